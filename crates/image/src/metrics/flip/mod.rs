//! FLIP: how different two pictures look when shown in turn, from 0 (alike) to 1, per pixel.
//!
//! ```text
//! FLIP = ΔE_c ^ (1 − ΔE_f)
//! ```
//!
//! ΔE_c is the difference of colour after the eye's contrast sensitivity has blurred both pictures; ΔE_f that of
//! edges and points. For pictures of high dynamic range it is the largest value over a range of exposures.
//!
//! Sources: P. Andersson et al., *FLIP: A Difference Evaluator for Alternating Images*, 2020 (LDR); P. Andersson
//! et al., *Visualizing Errors in Rendered High Dynamic Range Images*, 2021 (HDR); T. Akenine-Möller et al.,
//! *Errata for FLIP*, in the edition of the filters that are split into rows and columns.
//!
//! Conventions: linear Rec. 709 in, replicated at the borders; pixels that are not finite are black; 67.02 pixels
//! per degree unless stated (0.7 m from a screen 0.7 m and 3840 pixels wide).
//!
//! Error: the mean agrees with the authors' package within 1e-4 on the pairs of `tests/metrics_flip.rs`, which
//! names the script that made the package's numbers. Cost: about a quarter of a CPU-second per megapixel and exposure.
//!
//! ```
//! use halflight_image::{RgbImage, metrics::flip};
//! let reference = RgbImage::from_fn(32, 32, |x, _| [0.5 + 0.4 * (x as f32 * 0.7).sin(); 3]);
//! assert_eq!(flip(&reference, &reference, 0.0)?.mean, 0.0);
//! let flat = RgbImage::from_fn(32, 32, |_, _| [0.5; 3]);
//! assert!(flip(&flat, &reference, 0.0)?.mean > 0.1);
//! # Ok::<(), halflight_image::metrics::MetricError>(())
//! ```

mod color;
mod exposure;
mod filters;
mod perceived;

pub use exposure::ExposureRange;

use rayon::prelude::*;

use super::{MetricError, check_sizes};
use crate::{Plane, RgbImage};
use filters::Filters;
use perceived::{Perceived, difference};

/// The viewer for whom FLIP is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flip {
    /// Pixels per degree of the visual angle.
    pub pixels_per_degree: f32,
}

/// FLIP per pixel, and its mean.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipMap {
    /// Mean over the pixels.
    pub mean: f64,
    /// Value of each pixel, in [0, 1].
    pub map: Plane,
}

/// FLIP of the pictures as shown: multiplied by 2^EV and clamped to [0, 1]; for the standard viewer.
///
/// # Errors
/// If the sizes differ or there are no pixels.
pub fn flip(image: &RgbImage, reference: &RgbImage, exposure_ev: f32) -> Result<FlipMap, MetricError> {
    Flip::default().ldr(image, reference, exposure_ev)
}

/// FLIP over the range of exposures that the reference calls for ([`ExposureRange::of`]); for the standard viewer.
///
/// # Errors
/// If the sizes differ or there are no pixels.
pub fn hdr_flip(image: &RgbImage, reference: &RgbImage) -> Result<FlipMap, MetricError> {
    Flip::default().hdr(image, reference, &ExposureRange::of(reference))
}

impl Default for Flip {
    /// 0.7 m away from a screen 0.7 m and 3840 pixels wide.
    fn default() -> Self {
        Self::seen_from(0.7, 0.7, 3840.0)
    }
}

impl Flip {
    /// The viewer at a distance from a screen of a width in metres and in pixels.
    pub fn seen_from(distance_metres: f32, screen_metres: f32, screen_pixels: f32) -> Self {
        Self { pixels_per_degree: distance_metres * screen_pixels / screen_metres * 1_f32.to_radians() }
    }

    /// FLIP of the pictures multiplied by 2^EV and clamped to [0, 1].
    ///
    /// # Errors
    /// If the sizes differ or there are no pixels.
    pub fn ldr(
        &self,
        image: &RgbImage,
        reference: &RgbImage,
        exposure_ev: f32,
    ) -> Result<FlipMap, MetricError> {
        check_sizes(image, reference)?;
        let scale = exposure_ev.exp2();
        let mut map =
            Plane { width: image.width, height: image.height, values: vec![0.0; image.pixels.len()] };
        self.raise(&mut map, image, reference, |value| (value * scale).clamp(0.0, 1.0));
        Ok(with_mean(map))
    }

    /// The largest FLIP of each pixel over the exposures of the range, each shown through the ACES tone curve.
    ///
    /// # Errors
    /// If the sizes differ or there are no pixels.
    pub fn hdr(
        &self,
        image: &RgbImage,
        reference: &RgbImage,
        range: &ExposureRange,
    ) -> Result<FlipMap, MetricError> {
        check_sizes(image, reference)?;
        let mut map =
            Plane { width: image.width, height: image.height, values: vec![0.0; image.pixels.len()] };
        for stop in range.stops() {
            let scale = stop.exp2();
            self.raise(&mut map, image, reference, |value| exposure::aces(value * scale));
        }
        Ok(with_mean(map))
    }

    /// Raises each pixel of the map to the FLIP of the two pictures as `shown` in [0, 1], where that is larger.
    fn raise(
        &self,
        map: &mut Plane,
        image: &RgbImage,
        reference: &RgbImage,
        shown: impl Fn(f32) -> f32 + Sync,
    ) {
        let filters = Filters::new(self.pixels_per_degree);
        let [test, truth] = [image, reference].map(|picture| Perceived::new(picture, &filters, &shown));
        let width = map.width;
        map.values.par_chunks_mut(width).enumerate().for_each_init(
            || [test.scratch(), truth.scratch()],
            |[test_row, truth_row], (y, row)| {
                test.row(y, &filters, test_row);
                truth.row(y, &filters, truth_row);
                for (x, value) in row.iter_mut().enumerate() {
                    *value = value.max(difference(test_row, truth_row, x));
                }
            },
        );
    }
}

fn with_mean(map: Plane) -> FlipMap {
    let rows: Vec<f64> =
        map.values.par_chunks(map.width).map(|row| row.iter().map(|&v| f64::from(v)).sum()).collect();
    let mean = rows.into_iter().sum::<f64>() / map.values.len() as f64;
    FlipMap { mean, map }
}
