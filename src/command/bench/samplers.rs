//! How much sooner the sampler's numbers converge than independent ones.
//!
//! Each of 4096 pixels estimates two integrals over the unit square whose values are known: a smooth one, and a disk,
//! which has an edge as shadows have. Reported is the root of the mean squared error over the pixels.

use halflight_render::sampler::Sampler;

use super::clock;
use super::{BenchArgs, Findings};
use crate::command::table::Table;
use crate::command::words;

/// Pixels of a side of the square that is averaged over.
const SIDE: u32 = 64;
/// The seed of the second sampler, of which each sample of each pixel takes only the first.
const OTHER_SEED: u64 = 99;

pub(super) fn measure(args: &BenchArgs) -> Findings {
    let counts: &[u32] = if args.quick { &[4, 16] } else { &[1, 4, 16, 64, 256] };
    let mut table = Table::new([
        "samples",
        "smooth",
        "smooth, independent",
        "smooth gain",
        "disk",
        "disk, independent",
        "disk gain",
    ]);
    for &count in counts {
        let mut cells = vec![count.to_string()];
        for (integrand, truth) in [(smooth as fn(f32, f32) -> f32, SMOOTH), (disk, DISK)] {
            let errors = [stratified, independent].map(|sampler| rms(sampler, integrand, truth, count));
            cells.extend(errors.map(words::figure));
            cells.push(format!("{:.1}×", errors[1] / errors[0]));
        }
        table.row(cells);
    }
    let draws = 1 << 16;
    let timing = clock::time(if args.quick { 0.02 } else { 0.3 }, || {
        let sum: f32 = (0..draws).map(|s| Sampler::new(1, s & 63, s >> 10, s & 255).next_four()[0]).sum();
        std::hint::black_box(sum);
    });
    let notes = vec![
        format!("root mean squared error over {} pixels", SIDE * SIDE),
        format!("four numbers cost {:.1} ns of processor time", 1e9 * timing.cpu / f64::from(draws)),
    ];
    Findings { title: "Sampler", table, notes }
}

fn stratified(x: u32, y: u32, sample: u32) -> [f32; 4] {
    Sampler::new(0, x, y, sample).next_four()
}

fn independent(x: u32, y: u32, sample: u32) -> [f32; 4] {
    Sampler::new(OTHER_SEED + u64::from(sample), x, y, 0).next_four()
}

/// ∫∫ cos(πx/2) cos(πy/2) = (2/π)².
const SMOOTH: f64 = 4.0 / (std::f64::consts::PI * std::f64::consts::PI);
/// The quarter of the unit disk.
const DISK: f64 = std::f64::consts::FRAC_PI_4;

fn smooth(x: f32, y: f32) -> f32 {
    let quarter = std::f32::consts::FRAC_PI_2;
    (x * quarter).cos() * (y * quarter).cos()
}

fn disk(x: f32, y: f32) -> f32 {
    f32::from(u8::from(x * x + y * y < 1.0))
}

fn rms(sampler: fn(u32, u32, u32) -> [f32; 4], f: fn(f32, f32) -> f32, truth: f64, count: u32) -> f64 {
    let mut sum = 0.0;
    for pixel in 0..SIDE * SIDE {
        let (x, y) = (pixel % SIDE, pixel / SIDE);
        let total: f64 = (0..count).map(|s| sampler(x, y, s)).map(|u| f64::from(f(u[0], u[1]))).sum();
        sum += (total / f64::from(count) - truth).powi(2);
    }
    (sum / f64::from(SIDE * SIDE)).sqrt()
}
