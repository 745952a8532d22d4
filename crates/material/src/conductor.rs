//! Metal: f = F D G / (4 cos_o cos_i) over a GGX surface, or an ideal mirror where it is smooth.
//!
//! Source: Walter et al. 2007; Fresnel terms in `fresnel`. Sampled by visible normals, so that a weight is
//! F · G₂/G₁ ≤ 1 at every angle.

use glam::{Vec2, Vec3};

use crate::bsdf::BsdfSample;
use crate::fresnel;
use crate::microfacet::Ggx;
use crate::sampling::reflect;

/// What a facet reflects.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Reflectance {
    Complex {
        eta: Vec3,
        k: Vec3,
    },
    Normal(Vec3),
    /// The same at every angle.
    Constant(Vec3),
}

impl Reflectance {
    #[inline]
    pub(crate) fn at(&self, cos: f32) -> Vec3 {
        match *self {
            Reflectance::Complex { eta, k } => fresnel::conductor(cos, eta, k),
            Reflectance::Normal(color) => fresnel::schlick(cos, color),
            Reflectance::Constant(color) => color,
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Conductor {
    pub(crate) reflectance: Reflectance,
    pub(crate) facets: Ggx,
}

impl Conductor {
    #[inline]
    pub(crate) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let Some(h) = (wo + wi).try_normalize() else { return (Vec3::ZERO, 0.0) };
        let value = self.facets.density(h) * self.facets.visibility(wo, wi) * wi.z;
        (self.reflectance.at(wo.dot(h).clamp(0.0, 1.0)) * value, self.facets.reflected_pdf(wo, h))
    }

    #[inline]
    pub(crate) fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        let h = self.facets.sample_visible(wo, u);
        let wi = reflect(wo, h);
        let cos = wo.dot(h);
        if wi.z <= 0.0 || cos <= 0.0 {
            return None;
        }
        Some(BsdfSample {
            wi,
            weight: self.reflectance.at(cos.min(1.0)) * self.facets.masking_ratio(wo, wi),
            pdf: self.facets.reflected_pdf(wo, h),
            delta: false,
            transmitted: false,
        })
    }
}

/// The mirror direction, with certainty.
pub(crate) fn sample_mirror(reflectance: &Reflectance, wo: Vec3) -> Option<BsdfSample> {
    Some(BsdfSample {
        wi: Vec3::new(-wo.x, -wo.y, wo.z),
        weight: reflectance.at(wo.z.min(1.0)),
        pdf: 1.0,
        delta: true,
        transmitted: false,
    })
}
