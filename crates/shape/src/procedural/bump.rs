//! A Gaussian hill that travels over a base: y = base(x, z, t) + height · exp(−|p − c(t)|² / 2σ²).

use std::sync::Arc;

use glam::{DVec2, Vec2};

use super::{Grid, ProceduralHeight, require, require_finite, require_positive};
use crate::HeightFieldError;

/// Where the middle of a [`MovingBump`] is.
#[derive(Clone, Debug, PartialEq)]
pub enum BumpPath {
    /// Once around a circle in `period_seconds` (negative turns the other way), from +x of the centre towards +z.
    Circle {
        /// The middle of the circle in x and z, in metres.
        center: Vec2,
        /// Its radius, in metres.
        radius: f32,
        /// Seconds for one turn; not 0.
        period_seconds: f32,
    },
    /// Along straight lines at a constant speed and back to the first point; a single point stands still.
    Polyline {
        /// The corners in x and z, at least one.
        points: Vec<Vec2>,
        /// Metres per second.
        speed: f32,
    },
}

impl BumpPath {
    /// The place at a time.
    pub fn position(&self, time_seconds: f64) -> Vec2 {
        match self {
            Self::Circle { center, radius, period_seconds } => {
                let angle = std::f64::consts::TAU * (time_seconds / f64::from(*period_seconds)).fract();
                *center + *radius * DVec2::from_angle(angle).as_vec2()
            }
            Self::Polyline { points, speed } => {
                let next = |i: usize| points[(i + 1) % points.len()];
                let lengths = points.iter().enumerate().map(|(i, p)| f64::from(p.distance(next(i))));
                let length: f64 = lengths.clone().sum();
                if length <= 0.0 {
                    return points.first().copied().unwrap_or_default();
                }
                let mut left = (f64::from(*speed) * time_seconds).rem_euclid(length);
                for (i, piece) in lengths.enumerate() {
                    if left <= piece && piece > 0.0 {
                        return points[i].lerp(next(i), (left / piece) as f32);
                    }
                    left -= piece;
                }
                points[0]
            }
        }
    }
}

/// A hill that travels.
#[derive(Clone, Debug)]
pub struct MovingBump {
    /// Height of the hill, in metres; negative for a hollow.
    pub height: f32,
    /// Standard deviation of the Gaussian, in metres.
    pub sigma: f32,
    /// Where it goes.
    pub path: BumpPath,
    /// What it travels over.
    pub base: Arc<ProceduralHeight>,
}

impl MovingBump {
    pub(super) fn validate(&self) -> Result<(), HeightFieldError> {
        require_finite("height", self.height)?;
        require_positive("sigma", self.sigma)?;
        match &self.path {
            BumpPath::Circle { center, radius, period_seconds } => {
                require_finite("centre of the circle", center.x + center.y)?;
                require_finite("radius", *radius)?;
                let period = f64::from(*period_seconds);
                require(
                    "period_seconds",
                    period,
                    "finite and other than 0",
                    period.is_finite() && period != 0.0,
                )?;
            }
            BumpPath::Polyline { points, speed } => {
                require("number of points", points.len() as f64, "at least 1", !points.is_empty())?;
                for point in points {
                    require_finite("point of the path", point.x + point.y)?;
                }
                require_finite("speed", *speed)?;
            }
        }
        self.base.validate()
    }

    pub(super) fn fill(&self, grid: &Grid, time_seconds: f64, heights: &mut [f32]) {
        self.base.fill(grid, time_seconds, heights);
        let center = self.path.position(time_seconds).as_dvec2();
        // exp(−(dx² + dz²)/2σ²) is a product: one exponential a column and one a row.
        let gauss = |d: f64| (-0.5 * (d / f64::from(self.sigma)).powi(2)).exp() as f32;
        let columns: Vec<f32> = (0..grid.columns).map(|column| gauss(grid.x(column) - center.x)).collect();
        grid.rows_mut(heights, |_, z, line| {
            let across = self.height * gauss(z - center.y);
            for (height, along) in line.iter_mut().zip(&columns) {
                *height += across * along;
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hill_is_highest_where_the_path_says() {
        let path = BumpPath::Circle { center: Vec2::ZERO, radius: 2.0, period_seconds: 4.0 };
        let base = Arc::new(ProceduralHeight::Flat(0.5));
        let bump = ProceduralHeight::MovingBump(MovingBump { height: 1.0, sigma: 0.5, path, base });
        let field = bump.evaluate(81, 81, Vec2::splat(-4.0), Vec2::splat(4.0), 1.0).unwrap();
        assert!((field.height_at(0.0, 2.0) - 1.5).abs() < 1e-4);
        assert!((field.height_at(2.0, 0.0) - 0.5).abs() < 1e-3);
    }

    #[test]
    fn a_polyline_is_walked_at_constant_speed_and_closed() {
        let corner = |x, z| Vec2::new(x, z);
        let points = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
        let path = BumpPath::Polyline { points, speed: 2.0 };
        assert_eq!(path.position(0.25), corner(0.5, 0.0));
        assert_eq!(path.position(0.75), corner(1.0, 0.5));
        assert_eq!(path.position(2.25), corner(0.5, 0.0));
        let still = BumpPath::Polyline { points: vec![corner(3.0, 4.0)], speed: 2.0 };
        assert_eq!(still.position(7.0), corner(3.0, 4.0));
    }
}
