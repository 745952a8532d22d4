//! What a render writes must not fall upon what it reads, nor may two outputs be one file.
//!
//! Paths are compared as the file system resolves them (symbolic links, `./`, `..`). Only a file that is there can be
//! overwritten, so the scene's files are looked through only if an output exists already.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use halflight_file::extension;

use super::options::RenderArgs;
use crate::command::failure::Failure;
use crate::command::output::folder_of;
use crate::command::sequence::Shot;

/// An output and the option that names it.
type Target<'a> = (&'static str, &'a Path);

/// All files that the command is going to write.
fn targets<'a>(args: &'a RenderArgs, shots: &'a [Shot]) -> impl Iterator<Item = Target<'a>> {
    shots.iter().map(|shot| ("the picture", shot.output.as_path())).chain(beside(args))
}

/// Those that are not pictures.
fn beside(args: &RenderArgs) -> impl Iterator<Item = Target<'_>> {
    let checkpoint = args.checkpoint.iter().map(|path| ("--checkpoint", path.as_path()));
    checkpoint.chain(args.stats.iter().map(|path| ("--stats", path.as_path())))
}

/// Refuses two outputs of one path.
pub(super) fn refuse_twins(args: &RenderArgs, shots: &[Shot]) -> Result<(), Failure> {
    let mut known: HashMap<PathBuf, &'static str> = HashMap::new();
    for (asked, path) in targets(args, shots) {
        if let Some(other) = known.insert(resolved(path), asked) {
            return Err(Failure::usage(format!(
                "cannot write both {other} and {asked} to {}: they are one file (give each a name of its own)",
                path.display()
            )));
        }
    }
    Ok(())
}

/// What the scene is made from, as far as it matters to outputs.
pub(super) struct Inputs(HashSet<PathBuf>);

impl Inputs {
    /// What is known before the scene is loaded: the files that the command line names.
    pub(super) fn named(args: &RenderArgs) -> Self {
        let environment = args.scene_args.environment.as_ref();
        Self([Some(&args.scene), environment].into_iter().flatten().map(|path| resolved(path)).collect())
    }

    /// Adds the files that the scene has read, with the buffers, pictures and material libraries of its models.
    pub(super) fn add(&mut self, files: &[PathBuf]) {
        self.0.extend(files.iter().map(|path| resolved(path)));
        for path in files {
            self.0.extend(companions(path).iter().map(|path| resolved(path)));
        }
    }

    fn hold(&self, path: &Path) -> bool {
        path.exists() && self.0.contains(&resolved(path))
    }

    /// Whether any picture would overwrite what the scene is made from.
    pub(super) fn meet(&self, shots: &[Shot]) -> bool {
        shots.iter().any(|shot| self.hold(&shot.output))
    }

    /// Refuses to overwrite what the scene is made from.
    pub(super) fn refuse(&self, args: &RenderArgs, shots: &[Shot]) -> Result<(), Failure> {
        let Some((asked, path)) = targets(args, shots).find(|(_, path)| self.hold(path)) else {
            return Ok(());
        };
        let example = match asked {
            "--checkpoint" => "--checkpoint other.checkpoint",
            "--stats" => "--stats other.json",
            _ => "-o other.png",
        };
        Err(Failure::usage(format!(
            "cannot write {asked} to {}: the scene {} is made from this file, and it would be lost (write elsewhere: \
             {example})",
            path.display(),
            args.scene.display()
        )))
    }
}

/// Whether any output is there already, and so could be lost.
pub(super) fn any_exists(args: &RenderArgs, shots: &[Shot]) -> bool {
    targets(args, shots).any(|(_, path)| path.exists())
}

/// The path without links and detours; of a file that is not there yet, that of its folder and its name.
fn resolved(path: &Path) -> PathBuf {
    std::fs::canonicalize(path).unwrap_or_else(|_| {
        let folder = folder_of(path);
        let folder = std::fs::canonicalize(&folder).unwrap_or(folder);
        path.file_name().map_or_else(|| folder.clone(), |name| folder.join(name))
    })
}

/// The files that a model's file names. It has been loaded, so what cannot be read here names nothing.
fn companions(model: &Path) -> Vec<PathBuf> {
    let names = match extension(model).as_str() {
        "gltf" => of_gltf(&halflight_file::read(model, "glTF model").unwrap_or_default()),
        "obj" => of_obj(&halflight_file::read(model, "OBJ model").unwrap_or_default()),
        _ => return Vec::new(),
    };
    let folder = folder_of(model);
    names.iter().map(|name| folder.join(name)).collect()
}

fn of_gltf(bytes: &[u8]) -> Vec<String> {
    let json: serde_json::Value = serde_json::from_slice(bytes).unwrap_or_default();
    let lists = ["buffers", "images"].into_iter().filter_map(|key| json.get(key)?.as_array());
    let uris = lists.flatten().filter_map(|entry| entry.get("uri")?.as_str());
    uris.filter(|uri| !uri.starts_with("data:")).map(|uri| uri.replace("%20", " ")).collect()
}

fn of_obj(bytes: &[u8]) -> Vec<String> {
    let lines = bytes.split(|&byte| byte == b'\n').filter_map(|line| line.strip_prefix(b"mtllib "));
    lines.map(|name| String::from_utf8_lossy(name).trim().to_string()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_name_their_companions() {
        let gltf =
            br#"{"buffers": [{"uri": "a%20b.bin"}, {"uri": "data:,x"}, {}], "images": [{"uri": "c.png"}]}"#;
        assert_eq!(of_gltf(gltf), ["a b.bin", "c.png"]);
        assert_eq!(of_obj(b"o x\nmtllib m n.mtl\r\nv 1 2 3\n"), ["m n.mtl"]);
        assert!(of_gltf(b"{").is_empty() && of_obj(b"").is_empty());
    }
}
