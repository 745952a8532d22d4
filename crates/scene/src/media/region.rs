//! Where a medium is.

use glam::Vec3;

/// The part of space that a medium fills; convex, so that a ray is in it from one distance to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Region {
    /// Everywhere.
    Everywhere,
    /// A box along the axes.
    Box {
        /// Lower corner.
        low: Vec3,
        /// Upper corner.
        high: Vec3,
    },
    /// A ball.
    Sphere {
        /// Its middle.
        center: Vec3,
        /// Its radius.
        radius: f32,
    },
}

impl Region {
    /// From where to where a ray is inside, within 0 and `end`; `None` if it never is.
    #[inline]
    #[must_use]
    pub fn interval(&self, origin: Vec3, direction: Vec3, end: f32) -> Option<[f32; 2]> {
        let [enter, leave] = match *self {
            Self::Everywhere => [0.0, end],
            Self::Box { low, high } => {
                let inverse = direction.recip();
                let (mut enter, mut leave) = (0.0f32, end);
                for axis in 0..3 {
                    if direction[axis] == 0.0 {
                        if origin[axis] < low[axis] || origin[axis] > high[axis] {
                            return None;
                        }
                        continue;
                    }
                    let a = (low[axis] - origin[axis]) * inverse[axis];
                    let b = (high[axis] - origin[axis]) * inverse[axis];
                    (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
                }
                [enter, leave]
            }
            Self::Sphere { center, radius } => {
                let to = center - origin;
                let middle = to.dot(direction);
                // From the nearest point of the ray: no difference of large squares.
                let off = (to - middle * direction).length_squared();
                let half = radius * radius - off;
                if half <= 0.0 {
                    return None;
                }
                let half = half.sqrt();
                [(middle - half).max(0.0), (middle + half).min(end)]
            }
        };
        (leave > enter).then_some([enter, leave])
    }

    /// Lower and upper corner; without end for everywhere.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        match *self {
            Self::Everywhere => (Vec3::NEG_INFINITY, Vec3::INFINITY),
            Self::Box { low, high } => (low, high),
            Self::Sphere { center, radius } => (center - radius, center + radius),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_are_inside_from_where_they_enter_to_where_they_leave() {
        let cube = Region::Box { low: Vec3::ZERO, high: Vec3::ONE };
        let ball = Region::Sphere { center: Vec3::splat(0.5), radius: 0.5 };
        let from = Vec3::new(-1.0, 0.5, 0.5);
        assert_eq!(cube.interval(from, Vec3::X, f32::INFINITY), Some([1.0, 2.0]));
        assert_eq!(ball.interval(from, Vec3::X, 1.5), Some([1.0, 1.5]));
        assert_eq!(cube.interval(from, Vec3::Y, f32::INFINITY), None);
        assert_eq!(cube.interval(from, Vec3::NEG_X, f32::INFINITY), None);
        assert_eq!(ball.interval(from, Vec3::X, 0.5), None);
        assert_eq!(cube.interval(Vec3::splat(0.5), Vec3::Z, 9.0), Some([0.0, 0.5]));
        assert_eq!(Region::Everywhere.interval(from, Vec3::X, 3.0), Some([0.0, 3.0]));
    }
}
