//! Triangle meshes and what is done to them before any ray sees them.
//!
//! | file | what it does |
//! |---|---|
//! | `validate` | what must hold of a mesh, and the repair of what can be repaired |
//! | `measure` | bounds, surface area |
//! | `normals` | angle-weighted vertex normals, facets |
//! | `tangents` | tangent frames for normal maps |
//! | `weld` | which vertices stand at the same place |
//! | `surface_net` | the surface where values on a lattice change their sign |
//! | `subdivide` | midpoint subdivision, whole or down to an edge length, without cracks |
//! | `displace` | displacement along the normal |
//! | `combine` | transforming and joining |

mod combine;
mod displace;
mod measure;
mod normals;
mod subdivide;
mod surface_net;
mod tangents;
mod validate;
mod weld;

use glam::{Vec2, Vec3, Vec4};

pub use surface_net::Lattice;
pub use validate::{MAX_COORDINATE, MeshError, MeshFlaws};

/// Triangles that share vertices. Attributes other than positions may be absent: their vectors are then empty.
///
/// ```
/// use glam::Vec3;
/// use halflight_shape::TriangleMesh;
/// let mut mesh = TriangleMesh {
///     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
///     triangles: vec![[0, 1, 2]],
///     ..TriangleMesh::default()
/// };
/// mesh.compute_smooth_normals();
/// assert_eq!(mesh.normals, [Vec3::Z; 3]);
/// assert_eq!(mesh.surface_area(), 0.5);
/// assert!(mesh.validate().is_ok());
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Three vertex indices a triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Unit shading normals per vertex; empty for flat shading.
    pub normals: Vec<Vec3>,
    /// Texture coordinates per vertex, v downwards from the top row of the picture (as in glTF); may be empty.
    pub uvs: Vec<Vec2>,
    /// Unit tangents per vertex, w = ±1 the handedness of the bitangent (as in glTF); may be empty.
    pub tangents: Vec<Vec4>,
    /// Linear colours per vertex, which multiply the albedo; may be empty.
    pub colors: Vec<Vec3>,
    /// Material slot per triangle; empty when all are slot 0.
    pub material_slots: Vec<u32>,
}

impl TriangleMesh {
    /// The three corners of a triangle.
    ///
    /// # Panics
    /// If there is no such triangle, or its indices are out of range (see [`TriangleMesh::validate`]).
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|vertex| self.positions[vertex as usize])
    }

    /// The material slot of a triangle.
    pub fn material_slot(&self, triangle: usize) -> u32 {
        self.material_slots.get(triangle).copied().unwrap_or(0)
    }
}

#[cfg(test)]
pub(crate) mod samples;
