//! `halflight info`: what is in a file.

mod field_file;
mod layer;
mod model;
mod picture;

use std::path::PathBuf;

use clap::Args;
use halflight::demos;
use halflight_file::extension;
use serde_json::{Value, json};

use super::console::Console;
use super::failure::Failure;
use super::stage::{self, MachineArgs, SceneArgs};
use super::{brdf, words};

#[derive(Args, Debug)]
pub(crate) struct InfoArgs {
    /// A scene, a mesh, a picture or a measured material; .xz is unpacked
    file: PathBuf,

    /// A layer of an EXR picture to show in false colour, as its channels are named: level, depth.Z
    #[arg(long, value_name = "NAME", requires = "output")]
    layer: Option<String>,

    /// The PNG to show it in
    #[arg(short, long, value_name = "FILE", requires = "layer")]
    output: Option<PathBuf>,

    /// The values that are darkest and brightest [default: all but a few outliers]
    #[arg(long, value_name = "LOW,HIGH", requires = "layer", allow_hyphen_values = true)]
    range: Option<String>,
}

/// A description for people and one for programs.
pub(crate) struct Description {
    pub(crate) text: String,
    pub(crate) json: Value,
}

pub(crate) fn run(args: &InfoArgs, console: Console) -> Result<(), Failure> {
    let path = &args.file;
    if let (Some(layer), Some(output)) = (&args.layer, &args.output) {
        return layer::show(path, layer, args.range.as_deref(), output, console);
    }
    let Description { text, json } = match extension(path).as_str() {
        "ply" | "obj" | "gltf" | "glb" => model::describe(path)?,
        "binary" => brdf::describe(path)?,
        "ddf" => field_file::describe(path)?,
        "toml" => scene(path)?,
        _ if demos::built_in(path)?.is_some() => scene(path)?,
        // Pictures are told by their first bytes; for anything else their reader says what is known.
        _ => picture::describe(path)?,
    };
    console.answer(text.trim_end());
    console.event("info", json!({ "file": path, "description": json }));
    Ok(())
}

fn scene(path: &std::path::Path) -> Result<Description, Failure> {
    let stage = stage::load(path, &SceneArgs::default(), &MachineArgs::default())?;
    let text = format!("{}\n  content hash   {}", stage.describe().trim_end(), stage.hash());
    let size = stage.size();
    let json = json!({
        "kind": "scene", "hash": stage.hash(), "width": size.width, "height": size.height,
        "warnings": stage.warnings(), "text": text,
    });
    Ok(Description { text, json })
}

/// A line `  label   value` of a description.
pub(crate) fn field(text: &mut String, label: &str, value: impl std::fmt::Display) {
    *text += &format!("  {label:<14} {value}\n");
}

/// `0.123 0.456 0.789`
pub(super) fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    values.into_iter().map(words::figure).collect::<Vec<_>>().join(" ")
}
