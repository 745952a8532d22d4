//! Maps from the unit square to directions, and the small geometry that materials share.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

use glam::{Vec2, Vec3};

/// A point of the unit disk for one of the unit square, keeping areas and neighbourhoods: Shirley & Chiu 1997, "A low
/// distortion map between disk and square".
#[inline]
pub fn concentric_disk(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    if p.x == 0.0 && p.y == 0.0 {
        return Vec2::ZERO;
    }
    if p.x.abs() > p.y.abs() {
        let (sin, cos) = sin_cos_of_octant(FRAC_PI_4 * (p.y / p.x));
        p.x * Vec2::new(cos, sin)
    } else {
        let (sin, cos) = sin_cos_of_octant(FRAC_PI_4 * (p.x / p.y));
        p.y * Vec2::new(sin, cos)
    }
}

/// Sine and cosine of an angle of at most an eighth of a turn, to 1e-7: Taylor's polynomials of degrees 9 and 8. Drawing
/// a direction from a diffuse surface is half this.
fn sin_cos_of_octant(angle: f32) -> (f32, f32) {
    let s = angle * angle;
    let sin =
        angle * (1.0 + s * (-1.0 / 6.0 + s * (1.0 / 120.0 + s * (-1.0 / 5040.0 + s * (1.0 / 362_880.0)))));
    let cos = 1.0 + s * (-0.5 + s * (1.0 / 24.0 + s * (-1.0 / 720.0 + s * (1.0 / 40_320.0))));
    (sin, cos)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sine_and_cosine_of_an_octant_are_right_to_two_roundings() {
        for i in -10_000..=10_000 {
            let angle = i as f32 / 10_000.0 * FRAC_PI_4;
            let (sin, cos) = sin_cos_of_octant(angle);
            let exact = f64::from(angle).sin_cos();
            assert!((f64::from(sin) - exact.0).abs() < 1.5e-7, "{angle}");
            assert!((f64::from(cos) - exact.1).abs() < 1.5e-7, "{angle}");
        }
    }
}
