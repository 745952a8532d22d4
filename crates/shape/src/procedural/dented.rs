//! Ground that a ball has pressed in, and that stays so: y = min(base(x, z), underside of the ball at any time so far).
//!
//! The ball goes in straight lines between the points of its path. Its underside at p is c_y − √(r² − |p − c|²) where
//! the ball is above p; the least over the way is taken over steps of r/16, between which it differs by at
//! most r/2048. Cost: a step touches the posts below the ball.

use std::sync::Arc;

use glam::Vec3;

use super::{Grid, ProceduralHeight, require, require_finite, require_positive};
use crate::HeightFieldError;

/// More places of the ball than this are not looked at; a longer way is looked at in longer steps.
const MOST_STEPS: f64 = 4096.0;
/// Steps along the way in one radius.
const STEPS_A_RADIUS: f64 = 16.0;

/// Ground with the dents of a ball.
#[derive(Clone, Debug)]
pub struct DentedGround {
    /// Radius of the ball, in metres.
    pub radius: f32,
    /// Where the middle of the ball is at rising times in seconds. Before the first it presses nothing, after the
    /// last it stays there.
    pub path: Vec<(f32, Vec3)>,
    /// The ground before.
    pub base: Arc<ProceduralHeight>,
}

impl DentedGround {
    pub(super) fn validate(&self) -> Result<(), HeightFieldError> {
        require_positive("radius", self.radius)?;
        for (time, place) in &self.path {
            require_finite("time of the path", *time)?;
            require_finite("point of the path", place.x + place.y + place.z)?;
        }
        for pair in self.path.windows(2) {
            let (before, after) = (f64::from(pair[0].0), f64::from(pair[1].0));
            require("time of the path", after, "later than the one before", after > before)?;
        }
        self.base.validate()
    }

    pub(super) fn fill(&self, grid: &Grid, time_seconds: f64, heights: &mut [f32]) {
        self.base.fill(grid, time_seconds, heights);
        let places = self.places(time_seconds);
        let square = self.radius * self.radius;
        let step = (grid.x(1) - grid.x(0)) as f32;
        let columns: Vec<f32> = (0..grid.columns).map(|column| grid.x(column) as f32).collect();
        grid.rows_mut(heights, |_, z, line| {
            for place in &places {
                let across = z as f32 - place.z;
                let half = square - across * across;
                if half <= 0.0 {
                    continue;
                }
                let column = |x: f32| ((x - grid.min.x) / step).clamp(0.0, grid.columns as f32) as usize;
                let reach = half.sqrt();
                let near = column(place.x - reach)..column(place.x + reach + step).min(grid.columns);
                for (height, x) in line[near.clone()].iter_mut().zip(&columns[near]) {
                    let along = x - place.x;
                    let below = half - along * along;
                    let underside = place.y - below.max(0.0).sqrt();
                    *height = if below > 0.0 && underside < *height { underside } else { *height };
                }
            }
        });
    }

    /// Where the ball has been until a time, in small steps.
    fn places(&self, time_seconds: f64) -> Vec<Vec3> {
        let Some(&(start, first)) = self.path.first() else { return Vec::new() };
        if time_seconds < f64::from(start) {
            return Vec::new();
        }
        let length: f64 = self.path.windows(2).map(|pair| f64::from(pair[0].1.distance(pair[1].1))).sum();
        let step = (f64::from(self.radius) / STEPS_A_RADIUS).max(length / MOST_STEPS);
        let mut places = vec![first];
        for pair in self.path.windows(2) {
            let ((from, a), (to, b)) = (pair[0], pair[1]);
            let part = ((time_seconds - f64::from(from)) / f64::from(to - from)).min(1.0);
            if part <= 0.0 {
                break;
            }
            let steps = (f64::from(a.distance(b)) / step).ceil().max(1.0);
            let places_here = (1..=steps as usize).map(|i| (i as f64 / steps).min(part));
            let mut last = 0.0;
            for t in places_here {
                if t > last {
                    places.push(a.lerp(b, t as f32));
                    last = t;
                }
            }
        }
        places
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    fn ground() -> ProceduralHeight {
        let path = vec![(0.0, Vec3::new(-2.0, 0.8, 0.0)), (2.0, Vec3::new(2.0, 0.8, 0.0))];
        let base = Arc::new(ProceduralHeight::Flat(0.0));
        ProceduralHeight::Dented(DentedGround { radius: 1.0, path, base })
    }

    #[test]
    fn a_ball_leaves_a_furrow_as_far_as_it_has_come() {
        let at = |time| ground().evaluate(81, 81, Vec2::splat(-4.0), Vec2::splat(4.0), time).unwrap();
        let half = at(1.0);
        assert!(
            (half.height_at(-1.0, 0.0) + 0.2).abs() < 2e-3 && (half.height_at(0.0, 0.0) + 0.2).abs() < 2e-3
        );
        assert_eq!(half.height_at(1.0, 0.0), 0.0);
        assert_eq!(half.height_at(-1.0, 0.7), 0.0);
        let whole = at(9.0);
        assert!(
            (whole.height_at(1.0, 0.0) + 0.2).abs() < 2e-3 && (whole.height_at(-1.0, 0.0) + 0.2).abs() < 2e-3
        );
        assert!(at(-1.0).heights.iter().all(|&h| h == 0.0));
    }

    #[test]
    fn a_path_that_goes_back_in_time_or_out_of_numbers_is_refused() {
        let dented = |path| DentedGround { radius: 1.0, path, base: Arc::new(ProceduralHeight::Flat(0.0)) };
        assert!(dented(vec![(1.0, Vec3::ZERO), (1.0, Vec3::X)]).validate().is_err());
        assert!(dented(vec![(1.0, Vec3::NAN)]).validate().is_err());
        assert!(dented(Vec::new()).validate().is_ok());
        let far = dented(vec![(0.0, Vec3::ZERO), (1.0, Vec3::X * 1e14)]);
        assert!(far.places(1.0).len() < 5000);
    }
}
