//! `halflight ddf`: geometry as a learned field of directed distances.

mod ablate;
mod convert;
mod eval;
mod learner;
mod render;
mod sheet;
mod train;

pub(crate) use sheet::radiance;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use halflight_ddf::{DirectedField, mesh_hash};
use halflight_shape::{TriangleMesh, load_model};
use serde_json::json;

use super::console::{Console, ProgressStyle};
use super::failure::Failure;

#[derive(Args, Debug)]
pub(crate) struct DdfArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Learn the field of a mesh
    Train(train::TrainArgs),
    /// Say how far a field is from its mesh: points, depths, normals, hits and misses
    Eval {
        /// The .ddf file
        field: PathBuf,
        /// The mesh that it was learned from
        mesh: PathBuf,
        /// Points a side, and rays of each kind
        #[arg(long, value_name = "N", default_value_t = 30_000, value_parser = clap::value_parser!(u32).range(100..=3_000_000))]
        points: u32,
    },
    /// Show a field: distance and normals, beside its mesh if it is given
    Render(render::RenderFieldArgs),
    /// Turn a field into a mesh, or into spheres, by its unsigned distances
    Mesh(convert::MeshArgs),
    /// Draw samples of a mesh's field and write them to a file
    Samples(convert::SamplesArgs),
    /// Train on more and more samples of each kind: table and plot of how near the fields come
    Ablate(ablate::AblateArgs),
}

pub(crate) fn run(args: &DdfArgs, console: Console) -> Result<(), Failure> {
    match &args.action {
        Action::Train(args) => train::run(args, console),
        Action::Eval { field, mesh, points } => eval::run(field, mesh, *points as usize, console),
        Action::Render(args) => render::run(args, console),
        Action::Mesh(args) => convert::mesh(args, console),
        Action::Samples(args) => convert::samples(args, console),
        Action::Ablate(args) => ablate::run(args, console),
    }
}

/// How far something is that takes long, in whichever form progress is wanted.
fn tell(console: Console, what: &str, part: f32) {
    match console.progress_style() {
        ProgressStyle::None => {}
        ProgressStyle::Json => console.event("progress", json!({ "what": what, "fraction": part })),
        _ => console.note(&format!("{what}: {:.0} %", 100.0 * part)),
    }
}

/// Says so if a mesh is another than a field was learned from.
fn warn_of_other_mesh(field: (&Path, &DirectedField), mesh: (&Path, &TriangleMesh), console: Console) {
    let from = &field.1.provenance;
    if !from.source_hash.is_empty() && mesh_hash(mesh.1) != from.source_hash {
        console.warn(&format!(
            "{} is not the mesh that {} was learned from ({}, {} triangles)",
            mesh.0.display(),
            field.0.display(),
            from.source,
            from.source_triangles
        ));
    }
}

/// A mesh from a file, with all its parts where they stand, repaired as far as it can be.
fn load_mesh(path: &Path, console: Console) -> Result<TriangleMesh, Failure> {
    let model = load_model(path)?;
    model.warnings.iter().for_each(|warning| console.warn(warning));
    let mut mesh = model.rest_surface().mesh;
    let flaws = mesh.repair().map_err(|error| Failure::failed(format!("{}: {error}", path.display())))?;
    let name = path.display().to_string();
    flaws.sentences(&name).iter().for_each(|sentence| console.warn(sentence));
    Ok(mesh)
}
