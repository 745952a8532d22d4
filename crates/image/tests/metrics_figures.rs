//! The figures that are one number, and the maps.

#![allow(clippy::unwrap_used, reason = "a test may end where it goes wrong")]

use halflight_image::metrics::{
    Difference, MetricError, expected_noise, max_error, mean_rgb, mse, psnr, relative_mse,
    relative_squared_error, signed_difference, without_noise,
};
use halflight_image::{Plane, RgbImage};

fn ramp() -> RgbImage {
    RgbImage::from_fn(7, 5, |x, y| [x as f32 * 0.1, y as f32 * 0.2, 0.5])
}

/// The ramp with something added to every value.
fn lifted(by: f32) -> RgbImage {
    let ramp = ramp();
    RgbImage::from_fn(7, 5, |x, y| ramp.pixels[y * 7 + x].map(|v| v + by))
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * b.abs().max(1e-12)
}

#[test]
fn figures_are_their_formulas() {
    let (image, reference) = (lifted(0.05), ramp());
    let squares: Vec<(f64, f64)> = image
        .pixels
        .iter()
        .flatten()
        .zip(reference.pixels.iter().flatten())
        .map(|(&x, &r)| ((f64::from(x) - f64::from(r)).powi(2), f64::from(r).powi(2) + 0.01))
        .collect();
    let count = squares.len() as f64;
    let relative = squares.iter().map(|(square, weight)| square / weight).sum::<f64>() / count;
    let absolute = squares.iter().map(|(square, _)| square).sum::<f64>() / count;
    assert!(close(relative_mse(&image, &reference).unwrap(), relative));
    assert!(close(mse(&image, &reference).unwrap(), absolute));
    let all = Difference::measure(&image, &reference, 0.0).unwrap();
    assert!(close(all.mean[2], 0.55) && close(all.reference_mean[2], 0.5));
    assert_eq!(all.non_finite.left_out, 0);
}

#[test]
fn psnr_looks_at_the_picture_as_it_is_shown() {
    let grey = |v: f32| RgbImage::from_fn(4, 4, |_, _| [v; 3]);
    // Both are burnt out one stop up, and no longer one stop down.
    assert_eq!(psnr(&grey(0.6), &grey(0.9), 1.0).unwrap(), f64::INFINITY);
    let encode = |v: f64| 1.055 * v.powf(1.0 / 2.4) - 0.055;
    let expected = -20.0 * (encode(0.45) - encode(0.3)).log10();
    assert!((psnr(&grey(0.6), &grey(0.9), -1.0).unwrap() - expected).abs() < 1e-4);
}

#[test]
fn the_largest_error_is_found_where_it_is() {
    let mut image = ramp();
    image.pixels[3 * 7 + 2][1] -= 4.0;
    let all = Difference::measure(&image, &ramp(), 0.0).unwrap();
    assert_eq!(all.max_error_at, (2, 3));
    assert!(close(all.max_error, 4.0) && close(max_error(&image, &ramp()).unwrap(), all.max_error));
}

#[test]
fn pixels_without_a_value_are_counted_and_left_out() {
    let (mut image, mut reference) = (lifted(0.1), ramp());
    let without = RgbImage { width: 6, height: 5, pixels: image.pixels[..30].to_vec() };
    let without_of_reference = RgbImage { width: 6, height: 5, pixels: reference.pixels[..30].to_vec() };
    image.pixels[30][0] = f32::NAN;
    image.pixels[31] = [f32::INFINITY; 3];
    image.pixels[32][2] = f32::NEG_INFINITY;
    reference.pixels[32][1] = f32::NAN;
    reference.pixels[33][1] = f32::INFINITY;
    image.pixels[34] = [f32::NAN; 3];
    let all = Difference::measure(&image, &reference, 0.0).unwrap();
    assert_eq!((all.non_finite.image, all.non_finite.reference, all.non_finite.left_out), (4, 2, 5));
    assert!(close(all.relative_mse, relative_mse(&without, &without_of_reference).unwrap()));
    assert_eq!(mean_rgb(&image).1, 4);
    assert!(close(mean_rgb(&without).0[2], mean_rgb(&image).0[2]));
    for map in [relative_squared_error(&image, &reference), signed_difference(&image, &reference)] {
        let map = map.unwrap();
        assert!(map.values.iter().all(|v| v.is_finite()));
        assert!(map.values[30..].iter().all(|&v| v == 0.0));
    }
}

#[test]
fn a_picture_without_any_value_is_an_error_that_says_so() {
    let nothing = RgbImage::from_fn(7, 5, |_, _| [f32::NAN; 3]);
    let error = relative_mse(&nothing, &ramp()).unwrap_err();
    assert_eq!(error, MetricError::NothingFinite { pixels: 35, image: 35, reference: 0 });
    assert!(error.to_string().contains("35 of the picture"));
}

#[test]
fn pictures_of_two_sizes_are_an_error_that_names_both() {
    let error = relative_mse(&RgbImage::new(4, 3), &ramp()).unwrap_err().to_string();
    assert!(error.contains("4×3") && error.contains("7×5"), "{error}");
    assert_eq!(relative_mse(&RgbImage::new(0, 3), &RgbImage::new(0, 3)), Err(MetricError::Empty));
    assert!(relative_squared_error(&RgbImage::new(4, 3), &ramp()).is_err());
}

#[test]
fn maps_average_to_their_figures_and_keep_the_sign() {
    let (image, reference) = (lifted(-0.03), ramp());
    let map = relative_squared_error(&image, &reference).unwrap();
    let mean = map.values.iter().map(|&v| f64::from(v)).sum::<f64>() / map.values.len() as f64;
    assert!(close(mean, relative_mse(&image, &reference).unwrap()));
    assert!(signed_difference(&image, &reference).unwrap().values.iter().all(|&v| v < 0.0));
    assert!(signed_difference(&reference, &image).unwrap().values.iter().all(|&v| v > 0.0));
}

#[test]
fn values_that_overflow_stay_finite() {
    let huge = RgbImage::from_fn(3, 3, |x, _| [if x == 1 { f32::MAX } else { f32::MIN }; 3]);
    let other = RgbImage::from_fn(3, 3, |x, _| [if x == 2 { f32::MAX } else { 0.0 }; 3]);
    for (a, b) in [(&huge, &other), (&other, &huge)] {
        assert!(Difference::measure(a, b, 20.0).unwrap().relative_mse.is_finite());
        assert!(relative_squared_error(a, b).unwrap().values.iter().all(|v| v.is_finite()));
        assert!(signed_difference(a, b).unwrap().values.iter().all(|v| v.is_finite()));
    }
}

#[test]
fn noise_that_is_known_is_allowed_for() {
    // Every value errs by ±0.02, so the variance is 0.0004 and nothing else is wrong.
    let reference = ramp();
    let image = RgbImage::from_fn(7, 5, |x, y| {
        reference.pixels[y * 7 + x].map(|v| if (x + y) % 2 == 0 { v + 0.02 } else { v - 0.02 })
    });
    let variance = Plane { width: 7, height: 5, values: vec![0.0004; 35] };
    let measured = relative_mse(&image, &reference).unwrap();
    let noise = expected_noise(&reference, &variance).unwrap();
    assert!(without_noise(measured, noise).abs() < 1e-5 * measured);
    assert!(expected_noise(&reference, &Plane { width: 5, height: 7, values: vec![0.0; 35] }).is_err());
}
