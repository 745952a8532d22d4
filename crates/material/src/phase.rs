//! Henyey and Greenstein's phase function, p(θ) = (1 − g²)/(4π (1 + g² − 2 g cos θ)^{3/2}), θ the angle that light is turned by.
//!
//! Source: Henyey & Greenstein 1941. Sampled exactly by inversion. Its integral over the sphere is 1, its mean cosine g.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use crate::bsdf::BsdfSample;
use crate::sampling::about;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Phase {
    g: f32,
}

impl Phase {
    pub(crate) fn new(g: f32) -> Self {
        /// A peak beyond this is narrower than f32 directions resolve.
        const MOST: f32 = 0.999;
        Self { g: if g.is_finite() { g.clamp(-MOST, MOST) } else { 0.0 } }
    }

    /// Light that came against `wi` leaves along `wo`: it is turned by the angle between −`wi` and `wo`.
    #[inline]
    pub(crate) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        // 1 + g² − 2 g cos θ without the loss of a difference: (1 − |g|)² + |g| · |wo ± wi|².
        let side = if self.g < 0.0 { wo - wi } else { wo + wi };
        let g = self.g.abs();
        let base = (1.0 - g) * (1.0 - g) + g * side.length_squared();
        let p = (1.0 - g * g) / (4.0 * PI * base * base.sqrt());
        (Vec3::splat(p), p)
    }

    #[inline]
    pub(crate) fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        let g = self.g;
        let cos = if g.abs() < 1e-3 {
            1.0 - 2.0 * u.x
        } else {
            let part = (1.0 - g * g) / (1.0 + g - 2.0 * g * u.x);
            ((1.0 + g * g - part * part) / (2.0 * g)).clamp(-1.0, 1.0)
        };
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (TAU * u.y).sin_cos();
        let wi = about(-wo, Vec3::new(sin * cos_phi, sin * sin_phi, cos)).normalize();
        BsdfSample::scattered(wi, self.eval_pdf(wo, wi))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_have_the_density_that_is_claimed_and_the_mean_cosine_g() {
        let wo = Vec3::new(0.3, -0.5, 0.8).normalize();
        for g in [-0.8, -0.3, 0.0, 0.2, 0.6, 0.95] {
            let phase = Phase::new(g);
            let n = 64;
            let (mut cosine, mut weight) = (0.0, 0.0);
            // Shares of equal steps of the cosine, against the integral of the density over each.
            let mut found = [0.0f32; 16];
            for i in 0..n * n {
                let u = Vec2::new(((i / n) as f32 + 0.5) / n as f32, ((i % n) as f32 + 0.5) / n as f32);
                let sample = phase.sample(wo, u).expect("a phase function has no side without light");
                let cos = -sample.wi.dot(wo);
                cosine += cos / (n * n) as f32;
                weight += sample.weight.x / (n * n) as f32;
                found[((cos * 0.5 + 0.5) * 15.999) as usize] += 1.0 / (n * n) as f32;
            }
            assert!((cosine - g).abs() < 0.01, "{g}: {cosine}");
            assert!((weight - 1.0).abs() < 1e-4);
            for (k, found) in found.into_iter().enumerate() {
                let steps = 256;
                let expected: f32 = (0..steps)
                    .map(|j| {
                        let cos = -1.0 + (k as f32 + (j as f32 + 0.5) / steps as f32) / 8.0;
                        let sin = (1.0 - cos * cos).sqrt();
                        let across = wo.any_orthonormal_vector();
                        phase.eval_pdf(wo, -wo * cos + across * sin).1 * TAU / (8 * steps) as f32
                    })
                    .sum();
                assert!((found - expected).abs() < 0.02, "{g} {k}: {found} {expected}");
            }
        }
    }
}
