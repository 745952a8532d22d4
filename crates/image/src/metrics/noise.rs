//! Allowing for references that are themselves noisy.
//!
//! If picture and reference err independently, E[(x − r)²] = E[(x − t)²] + Var[r] for the truth t: the measured
//! relative MSE is too large by the reference's own, mean(Var[r] / (r² + 0.01)), which may be subtracted.

use rayon::prelude::*;

use super::{MetricError, RELATIVE_FLOOR};
use crate::{Plane, RgbImage};

/// The measured relative MSE less the known relative MSE of the noise of the reference (or of both pictures).
///
/// The result is an unbiased estimate and so may be a little below zero when there is nothing but noise.
pub fn without_noise(relative_mse: f64, noise: f64) -> f64 {
    relative_mse - noise
}

/// The relative MSE to expect from noise alone: mean(Var / (r² + 0.01)) over pixels and channels, where `variance`
/// is that of each pixel's mean (the same for the three channels). Pixels that are not finite are left out.
///
/// # Errors
/// If the sizes differ or no pixel is finite.
pub fn expected_noise(reference: &RgbImage, variance: &Plane) -> Result<f64, MetricError> {
    if (reference.width, reference.height) != (variance.width, variance.height) {
        let (image, reference) = ((variance.width, variance.height), (reference.width, reference.height));
        return Err(MetricError::Sizes { image, reference });
    }
    if reference.pixels.is_empty() {
        return Err(MetricError::Empty);
    }
    let rows: Vec<(f64, usize)> = reference
        .pixels
        .par_chunks(reference.width)
        .zip(variance.values.par_chunks(reference.width))
        .map(|(pixels, variances)| {
            let finite = pixels
                .iter()
                .zip(variances)
                .filter(|(r, v)| v.is_finite() && r.iter().all(|c| c.is_finite()));
            finite.fold((0.0, 0), |(sum, count), (r, &v)| {
                let weight = |c: f32| 1.0 / (f64::from(c).powi(2) + f64::from(RELATIVE_FLOOR));
                (sum + f64::from(v) * r.iter().map(|&c| weight(c)).sum::<f64>(), count + 3)
            })
        })
        .collect();
    let (sum, count) = rows.into_iter().fold((0.0, 0), |(s, n), (row, more)| (s + row, n + more));
    if count == 0 {
        let pixels = reference.pixels.len();
        return Err(MetricError::NothingFinite { pixels, image: 0, reference: pixels });
    }
    Ok(sum / count as f64)
}
