//! `halflight brdf`: files in the format of the MERL database, written from any material and described.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, Subcommand};
use halflight_file::extension;
use halflight_material::{Lookup, Material, MaterialKind, MeasuredBrdf, SurfaceInput, write_merl};
use serde_json::json;

use super::console::Console;
use super::failure::Failure;
use super::info::Description;
use super::{output, stage, words};

#[derive(Args, Debug)]
pub(crate) struct BrdfArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Sample a material on the grid of the MERL database and write it
    Synth {
        /// A type of material and its keys, as in "conductor roughness=0.3"
        spec: String,
        /// The file, .binary
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Describe a measured material
    Info {
        /// A .binary file, or .binary.xz
        file: PathBuf,
    },
}

pub(crate) fn run(args: &BrdfArgs, console: Console) -> Result<(), Failure> {
    match &args.action {
        Action::Synth { spec, output } => synth(spec, output, console),
        Action::Info { file } => {
            let Description { text, json } = describe(file)?;
            console.answer(text.trim_end());
            console.event("info", json!({ "file": file, "description": json }));
            Ok(())
        }
    }
}

fn synth(spec: &str, path: &Path, console: Console) -> Result<(), Failure> {
    if extension(path) != "binary" || path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xz")) {
        return Err(Failure::usage(format!(
            "cannot write {}: measured materials are .binary files",
            path.display()
        )));
    }
    output::check_writable(path)?;
    let material = stage::material(spec)?;
    check_synthesis(&material, spec, console)?;
    let start = Instant::now();
    write_merl(&material.bsdf(&SurfaceInput::default()), path)?;
    let seconds = start.elapsed().as_secs_f64();
    console.note(&format!("wrote {} in {}", path.display(), words::seconds(seconds)));
    console.event("done", json!({ "output": path, "seconds": seconds }));
    Ok(())
}

/// Refuses what reflects nothing, and says what is lost of what does.
fn check_synthesis(material: &Material, spec: &str, console: Console) -> Result<(), Failure> {
    match &material.kind {
        MaterialKind::Black => {
            let why = if material.is_emissive() { "it only shines" } else { "it is black" };
            return Err(Failure::failed(format!("cannot measure {spec:?}: {why}, and reflects nothing")));
        }
        MaterialKind::Conductor { anisotropy, .. } if *anisotropy != 0.0 => console.warn(
            "the format is for isotropic materials: of this anisotropic one the section along its tangent is written",
        ),
        _ => {}
    }
    if material.is_emissive() {
        console.warn("the format holds what a surface reflects: what it emits is left out");
    }
    Ok(())
}

/// What `info` says of a measured material.
pub(crate) fn describe(path: &Path) -> Result<Description, Failure> {
    let info = MeasuredBrdf::load(path, Lookup::default())?.describe();
    let albedo: Vec<_> = info
        .albedo
        .iter()
        .map(|a| json!({ "view_degrees": a.view_degrees, "albedo": a.albedo.to_array() }))
        .collect();
    let json = json!({
        "kind": "measured material", "name": info.name, "invalid_fraction": info.invalid_fraction,
        "max": info.max.to_array(), "max_at_degrees": info.max_at_degrees, "diffuse": info.diffuse.to_array(),
        "peak": info.peak.to_array(), "half_width_degrees": info.half_width_degrees, "albedo": albedo,
    });
    Ok(Description { text: info.to_string(), json })
}
