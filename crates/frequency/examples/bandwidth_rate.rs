//! What the analysis costs: `cargo run --release -p halflight-frequency --example bandwidth_rate`.

use std::hint::black_box;
use std::time::Instant;

use glam::Vec3;
use halflight_frequency::bandwidth::{Exit, pixel, variance};
use halflight_frequency::importance::{ImportanceTable, TableSize};
use halflight_frequency::mapping::EnvironmentBandwidth;
use halflight_frequency::preconvolved::Preconvolved;
use halflight_frequency::reflectance::{ReflectanceBandwidth, Slices};
use halflight_frequency::wavelet::{Filter, Rule};
use halflight_image::{Plane, RgbImage};

fn best(times: usize, mut run: impl FnMut()) -> f64 {
    let time = |run: &mut dyn FnMut()| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    };
    (0..times).map(|_| time(&mut run)).fold(f64::INFINITY, f64::min)
}

fn main() {
    let (w, h) = (512, 256);
    let value = |i: usize| {
        let (x, y) = ((i % w) as f32, (i / w) as f32);
        1.0 + (x * 0.3).sin() * (y * 0.02).cos() + if i.is_multiple_of(9973) { 500.0 } else { 0.0 }
    };
    let map = Plane { width: w, height: h, values: (0..w * h).map(value).collect() };
    for threads in [1, 2] {
        let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(threads).build() else { return };
        let seconds = pool.install(|| {
            best(50, || {
                black_box(EnvironmentBandwidth::plane(black_box(&map), Filter::Smooth, Rule::Octave));
            })
        });
        println!("environment {w} x {h}, {threads} threads: {:.2} ms", seconds * 1e3);
    }

    tables();

    let light: [f32; 16] = std::array::from_fn(|i| 1.0 + i as f32);
    let lobe: [f32; 16] = std::array::from_fn(|i| 20.0 - i as f32);
    let weight: [f32; 16] = std::array::from_fn(|i| 0.1 * i as f32);
    let distance: [f32; 16] = std::array::from_fn(|i| 1.0 + 0.1 * i as f32);
    let cosine: [f32; 16] = std::array::from_fn(|i| 1.0 - 0.05 * i as f32);
    let pixels = 512 * 512;
    let exit = |i: usize| Exit { curvature: i as f32 * 1e-5, distance: 3.0, cos_exit: 0.7, texture: 1.0 };
    let shade = |angular: f32| pixel::level(pixel::pixel_bandwidth(angular, 0.002, 0.002), -2, 9);
    let report = |name: &str, seconds: f64| {
        println!(
            "{name}: {:.1} ns per pixel, {:.2} ms for 512 x 512",
            seconds * 1e9 / pixels as f64,
            seconds * 1e3
        );
    };
    let sum = |f: &dyn Fn(usize) -> i32| {
        best(10, || {
            black_box((0..pixels).map(f).sum::<i32>());
        })
    };
    report(
        "sixteen distant directions, one thread",
        sum(&|i| shade(black_box(&exit(i)).average_distant(black_box(&light), &lobe, &weight).angular)),
    );
    report(
        "sixteen points of local lights, one thread",
        sum(&|i| {
            let exit = black_box(exit(i));
            shade(exit.average_local(black_box(&light), &distance, &cosine, &lobe, &weight).angular)
        }),
    );
    report(
        "second moment and count, one thread",
        sum(&|_| {
            let moment = variance::second_moment_plain(black_box(&light), &weight, &light, &lobe);
            variance::sample_count(variance::uniform_bound(moment), 3.0, 0.02, 1, 1024) as i32
        }),
    );
}

/// What is made once: per material, or when the light changes.
fn tables() {
    let phong = |wi: Vec3, wo: Vec3| Vec3::new(-wi.x, -wi.y, wi.z).dot(wo).max(0.0).powf(64.0);
    let seconds = best(3, || {
        black_box(ReflectanceBandwidth::new(phong, &Slices::ISOTROPIC));
    });
    println!("reflectance, isotropic: {:.1} ms", seconds * 1e3);
    let seconds = best(3, || {
        black_box(ReflectanceBandwidth::new(phong, &Slices::ANISOTROPIC));
    });
    println!("reflectance, with a grain: {:.1} ms", seconds * 1e3);
    let mut bytes = 0;
    let seconds = best(3, || {
        bytes = black_box(ImportanceTable::new(phong, TableSize::default())).memory_bytes();
    });
    println!("importance table: {:.1} ms, {:.1} MB", seconds * 1e3, bytes as f64 * 1e-6);
    let map = RgbImage::from_fn(512, 256, |x, y| [x as f32, y as f32, 1.0]);
    let seconds = best(3, || {
        bytes = black_box(Preconvolved::new(&map)).memory_bytes();
    });
    println!("environment 512 x 256 convolved: {:.1} ms, {:.1} MB", seconds * 1e3, bytes as f64 * 1e-6);
}
