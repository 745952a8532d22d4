//! The exposure of a bare environment map, which nothing else tells: maps are in any unit, from lux to "about one".

use halflight_image::RgbImage;
use halflight_scene::lights::luminance;

/// What the geometric mean of the luminance becomes: the grey card of photographers, the middle of what a screen shows.
const GREY: f64 = 0.18;
/// Pixels darker than this part of the brightest mean count as if they had it: black corners are no measure.
const FLOOR: f64 = 1e-6;

/// Stops that bring the geometric mean of the luminance (Reinhard et al. 2002, eq. 1) to middle grey, in tenths; 0 for a
/// black picture.
pub fn automatic_exposure(image: &RgbImage) -> f32 {
    let luminances: Vec<f64> =
        image.pixels.iter().map(|&p| f64::from(luminance(p.into()))).filter(|l| l.is_finite()).collect();
    let brightest = luminances.iter().copied().fold(0.0, f64::max);
    if brightest <= 0.0 {
        return 0.0;
    }
    let logs: f64 = luminances.iter().map(|l| l.max(FLOOR * brightest).ln()).sum();
    let mean = (logs / luminances.len() as f64).exp();
    ((GREY / mean).log2() * 10.0).round() as f32 / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn middle_grey_needs_no_exposure_and_half_of_it_one_stop() {
        let grey = |value: f32| RgbImage::from_fn(4, 4, |_, _| [value; 3]);
        assert_eq!(automatic_exposure(&grey(0.18)), 0.0);
        assert_eq!(automatic_exposure(&grey(0.09)), 1.0);
        assert_eq!(automatic_exposure(&grey(18.0 * 1.024)), -6.7);
        assert_eq!(automatic_exposure(&grey(0.0)), 0.0);
    }

    #[test]
    fn a_tiny_sun_does_not_darken_the_picture() {
        let dim = |x: usize, y: usize| if (x, y) == (3, 3) { [1e4; 3] } else { [0.05; 3] };
        assert!(automatic_exposure(&RgbImage::from_fn(64, 64, dim)) > 1.5);
    }
}
