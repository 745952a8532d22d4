//! Geometry from formulas: height fields that are functions of time, and meshes.

mod bump;
mod dented;
mod fractal;
pub mod mesh;
mod noise;
mod ocean;
mod sines;

use std::sync::Arc;

use glam::Vec2;
use rayon::prelude::*;

use crate::height_field::{HeightField, HeightFieldError};

pub use bump::{BumpPath, MovingBump};
pub use dented::DentedGround;
pub use fractal::FractalTerrain;
pub use ocean::{Ocean, OceanSettings, OceanSpectrum};
pub use sines::{SineTerm, SumOfSines};

/// A height field as a function of time.
///
/// ```
/// use glam::Vec2;
/// use halflight_shape::procedural::{ProceduralHeight, SineTerm, SumOfSines};
/// let wave = SineTerm { amplitude: 0.2, kx: 3.0, kz: 0.0, phase: 0.0, angular_speed: 1.0 };
/// let height = ProceduralHeight::SumOfSines(SumOfSines { terms: vec![wave] });
/// let field = height.evaluate(64, 64, Vec2::splat(-1.0), Vec2::splat(1.0), 0.5)?;
/// assert_eq!(field.heights.len(), 64 * 64);
/// # Ok::<(), halflight_shape::HeightFieldError>(())
/// ```
#[derive(Clone, Debug)]
pub enum ProceduralHeight {
    /// The same height everywhere, in metres.
    Flat(f32),
    /// Plane waves.
    SumOfSines(SumOfSines),
    /// Mountains.
    FractalTerrain(FractalTerrain),
    /// Wind waves. Prepared once, shared by every instant.
    Ocean(Arc<Ocean>),
    /// A hill that travels.
    MovingBump(MovingBump),
    /// Ground that a ball presses in.
    Dented(DentedGround),
}

impl ProceduralHeight {
    /// The heights at `columns × rows` posts from `min` to `max` (x and z) at a time in seconds. In parallel;
    /// the result does not depend on the number of threads.
    ///
    /// # Errors
    /// If the grid is impossible (see [`HeightField::new`]) or a parameter of the formula is.
    pub fn evaluate(
        &self,
        columns: usize,
        rows: usize,
        min: Vec2,
        max: Vec2,
        time_seconds: f64,
    ) -> Result<HeightField, HeightFieldError> {
        let posts = columns.checked_mul(rows).filter(|&posts| posts <= i32::MAX as usize);
        let Some(posts) = posts.filter(|_| columns >= 2 && rows >= 2) else {
            return Err(HeightFieldError::Posts { columns, rows });
        };
        if !(min.is_finite() && max.is_finite() && min.cmplt(max).all()) {
            return Err(HeightFieldError::Extent { min, max });
        }
        require("time", time_seconds, "finite", time_seconds.is_finite())?;
        self.validate()?;
        let grid = Grid { columns, rows, min, max };
        let mut heights = vec![0.0; posts];
        self.fill(&grid, time_seconds, &mut heights);
        HeightField::new(columns, rows, min, max, heights)
    }

    /// Whether the heights depend on time.
    pub fn is_animated(&self) -> bool {
        match self {
            Self::Flat(_) | Self::FractalTerrain(_) => false,
            Self::SumOfSines(sines) => sines.terms.iter().any(|term| term.angular_speed != 0.0),
            Self::Ocean(_) | Self::MovingBump(_) | Self::Dented(_) => true,
        }
    }

    /// Checks the parameters: finite, positive where they must be.
    ///
    /// # Errors
    /// The first parameter that is impossible.
    pub fn validate(&self) -> Result<(), HeightFieldError> {
        match self {
            Self::Flat(height) => require("height", f64::from(*height), "finite", height.is_finite()),
            Self::SumOfSines(sines) => sines.validate(),
            Self::FractalTerrain(terrain) => terrain.validate(),
            Self::Ocean(_) => Ok(()),
            Self::MovingBump(bump) => bump.validate(),
            Self::Dented(ground) => ground.validate(),
        }
    }

    fn fill(&self, grid: &Grid, time_seconds: f64, heights: &mut [f32]) {
        match self {
            Self::Flat(height) => heights.fill(*height),
            Self::SumOfSines(sines) => sines.fill(grid, time_seconds, heights),
            Self::FractalTerrain(terrain) => terrain.fill(grid, heights),
            Self::Ocean(ocean) => ocean.fill(grid, time_seconds, heights),
            Self::MovingBump(bump) => bump.fill(grid, time_seconds, heights),
            Self::Dented(ground) => ground.fill(grid, time_seconds, heights),
        }
    }
}

/// Where the posts stand, for the formulas.
struct Grid {
    columns: usize,
    rows: usize,
    min: Vec2,
    max: Vec2,
}

impl Grid {
    fn x(&self, column: usize) -> f64 {
        let (low, high) = (f64::from(self.min.x), f64::from(self.max.x));
        low + (high - low) * column as f64 / (self.columns - 1) as f64
    }

    fn z(&self, row: usize) -> f64 {
        let (low, high) = (f64::from(self.min.y), f64::from(self.max.y));
        low + (high - low) * row as f64 / (self.rows - 1) as f64
    }

    /// Calls `f(row, z, heights of the row)` for every row, in parallel.
    fn rows_mut(&self, heights: &mut [f32], f: impl Fn(usize, f64, &mut [f32]) + Sync) {
        heights.par_chunks_mut(self.columns).enumerate().for_each(|(row, line)| f(row, self.z(row), line));
    }
}

fn require(
    parameter: &'static str,
    found: f64,
    expected: &'static str,
    holds: bool,
) -> Result<(), HeightFieldError> {
    if holds { Ok(()) } else { Err(HeightFieldError::Parameter { parameter, found, expected }) }
}

fn require_finite(parameter: &'static str, found: f32) -> Result<(), HeightFieldError> {
    require(parameter, f64::from(found), "finite", found.is_finite())
}

fn require_positive(parameter: &'static str, found: f32) -> Result<(), HeightFieldError> {
    require(parameter, f64::from(found), "positive and finite", found > 0.0 && found.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_grids_and_parameters_are_errors_not_panics() {
        let flat = ProceduralHeight::Flat(1.0);
        assert!(flat.evaluate(1, 2, Vec2::ZERO, Vec2::ONE, 0.0).is_err());
        assert!(flat.evaluate(usize::MAX, usize::MAX, Vec2::ZERO, Vec2::ONE, 0.0).is_err());
        assert!(flat.evaluate(2, 2, Vec2::ONE, Vec2::ZERO, 0.0).is_err());
        assert!(flat.evaluate(2, 2, Vec2::ZERO, Vec2::ONE, f64::NAN).is_err());
        assert!(ProceduralHeight::Flat(f32::INFINITY).evaluate(2, 2, Vec2::ZERO, Vec2::ONE, 0.0).is_err());
        let error = FractalTerrain { wavelength: -1.0, ..FractalTerrain::default() };
        let error = ProceduralHeight::FractalTerrain(error).validate().unwrap_err();
        assert_eq!(error.to_string(), "wavelength is -1, which is not positive and finite");
    }
}
