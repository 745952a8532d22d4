//! From samples to a picture: anisotropic Gaussian filters, as wide as covariance allows and no wider than samples bear out.
//!
//! The widest filter of a pixel is exp(−½ dᵀ S d) with S = 4π² [(Σ⁻¹)_xx]⁻¹ at the film; it is tried at some scales ≤ 1, the
//! smallest being no filter at all. Samples weigh the same wherever they are, weights are normalised. Which scale is right
//! the samples say: with halves a and b, E (F[a] − b)² is the squared error of F[a] plus a variance of b that is the same for
//! all scales. Its local mean picks the scale; so as samples grow the bias decides, and the picture goes to the truth.
//!
//! Beside these, guided filters are tried (`regress`), which edges do not narrow.
//!
//! Cost: one gather over two and a half standard deviations for all scales.

use glam::{Vec2, Vec3};
use halflight_trace::{Kernel, Simd};
use rayon::prelude::*;

use super::allocate::FLOOR;
use super::gather::Halves;
use super::guides::Guides;
use super::regress::{self, GuidedRow};

/// Scales of the widest filter, as standard deviations; the first is none. Each is √½ of the next, so that its weights are the
/// squares of the next one's.
pub(super) const SCALES: [f32; 5] = [0.0, 0.353_553_4, 0.5, std::f32::consts::FRAC_1_SQRT_2, 1.0];
/// A filter ends after so many standard deviations.
pub(super) const REACH: f32 = 2.5;
/// Filters that are tried: the plain ones, three guided ones of the widest shape without edges, and one of that with them.
const TRIED: usize = SCALES.len() + 4;
const OPEN: [f32; 3] = [1.0, 0.5, 0.25];
const CLOSED: usize = TRIED - 1;
/// Standard deviation over which errors are averaged before they are compared, pixels, from least to most, and what it is
/// times the root of the samples: many samples tell edges by themselves that nobody has foretold.
const JUDGE: [f32; 2] = [1.2, 3.5];
const JUDGE_AT_ONE: f32 = 10.0;

/// A filtered picture.
pub(super) struct Picture {
    pub(super) radiance: Vec<Vec3>,
    /// The scale of the filter of each pixel, 0 to 1.
    pub(super) scale: Vec<f32>,
    /// The share of guided filters in it.
    pub(super) guided: Vec<f32>,
}

/// The shape of a filter in pixels: principal axis and standard deviations.
#[derive(Clone, Copy)]
pub(super) struct Shape {
    pub(super) axis: Vec2,
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

    /// Whether deviations are the same but for a twentieth.
    fn is_about(&self, other: &Self) -> bool {
        self.deviations.iter().zip(other.deviations).all(|(a, b)| (a - b).abs() <= 0.05 * b)
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
pub(super) type Three = [Vec3; 3];

/// What filters are made from, all of them rows from the top.
pub(super) struct Filters<'a> {
    /// The widest that covariance allows, and that which it would allow if there were no edges.
    pub(super) shapes: &'a [Shape],
    pub(super) open: &'a [Shape],
    pub(super) guides: &'a [Guides],
    pub(super) size: [usize; 2],
}

/// The filtered picture of the halves, rows from the top.
pub(super) fn reconstruct(pixels: &[Halves], filters: &Filters, simd: Simd) -> Picture {
    let Filters { shapes, open, guides, size } = *filters;
    let [width, height] = size;
    let halves: Vec<Sums> = pixels
        .par_iter()
        .map(|pixel| {
            let [a, b] = pixel.half.map(|half| (half.sum.map(|s| s as f32), half.samples as f32));
            [a.0[0], a.0[1], a.0[2], a.1, b.0[0], b.0[1], b.0[2], b.1]
        })
        .collect();
    let values = regress::values(pixels, guides);
    let total = |at: usize| halves.iter().map(|s| f64::from(s[at])).sum::<f64>();
    let first = (total(3) / (total(3) + total(7)).max(1e-12)) as f32;
    let mut filtered: Vec<[Three; TRIED]> = vec![[[Vec3::ZERO; 3]; TRIED]; pixels.len()];
    filtered.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let of_row = y * width..(y + 1) * width;
        let (shapes, open) = (&shapes[of_row.clone()], &open[of_row]);
        simd.run(Row { halves: &halves, shapes, size, y, out });
        let same = |x: usize| shapes[x].is_about(&open[x]);
        let mut guided = |shapes, scale, wanted: &dyn Fn(usize) -> bool, at: usize| {
            let put = &mut |x: usize, found| out[x][at] = found;
            simd.run(GuidedRow { values: &values, shapes, scale, size, y, first, wanted, put });
        };
        for (k, scale) in OPEN.into_iter().enumerate() {
            guided(open, scale, &|_| true, SCALES.len() + k);
        }
        guided(shapes, 1.0, &|x| !same(x), CLOSED);
        for x in (0..width).filter(|&x| same(x)) {
            out[x][CLOSED] = out[x][SCALES.len()];
        }
    });
    let count: f64 = halves.iter().map(|s| f64::from(s[3] + s[7])).sum();
    let mean = (count / halves.len().max(1) as f64).max(1.0) as f32;
    let judge = (JUDGE_AT_ONE / mean.sqrt()).clamp(JUDGE[0], JUDGE[1]);
    let errors: Vec<Vec<f32>> = (0..TRIED)
        .map(|tried| {
            let squared =
                halves.par_iter().zip(&filtered).map(|(halves, all)| squared_error(halves, all, tried));
            smoothed(&squared.collect::<Vec<f32>>(), size, judge)
        })
        .collect();
    let mut radiance = vec![Vec3::ZERO; pixels.len()];
    let (mut scale, mut guided) = (vec![0.0; pixels.len()], vec![0.0; pixels.len()]);
    let chosen: Vec<usize> = (0..pixels.len())
        .map(|i| (1..TRIED).fold(0, |best, k| if errors[k][i] < errors[best][i] { k } else { best }))
        .collect();
    for i in 0..pixels.len() {
        // The choices of neighbours are mixed, so that filters change gently.
        let (x, y) = (i % width, i / width);
        let mut weights = [0.0f32; TRIED];
        for v in y.saturating_sub(1)..=(y + 1).min(height - 1) {
            for u in x.saturating_sub(1)..=(x + 1).min(width - 1) {
                weights[chosen[v * width + u]] += 1.0;
            }
        }
        let total: f32 = weights.iter().sum();
        for (k, weight) in weights.into_iter().enumerate() {
            radiance[i] += filtered[i][k][2] * (weight / total);
            scale[i] += scale_of(k) * weight / total;
            if k >= SCALES.len() {
                guided[i] += weight / total;
            }
        }
    }
    Picture { radiance, scale, guided }
}

/// Of a filter that is tried, relative to its widest.
fn scale_of(tried: usize) -> f32 {
    match tried.checked_sub(SCALES.len()) {
        None => SCALES[tried],
        Some(guided) => OPEN.get(guided).copied().unwrap_or(1.0),
    }
}

/// A row of pixels, filtered.
struct Row<'a> {
    halves: &'a [Sums],
    shapes: &'a [Shape],
    size: [usize; 2],
    y: usize,
    out: &'a mut [[Three; TRIED]],
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
                let Vec2 { x: cos, y: sin } = shape.axis;
                for v in (ys - reach).max(0)..(ys + reach + 1).min(height as isize) {
                    let row = &halves[v as usize * width..][..width];
                    let dy = (v - ys) as f32;
                    for u in (xs - reach).max(0)..(xs + reach + 1).min(width as isize) {
                        let dx = (u - xs) as f32;
                        let (along, across) = (dx * cos + dy * sin, dx * sin - dy * cos);
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
pub(super) fn exponential(x: f32) -> f32 {
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
fn squared_error(halves: &Sums, all: &[Three; TRIED], tried: usize) -> f32 {
    let [a, b, _] = means(halves);
    let [fa, fb, _] = all[tried];
    let error = (fa - b).length_squared() + (fb - a).length_squared();
    error / (all[SCALES.len() - 1][2].length_squared() + FLOOR)
}

/// Local means.
fn smoothed(values: &[f32], [width, height]: [usize; 2], judge: f32) -> Vec<f32> {
    let reach = (2.5 * judge).ceil() as isize;
    let kernel: Vec<f32> = (-reach..=reach).map(|d| (-0.5 * (d as f32 / judge).powi(2)).exp()).collect();
    // Of the weights that lie within a line of so many.
    let totals = |count: usize| -> Vec<f32> {
        let within = |i: isize| (0..count as isize).contains(&i);
        let total = |at: usize| {
            let of = |(k, weight): (usize, &f32)| within(at as isize + k as isize - reach).then_some(*weight);
            kernel.iter().enumerate().filter_map(of).sum()
        };
        (0..count).map(total).collect()
    };
    let of_columns = totals(width);
    let of_rows = totals(height);
    let lines = |f: &(dyn Fn(usize, &mut [f32]) + Sync)| {
        let mut result = vec![0.0; values.len()];
        result.par_chunks_mut(width).enumerate().for_each(|(y, row)| f(y, row));
        result
    };
    let across = lines(&|y, row| {
        let from = &values[y * width..][..width];
        for (k, weight) in kernel.iter().enumerate() {
            let (skip, ahead) = ((reach as usize).saturating_sub(k), k.saturating_sub(reach as usize));
            for (out, value) in row.iter_mut().skip(skip).zip(from.iter().skip(ahead)) {
                *out += weight * value;
            }
        }
        row.iter_mut().zip(&of_columns).for_each(|(out, total)| *out /= total);
    });
    lines(&|y, row| {
        for (k, weight) in kernel.iter().enumerate() {
            let v = y as isize + k as isize - reach;
            if v < 0 || v >= height as isize {
                continue;
            }
            for (out, value) in row.iter_mut().zip(&across[v as usize * width..][..width]) {
                *out += weight * value;
            }
        }
        row.iter_mut().for_each(|out| *out /= of_rows[y]);
    })
}
