//! Materials in one line, for the command: `conductor:gold,roughness=0.2`.
//!
//! ```text
//! SPEC   = KIND [":" VALUE] {"," KEY "=" VALUE} {"," FLAG}
//! VALUE  = number | number "," number "," number | "#rrggbb" (sRGB) | word
//!
//! diffuse[:COLOR]              albedo, 0.5 unless given
//! phong[:COLOR]                diffuse part; specular=COLOR (0.3), exponent=NUMBER (50)
//! conductor[:METAL|COLOR]      a metal's name, or the colour it reflects; roughness=NUMBER (0.3),
//!                              anisotropy=NUMBER (0)
//! mirror[:COLOR]               ideal mirror
//! glass[:IOR]                  1.5 unless given; roughness=NUMBER (0), tint=COLOR (1)
//! metallic-roughness[:COLOR]   base colour; metallic=NUMBER (0), roughness=NUMBER (0.5),
//!                              transmission=NUMBER (0), ior=NUMBER (1.5)
//! measured:FILE                MERL .binary, also .binary.xz; flag nearest or interpolated (the default)
//! emissive[:COLOR]             radiance, 1 unless given
//! black                        scatters nothing
//!
//! every kind: emission=COLOR, flag one-sided
//! ```

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use halflight_file::{LoadError, nearest_name};

use crate::material::{ConductorColor, Material, MaterialKind};
use crate::merl::{Lookup, MeasuredBrdf};
use crate::metals::{metal, metal_names};

/// The kinds of [`Material::from_spec`].
const KINDS: [&str; 9] = [
    "diffuse",
    "phong",
    "conductor",
    "mirror",
    "glass",
    "metallic-roughness",
    "measured",
    "emissive",
    "black",
];

/// Why a line does not describe a material.
#[derive(Debug, thiserror::Error)]
pub enum SpecError {
    /// The line itself.
    #[error("the material {spec:?} is not understood: {found}{}", hint.as_ref().map(|h| format!(" ({h})")).unwrap_or_default())]
    Wrong {
        /// The line.
        spec: String,
        /// What is wrong with it.
        found: String,
        /// What to try.
        hint: Option<String>,
    },
    /// A file it names.
    #[error(transparent)]
    Load(#[from] LoadError),
}

impl Material {
    /// The material that a line such as `conductor:gold,roughness=0.2` describes:
    ///
    /// - `diffuse:0.8,0.2,0.1` or `diffuse:#c04020` or `diffuse:0.5`
    /// - `phong:0.2,0.1,0.1,specular=0.4,exponent=80`
    /// - `conductor:gold,roughness=0.2,anisotropy=0.5`, `conductor:0.9,0.6,0.3`, `mirror`
    /// - `glass`, `glass:1.33`, `glass:1.5,roughness=0.3,tint=0.9,1,0.9`
    /// - `metallic-roughness:0.8,0.1,0.1,metallic=0,roughness=0.4`
    /// - `measured:chrome.binary`, `measured:chrome.binary.xz,nearest`
    /// - `emissive:10,8,6`, `black`; and of every kind `…,emission=1,1,1` and `…,one-sided`
    ///
    /// # Errors
    /// A kind, key, flag or metal that does not exist (with the nearest that does), a value that is no number or
    /// out of range, or a file that does not load.
    ///
    /// ```
    /// use halflight_material::Material;
    /// assert!(Material::from_spec("conductor:gold,roughness=0.2").is_ok());
    /// let error = Material::from_spec("conducter:gold").unwrap_err().to_string();
    /// assert!(error.contains("did you mean conductor?"), "{error}");
    /// ```
    pub fn from_spec(spec: &str) -> Result<Material, SpecError> {
        let mut fields = Fields::parse(spec)?;
        let kind = match fields.kind.as_str() {
            "diffuse" => MaterialKind::Diffuse { albedo: fields.reflectance("", 0.5)?.into() },
            "phong" => MaterialKind::Phong {
                diffuse: fields.reflectance("", 0.5)?.into(),
                specular: fields.reflectance("specular", 0.3)?.into(),
                exponent: fields.number("exponent", 50.0, 0.0..=1e5)?.into(),
            },
            "conductor" => MaterialKind::Conductor {
                color: fields.conductor_color()?,
                roughness: fields.number("roughness", 0.3, 0.0..=1.0)?.into(),
                anisotropy: fields.number("anisotropy", 0.0, -1.0..=1.0)?,
            },
            "mirror" => MaterialKind::Conductor {
                color: ConductorColor::Constant(fields.reflectance("", 1.0)?.into()),
                roughness: 0.0.into(),
                anisotropy: 0.0,
            },
            "glass" => MaterialKind::Dielectric {
                ior: fields.number("", 1.5, 0.1..=10.0)?,
                roughness: fields.number("roughness", 0.0, 0.0..=1.0)?.into(),
                tint: fields.reflectance("tint", 1.0)?.into(),
            },
            "metallic-roughness" => MaterialKind::MetallicRoughness {
                base_color: fields.reflectance("", 0.8)?.into(),
                metallic: fields.number("metallic", 0.0, 0.0..=1.0)?.into(),
                roughness: fields.number("roughness", 0.5, 0.0..=1.0)?.into(),
                transmission: fields.number("transmission", 0.0, 0.0..=1.0)?.into(),
                ior: fields.number("ior", 1.5, 1.0..=10.0)?,
            },
            "measured" => MaterialKind::Measured(Arc::new(fields.measured()?)),
            "emissive" | "black" => MaterialKind::Black,
            other => return Err(fields.unknown("kind", other, &KINDS)),
        };
        let mut material = Material::new(spec, kind);
        if fields.kind == "emissive" {
            material.emission = Some(fields.color("", 1.0, f32::MAX)?.into());
        }
        if fields.has("emission") {
            material.emission = Some(fields.color("emission", 1.0, f32::MAX)?.into());
        }
        material.two_sided = !fields.flag("one-sided");
        fields.finish()?;
        Ok(material)
    }
}

/// A line taken apart; what has been read is taken out, so that what is left over is an error.
struct Fields {
    spec: String,
    kind: String,
    /// Key (empty for what follows the kind) and the parts of its value.
    values: Vec<(String, Vec<String>)>,
    flags: Vec<String>,
    /// The keys that were asked for, to suggest the nearest.
    known: Vec<&'static str>,
}

const FLAGS: [&str; 3] = ["one-sided", "nearest", "interpolated"];

impl Fields {
    fn parse(spec: &str) -> Result<Self, SpecError> {
        let (kind, rest) = match spec.split_once([':', ',']) {
            Some((kind, _)) => (kind, &spec[kind.len()..]),
            None => (spec, ""),
        };
        let mut this = Self {
            spec: spec.into(),
            kind: kind.trim().to_lowercase(),
            values: Vec::new(),
            flags: Vec::new(),
            known: vec!["emission"],
        };
        let positional = rest.starts_with(':');
        for (index, part) in rest.get(1..).unwrap_or("").split(',').map(str::trim).enumerate() {
            if part.is_empty() {
                if rest.len() > 1 {
                    return Err(this.wrong("there is nothing between two commas".into(), None));
                }
            } else if FLAGS.contains(&part) {
                this.flags.push(part.into());
            } else if let Some((key, value)) = part.split_once('=').filter(|_| !(positional && index == 0)) {
                this.values.push((key.trim().to_lowercase(), vec![value.trim().into()]));
            } else if positional && index == 0 {
                this.values.push((String::new(), vec![part.into()]));
            } else if let Some((_, parts)) = this.values.last_mut() {
                parts.push(part.into());
            } else {
                let error = this.unknown("flag", part, &FLAGS);
                return Err(error);
            }
        }
        Ok(this)
    }

    fn wrong(&self, found: String, hint: Option<String>) -> SpecError {
        SpecError::Wrong { spec: self.spec.clone(), found, hint }
    }

    fn unknown(&self, what: &str, name: &str, known: &[&str]) -> SpecError {
        let hint = match nearest_name(name, known.iter().copied()) {
            Some(nearest) => format!("did you mean {nearest}?"),
            None => format!("known are {}", known.join(", ")),
        };
        self.wrong(format!("there is no {what} {name:?}"), Some(hint))
    }

    fn has(&self, key: &str) -> bool {
        self.values.iter().any(|(known, _)| known == key)
    }

    fn take(&mut self, key: &'static str) -> Option<Vec<String>> {
        self.known.push(key);
        let index = self.values.iter().position(|(known, _)| known == key)?;
        Some(self.values.remove(index).1)
    }

    fn flag(&mut self, name: &str) -> bool {
        let before = self.flags.len();
        self.flags.retain(|flag| flag != name);
        self.flags.len() < before
    }

    fn number(
        &mut self,
        key: &'static str,
        default: f32,
        range: std::ops::RangeInclusive<f32>,
    ) -> Result<f32, SpecError> {
        let Some(parts) = self.take(key) else { return Ok(default) };
        let text = parts.join(",");
        match text.parse::<f32>() {
            Ok(value) if range.contains(&value) => Ok(value),
            _ => {
                let (low, high) = (range.start(), range.end());
                let name = if key.is_empty() { "value" } else { key };
                Err(self.wrong(format!("the {name} is a number from {low} to {high}, not {text:?}"), None))
            }
        }
    }

    fn reflectance(&mut self, key: &'static str, default: f32) -> Result<Vec3, SpecError> {
        self.color(key, default, 1.0)
    }

    fn color(&mut self, key: &'static str, default: f32, limit: f32) -> Result<Vec3, SpecError> {
        let Some(parts) = self.take(key) else { return Ok(Vec3::splat(default)) };
        let color = parse_color(&parts).filter(|c| c.is_finite() && c.min_element() >= 0.0);
        match color {
            Some(color) if color.max_element() <= limit => Ok(color),
            Some(_) => Err(self.wrong(
                format!("the colour {} is more than {limit}: it would make light", parts.join(",")),
                None,
            )),
            None => Err(self.wrong(
                format!("{:?} is not a colour", parts.join(",")),
                Some("one number, three numbers from 0 such as 0.8,0.2,0.1, or #rrggbb".into()),
            )),
        }
    }

    fn conductor_color(&mut self) -> Result<ConductorColor, SpecError> {
        let word = self.values.iter().find(|(key, _)| key.is_empty()).map(|(_, parts)| parts.clone());
        let Some([word]) = word.as_deref() else {
            return Ok(ConductorColor::Normal(self.reflectance("", 0.9)?.into()));
        };
        if !word.starts_with(|c: char| c.is_ascii_alphabetic()) {
            return Ok(ConductorColor::Normal(self.reflectance("", 0.9)?.into()));
        }
        let Some((eta, k)) = metal(&word.to_lowercase()) else {
            return Err(self.unknown("metal", word, &metal_names().collect::<Vec<_>>()));
        };
        self.take("");
        Ok(ConductorColor::Complex { eta, k })
    }

    fn measured(&mut self) -> Result<MeasuredBrdf, SpecError> {
        let Some(parts) = self.take("") else {
            let hint = Some("measured:chrome.binary".into());
            return Err(self.wrong("a measured material needs a file".into(), hint));
        };
        let (nearest, interpolated) = (self.flag("nearest"), self.flag("interpolated"));
        if nearest && interpolated {
            return Err(self.wrong("nearest and interpolated exclude each other".into(), None));
        }
        let lookup = if nearest { Lookup::Nearest } else { Lookup::Interpolated };
        Ok(MeasuredBrdf::load(Path::new(&parts.join(",")), lookup)?)
    }

    /// Whatever was not asked for is a mistake.
    fn finish(self) -> Result<(), SpecError> {
        if let Some((key, parts)) = self.values.first() {
            if key.is_empty() {
                return Err(self
                    .wrong(format!("{} takes no value, {:?} was given", self.kind, parts.join(",")), None));
            }
            let known: Vec<&str> = self.known.iter().copied().filter(|key| !key.is_empty()).collect();
            return Err(self.unknown(&format!("key of {},", self.kind), key, &known));
        }
        match self.flags.first() {
            Some(flag) => Err(self.wrong(format!("{flag:?} means nothing to {}", self.kind), None)),
            None => Ok(()),
        }
    }
}

fn parse_color(parts: &[String]) -> Option<Vec3> {
    if let [text] = parts {
        if let Some(hex) = text.strip_prefix('#') {
            let bits = u32::from_str_radix(hex, 16).ok().filter(|_| hex.len() == 6)?;
            let channel = |shift: u32| {
                let v = (bits >> shift & 255) as f32 / 255.0;
                if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
            };
            return Some(Vec3::new(channel(16), channel(8), channel(0)));
        }
        return text.parse().ok().map(Vec3::splat);
    }
    let numbers: Vec<f32> = parts.iter().map(|part| part.parse().ok()).collect::<Option<_>>()?;
    let numbers: [f32; 3] = numbers.try_into().ok()?;
    Some(Vec3::from_array(numbers))
}
