//! Geometry.

mod height_field;
mod mesh;

pub use height_field::HeightField;
pub use mesh::TriangleMesh;
