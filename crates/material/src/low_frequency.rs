//! What is left of a surface's scattering at low angular frequencies: a diffuse part and one Phong lobe.
//!
//! Techniques that hold light in a few bands of spherical harmonics cannot see more of it. Diffuse and Phong surfaces are
//! exact; a microfacet lobe of width α becomes the Phong lobe about the mirror direction of the same
//! spread near its peak, n = (2/α² − 2)/4 (the quarter turns half-vector angles into angles of reflection); measured
//! materials give their albedo straight on as a diffuse one. Mixes are the sum of their parts, with one lobe for two.

use glam::Vec3;

use crate::bsdf::{Bsdf, Lobe};
use crate::sampling::luminance;

/// f cos θ ≈ (diffuse/π + specular · (n + 2)/2π · cosⁿ α) cos θ, α the angle from the mirror direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowFrequency {
    /// Albedo of the diffuse part.
    pub diffuse: Vec3,
    /// What the lobe reflects straight on.
    pub specular: Vec3,
    /// n, at most [`LowFrequency::MAX_EXPONENT`].
    pub exponent: f32,
    /// Whether this is the surface itself and not an approximation.
    pub exact: bool,
}

impl LowFrequency {
    /// Narrower lobes than this are all the same to eight bands.
    pub const MAX_EXPONENT: f32 = 1024.0;

    fn lobe(specular: Vec3, alpha: f32) -> Self {
        let exponent = (0.5 / (alpha * alpha).max(1e-6) - 0.5).clamp(1.0, Self::MAX_EXPONENT);
        Self { diffuse: Vec3::ZERO, specular, exponent, exact: false }
    }

    /// The sum of two surfaces by their shares. Two lobes become one: of the mean of the logarithms of their exponents,
    /// each counted by what it reflects.
    fn mixed(a: &Self, first: f32, b: &Self, second: f32) -> Self {
        let (one, other) = (first * a.specular, second * b.specular);
        let [weight, opposite] = [luminance(one).max(0.0), luminance(other).max(0.0)];
        let exponent = if opposite == 0.0 {
            a.exponent
        } else if weight == 0.0 {
            b.exponent
        } else {
            let log = |exponent: f32| exponent.max(0.0).ln_1p();
            let mean = (weight * log(a.exponent) + opposite * log(b.exponent)) / (weight + opposite);
            mean.exp_m1().clamp(0.0, Self::MAX_EXPONENT)
        };
        let is_one_lobe = weight == 0.0 || opposite == 0.0 || a.exponent == b.exponent;
        Self {
            diffuse: first * a.diffuse + second * b.diffuse,
            specular: one + other,
            exponent,
            exact: a.exact && b.exact && is_one_lobe,
        }
    }
}

impl Bsdf<'_> {
    /// The low frequencies of this surface.
    pub fn low_frequency(&self) -> LowFrequency {
        let diffuse =
            |diffuse: Vec3, exact| LowFrequency { diffuse, specular: Vec3::ZERO, exponent: 1.0, exact };
        match &self.lobe {
            Lobe::Black => diffuse(Vec3::ZERO, true),
            Lobe::Diffuse(surface) => diffuse(surface.albedo, true),
            Lobe::Phong(phong) => LowFrequency {
                diffuse: phong.diffuse,
                specular: phong.specular,
                exponent: phong.exponent.clamp(0.0, LowFrequency::MAX_EXPONENT),
                exact: phong.exponent <= LowFrequency::MAX_EXPONENT,
            },
            Lobe::Mirror(_) => LowFrequency::lobe(self.albedo(), 0.0),
            Lobe::Conductor(metal) => LowFrequency::lobe(self.albedo(), metal.facets.mean_alpha()),
            Lobe::MetallicRoughness(model) => {
                let (diffuse, specular, facets) = model.parts();
                LowFrequency { diffuse, ..LowFrequency::lobe(specular, facets.mean_alpha()) }
            }
            // What goes through comes from places that these techniques do not look at.
            Lobe::Dielectric(_) => LowFrequency::lobe(Vec3::splat(0.04), 0.0),
            Lobe::Phase(_) => diffuse(Vec3::ONE, true),
            Lobe::Measured(_) => diffuse(self.albedo(), false),
            Lobe::Mix(mix) => {
                let [(first, a), (second, b)] = mix.parts(true);
                LowFrequency::mixed(&a.low_frequency(), first, &b.low_frequency(), second)
            }
        }
    }
}
