//! MTL materials, converted to metallic-roughness.
//!
//! | MTL | here |
//! |---|---|
//! | `Kd`, `map_Kd` | base colour; linear, as MTL defines no other space |
//! | `Ns` | GGX α = √(2/(Ns + 2)) (Walter et al. 2007, §5.2's match of Blinn's exponent), roughness = √α |
//! | `Ks` black, `illum` 0 or 1 | no highlight: roughness 1 and index of refraction 1 |
//! | `Ks` bright over a black `Kd` | a metal of that colour |
//! | `Pr`, `Pm`, `map_Pr`, `map_Pm` | roughness and metallic as they are |
//! | `Ke`, `map_Ke` | emission |
//! | `d`, `Tr` with `illum` 4, 6, 7 or 9 | transmission with `Ni` |
//! | `d`, `Tr` otherwise; `map_d` | opacity; a mask if it is the picture of `map_Kd` |
//! | `norm` | normal map |
//! | `map_bump`, `bump` | bump map with `-bm` |
//!
//! Surfaces are seen from both sides: MTL has no word for one side.

use std::path::Path;

use glam::{Affine2, Mat2, Vec2, Vec3};
use halflight_file::{LoadError, Place};

use super::lines::{Statement, number, shown, statements};
use crate::formats::Resolver;
use crate::formats::resolve::Located;
use crate::model::{AlphaMode, ModelImage, ModelMaterial, ModelTexture, Wrap};

pub(super) const ASKED: &str = "OBJ material file";

/// A specular colour over a diffuse one that is this dark makes a metal.
const BLACK: f32 = 0.02;

/// Materials of all material files of a mesh.
#[derive(Default)]
pub(super) struct Library {
    materials: Vec<Mtl>,
    pub(super) images: Vec<ModelImage>,
    /// Names by image, to share pictures.
    image_names: Vec<String>,
}

/// A material in the words of the file.
#[derive(Default)]
struct Mtl {
    name: String,
    diffuse: Option<Vec3>,
    specular: Option<Vec3>,
    emissive: Vec3,
    exponent: Option<f32>,
    ior: Option<f32>,
    opacity: Option<f32>,
    model: Option<u32>,
    roughness: Option<f32>,
    metallic: Option<f32>,
    diffuse_map: Option<Map>,
    emissive_map: Option<Map>,
    opacity_map: Option<Map>,
    normal_map: Option<Map>,
    bump_map: Option<Map>,
}

struct Map {
    texture: ModelTexture,
    bump: f32,
}

impl Library {
    /// Reads a material file that the mesh `model` refers to.
    pub(super) fn read(
        &mut self,
        bytes: &[u8],
        path: &Path,
        companions: &Resolver,
        model: &Path,
    ) -> Result<(), LoadError> {
        statements(bytes, |statement| {
            let line = statement.line;
            let at = |found: String| LoadError::new(ASKED, path, found).at(Place::Line(line));
            if statement.keyword == "newmtl" {
                self.materials.push(Mtl { name: statement.rest.into(), ..Mtl::default() });
                return Ok(());
            }
            let is_map = |name: &str| statement.keyword.eq_ignore_ascii_case(name);
            let maps = ["map_Kd", "map_Ke", "map_d", "norm", "map_norm", "map_Kn", "map_bump", "bump"];
            let map = match maps.iter().any(|name| is_map(name)) {
                true => Some(self.map(statement.rest, companions, model).map_err(|e| match e {
                    MapError::Line(found) => at(found),
                    MapError::Missing(error) => error,
                })?),
                false => None,
            };
            // A statement before any material means nothing.
            let Some(material) = self.materials.last_mut() else { return Ok(()) };
            match map {
                Some(map) => material.set_map(statement.keyword, map),
                None => material.set(&statement).map_err(at)?,
            }
            Ok(())
        })
    }

    /// The materials of these names, in this order.
    pub(super) fn pick(&self, names: &[String], warnings: &mut Vec<String>) -> Vec<ModelMaterial> {
        let mut unknown = Vec::new();
        let materials = names.iter().map(|name| match self.materials.iter().find(|m| m.name == *name) {
            Some(material) => material.convert(),
            None => {
                if !name.is_empty() && !self.materials.is_empty() {
                    unknown.push(shown(name));
                }
                ModelMaterial { name: name.clone(), stand_in: true, ..Mtl::default().convert() }
            }
        });
        let materials = materials.collect();
        if !unknown.is_empty() {
            warnings
                .push(format!("no material file describes {}; a neutral grey stands in", unknown.join(", ")));
        }
        materials
    }

    /// `[-option value …] file name`.
    fn map(&mut self, rest: &str, companions: &Resolver, model: &Path) -> Result<Map, MapError> {
        let mut words = Words(rest);
        let (mut scale, mut offset) = (Vec2::ONE, Vec2::ZERO);
        let (mut clamp, mut bump) = (false, 1.0);
        let name = loop {
            let here = words.0;
            let option = words.next();
            match option {
                "-s" => words.pair(&mut scale)?,
                "-o" => words.pair(&mut offset)?,
                "-t" => words.pair(&mut Vec2::default())?,
                "-bm" => bump = number(words.next()).map_err(MapError::Line)?,
                "-clamp" => clamp = words.next().eq_ignore_ascii_case("on"),
                "-mm" => words = words.after(2),
                "-blendu" | "-blendv" | "-boost" | "-cc" | "-imfchan" | "-texres" | "-type" => {
                    words = words.after(1);
                }
                _ => break here.trim(),
            }
        };
        if name.is_empty() {
            return Err(MapError::Line("the name of a picture is missing".into()));
        }
        let wrap = if clamp { Wrap::ClampToEdge } else { Wrap::Repeat };
        // v' = s v + o with v upwards is v' = s v + (1 − s − o) with v downwards.
        let translation = Vec2::new(offset.x, 1.0 - scale.y - offset.y);
        let texture = ModelTexture {
            image: self.image(name, companions, model)?,
            wrap_u: wrap,
            wrap_v: wrap,
            nearest: false,
            uv_transform: Affine2::from_mat2_translation(Mat2::from_diagonal(scale), translation),
        };
        Ok(Map { texture, bump })
    }

    fn image(&mut self, name: &str, companions: &Resolver, model: &Path) -> Result<usize, MapError> {
        if let Some(known) = self.image_names.iter().position(|known| known == name) {
            return Ok(known);
        }
        let image = match companions.locate(name, "OBJ texture", model).map_err(MapError::Missing)? {
            Located::File(path) => ModelImage::File(path),
            Located::Bytes(bytes) => ModelImage::Encoded { bytes, name: name.into() },
        };
        self.images.push(image);
        self.image_names.push(name.into());
        Ok(self.images.len() - 1)
    }
}

/// Words of a line, taken one after the other.
struct Words<'a>(&'a str);

impl<'a> Words<'a> {
    fn next(&mut self) -> &'a str {
        let left = self.0.trim_start();
        let (word, left) = left.split_at(left.find(char::is_whitespace).unwrap_or(left.len()));
        self.0 = left;
        word
    }

    fn after(mut self, count: usize) -> Self {
        for _ in 0..count {
            self.next();
        }
        self
    }

    /// One to three numbers, of which the first two count.
    fn pair(&mut self, pair: &mut Vec2) -> Result<(), MapError> {
        for i in 0..3 {
            let before = self.0;
            match number(self.next()) {
                Ok(value) if i < 2 => pair[i] = value,
                Ok(_) => {}
                Err(found) if i == 0 => return Err(MapError::Line(found)),
                Err(_) => {
                    self.0 = before;
                    break;
                }
            }
        }
        Ok(())
    }
}

enum MapError {
    Line(String),
    Missing(LoadError),
}

impl Mtl {
    fn set(&mut self, statement: &Statement) -> Result<(), String> {
        let first = || number(statement.rest.split_ascii_whitespace().next().unwrap_or_default());
        match statement.keyword {
            "Kd" => self.diffuse = color(statement.rest)?,
            "Ks" => self.specular = color(statement.rest)?,
            "Ke" => self.emissive = color(statement.rest)?.unwrap_or(Vec3::ZERO),
            "Ns" => self.exponent = Some(first()?.max(0.0)),
            "Ni" => self.ior = Some(first()?),
            "d" => {
                // `d -halo factor` fades towards the silhouette; the factor is all that is taken from it.
                let factor = statement.rest.split_ascii_whitespace().find(|word| *word != "-halo");
                self.opacity = Some(number(factor.unwrap_or_default())?.clamp(0.0, 1.0));
            }
            "Tr" => self.opacity = Some(1.0 - first()?.clamp(0.0, 1.0)),
            "illum" => self.model = Some(first()?.max(0.0) as u32),
            "Pr" => self.roughness = Some(first()?.clamp(0.0, 1.0)),
            "Pm" => self.metallic = Some(first()?.clamp(0.0, 1.0)),
            _ => {}
        }
        Ok(())
    }

    fn set_map(&mut self, keyword: &str, map: Map) {
        let slot = match keyword.to_ascii_lowercase().as_str() {
            "map_kd" => &mut self.diffuse_map,
            "map_ke" => &mut self.emissive_map,
            "map_d" => &mut self.opacity_map,
            "map_bump" | "bump" => &mut self.bump_map,
            _ => &mut self.normal_map,
        };
        *slot = Some(map);
    }

    fn convert(&self) -> ModelMaterial {
        let specular = self.specular.unwrap_or(Vec3::ZERO);
        let mut diffuse = self.diffuse.unwrap_or(Vec3::splat(0.8));
        // Exporters write a black factor beside a texture that was meant to show.
        if self.diffuse_map.is_some() && diffuse == Vec3::ZERO {
            diffuse = Vec3::ONE;
        }
        let shines = specular.max_element() > 0.0 && !matches!(self.model, Some(0 | 1));
        let from_exponent = |ns: f32| (2.0 / (ns + 2.0)).sqrt().sqrt();
        let roughness = self.roughness.or(self.exponent.filter(|_| shines).map(from_exponent)).unwrap_or(1.0);
        let is_metal = shines
            && self.diffuse_map.is_none()
            && diffuse.max_element() < BLACK
            && specular.min_element() > BLACK;
        let metallic = self.metallic.unwrap_or(if is_metal { 1.0 } else { 0.0 });
        let base = if is_metal && self.metallic.is_none() { specular } else { diffuse };
        let opacity = self.opacity.unwrap_or(1.0);
        let refracts = matches!(self.model, Some(4 | 6 | 7 | 9)) && opacity < 1.0;
        let texture = |map: &Option<Map>| map.as_ref().map(|map| map.texture.clone());
        let same = |a: &Option<Map>, b: &Option<Map>| {
            a.as_ref().zip(b.as_ref()).is_some_and(|(a, b)| a.texture.image == b.texture.image)
        };
        let any_highlight = shines || self.roughness.is_some() || self.metallic.is_some() || refracts;
        ModelMaterial {
            name: self.name.clone(),
            base_color: base.extend(if refracts { 1.0 } else { opacity }),
            base_color_texture: texture(&self.diffuse_map),
            metallic,
            roughness: if refracts && self.roughness.is_none() && self.exponent.is_none() {
                0.0
            } else {
                roughness
            },
            normal_texture: texture(&self.normal_map),
            bump_texture: texture(&self.bump_map),
            bump_scale: self.bump_map.as_ref().map_or(1.0, |map| map.bump),
            emissive: if self.emissive_map.is_some() && self.emissive == Vec3::ZERO {
                Vec3::ONE
            } else {
                self.emissive
            },
            emissive_texture: texture(&self.emissive_map),
            transmission: if refracts { 1.0 - opacity } else { 0.0 },
            ior: match self.ior {
                _ if !any_highlight => 1.0,
                // 1.0 is what exporters write when they know nothing.
                Some(ior) if ior > 1.0 => ior,
                _ => 1.5,
            },
            double_sided: true,
            alpha_mode: match () {
                () if refracts => AlphaMode::Opaque,
                () if same(&self.diffuse_map, &self.opacity_map) => AlphaMode::Mask { cutoff: 0.5 },
                () if self.opacity_map.is_some() => AlphaMode::Mask { cutoff: 0.5 },
                () if opacity < 1.0 => AlphaMode::Blend,
                () => AlphaMode::Opaque,
            },
            opacity_texture: (!refracts && !same(&self.diffuse_map, &self.opacity_map))
                .then(|| texture(&self.opacity_map))
                .flatten(),
            ..ModelMaterial::default()
        }
    }
}

/// `r g b`, or `r` for a grey; `None` for spectral curves and CIE XYZ, which are not read.
fn color(rest: &str) -> Result<Option<Vec3>, String> {
    if rest.starts_with("spectral") || rest.starts_with("xyz") {
        return Ok(None);
    }
    let values: Vec<f32> = rest.split_ascii_whitespace().take(3).map(number).collect::<Result<_, _>>()?;
    match values.as_slice() {
        [r, g, b] => Ok(Some(Vec3::new(*r, *g, *b).max(Vec3::ZERO))),
        [grey, ..] => Ok(Some(Vec3::splat(grey.max(0.0)))),
        [] => Err("a colour has no numbers".into()),
    }
}
