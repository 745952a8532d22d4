//! The GGX (Trowbridge–Reitz) distribution of microfacet normals.
//!
//! D(h) = 1 / (π αx αy (hx²/αx² + hy²/αy² + hz²)²), with Smith's shadowing, height-correlated. With
//! s(v) = √(αx² vx² + αy² vy² + vz²) everything below is free of trigonometry and of quotients that fail at grazing:
//!
//! - G₂ / (4 cos_o cos_i) = ½ / (cos_i s(o) + cos_o s(i))
//! - density of visible normals: 2 D(h) (o·h) / (cos_o + s(o)), after reflection D(h) / (2 (cos_o + s(o)))
//! - G₂ / G₁(o) = cos_i (cos_o + s(o)) / (cos_i s(o) + cos_o s(i)), the weight of a sampled normal
//!
//! Sources: Walter et al. 2007 (the model), Heitz 2014 (shadowing), Dupuy & Benyoub 2023, "Sampling visible GGX
//! normals with spherical caps" (the sampler). Roughness is perceptual: α = roughness², as Burley 2012 and glTF.
//! Light that would bounce between facets is lost: a rough white metal returns less than it gets (tests state it).

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3, Vec3Swizzles};

use crate::sampling::spherical;

/// Below this α a surface counts as smooth and is sampled as a delta function: the lobe is then narrower (0.06°)
/// than a pixel of a 4096-pixel environment map (0.09°), and f32 half vectors still resolve everything above it.
pub(crate) const SMOOTH_ALPHA: f32 = 1e-3;

/// α from a roughness of any value, kept in [0, 1].
pub(crate) fn alpha(roughness: f32) -> f32 {
    let roughness = if roughness.is_finite() { roughness.clamp(0.0, 1.0) } else { 1.0 };
    roughness * roughness
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Ggx {
    alpha: Vec2,
}

impl Ggx {
    pub(crate) fn new(alpha: f32) -> Self {
        Self { alpha: Vec2::splat(alpha.max(SMOOTH_ALPHA)) }
    }

    /// The mean width of the two directions.
    pub(crate) fn mean_alpha(&self) -> f32 {
        (self.alpha.x * self.alpha.y).sqrt()
    }

    /// Stretched by `anisotropy` in [−1, 1], Burley 2012 §5.4.
    pub(crate) fn anisotropic(alpha: f32, anisotropy: f32) -> Self {
        let anisotropy = if anisotropy.is_finite() { anisotropy.clamp(-1.0, 1.0) } else { 0.0 };
        let aspect = (1.0 - 0.9 * anisotropy.abs()).sqrt();
        let (long, short) = ((alpha / aspect).min(1.0), alpha * aspect);
        let alpha = if anisotropy >= 0.0 { Vec2::new(long, short) } else { Vec2::new(short, long) };
        Self { alpha: alpha.max(Vec2::splat(SMOOTH_ALPHA)) }
    }

    /// D(h): how many facets have the normal `h`, per solid angle and per area of the flat surface.
    #[inline]
    pub(crate) fn density(&self, h: Vec3) -> f32 {
        let p = h.xy() / self.alpha;
        let q = p.length_squared() + h.z * h.z;
        FRAC_1_PI / (self.alpha.x * self.alpha.y * q * q)
    }

    #[inline]
    fn stretch(&self, v: Vec3) -> f32 {
        ((self.alpha * v.xy()).length_squared() + v.z * v.z).sqrt()
    }

    /// G₂ / (4 |cos_o| |cos_i|).
    #[inline]
    pub(crate) fn visibility(&self, wo: Vec3, wi: Vec3) -> f32 {
        0.5 / (wi.z.abs() * self.stretch(wo) + wo.z.abs() * self.stretch(wi))
    }

    /// G₂ / G₁(wo).
    #[inline]
    pub(crate) fn masking_ratio(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (cos_o, cos_i, s) = (wo.z.abs(), wi.z.abs(), self.stretch(wo));
        cos_i * (cos_o + s) / (cos_i * s + cos_o * self.stretch(wi))
    }

    /// The density of `wi` = `wo` mirrored in a visible normal `h`.
    #[inline]
    pub(crate) fn reflected_pdf(&self, wo: Vec3, h: Vec3) -> f32 {
        self.density(h) / (2.0 * (wo.z + self.stretch(wo)))
    }

    /// The density of visible normals.
    #[inline]
    pub(crate) fn visible_pdf(&self, wo: Vec3, h: Vec3) -> f32 {
        2.0 * self.density(h) * wo.dot(h).max(0.0) / (wo.z + self.stretch(wo))
    }

    /// A normal visible from `wo` (`wo.z` > 0).
    #[inline]
    pub(crate) fn sample_visible(&self, wo: Vec3, u: Vec2) -> Vec3 {
        let stretched = (self.alpha * wo.xy()).extend(wo.z).normalize_or(Vec3::Z);
        let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
        let h = spherical(z, TAU * u.x) + stretched;
        (self.alpha * h.xy()).extend(h.z.max(0.0)).normalize_or(Vec3::Z)
    }
}
