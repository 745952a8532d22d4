//! Glass and water: reflection and refraction at a smooth or a GGX border.
//!
//! Source: Walter et al. 2007, "Microfacet models for refraction through rough surfaces", eqs. 20 and 21 (values),
//! 14 and 17 (densities), with visible normals. Everything is seen from the viewer's side of the border: η is the
//! index of the far side over that of the viewer's.
//!
//! **Radiance is scaled**: light that crosses the border carries 1/η² (n of the viewer's side over n of the
//! light's, squared), because radiance over n² is what a border conserves. A path into glass and out again gets
//! both factors and they cancel. In a uniform furnace of radiance ∝ n² a clear border gives back exactly one.
//!
//! A share R of the samples is reflected, the rest is refracted.

use glam::{Vec2, Vec3};

use crate::bsdf::BsdfSample;
use crate::fresnel;
use crate::microfacet::Ggx;
use crate::sampling::reflect;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Dielectric {
    pub(crate) ior: f32,
    /// Multiplies what goes through.
    pub(crate) tint: Vec3,
    /// `None` for a smooth border.
    pub(crate) facets: Option<Ggx>,
}

impl Dielectric {
    pub(crate) fn new(ior: f32, tint: Vec3, alpha: f32) -> Self {
        let ior = if ior.is_finite() && ior > 0.0 { ior.clamp(0.01, 100.0) } else { 1.0 };
        // Between equal media a border does nothing, however rough; the half vector is not defined either.
        let smooth = alpha < crate::microfacet::SMOOTH_ALPHA || (ior - 1.0).abs() < 1e-3;
        Self { ior, tint, facets: (!smooth).then(|| Ggx::new(alpha)) }
    }

    /// The far index over the near one, for a viewer outside or inside.
    #[inline]
    fn relative(&self, outside: bool) -> f32 {
        if outside { self.ior } else { 1.0 / self.ior }
    }

    /// The probability to sample the reflection, where a facet reflects `reflectance`.
    #[inline]
    fn share(&self, reflectance: f32) -> f32 {
        let through = (1.0 - reflectance) * self.tint.max_element();
        if reflectance + through > 0.0 { reflectance / (reflectance + through) } else { 1.0 }
    }

    /// `wo.z` > 0 after turning both directions; `outside` tells which side that was.
    #[inline]
    pub(crate) fn eval_pdf(&self, wo: Vec3, wi: Vec3, outside: bool) -> (Vec3, f32) {
        let Some(facets) = &self.facets else { return (Vec3::ZERO, 0.0) };
        let eta = self.relative(outside);
        let reflected = wi.z > 0.0;
        let Some(mut h) = (if reflected { wo + wi } else { wo + eta * wi }).try_normalize() else {
            return (Vec3::ZERO, 0.0);
        };
        if h.z < 0.0 {
            h = -h;
        }
        let (o_h, i_h) = (wo.dot(h), wi.dot(h));
        // A facet seen from its back, or light on the wrong side of it.
        if o_h <= 0.0 || (i_h > 0.0) != reflected || wi.z == 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let (reflectance, _) = fresnel::dielectric(o_h.min(1.0), eta);
        let share = self.share(reflectance);
        let distribution = facets.density(h) * facets.visibility(wo, wi) * wi.z.abs();
        if reflected {
            (Vec3::splat(reflectance * distribution), share * facets.reflected_pdf(wo, h))
        } else {
            let denominator = i_h + o_h / eta;
            let jacobian = i_h.abs() / (denominator * denominator);
            let value = (1.0 - reflectance) * distribution * 4.0 * o_h * jacobian / (eta * eta);
            (self.tint * value, (1.0 - share) * facets.visible_pdf(wo, h) * jacobian)
        }
    }

    #[inline]
    pub(crate) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2, outside: bool) -> Option<BsdfSample> {
        let eta = self.relative(outside);
        let h = self.facets.map_or(Vec3::Z, |facets| facets.sample_visible(wo, u));
        let o_h = wo.dot(h).min(1.0);
        if o_h <= 0.0 {
            return None;
        }
        let (reflectance, cos_t) = fresnel::dielectric(o_h, eta);
        let share = self.share(reflectance);
        let reflected = u_lobe < share;
        let wi =
            if reflected { reflect(wo, h) } else { ((o_h / eta - cos_t) * h - wo / eta).normalize_or(-wo) };
        if (wi.z > 0.0) != reflected || wi.z == 0.0 {
            return None;
        }
        let weight = if reflected {
            Vec3::splat(reflectance / share)
        } else {
            self.tint * ((1.0 - reflectance) / ((1.0 - share) * eta * eta))
        };
        let Some(facets) = &self.facets else {
            let pdf = if reflected { share } else { 1.0 - share };
            return Some(BsdfSample { wi, weight, pdf, delta: true, transmitted: !reflected });
        };
        let pdf = if reflected {
            share * facets.reflected_pdf(wo, h)
        } else {
            let i_h = wi.dot(h);
            let denominator = i_h + o_h / eta;
            (1.0 - share) * facets.visible_pdf(wo, h) * i_h.abs() / (denominator * denominator)
        };
        let weight = weight * facets.masking_ratio(wo, wi);
        Some(BsdfSample { wi, weight, pdf, delta: false, transmitted: !reflected })
    }
}
