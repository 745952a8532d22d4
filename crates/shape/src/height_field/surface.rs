//! The surface of a height field: where it is, which way it faces, and the same as triangles.
//!
//! Within a cell, with fx and fz the fractions along x and z, the lower-right triangle (fx ≥ fz) is
//! h₀₀ + fx (h₁₀ − h₀₀) + fz (h₁₁ − h₁₀) and the other h₀₀ + fz (h₀₁ − h₀₀) + fx (h₁₁ − h₀₁).
//! Normals at posts come from central differences, one-sided at the border.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::HeightField;
use crate::TriangleMesh;

impl HeightField {
    /// Cells along x and z.
    pub fn cells(&self) -> (usize, usize) {
        (self.columns - 1, self.rows - 1)
    }

    /// The size of a cell along x and z, in metres.
    pub fn spacing(&self) -> Vec2 {
        (self.max - self.min) / Vec2::new((self.columns - 1) as f32, (self.rows - 1) as f32)
    }

    /// The least and the greatest height.
    pub fn height_range(&self) -> (f32, f32) {
        const LANES: usize = 16;
        let none = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
        // Comparisons, not `f32::min`, which has more to say of NaN: there is none here.
        let wider = |(mut low, mut high): ([f32; LANES], [f32; LANES]),
                     (a, b): (&[f32; LANES], &[f32; LANES])| {
            for i in 0..LANES {
                low[i] = if a[i] < low[i] { a[i] } else { low[i] };
                high[i] = if b[i] > high[i] { b[i] } else { high[i] };
            }
            (low, high)
        };
        let of_piece = |heights: &[f32]| {
            let (lines, rest) = heights.as_chunks::<LANES>();
            let found = lines.iter().fold(none, |found, line| wider(found, (line, line)));
            rest.iter().fold(found, |found, &h| wider(found, (&[h; LANES], &[h; LANES])))
        };
        let pieces = self.heights.par_chunks(1 << 14).map(of_piece);
        let (low, high) = pieces.reduce(|| none, |a, b| wider(a, (&b.0, &b.1)));
        (low.into_iter().fold(f32::INFINITY, f32::min), high.into_iter().fold(f32::NEG_INFINITY, f32::max))
    }

    /// The corners of the box that holds the field.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let (low, high) = self.height_range();
        (Vec3::new(self.min.x, low, self.min.y), Vec3::new(self.max.x, high, self.max.y))
    }

    /// Where post (i, j) stands. The last post of an axis stands exactly at `max`.
    pub fn post(&self, column: usize, row: usize) -> Vec3 {
        let between = |low: f32, high: f32, at: usize, last: usize| {
            if at == last { high } else { low + (high - low) * (at as f32 / last as f32) }
        };
        let x = between(self.min.x, self.max.x, column, self.columns - 1);
        let z = between(self.min.y, self.max.y, row, self.rows - 1);
        Vec3::new(x, self.heights[row * self.columns + column], z)
    }

    /// The height of the surface at (x, z); outside the field, that of the nearest point on its border.
    pub fn height_at(&self, x: f32, z: f32) -> f32 {
        let (cells_x, cells_z) = self.cells();
        let at = (Vec2::new(x, z) - self.min) / (self.max - self.min);
        let at = at.clamp(Vec2::ZERO, Vec2::ONE) * Vec2::new(cells_x as f32, cells_z as f32);
        let (i, j) = ((at.x as usize).min(cells_x - 1), (at.y as usize).min(cells_z - 1));
        let (fx, fz) = (at.x - i as f32, at.y - j as f32);
        let post = j * self.columns + i;
        let (h00, h10) = (self.heights[post], self.heights[post + 1]);
        let (h01, h11) = (self.heights[post + self.columns], self.heights[post + self.columns + 1]);
        if fx >= fz {
            h00 + fx * (h10 - h00) + fz * (h11 - h10)
        } else {
            h00 + fz * (h01 - h00) + fx * (h11 - h01)
        }
    }

    /// The unit normal at post (i, j), from central differences.
    pub fn post_normal(&self, column: usize, row: usize) -> Vec3 {
        let spacing = self.spacing();
        let height = |i: usize, j: usize| self.heights[j * self.columns + i];
        let (left, right) = (column.saturating_sub(1), (column + 1).min(self.columns - 1));
        let (far, near) = (row.saturating_sub(1), (row + 1).min(self.rows - 1));
        let slope_x = (height(right, row) - height(left, row)) / ((right - left) as f32 * spacing.x);
        let slope_z = (height(column, near) - height(column, far)) / ((near - far) as f32 * spacing.y);
        // The slopes may be of any size: scale before normalising, so that squares stay finite.
        let normal = Vec3::new(-slope_x, 1.0, -slope_z);
        (normal / normal.abs().max_element()).normalize()
    }

    /// The same surface as triangles: 2 (j (columns − 1) + i) is the triangle of cell (i, j) at fx ≥ fz, the
    /// next one its other half. With normals at the posts if the field is smooth, and texture coordinates.
    pub fn to_mesh(&self) -> TriangleMesh {
        let (cells_x, cells_z) = self.cells();
        let posts = |f: &(dyn Fn(usize, usize) -> Vec3 + Sync)| -> Vec<Vec3> {
            (0..self.rows * self.columns)
                .into_par_iter()
                .map(|p| f(p % self.columns, p / self.columns))
                .collect()
        };
        let uv = |p: usize| {
            Vec2::new((p % self.columns) as f32 / cells_x as f32, (p / self.columns) as f32 / cells_z as f32)
        };
        let triangles = (0..cells_x * cells_z)
            .into_par_iter()
            .flat_map_iter(|cell| {
                let p00 = (cell / cells_x * self.columns + cell % cells_x) as u32;
                let (p10, p01) = (p00 + 1, p00 + self.columns as u32);
                [[p00, p01 + 1, p10], [p00, p01, p01 + 1]]
            })
            .collect();
        TriangleMesh {
            positions: posts(&|i, j| self.post(i, j)),
            triangles,
            normals: if self.smooth { posts(&|i, j| self.post_normal(i, j)) } else { Vec::new() },
            uvs: (0..self.rows * self.columns).into_par_iter().map(uv).collect(),
            ..TriangleMesh::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bumpy() -> HeightField {
        let heights = (0..7 * 5).map(|p| ((p * 37 % 11) as f32 * 0.7).sin()).collect();
        HeightField::new(7, 5, Vec2::new(-2.0, 1.0), Vec2::new(4.0, 3.0), heights).unwrap()
    }

    #[test]
    fn the_mesh_faces_up_and_its_triangles_lie_on_the_surface() {
        let field = bumpy();
        let mesh = field.to_mesh();
        assert_eq!(mesh.triangles.len(), 2 * 6 * 4);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
            assert!((b - a).cross(c - a).y > 0.0);
            let inside = a * 0.5 + b * 0.3 + c * 0.2;
            assert!((field.height_at(inside.x, inside.z) - inside.y).abs() < 1e-5);
        }
    }

    #[test]
    fn the_bounds_hold_every_post_and_the_corners_are_exact() {
        let field = bumpy();
        let (low, high) = field.bounds();
        for row in 0..5 {
            for column in 0..7 {
                let post = field.post(column, row);
                assert!(post.cmpge(low).all() && post.cmple(high).all());
            }
        }
        assert_eq!(field.post(6, 4).with_y(0.0), Vec3::new(4.0, 0.0, 3.0));
    }

    #[test]
    fn the_normals_of_a_plane_are_its_own_up_to_the_border() {
        let heights = (0..6 * 4).map(|p| 0.5 * (p % 6) as f32 - 0.25 * (p / 6) as f32).collect();
        let field = HeightField::new(6, 4, Vec2::ZERO, Vec2::new(5.0, 3.0), heights).unwrap();
        let expected = Vec3::new(-0.5, 1.0, 0.25).normalize();
        for p in 0..24 {
            assert!(field.post_normal(p % 6, p / 6).abs_diff_eq(expected, 1e-6));
        }
    }
}
