//! The exposures over which HDR-FLIP looks, and the tone curve through which it does.

use rayon::prelude::*;

use super::color::luminance;
use crate::RgbImage;

/// A range of exposures, in stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExposureRange {
    /// The darkest: at it the brightest pixel of the reference is just not burnt out.
    pub start_ev: f32,
    /// The brightest: at it the median pixel is just not burnt out.
    pub stop_ev: f32,
    /// How many exposures, evenly spaced from the first to the last.
    pub count: usize,
}

/// Numerator and denominator of the ACES tone curve (Narkowicz's fit), in powers of the value from the second
/// down; the fit is taken at 0.6 of the value, as the HDR-FLIP paper does.
const NUMERATOR: [f32; 3] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0];
const DENOMINATOR: [f32; 3] = [0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

/// What counts as burnt out: a tone-mapped value above this.
const BRIGHTEST: f32 = 0.85;

/// The median of a picture that is mostly black; so many stops down nothing is seen anyway.
const LEAST_MEDIAN: f32 = f32::EPSILON;

impl ExposureRange {
    /// The range the paper gives for a reference: from log₂(x / Yₘₐₓ) to log₂(x / Yₘₑ𝒹), where x is shown as 0.85,
    /// about one exposure per stop and at least two. A black reference is looked at as it is.
    pub fn of(reference: &RgbImage) -> Self {
        let mut luminances: Vec<f32> = reference
            .pixels
            .par_iter()
            .filter(|pixel| pixel.iter().all(|v| v.is_finite()))
            .map(|&pixel| luminance(pixel))
            .collect();
        let brightest = luminances.iter().copied().fold(0.0, f32::max);
        if brightest <= 0.0 {
            return Self { start_ev: 0.0, stop_ev: 0.0, count: 2 };
        }
        let middle = luminances.len() / 2;
        let median = luminances.select_nth_unstable_by(middle, f32::total_cmp).1.max(LEAST_MEDIAN);
        let not_burnt_out = value_shown_as(BRIGHTEST);
        let start_ev = (not_burnt_out / brightest).log2();
        let stop_ev = (not_burnt_out / median).log2().max(start_ev);
        Self { start_ev, stop_ev, count: ((stop_ev - start_ev).ceil() as usize).max(2) }
    }

    /// The exposures, darkest first.
    pub fn stops(&self) -> impl Iterator<Item = f32> + use<> {
        let Self { start_ev, stop_ev, count } = *self;
        let step = (stop_ev - start_ev) / count.saturating_sub(1).max(1) as f32;
        (0..count).map(move |k| start_ev + k as f32 * step)
    }
}

/// The ACES tone curve, clamped to [0, 1].
pub(super) fn aces(value: f32) -> f32 {
    // From here on the curve is above one; further on the squares would overflow.
    let x = value.clamp(0.0, 1e6);
    let polynomial = |c: &[f32; 3]| (c[0] * x + c[1]) * x + c[2];
    (polynomial(&NUMERATOR) / polynomial(&DENOMINATOR)).clamp(0.0, 1.0)
}

/// The value that the tone curve shows as `shown`: the positive root of numerator − shown · denominator.
fn value_shown_as(shown: f32) -> f32 {
    let [a, b, c] = [0, 1, 2].map(|i| NUMERATOR[i] - shown * DENOMINATOR[i]);
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_brightest_value_is_shown_as_the_curve_says() {
        assert!((aces(value_shown_as(0.85)) - 0.85).abs() < 1e-6);
    }

    #[test]
    fn a_range_runs_from_its_start_to_its_stop() {
        let range = ExposureRange { start_ev: -2.0, stop_ev: 1.0, count: 4 };
        assert_eq!(range.stops().collect::<Vec<_>>(), [-2.0, -1.0, 0.0, 1.0]);
    }

    #[test]
    fn a_black_reference_is_looked_at_as_it_is() {
        let range = ExposureRange::of(&RgbImage::new(4, 4));
        assert!(range.stops().all(|stop| stop == 0.0));
    }
}
