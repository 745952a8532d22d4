//! One convolution: for each row of the result, the rows of the source within the lobe, each by a kernel of the difference
//! in longitude.

use std::f32::consts::{PI, TAU};

use halflight_image::RgbImage;
use rayon::prelude::*;

/// The lobe is cut where it has fallen to this share of its peak; what remains is normalized.
const CUT: f32 = 1e-3;

/// `source` convolved with max(cos, 0)^exponent, normalized.
pub(super) fn phong(source: &RgbImage, exponent: f32) -> RgbImage {
    let (w, h) = (source.width, source.height);
    let (width, height) = (w, h);
    // The source was averaged over texels of variance h²/12 in each direction, and bilinear look-ups widen by as much at
    // a half (by nothing at texels, by h²/4 between them); the lobe has 1/α.
    let texel = PI / h as f32;
    let exponent = 1.0 / (1.0 / exponent - texel * texel / 6.0);
    let least_cos = CUT.powf(1.0 / exponent);
    let reach = least_cos.acos();
    // Rows of one channel each, repeated at both ends so that kernels need no wrapping.
    let channels: Vec<Vec<f32>> = (0..3)
        .map(|c| {
            let row = |y: usize| (0..3 * w).map(move |x| source.pixels[y * w + x % w][c]);
            (0..h).flat_map(row).collect()
        })
        .collect();
    let mut pixels = vec![[0.0; 3]; width * height];
    pixels.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let theta = PI * (y as f32 + 0.5) / height as f32;
        let mut kernel = Vec::with_capacity(w);
        let mut sums = vec![[0.0f32; 3]; width];
        let mut total = 0.0;
        for row in 0..h {
            let other = PI * (row as f32 + 0.5) / h as f32;
            if (other - theta).abs() > reach + PI / h as f32 {
                continue;
            }
            let solid = (PI * row as f32 / h as f32).cos() - (PI * (row + 1) as f32 / h as f32).cos();
            let (along, across) = (theta.cos() * other.cos(), theta.sin() * other.sin());
            let weight = |k: usize| {
                let cos = along + across * (TAU * k as f32 / w as f32).cos();
                if cos > least_cos { solid * cos.powf(exponent) } else { 0.0 }
            };
            kernel.clear();
            kernel.extend((0..=w / 2).map(weight).take_while(|&k| k > 0.0));
            if kernel.is_empty() {
                continue;
            }
            if kernel.len() == w / 2 + 1 {
                // The far side is one column, seen from both.
                kernel[w / 2] *= 0.5;
            }
            total += 2.0 * kernel.iter().sum::<f32>() - kernel[0];
            // Both sides in one run, left to right.
            let reversed: Vec<f32> = kernel.iter().skip(1).rev().chain(&kernel).copied().collect();
            for (c, channel) in channels.iter().enumerate() {
                let line = &channel[row * 3 * w..(row + 1) * 3 * w];
                for (x, sums) in sums.iter_mut().enumerate() {
                    let first = w + x + 1 - kernel.len();
                    sums[c] += dot(&reversed, &line[first..first + reversed.len()]);
                }
            }
        }
        for (out, sums) in out.iter_mut().zip(&sums) {
            *out = sums.map(|s| if total > 0.0 { s / total } else { 0.0 });
        }
    });
    RgbImage { width, height, pixels }
}

/// Eight partial sums, so that the compiler may use wide registers.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    let (a, b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f32 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f32>() + rest
}
