//! Displacement: p' = p + scale · h(uv) n, after which the normals are those of the displaced surface.
//!
//! The picture's detail resolves only as finely as the mesh: call [`TriangleMesh::subdivide_to_edge`] first,
//! with the length of a texel on the surface or more. Vertices at the same place move together, by the mean of
//! their heights along the normalised mean of their normals, so that texture seams and hard edges do not open.

use glam::{Vec2, Vec3};

use super::TriangleMesh;
use super::normals::angle_weighted_normals;

/// Vertices at one place are shaded smoothly across each other if their normals were within this angle
/// before; beyond it the edge was meant to be hard. 30° is what modelling programs offer as their default.
const HARD_EDGE_COSINE: f32 = 0.866;

impl TriangleMesh {
    /// Moves each vertex along its normal by `scale` (metres) times the height at its texture coordinates;
    /// heights that are not finite count as 0. Without texture coordinates nothing moves. Without normals the
    /// smooth ones are used. Normals (and tangents, if there are any) are computed anew.
    ///
    /// ```
    /// # use glam::{Vec2, Vec3};
    /// # use halflight_shape::TriangleMesh;
    /// let mut square = TriangleMesh {
    ///     positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
    ///     uvs: vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::X, Vec2::ZERO],
    ///     triangles: vec![[0, 1, 2], [0, 2, 3]],
    ///     ..TriangleMesh::default()
    /// };
    /// square.subdivide_to_edge(0.1, 10_000)?;
    /// square.displace(|uv| (std::f32::consts::TAU * uv.x).sin(), 0.05);
    /// assert!(square.surface_area() > 1.01);
    /// # Ok::<(), halflight_shape::MeshError>(())
    /// ```
    pub fn displace(&mut self, heights: impl Fn(Vec2) -> f32, scale: f32) {
        if self.uvs.len() != self.positions.len() {
            return;
        }
        if self.normals.len() != self.positions.len() {
            self.compute_smooth_normals();
        }
        let places = self.places();
        let mut sums = vec![(Vec3::ZERO, 0f32, 0f32); self.positions.len()];
        for (i, &place) in places.iter().enumerate() {
            let height = heights(self.uvs[i]);
            let (normal, total, count) = &mut sums[place as usize];
            *normal += self.normals[i];
            *total += if height.is_finite() { height } else { 0.0 };
            *count += 1.0;
        }
        for (i, &place) in places.iter().enumerate() {
            let (normal, total, count) = sums[place as usize];
            let direction = normal.try_normalize().unwrap_or(self.normals[place as usize]);
            self.positions[i] += scale * (total / count) * direction;
        }
        self.normals = self.normals_with_hard_edges(&places);
        if !self.tangents.is_empty() {
            self.compute_tangents();
        }
    }

    /// Angle-weighted normals of the present positions, smooth across vertices of one place whose present
    /// normals are close.
    fn normals_with_hard_edges(&self, places: &[u32]) -> Vec<Vec3> {
        let mut own = vec![Vec3::ZERO; self.positions.len()];
        for (triangle, indices) in self.triangles.iter().enumerate() {
            for (vertex, normal) in indices.iter().zip(angle_weighted_normals(self.corners(triangle))) {
                own[*vertex as usize] += normal;
            }
        }
        // The vertices of a place in a row, so that each can look at its neighbours.
        let mut order: Vec<u32> = (0..places.len() as u32).collect();
        order.sort_unstable_by_key(|&vertex| (places[vertex as usize], vertex));
        let mut normals = self.normals.clone();
        for place in order.chunk_by(|a, b| places[*a as usize] == places[*b as usize]) {
            for &vertex in place {
                let before = self.normals[vertex as usize];
                let close =
                    place.iter().filter(|&&w| self.normals[w as usize].dot(before) >= HARD_EDGE_COSINE);
                let sum: Vec3 = close.map(|&w| own[w as usize]).sum();
                normals[vertex as usize] = sum.try_normalize().unwrap_or(before);
            }
        }
        normals
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{grid, octahedron};
    use super::super::subdivide::tests::open_edges;
    use super::*;

    #[test]
    fn a_wave_on_a_square_has_the_height_and_the_normals_of_the_wave() {
        let mut mesh = grid(64);
        mesh.compute_tangents();
        let wave = |uv: Vec2| (3.0 * uv.x).sin();
        mesh.displace(wave, 0.1);
        for (i, uv) in mesh.uvs.iter().enumerate() {
            assert!((mesh.positions[i].z - 0.1 * wave(*uv)).abs() < 1e-6);
            let exact = Vec3::new(-0.3 * (3.0 * uv.x).cos(), 0.0, 1.0).normalize();
            // Vertices on the border see one side of the wave only.
            let tolerance = if uv.x == 0.0 || uv.x == 1.0 { 2e-2 } else { 2e-3 };
            assert!((mesh.normals[i] - exact).length() < tolerance, "{uv}");
        }
        assert_eq!(mesh.validate().expect("usable"), Default::default());
    }

    #[test]
    fn seams_and_hard_edges_do_not_open() {
        let mut mesh = octahedron().faceted();
        // Each triangle has texture coordinates of its own, so that heights differ across every edge.
        mesh.uvs = (0..24).map(|i| Vec2::new(i as f32, (i * i) as f32)).collect();
        mesh.subdivide_to_edge(0.2, 100_000).expect("fits");
        mesh.displace(|uv| (uv.x * 7.0).sin() + (uv.y * 3.0).cos(), 0.1);
        assert_eq!(open_edges(&mesh), 0);
        assert_eq!(mesh.validate().expect("usable").bad_normals, 0);
    }

    #[test]
    fn heights_that_are_not_finite_move_nothing() {
        let mut mesh = grid(2);
        let before = mesh.positions.clone();
        mesh.displace(|_| f32::NAN, 1.0);
        assert_eq!(mesh.positions, before);
    }
}
