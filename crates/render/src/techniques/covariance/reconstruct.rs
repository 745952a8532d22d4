//! From samples to a picture: anisotropic Gaussian filters, as wide as covariance allows and no wider than samples bear out.
//!
//! The widest filter of a pixel is exp(−½ dᵀ S d) with S = 4π² [(Σ⁻¹)_xx]⁻¹ at the film; it is tried at some scales ≤ 1, the
//! smallest being no filter at all. Samples weigh the same wherever they are, weights are normalised. Which scale is right
//! the samples say: with halves a and b, E (F[a] − b)² is the squared error of F[a] plus a variance of b that is the same for
//! all scales. Its local mean picks the scale; so as samples grow the bias decides, and the picture goes to the truth.
//!
//! Cost: one gather over two and a half standard deviations for all scales.

use glam::{Vec2, Vec3};
use halflight_trace::{Kernel, Simd};
use rayon::prelude::*;

use super::allocate::FLOOR;
use super::gather::Halves;

/// Scales of the widest filter, as standard deviations; the first is none. Each is √½ of the next, so that its weights are the
/// squares of the next one's.
pub(super) const SCALES: [f32; 5] = [0.0, 0.353_553_4, 0.5, std::f32::consts::FRAC_1_SQRT_2, 1.0];
/// A filter ends after so many standard deviations.
const REACH: f32 = 2.5;
/// Standard deviation over which errors are averaged before they are compared, pixels, from least to most, and what it is
/// times the root of the samples: many samples tell edges by themselves that nobody has foretold.
const JUDGE: [f32; 2] = [1.2, 3.5];
const JUDGE_AT_ONE: f32 = 10.0;

/// A filtered picture.
pub(super) struct Picture {
    pub(super) radiance: Vec<Vec3>,
    /// The scale of the filter of each pixel, 0 to 1.
    pub(super) scale: Vec<f32>,
}

/// The shape of a filter in pixels: principal axis and standard deviations.
#[derive(Clone, Copy)]
pub(super) struct Shape {
    axis: Vec2,
    pub(super) deviations: [f32; 2],
}

impl Shape {
    /// From S, with deviations of at most `widest`.
    pub(super) fn new([xx, xy, yy]: [f32; 3], widest: f32) -> Self {
        let (mean, half) = (0.5 * (xx + yy), (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt());
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let axis = if angle.is_finite() { Vec2::from_angle(angle) } else { Vec2::X };
        // S is large along the first axis: the filter is narrow there.
        let deviation = |s: f32| {
            let wide = 1.0 / s.max(0.0).sqrt();
            if wide.is_nan() { 0.0 } else { wide.min(widest) }
        };
        Self { axis, deviations: [deviation(mean + half), deviation(mean - half)] }
    }

    /// Pixels that a filter of this scale takes together.
    pub(super) fn area(&self, scale: f32) -> f32 {
        let [a, b] = self.deviations.map(|d| (d * scale).max(0.28));
        (4.0 * std::f32::consts::PI * a * b).max(1.0)
    }
}

/// Sums of the samples of both halves: red, green, blue, count, and the same again.
type Sums = [f32; 8];

/// A picture by each half and by both.
type Three = [Vec3; 3];

/// The filtered picture of the halves, rows from the top.
pub(super) fn reconstruct(
    pixels: &[Halves],
    shapes: &[Shape],
    [width, height]: [usize; 2],
    simd: Simd,
) -> Picture {
    let halves: Vec<Sums> = pixels
        .par_iter()
        .map(|pixel| {
            let [a, b] = pixel.half.map(|half| (half.sum.map(|s| s as f32), half.samples as f32));
            [a.0[0], a.0[1], a.0[2], a.1, b.0[0], b.0[1], b.0[2], b.1]
        })
        .collect();
    let size = [width, height];
    let mut filtered: Vec<[Three; SCALES.len()]> = vec![[[Vec3::ZERO; 3]; SCALES.len()]; pixels.len()];
    filtered.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        simd.run(Row { halves: &halves, shapes: &shapes[y * width..(y + 1) * width], size, y, out });
    });
    let count: f64 = halves.iter().map(|s| f64::from(s[3] + s[7])).sum();
    let mean = (count / halves.len().max(1) as f64).max(1.0) as f32;
    let judge = (JUDGE_AT_ONE / mean.sqrt()).clamp(JUDGE[0], JUDGE[1]);
    let errors: Vec<Vec<f32>> = (0..SCALES.len())
        .map(|scale| {
            let squared =
                halves.par_iter().zip(&filtered).map(|(halves, all)| squared_error(halves, all, scale));
            smoothed(&squared.collect::<Vec<f32>>(), size, judge)
        })
        .collect();
    let mut radiance = vec![Vec3::ZERO; pixels.len()];
    let mut scale = vec![0.0; pixels.len()];
    let chosen: Vec<usize> = (0..pixels.len())
        .map(|i| (1..SCALES.len()).fold(0, |best, k| if errors[k][i] < errors[best][i] { k } else { best }))
        .collect();
    for i in 0..pixels.len() {
        // The choices of neighbours are mixed, so that filters change gently.
        let (x, y) = (i % width, i / width);
        let mut weights = [0.0f32; SCALES.len()];
        for v in y.saturating_sub(1)..=(y + 1).min(height - 1) {
            for u in x.saturating_sub(1)..=(x + 1).min(width - 1) {
                weights[chosen[v * width + u]] += 1.0;
            }
        }
        let total: f32 = weights.iter().sum();
        for (k, weight) in weights.into_iter().enumerate() {
            radiance[i] += filtered[i][k][2] * (weight / total);
            scale[i] += SCALES[k] * weight / total;
        }
    }
    Picture { radiance, scale }
}

/// A row of pixels, filtered.
struct Row<'a> {
    halves: &'a [Sums],
    shapes: &'a [Shape],
    size: [usize; 2],
    y: usize,
    out: &'a mut [[Three; SCALES.len()]],
}

impl Kernel for Row<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { halves, shapes, size: [width, height], y, out } = self;
        for x in 0..width {
            let shape = &shapes[x];
            let own = &halves[y * width + x];
            let [a, b] = shape.deviations;
            let reach = (REACH * a.max(b)).ceil() as isize;
            let (p, q) = (0.5 / (a * a).max(0.02), 0.5 / (b * b).max(0.02));
            let (xs, ys) = (x as isize, y as isize);
            let mut sums = [[0.0f32; 8]; SCALES.len()];
            sums[0] = *own;
            if a.max(b) < 0.2 {
                sums = [*own; SCALES.len()];
            } else {
                for v in (ys - reach).max(0)..=(ys + reach).min(height as isize - 1) {
                    let row = &halves[v as usize * width..];
                    for u in (xs - reach).max(0)..=(xs + reach).min(width as isize - 1) {
                        let d = Vec2::new((u - xs) as f32, (v - ys) as f32);
                        let (along, across) = (d.dot(shape.axis), d.perp_dot(shape.axis));
                        let exponent = p * along * along + q * across * across;
                        if exponent > 0.5 * REACH * REACH {
                            continue;
                        }
                        let values = &row[u as usize];
                        let mut weight = exponential(exponent);
                        for step in 1..SCALES.len() {
                            let k = SCALES.len() - step;
                            for c in 0..8 {
                                sums[k][c] += weight * values[c];
                            }
                            weight *= weight;
                        }
                    }
                }
            }
            for k in 0..SCALES.len() {
                out[x][k] = means(&sums[k]);
            }
        }
    }
}

/// exp(−x) for 0 ≤ x ≤ 4, to 1e-3 of itself: the sixteenth power of a short series.
#[inline(always)]
fn exponential(x: f32) -> f32 {
    // e^(−x/16) = 1 − y + y²/2 − y³/6, y ≤ ¼.
    let y = x * (1.0 / 16.0);
    let e = 1.0 - y * (1.0 - y * (0.5 - y * (1.0 / 6.0)));
    let e2 = e * e;
    let e4 = e2 * e2;
    let e8 = e4 * e4;
    e8 * e8
}

#[inline(always)]
fn means(s: &Sums) -> Three {
    let mean = |at: usize| Vec3::new(s[at], s[at + 1], s[at + 2]) / s[at + 3].max(1e-12);
    let both = Vec3::new(s[0] + s[4], s[1] + s[5], s[2] + s[6]) / (s[3] + s[7]).max(1e-12);
    [mean(0), mean(4), both]
}

/// (F[a] − b)² and (F[b] − a)², relative to the light there: that of the widest filter, the same for all, or a bright outlier
/// would excuse itself.
fn squared_error(halves: &Sums, all: &[Three; SCALES.len()], scale: usize) -> f32 {
    let [a, b, _] = means(halves);
    let [fa, fb, _] = all[scale];
    let error = (fa - b).length_squared() + (fb - a).length_squared();
    error / (all[SCALES.len() - 1][2].length_squared() + FLOOR)
}

/// Local means.
fn smoothed(values: &[f32], [width, height]: [usize; 2], judge: f32) -> Vec<f32> {
    let reach = (2.5 * judge).ceil() as isize;
    let kernel: Vec<f32> = (-reach..=reach).map(|d| (-0.5 * (d as f32 / judge).powi(2)).exp()).collect();
    let pass = |values: &[f32], across: bool| {
        let mut result = vec![0.0; values.len()];
        result.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let (mut sum, mut total) = (0.0, 0.0);
                for (k, weight) in kernel.iter().enumerate() {
                    let d = k as isize - reach;
                    let (u, v) =
                        if across { (x as isize + d, y as isize) } else { (x as isize, y as isize + d) };
                    if u >= 0 && v >= 0 && u < width as isize && v < height as isize {
                        let value = values[v as usize * width + u as usize];
                        sum += weight * value;
                        total += weight;
                    }
                }
                *out = sum / total;
            }
        });
        result
    };
    pass(&pass(values, true), false)
}
