//! Convolved environments against direct summation over every texel of the map.

use std::f32::consts::{PI, TAU};

use glam::Vec3;
use halflight_frequency::preconvolved::{LEVELS, Preconvolved};
use halflight_image::RgbImage;

fn direction(x: f32, y: f32, w: usize, h: usize) -> Vec3 {
    let (phi, theta) = (TAU * x / w as f32 - PI, PI * y / h as f32);
    Vec3::new(phi.sin() * theta.sin(), theta.cos(), -phi.cos() * theta.sin())
}

fn direct(map: &RgbImage, about: Vec3, alpha: f32) -> Vec3 {
    let (w, h) = (map.width, map.height);
    let (mut sum, mut total) = (Vec3::ZERO, 0.0f64);
    let mut wide = [0.0f64; 3];
    for y in 0..h {
        let solid = (PI * y as f32 / h as f32).cos() - (PI * (y + 1) as f32 / h as f32).cos();
        for x in 0..w {
            let cos = direction(x as f32 + 0.5, y as f32 + 0.5, w, h).dot(about).max(0.0);
            let weight = f64::from(solid * cos.powf(alpha));
            total += weight;
            for c in 0..3 {
                wide[c] += weight * f64::from(map.pixels[y * w + x][c]);
            }
        }
    }
    for c in 0..3 {
        sum[c] = (wide[c] / total) as f32;
    }
    sum
}

#[test]
fn every_level_is_the_direct_sum_within_three_percent_of_its_largest_value() {
    let (w, h) = (256, 128);
    let map = RgbImage::from_fn(w, h, |x, y| {
        let d = direction(x as f32 + 0.5, y as f32 + 0.5, w, h);
        let sun = if d.dot(Vec3::new(0.48, 0.6, -0.64)) > 0.995 { 200.0 } else { 0.0 };
        [
            1.0 + sun + (9.0 * d.x).sin(),
            0.5 + sun + 0.5 * (20.0 * d.y).cos(),
            if d.y > 0.0 { 2.0 } else { 0.1 },
        ]
    });
    let convolved = Preconvolved::new(&map);
    for exponent in [1.0f32, 4.0, 32.0, 256.0, 1024.0] {
        let level = Preconvolved::level_of_exponent(exponent);
        let (mut worst, mut largest) = (0.0f32, 0.0f32);
        for k in 0..60 {
            let z = 1.0 - (k as f32 + 0.5) / 30.0;
            let (s, c) = (2.399_963 * k as f32).sin_cos();
            let mut about = Vec3::new((1.0 - z * z).sqrt() * c, z, (1.0 - z * z).sqrt() * s);
            if k % 10 == 0 {
                about = (Vec3::new(0.48, 0.6, -0.64) + 0.05 * about).normalize();
            }
            let truth = direct(&map, about, exponent);
            worst = worst.max((convolved.radiance(about, level) - truth).abs().max_element());
            largest = largest.max(truth.max_element());
        }
        eprintln!("exponent {exponent}: {:.4}", worst / largest);
        assert!(worst < 0.03 * largest, "exponent {exponent}: {worst} of {largest}");
    }
}

#[test]
fn constants_are_kept_and_level_zero_is_the_map() {
    let map = RgbImage { width: 40, height: 20, pixels: vec![[0.25, 1.0, 3.0]; 800] };
    let convolved = Preconvolved::new(&map);
    assert_eq!(convolved.levels().len(), LEVELS + 1);
    for level in [0.0, 0.5, 3.7, 11.0, 99.0, f32::NAN] {
        let got = convolved.radiance(Vec3::new(0.3, -0.5, 0.8), level);
        assert!((got - Vec3::new(0.25, 1.0, 3.0)).length() < 1e-3, "{level}: {got}");
    }
    assert_eq!(Preconvolved::level_of_exponent(1e9), 0.0);
    assert_eq!(Preconvolved::level_of_exponent(1024.0), 1.0);
    assert_eq!(Preconvolved::level_of_exponent(f32::NAN), LEVELS as f32);
    assert!((Preconvolved::level_of_bandwidth(0.2755 * 8.0) - 5.0).abs() < 1e-3);
}

#[test]
fn one_texel_black_and_broken_maps_give_sound_light() {
    for (w, h) in [(0, 0), (3, 1)] {
        for value in [0.0, 2.0, f32::NAN, f32::MAX] {
            let convolved =
                Preconvolved::new(&RgbImage { width: w, height: h, pixels: vec![[value; 3]; w * h] });
            for d in [Vec3::X, Vec3::Y, Vec3::ZERO, Vec3::NAN] {
                let got = convolved.radiance(d, 4.5);
                assert!(got.is_finite() && got.min_element() >= 0.0, "{w} {h} {value} {d}: {got}");
            }
        }
    }
}
