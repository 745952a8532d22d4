//! The variance of lobes, in radians² about their middle: what [`super::Covariance::reflect`] blurs by.

use std::f64::consts::PI;

/// The widest that a lobe's standard deviation is taken to be: a hemisphere holds no more.
const WIDEST: f64 = PI / 2.0;

/// cosᵉ has the variance 1/e about its axis (0.0907, 0.00990, 0.00100 for e = 10, 100, 1000).
#[must_use]
pub fn phong_lobe(exponent: f64) -> [f64; 3] {
    let variance = if exponent > 0.0 { (1.0 / exponent).min(WIDEST * WIDEST) } else { WIDEST * WIDEST };
    [variance, 0.0, variance]
}

/// Microfacets of roughness α (Beckmann's, or the middle part of GGX): slopes of variance α²/2 turn a reflected ray by twice
/// as much in the plane of incidence, and by cos θ of that across it: 2α² and 2α² cos² θ.
#[must_use]
pub fn microfacet_lobe(alpha: f64, cos: f64) -> [f64; 3] {
    let variance = (2.0 * alpha * alpha).min(WIDEST * WIDEST);
    [variance, 0.0, variance * cos * cos]
}

/// A lobe whose logarithm has the second derivatives [uu, uv, vv] at its middle: the inverse of |H|. Flat directions are as
/// wide as a hemisphere.
#[must_use]
pub fn lobe_from_log_hessian([uu, uv, vv]: [f64; 3]) -> [f64; 3] {
    let angle = 0.5 * (2.0 * uv).atan2(uu - vv);
    let (mean, half) = (0.5 * (uu + vv), (0.25 * (uu - vv) * (uu - vv) + uv * uv).sqrt());
    let inverse = |value: f64| (1.0 / value.abs()).min(WIDEST * WIDEST);
    let (a, b) = (inverse(mean + half), inverse(mean - half));
    let (sin, cos) = angle.sin_cos();
    [a * cos * cos + b * sin * sin, (a - b) * sin * cos, a * sin * sin + b * cos * cos]
}

/// Henyey and Greenstein's phase function at its peak: −(ln p)'' = 3 |g|/(1 − |g|)², so the variance is (1 − |g|)²/(3 |g|).
#[must_use]
pub fn henyey_greenstein_peak(g: f64) -> f64 {
    let g = g.abs().min(1.0);
    ((1.0 - g) * (1.0 - g) / (3.0 * g)).min(WIDEST * WIDEST)
}

/// The same by its second moment: ⟨θ²⟩/2 per axis with ⟨cos θ⟩ = g gives 1 − |g| for narrow lobes. Larger than at the peak,
/// as the tails are long.
#[must_use]
pub fn henyey_greenstein_moment(g: f64) -> f64 {
    (1.0 - g.abs().min(1.0)).min(WIDEST * WIDEST)
}
