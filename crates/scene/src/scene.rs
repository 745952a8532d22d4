//! A scene: what there is, as functions of time.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use halflight_material::Material;
use halflight_trace::Simd;

use crate::SceneError;
use crate::build::{Builder, CameraRig, Form, LightRig, Object, studio};
use crate::framing::Outline;
use crate::media::Media;
use crate::schema::{Kind, Origin, Problem, Source, Table, Value};
use crate::spec::{self, ImageSpec, SceneSpec};
use crate::{bare, build};

/// Which axis of a bare model points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// +y, as in glTF and in scenes.
    #[default]
    Y,
    /// +z, as of programs that design and print: the model is turned so that its z becomes y and its y goes back.
    Z,
}

/// What a command may change about a scene while it is loaded.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// Light from all around instead of the scene's: a picture, or `studio`, `sky`, `black`.
    pub environment: Option<PathBuf>,
    /// A material, as [`material_from_text`](crate::material_from_text) takes it. Of a bare asset it is that of the
    /// asset; in a scene file that of the shapes which name none; `NAME=TEXT` replaces the material NAME of the file.
    pub material: Option<String>,
    /// Width and height of the picture instead of the scene's.
    pub size: Option<[u32; 2]>,
    /// Settings as `key=value`; see [`Table::assign`].
    pub set: Vec<String>,
    /// Which axis of a bare model points up; other assets and scene files do not ask.
    pub up: Up,
    /// The instructions that rays are traced with.
    pub simd: Simd,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            environment: None,
            material: None,
            size: None,
            set: Vec::new(),
            up: Up::Y,
            simd: Simd::detect(),
        }
    }
}

impl LoadOptions {
    /// What they say about the scene: not how large its picture is, nor with which instructions it is made.
    pub(crate) fn said(&self) -> String {
        format!("{:?}", Self { size: None, simd: Simd::Baseline, ..self.clone() })
    }
}

/// What there is, as functions of time: shapes, materials, lights, camera. [`Scene::at`] gives one instant of it.
pub struct Scene {
    pub(crate) name: String,
    pub(crate) description: Option<String>,
    pub(crate) image: ImageSpec,
    pub(crate) camera: CameraRig,
    pub(crate) materials: Vec<Arc<Material>>,
    pub(crate) objects: Vec<Object>,
    pub(crate) lights: LightRig,
    pub(crate) media: Arc<Media>,
    pub(crate) techniques: Vec<(String, Table)>,
    pub(crate) warnings: Vec<String>,
    pub(crate) files: Vec<PathBuf>,
    /// Everything that was said about the scene in words, for its hash.
    pub(crate) said: String,
    pub(crate) simd: Simd,
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Scene({}, {} shapes, {} materials)", self.name, self.objects.len(), self.materials.len())
    }
}

impl Scene {
    /// Loads a scene file (`.toml`), or makes a scene of a bare asset: a model (`.ply`, `.obj`, `.gltf`, `.glb`), a
    /// picture of heights (`.tif`, 16-bit `.png`), an environment map (`.hdr`, `.exr`) or a measured material
    /// (`.binary`); any of them packed as `.xz`.
    ///
    /// ```no_run
    /// use halflight_scene::{LoadOptions, Scene};
    /// let scene = Scene::load("bunny.ply".as_ref(), &LoadOptions::default())?;
    /// let frame = scene.at(0.0)?;
    /// println!("{} materials, {} instances", frame.materials.len(), frame.world.instances().len());
    /// # Ok::<(), halflight_scene::SceneError>(())
    /// ```
    ///
    /// # Errors
    /// Whatever is wrong with the scene file, the assets it names, or the options, with places and ways out.
    pub fn load(path: &Path, options: &LoadOptions) -> Result<Self, SceneError> {
        if halflight_file::extension(path) != "toml" {
            return bare::load(path, options);
        }
        let bytes = halflight_file::read(path, "scene")?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let at = error.utf8_error().valid_up_to() as u64;
            halflight_file::LoadError::new("scene", path, "this is not UTF-8 text")
                .at(halflight_file::Place::Byte(at))
        })?;
        let source = Source::file(path, text);
        let mut table = Table::parse(&source)?;
        apply_settings(&mut table, options)?;
        let said = format!("{}\n{}", source.text, options.said());
        Self::build(path.display().to_string(), &table, options, said)
    }

    /// Reads a scene file's text without loading what it names: checks keys, types and values. `name` is for errors,
    /// and relative paths start from its folder.
    ///
    /// # Errors
    /// Whatever is wrong with the text.
    pub fn parse(text: &str, name: &Path) -> Result<SceneSpec, SceneError> {
        let table = Table::parse(&Source::file(name, text))?;
        Ok(spec::read_spec(&table)?)
    }

    /// Builds what a table describes.
    pub(crate) fn build(
        name: String,
        table: &Table,
        options: &LoadOptions,
        said: String,
    ) -> Result<Self, SceneError> {
        let spec = spec::read_spec(table)?;
        let mut builder = Builder::default();
        if let Some(text) = &options.material {
            override_material(&mut builder, text, &spec)?;
        }
        builder.named_materials(&spec.material.0);
        if let Some(text) = &options.material {
            replace_named(&mut builder, text)?;
        }
        let mut objects = builder.shapes(&spec.shape);
        let (deltas, shining) = builder.lights(&spec.light);
        objects.extend(shining);
        let environment = match &spec.environment {
            Some(environment) => build::environment(environment, &mut builder),
            None => {
                let lights = |o: &Object| matches!(&o.form, Form::Model(m) if !m.model().lights.is_empty());
                let lit = !deltas.is_empty()
                    || objects.iter().any(lights)
                    || objects
                        .iter()
                        .flat_map(|o| o.materials.iter())
                        .any(|&m| builder.materials[m as usize].is_emissive());
                (!lit).then(studio)
            }
        };
        let outline = outline(&objects, &[0.0]);
        let camera = builder.camera(spec.camera.as_ref(), &outline, spec.image.size);
        Self::finish(name, said, options, builder, spec, objects, LightRig { environment, deltas }, camera)
    }

    pub(crate) fn finish(
        name: String,
        said: String,
        options: &LoadOptions,
        mut builder: Builder,
        spec: SceneSpec,
        objects: Vec<Object>,
        lights: LightRig,
        camera: CameraRig,
    ) -> Result<Self, SceneError> {
        let media = Arc::new(builder.media(&spec.medium));
        let Builder { reader, warnings, files, materials, .. } = builder;
        reader.finish(Some(()))?;
        Ok(Self {
            name,
            description: spec.description,
            image: spec.image,
            camera,
            materials,
            objects,
            lights,
            media,
            techniques: spec.technique.0.into_iter().map(|(name, table)| (name.value, table)).collect(),
            warnings,
            files,
            said,
            simd: options.simd,
        })
    }

    /// The file it came from.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the scene says it shows.
    pub fn description(&self) -> Option<&str> {
        self.description.as_deref()
    }

    /// Size, exposure and tone curve of the picture.
    pub fn image(&self) -> &ImageSpec {
        &self.image
    }

    /// The materials; frames have the same.
    pub fn materials(&self) -> &[Arc<Material>] {
        &self.materials
    }

    /// What the settings of a technique say, as they were written; `None` if the scene says nothing of it.
    pub fn technique(&self, name: &str) -> Option<&Table> {
        self.techniques.iter().find(|(known, _)| known == name).map(|(_, table)| table)
    }

    /// The techniques that the scene has settings for, with these.
    pub fn techniques(&self) -> &[(String, Table)] {
        &self.techniques
    }

    /// What the loader did that the user should know.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Every file that was read beside the scene file itself.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// What the camera takes for up: what the scene says, or of a camera that is placed by a transform the axis of the
    /// world nearest to the top of its picture.
    pub fn camera_up(&self) -> glam::Vec3 {
        self.camera.up()
    }

    /// Whether anything depends on time.
    pub fn is_animated(&self) -> bool {
        self.camera.moves() || self.objects.iter().any(Object::is_animated)
    }

    /// Seconds until all keyframes and animations from files have ended or begin again; `None` if there are none.
    /// Waves and other endless motions do not count.
    pub fn duration(&self) -> Option<f64> {
        self.objects.iter().filter_map(Object::duration).chain(self.camera.end()).reduce(f64::max)
    }

    /// A number that changes when anything changes that the scene was made from: its text, the options, or the bytes of
    /// the files that it names. The size of the picture and the instruction set are not of the scene: whoever keeps
    /// samples adds both. Reads the files again.
    pub fn hash(&self) -> u64 {
        let mut hash = Fnv::default();
        hash.add(self.said.as_bytes());
        for file in &self.files {
            hash.add(&std::fs::read(file).unwrap_or_default());
        }
        hash.0
    }
}

/// What objects reach over several times.
pub(crate) fn outline(objects: &[Object], times: &[f64]) -> Outline {
    let all_ground = objects.iter().all(|object| object.ground);
    let shown = objects.iter().filter(|object| all_ground || !object.ground);
    Outline::new(shown.flat_map(|object| times.iter().flat_map(|&time| object.outline(time))).collect())
}

/// Applies `--set`, `--environment` and the size to a scene file's table.
pub(crate) fn apply_settings(table: &mut Table, options: &LoadOptions) -> Result<(), Problem> {
    for setting in &options.set {
        table.assign("--set", setting)?;
    }
    if let Some(environment) = &options.environment {
        let text = environment.display().to_string();
        let origin = Origin::whole(&Source::option("--environment", text.clone()));
        let value = Value { origin: origin.clone(), kind: Kind::Text(text) };
        table.entries.retain(|entry| entry.name != "environment");
        table.entries.push(crate::schema::Entry { name: "environment".into(), key: origin, value });
    }
    if let Some([width, height]) = options.size {
        table.assign("--size", &format!("image.size=[{width}, {height}]"))?;
    }
    Ok(())
}

/// `NAME=TEXT` of `--material`: the name, if the text before the equals sign is one.
fn named_override(text: &str) -> Option<(&str, &str)> {
    let (name, rest) = text.split_once('=')?;
    let name = name.trim();
    // `phong exponent=40` sets a key of phong; a name stands alone.
    (!name.contains([' ', ':', ',']) && !name.is_empty()).then_some((name, rest))
}

/// A material for the shapes that name none.
fn override_material(builder: &mut Builder, text: &str, spec: &SceneSpec) -> Result<(), SceneError> {
    if let Some((name, _)) = named_override(text) {
        let names = spec.material.0.iter().map(|(name, _)| name.value.as_str());
        if !names.clone().any(|known| known == name) {
            let origin = Origin::whole(&Source::option("--material", text));
            let problem = Problem::new(&origin, format!("there is no material `{name}` to replace"));
            return Err(problem.offer(name, names).into());
        }
        return Ok(());
    }
    let material = build::material_from_text(text, builder)?;
    builder.set_default_material(material);
    Ok(())
}

/// A material instead of one that the scene names.
fn replace_named(builder: &mut Builder, text: &str) -> Result<(), SceneError> {
    let Some((name, rest)) = named_override(text) else { return Ok(()) };
    let mut material = build::material_from_text(rest, builder)?;
    material.name = name.into();
    if let Some(entry) = builder.named.get(name) {
        let index = entry.index as usize;
        builder.materials[index] = Arc::new(material);
    }
    Ok(())
}

/// Fowler, Noll and Vo's hash (FNV-1a) over words of eight bytes: quick, and the same everywhere.
struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    fn add(&mut self, bytes: &[u8]) {
        let mut mix = |word: u64| {
            self.0 = (self.0 ^ word).wrapping_mul(0x0000_0100_0000_01b3);
            self.0 ^= self.0 >> 29;
        };
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            mix(u64::from_le_bytes(word));
        }
        mix(bytes.len() as u64);
    }
}
