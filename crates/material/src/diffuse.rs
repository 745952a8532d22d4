//! Lambert's surface: f = albedo / π.
//!
//! Sampled in proportion to the cosine, so that every weight is the albedo: the only noise left is the light's.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use crate::bsdf::BsdfSample;
use crate::sampling::{cosine_hemisphere, cosine_pdf};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Diffuse {
    pub(crate) albedo: Vec3,
}

impl Diffuse {
    pub(crate) fn eval(&self, wi: Vec3) -> Vec3 {
        self.albedo * (FRAC_1_PI * wi.z)
    }

    pub(crate) fn eval_pdf(&self, wi: Vec3) -> (Vec3, f32) {
        (self.eval(wi), cosine_pdf(wi.z))
    }

    pub(crate) fn sample(&self, u: Vec2) -> Option<BsdfSample> {
        let wi = cosine_hemisphere(u);
        Some(BsdfSample { wi, weight: self.albedo, pdf: cosine_pdf(wi.z), delta: false, transmitted: false })
    }
}
