//! First spheres, of two kinds; the fit goes on from the better.
//!
//! On the axis: candidates are balls around cells of the medial axis (no neighbour lies deeper), somewhat larger than the depth, so
//! that they reach over the surface; the one that covers most points not covered yet is taken, again and again. What
//! spheres are left over start at the point farthest from the others. Apart: all of them do.

use std::collections::BinaryHeap;

use glam::Vec3;
use rayon::prelude::*;

use super::cover::Ball;
use super::solid::Solid;

/// More candidates do not change the fit.
const MOST_CANDIDATES: usize = 3000;
/// How much a candidate is larger than its depth.
const INFLATION: f32 = 1.2;

/// `count` balls on the medial axis, as far as there is one.
pub(super) fn on_axis(solid: &Solid, points: &[Vec3], count: usize) -> Vec<Ball> {
    completed(greedy(&medial(solid), points, count), points, count)
}

/// `count` balls of no size, each at the point farthest from those before.
pub(super) fn apart(points: &[Vec3], count: usize) -> Vec<Ball> {
    completed(Vec::new(), points, count)
}

fn completed(mut balls: Vec<Ball>, points: &[Vec3], count: usize) -> Vec<Ball> {
    while balls.len() < count {
        let center = farthest(&balls, points);
        balls.push(Ball { center, radius: 0.0 });
    }
    balls
}

/// The point that lies farthest outside of all balls; of the first, the one nearest to the mean.
fn farthest(balls: &[Ball], points: &[Vec3]) -> Vec3 {
    let mean = points.iter().sum::<Vec3>() / points.len() as f32;
    let far = |p: Vec3| match balls {
        [] => -p.distance(mean),
        _ => balls.iter().map(|b| p.distance(b.center) - b.radius).fold(f32::INFINITY, f32::min),
    };
    let distances: Vec<f32> = points.par_iter().map(|p| far(*p)).collect();
    let best = (0..points.len()).max_by(|&a, &b| distances[a].total_cmp(&distances[b]).then(b.cmp(&a)));
    best.map_or(mean, |i| points[i])
}

/// Lazy greedy cover: scores only fall, so a candidate whose fresh score still leads is the best.
fn greedy(candidates: &[Ball], points: &[Vec3], count: usize) -> Vec<Ball> {
    let covers = |ball: &Ball, p: &Vec3| p.distance_squared(ball.center) <= ball.radius * ball.radius;
    let mut left = points.to_vec();
    let scores: Vec<usize> =
        candidates.par_iter().map(|b| left.iter().filter(|p| covers(b, p)).count()).collect();
    let mut heap: BinaryHeap<(usize, std::cmp::Reverse<usize>)> =
        scores.into_iter().enumerate().map(|(i, score)| (score, std::cmp::Reverse(i))).collect();
    let mut chosen = Vec::new();
    while let Some((score, index)) = heap.pop() {
        if chosen.len() == count || score == 0 {
            break;
        }
        let ball = candidates[index.0];
        let fresh = left.iter().filter(|p| covers(&ball, p)).count();
        if heap.peek().is_none_or(|next| (fresh, index) >= *next) {
            left.retain(|p| !covers(&ball, p));
            chosen.push(ball);
        } else {
            heap.push((fresh, index));
        }
    }
    chosen
}

/// Balls on the medial axis of the solid.
fn medial(solid: &Solid) -> Vec<Ball> {
    let size = solid.size();
    let depth = depths(solid);
    let at = |[x, y, z]: [usize; 3]| depth[(z * size[1] + y) * size[0] + x];
    // The grid has a margin of empty cells, so inside cells have all neighbours.
    let is_deepest = |c: [usize; 3]| {
        (0..3).all(|k| {
            let (mut low, mut high) = (c, c);
            (low[k], high[k]) = (c[k] - 1, c[k] + 1);
            at(low) <= at(c) && at(high) <= at(c)
        })
    };
    let cells: Vec<[usize; 3]> = solid.cells().into_iter().filter(|&c| is_deepest(c)).collect();
    let step = cells.len().div_ceil(MOST_CANDIDATES).max(1);
    let ball =
        |c: &[usize; 3]| Ball { center: solid.center(*c), radius: solid.cell() * (INFLATION * at(*c) + 1.0) };
    cells.iter().step_by(step).map(ball).collect()
}

/// The distance from each cell to the nearest that is not inside, in cells: three sweeps of parabola envelopes
/// (Felzenszwalb and Huttenlocher 2012).
fn depths(solid: &Solid) -> Vec<f32> {
    let [nx, ny, nz] = solid.size();
    let mut squared = vec![0.0f32; nx * ny * nz];
    for [x, y, z] in solid.cells() {
        squared[(z * ny + y) * nx + x] = 1e12;
    }
    squared.par_chunks_mut(nx).for_each(envelope);
    squared.par_chunks_mut(nx * ny).for_each(|slice| {
        let mut line = vec![0.0; ny];
        for x in 0..nx {
            (0..ny).for_each(|y| line[y] = slice[y * nx + x]);
            envelope(&mut line);
            (0..ny).for_each(|y| slice[y * nx + x] = line[y]);
        }
    });
    let mut line = vec![0.0; nz];
    for i in 0..nx * ny {
        (0..nz).for_each(|z| line[z] = squared[z * nx * ny + i]);
        envelope(&mut line);
        (0..nz).for_each(|z| squared[z * nx * ny + i] = line[z]);
    }
    squared.par_iter_mut().for_each(|d| *d = d.sqrt());
    squared
}

/// d(i) = min_j f(j) + (i − j)².
fn envelope(f: &mut [f32]) {
    let source = f.to_vec();
    // Parabolas of the envelope, and where each begins.
    let (mut parabolas, mut begins) = (vec![0usize], vec![f32::NEG_INFINITY]);
    let height = |j: usize| source[j] + (j * j) as f32;
    for j in 1..f.len() {
        loop {
            let last = parabolas[parabolas.len() - 1];
            let meet = (height(j) - height(last)) / (2.0 * (j - last) as f32);
            if meet <= begins[begins.len() - 1] {
                parabolas.pop();
                begins.pop();
            } else {
                parabolas.push(j);
                begins.push(meet);
                break;
            }
        }
    }
    let mut k = 0;
    for (i, value) in f.iter_mut().enumerate() {
        while k + 1 < begins.len() && begins[k + 1] < i as f32 {
            k += 1;
        }
        let j = parabolas[k];
        *value = source[j] + (i as f32 - j as f32).powi(2);
    }
}
