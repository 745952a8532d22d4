//! Materials, textures and pictures; only what some mesh uses is looked at.

use std::collections::BTreeMap;

use glam::{Affine2, Mat2, Vec2, Vec3, Vec4};
use halflight_file::LoadError;

use super::accessor::Document;
use super::container::{data_uri, local_name};
use super::json::{Material, TextureInfo};
use crate::formats::resolve::Located;
use crate::model::{AlphaMode, ModelImage, ModelMaterial, ModelTexture, Wrap};

/// Materials in the order of their first use.
#[derive(Default)]
pub(super) struct Materials {
    pub(super) list: Vec<ModelMaterial>,
    pub(super) images: Vec<ModelImage>,
    pub(super) warnings: Vec<String>,
    slots: BTreeMap<Option<usize>, Used>,
    image_of_source: BTreeMap<usize, usize>,
}

/// A material that is in use.
#[derive(Clone, Copy)]
pub(super) struct Used {
    /// Its slot.
    pub(super) slot: u32,
    /// Which set of texture coordinates its textures are laid by.
    pub(super) uv_set: u32,
    /// Whether it has a normal map.
    pub(super) wants_tangents: bool,
}

impl Materials {
    /// The material of a primitive: one of the file's, or the default.
    pub(super) fn slot(
        &mut self,
        index: Option<usize>,
        asker: &str,
        file: &Document,
    ) -> Result<Used, LoadError> {
        if let Some(used) = self.slots.get(&index) {
            return Ok(*used);
        }
        let (material, uv_set) = match index {
            Some(index) => {
                let material = file.get(&file.root.materials, index, "material", asker)?;
                self.convert(material, index, file)?
            }
            None => (ModelMaterial { stand_in: true, ..ModelMaterial::default() }, 0),
        };
        let used =
            Used { slot: self.list.len() as u32, uv_set, wants_tangents: material.normal_texture.is_some() };
        self.list.push(material);
        self.slots.insert(index, used);
        Ok(used)
    }

    fn convert(
        &mut self,
        material: &Material,
        index: usize,
        file: &Document,
    ) -> Result<(ModelMaterial, u32), LoadError> {
        let who = if material.name.is_empty() {
            format!("material {index}")
        } else {
            format!("material {index} ({})", material.name)
        };
        let mut sets = Vec::new();
        let mut texture = |info: &Option<TextureInfo>| match info {
            Some(info) => self.texture(info, &who, &mut sets, file),
            None => Ok(None),
        };
        let pbr = &material.pbr_metallic_roughness;
        let extensions = &material.extensions;
        let mut converted = ModelMaterial {
            name: material.name.clone(),
            base_color_texture: texture(&pbr.base_color_texture)?,
            metallic_roughness_texture: texture(&pbr.metallic_roughness_texture)?,
            normal_texture: texture(&material.normal_texture)?,
            emissive_texture: texture(&material.emissive_texture)?,
            ..ModelMaterial::default()
        };
        let mut base = pbr.base_color_factor.unwrap_or([1.0; 4]);
        converted.metallic = unit(pbr.metallic_factor.unwrap_or(1.0));
        converted.roughness = unit(pbr.roughness_factor.unwrap_or(1.0));
        if let Some(old) = &extensions.specular_glossiness {
            converted.base_color_texture = texture(&old.diffuse_texture)?;
            base = old.diffuse_factor.unwrap_or([1.0; 4]);
            converted.metallic = 0.0;
            converted.roughness = 1.0 - unit(old.glossiness_factor.unwrap_or(1.0));
            self.warnings
                .push(format!("{who}: of specular-glossiness only diffuse colour and glossiness are used"));
        }
        converted.base_color = Vec4::from(base.map(unit));
        let strength = extensions.emissive_strength.as_ref().and_then(|e| e.emissive_strength).unwrap_or(1.0);
        let emissive = Vec3::from(material.emissive_factor.unwrap_or([0.0; 3])) * strength;
        if !emissive.is_finite() {
            return Err(file.error(format!("{who}: the emission {emissive} is not finite")));
        }
        converted.emissive = emissive.max(Vec3::ZERO);
        if let Some(info) = &material.normal_texture {
            converted.normal_scale = info.scale.filter(|scale| scale.is_finite()).unwrap_or(1.0);
        }
        if let Some(ior) = extensions.ior.as_ref().and_then(|e| e.ior) {
            // 0 stands for a surface that reflects everything, for old materials; 1 and more is physical.
            converted.ior = if ior.is_finite() && ior >= 1.0 { ior } else { 1.5 };
        }
        if let Some(transmission) = &extensions.transmission {
            converted.transmission = unit(transmission.transmission_factor);
            if transmission.transmission_texture.is_some() {
                self.warnings
                    .push(format!("{who}: the texture of its transmission is not used, only the factor"));
            }
        }
        converted.double_sided = material.double_sided;
        converted.unlit = extensions.unlit.is_some();
        converted.alpha_mode = match material.alpha_mode.as_deref() {
            Some("MASK") => {
                let cutoff = material.alpha_cutoff.filter(|cutoff| cutoff.is_finite());
                AlphaMode::Mask { cutoff: cutoff.unwrap_or(0.5) }
            }
            Some("BLEND") => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        };
        let uv_set = sets.first().copied().unwrap_or(0);
        if sets.iter().any(|set| *set != uv_set) {
            self.warnings.push(format!(
                "{who}: its textures use several sets of texture coordinates; all are laid by TEXCOORD_{uv_set}"
            ));
        }
        Ok((converted, uv_set))
    }

    fn texture(
        &mut self,
        info: &TextureInfo,
        who: &str,
        sets: &mut Vec<u32>,
        file: &Document,
    ) -> Result<Option<ModelTexture>, LoadError> {
        let texture = file.get(&file.root.textures, info.index, "texture", who)?;
        let Some(source) = texture.source else {
            self.warnings.push(format!("{who}: texture {} is in a form that is not read", info.index));
            return Ok(None);
        };
        let image = match self.image_of_source.get(&source) {
            Some(image) => *image,
            None => {
                self.images.push(load_image(source, who, file)?);
                self.image_of_source.insert(source, self.images.len() - 1);
                self.images.len() - 1
            }
        };
        let mut converted = ModelTexture::new(image);
        if let Some(sampler) = texture.sampler {
            let sampler = file.get(&file.root.samplers, sampler, "sampler", who)?;
            converted.wrap_u = wrap(sampler.wrap_s);
            converted.wrap_v = wrap(sampler.wrap_t);
            converted.nearest = sampler.mag_filter == Some(9728);
        }
        let transform = info.extensions.transform.as_ref();
        sets.push(transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord));
        if let Some(transform) = transform {
            let scale = Vec2::from(transform.scale.unwrap_or([1.0; 2]));
            let offset = Vec2::from(transform.offset.unwrap_or([0.0; 2]));
            // Counter-clockwise as seen, with v downwards: so the extension's words and its example have it (the lower
            // left quarter, turned clockwise), and viewers. Its matrix, taken by columns as GLSL does, would turn the
            // other way.
            let (sin, cos) = transform.rotation.sin_cos();
            let turn = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
            converted.uv_transform =
                Affine2::from_mat2_translation(turn * Mat2::from_diagonal(scale), offset);
            if !converted.uv_transform.is_finite() {
                return Err(file.error(format!("{who}: the transform of its texture is not finite")));
            }
        }
        Ok(Some(converted))
    }
}

fn load_image(source: usize, who: &str, file: &Document) -> Result<ModelImage, LoadError> {
    let image = file.get(&file.root.images, source, "image", who)?;
    let name = if image.name.is_empty() { format!("image {source}") } else { image.name.clone() };
    match (&image.uri, image.buffer_view) {
        (Some(uri), _) => match data_uri(uri) {
            Some(Ok(bytes)) => Ok(ModelImage::Encoded { bytes, name }),
            Some(Err(found)) => Err(file.error(format!("{name}: {found}"))),
            None => {
                let local = local_name(uri).map_err(|found| file.error(format!("{name}: {found}")))?;
                Ok(match file.companions.locate(&local, "glTF texture", file.name)? {
                    Located::File(path) => ModelImage::File(path),
                    Located::Bytes(bytes) => ModelImage::Encoded { bytes, name: uri.clone() },
                })
            }
        },
        (None, Some(view)) => Ok(ModelImage::Encoded { bytes: file.view(view, &name)?.to_vec(), name }),
        (None, None) => Err(file.error(format!("{name} has neither a URI nor a buffer view"))),
    }
}

/// By the numbers of OpenGL.
fn wrap(code: Option<u32>) -> Wrap {
    match code {
        Some(33071) => Wrap::ClampToEdge,
        Some(33648) => Wrap::MirroredRepeat,
        _ => Wrap::Repeat,
    }
}

/// In [0, 1]; what is not finite comes to an end of it.
fn unit(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) }
}
