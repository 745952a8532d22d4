//! From what a scene file says to what a scene is: loads the files it names, resolves the names it uses.
//!
//! Problems are collected, so that one run tells all of them; what could not be loaded is replaced by something plain
//! until the end, where the problems are returned instead of the scene.

mod camera;
mod environment;
pub(crate) mod fields;
mod heights;
mod lights;
mod materials;
mod media;
mod meshes;
mod mixes;
mod model_materials;
mod node_spheres;
mod shapes;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use halflight_file::LoadError;
use halflight_image::{ColorSpace, TextureImage};
use halflight_material::{Material, MeasuredBrdf};
use halflight_shape::Model;

use crate::lights::EnvironmentMap;
use crate::schema::{FilePath, Problem, Reader};

pub(crate) use camera::{CameraRig, Placement};
pub(crate) use environment::{environment, environment_image, sky_of, studio};
pub(crate) use heights::{HeightSource, relief};
pub(crate) use lights::LightRig;
use materials::default_material;
pub(crate) use materials::{material_as_toml, material_from_text};
pub(crate) use meshes::{MeshPart, ModelShape, built_once};
pub(crate) use shapes::{Form, Object, facing_up};

/// What is shared while a scene is built.
#[derive(Default)]
pub(crate) struct Builder {
    /// What is wrong so far.
    pub(crate) reader: Reader,
    /// What the user should know.
    pub(crate) warnings: Vec<String>,
    /// Every file that was read.
    pub(crate) files: Vec<PathBuf>,
    /// The materials of the scene; shapes refer to them by index.
    pub(crate) materials: Vec<Arc<Material>>,
    /// Materials of the scene file by name, with the displacement that goes with them.
    pub(crate) named: HashMap<String, MaterialEntry>,
    mixing: mixes::Mixing,
    textures: HashMap<(PathBuf, bool), Arc<TextureImage>>,
    measured: HashMap<(PathBuf, bool), Arc<MeasuredBrdf>>,
    models: HashMap<PathBuf, Arc<Model>>,
    maps: HashMap<(PathBuf, bool), Arc<EnvironmentMap>>,
    default_material: Option<u32>,
}

/// A material of the scene and what it does to meshes.
#[derive(Clone)]
pub(crate) struct MaterialEntry {
    pub(crate) index: u32,
    pub(crate) displacement: Option<Arc<Displacement>>,
}

/// Heights that move the vertices of a mesh.
pub(crate) struct Displacement {
    pub(crate) texture: halflight_material::Texture,
    /// Beyond the borders of the texture; without it, as suits the mesh.
    pub(crate) wrap: Option<halflight_material::Wrap>,
    pub(crate) scale: f32,
    pub(crate) middle: f32,
    pub(crate) edge: Option<f32>,
}

impl Builder {
    /// Adds a material and gives its index.
    pub(crate) fn add_material(&mut self, material: Material) -> u32 {
        self.materials.push(Arc::new(material));
        (self.materials.len() - 1) as u32
    }

    /// The material of shapes that say nothing about theirs.
    pub(crate) fn default_material(&mut self) -> u32 {
        if let Some(index) = self.default_material {
            return index;
        }
        let index = self.add_material(default_material());
        self.default_material = Some(index);
        index
    }

    /// Another material for shapes that say nothing about theirs.
    pub(crate) fn set_default_material(&mut self, material: Material) {
        self.default_material = Some(self.add_material(material));
    }

    /// Notes a file that could not be loaded, at the line that names it.
    fn failed(&mut self, file: &FilePath, error: &LoadError) {
        self.reader.report(Problem::load(&file.origin, error));
    }

    pub(crate) fn note_file(&mut self, path: &Path) {
        if !self.files.iter().any(|known| known == path) {
            self.files.push(path.to_path_buf());
        }
    }

    /// A texture, loaded once for each colour space.
    fn texture(&mut self, file: &FilePath, space: ColorSpace) -> Option<Arc<TextureImage>> {
        let key = (file.path.clone(), space == ColorSpace::Srgb);
        if let Some(known) = self.textures.get(&key) {
            return Some(Arc::clone(known));
        }
        match halflight_image::load_texture(&file.path, space) {
            Ok(image) => {
                self.note_file(&file.path);
                let image = Arc::new(image);
                self.textures.insert(key, Arc::clone(&image));
                Some(image)
            }
            Err(error) => {
                self.failed(file, &error);
                None
            }
        }
    }

    /// A model, loaded once.
    fn model(&mut self, file: &FilePath) -> Option<Arc<Model>> {
        if let Some(known) = self.models.get(&file.path) {
            return Some(Arc::clone(known));
        }
        match halflight_shape::load_model(&file.path) {
            Ok(model) => {
                self.note_file(&file.path);
                self.warnings.extend(model.warnings.iter().map(|w| format!("{}: {w}", file.path.display())));
                let model = Arc::new(model);
                self.models.insert(file.path.clone(), Arc::clone(&model));
                Some(model)
            }
            Err(error) => {
                self.failed(file, &error);
                None
            }
        }
    }
}
