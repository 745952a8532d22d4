//! The scattering of one place of a surface.

use glam::{Vec2, Vec3};

use crate::conductor::{Conductor, Reflectance, sample_mirror};
use crate::dielectric::Dielectric;
use crate::diffuse::Diffuse;
use crate::merl::MeasuredBrdf;
use crate::metallic_roughness::MetallicRoughness;
use crate::mix::Mix;
use crate::phase::Phase;
use crate::phong::Phong;

/// A direction chosen by [`Bsdf::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// The direction to the light, local, unit length, away from the surface.
    pub wi: Vec3,
    /// [`Bsdf::eval`] / density: what the light from there is multiplied by.
    pub weight: Vec3,
    /// The density of `wi` per solid angle over all lobes that are not delta functions, [`Bsdf::pdf`]; of a delta
    /// function the probability that it was chosen.
    pub pdf: f32,
    /// Whether the direction is the only one (a mirror's, a window's): no light sampled otherwise can add to it.
    pub delta: bool,
    /// Whether light goes through the surface.
    pub transmitted: bool,
}

impl BsdfSample {
    /// A sample of lobes that are not delta functions, from their value and density; `None` where the density
    /// is zero.
    #[inline]
    pub(crate) fn scattered(wi: Vec3, (value, pdf): (Vec3, f32)) -> Option<Self> {
        (pdf > 0.0).then(|| Self { wi, weight: value / pdf, pdf, delta: false, transmitted: false })
    }
}

/// How one place of a surface scatters: small, copied freely, with the textures looked up.
///
/// Nanoseconds per call (eval with density / sample) on one core of a busy machine, by the example `material_speed`:
/// diffuse 5 / 11, coloured GGX metal 22 / 45, metal with a complex index 38 / 70, rough glass 30 / 60, glTF 32 / 66,
/// measured 75 / 137 (nearest; 37 for the value alone) and 97 / 165 (interpolated; 66).
///
/// Every answer is finite for any two unit vectors, also for those that lie in the surface.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<'a> {
    pub(crate) lobe: Lobe<'a>,
    two_sided: bool,
    /// The part of the light that meets the lobe; the rest goes straight through.
    opacity: f32,
}

/// The ways to scatter, with directions turned so that `wo` is in front.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Lobe<'a> {
    Black,
    Diffuse(Diffuse),
    Phong(Phong),
    Mirror(Reflectance),
    Conductor(Conductor),
    Dielectric(Dielectric),
    MetallicRoughness(MetallicRoughness),
    Measured(&'a MeasuredBrdf),
    /// Its parts turn directions by themselves.
    Mix(Mix<'a>),
    Phase(Phase),
}

impl<'a> Bsdf<'a> {
    pub(crate) fn new(lobe: Lobe<'a>, two_sided: bool) -> Self {
        // A border has two sides by its nature.
        let two_sided = two_sided || matches!(lobe, Lobe::Dielectric(_));
        Self { lobe, two_sided, opacity: 1.0 }
    }

    /// The same with a surface that is there only in part.
    pub(crate) fn with_opacity(self, opacity: f32) -> Self {
        Self { opacity, ..self }
    }

    /// The same, black from behind unless `two_sided` (or a border of media).
    pub(crate) fn turned_away_unless(self, two_sided: bool) -> Self {
        let two_sided = self.two_sided && (two_sided || matches!(self.lobe, Lobe::Dielectric(_)));
        Self { two_sided, ..self }
    }

    /// The surface where it is there: nothing goes straight through.
    #[must_use]
    pub fn solid(self) -> Self {
        Self { opacity: 1.0, ..self }
    }

    /// Lambert's surface, two-sided.
    pub fn diffuse(albedo: Vec3) -> Bsdf<'static> {
        Bsdf::new(Lobe::Diffuse(Diffuse { albedo }), true)
    }

    /// A point within a medium, by Henyey and Greenstein's phase function of mean cosine `anisotropy`. It has no cosine: its
    /// value is that of the phase function, in all directions.
    pub fn phase(anisotropy: f32) -> Bsdf<'static> {
        Bsdf::new(Lobe::Phase(Phase::new(anisotropy)), true)
    }

    /// The sign that turns `wo` to the front; `None` where nothing scatters.
    #[inline]
    fn side(&self, wo: Vec3) -> Option<f32> {
        if wo.z > GRAZING {
            Some(1.0)
        } else if wo.z < -GRAZING && self.two_sided {
            Some(-1.0)
        } else {
            None
        }
    }

    /// The scattering function times |cos θ| of `wi`; zero for delta lobes.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        match (&self.lobe, self.side(wo)) {
            // The density of a measured lobe costs as much as its value.
            (Lobe::Measured(brdf), Some(side)) if wi.z * side > 0.0 => {
                brdf.eval(turned(wo, side), turned(wi, side)) * self.opacity
            }
            (Lobe::Mix(mix), _) => mix.eval(self.two_sided, wo, wi) * self.opacity,
            _ => self.eval_pdf(wo, wi).0,
        }
    }

    /// The density with which [`sample`](Self::sample) chooses `wi`, per solid angle; delta lobes left out.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(wo, wi).1
    }

    /// [`eval`](Self::eval) and [`pdf`](Self::pdf) together, for little more than one of them.
    #[inline]
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let (value, pdf) = self.lobe_eval_pdf(wo, wi);
        (value * self.opacity, pdf * self.opacity)
    }

    #[inline]
    fn lobe_eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        const NOTHING: (Vec3, f32) = (Vec3::ZERO, 0.0);
        if let Lobe::Mix(mix) = &self.lobe {
            return mix.eval_pdf(self.two_sided, wo, wi);
        }
        let Some(side) = self.side(wo) else { return NOTHING };
        let (wo, wi) = (turned(wo, side), turned(wi, side));
        // False for NaN too.
        let leaves = wi.z.abs() > GRAZING;
        if !leaves {
            return NOTHING;
        }
        if let Lobe::Dielectric(dielectric) = &self.lobe {
            return dielectric.eval_pdf(wo, wi, side > 0.0);
        }
        if let Lobe::Phase(phase) = &self.lobe {
            return phase.eval_pdf(wo, wi);
        }
        if wi.z <= 0.0 {
            return NOTHING;
        }
        match &self.lobe {
            Lobe::Diffuse(diffuse) => diffuse.eval_pdf(wi),
            Lobe::Phong(phong) => phong.eval_pdf(wo, wi),
            Lobe::Conductor(conductor) => conductor.eval_pdf(wo, wi),
            Lobe::MetallicRoughness(model) => model.eval_pdf(wo, wi),
            Lobe::Measured(brdf) => brdf.eval_pdf(wo, wi),
            Lobe::Black | Lobe::Mirror(_) | Lobe::Dielectric(_) | Lobe::Mix(_) | Lobe::Phase(_) => NOTHING,
        }
    }

    /// Chooses a direction to look for light in. `u_lobe` chooses among lobes, `u` within; all in [0, 1).
    /// `None` where nothing is scattered.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let mut u_lobe = u_lobe;
        if self.opacity < 1.0 {
            let pdf = 1.0 - self.opacity;
            if u_lobe < pdf {
                let through = BsdfSample { wi: -wo, weight: Vec3::ONE, pdf, delta: true, transmitted: true };
                return (wo.z.abs() > GRAZING).then_some(through);
            }
            u_lobe = ((u_lobe - pdf) / self.opacity).min(1.0 - f32::EPSILON);
        }
        if let Lobe::Mix(mix) = &self.lobe {
            let sample = mix.sample(self.two_sided, wo, u_lobe, u)?;
            return Some(BsdfSample { pdf: sample.pdf * self.opacity, ..sample });
        }
        let side = self.side(wo)?;
        let wo = turned(wo, side);
        let mut sample = match &self.lobe {
            Lobe::Black | Lobe::Mix(_) => None,
            Lobe::Diffuse(diffuse) => diffuse.sample(u),
            Lobe::Phong(phong) => phong.sample(wo, u_lobe, u),
            Lobe::Mirror(reflectance) => sample_mirror(reflectance, wo),
            Lobe::Conductor(conductor) => conductor.sample(wo, u),
            Lobe::Dielectric(dielectric) => dielectric.sample(wo, u_lobe, u, side > 0.0),
            Lobe::MetallicRoughness(model) => model.sample(wo, u_lobe, u),
            Lobe::Measured(brdf) => brdf.sample(wo, u_lobe, u),
            Lobe::Phase(phase) => phase.sample(wo, u),
        }?;
        sample.wi.z *= side;
        sample.pdf *= self.opacity;
        (sample.wi.z.abs() > GRAZING).then_some(sample)
    }

    /// Whether nothing scatters but delta functions: sampling lights is then of no use.
    pub fn is_delta_only(&self) -> bool {
        match &self.lobe {
            Lobe::Black | Lobe::Mirror(_) => true,
            Lobe::Dielectric(dielectric) => dielectric.facets.is_none(),
            Lobe::Mix(mix) => mix.parts(true).iter().all(|(_, part)| part.is_delta_only()),
            _ => false,
        }
    }

    /// A colour that stands for the surface in the `albedo` layer of a picture: what it returns straight on.
    pub fn albedo(&self) -> Vec3 {
        match &self.lobe {
            Lobe::Black => Vec3::ZERO,
            Lobe::Diffuse(diffuse) => diffuse.albedo,
            Lobe::Phong(phong) => phong.diffuse + phong.specular,
            Lobe::Mirror(reflectance) => reflectance.at(1.0),
            Lobe::Conductor(conductor) => conductor.reflectance.at(1.0),
            Lobe::Dielectric(dielectric) => dielectric.tint,
            Lobe::MetallicRoughness(model) => model.albedo(),
            Lobe::Measured(brdf) => brdf.albedo_straight_on(),
            Lobe::Mix(mix) => mix.parts(true).iter().map(|(share, part)| *share * part.albedo()).sum(),
            Lobe::Phase(_) => Vec3::ONE,
        }
    }

    /// The index of refraction beyond the surface over that on the side of `wo`; 1 where nothing is refracted. Of a mix,
    /// that of the first part that refracts.
    pub fn index_beyond(&self, wo: Vec3) -> f32 {
        match &self.lobe {
            Lobe::Dielectric(dielectric) if wo.z < 0.0 => 1.0 / dielectric.ior,
            Lobe::Dielectric(dielectric) => dielectric.ior,
            Lobe::Mix(mix) => {
                let indices = mix.parts(true).map(|(_, part)| part.index_beyond(wo));
                indices.into_iter().find(|&index| index != 1.0).unwrap_or(1.0)
            }
            _ => 1.0,
        }
    }

    /// Whether light can go through.
    pub fn transmits(&self) -> bool {
        self.opacity < 1.0
            || match &self.lobe {
                Lobe::Dielectric(_) | Lobe::Phase(_) => true,
                Lobe::MetallicRoughness(model) => model.transmits(),
                Lobe::Mix(mix) => mix.parts(true).iter().any(|(_, part)| part.transmits()),
                _ => false,
            }
    }
}

/// Cosines up to this lie in the surface: nothing arrives there, and quotients of such cosines are not finite.
const GRAZING: f32 = 1e-9;

#[inline]
fn turned(v: Vec3, side: f32) -> Vec3 {
    Vec3::new(v.x, v.y, v.z * side)
}
