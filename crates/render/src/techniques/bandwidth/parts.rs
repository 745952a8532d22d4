//! Materials taken apart, so that what pictures paint is multiplied in after shading and not shaded at every pixel.
//!
//! ```text
//! f(ω_i, ω) = w_0 F_0(ω_i, ω) + w_1 F_1(ω_i, ω)          w by the place, F the same everywhere
//! ```
//!
//! For one colour c that f depends on linearly: w = (1, c), F_0 = f at black, F_1 = f at white − f at black. For Phong's two
//! colours: the one with the other black. For two materials and a mask m: w = ((1 − m) c_0, m c_1) with F of the one and of the
//! other, c the colour of a diffuse one and else white; parts with pictures of their own beside that, and mixes of mixes, stay
//! whole. Whether f is such a sum is not assumed but tried, and where it is not (a textured
//! glTF metal in part, say) the material stays whole. The seed shades pictures on materials as they are, `[001]` §2.3, with
//! t added to ν_s; taken apart, t is zero for colours.

use glam::Vec3;
use halflight_material::{
    Bsdf, ColorInput, ConductorColor, Material, MaterialKind, ScalarInput, SurfaceInput,
};

use super::paint::{colours, numbers};

/// What a place sends to the eye by each of the parts of its material.
pub(super) type Shares = [Vec3; 2];

/// How a material is put together.
pub(super) enum Parts {
    /// F_0 alone, of this material without pictures.
    Whole(Box<Material>),
    /// One colour: the material in black and in white.
    Tinted(Box<[Material; 2]>),
    /// Phong's: without its lobe in white, without its diffuse part in white.
    Sum(Box<[Material; 2]>),
    /// A mix: what it is mixed of, what is diffuse in white; and both with their own mean colours.
    Mixed(Box<[Material; 2]>, Box<[Material; 2]>),
}

/// Whether places of a material differ in nothing but what [`Parts::weights`] says.
pub(super) struct Split {
    pub(super) parts: Parts,
    /// Whether that holds of its pictures.
    pub(super) is_apart: bool,
    /// Whether that holds of vertex colours, too.
    pub(super) is_complete: bool,
}

impl Parts {
    /// w_0 and w_1 at a place of the material itself.
    #[inline]
    pub(super) fn weights(&self, material: &Material, input: &SurfaceInput) -> Shares {
        let color = |source: &ColorInput| (source.at(input.uv) * input.color).clamp(Vec3::ZERO, Vec3::ONE);
        match (self, &material.kind) {
            (Parts::Whole(_), _) => [Vec3::ONE, Vec3::ZERO],
            (Parts::Sum(_), MaterialKind::Phong { diffuse, specular, .. }) => {
                [color(diffuse), color(specular)]
            }
            (Parts::Mixed(..), MaterialKind::Mix { parts, mask }) => {
                let second = mask.share_at(input.uv);
                let part = |i: usize, share: f32| match &parts[i].kind {
                    MaterialKind::Diffuse { albedo } => share * color(albedo),
                    _ => Vec3::splat(share),
                };
                [part(0, 1.0 - second), part(1, second)]
            }
            (
                _,
                MaterialKind::Diffuse { albedo: c }
                | MaterialKind::MetallicRoughness { base_color: c, .. }
                | MaterialKind::Conductor {
                    color: ConductorColor::Normal(c) | ConductorColor::Constant(c),
                    ..
                },
            ) => [Vec3::ONE, color(c)],
            _ => [Vec3::ONE, Vec3::ZERO],
        }
    }

    /// The scattering functions that [`Self::values`] asks, made once for many directions.
    #[inline]
    pub(super) fn bsdfs(&self) -> Scattering<'_> {
        let input = SurfaceInput::default();
        match self {
            Parts::Whole(material) => Scattering { first: material.bsdf(&input), second: None, from: false },
            Parts::Tinted(pair) => {
                Scattering { first: pair[0].bsdf(&input), second: Some(pair[1].bsdf(&input)), from: true }
            }
            Parts::Sum(pair) | Parts::Mixed(pair, _) => {
                Scattering { first: pair[0].bsdf(&input), second: Some(pair[1].bsdf(&input)), from: false }
            }
        }
    }

    /// What a mix is mixed of, without pictures, where places are judged by each of its parts.
    pub(super) fn mixed(&self) -> Option<&[Material; 2]> {
        match self {
            Parts::Mixed(_, pair) => Some(pair),
            _ => None,
        }
    }

    /// Each part of a mix alone.
    pub(super) fn wholes(&self) -> Option<[Parts; 2]> {
        match self {
            Parts::Mixed(pair, _) => Some(pair.each_ref().map(|part| Parts::Whole(Box::new(part.clone())))),
            _ => None,
        }
    }

    /// Whether there is a second part.
    pub(super) fn is_double(&self) -> bool {
        !matches!(self, Parts::Whole(_))
    }
}

impl Split {
    /// Takes a material apart; `plain` is the same with pictures replaced by their means.
    pub(super) fn new(material: &Material, plain: &Material) -> Self {
        let with = |kind| Material { kind, ..plain.clone() };
        let one = |recoloured: &dyn Fn(Vec3) -> MaterialKind| {
            let pair = [with(recoloured(Vec3::ZERO)), with(recoloured(Vec3::ONE))];
            if is_linear(&pair, &with(recoloured(Vec3::splat(0.5)))) {
                Split { parts: Parts::Tinted(Box::new(pair)), is_apart: true, is_complete: true }
            } else {
                Split { is_apart: false, is_complete: false, ..Split::whole(plain) }
            }
        };
        match &plain.kind {
            MaterialKind::Diffuse { .. } => one(&|c| MaterialKind::Diffuse { albedo: c.into() }),
            MaterialKind::Phong { exponent, .. } => {
                let part = |diffuse: f32| {
                    with(MaterialKind::Phong {
                        diffuse: Vec3::splat(diffuse).into(),
                        specular: Vec3::splat(1.0 - diffuse).into(),
                        exponent: exponent.clone(),
                    })
                };
                let parts = Parts::Sum(Box::new([part(1.0), part(0.0)]));
                Split { parts, is_apart: true, is_complete: true }
            }
            MaterialKind::Conductor { color, roughness, anisotropy } => {
                let conductor = |color| MaterialKind::Conductor {
                    color,
                    roughness: roughness.clone(),
                    anisotropy: *anisotropy,
                };
                match color {
                    ConductorColor::Normal(_) => one(&|c| conductor(ConductorColor::Normal(c.into()))),
                    ConductorColor::Constant(_) => one(&|c| conductor(ConductorColor::Constant(c.into()))),
                    // Vertex colours do not reach it.
                    ConductorColor::Complex { .. } => Split::whole(plain),
                }
            }
            MaterialKind::MetallicRoughness { metallic, roughness, transmission, ior, .. } => {
                one(&|c| MaterialKind::MetallicRoughness {
                    base_color: c.into(),
                    metallic: metallic.clone(),
                    roughness: roughness.clone(),
                    transmission: transmission.clone(),
                    ior: *ior,
                })
            }
            MaterialKind::Black | MaterialKind::Measured(_) => Split::whole(plain),
            // What goes through is not tinted by the tables.
            MaterialKind::Dielectric { .. } => {
                Split { is_apart: false, is_complete: false, ..Split::whole(plain) }
            }
            MaterialKind::Mix { parts: plain_parts, .. } => match &material.kind {
                MaterialKind::Mix { parts, mask } => Split::mixed(parts, mask, plain, plain_parts),
                _ => Split { is_apart: false, is_complete: false, ..Split::whole(plain) },
            },
        }
    }

    fn mixed(
        parts: &[Material; 2],
        mask: &ScalarInput,
        plain: &Material,
        plain_parts: &[Material; 2],
    ) -> Self {
        let ignores_vertices = |part: &&Material| match &part.kind {
            MaterialKind::Black | MaterialKind::Measured(_) => true,
            MaterialKind::Conductor { color, .. } => matches!(color, ConductorColor::Complex { .. }),
            _ => false,
        };
        let is_diffuse = |part: &Material| matches!(part.kind, MaterialKind::Diffuse { .. });
        let is_mix = |part: &Material| matches!(part.kind, MaterialKind::Mix { .. });
        let is_painted = |part: &Material| !(colours(part).is_empty() && numbers(part).is_empty());
        if matches!(mask, ScalarInput::Constant(_)) && !parts.iter().any(is_painted) {
            // One lobe, the same everywhere.
            let is_complete = plain.leaves().iter().all(ignores_vertices);
            return Split { is_complete, ..Split::whole(plain) };
        }
        if parts.iter().any(|part| is_mix(part) || !is_diffuse(part) && is_painted(part)) {
            return Split { is_apart: false, is_complete: false, ..Split::whole(plain) };
        }
        let white = |part: &Material| match is_diffuse(part) {
            true => Material { kind: MaterialKind::Diffuse { albedo: Vec3::ONE.into() }, ..part.clone() },
            false => part.clone(),
        };
        let is_complete = parts.iter().all(|part| is_diffuse(part) || ignores_vertices(&part));
        let parts = Parts::Mixed(Box::new(plain_parts.each_ref().map(white)), Box::new(plain_parts.clone()));
        Split { parts, is_apart: true, is_complete }
    }

    fn whole(plain: &Material) -> Self {
        Self { parts: Parts::Whole(Box::new(plain.clone())), is_apart: true, is_complete: true }
    }
}

/// F_0 and F_1, ready to be asked.
pub(super) struct Scattering<'a> {
    first: Bsdf<'a>,
    second: Option<Bsdf<'a>>,
    /// Whether the second is what it adds to the first.
    from: bool,
}

impl Scattering<'_> {
    /// F_0 and F_1, each times the cosine.
    #[inline]
    pub(super) fn eval(&self, view: Vec3, light: Vec3) -> Shares {
        let first = self.first.eval(view, light);
        match &self.second {
            None => [first, Vec3::ZERO],
            Some(second) if self.from => [first, second.eval(view, light) - first],
            Some(second) => [first, second.eval(view, light)],
        }
    }
}

/// What the parts send together.
#[inline]
pub(super) fn joined(shares: Shares, weights: Shares) -> Vec3 {
    shares[0] * weights[0] + shares[1] * weights[1]
}

/// Whether what lies in the middle of black and white scatters as the mean of both.
fn is_linear(ends: &[Material; 2], middle: &Material) -> bool {
    let input = SurfaceInput::default();
    let [black, white, middle] = [&ends[0], &ends[1], middle].map(|m| m.bsdf(&input));
    (0..64).all(|i| {
        let at = |turn: f32, shift: f32| {
            let z = ((i as f32 + shift) * 0.618_034).fract() * 0.98 + 0.01;
            let (sin, cos) = (i as f32 * turn + shift).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * cos, r * sin, z)
        };
        let (view, light) = (at(2.399_963, 0.5), at(1.1, 0.2));
        let mean = 0.5 * (black.eval(view, light) + white.eval(view, light));
        let off = (middle.eval(view, light) - mean).abs();
        off.cmple(2e-3 * mean + Vec3::splat(1e-6)).all()
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec2;
    use halflight_image::{Texels, TextureImage};
    use halflight_material::Texture;

    use super::super::paint::without_paint;
    use super::*;

    #[test]
    fn a_material_is_the_sum_of_its_parts_wherever_it_can_be_taken_apart() {
        let gltf = |metallic: f32| {
            let kind = MaterialKind::MetallicRoughness {
                base_color: Vec3::new(0.7, 0.4, 0.1).into(),
                metallic: metallic.into(),
                roughness: 0.5.into(),
                transmission: 0.0.into(),
                ior: 1.5,
            };
            Material::new("gltf", kind)
        };
        let color = ConductorColor::Normal(Vec3::new(0.9, 0.6, 0.2).into());
        let metal = MaterialKind::Conductor { color, roughness: 0.5.into(), anisotropy: 0.0 };
        let materials = [
            Material::diffuse(Vec3::new(0.2, 0.5, 0.9)),
            Material::phong(Vec3::new(0.3, 0.2, 0.1), Vec3::new(0.4, 0.5, 0.6), 30.0),
            Material::new("metal", metal),
            gltf(0.0),
            gltf(1.0),
        ];
        let (view, light) = (Vec3::new(0.5, 0.1, 0.8).normalize(), Vec3::new(-0.4, 0.2, 0.6).normalize());
        let input = SurfaceInput { color: Vec3::new(0.8, 0.9, 0.5), ..SurfaceInput::default() };
        for material in &materials {
            let split = Split::new(material, material);
            assert!(split.is_complete && split.parts.is_double(), "{}", material.name);
            let sum = joined(split.parts.bsdfs().eval(view, light), split.parts.weights(material, &input));
            let whole = material.bsdf(&input).eval(view, light);
            assert!(sum.distance(whole) < 1e-4 * whole.length(), "{}: {sum} {whole}", material.name);
        }
        // Half a metal depends on its colour's square.
        let half = gltf(0.5);
        assert!(!Split::new(&half, &half).is_complete);
    }

    #[test]
    fn a_mix_by_a_picture_is_the_sum_of_its_parts_times_the_mask() {
        let picture = TextureImage {
            width: 2,
            height: 1,
            texels: Texels::Floats(vec![[0.2, 0.5, 0.9, 1.0], [0.7, 0.1, 0.3, 1.0]]),
        };
        let texture = Arc::new(Texture::new(Arc::new(picture)));
        let mask = ScalarInput::Textured { texture: Arc::clone(&texture), channel: 0, factor: 1.0 };
        let painted = ColorInput::Textured { texture, factor: Vec3::ONE };
        let marble = Material::new("marble", MaterialKind::Diffuse { albedo: painted.clone() });
        let shiny = Material::phong(Vec3::splat(0.2), Vec3::splat(0.6), 90.0);
        let mix = |first: &Material, second: &Material, mask: &ScalarInput| {
            let parts = Arc::new([first.clone(), second.clone()]);
            Material::new("mix", MaterialKind::Mix { parts, mask: mask.clone() })
        };
        let both = mix(&marble, &shiny, &mask);
        let (plain, _) = without_paint(&both);
        let split = Split::new(&both, &plain);
        assert!(split.is_apart && !split.is_complete && split.parts.is_double());
        let (view, light) = (Vec3::new(0.5, 0.1, 0.8).normalize(), Vec3::new(-0.4, 0.2, 0.6).normalize());
        for u in [0.25, 0.4, 0.75] {
            let input = SurfaceInput { uv: Vec2::new(u, 0.5), ..SurfaceInput::default() };
            let sum = joined(split.parts.bsdfs().eval(view, light), split.parts.weights(&both, &input));
            let whole = both.bsdf(&input).eval(view, light);
            assert!(sum.distance(whole) < 1e-5 * whole.length(), "{u}: {sum} {whole}");
        }
        // Pictures of other kinds, and mixes in mixes, are not taken apart; one lobe for all is itself.
        let metal = MaterialKind::Conductor {
            color: ConductorColor::Normal(painted),
            roughness: 0.5.into(),
            anisotropy: 0.0,
        };
        let half = ScalarInput::Constant(0.5);
        for (first, second, mask, is_apart) in [
            (&Material::new("metal", metal), &shiny, &mask, false),
            (&both, &shiny, &mask, false),
            (&shiny, &Material::diffuse(Vec3::splat(0.3)), &half, true),
        ] {
            let both = mix(first, second, mask);
            let split = Split::new(&both, &without_paint(&both).0);
            assert!(split.is_apart == is_apart && !split.parts.is_double());
        }
    }
}
