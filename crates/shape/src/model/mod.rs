//! What a model file holds, whatever its format: nodes that place meshes, materials, and how they move.
//!
//! | file | what it holds |
//! |---|---|
//! | `material` | materials, textures and pictures as the file names them |
//! | `animation` | keyframes and their interpolation |
//! | `deform` | skins and morph targets, and the loops that apply them |
//! | `pose` | the model at one time |
//!
//! Conventions are glTF's and halflight's alike: right-handed, +y up, metres, seconds, radians, a camera
//! looks along −z, linear Rec. 709. Formats without units (PLY, OBJ) are taken as they are.

mod animation;
mod deform;
mod material;
mod pose;

use std::sync::Arc;

use glam::{Affine3A, Quat, Vec3};

use crate::TriangleMesh;

pub use animation::{Interpolation, ModelAnimation, ModelChannel, ModelProperty, ModelTrack};
pub use deform::{ModelInfluences, ModelMorph, ModelSkin};
pub use material::{AlphaMode, ModelImage, ModelMaterial, ModelTexture, Wrap};
pub use pose::PosedMesh;

/// Everything that a model file says.
///
/// All references between its parts (indices of nodes, meshes, materials …) are in range, all numbers finite,
/// and parents stand before their children: the loaders see to it.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// The file's name without folder and extension.
    pub name: String,
    /// Nodes of the scene, parents before children.
    pub nodes: Vec<ModelNode>,
    /// Meshes, each drawn by the nodes that name it.
    pub meshes: Vec<ModelMesh>,
    /// Skins, used by nodes.
    pub skins: Vec<ModelSkin>,
    /// Animations by the file's order; [`Model::pose`] plays the first.
    pub animations: Vec<ModelAnimation>,
    /// Materials. Slot s of every mesh is `materials[s]`; if the file has none, this is empty and all slots
    /// are 0.
    pub materials: Vec<ModelMaterial>,
    /// Pictures that the materials' textures refer to.
    pub images: Vec<ModelImage>,
    /// Perspective cameras.
    pub cameras: Vec<ModelCamera>,
    /// Lights.
    pub lights: Vec<ModelLight>,
    /// What was left out or repaired while loading, in sentences.
    pub warnings: Vec<String>,
}

/// A mesh as the file stores it, before skins and morph targets move it.
#[derive(Clone, Debug, Default)]
pub struct ModelMesh {
    /// Its name in the file; may be empty.
    pub name: String,
    /// The mesh at rest.
    pub mesh: Arc<TriangleMesh>,
    /// Morph targets.
    pub morphs: Vec<ModelMorph>,
    /// Weights of the morph targets where neither the node nor an animation says otherwise.
    pub morph_weights: Vec<f32>,
    /// Which joints of a node's skin move the vertices.
    pub influences: Option<ModelInfluences>,
}

/// A place in the hierarchy.
#[derive(Clone, Debug, Default)]
pub struct ModelNode {
    /// Its name in the file; may be empty.
    pub name: String,
    /// The node this one moves with: an index smaller than its own.
    pub parent: Option<usize>,
    /// Where it stands in its parent when no animation says otherwise.
    pub placement: Placement,
    /// Meshes drawn here.
    pub meshes: Vec<usize>,
    /// The skin that deforms them.
    pub skin: Option<usize>,
    /// Weights of their morph targets; empty for the mesh's own.
    pub morph_weights: Vec<f32>,
}

/// Where a node stands in its parent: p ↦ translation + rotation (scale p), or a matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Placement {
    /// In parts, which animations may replace one by one.
    Parts {
        /// In metres.
        translation: Vec3,
        /// A unit quaternion.
        rotation: Quat,
        /// Along the axes before the rotation.
        scale: Vec3,
    },
    /// As a whole.
    Matrix(Affine3A),
}

impl Default for Placement {
    fn default() -> Self {
        Self::Parts { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE }
    }
}

/// A perspective camera at a node: it looks along the node's −z, +y is up.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelCamera {
    /// Its name in the file; may be empty.
    pub name: String,
    /// Where it stands: see [`Model::transforms`].
    pub node: usize,
    /// Vertical angle of view, in radians.
    pub vertical_fov: f32,
    /// Width over height, if the file asks for one.
    pub aspect: Option<f32>,
    /// Distance of the near plane, in metres.
    pub near: f32,
}

/// A light at a node (`KHR_lights_punctual`).
#[derive(Clone, Debug, PartialEq)]
pub struct ModelLight {
    /// Its name in the file; may be empty.
    pub name: String,
    /// Where it stands: see [`Model::transforms`]. Directional and spot lights shine along its −z.
    pub node: usize,
    /// How it shines.
    pub kind: ModelLightKind,
    /// Linear colour.
    pub color: Vec3,
    /// Candela for point and spot lights, lux for directional ones.
    pub intensity: f32,
}

/// How a [`ModelLight`] shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ModelLightKind {
    /// From infinitely far.
    Directional,
    /// From a point, everywhere.
    Point,
    /// From a point, into a cone.
    Spot {
        /// Half the angle within which it has full intensity, in radians.
        inner: f32,
        /// Half the angle beyond which it has none, in radians.
        outer: f32,
    },
}

impl Model {
    /// A model of one mesh at the origin.
    pub fn from_mesh(name: impl Into<String>, mesh: TriangleMesh) -> Self {
        let name = name.into();
        Self {
            nodes: vec![ModelNode { name: name.clone(), meshes: vec![0], ..ModelNode::default() }],
            meshes: vec![ModelMesh { name: name.clone(), mesh: Arc::new(mesh), ..ModelMesh::default() }],
            name,
            ..Self::default()
        }
    }

    /// How many triangles [`Model::pose`] draws, instances counted each time.
    pub fn triangle_count(&self) -> usize {
        self.nodes.iter().flat_map(|n| &n.meshes).map(|&mesh| self.meshes[mesh].mesh.triangles.len()).sum()
    }
}
