//! Normals from positions.
//!
//! Vertex normal = Σ θ_t n_t, normalised, over the triangles t around the vertex, with n_t the unit normal of
//! the triangle and θ_t its angle at the vertex (Thürmer and Wüthrich 1998, "Computing vertex normals from
//! polygonal facets"). Weighting by angle makes the result independent of how flat polygons were cut into
//! triangles. Vertices at the same place count as one, so that texture seams do not show in the shading.

use glam::Vec3;

use super::TriangleMesh;

impl TriangleMesh {
    /// Replaces the normals by smooth ones. A vertex whose triangles cancel out, or that has none, gets +y.
    pub fn compute_smooth_normals(&mut self) {
        self.normals = self.smooth_normals();
    }

    /// The same surface with three vertices of its own for each triangle, whose normals are the triangle's:
    /// flat shading said explicitly. A triangle without area gets +y.
    #[must_use]
    pub fn faceted(&self) -> Self {
        let corners = || self.triangles.iter().flatten().map(|&vertex| vertex as usize);
        let normals = (0..self.triangles.len()).flat_map(|t| {
            let [a, b, c] = self.corners(t);
            [unit_normal(a, b, c).unwrap_or(Vec3::Y); 3]
        });
        Self {
            positions: corners().map(|v| self.positions[v]).collect(),
            triangles: (0..self.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            normals: normals.collect(),
            uvs: gather(&self.uvs, corners()),
            tangents: gather(&self.tangents, corners()),
            colors: gather(&self.colors, corners()),
            material_slots: self.material_slots.clone(),
        }
    }

    pub(super) fn smooth_normals(&self) -> Vec<Vec3> {
        let places = self.places();
        let mut sums = vec![Vec3::ZERO; self.positions.len()];
        for (triangle, indices) in self.triangles.iter().enumerate() {
            let weighted = angle_weighted_normals(self.corners(triangle));
            for (vertex, normal) in indices.iter().zip(weighted) {
                sums[places[*vertex as usize] as usize] += normal;
            }
        }
        places.iter().map(|&place| sums[place as usize].try_normalize().unwrap_or(Vec3::Y)).collect()
    }
}

/// The triangle's unit normal times its angle, at each corner; zero if it has no area.
pub(super) fn angle_weighted_normals([a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
    match unit_normal(a, b, c) {
        Some(n) => [n * angle(a, b, c), n * angle(b, c, a), n * angle(c, a, b)],
        None => [Vec3::ZERO; 3],
    }
}

/// Scaled by the longest edge first, so that neither tiny nor huge triangles leave the range of f32.
pub(super) fn unit_normal(a: Vec3, b: Vec3, c: Vec3) -> Option<Vec3> {
    let (u, v) = (b - a, c - a);
    let scale = u.abs().max_element().max(v.abs().max_element());
    if scale > 0.0 { (u / scale).cross(v / scale).try_normalize() } else { None }
}

/// The angle at `at` between the directions to `to` and `other`; 0 where an edge has no length.
fn angle(at: Vec3, to: Vec3, other: Vec3) -> f32 {
    match ((to - at).try_normalize(), (other - at).try_normalize()) {
        (Some(u), Some(v)) => u.dot(v).clamp(-1.0, 1.0).acos(),
        _ => 0.0,
    }
}

/// `values[i]` for each index, or nothing if the attribute is absent.
pub(super) fn gather<T: Copy>(values: &[T], indices: impl Iterator<Item = usize>) -> Vec<T> {
    if values.is_empty() { Vec::new() } else { indices.map(|i| values[i]).collect() }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{grid, octahedron};
    use super::*;

    #[test]
    fn smooth_normals_of_a_sphere_point_outwards() {
        let mut sphere = octahedron();
        for _ in 0..4 {
            sphere = sphere.subdivide();
            sphere.positions.iter_mut().for_each(|p| *p = p.normalize());
        }
        sphere.compute_smooth_normals();
        for (p, n) in sphere.positions.iter().zip(&sphere.normals) {
            assert!(p.dot(*n) > 0.9995, "{p} {n}");
        }
    }

    #[test]
    fn the_cut_of_a_cube_does_not_bend_its_normals() {
        // One corner of a cube: three faces, of which one is cut into two triangles at the corner.
        let mesh = TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(1.0, 1.0, 0.0)],
            triangles: vec![[0, 4, 1], [0, 2, 4], [0, 3, 2], [0, 1, 3]],
            ..TriangleMesh::default()
        };
        assert!((mesh.smooth_normals()[0] + Vec3::ONE.normalize()).length() < 1e-6);
    }

    #[test]
    fn seams_do_not_show_and_tiny_or_huge_meshes_have_normals_too() {
        let faceted = octahedron().faceted();
        assert_eq!(faceted.positions.len(), 24);
        for scale in [1e-15f32, 1.0, 1e14] {
            let mut split = faceted.clone();
            split.positions.iter_mut().for_each(|p| *p *= scale);
            split.compute_smooth_normals();
            for (p, n) in split.positions.iter().zip(&split.normals) {
                assert!((*n - *p / scale).length() < 1e-5);
            }
        }
    }

    #[test]
    fn facets_carry_the_normal_of_their_triangle() {
        let mesh = grid(2).faceted();
        assert!(mesh.normals.iter().all(|n| *n == Vec3::Z));
        assert_eq!(mesh.uvs.len(), mesh.positions.len());
        assert_eq!(mesh.validate().expect("usable").bad_normals, 0);
    }
}
