//! How finely the pictures on a material vary, and the material without them.
//!
//! What a picture adds to the bandwidth of a pixel is [`TextureBandwidth`] around the texture coordinates, largest within
//! the pixel's footprint, times how many texels a pixel steps over. `[001]` §2.3 gives cycles per metre; as pixels are
//! what is asked for in the end, and texture coordinates are known there, the way over metres is left out.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use halflight_frequency::bandwidth::{UNLIMITED, bounded};
use halflight_frequency::mapping::TextureBandwidth;
use halflight_frequency::wavelet::{Filter, Rule};
use halflight_image::Plane;
use halflight_material::{
    ColorInput, ConductorColor, Material, MaterialKind, ScalarInput, Texture, UvTransform,
};
use halflight_scene::lights::luminance;

/// A picture on a material.
pub(super) struct Paint {
    bandwidth: TextureBandwidth,
    transform: UvTransform,
    texels: Vec2,
}

impl Paint {
    fn new(texture: &Texture, value: impl Fn(Vec3) -> f32) -> Self {
        let (width, height) = (texture.image.width.max(1), texture.image.height.max(1));
        let plain = Texture { transform: UvTransform::default(), ..texture.clone() };
        let texels = Vec2::new(width as f32, height as f32);
        let texel = |i: usize| {
            let at = (Vec2::new((i % width) as f32, (i / width) as f32) + Vec2::splat(0.5)) / texels;
            value(plain.sample(at).truncate())
        };
        let plane = Plane { width, height, values: (0..width * height).map(texel).collect() };
        let repeats = texture.wrap_u == halflight_material::Wrap::Repeat;
        let bandwidth = TextureBandwidth::new(&plane, Filter::Smooth, Rule::Within, repeats);
        Self { bandwidth, transform: texture.transform, texels }
    }

    /// The picture of what shines, if it is one.
    pub(super) fn of_light(radiance: &ColorInput) -> Option<Self> {
        colour(radiance)
    }

    /// Cycles per metre around `uv`, where position changes by `dp_du` and `dp_dv` metres per unit of texture coordinates.
    pub(super) fn per_metre(&self, uv: Vec2, [dp_du, dp_dv]: [Vec3; 2]) -> f32 {
        let origin = self.transform.apply(Vec2::ZERO);
        let (x, y) = (self.transform.apply(Vec2::X) - origin, self.transform.apply(Vec2::Y) - origin);
        let area = x.perp_dot(y);
        if area == 0.0 {
            // One line of the picture, or one point of it.
            return if x == Vec2::ZERO && y == Vec2::ZERO { 0.0 } else { UNLIMITED };
        }
        // Over coordinates of the picture: the inverse of the matrix of these columns.
        let (across, down) = ((y.y * dp_du - x.y * dp_dv) / area, (x.x * dp_dv - y.x * dp_du) / area);
        self.bandwidth.on_surface(self.transform.apply(uv), Vec2::ZERO, across, down)
    }

    /// Cycles per pixel around `uv`, which changes by `across` and `along` from pixel to pixel.
    pub(super) fn per_pixel(&self, uv: Vec2, across: Vec2, along: Vec2) -> f32 {
        let origin = self.transform.apply(uv);
        let (across, along) =
            (self.transform.apply(uv + across) - origin, self.transform.apply(uv + along) - origin);
        let footprint = across.abs() + along.abs();
        let per_texel = self.bandwidth.map().within(origin.x, origin.y, footprint.x, footprint.y);
        bounded(per_texel * (across * self.texels).length().max((along * self.texels).length()))
    }
}

/// The pictures that colour a material, and those that mix it.
pub(super) fn colours(material: &Material) -> Vec<Paint> {
    if let MaterialKind::Mix { parts, mask } = &material.kind {
        return number(mask).into_iter().chain(parts.iter().flat_map(colours)).collect();
    }
    let inputs: Vec<&ColorInput> = match &material.kind {
        MaterialKind::Black | MaterialKind::Measured(_) | MaterialKind::Mix { .. } => Vec::new(),
        MaterialKind::Diffuse { albedo } => vec![albedo],
        MaterialKind::Phong { diffuse, specular, .. } => vec![diffuse, specular],
        MaterialKind::Conductor { color, .. } => match color {
            ConductorColor::Normal(input) | ConductorColor::Constant(input) => vec![input],
            ConductorColor::Complex { .. } => Vec::new(),
        },
        MaterialKind::Dielectric { tint, .. } => vec![tint],
        MaterialKind::MetallicRoughness { base_color, .. } => vec![base_color],
    };
    inputs.into_iter().filter_map(colour).collect()
}

fn colour(input: &ColorInput) -> Option<Paint> {
    match input {
        ColorInput::Textured { texture, factor } => {
            Some(Paint::new(texture, |texel| luminance(texel * *factor)))
        }
        ColorInput::Constant(_) => None,
    }
}

/// The pictures that change the form of its lobe, or where it is.
pub(super) fn numbers(material: &Material) -> Vec<Paint> {
    let mut inputs: Vec<&ScalarInput> = match &material.kind {
        MaterialKind::Black | MaterialKind::Measured(_) | MaterialKind::Diffuse { .. } => Vec::new(),
        MaterialKind::Phong { exponent, .. } => vec![exponent],
        MaterialKind::Conductor { roughness, .. } | MaterialKind::Dielectric { roughness, .. } => {
            vec![roughness]
        }
        MaterialKind::MetallicRoughness { metallic, roughness, transmission, .. } => {
            vec![metallic, roughness, transmission]
        }
        MaterialKind::Mix { .. } => Vec::new(),
    };
    inputs.extend(material.opacity.as_ref().map(|opacity| &opacity.amount));
    let of_parts: Vec<Paint> = match &material.kind {
        MaterialKind::Mix { parts, .. } => parts.iter().flat_map(numbers).collect(),
        _ => Vec::new(),
    };
    inputs.into_iter().filter_map(number).chain(of_parts).collect()
}

fn number(input: &ScalarInput) -> Option<Paint> {
    match input {
        ScalarInput::Textured { texture, channel, .. } => {
            let channel = (*channel).min(2);
            Some(Paint::new(texture, |texel| texel[channel]))
        }
        ScalarInput::Constant(_) => None,
    }
}

/// The material with every picture replaced by its mean; and whether the form of its lobe, not just its colour, varied.
pub(super) fn without_paint(material: &Material) -> (Material, bool) {
    let color = |input: &ColorInput| ColorInput::Constant(input.mean());
    let mut varies = false;
    let mut scalar = |input: &ScalarInput| match input {
        ScalarInput::Constant(value) => ScalarInput::Constant(*value),
        ScalarInput::Textured { texture, channel, factor } => {
            varies = true;
            ScalarInput::Constant(texture.mean().to_array()[(*channel).min(3)] * factor)
        }
    };
    let kind = match &material.kind {
        MaterialKind::Black => MaterialKind::Black,
        MaterialKind::Measured(brdf) => MaterialKind::Measured(Arc::clone(brdf)),
        MaterialKind::Mix { parts, mask } => {
            let mask = match mask {
                ScalarInput::Textured { texture, channel, factor } => {
                    texture.mean().to_array()[(*channel).min(3)] * factor
                }
                ScalarInput::Constant(share) => *share,
            };
            let parts = parts.each_ref().map(|part| {
                let (plain, part_varies) = without_paint(part);
                varies |= part_varies;
                plain
            });
            MaterialKind::Mix { parts: Arc::new(parts), mask: mask.into() }
        }
        MaterialKind::Diffuse { albedo } => MaterialKind::Diffuse { albedo: color(albedo) },
        MaterialKind::Phong { diffuse, specular, exponent } => MaterialKind::Phong {
            diffuse: color(diffuse),
            specular: color(specular),
            exponent: scalar(exponent),
        },
        MaterialKind::Conductor { color: metal, roughness, anisotropy } => MaterialKind::Conductor {
            color: match metal {
                ConductorColor::Complex { eta, k } => ConductorColor::Complex { eta: *eta, k: *k },
                ConductorColor::Normal(input) => ConductorColor::Normal(color(input)),
                ConductorColor::Constant(input) => ConductorColor::Constant(color(input)),
            },
            roughness: scalar(roughness),
            anisotropy: *anisotropy,
        },
        MaterialKind::Dielectric { ior, roughness, tint } => {
            MaterialKind::Dielectric { ior: *ior, roughness: scalar(roughness), tint: color(tint) }
        }
        MaterialKind::MetallicRoughness { base_color, metallic, roughness, transmission, ior } => {
            MaterialKind::MetallicRoughness {
                base_color: color(base_color),
                metallic: scalar(metallic),
                roughness: scalar(roughness),
                transmission: scalar(transmission),
                ior: *ior,
            }
        }
    };
    let plain = Material { kind, emission: None, normal_map: None, opacity: None, ..material.clone() };
    (plain, varies)
}
