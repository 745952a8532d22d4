//! glTF 2.0's metallic-roughness model: f = (1 − F(min(cos_o, cos_i))) c_diffuse / π + F(h) D G / (4 cos_o cos_i).
//!
//! Source: glTF 2.0 specification, appendix B.3.5: F₀ = lerp(((n−1)/(n+1))², base colour, metallic),
//! c_diffuse = (1 − metallic) · base colour, F Schlick's, D GGX with α = roughness², G Smith's (height-correlated).
//! α is kept at or above 0.001: the model has no delta lobe.
//!
//! One departure from the appendix (which is not normative): there the diffuse part is dimmed by F at the half
//! vector, and near grazing a white surface returns up to 1.15 times the light it gets. Here it is dimmed by F at
//! the flatter of the two directions: the same straight on, reciprocal, and never more than one.
//!
//! `transmission` moves that part of c_diffuse into a ray that goes straight through, as a thin wall does
//! (`KHR_materials_transmission` without roughness): its weight is base colour · (1 − F(cos_o)).
//!
//! Sampled as a mixture of visible normals, cosine and the straight ray, the shares by what each returns for the
//! view direction.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use crate::bsdf::BsdfSample;
use crate::fresnel::schlick;
use crate::microfacet::Ggx;
use crate::sampling::{cosine_hemisphere, cosine_pdf, luminance, reflect};

#[derive(Clone, Copy, Debug)]
pub(crate) struct MetallicRoughness {
    diffuse: Vec3,
    normal: Vec3,
    through: Vec3,
    facets: Ggx,
}

impl MetallicRoughness {
    pub(crate) fn new(base: Vec3, metallic: f32, alpha: f32, transmission: f32, ior: f32) -> Self {
        let unit = |x: f32| if x.is_finite() { x.clamp(0.0, 1.0) } else { 0.0 };
        let (metallic, transmission) = (unit(metallic), unit(transmission));
        let ratio = (ior - 1.0) / (ior + 1.0);
        let dielectric = unit(ratio * ratio);
        let body = base * (1.0 - metallic);
        Self {
            diffuse: body * (1.0 - transmission),
            through: body * transmission,
            normal: Vec3::splat(dielectric).lerp(base, metallic),
            facets: Ggx::new(alpha),
        }
    }

    /// The shares of samples: facets, diffuse; what is missing to one goes straight through.
    #[inline]
    fn shares(&self, wo: Vec3) -> (f32, f32) {
        // Never zero, so that a surface that returns nothing is still sampled somehow.
        let surface = luminance(schlick(wo.z.min(1.0), self.normal)).max(1e-4);
        let diffuse = (1.0 - surface) * luminance(self.diffuse);
        let through = (1.0 - surface) * luminance(self.through);
        let all = surface + diffuse + through;
        // A tenth at least for what exists, because facets turned away from the normal reflect otherwise than
        // F(cos_o) says; this bounds the weights.
        let share = |part: f32| if part > 0.0 { 0.1 + 0.7 * part / all } else { 0.0 };
        let (surface, diffuse, through) = (share(surface), share(diffuse), share(through));
        let all = surface + diffuse + through;
        (surface / all, diffuse / all)
    }

    #[inline]
    fn eval_pdf_with(&self, wo: Vec3, wi: Vec3, (surface, diffuse): (f32, f32)) -> (Vec3, f32) {
        let Some(h) = (wo + wi).try_normalize() else { return (Vec3::ZERO, 0.0) };
        let fresnel = schlick(wo.dot(h), self.normal);
        let lobe = self.facets.density(h) * self.facets.visibility(wo, wi);
        let entering = Vec3::ONE - schlick(wo.z.min(wi.z), self.normal);
        let value = (entering * self.diffuse * FRAC_1_PI + fresnel * lobe) * wi.z;
        (value, surface * self.facets.reflected_pdf(wo, h) + diffuse * cosine_pdf(wi.z))
    }

    #[inline]
    pub(crate) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        self.eval_pdf_with(wo, wi, self.shares(wo))
    }

    #[inline]
    pub(crate) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let shares = self.shares(wo);
        let wi = if u_lobe < shares.0 {
            reflect(wo, self.facets.sample_visible(wo, u))
        } else if u_lobe < shares.0 + shares.1 || self.through == Vec3::ZERO {
            cosine_hemisphere(u)
        } else {
            let pdf = 1.0 - shares.0 - shares.1;
            let weight = self.through * (Vec3::ONE - schlick(wo.z.min(1.0), self.normal)) / pdf;
            return Some(BsdfSample { wi: -wo, weight, pdf, delta: true, transmitted: true });
        };
        if wi.z <= 0.0 {
            return None;
        }
        BsdfSample::scattered(wi, self.eval_pdf_with(wo, wi, shares))
    }

    pub(crate) fn albedo(&self) -> Vec3 {
        (self.diffuse + self.through + self.normal).min(Vec3::ONE)
    }

    /// Albedo of the diffuse part, reflectance straight on, and the facets.
    pub(crate) fn parts(&self) -> (Vec3, Vec3, &Ggx) {
        (self.diffuse, self.normal, &self.facets)
    }

    pub(crate) fn transmits(&self) -> bool {
        self.through != Vec3::ZERO
    }
}
