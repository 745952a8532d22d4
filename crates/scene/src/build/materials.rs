//! Materials of scene files.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use halflight_file::LoadError;
use halflight_image::ColorSpace;
use halflight_material::{
    ColorInput, ConductorColor, Levels, Lookup, Material, MaterialKind, MeasuredBrdf, NormalMap, Opacity,
    ScalarInput, Texture, UvTransform, Wrap,
};

use super::{Builder, Displacement, MaterialEntry};
use crate::SceneError;
use crate::schema::{self, At, FilePath, Kind, Origin, Problem, Reader, Source, Table, Value};
use crate::spec::{
    self, ColorSetting, DisplacementSpec, Interpolation, MaterialKindSpec, MaterialReference, MaterialSpec,
    ScalarSetting, TextureSpec, WrapName,
};

/// What shapes are made of that say nothing about it: light grey and dull.
pub(crate) fn default_material() -> Material {
    Material { name: "default".into(), ..Material::diffuse(Vec3::splat(0.7)) }
}

impl Builder {
    /// Builds every `[material.NAME]`.
    pub(crate) fn named_materials(&mut self, named: &[(At<String>, MaterialSpec)]) {
        self.mixing.declared = named.into();
        for (name, spec) in named {
            let Some(material) = self.declared_material(name) else { continue };
            let entry = self.entry_of(material, spec);
            self.named.insert(name.value.clone(), entry);
        }
    }

    /// The material that a shape refers to, if it refers to one.
    pub(crate) fn referred(
        &mut self,
        reference: Option<&MaterialReference>,
        of: &str,
    ) -> Option<MaterialEntry> {
        match reference? {
            MaterialReference::Inline(spec) => Some(self.material_entry(of, spec)),
            MaterialReference::Named(name) => {
                let found = self.named.get(&name.value).cloned();
                if found.is_none() {
                    let names = self.named.keys().map(String::as_str).collect();
                    let problem = no_such_material(name, names);
                    self.reader.report(problem);
                }
                found
            }
        }
    }

    fn material_entry(&mut self, name: &str, spec: &MaterialSpec) -> MaterialEntry {
        let material = self.material(name, spec);
        self.entry_of(material, spec)
    }

    fn entry_of(&mut self, material: Material, spec: &MaterialSpec) -> MaterialEntry {
        let displacement = spec.common.displacement.as_ref().and_then(|d| self.displacement(d));
        MaterialEntry { index: self.add_material(material), displacement }
    }

    /// Builds one material; what cannot be loaded is reported and left plain.
    pub(crate) fn material(&mut self, name: &str, spec: &MaterialSpec) -> Material {
        let mut emission = spec.common.emission.as_ref().map(|e| self.color(e));
        let mut two_sided = spec.common.two_sided.unwrap_or(true);
        let kind = match &spec.kind {
            MaterialKindSpec::Diffuse(s) => MaterialKind::Diffuse { albedo: self.color(&s.albedo) },
            MaterialKindSpec::Phong(s) => MaterialKind::Phong {
                diffuse: self.color(&s.diffuse),
                specular: self.color(&s.specular),
                exponent: self.scalar(&s.exponent, 0),
            },
            MaterialKindSpec::Conductor(s) => MaterialKind::Conductor {
                color: self.metal(s),
                roughness: self.scalar(&s.roughness, 0),
                anisotropy: s.anisotropy,
            },
            MaterialKindSpec::Dielectric(s) => MaterialKind::Dielectric {
                ior: s.ior,
                roughness: self.scalar(&s.roughness, 0),
                tint: self.color(&s.tint),
            },
            MaterialKindSpec::MetallicRoughness(s) => MaterialKind::MetallicRoughness {
                base_color: self.color(&s.base_color),
                metallic: self.scalar(&s.metallic, 2),
                roughness: self.scalar(&s.roughness, 1),
                transmission: self.scalar(&s.transmission, 0),
                ior: s.ior,
            },
            MaterialKindSpec::Measured(s) => match self.measured_table(&s.file, s.interpolation) {
                Some(table) => MaterialKind::Measured(table),
                None => MaterialKind::Black,
            },
            MaterialKindSpec::Mix(s) => self.mix(name, s),
            MaterialKindSpec::Mirror(s) => MaterialKind::Conductor {
                color: ConductorColor::Constant(self.color(&s.color)),
                roughness: 0.0.into(),
                anisotropy: 0.0,
            },
            MaterialKindSpec::Emissive(s) => {
                two_sided = spec.common.two_sided.unwrap_or(false);
                emission = Some(self.color(&s.radiance));
                MaterialKind::Black
            }
        };
        let normal_map = spec.common.normal_map.as_ref().and_then(|map| {
            let image = self.texture(&map.0.file, ColorSpace::Linear)?;
            let mut texture = Texture::new(image);
            texture.transform.scale = map.0.repeat;
            (texture.wrap_u, texture.wrap_v) = (wrap(map.0.wrap), wrap(map.0.wrap));
            Some(NormalMap { texture: Arc::new(texture), scale: map.0.scale })
        });
        let opacity = spec
            .common
            .opacity
            .as_ref()
            .map(|amount| Opacity { amount: self.scalar(amount, 3), cutoff: spec.common.opacity_cutoff });
        Material { name: name.into(), kind, emission, two_sided, normal_map, opacity }
    }

    fn metal(&mut self, spec: &spec::ConductorSpec) -> ConductorColor {
        let given = [spec.color.is_some(), spec.metal.is_some(), spec.eta.is_some() || spec.k.is_some()];
        if given.iter().filter(|&&g| g).count() > 1 {
            let origin = spec.eta.as_ref().or(spec.k.as_ref()).map(|x| x.origin.clone());
            let origin = origin.unwrap_or_else(Origin::nowhere);
            let problem = Problem::new(
                &origin,
                "a conductor has a `color`, a `metal`, or `eta` and `k`, but only one of these",
            );
            self.reader.report(problem);
        }
        match (&spec.color, &spec.metal, &spec.eta, &spec.k) {
            (Some(color), ..) => ConductorColor::Normal(self.color(color)),
            (_, Some(metal), ..) => ConductorColor::Complex { eta: metal.eta, k: metal.k },
            (_, _, Some(eta), Some(k)) => ConductorColor::Complex { eta: eta.value.0, k: k.value.0 },
            (_, _, Some(alone), None) | (_, _, None, Some(alone)) => {
                self.reader
                    .report(Problem::new(&alone.origin, "`eta` and `k` go together; one of them is missing"));
                ConductorColor::Normal(Vec3::splat(0.9).into())
            }
            _ => ConductorColor::Normal(Vec3::splat(0.9).into()),
        }
    }

    fn measured_table(&mut self, file: &FilePath, interpolation: Interpolation) -> Option<Arc<MeasuredBrdf>> {
        let nearest = interpolation == Interpolation::Nearest;
        let key = (file.path.clone(), nearest);
        if let Some(known) = self.measured.get(&key) {
            return Some(Arc::clone(known));
        }
        let lookup = if nearest { Lookup::Nearest } else { Lookup::Interpolated };
        match MeasuredBrdf::load(&file.path, lookup) {
            Ok(table) => {
                self.note_file(&file.path);
                let table = Arc::new(table);
                self.measured.insert(key, Arc::clone(&table));
                Some(table)
            }
            Err(error) => {
                self.failed(file, &error);
                None
            }
        }
    }

    /// A measured material whose file the program itself names.
    pub(crate) fn bare_measured(&mut self, file: &FilePath) -> Result<Material, LoadError> {
        let table = MeasuredBrdf::load(&file.path, Lookup::Interpolated)?;
        self.note_file(&file.path);
        Ok(Material::new(table.name().to_string(), MaterialKind::Measured(Arc::new(table))))
    }

    fn texture_setting(&mut self, spec: &TextureSpec, usual: ColorSpace) -> Option<Texture> {
        let space = match spec.space {
            Some(spec::SpaceName::Srgb) => ColorSpace::Srgb,
            Some(spec::SpaceName::Linear) => ColorSpace::Linear,
            None => usual,
        };
        let image = self.texture(&spec.file, space)?;
        let wrap = wrap(spec.wrap);
        let rotation = (spec.rotation_degrees % 360.0).to_radians();
        let transform = UvTransform { offset: spec.offset, rotation, scale: spec.repeat };
        Some(Texture {
            image,
            wrap_u: wrap,
            wrap_v: wrap,
            transform,
            nearest: false,
            levels: Levels::default(),
        })
    }

    /// A colour, or a texture of colours.
    pub(crate) fn color(&mut self, setting: &ColorSetting) -> ColorInput {
        match setting {
            ColorSetting::Constant(color) => ColorInput::Constant(color.0),
            ColorSetting::Texture(spec) => match self.texture_setting(spec, ColorSpace::Srgb) {
                Some(texture) => ColorInput::Textured { texture: Arc::new(texture), factor: spec.factor.0 },
                None => ColorInput::Constant(Vec3::splat(0.5)),
            },
        }
    }

    /// A number, or one channel of a texture; `channel` where the setting does not say which.
    pub(super) fn scalar(&mut self, setting: &ScalarSetting, channel: usize) -> ScalarInput {
        match setting {
            ScalarSetting::Constant(x) => ScalarInput::Constant(*x),
            ScalarSetting::Texture(spec) => match self.texture_setting(spec, ColorSpace::Linear) {
                Some(texture) => ScalarInput::Textured {
                    texture: Arc::new(texture),
                    channel: spec.channel.map_or(channel, |c| c as usize),
                    factor: spec.factor.0.x,
                },
                None => ScalarInput::Constant(0.5),
            },
        }
    }

    fn displacement(&mut self, spec: &DisplacementSpec) -> Option<Arc<Displacement>> {
        let image = self.texture(&spec.file, ColorSpace::Linear)?;
        let texture = Texture::new(image);
        let wrap = spec.wrap.map(wrap);
        Some(Arc::new(Displacement {
            texture,
            wrap,
            scale: spec.scale,
            middle: spec.middle,
            edge: spec.edge,
        }))
    }
}

/// That a name is none of these materials.
pub(super) fn no_such_material(name: &At<String>, mut names: Vec<&str>) -> Problem {
    let problem = Problem::new(&name.origin, format!("there is no material `{}`", name.value));
    names.sort_unstable();
    if names.is_empty() {
        problem.help(format!("write a table [material.{}]", name.value))
    } else {
        problem.offer(&name.value, names)
    }
}

fn wrap(name: WrapName) -> Wrap {
    match name {
        WrapName::Repeat => Wrap::Repeat,
        WrapName::Clamp => Wrap::Clamp,
        WrapName::Mirror => Wrap::Mirror,
    }
}

/// The material that a text describes, as `--material` takes it: a measured file, or a type and its keys.
///
/// `gold.binary`, `mirror`, `gold`, `phong exponent=40 specular=0.2`, `conductor:metal=copper,roughness=0.2`.
///
/// # Errors
/// An unknown type, unknown keys, impossible values, or a file that cannot be loaded.
pub(crate) fn material_from_text(text: &str, builder: &mut Builder) -> Result<Material, SceneError> {
    let spec = spec_from_text(text)?;
    Ok(builder.material(text.trim(), &spec))
}

fn spec_from_text(text: &str) -> Result<MaterialSpec, SceneError> {
    let source = Source::option("--material", text);
    let origin = Origin::whole(&source);
    let trimmed = text.trim();
    if halflight_file::extension(Path::new(trimmed)) == "binary" && !trimmed.contains('=') {
        let value = Value { origin: origin.clone(), kind: Kind::Text(String::new()) };
        return Ok(spec::plain(spec::measured(FilePath::named(trimmed, &origin)), &value));
    }
    let (kind, parts) = kind_and_keys(trimmed);
    let mut table = Table { origin: origin.clone(), entries: Vec::new() };
    for part in parts {
        table.assign("--material", &part)?;
    }
    table.entries.push(schema::Entry {
        name: "type".into(),
        key: origin.clone(),
        value: Value { origin, kind: Kind::Text(kind.into()) },
    });
    let mut reader = Reader::new();
    let spec = MaterialSpec::read_table(&table, None, &mut reader);
    Ok(reader.finish(spec)?)
}

/// The type that a text names, and its keys as `key=value`: a metal's name alone is that metal.
fn kind_and_keys(text: &str) -> (&str, Vec<String>) {
    let mut parts = parts_of(text).into_iter();
    let name = parts.next().unwrap_or_default();
    let keys = parts.map(String::from);
    if halflight_material::metal(name).is_some() {
        ("conductor", std::iter::once(format!("metal={name}")).chain(keys).collect())
    } else {
        (if name == "glass" { "dielectric" } else { name }, keys.collect())
    }
}

/// The same as a table of one line, as a scene file would have it: `{ type = "phong", exponent = 40 }`.
pub(crate) fn material_as_toml(text: &str) -> String {
    let trimmed = text.trim();
    let quoted = |text: &str| toml::Value::String(text.into()).to_string();
    if halflight_file::extension(Path::new(trimmed)) == "binary" && !trimmed.contains('=') {
        return format!("{{ type = \"measured\", file = {} }}", quoted(trimmed));
    }
    let (kind, keys) = kind_and_keys(trimmed);
    let mut table = format!("{{ type = {}", quoted(kind));
    for part in keys {
        let (key, value) = part.split_once('=').unwrap_or((&part, ""));
        let (key, value) = (key.trim(), value.trim());
        let is_toml = format!("x = {value}").parse::<toml::Table>().is_ok();
        let value = if is_toml { value.to_string() } else { quoted(value) };
        table += &format!(", {key} = {value}");
    }
    table + " }"
}

/// Splits `phong exponent=40` and `phong:exponent=40,diffuse=[1, 0, 0]` at blanks, colons and commas outside brackets.
fn parts_of(text: &str) -> Vec<&str> {
    let mut parts = Vec::new();
    let (mut start, mut depth, mut quoted) = (0, 0_usize, false);
    for (at, letter) in text.char_indices() {
        match letter {
            '"' => quoted = !quoted,
            '[' | '{' if !quoted => depth += 1,
            ']' | '}' if !quoted => depth = depth.saturating_sub(1),
            ' ' | ',' | ':' if depth == 0 && !quoted => {
                parts.push(&text[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[start..]);
    parts.into_iter().map(str::trim).filter(|part| !part.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind_of(text: &str) -> MaterialKind {
        material_from_text(text, &mut Builder::default()).map(|m| m.kind).expect("the text is a material")
    }

    #[test]
    fn a_material_can_be_said_in_a_word_or_with_keys() {
        assert!(matches!(kind_of("mirror"), MaterialKind::Conductor { .. }));
        assert!(matches!(kind_of("glass ior=1.7"), MaterialKind::Dielectric { ior, .. } if ior == 1.7));
        assert!(matches!(
            kind_of("gold:roughness=0.1"),
            MaterialKind::Conductor { color: ConductorColor::Complex { .. }, .. }
        ));
        assert!(matches!(
            kind_of("phong exponent=40, diffuse=[0.1, 0.2, 0.3]"),
            MaterialKind::Phong { diffuse: ColorInput::Constant(c), .. } if c == Vec3::new(0.1, 0.2, 0.3)
        ));
    }

    #[test]
    fn every_mistake_in_a_material_text_is_told_with_what_was_meant() {
        for (text, hint) in [
            ("difuse", "`diffuse`"),
            ("phong exponnent=4", "`exponent`"),
            ("", "not a type"),
            ("conductor metal=golt", "gold"),
            ("gold rougness=0.2", "`roughness`"),
            ("gold roughness=2", "0 to 1"),
            ("gold roughness=nan", "nan"),
            ("diffuse albedo=1.5", "1.5"),
            ("diffuse albedo=-1", "-1"),
            ("diffuse albedo=[0.1, 0.2]", "a list of 2 values"),
            ("diffuse albedo=inf", "inf"),
            ("glass ior=0", "ior"),
            ("measured", "file"),
            ("no-such-file.binary", "no-such-file.binary"),
            ("mirror shiny", "shiny"),
        ] {
            let mut builder = Builder::default();
            let found = material_from_text(text, &mut builder)
                .and_then(|material| builder.reader.finish(Some(material)).map_err(SceneError::from));
            let Err(error) = found else { panic!("{text:?} is no material") };
            assert!(error.to_string().contains(hint), "{text:?}: {error}");
        }
    }

    #[test]
    fn a_material_text_may_tell_colours_light_and_sides() {
        let material = |text: &str| crate::material_from_text(text).expect("the text is a material");
        let lamp = material("diffuse albedo=0.5 emission=[3, 2, 1] two_sided=false");
        assert!(lamp.is_emissive() && !lamp.two_sided);
        assert_eq!(lamp.mean_emission(), Vec3::new(3.0, 2.0, 1.0));
        assert_eq!(material("emissive radiance=9").mean_emission(), Vec3::splat(9.0));
        let brown = material("diffuse:albedo=[0.8, 0.2, 0.1]");
        assert!(
            matches!(brown.kind, MaterialKind::Diffuse { albedo: ColorInput::Constant(c) } if c == Vec3::new(0.8, 0.2, 0.1))
        );
    }
}
