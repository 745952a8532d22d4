//! Transforming and joining meshes.

use glam::{Affine3A, Vec2, Vec3, Vec4};

use super::TriangleMesh;

impl TriangleMesh {
    /// The mesh in another place. Normals go by the inverse transpose. A transform that mirrors also turns
    /// the triangles round, so that the front stays the front. A transform that flattens leaves normals that
    /// have no meaning; [`TriangleMesh::repair`] replaces them.
    #[must_use]
    pub fn transformed(&self, transform: &Affine3A) -> Self {
        let linear = transform.matrix3;
        let mirrors = linear.determinant() < 0.0;
        // The cofactor matrix is the inverse transpose times the determinant, and exists without an inverse.
        let cofactors = glam::Mat3::from_cols(
            Vec3::from(linear.y_axis.cross(linear.z_axis)),
            Vec3::from(linear.z_axis.cross(linear.x_axis)),
            Vec3::from(linear.x_axis.cross(linear.y_axis)),
        ) * if mirrors { -1.0 } else { 1.0 };
        let tangent = |t: &Vec4| {
            let direction = transform.transform_vector3(t.truncate()).normalize_or_zero();
            direction.extend(if mirrors { -t.w } else { t.w })
        };
        let mut mesh = Self {
            positions: self.positions.iter().map(|p| transform.transform_point3(*p)).collect(),
            triangles: self.triangles.clone(),
            normals: self.normals.iter().map(|n| (cofactors * *n).normalize_or_zero()).collect(),
            uvs: self.uvs.clone(),
            tangents: self.tangents.iter().map(tangent).collect(),
            colors: self.colors.clone(),
            material_slots: self.material_slots.clone(),
        };
        if mirrors {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        mesh
    }

    /// Appends another mesh. An attribute that only one of the two has is filled in for the other such that
    /// nothing looks different: flat shading becomes facets with normals, colours are white, texture
    /// coordinates zero, material slots 0. Tangents that only one has are dropped: compute them again.
    pub fn merge(&mut self, other: &Self) {
        if self.positions.is_empty() && self.triangles.is_empty() {
            *self = other.clone();
            return;
        }
        if other.positions.is_empty() {
            return;
        }
        let faceted;
        let other = match (self.normals.is_empty(), other.normals.is_empty()) {
            (true, false) => {
                *self = self.faceted();
                other
            }
            (false, true) => {
                faceted = other.faceted();
                &faceted
            }
            _ => other,
        };
        let (left, right) = (self.positions.len(), other.positions.len());
        join(&mut self.normals, &other.normals, left, right, Vec3::Y);
        join(&mut self.uvs, &other.uvs, left, right, Vec2::ZERO);
        join(&mut self.colors, &other.colors, left, right, Vec3::ONE);
        join(&mut self.material_slots, &other.material_slots, self.triangles.len(), other.triangles.len(), 0);
        if self.tangents.is_empty() || other.tangents.is_empty() {
            self.tangents.clear();
        } else {
            self.tangents.extend_from_slice(&other.tangents);
        }
        self.positions.extend_from_slice(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|vertex| vertex + left as u32)));
    }
}

/// Appends an attribute whose absence on one side stands for `neutral`.
fn join<T: Copy>(mine: &mut Vec<T>, theirs: &[T], left: usize, right: usize, neutral: T) {
    if mine.is_empty() && theirs.is_empty() {
        return;
    }
    mine.resize(left, neutral);
    mine.extend_from_slice(theirs);
    mine.resize(left + right, neutral);
}

#[cfg(test)]
mod tests {
    use glam::{Mat3, Quat};

    use super::super::samples::{grid, octahedron};
    use super::*;

    #[test]
    fn normals_stay_orthogonal_to_the_surface_and_the_front_stays_in_front() {
        let shear = Mat3::from_cols(Vec3::new(1.0, 0.5, 0.0), Vec3::new(0.0, 2.0, 0.3), Vec3::Z);
        for linear in [
            shear,
            Mat3::from_diagonal(Vec3::new(-1.0, 2.0, 1.0)),
            Mat3::from_quat(Quat::from_rotation_x(1.0)),
        ] {
            let mut mesh = grid(1);
            mesh.compute_smooth_normals();
            mesh.compute_tangents();
            let mesh = mesh.transformed(&Affine3A::from_mat3_translation(linear, Vec3::ONE));
            let [a, b, c] = mesh.corners(0);
            let geometric = (b - a).cross(c - a).normalize();
            assert!((geometric - mesh.normals[0]).length() < 1e-6, "{geometric} {}", mesh.normals[0]);
            // The bitangent must still point up in the picture.
            let t = mesh.tangents[0];
            let up = linear * Vec3::Y;
            assert!(mesh.normals[0].cross(t.truncate()).dot(up) * t.w > 0.0);
        }
    }

    #[test]
    fn merging_keeps_both_halves() {
        let mut smooth = octahedron();
        smooth.compute_smooth_normals();
        smooth.colors = vec![Vec3::X; 6];
        let mut both = grid(1);
        both.material_slots = vec![3, 4];
        both.merge(&smooth);
        assert_eq!(both.triangles.len(), 10);
        assert_eq!(both.validate().expect("usable"), Default::default());
        assert_eq!(both.normals[0], Vec3::Z);
        assert_eq!(both.colors[0], Vec3::ONE);
        assert_eq!(*both.colors.last().expect("some"), Vec3::X);
        assert_eq!(both.material_slots, [3, 4, 0, 0, 0, 0, 0, 0, 0, 0]);
        assert!((both.surface_area() - 1.0 - smooth.surface_area()).abs() < 1e-6);
        let mut empty = TriangleMesh::default();
        empty.merge(&smooth);
        empty.merge(&TriangleMesh::default());
        assert_eq!(empty, smooth);
    }
}
