//! How far a picture is from a reference.
//!
//! - [`Difference`] measures everything that is one number in a single pass: relative squared error, squared error,
//!   PSNR, means, the largest error and where it is.
//! - [`relative_squared_error`] and [`signed_difference`] keep one value per pixel.
//! - [`Flip`] tells what a person would notice when the two are shown in turn.
//! - [`without_noise`] and [`expected_noise`] allow for a reference that is itself noisy.
//!
//! Conventions: the picture under test comes first and the reference second; both are linear Rec. 709 and of one
//! size. A pixel that holds a NaN or an infinity in either picture is left out of every average, counted
//! ([`NonFinite`]), and is zero in the maps; FLIP takes it for black. Sums are made in `f64`, row by row in a
//! fixed order, so the results do not depend on the number of threads.
//!
//! ```
//! use halflight_image::RgbImage;
//! use halflight_image::metrics::{Difference, relative_mse};
//! let reference = RgbImage::from_fn(8, 8, |x, _| [x as f32 / 8.0; 3]);
//! let image = RgbImage::from_fn(8, 8, |x, _| [x as f32 / 8.0 + 0.1; 3]);
//! let all = Difference::measure(&image, &reference, 0.0)?;
//! assert!((all.mse - 0.01).abs() < 1e-6);
//! assert_eq!(all.relative_mse, relative_mse(&image, &reference)?);
//! # Ok::<(), halflight_image::metrics::MetricError>(())
//! ```

mod difference;
mod error;
mod flip;
mod maps;
mod noise;

pub use difference::{Difference, NonFinite, max_error, mean_rgb, mse, psnr, relative_mse};
pub use error::MetricError;
pub use flip::{ExposureRange, Flip, FlipMap, flip, hdr_flip};
pub use maps::{relative_squared_error, signed_difference};
pub use noise::{expected_noise, without_noise};

pub(crate) use maps::finite_in_both;

/// What is added to r² below the fraction of the relative squared error, so that black pixels do not rule it:
/// the square of a radiance of 0.1, a tenth of what is shown as white.
pub const RELATIVE_FLOOR: f32 = 0.01;

use crate::RgbImage;

/// Both pictures have pixels, and the same number of them each way.
fn check_sizes(image: &RgbImage, reference: &RgbImage) -> Result<(), MetricError> {
    let [of_image, of_reference] = [image, reference].map(|p| (p.width, p.height));
    if of_image != of_reference {
        return Err(MetricError::Sizes { image: of_image, reference: of_reference });
    }
    if image.pixels.is_empty() {
        return Err(MetricError::Empty);
    }
    Ok(())
}
