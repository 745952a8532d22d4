//! Geometry.

mod height_field;
mod mesh;
pub mod procedural;

pub use height_field::{HeightField, HeightFieldError};
pub use mesh::{MAX_COORDINATE, MeshError, MeshFlaws, TriangleMesh};
