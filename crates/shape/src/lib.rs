//! Geometry.

mod formats;
mod height_field;
mod mesh;
mod model;
pub mod procedural;

pub use formats::{Resolver, decode_gltf, decode_obj, decode_ply, load_model, write_ply};
pub use height_field::{HeightField, HeightFieldError};
pub use mesh::{MAX_COORDINATE, MeshError, MeshFlaws, TriangleMesh};
pub use model::{
    AlphaMode, Interpolation, Model, ModelAnimation, ModelCamera, ModelChannel, ModelImage, ModelInfluences,
    ModelLight, ModelLightKind, ModelMaterial, ModelMesh, ModelMorph, ModelNode, ModelProperty, ModelSkin,
    ModelTexture, ModelTrack, Placement, PosedMesh, Wrap,
};
