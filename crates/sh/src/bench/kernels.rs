//! The calls that are timed.

use std::hint::black_box;

use glam::{Mat3, Vec3};

use super::{KernelTime, best};
use crate::batch::{self, CapLanes, Lanes, WIDTH};
use crate::numbers::Numbers;
use crate::study::BlockerSet;
use crate::{BlockerTable, Exponential, Rotation, Sh, Simd, Zh};

/// Vectors in a set.
const SET: usize = 64;
/// Blocks in a set.
const BLOCKS: usize = SET / WIDTH;

/// Log-visibilities of random sets of blockers: what is exponentiated.
fn logs<const ORDER: usize>(table: &BlockerTable<ORDER>) -> Vec<Sh<ORDER>> {
    (0..SET)
        .map(|i| {
            let set =
                [BlockerSet::Small(20), BlockerSet::Body(20), BlockerSet::Large(4), BlockerSet::Large(1)]
                    [i % 4];
            set.caps(i as u64).iter().map(|cap| table.log_visibility(cap)).sum()
        })
        .collect()
}

fn blocks<const ORDER: usize>(vectors: &[Sh<ORDER>]) -> Vec<Sh<ORDER, Lanes>> {
    vectors
        .chunks(WIDTH)
        .map(|chunk| {
            let mut block = Sh::zero();
            for (lane, sh) in chunk.iter().enumerate() {
                batch::set_lane(&mut block, lane, sh);
            }
            block
        })
        .collect()
}

fn side_by_side(vectors: &[Vec3]) -> Vec<[Lanes; 3]> {
    vectors
        .chunks(WIDTH)
        .map(|chunk| [0, 1, 2].map(|axis| Lanes(std::array::from_fn(|lane| chunk[lane][axis]))))
        .collect()
}

pub(super) fn all<const ORDER: usize>(simd: Simd, runs: usize) -> Vec<KernelTime> {
    let mut lines = single::<ORDER>(runs);
    lines.extend(batched::<ORDER>(simd, runs));
    lines
}

/// Goals hold at order 4.
fn line(
    kernel: &'static str,
    batched: bool,
    order: usize,
    nanoseconds: f64,
    goal: Option<f64>,
) -> KernelTime {
    KernelTime { kernel, batched, order, nanoseconds, goal: goal.filter(|_| order == 4) }
}

fn single<const ORDER: usize>(runs: usize) -> Vec<KernelTime> {
    let mut numbers = Numbers::new(1);
    let directions: Vec<Vec3> = (0..SET).map(|_| numbers.direction().as_vec3()).collect();
    let turns: Vec<Mat3> = (0..SET)
        .map(|_| Mat3::from_axis_angle(numbers.direction().as_vec3(), numbers.next() as f32 * 6.0))
        .collect();
    let table = BlockerTable::<ORDER>::new();
    let f = logs(&table);
    let g: Vec<Sh<ORDER>> = f.iter().rev().copied().collect();
    let mut out = vec![Sh::<ORDER>::zero(); SET];
    let caps: Vec<_> = (0..SET).flat_map(|seed| BlockerSet::Large(1).caps(seed as u64)).collect();
    let mut lines = Vec::new();
    let mut add = |kernel, goal, ns| lines.push(line(kernel, false, ORDER, ns, goal));
    add(
        "basis",
        Some(3.9),
        best(runs, SET, || {
            let directions = black_box(&directions);
            for i in 0..SET {
                out[i] = Sh::basis(directions[i]);
            }
            black_box(&mut out);
        }),
    );
    add(
        "rotation from a matrix",
        Some(23.0),
        best(runs, SET, || {
            let (f, turns) = (black_box(&f), black_box(&turns));
            for i in 0..SET {
                out[i] = f[i].rotated(&turns[i]);
            }
            black_box(&mut out);
        }),
    );
    let kept = Rotation::<ORDER, f32>::from_matrix(&turns[0]);
    add(
        "rotation, prepared",
        None,
        best(runs, SET, || {
            let f = black_box(&f);
            for i in 0..SET {
                out[i] = kept.apply(&f[i]);
            }
            black_box(&mut out);
        }),
    );
    add(
        "product",
        Some(64.0),
        best(runs, SET, || {
            let (f, g) = (black_box(&f), black_box(&g));
            for i in 0..SET {
                out[i] = f[i].product(&g[i]);
            }
            black_box(&mut out);
        }),
    );
    add(
        "square",
        None,
        best(runs, SET, || {
            let f = black_box(&f);
            for i in 0..SET {
                out[i] = f[i].square();
            }
            black_box(&mut out);
        }),
    );
    let exponential = Exponential::default();
    add(
        "exponential",
        None,
        best(runs, SET, || {
            let f = black_box(&f);
            for i in 0..SET {
                out[i] = exponential.apply(&f[i]);
            }
            black_box(&mut out);
        }),
    );
    add(
        "blocker",
        None,
        best(runs, SET, || {
            let caps = black_box(&caps);
            let mut sum = Sh::<ORDER>::zero();
            for cap in caps {
                sum += table.log_visibility(cap);
            }
            black_box(&mut sum);
        }),
    );
    lines
}

fn batched<const ORDER: usize>(simd: Simd, runs: usize) -> Vec<KernelTime> {
    let mut numbers = Numbers::new(2);
    let directions = side_by_side(&(0..SET).map(|_| numbers.direction().as_vec3()).collect::<Vec<_>>());
    let table = BlockerTable::<ORDER>::new();
    let f = blocks(&logs(&table));
    let g: Vec<Sh<ORDER, Lanes>> = f.iter().rev().copied().collect();
    let mut out = vec![Sh::<ORDER, Lanes>::zero(); BLOCKS];
    let zonal = vec![Zh::<ORDER, Lanes>(std::array::from_fn(|l| Lanes::splat(l as f32))); BLOCKS];
    let caps: Vec<CapLanes> = directions
        .iter()
        .map(|&direction| {
            let half_angle = Lanes(std::array::from_fn(|_| numbers.between(0.05, 1.2) as f32));
            CapLanes { direction, half_angle, weight: Lanes::splat(0.9) }
        })
        .collect();
    let mut lines = Vec::new();
    let mut add = |kernel, goal, ns| lines.push(line(kernel, true, ORDER, ns, goal));
    add(
        "basis",
        Some(2.0),
        best(runs, SET, || {
            batch::basis(simd, black_box(&directions), &mut out);
            black_box(&mut out);
        }),
    );
    add(
        "zonal rotation",
        None,
        best(runs, SET, || {
            batch::rotate_zonal(simd, black_box(&zonal), black_box(&directions), &mut out);
            black_box(&mut out);
        }),
    );
    add(
        "product",
        Some(16.0),
        best(runs, SET, || {
            batch::product(simd, black_box(&f), black_box(&g), &mut out);
            black_box(&mut out);
        }),
    );
    add(
        "square",
        Some(12.0),
        best(runs, SET, || {
            batch::square(simd, black_box(&f), &mut out);
            black_box(&mut out);
        }),
    );
    add(
        "exponential",
        Some(60.0),
        best(runs, SET, || {
            batch::exponential(simd, Exponential::default(), black_box(&f), &mut out);
            black_box(&mut out);
        }),
    );
    add(
        "blockers, one point",
        Some(8.0),
        best(runs, SET, || {
            black_box(batch::accumulate_blockers(simd, &table, black_box(&caps)));
        }),
    );
    add(
        "blocker, many points",
        Some(8.0),
        best(runs, SET, || {
            out.fill(Sh::zero());
            batch::accumulate_blockers_at_points(simd, &table, black_box(&caps), &mut out);
            black_box(&mut out);
        }),
    );
    lines
}
