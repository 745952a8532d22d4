//! A sum of plane waves: y = Σ a sin(kx x + kz z + phase + angular_speed · t).
//!
//! Evaluated as sin(kx x) cos(b) + cos(kx x) sin(b) with b = kz z + phase + angular_speed · t, so that a post
//! costs two multiplications a term and no sine; in f64 throughout.

use super::{Grid, require, require_finite};
use crate::HeightFieldError;

/// One plane wave of a [`SumOfSines`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SineTerm {
    /// Half the height from trough to crest, in metres.
    pub amplitude: f32,
    /// Angular frequency along x, in radians per metre.
    pub kx: f32,
    /// Angular frequency along z, in radians per metre.
    pub kz: f32,
    /// Phase at x = z = t = 0, in radians.
    pub phase: f32,
    /// Growth of the phase, in radians per second; 0 for a wave that stands still.
    pub angular_speed: f32,
}

/// A sum of plane waves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SumOfSines {
    /// The waves.
    pub terms: Vec<SineTerm>,
}

impl SumOfSines {
    /// The height at one place and time.
    pub fn height(&self, x: f64, z: f64, time_seconds: f64) -> f64 {
        let wave = |term: &SineTerm| {
            let angle = f64::from(term.kx) * x + f64::from(term.kz) * z + f64::from(term.phase);
            f64::from(term.amplitude) * (angle + f64::from(term.angular_speed) * time_seconds).sin()
        };
        self.terms.iter().map(wave).sum()
    }

    pub(super) fn validate(&self) -> Result<(), HeightFieldError> {
        for term in &self.terms {
            require_finite("amplitude", term.amplitude)?;
            require_finite("kx", term.kx)?;
            require_finite("kz", term.kz)?;
            require_finite("phase", term.phase)?;
            require_finite("angular_speed", term.angular_speed)?;
        }
        let count = self.terms.len();
        require("number of terms", count as f64, "at most 4096", count <= 4096)
    }

    pub(super) fn fill(&self, grid: &Grid, time_seconds: f64, heights: &mut [f32]) {
        let columns: Vec<f64> = (0..grid.columns).map(|column| grid.x(column)).collect();
        let waves: Vec<Vec<(f64, f64)>> = self
            .terms
            .iter()
            .map(|term| columns.iter().map(|x| (f64::from(term.kx) * x).sin_cos()).collect())
            .collect();
        grid.rows_mut(heights, |_, z, line| {
            let mut sums = vec![0.0f64; line.len()];
            for (term, wave) in self.terms.iter().zip(&waves) {
                let angle = f64::from(term.kz) * z
                    + f64::from(term.phase)
                    + f64::from(term.angular_speed) * time_seconds;
                let (sin, cos) = angle.sin_cos();
                let (sin, cos) = (f64::from(term.amplitude) * sin, f64::from(term.amplitude) * cos);
                for (sum, (sin_x, cos_x)) in sums.iter_mut().zip(wave) {
                    *sum += sin_x * cos + cos_x * sin;
                }
            }
            for (height, sum) in line.iter_mut().zip(sums) {
                *height = sum as f32;
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::procedural::ProceduralHeight;

    #[test]
    fn the_fast_evaluation_is_the_formula() {
        let term =
            |amplitude, kx, kz, phase, angular_speed| SineTerm { amplitude, kx, kz, phase, angular_speed };
        let sines = SumOfSines {
            terms: vec![
                term(0.35, 0.55, 0.3, 0.3, 0.0),
                term(0.28, -0.4, 0.75, 1.1, 2.0),
                term(0.01, 11.3, -9.7, 1.9, -1.0),
            ],
        };
        let height = ProceduralHeight::SumOfSines(sines.clone());
        let field = height.evaluate(33, 17, Vec2::splat(-6.0), Vec2::splat(6.0), 1.7).unwrap();
        for row in 0..17 {
            for column in 0..33 {
                let (x, z) = (-6.0 + 12.0 * column as f64 / 32.0, -6.0 + 12.0 * row as f64 / 16.0);
                let found = f64::from(field.heights[row * 33 + column]);
                assert!((found - sines.height(x, z, 1.7)).abs() < 1e-6);
            }
        }
    }
}
