//! Heights over a regular grid, a form of geometry of its own.
//!
//! y = h(x, z). Post (i, j) stands at x = min.x + (max.x − min.x) i / (columns − 1),
//! z = min.y + (max.y − min.y) j / (rows − 1). A cell is two triangles split along (i, j)–(i+1, j+1); both
//! face up (+y). Texture coordinates run from 0 to 1 over the field, u with x and v with z, so that row 0 of
//! an image made into a field lies at the least z and a texture of the same layout fits it.
//!
//! ```
//! use glam::Vec2;
//! use halflight_shape::HeightField;
//! let field = HeightField::new(2, 2, Vec2::ZERO, Vec2::ONE, vec![0.0, 1.0, 0.0, 1.0])?;
//! assert_eq!(field.height_at(0.25, 0.5), 0.25);
//! # Ok::<(), halflight_shape::HeightFieldError>(())
//! ```

mod surface;

use glam::Vec2;
use halflight_image::Plane;
use rayon::prelude::*;

/// Heights y over a regular grid of posts in x and z. Post (i, j) stands at
/// x = min.x + (max.x − min.x) i / (columns − 1), z = min.y + (max.y − min.y) j / (rows − 1).
///
/// A cell is two triangles split along (i, j)–(i+1, j+1).
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    /// Posts along x, at least 2.
    pub columns: usize,
    /// Posts along z, at least 2.
    pub rows: usize,
    /// Least x and z, in metres.
    pub min: Vec2,
    /// Greatest x and z, in metres.
    pub max: Vec2,
    /// `columns * rows` finite heights in metres; post (i, j) is `heights[j * columns + i]`.
    pub heights: Vec<f32>,
    /// Shading normals interpolated between posts, instead of those of the triangles.
    pub smooth: bool,
}

/// Why numbers do not make a height field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HeightFieldError {
    /// Fewer than two posts along an axis, or more than can be numbered.
    #[error(
        "a height field of {columns} × {rows} posts (it needs at least 2 × 2, and cells that 31 bits can number)"
    )]
    Posts {
        /// Posts along x.
        columns: usize,
        /// Posts along z.
        rows: usize,
    },
    /// The number of heights is not that of the posts.
    #[error("{found} heights for {expected} posts")]
    Length {
        /// Heights given.
        found: usize,
        /// Columns times rows.
        expected: usize,
    },
    /// The extent is empty, reversed or not finite along x or z.
    #[error("the extent from {min} to {max} along x and z is empty, reversed or not finite")]
    Extent {
        /// Least x and z.
        min: Vec2,
        /// Greatest x and z.
        max: Vec2,
    },
    /// A height is NaN, infinite, or so great that differences of heights overflow.
    #[error("the height of post ({column}, {row}) is {height}")]
    Height {
        /// Index along x.
        column: usize,
        /// Index along z.
        row: usize,
        /// What was found.
        height: f32,
    },
    /// A parameter of a procedural height field is impossible.
    #[error("{parameter} is {found}, which is not {expected}")]
    Parameter {
        /// Its name.
        parameter: &'static str,
        /// What was found.
        found: f64,
        /// What it must be.
        expected: &'static str,
    },
}

/// Heights and extents beyond this (metres) are refused, so that products of two differences stay finite.
const GREATEST: f32 = 1e15;

impl HeightField {
    /// A smooth field, checked: at least 2 × 2 posts, a height for every post, all finite, an extent that is
    /// not empty.
    ///
    /// # Errors
    /// If any of these does not hold.
    pub fn new(
        columns: usize,
        rows: usize,
        min: Vec2,
        max: Vec2,
        heights: Vec<f32>,
    ) -> Result<Self, HeightFieldError> {
        let field = Self { columns, rows, min, max, heights, smooth: true };
        field.validate()?;
        Ok(field)
    }

    /// The image as a landscape: y = offset + scale · value. Row 0 of the image lies at the least z and column 0
    /// at the least x, so with z towards the viewer the image lies as on a table, its top away from the viewer.
    /// `scale` is in metres per unit of the image, `offset` in metres.
    ///
    /// # Errors
    /// As [`HeightField::new`].
    pub fn from_plane(
        plane: &Plane,
        min: Vec2,
        max: Vec2,
        scale: f32,
        offset: f32,
    ) -> Result<Self, HeightFieldError> {
        let heights = plane.values.par_iter().map(|&value| offset + scale * value).collect();
        Self::new(plane.width, plane.height, min, max, heights)
    }

    /// Checks what [`HeightField::new`] checks: for fields whose members were set by hand.
    ///
    /// # Errors
    /// The first thing found wrong.
    pub fn validate(&self) -> Result<(), HeightFieldError> {
        let Self { columns, rows, min, max, .. } = *self;
        let posts = columns.checked_mul(rows).filter(|&posts| posts <= i32::MAX as usize);
        let Some(expected) = posts.filter(|_| columns >= 2 && rows >= 2) else {
            return Err(HeightFieldError::Posts { columns, rows });
        };
        if self.heights.len() != expected {
            return Err(HeightFieldError::Length { found: self.heights.len(), expected });
        }
        let in_range = min.abs().max_element() <= GREATEST && max.abs().max_element() <= GREATEST;
        // Posts must differ in position after rounding, or cells would be degenerate.
        let distinct = |low: f32, high: f32, posts: usize| {
            let step = (high - low) / (posts - 1) as f32;
            low < high && step > 2.0 * f32::EPSILON * low.abs().max(high.abs()) && step >= f32::MIN_POSITIVE
        };
        let posts_apart = distinct(min.x, max.x, columns) && distinct(min.y, max.y, rows);
        if !(min.is_finite() && max.is_finite() && in_range && posts_apart) {
            return Err(HeightFieldError::Extent { min, max });
        }
        // All of a piece are counted, which vectors do faster than one of them looks for the first.
        const PIECE: usize = 1 << 14;
        let bad = |h: &f32| !h.is_finite() || h.abs() > GREATEST;
        let bad_of = |piece: &[f32]| piece.iter().map(|h| u32::from(bad(h))).sum::<u32>();
        if let Some(piece) = self.heights.par_chunks(PIECE).position_first(|piece| bad_of(piece) > 0) {
            let at = piece * PIECE + self.heights[piece * PIECE..].iter().position(bad).unwrap_or(0);
            let height = self.heights[at];
            return Err(HeightFieldError::Height { column: at % columns, row: at / columns, height });
        }
        Ok(())
    }

    /// The same field with flat shading (`false`) or normals interpolated between posts (`true`).
    #[must_use]
    pub fn with_smooth(mut self, smooth: bool) -> Self {
        self.smooth = smooth;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_fields_are_refused_with_a_reason() {
        let (a, b) = (Vec2::ZERO, Vec2::ONE);
        assert!(matches!(HeightField::new(1, 5, a, b, vec![0.0; 5]), Err(HeightFieldError::Posts { .. })));
        assert!(matches!(HeightField::new(usize::MAX, 3, a, b, vec![]), Err(HeightFieldError::Posts { .. })));
        assert!(matches!(HeightField::new(2, 2, a, b, vec![0.0; 3]), Err(HeightFieldError::Length { .. })));
        assert!(matches!(HeightField::new(2, 2, b, a, vec![0.0; 4]), Err(HeightFieldError::Extent { .. })));
        assert!(matches!(
            HeightField::new(2, 2, a, Vec2::new(f32::NAN, 1.0), vec![0.0; 4]),
            Err(HeightFieldError::Extent { .. })
        ));
        let error = HeightField::new(3, 2, a, b, vec![0.0, 0.0, 0.0, 0.0, f32::NAN, 0.0]).unwrap_err();
        assert_eq!(error.to_string(), "the height of post (1, 1) is NaN");
    }

    #[test]
    fn the_top_row_of_an_image_lies_at_the_least_z() {
        let plane = Plane { width: 2, height: 3, values: vec![1.0, 2.0, 0.0, 0.0, 0.0, 0.0] };
        let field = HeightField::from_plane(&plane, Vec2::splat(-1.0), Vec2::ONE, 10.0, 5.0).unwrap();
        assert_eq!(field.height_at(-1.0, -1.0), 15.0);
        assert_eq!(field.height_at(1.0, -1.0), 25.0);
        assert_eq!(field.height_at(1.0, 1.0), 5.0);
    }
}
