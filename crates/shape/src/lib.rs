//! Geometry: what scenes are made of, before any ray sees it.
//!
//! - [`TriangleMesh`]: triangles, their attributes, and what is done to them (normals, tangents, subdivision,
//!   displacement).
//! - [`load_model`]: PLY, OBJ and glTF files as a [`Model`]: nodes, meshes, materials, skins, animations.
//!   [`Model::pose`] gives its meshes at one time.
//! - [`HeightField`]: heights over a grid.
//! - [`procedural`]: shapes made by formulas.
//! - [`SphereSet`]: a few spheres that block what a mesh blocks, and follow its joints.
//!
//! ```no_run
//! let model = halflight_shape::load_model("robot.glb".as_ref())?;
//! for part in model.pose(0.5) {
//!     println!("{} triangles at {}", part.mesh.triangles.len(), part.transform.translation);
//! }
//! # Ok::<(), halflight_file::LoadError>(())
//! ```

mod formats;
mod height_field;
mod mesh;
mod model;
pub mod procedural;
mod sphere_set;

pub use formats::{Resolver, decode_gltf, decode_obj, decode_ply, load_model, write_ply};
pub use height_field::{HeightField, HeightFieldError};
pub use mesh::{Lattice, MAX_COORDINATE, MeshError, MeshFlaws, TriangleMesh};
pub use model::{
    AlphaMode, Interpolation, Model, ModelAnimation, ModelCamera, ModelChannel, ModelImage, ModelInfluences,
    ModelLight, ModelLightKind, ModelMaterial, ModelMesh, ModelMorph, ModelNode, ModelProperty, ModelSkin,
    ModelTexture, ModelTrack, Placement, PosedMesh, Wrap,
};
pub use sphere_set::{
    MAX_SPHERES, RestSurface, SPHERES_VERSION, SilhouetteAgreement, SphereCoverage, SphereFitError,
    SphereFitOptions, SphereFitReport, SphereInfluences, SphereMeasure, SphereSet, SphereTree,
    SphereTreeNode,
};
