//! Geometry.

mod height_field;
mod mesh;

pub use height_field::HeightField;
pub use mesh::{MAX_COORDINATE, MeshError, MeshFlaws, TriangleMesh};
