//! Wavefront OBJ with its MTL materials.
//!
//! - The whole file becomes one mesh; `usemtl` becomes material slots, groups and objects only separate text.
//! - Polygons of any size are cut into triangles; indices may be negative; lines and points are left out.
//! - A corner with its own texture coordinate or normal gets its own vertex; without either, vertices are the
//!   file's. Missing normals of some corners are taken from the triangles around.
//! - v counts upwards in the file and is turned to count downwards. Colours behind positions are sRGB.
//! - A material file that is missing is a warning: the materials then have their names and a neutral grey. A
//!   texture that is missing is an error.
//!
//! Parsed in one pass, about 80 MB/s on one core (the armadillo; the test `large_meshes` prints the rate).

mod assemble;
mod lines;
mod mtl;
mod parse;

use std::path::Path;

use halflight_file::{LoadError, Place};

use super::Resolver;
use super::model_name;
use super::resolve::Located;
use crate::Model;

pub(super) const ASKED: &str = "OBJ mesh";

/// Reads an OBJ file from memory; `name` is for the model's name and messages, material files and textures come
/// from `companions`.
///
/// # Errors
/// Anything that does not follow the format, indices out of range, and numbers that are not finite, with the
/// line; a damaged material file; a texture that is missing.
pub fn decode_obj(bytes: &[u8], name: &Path, companions: &Resolver) -> Result<Model, LoadError> {
    let error = |found: String| LoadError::new(ASKED, name, found);
    if bytes.is_empty() {
        return Err(error("the file is empty".into()));
    }
    let parsed = parse::parse(bytes).map_err(|(line, found)| error(found).at(Place::Line(line)))?;
    if parsed.face_ends.is_empty() {
        return Err(match parsed.unknown.first() {
            Some((line, word)) => error(format!("{word} is not an OBJ statement")).at(Place::Line(*line)),
            None => error("there are no faces in it".into()),
        });
    }
    let title = model_name(name);
    let mut library = mtl::Library::default();
    let mut warnings = parsed.warnings();
    for file in &parsed.libraries {
        match companions.locate(file, "OBJ materials", name) {
            Ok(Located::File(path)) => {
                let text = halflight_file::read(&path, mtl::ASKED)?;
                library.read(&text, &path, companions, name)?;
            }
            Ok(Located::Bytes(text)) => library.read(&text, Path::new(file), companions, name)?,
            Err(missing) => warnings.push(format!("{}; its materials are a neutral grey", missing.found)),
        }
    }
    let materials = library.pick(&parsed.material_names, &mut warnings);
    let (mut mesh, left_out) = assemble::assemble(&parsed);
    if left_out > 0 {
        warnings.push(format!("{left_out} faces have fewer than three corners and were left out"));
    }
    let flaws = mesh.repair().map_err(|e| error(e.to_string()))?;
    warnings.extend(flaws.sentences(&title));
    let mut model = Model::from_mesh(title, mesh);
    model.materials = materials;
    model.images = library.images;
    model.warnings = warnings;
    Ok(model)
}

#[cfg(test)]
mod tests;
