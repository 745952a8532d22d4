//! The table of optimal-linear coefficients.
//!
//! `exp f̂ ≈ a 1 + b f̂` with `a = ⟨exp f̂, 1⟩/4π` and `b = ⟨exp f̂, f̂⟩/⟨f̂, f̂⟩` (\[004\]), as the median over random sets of
//! blockers whose log-visibility is scaled to each |f̂|. The spread of a at one |f̂| is 1 % at 2, 6 % at 4 and 25 % at 8:
//! that is why the linear form alone is poor.

use std::sync::OnceLock;

use crate::eigen::symmetric;
use crate::sh::SQRT_4PI;
use crate::study::BlockerSet;
use crate::{BlockerTable, Sh};

/// Steps of the table for each unit of |f̂|.
const STEPS: usize = 4;
/// Where the table ends.
const LAST: usize = 8;

/// (a, b) at a norm of f̂, for an order from 1 to 8. Beyond |f̂| = 8 they stay as they are there.
///
/// The table of an order is computed at its first use: a fraction of a second at orders up to 5, seconds at 8.
#[must_use]
pub fn optimal_linear(order: usize, norm: f32) -> (f32, f32) {
    static TABLES: [OnceLock<Vec<(f32, f32)>>; 8] = [const { OnceLock::new() }; 8];
    let table = TABLES[order.clamp(1, 8) - 1].get_or_init(|| match order {
        0..=1 => vec![(1.0, 1.0); LAST * STEPS + 1],
        2 => table::<2>(),
        3 => table::<3>(),
        4 => table::<4>(),
        5 => table::<5>(),
        6 => table::<6>(),
        7 => table::<7>(),
        _ => table::<8>(),
    });
    let place = (norm * STEPS as f32).clamp(0.0, (LAST * STEPS) as f32);
    let below = (place as usize).min(LAST * STEPS - 1);
    let t = place - below as f32;
    let ((a0, b0), (a1, b1)) = (table[below], table[below + 1]);
    (a0 + (a1 - a0) * t, b0 + (b1 - b0) * t)
}

fn table<const ORDER: usize>() -> Vec<(f32, f32)> {
    let blockers = BlockerTable::<ORDER>::new();
    let sets = [
        BlockerSet::Small(5),
        BlockerSet::Small(50),
        BlockerSet::Small(400),
        BlockerSet::Large(1),
        BlockerSet::Large(10),
        BlockerSet::Large(25),
        BlockerSet::Huge(1),
        BlockerSet::Huge(5),
        BlockerSet::Body(10),
        BlockerSet::Body(50),
        BlockerSet::Body(400),
    ];
    let mut samples = vec![Vec::new(); LAST * STEPS + 1];
    for set in sets {
        for seed in 0..3 {
            let mut f: Sh<ORDER, f64> =
                set.caps(seed).iter().map(|cap| blockers.log_visibility(cap).cast()).sum();
            f[0] = 0.0;
            f *= 1.0 / f.norm();
            for (step, found) in coefficients(&f).into_iter().enumerate() {
                samples[step].push(found);
            }
        }
    }
    samples
        .into_iter()
        .map(|found| {
            let median = |mut values: Vec<f64>| {
                values.sort_by(f64::total_cmp);
                values[values.len() / 2] as f32
            };
            (median(found.iter().map(|x| x.0).collect()), median(found.iter().map(|x| x.1).collect()))
        })
        .collect()
}

/// (a, b) of s·f for every step s of the table: one decomposition serves all, since scaling f scales its eigenvalues.
fn coefficients<const ORDER: usize>(f: &Sh<ORDER, f64>) -> Vec<(f64, f64)> {
    let n = ORDER * ORDER;
    let matrix = f.product_matrix();
    let (values, vectors) = symmetric((0..n * n).map(|at| matrix.row(at / n)[at % n]).collect(), n);
    let along: Vec<f64> = (0..n).map(|k| (0..n).map(|i| vectors[i * n + k] * f[i]).sum::<f64>()).collect();
    (0..=LAST * STEPS)
        .map(|step| {
            let s = step as f64 / STEPS as f64;
            if step == 0 {
                return (1.0, 1.0);
            }
            let e = |k: usize| (s * values[k]).exp() * vectors[k];
            let a = (0..n).map(|k| e(k) * vectors[k]).sum::<f64>();
            let b = SQRT_4PI * (0..n).map(|k| e(k) * along[k]).sum::<f64>() / s;
            (a, b)
        })
        .collect()
}
