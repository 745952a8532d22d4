//! Tangent frames for normal maps.
//!
//! For each triangle the derivatives of the position along the picture's axes are T = ∂p/∂u and B = −∂p/∂v
//! (v grows downwards, and a normal map's green points up, as glTF asks). At a vertex the unit T of its
//! triangles are summed, weighted by angle, and made orthogonal to the vertex normal n by Gram–Schmidt; the
//! handedness w = ±1 is such that B lies on the side of w n × T.
//!
//! This is what MikkTSpace computes except that it also splits vertices where mirrored halves of a texture
//! meet: here such a vertex takes the side with the greater angle, and the frame is bent within the triangles
//! along the mirror line. Files that need more bring tangents of their own, which are kept.

use glam::{Vec2, Vec3};

use super::TriangleMesh;
use super::normals::angle_weighted_normals;

impl TriangleMesh {
    /// Replaces the tangents. Without normals they are orthogonal to the smooth normals; without texture
    /// coordinates there is nothing to follow, and the tangents are left empty.
    pub fn compute_tangents(&mut self) {
        self.tangents.clear();
        if self.uvs.len() != self.positions.len() {
            return;
        }
        let smooth;
        let normals = if self.normals.len() == self.positions.len() {
            &self.normals
        } else {
            smooth = self.smooth_normals();
            &smooth
        };
        let mut tangents = vec![Vec3::ZERO; self.positions.len()];
        let mut handedness = vec![0f32; self.positions.len()];
        for (triangle, indices) in self.triangles.iter().enumerate() {
            let corners = self.corners(triangle);
            let uvs = indices.map(|vertex| self.uvs[vertex as usize]);
            let Some((tangent, bitangent)) = axes(corners, uvs) else { continue };
            let weighted = angle_weighted_normals(corners);
            for (corner, &vertex) in indices.iter().enumerate() {
                let angle = weighted[corner].length();
                let side = normals[vertex as usize].cross(tangent).dot(bitangent);
                tangents[vertex as usize] += angle * tangent;
                handedness[vertex as usize] += angle * side.signum();
            }
        }
        let orthogonal = |(i, tangent): (usize, &Vec3)| {
            let normal = normals[i];
            let side = if handedness[i] < 0.0 { -1.0 } else { 1.0 };
            let direction = tangent.reject_from_normalized(normal).try_normalize();
            direction.unwrap_or_else(|| normal.any_orthonormal_vector()).extend(side)
        };
        self.tangents = tangents.iter().enumerate().map(orthogonal).collect();
    }
}

/// Unit vectors along growing u and falling v; `None` where the texture or the triangle is degenerate.
fn axes([a, b, c]: [Vec3; 3], [ua, ub, uc]: [Vec2; 3]) -> Option<(Vec3, Vec3)> {
    let (e, f) = (b - a, c - a);
    let (du, dv) = (ub - ua, uc - ua);
    // p = a + s e + t f and uv = ua + s du + t dv; solved for the derivatives. Only directions are needed, so
    // that the determinant counts by its sign alone.
    let sign = du.perp_dot(dv);
    if sign == 0.0 {
        return None;
    }
    let tangent = (e * dv.y - f * du.y) * sign.signum();
    let bitangent = (e * dv.x - f * du.x) * sign.signum();
    Some((tangent.try_normalize()?, bitangent.try_normalize()?))
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::super::samples::{grid, octahedron};
    use super::*;

    #[test]
    fn an_upright_picture_has_its_tangent_to_the_right_and_its_bitangent_up() {
        let mut mesh = grid(2);
        mesh.compute_tangents();
        for t in &mesh.tangents {
            assert!((*t - Vec4::new(1.0, 0.0, 0.0, 1.0)).length() < 1e-6, "{t}");
        }
    }

    #[test]
    fn a_mirrored_picture_has_the_other_handedness() {
        let mut mesh = grid(2);
        mesh.uvs.iter_mut().for_each(|uv| uv.x = 1.0 - uv.x);
        mesh.compute_tangents();
        for t in &mesh.tangents {
            assert!((*t - Vec4::new(-1.0, 0.0, 0.0, -1.0)).length() < 1e-6, "{t}");
        }
    }

    #[test]
    fn degenerate_texture_coordinates_give_some_frame() {
        let mut mesh = octahedron();
        mesh.compute_tangents();
        assert!(mesh.tangents.is_empty());
        mesh.uvs = vec![Vec2::ZERO; 6];
        mesh.compute_smooth_normals();
        mesh.compute_tangents();
        for (t, n) in mesh.tangents.iter().zip(&mesh.normals) {
            assert!(t.truncate().dot(*n).abs() < 1e-6);
        }
        assert_eq!(mesh.validate().expect("usable").bad_tangents, 0);
    }
}
