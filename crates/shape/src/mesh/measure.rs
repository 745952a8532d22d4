//! How large a mesh is.

use glam::Vec3;

use super::TriangleMesh;

impl TriangleMesh {
    /// Least and greatest coordinates of the vertices that triangles use; `None` if there is no triangle.
    /// Vertices that no triangle uses (scans have many) do not count.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let first = self.positions[self.triangles.first()?[0] as usize];
        Some(self.triangles.iter().flatten().fold((first, first), |(low, high), &vertex| {
            let p = self.positions[vertex as usize];
            (low.min(p), high.max(p))
        }))
    }

    /// Sum of the areas of the triangles, in m²; summed in f64.
    pub fn surface_area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|triangle| {
                let [a, b, c] = self.corners(triangle).map(|p| p.as_dvec3());
                0.5 * (b - a).cross(c - a).length()
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{grid, octahedron};
    use super::*;

    #[test]
    fn the_octahedron_has_the_area_of_eight_equilateral_triangles() {
        // Edge √2: area √3/4 · 2 each.
        assert!((octahedron().surface_area() - 8.0 * 3f64.sqrt() / 2.0).abs() < 1e-6);
        assert!((grid(7).surface_area() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn bounds_ignore_vertices_that_no_triangle_uses() {
        let mut mesh = octahedron();
        mesh.positions.push(Vec3::splat(100.0));
        assert_eq!(mesh.bounds(), Some((Vec3::NEG_ONE, Vec3::ONE)));
        assert_eq!(TriangleMesh::default().bounds(), None);
    }
}
