//! Finding a view from which all of a scene is seen.

use glam::Vec3;

use crate::camera::{Camera, FieldOfView};

/// Points that a view should hold.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outline {
    points: Vec<Vec3>,
    low: Vec3,
    high: Vec3,
}

impl Outline {
    pub(crate) fn new(points: Vec<Vec3>) -> Self {
        let Some(&first) = points.first() else { return Self::default() };
        let (low, high) = points.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p)));
        Self { points, low, high }
    }

    /// Lower and upper corner; both zero if there are no points.
    pub(crate) fn bounds(&self) -> (Vec3, Vec3) {
        (self.low, self.high)
    }

    pub(crate) fn center(&self) -> Vec3 {
        // Halved first: the sum of two large numbers may not be one.
        0.5 * self.low + 0.5 * self.high
    }

    /// Half the diagonal; 1 if there is nothing or only a point.
    pub(crate) fn radius(&self) -> f32 {
        let radius = (0.5 * self.high - 0.5 * self.low).length();
        if radius > 0.0 && radius.is_finite() { radius } else { 1.0 }
    }
}

/// Where the camera stands, seen from what it looks at: a little to the right and above.
const AZIMUTH_DEGREES: f32 = 28.0;
const ELEVATION_DEGREES: f32 = 16.0;

/// How much of the half picture the outline may fill.
const FILL: f32 = 0.84;

/// Origin and target of a camera that looks at the middle of the outline (or at `target`) from the usual side and holds
/// all of it. Depends on nothing but proportions: a scene a thousand times as large is framed the same.
pub(crate) fn frame(outline: &Outline, lens: FieldOfView, aspect: f32, target: Option<Vec3>) -> (Vec3, Vec3) {
    let (azimuth, elevation) = (AZIMUTH_DEGREES.to_radians(), ELEVATION_DEGREES.to_radians());
    let towards_eye =
        Vec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos());
    frame_from(outline, lens, aspect, target, towards_eye)
}

/// [`frame`] from any side.
pub(crate) fn frame_from(
    outline: &Outline,
    lens: FieldOfView,
    aspect: f32,
    target: Option<Vec3>,
    towards_eye: Vec3,
) -> (Vec3, Vec3) {
    let (tan_x, tan_y) = match lens {
        FieldOfView::Vertical(angle) => ((0.5 * angle).tan() * aspect, (0.5 * angle).tan()),
        FieldOfView::Horizontal(angle) => ((0.5 * angle).tan(), (0.5 * angle).tan() / aspect),
    };
    let pose = Camera::look_at(towards_eye, Vec3::ZERO, Vec3::Y);
    let (right, up) = (Vec3::from(pose.matrix3.x_axis), Vec3::from(pose.matrix3.y_axis));
    let center = target.unwrap_or_else(|| outline.center());
    let radius = outline.radius();
    // With the target free, the middle of what is seen comes to the middle of the picture in a few steps.
    let mut target = center;
    let mut distance = radius;
    for _ in 0..4 {
        let local = |p: &Vec3| {
            let q = *p - target;
            (q.dot(right), q.dot(up), q.dot(towards_eye))
        };
        let needed = outline.points.iter().map(|p| {
            let (x, y, z) = local(p);
            z + (x.abs() / (FILL * tan_x)).max(y.abs() / (FILL * tan_y))
        });
        distance = needed.fold(0.1 * radius, f32::max);
        if center != outline.center() {
            break;
        }
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for p in &outline.points {
            let (x, y, z) = local(p);
            let depth = (distance - z).max(1e-3 * radius);
            for (k, seen) in [x / depth, y / depth].into_iter().enumerate() {
                (low[k], high[k]) = (low[k].min(seen), high[k].max(seen));
            }
        }
        if low[0].is_finite() {
            let shift = right * (low[0] + high[0]) + up * (low[1] + high[1]);
            target += 0.5 * distance * shift;
        }
    }
    (target + towards_eye * distance, target)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    fn seen(outline: &Outline, aspect: f32) -> Vec<Vec2> {
        let lens = FieldOfView::Vertical(0.6);
        let (origin, target) = frame(outline, lens, aspect, None);
        let pose = Camera::look_at(origin, target, Vec3::Y).inverse();
        let tan = 0.3f32.tan();
        let project = |p: &Vec3| {
            let q = pose.transform_point3(*p);
            Vec2::new(q.x / (-q.z * tan * aspect), q.y / (-q.z * tan))
        };
        outline.points.iter().map(project).collect()
    }

    #[test]
    fn everything_is_in_the_picture_and_fills_it_at_any_scale() {
        for scale in [1e-3, 1.0, 1e5] {
            for aspect in [0.5, 16.0 / 9.0] {
                let corner =
                    |i: usize| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32 * 3.0, (i >> 2) as f32 * 0.5);
                let outline = Outline::new((0..8).map(|i| scale * (corner(i) + Vec3::splat(7.0))).collect());
                let points = seen(&outline, aspect);
                let widest = points.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
                assert!(widest <= 0.9 && widest > 0.7, "{scale} {aspect}: {widest}");
            }
        }
    }

    #[test]
    fn nothing_and_a_single_point_are_framed_too() {
        for points in [vec![], vec![Vec3::splat(5.0)]] {
            let (origin, target) = frame(&Outline::new(points), FieldOfView::Vertical(0.6), 1.5, None);
            assert!(origin.is_finite() && origin.distance(target) > 0.0);
        }
    }
}
