//! What the kernels cost: nanoseconds for each vector on one core.
//!
//! Each kernel runs over a small set that stays in the first cache, many times; the best of several runs counts, since
//! every disturbance only adds. *Single* calls handle one vector, *batched* ones sixteen for each block.
//!
//! `cargo run --release -p halflight-sh --example kernel_times` prints the table.

mod kernels;

use std::time::Instant;

use crate::{ShError, Simd};

/// One line of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct KernelTime {
    /// What was called.
    pub kernel: &'static str,
    /// Whether sixteen vectors went side by side.
    pub batched: bool,
    /// Order of the vectors.
    pub order: usize,
    /// Nanoseconds for each vector (blocker, for the last).
    pub nanoseconds: f64,
    /// What it should not exceed, stated at order 4.
    pub goal: Option<f64>,
}

/// Times every kernel at an order from 3 to 6: the best of `runs` runs of about a millisecond each.
///
/// # Errors
/// Another order.
pub fn measure(order: usize, simd: Simd, runs: usize) -> Result<Vec<KernelTime>, ShError> {
    Ok(match order {
        3 => kernels::all::<3>(simd, runs),
        4 => kernels::all::<4>(simd, runs),
        5 => kernels::all::<5>(simd, runs),
        6 => kernels::all::<6>(simd, runs),
        _ => return Err(ShError::Order { order }),
    })
}

/// Nanoseconds for each of the `items` that one call of `work` handles.
fn best(runs: usize, items: usize, mut work: impl FnMut()) -> f64 {
    let mut time = |calls: usize| {
        let begun = Instant::now();
        for _ in 0..calls {
            work();
        }
        begun.elapsed().as_secs_f64()
    };
    // Calls that fill a millisecond.
    let mut calls = 1;
    while time(calls) < 2e-4 && calls < 1 << 24 {
        calls *= 2;
    }
    calls *= 4;
    let fastest = (0..runs.max(1)).map(|_| time(calls)).fold(f64::INFINITY, f64::min);
    fastest * 1e9 / (calls * items) as f64
}
