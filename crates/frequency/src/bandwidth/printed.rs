//! What `[001]` prints, where that is wrong: for the tests in `tests/errata.rs` that show the difference, and nothing else.

use super::operators::{Bandwidth, GRAZING};
use super::{Exit, bounded};

/// S = diag(1, −1), Fig. 4: the mirror re-parametrization that makes the travels of a local light subtract.
#[must_use]
pub fn mirror(nu: Bandwidth) -> Bandwidth {
    Bandwidth { angular: -nu.angular, ..nu }
}

/// B_{t,ρ} of Fig. 4: clips the angular component only, [ν_s + t, min(ρ, ν_a)].
#[must_use]
pub fn reflect(nu: Bandwidth, texture: f32, lobe: f32) -> Bandwidth {
    Bandwidth::new(nu.spatial + texture, lobe.min(nu.angular.abs()).copysign(nu.angular))
}

/// Eq. (3)–(4) for a light at `distance`: T_d' P_x C_-c S B C_c P_i T_d ν, with [`mirror`] and [`reflect`].
#[must_use]
pub fn one_bounce(light: Bandwidth, distance: f32, cos_incidence: f32, lobe: f32, exit: &Exit) -> Bandwidth {
    let arrived = light.travel(distance).incidence(cos_incidence).curvature(exit.curvature);
    mirror(reflect(arrived, exit.texture, lobe))
        .curvature(-exit.curvature)
        .exit(exit.cos_exit)
        .travel(exit.distance)
        .magnitude()
}

/// Eq. (5) on signed vectors: paths of opposite sign cancel.
#[must_use]
pub fn average(nu: &[Bandwidth], weight: &[f32]) -> Bandwidth {
    let sum = nu.iter().zip(weight).fold(Bandwidth::default(), |sum, (&nu, &w)| sum + nu * w);
    sum * (1.0 / weight.iter().sum::<f32>())
}

/// Eq. (6) with f/W for the pixel's angle.
#[must_use]
pub fn pixel_bandwidth(angular: f32, field_of_view: f32, pixels: f32) -> f32 {
    bounded(angular * field_of_view / pixels)
}

/// Eq. (11) without Nyquist's 2: ⌊log₂(1/b_p)⌋.
#[must_use]
pub fn level(pixel_bandwidth: f32) -> i32 {
    (1.0 / pixel_bandwidth).log2().floor() as i32
}

/// The sum of eq. (9), which grows with the number of directions.
#[must_use]
pub fn variance_sum(chi: &[f32], light: &[f32], lobe: &[f32]) -> f32 {
    (0..chi.len()).map(|i| (light[i] + lobe[i]) * chi[i] * chi[i]).sum()
}

/// The largest and smallest screen-space bandwidth of §3.2, in the order in which they are named there as (min, max):
/// (b_p/cos θ_x, b_p).
#[must_use]
pub fn anisotropy(pixel_bandwidth: f32, cos_exit: f32) -> (f32, f32) {
    (pixel_bandwidth / cos_exit.max(GRAZING), pixel_bandwidth)
}

/// Gauss's curvature, which §2.1 names: the product of the principal ones, in 1/m², zero on a cylinder.
#[must_use]
pub fn curvature(principal: [f32; 2]) -> f32 {
    principal[0] * principal[1]
}
