//! Guided filters: light as a linear function of the guides of its place, fitted to the samples around it.
//!
//! Around pixel p the light is taken to be L_q = β₀ + β · (g_q − g_p), g the guides; β minimises
//! Σ_q w_q (ȳ_q − L_q)² + λ Σ_q w_q |β_i|² (i > 0), w_q = n_q exp(−½ dᵀ S d) of n_q samples whose mean is ȳ_q, and β₀ is the filtered
//! picture. An edge in the guides takes no width from the filter, however it is blurred: S is that of covariance without any
//! edge. It is regression of first order (Moon, Carr, Yoon 2014; Bitterli et al. 2016) with windows from covariance.
//!
//! Both halves of the samples have the same weights, so one matrix serves both; the estimate of each is linear in its samples alone.
//!
//! Cost: nine fused multiply-adds of sixteen lanes for each pixel of the window, and one Cholesky decomposition of 9 × 9.

use glam::{Vec2, Vec3};
use halflight_trace::Kernel;

use super::gather::Halves;
use super::guides::{GUIDES, Guides, NEARNESS};
use super::reconstruct::{REACH, Shape, Three, exponential};

/// 1, the guides, and the means of both halves: red, green, blue, and the same again; one lane is left.
pub(super) type Values = [f32; 16];
/// Unknowns: β₀ and one for each guide.
const TERMS: usize = 1 + GUIDES;
const MEANS: usize = TERMS;
/// λ: guides that vary by less than about 0.03 say nothing. (0.01 errs more by up to 18 %, 0.0001 less by up to 5 %.)
const RIDGE: f64 = 1e-3;
/// Standard deviation, in pixels, below which there is nothing to fit.
const NARROWEST: f32 = 0.5;

/// What the filter reads of each pixel, and its weight.
pub(super) fn values(pixels: &[Halves], guides: &[Guides]) -> Vec<(Values, f32)> {
    let of = |(pixel, guides): (&Halves, &Guides)| {
        let mut values = [0.0; 16];
        values[0] = 1.0;
        values[1..TERMS].copy_from_slice(guides);
        for (half, out) in pixel.half.iter().zip(values[MEANS..].chunks_exact_mut(3)) {
            for (out, mean) in out.iter_mut().zip(half.mean()) {
                *out = mean as f32;
            }
        }
        (values, pixel.both().samples as f32)
    };
    pixels.iter().zip(guides).map(of).collect()
}

/// A row of pixels, filtered.
pub(super) struct GuidedRow<'a> {
    pub(super) values: &'a [(Values, f32)],
    pub(super) shapes: &'a [Shape],
    /// Deviations are multiplied by it.
    pub(super) scale: f32,
    pub(super) size: [usize; 2],
    pub(super) y: usize,
    /// The share of all samples that the first half has.
    pub(super) first: f32,
    /// Whether a pixel is filtered.
    pub(super) wanted: &'a dyn Fn(usize) -> bool,
    pub(super) put: &'a mut dyn FnMut(usize, Three),
}

impl Kernel for GuidedRow<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { values, shapes, scale, size: [width, height], y, first, wanted, put } = self;
        for x in 0..width {
            if !wanted(x) {
                continue;
            }
            let shape = &shapes[x];
            let [a, b] = shape.deviations.map(|d| (d * scale).max(NARROWEST));
            let reach = (REACH * a.max(b)).ceil() as isize;
            let (p, q) = (0.5 / (a * a), 0.5 / (b * b));
            let (xs, ys) = (x as isize, y as isize);
            let (middle, _) = &values[y * width + x];
            let mut offset = [0.0; 16];
            offset[1..TERMS].copy_from_slice(&middle[1..TERMS]);
            let mut unit = [1.0; 16];
            unit[1 + NEARNESS] = 1.0 / middle[1 + NEARNESS].max(1e-6);
            let mut sums = [[0.0f32; 16]; TERMS];
            let Vec2 { x: cos, y: sin } = shape.axis;
            for v in (ys - reach).max(0)..(ys + reach + 1).min(height as isize) {
                let row = &values[v as usize * width..][..width];
                let dy = (v - ys) as f32;
                for u in (xs - reach).max(0)..(xs + reach + 1).min(width as isize) {
                    let dx = (u - xs) as f32;
                    let (along, across) = (dx * cos + dy * sin, dx * sin - dy * cos);
                    let exponent = p * along * along + q * across * across;
                    if exponent > 0.5 * REACH * REACH {
                        continue;
                    }
                    let (values, count) = &row[u as usize];
                    let weight = exponential(exponent) * count;
                    let mut here = [0.0; 16];
                    for lane in 0..16 {
                        here[lane] = (values[lane] - offset[lane]) * unit[lane];
                    }
                    for term in 0..TERMS {
                        let weighted = weight * here[term];
                        for lane in 0..16 {
                            sums[term][lane] += weighted * here[lane];
                        }
                    }
                }
            }
            let fitted = solve(&sums);
            let half = |at: usize| Vec3::new(fitted[at], fitted[at + 1], fitted[at + 2]).max(Vec3::ZERO);
            let (one, other) = (half(0), half(3));
            put(x, [one, other, one * first + other * (1.0 - first)]);
        }
    }
}

/// β₀ of each of the six means, from the weighted sums of products of all terms with all values.
fn solve(sums: &[[f32; 16]; TERMS]) -> [f32; 6] {
    let ridge = RIDGE * f64::from(sums[0][0]);
    if ridge <= 0.0 {
        return [0.0; 6];
    }
    // M = L Lᵀ, last term first: β₀ then comes from the forward substitution alone.
    let term = |i: usize| TERMS - 1 - i;
    let mut l = [[0.0f64; TERMS]; TERMS];
    let mut z = [[0.0f64; 6]; TERMS];
    for i in 0..TERMS {
        for j in 0..=i {
            let mut sum = f64::from(sums[term(i)][term(j)]);
            if i == j && term(i) > 0 {
                sum += ridge;
            }
            for k in 0..j {
                sum -= l[i][k] * l[j][k];
            }
            l[i][j] = if i == j { sum.max(1e-9 * ridge).sqrt() } else { sum / l[j][j] };
        }
        for c in 0..6 {
            let mut sum = f64::from(sums[term(i)][MEANS + c]);
            for k in 0..i {
                sum -= l[i][k] * z[k][c];
            }
            z[i][c] = sum / l[i][i];
        }
    }
    let last = TERMS - 1;
    z[last].map(|value| (value / l[last][last]) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_linear_in_the_guides_is_found_exactly_but_for_the_ridge_and_both_halves_stay_apart() {
        // y = 2 + 3 g₀ − g₄ at g = 0 is 2; the other half is 5 everywhere.
        let mut sums = [[0.0f32; 16]; TERMS];
        for k in 0..200u32 {
            let number = |salt: u32| ((k * 7919 + salt * 104_729) % 1009) as f32 / 504.5 - 1.0;
            let mut v = [0.0; 16];
            v[0] = 1.0;
            (0..GUIDES).for_each(|g| v[1 + g] = number(g as u32));
            let y = 2.0 + 3.0 * v[1] - v[5];
            v[MEANS..MEANS + 6].copy_from_slice(&[y, y, y, 5.0, 5.0, 5.0]);
            for i in 0..TERMS {
                (0..16).for_each(|lane| sums[i][lane] += v[i] * v[lane]);
            }
        }
        let found = solve(&sums);
        assert!((found[0] - 2.0).abs() < 5e-3 && (found[3] - 5.0).abs() < 1e-3, "{found:?}");
        // Guides that say nothing leave the mean.
        for row in &mut sums {
            row[1..TERMS].fill(0.0);
        }
        sums[1..].fill([0.0; 16]);
        assert!((solve(&sums)[0] - sums[0][MEANS] / sums[0][0]).abs() < 1e-5);
        assert_eq!(solve(&[[0.0; 16]; TERMS]), [0.0; 6]);
    }
}
