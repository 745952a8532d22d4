//! Cycles per radian and metre on things whose frequencies are known.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use halflight_frequency::bandwidth::UNLIMITED;
use halflight_frequency::mapping::{
    EnvironmentBandwidth, LightBandwidth, MaxPyramid, TextureBandwidth, angular_map,
};
use halflight_frequency::wavelet::{Filter, Rule};
use halflight_image::Plane;

/// A sky of many waves exp(2πi k·ω), |k| = `frequency`: as fast in every direction.
fn sky(direction: Vec3, frequency: f32) -> f32 {
    (0..40)
        .map(|i| {
            let z = (2.0 * i as f32 + 1.0) / 40.0 - 1.0;
            let (s, c) = (i as f32 * 2.399_963).sin_cos();
            let r = (1.0 - z * z).sqrt();
            (TAU * frequency * direction.dot(Vec3::new(r * c, r * s, z)) + i as f32).sin()
        })
        .sum()
}

fn lat_long(w: usize, h: usize, f: impl Fn(Vec3) -> f32) -> Plane {
    let value = |i: usize| {
        let (phi, theta) =
            (TAU * ((i % w) as f32 + 0.5) / w as f32 - PI, PI * ((i / w) as f32 + 0.5) / h as f32);
        f(Vec3::new(phi.sin() * theta.sin(), theta.cos(), -phi.cos() * theta.sin()))
    };
    Plane { width: w, height: h, values: (0..w * h).map(value).collect() }
}

#[test]
fn a_sky_of_one_frequency_has_it_everywhere_even_at_the_poles() {
    for frequency in [3.0, 8.0] {
        let map = lat_long(512, 256, |d| sky(d, frequency));
        for (rule, least, most) in [(Rule::Octave, 1.0, 4.0), (Rule::Within, 0.7, 3.0)] {
            let bandwidth = EnvironmentBandwidth::plane(&map, Filter::Smooth, rule);
            for row in [1, 5, 20, 60, 128, 200, 254] {
                let mut values = bandwidth.values[row * 512..(row + 1) * 512].to_vec();
                values.sort_by(f32::total_cmp);
                let (low, mid, high) =
                    (values[25] / frequency, values[256] / frequency, values[486] / frequency);
                // Within two rows of a pole nothing better than an upper bound is to be had.
                let most = if (3..253).contains(&row) { most } else { 8.0 };
                assert!(mid > least && mid < most, "{frequency} {rule:?} row {row}: {mid}");
                assert!(
                    low > 0.4 * least && high < 2.0 * most,
                    "{frequency} {rule:?} row {row}: {low} {high}"
                );
            }
        }
    }
}

#[test]
fn a_light_probe_says_the_same_as_a_latitude_longitude_map() {
    let n = 256;
    let value = |i: usize| {
        let (x, y) =
            (2.0 * ((i % n) as f32 + 0.5) / n as f32 - 1.0, 1.0 - 2.0 * ((i / n) as f32 + 0.5) / n as f32);
        let r = x.hypot(y).max(1e-6);
        let theta = PI * r.min(1.0);
        sky(Vec3::new(theta.sin() * x / r, theta.sin() * y / r, -theta.cos()), 4.0)
    };
    let probe = Plane { width: n, height: n, values: (0..n * n).map(value).collect() };
    let map = angular_map(&probe, Filter::Smooth, Rule::Within);
    let mut inner: Vec<f32> = (0..n * n)
        .filter(|i| {
            let (x, y) = ((i % n) as f32 / 128.0 - 1.0, (i / n) as f32 / 128.0 - 1.0);
            x.hypot(y) < 0.8
        })
        .map(|i| map.values[i] / 4.0)
        .collect();
    inner.sort_by(f32::total_cmp);
    let median = inner[inner.len() / 2];
    assert!((0.8..2.0).contains(&median), "{median}");
    assert_eq!(map.values[0], 0.0);
}

#[test]
fn look_ups_by_direction_find_the_texel_and_cover_the_cap() {
    let map = lat_long(64, 32, |d| if d.dot(Vec3::X) > 0.97 { 100.0 } else { 1.0 });
    let bandwidth = EnvironmentBandwidth::new(&map, Filter::Smooth, Rule::Octave);
    assert!(bandwidth.along(Vec3::X) > 0.0);
    let most = bandwidth.within(Vec3::X, 0.3);
    assert!(most >= bandwidth.along(Vec3::X) && most >= bandwidth.along(Vec3::new(1.0, 0.25, 0.0)));
    assert!(bandwidth.within(Vec3::Y, 2.0) >= most);
    for bad in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
        assert!(bandwidth.along(bad).is_finite() && bandwidth.within(bad, 0.1).is_finite());
    }
}

#[test]
fn one_texel_and_black_environments_do_not_vary() {
    for (w, h) in [(1, 1), (8, 4), (0, 0)] {
        for value in [0.0, 5.0, f32::NAN] {
            let map = Plane { width: w, height: h, values: vec![value; w * h] };
            let bandwidth = EnvironmentBandwidth::new(&map, Filter::Smooth, Rule::Octave);
            assert_eq!(bandwidth.along(Vec3::Y), 0.0);
            assert_eq!(bandwidth.within(Vec3::X, 0.5), 0.0);
            assert!(angular_map(&map, Filter::Haar, Rule::Within).values.iter().all(|v| *v == 0.0));
        }
    }
}

#[test]
fn boxes_are_covered_by_the_maximum_and_by_little_more() {
    let (w, h) = (37, 20);
    let values: Vec<f32> = (0..w * h).map(|i| ((i * 7919) % 1009) as f32).collect();
    for wraps in [[true, true], [false, false]] {
        let pyramid = MaxPyramid::new(Plane { width: w, height: h, values: values.clone() }, wraps);
        for k in 0..400 {
            let (u, v) = ((k as f32 * 0.618).fract(), (k as f32 * 0.377).fract());
            let (bw, bh) = ((k % 17) as f32 / 37.0, (k % 11) as f32 / 20.0);
            let mut exact = 0.0f32;
            for dy in -10..=10i32 {
                for dx in -10..=10i32 {
                    let (x, y) =
                        (u * 37.0 + dx as f32 * bw * 37.0 / 20.0, v * 20.0 + dy as f32 * bh * 20.0 / 20.0);
                    let (x, y) = (x.floor() as i32, y.floor() as i32);
                    let (x, y) = if wraps[0] {
                        (x.rem_euclid(37), y.rem_euclid(20))
                    } else {
                        (x.clamp(0, 36), y.clamp(0, 19))
                    };
                    exact = exact.max(values[(y * 37 + x) as usize]);
                }
            }
            assert!(pyramid.within(u, v, bw, bh) >= exact, "{wraps:?} {k}");
        }
        assert_eq!(pyramid.at(0.5 / 37.0, 0.5 / 20.0), values[0]);
        assert_eq!(pyramid.within(0.3, 0.3, f32::INFINITY, 0.0), values.iter().copied().fold(0.0, f32::max));
        assert!(pyramid.within(f32::NAN, 0.3, 0.1, 0.0).is_finite());
    }
}

#[test]
fn textures_are_counted_in_cycles_per_metre_on_the_surface() {
    // 16 cycles across the picture, which is laid over 2 m × 4 m.
    let values = (0..128 * 128).map(|i| (TAU * 16.0 * ((i % 128) as f32 + 0.3) / 128.0).sin()).collect();
    let texture =
        TextureBandwidth::new(&Plane { width: 128, height: 128, values }, Filter::Smooth, Rule::Within, true);
    let uv = Vec2::new(0.4, 0.6);
    let flat = texture.on_surface(uv, Vec2::ZERO, Vec3::X * 2.0, Vec3::Z * 4.0);
    assert!((8.0 * 0.8..8.0 * 2.5).contains(&flat), "{flat}");
    assert!(texture.on_surface(uv, Vec2::splat(0.2), Vec3::X * 2.0, Vec3::Z * 4.0) >= flat);
    let twice = texture.on_surface(uv, Vec2::ZERO, Vec3::X, Vec3::Z * 4.0);
    assert!((twice / flat - 2.0).abs() < 1e-4);
    assert_eq!(texture.on_surface(uv, Vec2::ZERO, Vec3::X, Vec3::X), UNLIMITED);
    assert_eq!(texture.on_surface(uv, Vec2::ZERO, Vec3::NAN, Vec3::X), UNLIMITED);
    let plain = TextureBandwidth::new(
        &Plane { width: 4, height: 4, values: vec![0.5; 16] },
        Filter::Smooth,
        Rule::Within,
        true,
    );
    assert_eq!(plain.on_surface(uv, Vec2::ZERO, Vec3::ZERO, Vec3::ZERO), 0.0);
}

#[test]
fn lights_vary_at_their_edges_and_not_at_all_without_size() {
    let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let light = LightBandwidth::polygon(&corners, 64, Filter::Smooth, Rule::Octave);
    assert!(light.at(Vec2::new(0.01, 0.5)) > light.at(Vec2::splat(0.5)));
    assert!(light.at(Vec2::splat(0.5)) > 0.0);
    assert_eq!(light.whole(), 0.0);
    for none in [
        LightBandwidth::polygon(&[Vec2::ONE; 4], 64, Filter::Smooth, Rule::Octave),
        LightBandwidth::new(
            &Plane { width: 2, height: 2, values: vec![1.0; 4] },
            Vec2::ZERO,
            Filter::Haar,
            Rule::Octave,
        ),
    ] {
        assert_eq!((none.at(Vec2::splat(0.5)), none.whole()), (0.0, 0.0));
    }
}
