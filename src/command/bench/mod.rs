//! `halflight bench`: how fast it is and how much memory it takes, measured here and now.

mod bandwidth;
mod build;
mod clock;
mod covariance;
mod ddf;
mod memory;
mod path;
mod photons;
mod rays;
mod samplers;
mod sh;
mod shadow_fields;
mod shexp;
mod subjects;
mod textures;

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use super::console::Console;
use super::failure::Failure;
use super::stage::MachineArgs;
use super::table::Table;
use super::{interrupt, resources};

#[derive(Args, Debug)]
pub(crate) struct BenchArgs {
    /// What to measure [default: everything]
    #[arg(value_enum)]
    name: Option<Name>,
    /// Folder with `data/` (meshes) and `reference/` (pictures); what is missing there is passed over
    #[arg(long, value_name = "FOLDER", default_value = "../shared")]
    data: PathBuf,
    /// Folder with the scene files of the reference pictures
    #[arg(long, value_name = "FOLDER", default_value = "tests/reference")]
    scenes: PathBuf,
    /// One small mesh made of formulas, and short runs: a check that it works more than a measurement
    #[arg(long)]
    quick: bool,
    /// Folder for the maps of the technique `covariance`: predicted and optimal density, errors, filters
    #[arg(long, value_name = "FOLDER")]
    maps: Option<PathBuf>,
    #[command(flatten)]
    machine: MachineArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Name {
    /// Rays per second: closest and any hit, coherent and incoherent
    Rays,
    /// Time to build and to refit the trees that answer rays
    Build,
    /// Processor time of the technique `path` to a given error
    Path,
    /// Peak memory of a render
    Memory,
    /// Error of the sampler against independent random numbers
    Samplers,
    /// Error and memory of the fields of the technique `shadow-fields`
    ShadowFields,
    /// Fields of directed distances against the trees of their meshes
    Ddf,
    /// Kernels of spherical harmonics
    Sh,
    /// The technique `bandwidth` against forward shading at equal error, its stages, and how its cost grows
    Bandwidth,
    /// The technique `covariance` against `path` at equal error, its prediction, its photons, its cost
    Covariance,
    /// The technique `shexp` on three moving scenes, and how its cost grows
    Shexp,
}

const ALL: [Name; 11] = [
    Name::Ddf,
    Name::Rays,
    Name::Build,
    Name::Path,
    Name::Memory,
    Name::Samplers,
    Name::ShadowFields,
    Name::Sh,
    Name::Shexp,
    Name::Bandwidth,
    Name::Covariance,
];

/// A table with what one must know to read it.
struct Findings {
    title: &'static str,
    table: Table,
    /// How it was measured, and what was passed over.
    notes: Vec<String>,
}

pub(crate) fn run(args: &BenchArgs, console: Console) -> Result<(), Failure> {
    args.machine.apply()?;
    interrupt::listen();
    console.answer(&format!(
        "{}, {} threads, {}\n",
        resources::cpu_model(),
        rayon::current_num_threads(),
        args.machine.simd()?.name()
    ));
    for name in args.name.map_or(ALL.to_vec(), |name| vec![name]) {
        let findings = match name {
            Name::Rays => rays::measure(args)?,
            Name::Build => build::measure(args)?,
            Name::Path => path::measure(args)?,
            Name::Memory => memory::measure(args)?,
            Name::Ddf => {
                tell(console, &ddf::networks(args)?);
                tell(console, &ddf::pictures(args)?);
                ddf::measure(args)?
            }
            Name::Samplers => samplers::measure(args),
            Name::ShadowFields => shadow_fields::measure(args)?,
            Name::Sh => sh::measure(args)?,
            Name::Bandwidth => {
                tell(console, &bandwidth::equal_quality(args)?);
                bandwidth::growth(args)?
            }
            Name::Covariance => {
                tell(console, &textures::footprints(args)?);
                tell(console, &photons::kernels(args)?);
                tell(console, &covariance::overhead(args)?);
                covariance::equal_error(args)?
            }
            Name::Shexp => {
                tell(console, &shexp::scenes(args)?);
                tell(console, &shexp::errors(args)?);
                shexp::growth(args)?
            }
        };
        tell(console, &findings);
        if interrupt::is_asked_to_stop() {
            return Err(Failure::Interrupted);
        }
    }
    Ok(())
}

fn tell(console: Console, findings: &Findings) {
    let mut text = format!("{}\n\n", findings.title);
    if !findings.table.is_empty() {
        text += &format!("{}\n\n", findings.table.to_text());
    }
    for note in &findings.notes {
        text += &format!("  {note}\n");
    }
    console.answer(&text);
    console.event(
        "bench",
        json!({ "title": findings.title, "rows": findings.table.to_json(), "notes": findings.notes }),
    );
}
