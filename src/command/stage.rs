//! The scene of a command, with the changes that the command line makes to it; and the machine it runs on.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use halflight_material::Material;
use halflight_render::techniques;
use halflight_scene::schema::Table;
use halflight_scene::spec::ToneName;
use halflight_scene::{Frame, LoadOptions, Scene, Up};
use halflight_trace::Simd;
use serde_json::json;

use super::demo::{self, Demo};
use super::failure::Failure;
use super::output::Tone;
use super::parse::{Size, assignment};

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
    /// A field (.ddf) in place of the mesh of a shape of a scene file; repeatable
    #[arg(long = "shape", value_name = "NAME=FIELD", value_parser = assignment, help_heading = "Scene")]
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

/// A loaded scene.
pub(crate) struct Stage {
    scene: Scene,
    simd: Simd,
    hash: String,
    technique_settings: Vec<String>,
}

impl Stage {
    /// Loads a scene file or a bare asset.
    pub(crate) fn load(path: &Path, changes: &SceneArgs, machine: &MachineArgs) -> Result<Self, Failure> {
        let simd = machine.simd()?;
        let (of_technique, of_scene): (Vec<String>, Vec<String>) =
            changes.set.iter().cloned().partition(|text| is_of_technique(text));
        // As text of TOML, whose strings are those of JSON for what file names hold.
        let field = |(name, file): &(String, String)| format!("shape.{name}.field={}", json!(file));
        let fields = changes.shape.iter().map(field);
        let options = LoadOptions {
            environment: changes.environment.clone(),
            material: changes.material.clone(),
            size: changes.size.map(|size| [size.width as u32, size.height as u32]),
            set: of_scene.into_iter().chain(fields).collect(),
            simd,
            up: match changes.up {
                UpAxis::Y => Up::Y,
                UpAxis::Z => Up::Z,
            },
        };
        let scene = match demo::built_in(path)? {
            Some(demo) => load_text(demo, &options)?,
            None => Scene::load(path, &options).map_err(Failure::failed)?,
        };
        for (name, _) in scene.techniques() {
            techniques::find(name).map_err(|e| Failure::failed(format!("{}: {e}", path.display())))?;
        }
        let hash = format!("{:016x}", scene.hash());
        Ok(Self { scene, simd, hash, technique_settings: of_technique })
    }

    pub(crate) fn scene(&self) -> &Scene {
        &self.scene
    }

    pub(crate) fn into_scene(self) -> Scene {
        self.scene
    }

    /// What the loader did that the user should know.
    pub(crate) fn warnings(&self) -> &[String] {
        self.scene.warnings()
    }

    /// Of everything that the scene was made from.
    pub(crate) fn hash(&self) -> &str {
        &self.hash
    }

    pub(crate) fn simd_name(&self) -> &'static str {
        self.simd.name()
    }

    /// The size of the picture that the scene asks for.
    pub(crate) fn size(&self) -> Size {
        let [width, height] = self.scene.image().size;
        Size { width: width as usize, height: height as usize }
    }

    /// The exposure that the scene asks for.
    pub(crate) fn exposure_ev(&self) -> f32 {
        self.scene.image().exposure_ev
    }

    /// The tone curve that the scene asks for.
    pub(crate) fn tone(&self) -> Tone {
        match self.scene.image().tone {
            ToneName::Srgb => Tone::Srgb,
            ToneName::Filmic => Tone::Filmic,
        }
    }

    /// What the scene holds, in lines.
    pub(crate) fn describe(&self) -> String {
        self.scene.describe()
    }

    /// The scene at one time.
    pub(crate) fn frame(&self, time_seconds: f64) -> Result<Frame, Failure> {
        self.scene.at(time_seconds).map_err(Failure::failed)
    }

    /// What the scene and `--set` say about a technique.
    pub(crate) fn technique_settings(&self, name: &str) -> Result<Table, Failure> {
        let mut table = self.scene.technique(name).cloned().unwrap_or_else(Table::empty);
        for setting in &self.technique_settings {
            if let Some(rest) = setting.strip_prefix(name).and_then(|rest| rest.strip_prefix('.')) {
                table.assign("--set", rest).map_err(Failure::failed)?;
            }
        }
        Ok(table)
    }
}

/// Scenes are loaded from files, so a built-in one becomes a file for as long as that takes.
fn load_text(demo: &Demo, options: &LoadOptions) -> Result<Scene, Failure> {
    let failure =
        |e: std::io::Error| Failure::failed(format!("cannot unpack the demo scene {}: {e}", demo.name));
    let folder = tempfile::tempdir().map_err(failure)?;
    let path = folder.path().join(format!("{}.toml", demo.name));
    demo.unpack(&path)?;
    Scene::load(&path, options).map_err(Failure::failed)
}

/// Whether a setting belongs to a technique: `path.max_depth=4`.
fn is_of_technique(setting: &str) -> bool {
    let rest = |name: &str| setting.strip_prefix(name).is_some_and(|rest| rest.starts_with('.'));
    techniques::TECHNIQUES.iter().any(|entry| rest(entry.name))
}

/// The material that a text describes: `phong exponent=40`.
pub(crate) fn material(spec: &str) -> Result<Material, Failure> {
    halflight_scene::material_from_text(spec).map_err(Failure::failed)
}
