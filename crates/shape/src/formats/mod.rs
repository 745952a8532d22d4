//! Model files.
//!
//! | format | what is read |
//! |---|---|
//! | PLY | [`decode_ply`]: ascii and both binary orders, polygons, triangle strips, normals, texture coordinates, colours |
//! | OBJ | [`decode_obj`]: polygons, groups, `.mtl` materials with their textures |
//! | glTF 2.0 | [`decode_gltf`]: `.gltf` and `.glb`, materials, skins, morph targets, animations, cameras, lights |

mod color;
mod gltf;
mod obj;
mod ply;
mod polygon;
mod resolve;

use std::path::Path;

use halflight_file::{LoadError, extension, read};

pub use gltf::decode_gltf;
pub use obj::decode_obj;
pub use ply::{decode_ply, write_ply};
pub use resolve::Resolver;

use crate::Model;

/// Reads a model. The format is told by the extension: `.ply`, `.obj`, `.gltf` or `.glb`, each also packed as
/// `.xz`. Files that it refers to (materials, buffers, pictures) are looked for beside it.
///
/// # Errors
/// A missing or damaged file, a reference that leads nowhere, or something the format allows and halflight
/// cannot do. What can be left out without changing the shape is left out with a warning in
/// [`Model::warnings`].
pub fn load_model(path: &Path) -> Result<Model, LoadError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    match extension(path).as_str() {
        "ply" => decode_ply(&read(path, ply::ASKED)?, path),
        "obj" => decode_obj(&read(path, obj::ASKED)?, path, &Resolver::folder(folder)),
        "gltf" | "glb" => decode_gltf(&read(path, gltf::ASKED)?, path, &Resolver::folder(folder)),
        other => {
            // A wrong name is the first thing to say about a file that is not there.
            read(path, "model")?;
            let found = if other.is_empty() {
                "the name has no extension to tell the format by".to_string()
            } else {
                format!("`.{other}` is not a model format that is known")
            };
            Err(LoadError::new("model", path, found)
                .hint("known are .ply, .obj, .gltf and .glb, each also with .xz"))
        }
    }
}

/// A text without the mark of UTF-8 (U+FEFF) that some editors write before the first word.
fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// The file's name without folder and extensions: of `a/bunny.ply.xz` it is `bunny`.
fn model_name(path: &Path) -> String {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let name = name.strip_suffix(".xz").unwrap_or(&name);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_string()
}
