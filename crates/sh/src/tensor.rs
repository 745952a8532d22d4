//! The tripling tensor `Γ_ijk = ∫ y_i y_j y_k`, computed in f64 by quadrature that is exact for it.
//!
//! The integral splits into one over azimuth and one over height. Where the azimuthal part is not zero, the powers of
//! sin t add up to an even number and the rest is a polynomial of degree at most 3(order − 1), which 16 Gauss nodes
//! integrate exactly up to order 8. This file is also compiled into the build script.

use std::f64::consts::PI;

use super::legendre::{gauss_legendre, reduced_column};

/// One entry with i ≤ j ≤ k; all permutations of the indices have the same value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Entry {
    pub(crate) i: usize,
    pub(crate) j: usize,
    pub(crate) k: usize,
    pub(crate) value: f64,
}

/// Band and m of a coefficient.
pub(crate) fn band_and_m(index: usize) -> (usize, i32) {
    let l = index.isqrt();
    (l, index as i32 - (l * l + l) as i32)
}

/// All entries that are not zero with i ≤ j ≤ k, in lexicographic order.
pub(crate) fn tripling_entries(order: usize) -> Vec<Entry> {
    let nodes = gauss_legendre(16);
    // columns[node][m] = Ñ_l^m(x)/(1−x²)^(m/2) for l = m ..
    let columns: Vec<Vec<Vec<f64>>> =
        nodes.iter().map(|&(x, _)| (0..order).map(|m| reduced_column(order, m, x)).collect()).collect();
    // A trigonometric polynomial of degree at most 21, summed at 64 places.
    let wave = |m: i32, step: usize| {
        let angle = 2.0 * PI * step as f64 / 64.0 * f64::from(m.abs());
        if m < 0 { angle.sin() } else { angle.cos() }
    };
    let n = order * order;
    let mut entries = Vec::new();
    for i in 0..n {
        for j in i..n {
            for k in j..n {
                let ((li, mi), (lj, mj), (lk, mk)) = (band_and_m(i), band_and_m(j), band_and_m(k));
                if !(li + lj + lk).is_multiple_of(2) || lk > li + lj {
                    continue;
                }
                let around: f64 =
                    (0..64).map(|s| wave(mi, s) * wave(mj, s) * wave(mk, s)).sum::<f64>() * (2.0 * PI / 64.0);
                if around.abs() < 1e-10 {
                    continue;
                }
                let [a, b, c] = [mi, mj, mk].map(|m| m.unsigned_abs() as usize);
                let along: f64 = nodes
                    .iter()
                    .zip(&columns)
                    .map(|(&(x, w), column)| {
                        let power = (1.0 - x * x).powi((a + b + c) as i32 / 2);
                        w * power * column[a][li - a] * column[b][lj - b] * column[c][lk - c]
                    })
                    .sum();
                let value = around * along;
                if value.abs() > 1e-12 {
                    entries.push(Entry { i, j, k, value });
                }
            }
        }
    }
    entries
}
