//! Bandwidth around each texel.

use glam::Vec2;
use halflight_image::Plane;
use rayon::prelude::*;

use super::filter::Border;
use super::pyramid::{Level, Pyramid, inside};
use super::rule::{NEGLIGIBLE_CONTRAST, Rule, TAIL, upper_end};

/// Octaves whose cells are small enough to belong to a texel without question.
pub(super) const FINE_LEVELS: usize = 4;

/// Texels across a cell of the coarsest of these: the grain in which the variance around a texel is known.
pub const NEIGHBOURHOOD: usize = 1 << FINE_LEVELS;

/// More octaves than any picture that fits in memory has.
const MOST_OCTAVES: usize = 40;

/// Bandwidth around every texel, in cycles per unit, where `unit_per_texel(x, y)` is the size of texel (x, y) in that unit
/// (radians, metres) across and down. A texel of no size has no frequency of its own to offer: that direction is left out.
///
/// Each octave takes the scale in the middle of its own cell: near the pole of a latitude–longitude map the coarse octaves
/// hold power from far below, which must not be read at the scale of the narrow texels above.
///
/// All texels of a block of 2 × 2 share one value, as they do in the finest octave.
#[must_use]
pub fn local_bandwidth(
    pyramid: &Pyramid,
    rule: Rule,
    unit_per_texel: impl Fn(usize, usize) -> Vec2 + Sync,
) -> Plane {
    let (w, h) = (pyramid.width, pyramid.height);
    let mut values = vec![0.0; w * h];
    if pyramid.levels.is_empty() {
        return Plane { width: w, height: h, values };
    }
    let real = real_share(pyramid);
    values.par_chunks_mut(2 * w).enumerate().for_each(|(row, out)| {
        for cell in 0..w.div_ceil(2) {
            let frequency = around(pyramid, &real, cell, row, rule, &unit_per_texel);
            for line in out.chunks_mut(w) {
                let end = (2 * cell + 2).min(w);
                line[2 * cell..end].fill(frequency);
            }
        }
    });
    Plane { width: w, height: h, values }
}

/// How much of the power of the coarse octaves over a neighbourhood is really there: at most its variance with the four
/// cells around it in each direction.
fn real_share(pyramid: &Pyramid) -> Plane {
    let coarse = &pyramid.coarse;
    let (w, h) = (coarse.width, coarse.height);
    let share = |i: usize| {
        let (x, y) = (i % w, i / w);
        let claimed: f32 = pyramid
            .levels
            .iter()
            .enumerate()
            .skip(FINE_LEVELS)
            .map(|(k, level)| {
                let at = cell(level, x >> (k + 1 - FINE_LEVELS), y >> (k + 1 - FINE_LEVELS));
                level.across[at] + level.down[at]
            })
            .sum();
        let (mut sum, mut square, mut n) = (0.0, 0.0, 0.0);
        let centre = coarse.values[i];
        for dy in -2..=2isize {
            for dx in -2..=2isize {
                let x = inside(x as isize + dx, w, pyramid.border != Border::Repeat);
                let y = inside(y as isize + dy, h, pyramid.border == Border::Wrap);
                let value = coarse.values[y * w + x] - centre;
                sum += value;
                square += value * value;
                n += 1.0;
            }
        }
        let variance: f32 = (square - sum * sum / n) / n;
        if claimed > 0.0 { (variance / claimed).clamp(0.0, 1.0) } else { 1.0 }
    };
    Plane { width: w, height: h, values: (0..w * h).map(share).collect() }
}

#[inline]
fn cell(level: &Level, x: usize, y: usize) -> usize {
    y.min(level.height - 1) * level.width + x.min(level.width - 1)
}

/// The frequency above which [`TAIL`] of the power around a cell of the finest octave lies.
#[inline]
fn around(
    pyramid: &Pyramid,
    real: &Plane,
    x: usize,
    y: usize,
    rule: Rule,
    unit_per_texel: &impl Fn(usize, usize) -> Vec2,
) -> f32 {
    let count = pyramid.levels.len().min(MOST_OCTAVES);
    let mut across = [0.0f32; MOST_OCTAVES];
    let mut down = [0.0f32; MOST_OCTAVES];
    let mut frequency = [Vec2::ZERO; MOST_OCTAVES];
    let mut total = 0.0;
    let share = {
        let shift = FINE_LEVELS - 1;
        let (x, y) = ((x >> shift).min(real.width - 1), (y >> shift).min(real.height - 1));
        real.values[y * real.width + x]
    };
    for (k, level) in pyramid.levels.iter().enumerate().take(count) {
        let at = cell(level, x >> k, y >> k);
        let share = if k < FINE_LEVELS { 1.0 } else { share };
        let centre = |at: usize, size: usize| (((2 * (at >> k)) + 1) << k).min(size - 1);
        let texel = unit_per_texel(centre(x, pyramid.width), centre(y, pyramid.height));
        let of = |unit: f32| if unit > 0.0 { upper_end(k) / unit } else { 0.0 };
        frequency[k] = Vec2::new(of(texel.x), of(texel.y));
        across[k] = if texel.x > 0.0 { level.across[at] * share } else { 0.0 };
        down[k] = if texel.y > 0.0 { level.down[at] * share } else { 0.0 };
        total += across[k] + down[k];
    }
    let (cx, cy) = {
        let shift = FINE_LEVELS - 1;
        ((x >> shift).min(pyramid.coarse.width - 1), (y >> shift).min(pyramid.coarse.height - 1))
    };
    let contrast = NEGLIGIBLE_CONTRAST * pyramid.coarse.values[cy * pyramid.coarse.width + cx];
    if total <= contrast * contrast {
        return 0.0;
    }
    // Both lists fall in frequency: merge them from the top.
    let tail = TAIL * total;
    let mut needed = tail;
    let (mut i, mut j) = (0, 0);
    let mut last = 0.0;
    while i < count || j < count {
        let horizontal = if i < count { frequency[i].x } else { -1.0 };
        let vertical = if j < count { frequency[j].y } else { -1.0 };
        let (upper, power) = if horizontal == vertical {
            (i, j) = (i + 1, j + 1);
            (horizontal, across[i - 1] + down[j - 1])
        } else if horizontal > vertical {
            i += 1;
            (horizontal, across[i - 1])
        } else {
            j += 1;
            (vertical, down[j - 1])
        };
        if power > 0.0 && power >= needed {
            return rule.frequency(upper, needed, power, tail);
        }
        needed -= power;
        last = if upper > 0.0 { upper } else { last };
    }
    last
}
