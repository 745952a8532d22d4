//! A scene with the changes that a command or a program makes to it.

use std::path::{Path, PathBuf};

use halflight_file::extension;
use halflight_image::ToneCurve;
use halflight_render::techniques;
use halflight_scene::schema::Table;
use halflight_scene::spec::ToneName;
use halflight_scene::{Frame, LoadOptions, Scene, Up};
use halflight_trace::Simd;
use serde_json::json;

use super::{JobError, Size};
use crate::demos::{self, Demo};

/// Changes to a scene as it was written.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    /// The axis of a bare model that points up.
    pub up: Up,
    /// Light from all around: a map, or `sky`, `studio`, `black`.
    pub environment: Option<PathBuf>,
    /// Material of a bare asset, or of shapes without one; `NAME=SPEC` replaces one of a scene file.
    pub material: Option<String>,
    /// Fields (`.ddf`) in place of meshes, or other meshes: names of shapes, and files.
    pub shapes: Vec<(String, String)>,
    /// `key=value`, of the scene or of a technique.
    pub set: Vec<String>,
    /// The size of the picture, by which bare assets are framed.
    pub size: Option<Size>,
}

/// A loaded scene.
pub struct Stage {
    /// What was asked for.
    name: String,
    scene: Scene,
    simd: Simd,
    hash: String,
    technique_settings: Vec<String>,
    /// Whether it is a bare environment map.
    is_map: bool,
}

impl Stage {
    /// Loads a scene file, a bare asset or a demo (`demo:NAME`), for rays of an instruction set.
    ///
    /// # Errors
    /// Whatever is wrong with the scene or the changes.
    pub fn load(path: &Path, changes: &Changes, simd: Simd) -> Result<Self, JobError> {
        let (of_technique, of_scene): (Vec<String>, Vec<String>) =
            changes.set.iter().cloned().partition(|text| is_of_technique(text));
        // As text of TOML, whose strings are those of JSON for what file names hold.
        let shape = |(name, file): &(String, String)| {
            let key = if extension(file.as_ref()) == "ddf" { "field" } else { "file" };
            format!("shape.{name}.{key}={}", json!(file))
        };
        let shapes = changes.shapes.iter().map(shape);
        let options = LoadOptions {
            environment: changes.environment.clone(),
            material: changes.material.clone(),
            size: changes.size.map(|size| [size.width as u32, size.height as u32]),
            set: of_scene.into_iter().chain(shapes).collect(),
            simd,
            up: changes.up,
        };
        let scene = match demos::built_in(path)? {
            Some(demo) => load_text(demo, &options)?,
            None => Scene::load(path, &options).map_err(JobError::failed)?,
        };
        for (name, _) in scene.techniques() {
            techniques::find(name).map_err(|e| JobError::failed(format!("{}: {e}", path.display())))?;
        }
        let hash = format!("{:016x}", scene.hash());
        let is_map = matches!(extension(path).as_str(), "hdr" | "exr");
        let name = path.display().to_string();
        Ok(Self { name, scene, simd, hash, technique_settings: of_technique, is_map })
    }

    /// The file or the demo, as it was asked for.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What there is.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What there is, to keep.
    pub fn into_scene(self) -> Scene {
        self.scene
    }

    /// What the loader did that the user should know.
    pub fn warnings(&self) -> &[String] {
        self.scene.warnings()
    }

    /// Of everything that the scene was made from.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// The instruction set by name.
    pub fn simd_name(&self) -> &'static str {
        self.simd.name()
    }

    /// The size of the picture that the scene asks for.
    pub fn size(&self) -> Size {
        let [width, height] = self.scene.image().size;
        Size { width: width as usize, height: height as usize }
    }

    /// The exposure that the scene asks for.
    pub fn exposure_ev(&self) -> f32 {
        self.scene.image().exposure_ev
    }

    /// Whether the exposure is found from what the picture shows, because nothing else tells: of a bare environment map.
    pub fn exposes_itself(&self) -> bool {
        self.is_map && self.exposure_ev() == 0.0
    }

    /// The tone curve that the scene asks for.
    pub fn tone(&self) -> ToneCurve {
        match self.scene.image().tone {
            ToneName::Srgb => ToneCurve::Srgb,
            ToneName::Filmic => ToneCurve::Filmic,
        }
    }

    /// What the scene holds, in lines.
    pub fn describe(&self) -> String {
        self.scene.describe()
    }

    /// The scene at one time.
    ///
    /// # Errors
    /// If it cannot be posed there.
    pub fn frame(&self, time_seconds: f64) -> Result<Frame, JobError> {
        self.scene.at(time_seconds).map_err(JobError::failed)
    }

    /// What the scene and `--set` say about a technique.
    ///
    /// # Errors
    /// Settings that cannot be read.
    pub fn technique_settings(&self, name: &str) -> Result<Table, JobError> {
        let mut table = self.scene.technique(name).cloned().unwrap_or_else(Table::empty);
        for setting in &self.technique_settings {
            if let Some(rest) = setting.strip_prefix(name).and_then(|rest| rest.strip_prefix('.')) {
                table.assign("--set", rest).map_err(JobError::failed)?;
            }
        }
        Ok(table)
    }
}

/// Scenes are loaded from files, so a built-in one becomes a file for as long as that takes.
fn load_text(demo: &Demo, options: &LoadOptions) -> Result<Scene, JobError> {
    let failure =
        |e: std::io::Error| JobError::failed(format!("cannot unpack the demo scene {}: {e}", demo.name));
    let folder = tempfile::tempdir().map_err(failure)?;
    let path = folder.path().join(format!("{}.toml", demo.name));
    demo.unpack(&path)?;
    Scene::load(&path, options).map_err(JobError::failed)
}

/// Whether a setting belongs to a technique: `path.max_depth=4`.
fn is_of_technique(setting: &str) -> bool {
    let rest = |name: &str| setting.strip_prefix(name).is_some_and(|rest| rest.starts_with('.'));
    techniques::TECHNIQUES.iter().any(|entry| rest(entry.name))
}
