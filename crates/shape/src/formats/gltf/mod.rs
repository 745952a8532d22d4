//! glTF 2.0 (Khronos, ISO/IEC 12113:2022), `.gltf` and `.glb`.
//!
//! Read are the default scene with its node hierarchy, triangles of every mode, all types of indices and
//! components, sparse accessors, vertex colours, one set of texture coordinates per material, tangents,
//! metallic-roughness materials, skins with any number of influences, morph targets, animations of nodes and
//! weights, perspective cameras and punctual lights.
//!
//! | extension | |
//! |---|---|
//! | `KHR_texture_transform`, `KHR_lights_punctual`, `KHR_mesh_quantization` | read |
//! | `KHR_materials_emissive_strength`, `_ior`, `_transmission` (factor), `_unlit` | read |
//! | `KHR_materials_pbrSpecularGlossiness` | diffuse colour and glossiness |
//! | other `KHR_materials_…` | left out with a warning, also where the file requires them: they change the look, not the shape |
//! | anything else that a file requires (Draco, meshopt, KTX2 …) | an error that names it |
//!
//! Occlusion textures are left out on purpose: occlusion is what a renderer computes.

mod accessor;
mod animation;
mod container;
mod json;
mod material;
mod mesh;
mod scene;

use std::path::Path;

use halflight_file::LoadError;

use self::accessor::Document;
use self::material::Materials;
use super::{Resolver, model_name};
use crate::Model;

pub(super) const ASKED: &str = "glTF model";

const READ: [&str; 8] = [
    "KHR_texture_transform",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_pbrSpecularGlossiness",
];

/// Reads a glTF file, text or binary, from memory; `name` is for the model's name and messages, buffers and
/// pictures outside the file come from `companions`.
///
/// # Errors
/// Anything that does not follow the format, ranges outside their buffers, indices out of range, nodes in a
/// cycle, numbers that are not finite, required extensions that are not read, missing companions.
pub fn decode_gltf(bytes: &[u8], name: &Path, companions: &Resolver) -> Result<Model, LoadError> {
    let container::Container { root, buffers } = container::open(bytes, name, companions)?;
    let file = Document::new(&root, &buffers, name, companions);
    let mut model = Model { name: model_name(name), ..Model::default() };
    check_extensions(&file, &mut model.warnings)?;
    let order = scene::order(&file)?;
    let mut materials = Materials::default();
    scene::read(&mut model, &order, &mut materials, &file)?;
    animation::read(&mut model, &order, &file)?;
    model.materials = materials.list;
    model.images = materials.images;
    model.warnings.extend(materials.warnings);
    if model.meshes.is_empty() {
        model.warnings.push("there are no triangles in it".into());
    }
    Ok(model)
}

fn check_extensions(file: &Document, warnings: &mut Vec<String>) -> Result<(), LoadError> {
    let shown =
        |names: &[&String]| names.iter().map(|n| n.escape_debug().to_string()).collect::<Vec<_>>().join(", ");
    let is_read = |name: &str| READ.contains(&name);
    let only_look = |name: &str| name.starts_with("KHR_materials_");
    let required = file.root.extensions_required.iter();
    let required: Vec<&String> = required.filter(|name| !is_read(name) && !only_look(name)).collect();
    if !required.is_empty() {
        return Err(file
            .error(format!("it requires {}, which is not read", shown(&required)))
            .hint("export it without compression and with PNG or JPEG pictures"));
    }
    let unread: Vec<&String> = file.root.extensions_used.iter().filter(|name| !is_read(name)).collect();
    if !unread.is_empty() {
        warnings.push(format!("it uses {}, which is left out", shown(&unread)));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
