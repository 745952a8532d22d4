//! How many samples each pixel is to have: first as predicted, then as measured.
//!
//! The relative squared error of a picture whose pixel p has n_p samples of variance V_p, spread by a filter over A_p pixels, is
//! Σ V_p/(n_p A_p (L_p² + ε)); for a given sum of samples it is least with n_p ∝ √(V_p/(A_p (L_p² + ε))).
//!
//! V is predicted from few pilots: covariance tells the share of L² that lens, shutter and the pixel's own extent make samples
//! differ by, and over which pixels the rest (light, lobes, indirect light) may be pooled, as far as the widest filter goes. Each
//! pass then mixes in what its pixels have shown, weighted by samples.

use rayon::prelude::*;

use super::pilot::Forecast;
use crate::film::Pixel;

/// ε of the relative squared error, radiance².
pub(super) const FLOOR: f32 = 0.01;
/// Samples that the prediction counts for, beside measured ones.
const FAITH: f32 = 8.0;
/// Neighbours on each side that are pooled at most.
const REACH: isize = 9;
/// The part of L² that what varies within lens, shutter and pixel is taken to vary by, beside what the first samples show of it:
/// a contrast of a seventh. (0.1 and 0.4 rank pixels less well, by 0.13 and 0.4 for depth of field.)
const LENS: f32 = 0.02;
/// The least share of the mean number of samples that a pixel has.
const LEAST: f32 = 0.15;

/// What is known of each pixel, rows from the top.
pub(super) struct Known {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Standard deviation of one sample, relative: √(V/(L² + ε)).
    pub(super) predicted: Vec<f32>,
    pub(super) measured: Vec<f32>,
}

/// Variance of one sample, and mean, of luminance.
fn statistics(pixel: &Pixel) -> (f32, f32) {
    let n = f64::from(pixel.samples.max(1));
    let mean = pixel.sum.map(|s| s / n);
    let mean = 0.2126 * mean[0] + 0.7152 * mean[1] + 0.0722 * mean[2];
    let variance = (pixel.sum_squares / n - mean * mean).max(0.0) * n / (n - 1.0).max(1.0);
    (variance as f32, mean as f32)
}

/// Weights of neighbours within the widest filter, by its S.
fn pooled<T: Copy>(
    values: &[T],
    [width, height]: [usize; 2],
    i: usize,
    s: [f32; 3],
    mut add: impl FnMut(T, f32),
) {
    let (x, y) = ((i % width) as isize, (i / width) as isize);
    // Beyond it the weight is below e^(−4).
    let reach = ((8.0 / s[0].min(s[2])).sqrt() as isize).min(REACH);
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            let (u, v) = (x + dx, y + dy);
            if u < 0 || v < 0 || u >= width as isize || v >= height as isize {
                continue;
            }
            let (fx, fy) = (dx as f32, dy as f32);
            let q = s[0] * fx * fx + 2.0 * s[1] * fx * fy + s[2] * fy * fy;
            if q < 8.0 {
                add(values[v as usize * width + u as usize], (-0.5 * q).exp());
            }
        }
    }
}

impl Known {
    /// Before anything is known.
    pub(super) fn empty(width: usize, height: usize) -> Self {
        let nothing = vec![1.0; width * height];
        Self { width, height, predicted: nothing.clone(), measured: nothing }
    }

    /// From pilots' samples and what they foretell.
    pub(super) fn predict(pixels: &[Pixel], forecasts: &[Forecast], width: usize) -> Self {
        let height = pixels.len() / width.max(1);
        let statistics: Vec<(f32, f32)> = pixels.par_iter().map(statistics).collect();
        let predicted = (0..pixels.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                let (mut weight, mut mean, mut deviation) = (0.0, 0.0, 0.0);
                pooled(&statistics, [width, height], i, widened(forecasts[i].precision), |(v, m), w| {
                    weight += w;
                    mean += w * m;
                    // Of roots: one bright sample does not speak for all around it.
                    deviation += w * v.sqrt();
                });
                let (mean, deviation) = (mean / weight, deviation / weight);
                let lens = mean * mean * forecasts[i].varies;
                ((deviation * deviation + LENS * lens) / (mean * mean + FLOOR)).sqrt()
            })
            .collect();
        Self { width, height, predicted, measured: vec![0.0; pixels.len()] }
    }

    /// From all samples so far.
    pub(super) fn measure(&mut self, pixels: &[Pixel]) {
        let statistics: Vec<(f32, f32)> = pixels.par_iter().map(statistics).collect();
        let size = [self.width, self.height];
        self.measured = (0..pixels.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                // Single pixels of few samples often see no noise at all: their neighbours next to them help.
                let (mut weight, mut mean, mut within) = (0.0, 0.0, 0.0);
                pooled(&statistics, size, i, [2.0, 0.0, 2.0], |(v, m), w| {
                    weight += w;
                    mean += w * m;
                    within += w * v;
                });
                let mean = mean / weight;
                (within / weight / (mean * mean + FLOOR)).sqrt()
            })
            .collect();
    }

    /// Targets whose sum is about `total`, none below what a pixel has. `area` is A_p.
    pub(super) fn targets(&self, pixels: &[Pixel], area: &[f32], total: u64) -> Vec<u32> {
        let desire: Vec<f32> = (0..pixels.len())
            .map(|i| {
                let n = pixels[i].samples as f32;
                let (p, m) = (self.predicted[i], self.measured[i]);
                let deviation = ((FAITH * p * p + n * m * m) / (FAITH + n)).sqrt();
                let wanted = deviation / area[i].max(1.0).sqrt();
                if wanted.is_finite() { wanted } else { 0.0 }
            })
            .collect();
        let mean = desire.iter().map(|d| f64::from(*d)).sum::<f64>() / desire.len() as f64;
        if mean <= 0.0 {
            return vec![(total / pixels.len().max(1) as u64) as u32; pixels.len()];
        }
        let desire: Vec<f32> = desire.iter().map(|d| d.max(LEAST * mean as f32)).collect();
        // Pixels that have more than they should keep it; the others share what is left.
        let count = |scale: f64| -> u64 {
            let of = |(d, p): (&f32, &Pixel)| u64::from(p.samples.max((f64::from(*d) * scale) as u32));
            desire.iter().zip(pixels).map(of).sum()
        };
        let (mut low, mut high) = (0.0, 1.0);
        while count(high) < total && high < 1e12 {
            (low, high) = (high, high * 2.0);
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if count(middle) < total { low = middle } else { high = middle }
        }
        desire.iter().zip(pixels).map(|(d, p)| p.samples.max((f64::from(*d) * high) as u32)).collect()
    }
}

/// As far as the widest filter, and always over a deviation of two pixels: variances of four samples say too little alone. (Over
/// 0.8 pixels ranks agree less well, by 0.01 to 0.07.)
fn widened(s: [f32; 3]) -> [f32; 3] {
    let mean = (0.5 * (s[0] + s[2])).clamp(0.05, 0.25);
    [mean, 0.0, mean]
}
