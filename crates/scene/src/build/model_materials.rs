//! Materials that come with a model.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Affine2, Vec3};
use halflight_file::LoadError;
use halflight_image::{ColorSpace, TextureImage};
use halflight_material::{
    ColorInput, Levels, Material, MaterialKind, NormalMap, Opacity, ScalarInput, Texture, UvTransform, Wrap,
};
use halflight_shape::{AlphaMode, Model, ModelImage, ModelMaterial, ModelTexture};

use super::Builder;
use crate::schema::{FilePath, Problem};

/// Pictures of a model, decoded once for each colour space.
#[derive(Default)]
struct Pictures(HashMap<(usize, bool), Option<Arc<TextureImage>>>);

impl Builder {
    /// Adds the materials of a model; slot s of its meshes is the s-th.
    pub(crate) fn model_materials(&mut self, model: &Model, file: &FilePath) -> Vec<u32> {
        let mut pictures = Pictures::default();
        let build = |material: &ModelMaterial, builder: &mut Self| {
            let converted = builder.model_material(model, material, &mut pictures, file);
            builder.add_material(converted)
        };
        let mut build = build;
        model.materials.iter().map(|material| build(material, self)).collect()
    }

    fn model_material(
        &mut self,
        model: &Model,
        material: &ModelMaterial,
        pictures: &mut Pictures,
        file: &FilePath,
    ) -> Material {
        let mut texture = |builder: &mut Self, from: &Option<ModelTexture>, space: ColorSpace| {
            let from = from.as_ref()?;
            builder.model_texture(model, from, space, pictures, file).map(Arc::new)
        };
        let color = |texture: Option<Arc<Texture>>, factor: Vec3| match texture {
            Some(texture) => ColorInput::Textured { texture, factor },
            None => ColorInput::Constant(factor),
        };
        let base = texture(self, &material.base_color_texture, ColorSpace::Srgb);
        let mask = texture(self, &material.opacity_texture, ColorSpace::Linear);
        let opacity = opacity(material, base.as_ref(), mask);
        let base_color = color(base, material.base_color.truncate().clamp(Vec3::ZERO, Vec3::ONE));
        let emissive = texture(self, &material.emissive_texture, ColorSpace::Srgb);
        let mut emission = (material.emissive.max_element() > 0.0)
            .then(|| color(emissive, material.emissive.max(Vec3::ZERO)));
        let surface = texture(self, &material.metallic_roughness_texture, ColorSpace::Linear);
        let scalar = |channel: usize, factor: f32| match &surface {
            Some(texture) => ScalarInput::Textured { texture: Arc::clone(texture), channel, factor },
            None => ScalarInput::Constant(factor),
        };
        let kind = if material.unlit {
            emission = Some(base_color);
            MaterialKind::Black
        } else {
            MaterialKind::MetallicRoughness {
                base_color,
                metallic: scalar(2, material.metallic.clamp(0.0, 1.0)),
                roughness: scalar(1, material.roughness.clamp(0.0, 1.0)),
                transmission: material.transmission.clamp(0.0, 1.0).into(),
                ior: material.ior.clamp(1.0, 10.0),
            }
        };
        let normal_map = texture(self, &material.normal_texture, ColorSpace::Linear)
            .map(|texture| NormalMap { texture, scale: material.normal_scale })
            .or_else(|| {
                let texture = texture(self, &material.bump_texture, ColorSpace::Linear)?;
                // Exporters store normal maps under the name of bump maps; those are mostly light blue.
                let mean = texture.mean();
                let is_normal_map =
                    mean.z > 0.75 && (mean.x - 0.5).abs() < 0.15 && (mean.y - 0.5).abs() < 0.15;
                is_normal_map.then_some(NormalMap { texture, scale: 1.0 })
            });
        // Faces that are not two-sided are culled by viewers; here their backs would be black, which helps no one.
        Material { name: material.name.clone(), kind, emission, two_sided: true, normal_map, opacity }
    }

    fn model_texture(
        &mut self,
        model: &Model,
        from: &ModelTexture,
        space: ColorSpace,
        pictures: &mut Pictures,
        file: &FilePath,
    ) -> Option<Texture> {
        let key = (from.image, space == ColorSpace::Srgb);
        if let std::collections::hash_map::Entry::Vacant(entry) = pictures.0.entry(key) {
            let loaded: Result<TextureImage, LoadError> = match model.images.get(from.image)? {
                ModelImage::Encoded { bytes, name } => {
                    let whole = file.path.join(name);
                    halflight_image::decode_texture(bytes, &whole, space)
                }
                ModelImage::File(path) => {
                    self.note_file(path);
                    halflight_image::load_texture(path, space)
                }
            };
            let image = match loaded {
                Ok(image) => Some(Arc::new(image)),
                Err(error) => {
                    self.reader.report(Problem::load(&file.origin, &error));
                    None
                }
            };
            entry.insert(image);
        }
        let image = pictures.0.get(&key)?.clone()?;
        let (wrap_u, wrap_v) = (wrap(from.wrap_u), wrap(from.wrap_v));
        let transform = uv_transform(&from.uv_transform);
        Some(Texture { image, wrap_u, wrap_v, transform, nearest: from.nearest, levels: Levels::default() })
    }
}

/// How much of the surface is there, where the material says that it matters: by the alpha of its colour, or by the red
/// of a picture of its own.
fn opacity(
    material: &ModelMaterial,
    base: Option<&Arc<Texture>>,
    mask: Option<Arc<Texture>>,
) -> Option<Opacity> {
    let cutoff = match material.alpha_mode {
        AlphaMode::Opaque => return None,
        AlphaMode::Mask { cutoff } => Some(cutoff),
        AlphaMode::Blend => None,
    };
    let factor = material.base_color.w.clamp(0.0, 1.0);
    let amount = match (mask, base) {
        (Some(texture), _) => ScalarInput::Textured { texture, channel: 0, factor },
        (None, Some(texture)) => ScalarInput::Textured { texture: Arc::clone(texture), channel: 3, factor },
        (None, None) => ScalarInput::Constant(factor),
    };
    Some(Opacity { amount, cutoff })
}

fn wrap(from: halflight_shape::Wrap) -> Wrap {
    match from {
        halflight_shape::Wrap::Repeat => Wrap::Repeat,
        halflight_shape::Wrap::MirroredRepeat => Wrap::Mirror,
        halflight_shape::Wrap::ClampToEdge => Wrap::Clamp,
    }
}

/// The parts of glTF's texture transform: columns (s_x cos, −s_x sin) and (s_y sin, s_y cos).
fn uv_transform(from: &Affine2) -> UvTransform {
    let (x, y) = (from.matrix2.x_axis, from.matrix2.y_axis);
    let mirrored = if from.matrix2.determinant() < 0.0 { -1.0 } else { 1.0 };
    UvTransform {
        offset: from.translation,
        rotation: (-x.y).atan2(x.x),
        scale: glam::Vec2::new(x.length(), mirrored * y.length()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn a_texture_transform_keeps_its_meaning() {
        let wanted = UvTransform { offset: Vec2::new(0.1, 0.7), rotation: 0.6, scale: Vec2::new(2.0, -3.0) };
        let columns = [wanted.apply(Vec2::X) - wanted.offset, wanted.apply(Vec2::Y) - wanted.offset];
        let affine = Affine2::from_cols(columns[0], columns[1], wanted.offset);
        let found = uv_transform(&affine);
        for uv in [Vec2::ZERO, Vec2::X, Vec2::new(0.3, 0.8)] {
            assert!(found.apply(uv).distance(wanted.apply(uv)) < 1e-6);
            assert!(affine.transform_point2(uv).distance(wanted.apply(uv)) < 1e-6);
        }
    }
}
