//! What is in a scene or an asset, in words.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use glam::Vec3;
use halflight_material::MaterialKind;

use crate::SceneError;
use crate::build::{Form, HeightSource, Object};
use crate::scene::{LoadOptions, Scene, outline};

/// What is in a scene, counted.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// The file.
    pub name: String,
    /// What the scene says it shows.
    pub about: Option<String>,
    /// Each shape: its name, what it is, how many copies there are.
    pub shapes: Vec<(String, String, usize)>,
    /// Triangles over all copies.
    pub triangles: usize,
    /// Spheres over all copies.
    pub spheres: usize,
    /// Lower and upper corner of what is not mere ground.
    pub bounds: (Vec3, Vec3),
    /// How many materials there are of each kind.
    pub materials: BTreeMap<&'static str, usize>,
    /// What shines.
    pub lights: Vec<String>,
    /// Seconds of motion, if there is one that ends or repeats.
    pub duration: Option<f64>,
    /// Whether anything depends on time.
    pub animated: bool,
    /// Size of the picture.
    pub size: [u32; 2],
    /// Techniques that the scene has settings for.
    pub techniques: Vec<String>,
    /// What the loader did that the user should know.
    pub warnings: Vec<String>,
}

/// Loads a scene file or an asset and says what is in it.
///
/// # Errors
/// As [`Scene::load`].
pub fn describe(path: &Path) -> Result<Description, SceneError> {
    Ok(Scene::load(path, &LoadOptions::default())?.description_of())
}

impl Scene {
    /// What is in the scene, counted.
    pub fn description_of(&self) -> Description {
        let mut description = Description {
            name: self.name.clone(),
            about: self.description.clone(),
            shapes: Vec::new(),
            triangles: 0,
            spheres: 0,
            bounds: outline(&self.objects, &[0.0]).bounds(),
            materials: BTreeMap::new(),
            lights: Vec::new(),
            duration: self.duration(),
            animated: self.is_animated(),
            size: self.image.size,
            techniques: self.techniques.iter().map(|(name, _)| name.clone()).collect(),
            warnings: self.warnings.clone(),
        };
        for object in &self.objects {
            let (what, triangles, spheres) = form_of(object);
            let copies = object.places.len();
            description.shapes.push((object.name.clone(), what, copies));
            description.triangles += copies * triangles;
            description.spheres += copies * spheres;
            if object.materials.iter().any(|&m| self.materials[m as usize].is_emissive()) {
                description.lights.push(object.name.clone());
            }
            if let Form::Model(model) = &object.form {
                let lights = model.model().lights.iter().map(|_| format!("light of {}", object.name));
                description.lights.extend(lights);
            }
        }
        for material in &self.materials {
            *description.materials.entry(kind_of(&material.kind)).or_default() += 1;
        }
        if let Some(environment) = &self.lights.environment {
            let ((width, height), mean) = (environment.map.size(), environment.mean_radiance());
            let [r, g, b] = mean.to_array();
            let text =
                format!("environment of {width} × {height} texels, mean radiance ({r:.3}, {g:.3}, {b:.3})");
            description.lights.push(text);
        }
        for delta in &self.lights.deltas {
            let kind = match delta {
                crate::lights::DeltaLight::Point { .. } => "point light",
                crate::lights::DeltaLight::Spot { .. } => "spot light",
                crate::lights::DeltaLight::Directional { .. } => "directional light",
            };
            description.lights.push(kind.into());
        }
        description
    }

    /// What is in the scene, in lines.
    pub fn describe(&self) -> String {
        self.description_of().to_string()
    }
}

fn form_of(object: &Object) -> (String, usize, usize) {
    match &object.form {
        Form::Mesh(part) => {
            let count = part.mesh.triangles.len();
            (format!("mesh of {count} triangles"), count, 0)
        }
        Form::Model(shape) => {
            let model = shape.model();
            let count: usize = shape.meshes(0.0).iter().map(|(mesh, _)| mesh.triangles.len()).sum();
            let mut what = format!("model of {count} triangles in {} meshes", model.meshes.len());
            for (count, noun) in [
                (model.nodes.len(), "nodes"),
                (model.skins.len(), "skins"),
                (model.animations.len(), "animations"),
                (model.images.len(), "pictures"),
                (model.cameras.len(), "cameras"),
            ] {
                if count > 0 {
                    what += &format!(", {count} {noun}");
                }
            }
            (what, count, 0)
        }
        Form::Spheres(spheres, _) => match spheres.len() {
            1 => ("sphere".into(), 0, 1),
            count => (format!("{count} spheres"), 0, count),
        },
        Form::MovingSpheres(spheres) => (format!("{} spheres from a file", spheres.len()), 0, spheres.len()),
        Form::Rectangle => ("rectangle".into(), 0, 0),
        Form::Disk => ("disk".into(), 0, 0),
        Form::Field(shape) => {
            let from = &shape.tracer.field().provenance;
            (format!("field learned from {} ({} triangles)", from.source, from.source_triangles), 0, 0)
        }
        Form::Heights(HeightSource::Still(field), _) => {
            let (low, high) = field
                .heights
                .iter()
                .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &h| (low.min(h), high.max(h)));
            (format!("height field of {} × {} posts, {low} to {high} m", field.columns, field.rows), 0, 0)
        }
        Form::Heights(..) => ("height field that changes with time".into(), 0, 0),
    }
}

fn kind_of(kind: &MaterialKind) -> &'static str {
    match kind {
        MaterialKind::Black => "black",
        MaterialKind::Diffuse { .. } => "diffuse",
        MaterialKind::Phong { .. } => "phong",
        MaterialKind::Conductor { .. } => "conductor",
        MaterialKind::Dielectric { .. } => "dielectric",
        MaterialKind::MetallicRoughness { .. } => "metallic-roughness",
        MaterialKind::Measured(_) => "measured",
        MaterialKind::Mix { .. } => "mix",
    }
}

impl fmt::Display for Description {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// Longer lists are cut.
        const MANY: usize = 24;
        writeln!(f, "{}", self.name)?;
        if let Some(about) = &self.about {
            writeln!(f, "  {about}")?;
        }
        let (low, high) = self.bounds;
        let size = high - low;
        writeln!(f, "  picture    {} × {} pixels", self.size[0], self.size[1])?;
        writeln!(f, "  extent     {} × {} × {} m, from {low} to {high}", size.x, size.y, size.z)?;
        writeln!(
            f,
            "  contents   {} triangles, {} spheres, {} shapes",
            self.triangles,
            self.spheres,
            self.shapes.len()
        )?;
        for (name, what, copies) in self.shapes.iter().take(MANY) {
            let copies = if *copies == 1 { String::new() } else { format!(", {copies} copies") };
            writeln!(f, "    {name}: {what}{copies}")?;
        }
        if self.shapes.len() > MANY {
            writeln!(f, "    … and {} more", self.shapes.len() - MANY)?;
        }
        let kinds: Vec<String> =
            self.materials.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
        writeln!(f, "  materials  {}", if kinds.is_empty() { "none".into() } else { kinds.join(", ") })?;
        let lights = if self.lights.is_empty() { "none".into() } else { self.lights.join(", ") };
        writeln!(f, "  lights     {lights}")?;
        match (self.animated, self.duration) {
            (true, Some(duration)) => writeln!(f, "  motion     {duration:.2} s")?,
            (true, None) => writeln!(f, "  motion     without end")?,
            (false, _) => writeln!(f, "  motion     none")?,
        }
        if !self.techniques.is_empty() {
            writeln!(f, "  settings   for {}", self.techniques.join(", "))?;
        }
        for warning in &self.warnings {
            writeln!(f, "  note       {warning}")?;
        }
        Ok(())
    }
}
