//! Errors kept apart pixel by pixel, for pictures of where they are.

use rayon::prelude::*;

use super::{MetricError, RELATIVE_FLOOR, check_sizes};
use crate::{Plane, RgbImage};

/// mean over channels of (x − r)² / (r² + 0.01), per pixel; its mean over the pixels is the relative MSE.
///
/// # Errors
/// If the sizes differ.
pub fn relative_squared_error(image: &RgbImage, reference: &RgbImage) -> Result<Plane, MetricError> {
    per_pixel(image, reference, |x, r| {
        (0..3).map(|c| (x[c] - r[c]).powi(2) / (r[c] * r[c] + RELATIVE_FLOOR)).sum::<f32>() / 3.0
    })
}

/// mean over channels of (x − r) / √(r² + 0.01), per pixel: positive where the picture is too bright.
///
/// The divisor is that of the relative squared error, so shadows and lights weigh alike and a mean far from
/// zero over a region tells of bias where squares cannot tell it from noise.
///
/// # Errors
/// If the sizes differ.
pub fn signed_difference(image: &RgbImage, reference: &RgbImage) -> Result<Plane, MetricError> {
    per_pixel(image, reference, |x, r| {
        (0..3).map(|c| (x[c] - r[c]) / (r[c] * r[c] + RELATIVE_FLOOR).sqrt()).sum::<f32>() / 3.0
    })
}

/// Whether a pixel can be compared at all.
pub(crate) fn finite_in_both(x: &[f32; 3], r: &[f32; 3]) -> bool {
    x.iter().chain(r).all(|v| v.is_finite())
}

/// `value` of every pair of finite pixels, zero elsewhere, kept within what `f32` holds.
fn per_pixel(
    image: &RgbImage,
    reference: &RgbImage,
    value: impl Fn(&[f32; 3], &[f32; 3]) -> f32 + Sync,
) -> Result<Plane, MetricError> {
    check_sizes(image, reference)?;
    let values = image
        .pixels
        .par_iter()
        .zip(&reference.pixels)
        .map(|(x, r)| {
            let value = if finite_in_both(x, r) { value(x, r) } else { 0.0 };
            // Squares of values beyond 1e19 overflow: to infinity, or to infinity over infinity.
            if value.is_nan() { f32::MAX } else { value.clamp(f32::MIN, f32::MAX) }
        })
        .collect();
    Ok(Plane { width: image.width, height: image.height, values })
}
