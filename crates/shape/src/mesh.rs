use glam::{Vec2, Vec3, Vec4};

/// Triangles that share vertices. Attributes other than positions may be absent: their vectors are then empty.
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
