//! What a surface is made of, as a scene describes it.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::bsdf::{Bsdf, Lobe};
use crate::conductor::{Conductor, Reflectance};
use crate::dielectric::Dielectric;
use crate::diffuse::Diffuse;
use crate::footprint::Footprint;
use crate::input::{ColorInput, NormalMap, Opacity, ScalarInput, SurfaceInput};
use crate::merl::MeasuredBrdf;
use crate::metallic_roughness::MetallicRoughness;
use crate::metals::metal;
use crate::microfacet::{self, Ggx};
use crate::mix::Mix;
use crate::phong::Phong;

/// What a surface is made of.
#[derive(Clone, Debug)]
pub struct Material {
    /// How the scene calls it.
    pub name: String,
    /// How it scatters.
    pub kind: MaterialKind,
    /// The radiance it emits, the same in every direction; `None` if it does not shine.
    pub emission: Option<ColorInput>,
    /// Whether an opaque surface scatters from behind as it does from the front; else it is black from behind.
    pub two_sided: bool,
    /// Small bumps, as normals in the tangent frame. The caller turns the shading frame by them, see
    /// [`Material::shading_normal_local`].
    pub normal_map: Option<NormalMap>,
    /// How much of the surface is there, for leaves cut out of a picture and for gauze; `None` for all of it. What is
    /// not there neither scatters nor shines.
    pub opacity: Option<Opacity>,
}

/// The ways to scatter. Roughness is from 0 to 1, and α = roughness².
#[derive(Clone, Debug)]
pub enum MaterialKind {
    /// Scatters nothing: what only shines, or only blocks.
    Black,
    /// Lambert's surface.
    Diffuse {
        /// The part of light it gives back.
        albedo: ColorInput,
    },
    /// A diffuse part and a power-cosine lobe about the mirror direction, in the reciprocal form.
    Phong {
        /// Albedo of the diffuse part.
        diffuse: ColorInput,
        /// What the lobe reflects at normal incidence.
        specular: ColorInput,
        /// The power of the cosine.
        exponent: ScalarInput,
    },
    /// Metal: a GGX surface; smooth (a mirror) where the roughness is below about 0.03.
    Conductor {
        /// What a flat piece of it reflects.
        color: ConductorColor,
        /// Roughness along the tangent and, unless `anisotropy` says otherwise, across it.
        roughness: ScalarInput,
        /// From −1 to 1: the highlight is stretched along the tangent (above 0) or across it (below 0), as in
        /// Burley 2012: αx = α / √(1 − 0.9a), αy = α · √(1 − 0.9a).
        anisotropy: f32,
    },
    /// Glass, water: reflects and refracts; smooth where the roughness is below about 0.03.
    Dielectric {
        /// Index of refraction of the inside relative to the outside.
        ior: f32,
        /// Width of the GGX distribution.
        roughness: ScalarInput,
        /// Multiplies what goes through, at each border. White for clear glass.
        tint: ColorInput,
    },
    /// glTF 2.0's metallic-roughness model.
    MetallicRoughness {
        /// Albedo of the dielectric, reflectance of the metal.
        base_color: ColorInput,
        /// 0 dielectric, 1 metal.
        metallic: ScalarInput,
        /// Width of the GGX distribution.
        roughness: ScalarInput,
        /// The part of the diffuse light that goes straight through instead (a thin wall, tinted by the base
        /// colour): glTF's `KHR_materials_transmission` without its blur.
        transmission: ScalarInput,
        /// Index of refraction of the dielectric, 1.5 by default.
        ior: f32,
    },
    /// A table in the layout of the MERL database.
    Measured(Arc<MeasuredBrdf>),
    /// Two materials side by side: how they scatter, and nothing else of them. They may be mixes themselves.
    Mix {
        /// What there is where the mask is 0, and what there is where it is 1.
        parts: Arc<[Material; 2]>,
        /// The share of the second, from 0 to 1.
        mask: ScalarInput,
    },
}

/// What a flat piece of metal reflects.
#[derive(Clone, Debug)]
pub enum ConductorColor {
    /// The exact Fresnel reflectance of a complex index of refraction η + ik, each at red, green and blue.
    Complex {
        /// Real part.
        eta: Vec3,
        /// Imaginary part: the extinction.
        k: Vec3,
    },
    /// Schlick's approximation from the colour at normal incidence.
    Normal(ColorInput),
    /// The same at every angle: an ideal mirror.
    Constant(ColorInput),
}

impl Material {
    /// A two-sided material that does not shine.
    pub fn new(name: impl Into<String>, kind: MaterialKind) -> Self {
        Self { name: name.into(), kind, emission: None, two_sided: true, normal_map: None, opacity: None }
    }

    /// Lambert's surface of one colour.
    pub fn diffuse(albedo: Vec3) -> Self {
        Self::new("diffuse", MaterialKind::Diffuse { albedo: albedo.into() })
    }

    /// A surface that only shines, with one radiance in every direction.
    pub fn emissive(radiance: Vec3) -> Self {
        Self { emission: Some(radiance.into()), ..Self::new("emissive", MaterialKind::Black) }
    }

    /// A diffuse part and a power-cosine lobe, each of one colour.
    pub fn phong(diffuse: Vec3, specular: Vec3, exponent: f32) -> Self {
        let (diffuse, specular) = (diffuse.into(), specular.into());
        Self::new("phong", MaterialKind::Phong { diffuse, specular, exponent: exponent.into() })
    }

    /// A metal that [`metal`] knows by name; `None` for others.
    ///
    /// ```
    /// use halflight_material::Material;
    /// assert!(Material::metal("gold", 0.2).is_some());
    /// ```
    pub fn metal(name: &str, roughness: f32) -> Option<Self> {
        let (eta, k) = metal(name)?;
        let color = ConductorColor::Complex { eta, k };
        Some(Self::new(name, MaterialKind::Conductor { color, roughness: roughness.into(), anisotropy: 0.0 }))
    }

    /// An ideal mirror.
    pub fn mirror() -> Self {
        let color = ConductorColor::Constant(Vec3::ONE.into());
        Self::new("mirror", MaterialKind::Conductor { color, roughness: 0.0.into(), anisotropy: 0.0 })
    }

    /// Clear, smooth glass of that index of refraction.
    pub fn glass(ior: f32) -> Self {
        Self::new("glass", MaterialKind::Dielectric { ior, roughness: 0.0.into(), tint: Vec3::ONE.into() })
    }

    /// How the surface scatters at one place.
    #[inline]
    pub fn bsdf(&self, input: &SurfaceInput) -> Bsdf<'_> {
        self.bsdf_over(input, None, 0.0)
    }

    /// How the surface scatters at one place as the mean over a footprint about it, in which normals have slopes of variance
    /// `slopes` per axis ([`Material::normal_over`]): these widen lobes. What is smooth in the mean becomes a lobe. Where more
    /// light would be reflected than comes, colours are limited, which the mean of the limited ones keeps; what that is not known
    /// of is not averaged.
    pub fn bsdf_over(&self, input: &SurfaceInput, footprint: Option<Footprint>, slopes: f32) -> Bsdf<'_> {
        let color = |source: &ColorInput| {
            let linear = footprint.filter(|_| (source.most() * input.color).max_element() <= 1.0);
            (source.over(input.uv, linear) * input.color).clamp(Vec3::ZERO, Vec3::ONE)
        };
        let scalar = |source: &ScalarInput| source.over(input.uv, footprint);
        // Facets of roughness α have slopes of variance α²/2.
        let widened = |alpha: f32| {
            if slopes > 0.0 { (alpha * alpha + 2.0 * slopes).sqrt().min(1.0) } else { alpha }
        };
        let lobe = match &self.kind {
            MaterialKind::Black => Lobe::Black,
            MaterialKind::Diffuse { albedo } => Lobe::Diffuse(Diffuse { albedo: color(albedo) }),
            MaterialKind::Phong { diffuse, specular, exponent } => {
                let (diffuse, specular) = phong_colors(diffuse, specular, input, footprint);
                Lobe::Phong(Phong::new(diffuse, specular, {
                    let exponent = scalar(exponent);
                    // A normal that leans turns the lobe by twice as much.
                    if slopes > 0.0 { exponent / (1.0 + 4.0 * slopes * exponent) } else { exponent }
                }))
            }
            MaterialKind::Conductor { color: metal, roughness, anisotropy } => {
                let reflectance = match metal {
                    ConductorColor::Complex { eta, k } => {
                        Reflectance::Complex { eta: index(*eta), k: index(*k) }
                    }
                    ConductorColor::Normal(normal) => Reflectance::Normal(color(normal)),
                    ConductorColor::Constant(every) => Reflectance::Constant(color(every)),
                };
                let alpha = widened(microfacet::alpha(scalar(roughness)));
                if alpha < microfacet::SMOOTH_ALPHA {
                    Lobe::Mirror(reflectance)
                } else {
                    Lobe::Conductor(Conductor { reflectance, facets: Ggx::anisotropic(alpha, *anisotropy) })
                }
            }
            MaterialKind::Dielectric { ior, roughness, tint } => Lobe::Dielectric(Dielectric::new(
                *ior,
                color(tint),
                widened(microfacet::alpha(scalar(roughness))),
            )),
            MaterialKind::MetallicRoughness { base_color, metallic, roughness, transmission, ior } => {
                Lobe::MetallicRoughness(MetallicRoughness::new(
                    color(base_color),
                    scalar(metallic),
                    widened(microfacet::alpha(scalar(roughness))),
                    scalar(transmission),
                    *ior,
                ))
            }
            MaterialKind::Measured(brdf) => Lobe::Measured(brdf),
            MaterialKind::Mix { parts, mask } => {
                let share = mask.share_at(input.uv);
                if share <= 0.0 || share >= 1.0 {
                    let opacity = self.opacity_at(input);
                    let part =
                        parts[usize::from(share >= 1.0)].bsdf(input).turned_away_unless(self.two_sided);
                    let part = if opacity > 0.0 { part } else { Bsdf::new(Lobe::Black, self.two_sided) };
                    return part.with_opacity(opacity);
                }
                Lobe::Mix(Mix::new(parts, *input, share))
            }
        };
        let opacity = self.opacity_at(input);
        Bsdf::new(if opacity > 0.0 { lobe } else { Lobe::Black }, self.two_sided).with_opacity(opacity)
    }

    /// The radiance emitted at one place, in every direction of the side that shines; zero if none.
    pub fn emitted(&self, input: &SurfaceInput) -> Vec3 {
        self.emission.as_ref().map_or(Vec3::ZERO, |emission| emission.at(input.uv) * self.opacity_at(input))
    }

    /// The part of the light that the surface stops at one place.
    fn opacity_at(&self, input: &SurfaceInput) -> f32 {
        self.opacity.as_ref().map_or(1.0, |opacity| opacity.at(input.uv))
    }

    /// Whether the surface shines at all.
    pub fn is_emissive(&self) -> bool {
        match &self.emission {
            None => false,
            Some(ColorInput::Constant(radiance)) => radiance.max_element() > 0.0,
            Some(ColorInput::Textured { factor, .. }) => factor.max_element() > 0.0,
        }
    }

    /// Whether it scatters alike at every point, so that one [`Material::bsdf`] stands for all of a surface of one
    /// colour: no textures and no normal map.
    pub fn is_uniform(&self) -> bool {
        let color = |input: &ColorInput| matches!(input, ColorInput::Constant(_));
        let scalar = |input: &ScalarInput| matches!(input, ScalarInput::Constant(_));
        self.normal_map.is_none()
            && match &self.kind {
                MaterialKind::Black | MaterialKind::Measured(_) => true,
                MaterialKind::Diffuse { albedo } => color(albedo),
                MaterialKind::Phong { diffuse, specular, exponent } => {
                    color(diffuse) && color(specular) && scalar(exponent)
                }
                MaterialKind::Conductor { color: metal, roughness, .. } => {
                    scalar(roughness)
                        && match metal {
                            ConductorColor::Complex { .. } => true,
                            ConductorColor::Normal(input) | ConductorColor::Constant(input) => color(input),
                        }
                }
                MaterialKind::Dielectric { roughness, tint, .. } => scalar(roughness) && color(tint),
                MaterialKind::MetallicRoughness { base_color, metallic, roughness, transmission, .. } => {
                    color(base_color) && [metallic, roughness, transmission].into_iter().all(scalar)
                }
                MaterialKind::Mix { parts, mask } => scalar(mask) && parts.iter().all(Material::is_uniform),
            }
    }

    /// The materials that it is mixed of, mixes among them taken apart; itself alone if it is no mix.
    pub fn leaves(&self) -> Vec<&Material> {
        match &self.kind {
            MaterialKind::Mix { parts, .. } => parts.iter().flat_map(Material::leaves).collect(),
            _ => vec![self],
        }
    }

    /// Whether it scatters alike in all directions, or not at all, wherever it is.
    pub fn is_matt(&self) -> bool {
        match &self.kind {
            MaterialKind::Black | MaterialKind::Diffuse { .. } => true,
            MaterialKind::Mix { parts, .. } => parts.iter().all(Material::is_matt),
            _ => false,
        }
    }

    /// Whether it matters how texture coordinates run over the surface: for a normal map, or a grain.
    pub fn needs_tangents(&self) -> bool {
        self.normal_map.is_some()
            || match &self.kind {
                MaterialKind::Conductor { anisotropy, .. } => *anisotropy != 0.0,
                MaterialKind::Mix { parts, .. } => parts.iter().any(Material::needs_tangents),
                _ => false,
            }
    }

    /// The mean emitted radiance over the texture. Walks the whole picture: for preparation, not for shading.
    pub fn mean_emission(&self) -> Vec3 {
        self.emission.as_ref().map_or(Vec3::ZERO, ColorInput::mean)
    }

    /// The mean normal under a footprint that the normal map gives in the tangent frame, if there is a map, and the variance of
    /// slopes about it.
    pub fn normal_over(&self, uv: Vec2, footprint: Footprint) -> Option<(Vec3, f32)> {
        self.normal_map.as_ref().map(|map| map.over(uv, footprint))
    }

    /// The unit normal that the normal map gives in the tangent frame, if there is a map.
    pub fn shading_normal_local(&self, uv: Vec2) -> Option<Vec3> {
        self.normal_map.as_ref().map(|map| map.at(uv))
    }
}

/// The colours of a Phong material as the mean under a footprint. Both are scaled down together where their sum is above 1, so that the
/// mean is that of scaled ones.
fn phong_colors(
    diffuse: &ColorInput,
    specular: &ColorInput,
    input: &SurfaceInput,
    footprint: Option<Footprint>,
) -> (Vec3, Vec3) {
    let within = |color: Vec3| (color * input.color).clamp(Vec3::ZERO, Vec3::ONE);
    let both = |footprint: Option<Footprint>| {
        (within(diffuse.over(input.uv, footprint)), within(specular.over(input.uv, footprint)))
    };
    let Some(footprint) = footprint else { return both(None) };
    if ((diffuse.most() + specular.most()) * input.color).max_element() <= 1.0 {
        return both(Some(footprint));
    }
    let (texture, factor, constant) = match (diffuse, specular) {
        (ColorInput::Textured { texture, factor }, ColorInput::Constant(constant))
        | (ColorInput::Constant(constant), ColorInput::Textured { texture, factor })
            if input.color == Vec3::ONE =>
        {
            (texture, *factor, within(*constant))
        }
        _ => return both(None),
    };
    let numbers = [factor.x, factor.y, factor.z, constant.x, constant.y, constant.z];
    let limited = |texel: glam::Vec4| {
        let color = (texel.truncate() * factor).clamp(Vec3::ZERO, Vec3::ONE);
        let scale = 1.0 / (color + constant).max_element().max(1.0);
        (color * scale).extend(scale)
    };
    let Some(mean) = texture.mapped_over(input.uv, footprint, numbers, limited) else { return both(None) };
    let (varies, even) = (mean.truncate(), constant * mean.w);
    if matches!(diffuse, ColorInput::Textured { .. }) { (varies, even) } else { (even, varies) }
}

/// Indices of refraction in a range whose fourth powers are finite.
fn index(of: Vec3) -> Vec3 {
    of.clamp(Vec3::ZERO, Vec3::splat(1e6))
}
