//! Phong's lobe in the reciprocal form: f = k_d / π + k_s (n + 2) / 2π · cosⁿ α, α the angle between `wi` and the
//! mirror direction of `wo`.
//!
//! Source: Lafortune & Willems 1994, "Using the modified Phong reflectance model for physically based rendering".
//! (n + 2)/2π makes the lobe return exactly k_s straight on, and less at every other angle, so that k_d + k_s ≤ 1
//! keeps energy; where a scene asks for more, both are scaled down together. The powers are taken as
//! exp(n·ln(1 − d²/2)) with d the distance of the two directions: exact for exponents in the ten thousands, where
//! a power of an f32 cosine is not.
//!
//! Sampled as a mixture of cosine and cosⁿ, the shares as the luminances of k_d and k_s.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use crate::bsdf::BsdfSample;
use crate::sampling::{about, cosine_hemisphere, cosine_pdf, luminance, power_cosine};

/// Above this the lobe is narrower than f32 directions resolve well.
const MAX_EXPONENT: f32 = 1e5;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Phong {
    pub(crate) diffuse: Vec3,
    pub(crate) specular: Vec3,
    pub(crate) exponent: f32,
    /// The share of samples that go to the lobe.
    share: f32,
}

impl Phong {
    pub(crate) fn new(diffuse: Vec3, specular: Vec3, exponent: f32) -> Self {
        let scale = 1.0 / (diffuse + specular).max_element().max(1.0);
        let (diffuse, specular) = (diffuse * scale, specular * scale);
        let exponent = if exponent.is_finite() { exponent.clamp(0.0, MAX_EXPONENT) } else { 1.0 };
        let (d, s) = (luminance(diffuse), luminance(specular));
        let share = if d + s > 0.0 { s / (d + s) } else { 0.0 };
        Self { diffuse, specular, exponent, share }
    }

    #[inline]
    pub(crate) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let mirrored = Vec3::new(-wo.x, -wo.y, wo.z);
        let below = 0.5 * mirrored.distance_squared(wi);
        let power = if below < 1.0 { (self.exponent * (-below).ln_1p()).exp() } else { 0.0 };
        let lobe = power / TAU;
        let value = (self.diffuse * FRAC_1_PI + self.specular * (lobe * (self.exponent + 2.0))) * wi.z;
        (value, (1.0 - self.share) * cosine_pdf(wi.z) + self.share * lobe * (self.exponent + 1.0))
    }

    #[inline]
    pub(crate) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let wi = if u_lobe < self.share {
            about(Vec3::new(-wo.x, -wo.y, wo.z), power_cosine(self.exponent, u))
        } else {
            cosine_hemisphere(u)
        };
        if wi.z <= 0.0 {
            return None;
        }
        BsdfSample::scattered(wi, self.eval_pdf(wo, wi))
    }
}
