//! The wavelet rule against what Fourier says.

use glam::Vec2;
use halflight_frequency::measured;
use halflight_frequency::wavelet::{
    Border, Filter, Pyramid, Rule, local_bandwidth, padded_local_bandwidth, polygon_mask, printed,
    whole_bandwidth,
};
use halflight_image::Plane;

/// Numbers that look random, in 0..1.
fn hash(mut x: u32) -> f32 {
    x = (x ^ 61) ^ (x >> 16);
    x = x.wrapping_mul(9);
    x = (x ^ (x >> 4)).wrapping_mul(0x27d4_eb2d);
    (x ^ (x >> 15)) as f32 / u32::MAX as f32
}

/// Noise whose spectrum fills the disc of radius `cutoff` cycles per texel.
fn noise(w: usize, h: usize, cutoff: f32, seed: u32) -> Plane {
    let waves: Vec<[f32; 3]> = (0..160)
        .map(|i| {
            let r = cutoff * hash(seed + 3 * i).sqrt();
            let (s, c) = (std::f32::consts::TAU * hash(seed + 3 * i + 1)).sin_cos();
            [r * c, r * s, hash(seed + 3 * i + 2)]
        })
        .collect();
    let value = |i: usize| {
        let (x, y) = ((i % w) as f32, (i / w) as f32);
        waves.iter().map(|k| (std::f32::consts::TAU * (k[0] * x + k[1] * y + k[2])).sin()).sum::<f32>()
    };
    Plane { width: w, height: h, values: (0..w * h).map(value).collect() }
}

fn square(_: usize, _: usize) -> Vec2 {
    Vec2::ONE
}

#[test]
fn verified_math_5_calibration_on_band_limited_noise() {
    for (cutoff, smooth, haar) in
        [(0.4, 0.5, 0.5), (0.2, 0.5, 0.5), (0.1, 0.25, 0.25), (0.05, 0.125, 0.25), (0.025, 0.0625, 0.125)]
    {
        let picture = noise(256, 256, cutoff, 7);
        for (filter, expected) in [(Filter::Smooth, smooth), (Filter::Haar, haar)] {
            let pyramid = Pyramid::new(&picture, filter, Border::Repeat);
            let octave = whole_bandwidth(&pyramid, Rule::Octave);
            let within = whole_bandwidth(&pyramid, Rule::Within);
            eprintln!("cutoff {cutoff} {filter:?}: {octave} {within}");
            assert_eq!(octave, expected, "cutoff {cutoff}, {filter:?}");
            assert!(within <= octave && within >= 0.5 * octave);
        }
    }
}

#[test]
fn local_bandwidth_follows_the_windowed_transform() {
    for cutoff in [0.3, 0.15, 0.08] {
        let picture = noise(128, 128, cutoff, 99);
        let pyramid = Pyramid::new(&picture, Filter::Smooth, Border::Repeat);
        let mut ratios: [Vec<f32>; 2] = Default::default();
        for (rule, ratios) in [Rule::Octave, Rule::Within].into_iter().zip(&mut ratios) {
            let map = local_bandwidth(&pyramid, rule, square);
            for y in (20..110).step_by(6) {
                for x in (20..110).step_by(6) {
                    ratios.push(map.values[y * 128 + x] / measured::windowed_bandwidth(&picture, x, y));
                }
            }
            ratios.sort_by(f32::total_cmp);
        }
        let at = |r: &[f32], q: f32| r[(q * (r.len() - 1) as f32) as usize];
        for r in &ratios {
            eprintln!(
                "cutoff {cutoff}: {} {} {} {} {}",
                at(r, 0.02),
                at(r, 0.1),
                at(r, 0.5),
                at(r, 0.9),
                at(r, 0.98)
            );
        }
        assert!(at(&ratios[0], 0.1) > 0.7 && at(&ratios[0], 0.5) < 3.0);
        assert!((0.6..2.0).contains(&at(&ratios[1], 0.5)));
    }
}

#[test]
fn eq_7_as_printed_gives_the_finest_level_for_almost_anything() {
    let picture = noise(256, 256, 0.05, 3);
    let pyramid = Pyramid::new(&picture, Filter::Haar, Border::Repeat);
    let largest: Vec<f32> = pyramid
        .levels
        .iter()
        .enumerate()
        // Orthonormal amplitudes: power per texel times the area of a cell.
        .map(|(i, l)| {
            let power = l.across.iter().zip(&l.down).map(|(a, b)| a + b).fold(0.0, f32::max);
            (power * 4f32.powi(i as i32 + 1)).sqrt()
        })
        .collect();
    assert_eq!(printed::level_by_amplitude(&largest, 0.01), 0); // 0.5 cycles per texel: ten times too high
    assert_eq!(printed::level(&largest, 0.01), largest.len()); // the coarse tail is never small
    assert!(whole_bandwidth(&pyramid, Rule::Octave) <= 0.25);
    let ratio = printed::angular(3, 0.01) / (1.0 / (16.0 * 0.01));
    assert!((ratio - 4.0 * std::f32::consts::PI).abs() < 1e-4);
}

#[test]
fn power_is_kept_from_octave_to_octave() {
    for filter in [Filter::Haar, Filter::Smooth] {
        let picture = noise(64, 64, 0.5, 5);
        let pyramid = Pyramid::new(&picture, filter, Border::Wrap);
        let n = picture.values.len() as f64;
        let mean = picture.values.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
        let variance = picture.values.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>() / n;
        let total: f64 = pyramid.energies().iter().sum();
        assert!((total / variance - 1.0).abs() < 1e-4, "{filter:?}: {total} {variance}");
        assert!((f64::from(pyramid.mean) - mean).abs() < 1e-4);
    }
}

#[test]
fn a_sun_does_not_hide_the_detail_of_the_sky() {
    let mut picture = noise(256, 128, 0.3, 11);
    for v in &mut picture.values {
        *v = 1.0 + 0.01 * *v;
    }
    let clear = local_bandwidth(
        &Pyramid::new(&picture, Filter::Smooth, Border::WrapHorizontally),
        Rule::Octave,
        square,
    );
    picture.values[64 * 256 + 128] = 1e4;
    let sunny = local_bandwidth(
        &Pyramid::new(&picture, Filter::Smooth, Border::WrapHorizontally),
        Rule::Octave,
        square,
    );
    let mut lost = 0;
    let mut seen = 0;
    for y in 0..128usize {
        for x in 0..256usize {
            if x.abs_diff(128).max(y.abs_diff(64)) > 60 {
                seen += 1;
                lost += usize::from(sunny.values[y * 256 + x] < 0.5 * clear.values[y * 256 + x]);
            }
        }
    }
    eprintln!("lost {lost} of {seen}");
    assert!(lost * 50 < seen, "{lost} of {seen}");
    assert_eq!(sunny.values[64 * 256 + 128], 0.5);
}

#[test]
fn texels_that_are_not_square_are_counted_in_true_frequencies() {
    // Isotropic noise, sampled four times as densely across.
    let narrow = noise(512, 512, 0.1, 21);
    let values = (0..512 * 128).map(|i| narrow.values[(i / 512) * 4 * 512 + i % 512]).collect();
    let flat = Plane { width: 512, height: 128, values };
    let full = local_bandwidth(&Pyramid::new(&narrow, Filter::Smooth, Border::Repeat), Rule::Within, square);
    let cut = local_bandwidth(&Pyramid::new(&flat, Filter::Smooth, Border::Repeat), Rule::Within, |_, _| {
        Vec2::new(1.0, 4.0)
    });
    let mean = |p: &Plane| p.values.iter().sum::<f32>() / p.values.len() as f32;
    let ratio = mean(&cut) / mean(&full);
    assert!((0.6..1.5).contains(&ratio), "{ratio}");
}

#[test]
fn a_white_square_light_varies_at_its_edges_only() {
    let white = Plane { width: 64, height: 64, values: vec![1.0; 64 * 64] };
    let map = padded_local_bandwidth(&white, Filter::Smooth, Rule::Octave, Vec2::splat(0.01));
    assert_eq!((map.width, map.height), (64, 64));
    let at = |x: usize, y: usize| map.values[y * 64 + x];
    assert!(at(0, 32) >= 25.0, "{}", at(0, 32));
    assert!(at(32, 32) <= 6.25, "{}", at(32, 32));
    assert!(at(32, 32) > 0.0);
}

#[test]
fn a_polygon_becomes_a_mask_of_its_area() {
    let triangle = [Vec2::new(1.0, 1.0), Vec2::new(3.0, 1.0), Vec2::new(1.0, 2.0)];
    let (mask, texel) = polygon_mask(&triangle, 64);
    assert_eq!((mask.width, mask.height), (64, 32));
    let area: f32 = mask.values.iter().sum::<f32>() * texel.x * texel.y;
    assert!((area - 1.0).abs() < 0.01, "{area}");
    for bad in [&triangle[..2], &[Vec2::ZERO; 3], &[Vec2::NAN; 3]] {
        assert_eq!(polygon_mask(bad, 64).0.values, [0.0]);
    }
}

#[test]
fn black_flat_tiny_and_broken_pictures_have_sound_bandwidths() {
    let check = |picture: &Plane, zero: bool| {
        for filter in [Filter::Haar, Filter::Smooth] {
            for border in [Border::Repeat, Border::WrapHorizontally, Border::Wrap] {
                let pyramid = Pyramid::new(picture, filter, border);
                let map = local_bandwidth(&pyramid, Rule::Within, square);
                assert_eq!(map.values.len(), picture.width * picture.height);
                assert!(map.values.iter().all(|v| v.is_finite() && *v >= 0.0 && *v <= 0.5));
                let whole = whole_bandwidth(&pyramid, Rule::Octave);
                assert!(whole.is_finite() && (0.0..=0.5).contains(&whole));
                if zero {
                    assert!(map.values.iter().all(|v| *v == 0.0) && whole == 0.0, "{map:?}");
                }
                let padded = padded_local_bandwidth(picture, filter, Rule::Octave, Vec2::ONE);
                assert!(padded.values.iter().all(|v| v.is_finite()));
            }
        }
    };
    for (w, h) in [(0, 0), (1, 1), (1, 5), (7, 1), (2, 2), (3, 3), (33, 17), (64, 32)] {
        check(&Plane { width: w, height: h, values: vec![0.0; w * h] }, true);
        check(&Plane { width: w, height: h, values: vec![0.37; w * h] }, true);
        check(&Plane { width: w, height: h, values: vec![f32::NAN; w * h] }, true);
        let wild = [f32::MAX, -f32::MAX, f32::INFINITY, 0.0, 1.0, f32::NAN];
        check(&Plane { width: w, height: h, values: (0..w * h).map(|i| wild[i * 7 % 6]).collect() }, false);
        check(&Plane { width: w, height: h, values: vec![1.0; w * h / 2] }, false);
    }
}

#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    let picture = noise(200, 130, 0.3, 1);
    let run = || {
        let pyramid = Pyramid::new(&picture, Filter::Smooth, Border::WrapHorizontally);
        local_bandwidth(&pyramid, Rule::Within, |_, y| Vec2::new(0.01 + y as f32 * 1e-4, 0.01)).values
    };
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().map(|p| p.install(run));
    assert_eq!(pool(1).ok(), pool(3).ok());
}
