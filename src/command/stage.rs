//! The scene of a command, with the changes that the command line makes to it; and the machine it runs on.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use halflight::job::{Changes, Size, Stage};
use halflight_material::Material;
use halflight_scene::Up;
use halflight_trace::Simd;

use super::failure::Failure;
use super::parse::assignment;

/// [`Up`] as the command line names it.
#[derive(clap::ValueEnum, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum UpAxis {
    /// As in glTF
    #[default]
    Y,
    /// As in programs that design and print
    Z,
}

/// Changes to a scene.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct SceneArgs {
    /// The axis of a bare model that points up
    #[arg(long, value_name = "AXIS", value_enum, default_value_t = UpAxis::Y, help_heading = "Scene")]
    pub(crate) up: UpAxis,
    /// Light from all around: a map (.hdr, .exr, .png), or sky, studio, black
    #[arg(long, value_name = "FILE", help_heading = "Scene")]
    pub(crate) environment: Option<PathBuf>,
    /// Material of a bare asset, or of shapes without one: a type and its keys ("phong exponent=40"), a metal, or a
    /// measured .binary file. NAME=SPEC replaces the material NAME of a scene file
    #[arg(long, value_name = "SPEC", help_heading = "Scene")]
    pub(crate) material: Option<String>,
    /// A field (.ddf) in place of the mesh of a shape of a scene file, or another mesh; repeatable
    #[arg(long = "shape", value_name = "NAME=FILE", value_parser = assignment, help_heading = "Scene")]
    pub(crate) shape: Vec<(String, String)>,
    /// Set any key of the scene (camera.aperture_radius=0.05) or of a technique (path.max_depth=4); repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = checked_assignment, help_heading = "Scene")]
    pub(crate) set: Vec<String>,
    /// The size of the picture, by which bare assets are framed.
    #[arg(skip)]
    pub(crate) size: Option<Size>,
}

fn checked_assignment(text: &str) -> Result<String, String> {
    assignment(text).map(|_| text.to_string())
}

/// How the machine is used.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct MachineArgs {
    /// Threads to work with; the picture does not depend on it [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = "Machine")]
    pub(crate) threads: Option<u16>,
    /// Instruction set; the picture depends on it in the last bits
    #[arg(long, value_name = "LEVEL", value_enum, default_value_t, help_heading = "Machine")]
    pub(crate) simd: SimdLevel,
}

/// The instruction sets by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum SimdLevel {
    /// The best this machine has
    #[default]
    Auto,
    /// What every machine of the kind has
    Baseline,
    /// AVX2 and FMA
    Avx2,
    /// AVX-512
    Avx512,
}

impl MachineArgs {
    /// Starts the threads.
    pub(crate) fn apply(&self) -> Result<(), Failure> {
        let Some(threads) = self.threads else { return Ok(()) };
        rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(threads))
            .build_global()
            .map_err(|e| Failure::failed(format!("cannot start {threads} threads: {e}")))
    }

    /// The instruction set, if this machine has it.
    pub(crate) fn simd(&self) -> Result<Simd, Failure> {
        let name = match self.simd {
            SimdLevel::Auto => return Ok(Simd::detect()),
            SimdLevel::Baseline => "baseline",
            SimdLevel::Avx2 => "avx2",
            SimdLevel::Avx512 => "avx512",
        };
        Simd::from_name(name).map_err(Failure::failed)
    }
}

/// Loads a scene file, a bare asset or a demo.
pub(crate) fn load(path: &Path, changes: &SceneArgs, machine: &MachineArgs) -> Result<Stage, Failure> {
    Ok(Stage::load(path, &changes.changes(), machine.simd()?)?)
}

impl SceneArgs {
    fn changes(&self) -> Changes {
        Changes {
            up: match self.up {
                UpAxis::Y => Up::Y,
                UpAxis::Z => Up::Z,
            },
            environment: self.environment.clone(),
            material: self.material.clone(),
            shapes: self.shape.clone(),
            set: self.set.clone(),
            size: self.size,
        }
    }
}

/// The material that a text describes: `phong exponent=40`.
pub(crate) fn material(spec: &str) -> Result<Material, Failure> {
    halflight_scene::material_from_text(spec).map_err(Failure::failed)
}
