//! How noisy a pixel will be, and how many samples it needs.
//!
//! The integrand about a pixel is χ cos θ with χ = L ρ; for directions uniform on the hemisphere
//!
//! ```text
//! V = (4π²/N) (E[λ²] − E[λ]²) ≤ (4π²/N) E[χ²]           E over the uniform hemisphere          ([001] §2.4, exact)
//! E[χ²] ≈ (1/n) Σ χ_i²/(2π p_i)                          from n directions of density p
//! ```
//!
//! `[001]` eq. (8)–(10) multiply `E[χ²]`, which is already a second moment, by a bandwidth: a unit too many, and not
//! conservative below one cycle per radian. Here the factor is max(1, ν_light + ν_lobe), as a safety that grows with what the
//! sixteen directions may have missed; eq. (9) also sums where it has to average. With lobe-distributed directions sixteen
//! suffice; with uniform ones they miss lobes of exponent 200 half of the time.

use std::f32::consts::PI;

/// `E[χ²]` over the uniform hemisphere, from directions of density `pdf` (per steradian). Samples without density count zero.
#[inline]
#[must_use]
pub fn second_moment(chi: &[f32], pdf: &[f32]) -> f32 {
    second_moment_widened(chi, pdf, |_| 1.0)
}

/// The same with the factor max(1, ν_light + ν_lobe) of every direction. `[001]` eq. (9), corrected.
#[inline]
#[must_use]
pub fn second_moment_plain(chi: &[f32], pdf: &[f32], light: &[f32], lobe: &[f32]) -> f32 {
    second_moment_widened(chi, pdf, |i| (light[i] + lobe[i]).max(1.0))
}

/// The same for light that was convolved with the lobe: it has the lobe's bandwidth, max(1, 2 ν_lobe). `[001]` eq. (10),
/// corrected. `chi` has the convolved light in it.
#[inline]
#[must_use]
pub fn second_moment_preconvolved(chi: &[f32], pdf: &[f32], lobe: &[f32]) -> f32 {
    second_moment_widened(chi, pdf, |i| (2.0 * lobe[i]).max(1.0))
}

#[inline(always)]
fn second_moment_widened(chi: &[f32], pdf: &[f32], factor: impl Fn(usize) -> f32) -> f32 {
    let mut sum = 0.0;
    for i in 0..chi.len().min(pdf.len()) {
        let density = 2.0 * PI * pdf[i];
        sum += if density > 0.0 { factor(i) * chi[i] * chi[i] / density } else { 0.0 };
    }
    // A sum beyond the largest float, or NaN, is as noisy as can be.
    (sum / chi.len().max(1) as f32).min(f32::MAX)
}

/// The variance of one sample drawn from the very density that `lambda` = L ρ cos θ is divided by: what importance sampling
/// has, as far as the given directions tell. Smaller than the uniform bound by orders of magnitude for sharp lobes.
#[inline]
#[must_use]
pub fn importance_variance(lambda: &[f32], pdf: &[f32]) -> f32 {
    let n = lambda.len().min(pdf.len());
    let (mut sum, mut square) = (0.0f32, 0.0f32);
    for i in 0..n {
        let weight = if pdf[i] > 0.0 { lambda[i] / pdf[i] } else { 0.0 };
        sum += weight;
        square += weight * weight;
    }
    if n < 2 {
        return square.min(f32::MAX);
    }
    let n = n as f32;
    // Bessel's n − 1, as the mean comes from the same directions.
    let variance = (square - sum * sum / n) / (n - 1.0);
    // Rounding may leave less than nothing; infinity and NaN are as noisy as can be.
    if variance < 0.0 { 0.0 } else { variance.min(f32::MAX) }
}

/// The variance of one uniform sample by its bound, `4π² E[χ²]`.
#[inline]
#[must_use]
pub fn uniform_bound(second_moment: f32) -> f32 {
    (4.0 * PI * PI * second_moment).min(f32::MAX)
}

/// N_p: samples after which the standard error is `target` times `mean`, for a `variance` of one sample, within
/// `least..=most`. A mean of zero (black) needs the least; a variance that is not a number the most.
#[inline]
#[must_use]
pub fn sample_count(variance: f32, mean: f32, target: f32, least: u32, most: u32) -> u32 {
    let error = target * mean;
    let visible = error * error > 0.0;
    if !visible || variance == 0.0 {
        return least;
    }
    let count = (variance / (error * error)).ceil();
    // Converting saturates; NaN would become 0.
    if count.is_nan() { most } else { (count as u32).min(most).max(least) }
}
