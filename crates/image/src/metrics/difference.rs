//! The figures that are one number per pair of pictures, all from one pass over the pixels.
//!
//! With x the picture, r the reference, averages over pixels and channels:
//!
//! ```text
//! relMSE = mean( (x − r)² / (r² + 0.01) )        MSE = mean( (x − r)² )
//! PSNR   = −10 log₁₀ mean( (s(x) − s(r))² )       s(v) = sRGB( clamp(v · 2^EV, 0, 1) )
//! ```

use rayon::prelude::*;

use super::{MetricError, RELATIVE_FLOOR, check_sizes};
use crate::{RgbImage, srgb_encode};

/// All that can be said of a pair of pictures in single numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// mean((x − r)² / (r² + 0.01)) over pixels and channels.
    pub relative_mse: f64,
    /// mean((x − r)²) over pixels and channels.
    pub mse: f64,
    /// Peak signal-to-noise ratio in decibels of the pictures as shown: exposed, clamped to [0, 1] and encoded as
    /// sRGB. Infinite if they look the same.
    pub psnr_db: f64,
    /// The largest |x − r| of any channel.
    pub max_error: f64,
    /// Column and row of the pixel of the largest error (the first in reading order).
    pub max_error_at: (usize, usize),
    /// Mean of the picture, per channel.
    pub mean: [f64; 3],
    /// Mean of the reference over the same pixels, per channel.
    pub reference_mean: [f64; 3],
    /// Pixels that were left out.
    pub non_finite: NonFinite,
}

/// How many pixels hold a NaN or an infinity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct NonFinite {
    /// Of the picture under test.
    pub image: usize,
    /// Of the reference.
    pub reference: usize,
    /// Left out: those of either.
    pub left_out: usize,
}

/// What one row adds.
#[derive(Clone, Copy, Default)]
struct Sums {
    relative: f64,
    squared: f64,
    shown: f64,
    image: [f64; 3],
    reference: [f64; 3],
    max: f64,
    max_at: (usize, usize),
    non_finite: NonFinite,
}

impl Difference {
    /// Measures `image` against `reference`; only [`psnr_db`](Self::psnr_db) depends on the exposure (in stops).
    ///
    /// # Errors
    /// If the sizes differ or no pixel is finite in both.
    pub fn measure(image: &RgbImage, reference: &RgbImage, exposure_ev: f32) -> Result<Self, MetricError> {
        check_sizes(image, reference)?;
        let rows: Vec<Sums> = (0..image.height)
            .into_par_iter()
            .map(|y| sum_row(image, reference, y, exposure_ev.exp2()))
            .collect();
        let total = rows.into_iter().fold(Sums::default(), Sums::add);
        let pixels = image.pixels.len() - total.non_finite.left_out;
        if pixels == 0 {
            let NonFinite { image: of_image, reference, .. } = total.non_finite;
            return Err(MetricError::NothingFinite {
                pixels: image.pixels.len(),
                image: of_image,
                reference,
            });
        }
        let (per_pixel, per_value) = (1.0 / pixels as f64, 1.0 / (3 * pixels) as f64);
        Ok(Self {
            relative_mse: total.relative * per_value,
            mse: total.squared * per_value,
            psnr_db: -10.0 * (total.shown * per_value).log10(),
            max_error: total.max,
            max_error_at: total.max_at,
            mean: total.image.map(|sum| sum * per_pixel),
            reference_mean: total.reference.map(|sum| sum * per_pixel),
            non_finite: total.non_finite,
        })
    }
}

fn sum_row(image: &RgbImage, reference: &RgbImage, y: usize, exposure: f32) -> Sums {
    let mut sums = Sums::default();
    let row = y * image.width..(y + 1) * image.width;
    for (column, (x, r)) in image.pixels[row.clone()].iter().zip(&reference.pixels[row]).enumerate() {
        let [bad_x, bad_r] = [x, r].map(|pixel| pixel.iter().any(|v| !v.is_finite()));
        if bad_x || bad_r {
            sums.non_finite.image += usize::from(bad_x);
            sums.non_finite.reference += usize::from(bad_r);
            sums.non_finite.left_out += 1;
            continue;
        }
        for channel in 0..3 {
            let (value, truth) = (f64::from(x[channel]), f64::from(r[channel]));
            let error = value - truth;
            sums.squared += error * error;
            sums.relative += error * error / (truth * truth + f64::from(RELATIVE_FLOOR));
            let shown = shown(x[channel], exposure) - shown(r[channel], exposure);
            sums.shown += f64::from(shown * shown);
            sums.image[channel] += value;
            sums.reference[channel] += truth;
            if error.abs() > sums.max {
                (sums.max, sums.max_at) = (error.abs(), (column, y));
            }
        }
    }
    sums
}

impl Sums {
    /// The sums of these rows and the ones below them.
    fn add(self, below: Self) -> Self {
        let add = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
        let (max, max_at) =
            if below.max > self.max { (below.max, below.max_at) } else { (self.max, self.max_at) };
        Self {
            relative: self.relative + below.relative,
            squared: self.squared + below.squared,
            shown: self.shown + below.shown,
            image: add(self.image, below.image),
            reference: add(self.reference, below.reference),
            max,
            max_at,
            non_finite: NonFinite {
                image: self.non_finite.image + below.non_finite.image,
                reference: self.non_finite.reference + below.non_finite.reference,
                left_out: self.non_finite.left_out + below.non_finite.left_out,
            },
        }
    }
}

/// A linear value as a screen shows it, in [0, 1].
fn shown(linear: f32, exposure: f32) -> f32 {
    srgb_encode((linear * exposure).clamp(0.0, 1.0))
}

/// mean((x − r)² / (r² + 0.01)) over pixels and channels.
///
/// # Errors
/// If the sizes differ or no pixel is finite in both.
pub fn relative_mse(image: &RgbImage, reference: &RgbImage) -> Result<f64, MetricError> {
    Difference::measure(image, reference, 0.0).map(|d| d.relative_mse)
}

/// mean((x − r)²) over pixels and channels.
///
/// # Errors
/// If the sizes differ or no pixel is finite in both.
pub fn mse(image: &RgbImage, reference: &RgbImage) -> Result<f64, MetricError> {
    Difference::measure(image, reference, 0.0).map(|d| d.mse)
}

/// Peak signal-to-noise ratio in decibels of the pictures exposed, clamped to [0, 1] and encoded as sRGB.
///
/// # Errors
/// If the sizes differ or no pixel is finite in both.
pub fn psnr(image: &RgbImage, reference: &RgbImage, exposure_ev: f32) -> Result<f64, MetricError> {
    Difference::measure(image, reference, exposure_ev).map(|d| d.psnr_db)
}

/// The largest |x − r| of any pixel and channel.
///
/// # Errors
/// If the sizes differ or no pixel is finite in both.
pub fn max_error(image: &RgbImage, reference: &RgbImage) -> Result<f64, MetricError> {
    Difference::measure(image, reference, 0.0).map(|d| d.max_error)
}

/// Mean of each channel over the pixels that are finite, and how many are not. Zero if no pixel is finite.
pub fn mean_rgb(image: &RgbImage) -> ([f64; 3], usize) {
    let rows: Vec<([f64; 3], usize)> = image
        .pixels
        .par_chunks(image.width.max(1))
        .map(|row| {
            row.iter().fold(([0.0; 3], 0), |(sum, bad), pixel| {
                if pixel.iter().all(|v| v.is_finite()) {
                    ([0, 1, 2].map(|c| sum[c] + f64::from(pixel[c])), bad)
                } else {
                    (sum, bad + 1)
                }
            })
        })
        .collect();
    let (sum, bad) = rows
        .into_iter()
        .fold(([0.0; 3], 0), |(sum, bad), (row, more)| ([0, 1, 2].map(|c| sum[c] + row[c]), bad + more));
    (sum.map(|s: f64| s / (image.pixels.len() - bad).max(1) as f64), bad)
}
