//! Maps from the unit square to directions, and the small geometry that materials share.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

use glam::{Vec2, Vec3};

/// The unit disk, keeping areas and neighbourhoods: Shirley & Chiu 1997, "A low distortion map between disk and
/// square".
pub(crate) fn concentric_disk(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    if p.x == 0.0 && p.y == 0.0 {
        return Vec2::ZERO;
    }
    let (radius, angle) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, 2.0 * FRAC_PI_4 - FRAC_PI_4 * (p.x / p.y))
    };
    let (sin, cos) = angle.sin_cos();
    radius * Vec2::new(cos, sin)
}

/// A direction with density cos θ / π about +z. Never exactly on the horizon.
pub(crate) fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = concentric_disk(u);
    let z = (1.0 - d.length_squared()).max(1e-12).sqrt();
    d.extend(z)
}

/// The density of [`cosine_hemisphere`] above the horizon.
pub(crate) fn cosine_pdf(cos_theta: f32) -> f32 {
    cos_theta * FRAC_1_PI
}

/// `local`, given about +z, turned to stand about `axis` (unit). Duff et al. 2017, "Building an orthonormal basis,
/// revisited".
pub(crate) fn about(axis: Vec3, local: Vec3) -> Vec3 {
    let (tangent, bitangent) = axis.any_orthonormal_pair();
    tangent * local.x + bitangent * local.y + axis * local.z
}

/// The direction at cosine `z` from +z and turned by `phi`.
pub(crate) fn spherical(z: f32, phi: f32) -> Vec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = phi.sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// A direction with density ∝ cosⁿ about +z; the density is `(n + 1)/2π · cosⁿ`. Exact for large n, where the sine
/// taken from the cosine would not be.
pub(crate) fn power_cosine(exponent: f32, u: Vec2) -> Vec3 {
    let log_cos = (-u.x).ln_1p() / (exponent + 1.0);
    let r = (-(2.0 * log_cos).exp_m1()).max(0.0).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Vec3::new(r * cos, r * sin, log_cos.exp())
}

/// `wo` mirrored in the half vector `h`.
pub(crate) fn reflect(wo: Vec3, h: Vec3) -> Vec3 {
    2.0 * wo.dot(h) * h - wo
}

/// Rec. 709 luminance.
pub(crate) fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}
