//! Which sphere covers which points.
//!
//! The cost of a sphere (c, r) is its outside volume E(c, r), which only grows with r. Points are taken hardest first,
//! by the least E over the spheres if one of them had to reach the point: an uncovered one makes that sphere grow whose
//! cost rises least. Then each point goes to the cheapest of the spheres that cover it, E(c, |p − c|), so that spheres
//! which reached further than anybody needs can shrink.

use glam::Vec3;
use rayon::prelude::*;

use super::solid::Solid;

/// A sphere of the fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ball {
    pub(super) center: Vec3,
    pub(super) radius: f32,
}

/// Entries of a cost table: outside volumes are smooth, and 24 steps hold them to a percent.
const STEPS: usize = 24;
/// Points a thread takes at a time.
const CHUNK: usize = 512;

/// E(c, r) of one centre over radii.
#[derive(Clone, Debug)]
pub(super) struct Cost {
    step: f32,
    values: [f32; STEPS + 1],
}

impl Cost {
    /// Up to 2.5 times the ball's radius, and no less than `least`.
    pub(super) fn of(solid: &Solid, ball: &Ball, least: f32) -> Self {
        let reach = (2.5 * ball.radius).max(least);
        let step = reach / STEPS as f32;
        let level = solid.level_for(0.5 * reach);
        let mut values = [0.0; STEPS + 1];
        for k in 1..=STEPS {
            let value = solid.outside(level, ball.center, k as f32 * step);
            values[k] = value.max(values[k - 1]);
        }
        Self { step, values }
    }

    /// The outside volume at a radius; beyond the table all further volume counts as outside.
    pub(super) fn at(&self, radius: f32) -> f32 {
        let x = radius / self.step;
        let k = x as usize;
        if k < STEPS {
            return self.values[k] + (x - k as f32) * (self.values[k + 1] - self.values[k]);
        }
        let last = self.step * STEPS as f32;
        self.values[STEPS] + 4.0 / 3.0 * std::f32::consts::PI * (radius.powi(3) - last.powi(3))
    }
}

/// Cost tables of all balls.
pub(super) fn costs(solid: &Solid, balls: &[Ball], least: f32) -> Vec<Cost> {
    balls.par_iter().map(|ball| Cost::of(solid, ball, least)).collect()
}

/// The ball each point belongs to, after radii have grown from nothing to cover all points. `balls` keep their centres
/// and get those radii.
pub(super) fn assign(points: &[Vec3], balls: &mut [Ball], costs: &[Cost]) -> Vec<u32> {
    balls.iter_mut().for_each(|b| b.radius = 0.0);
    grow(points, balls, costs);
    points
        .par_iter()
        .with_min_len(CHUNK)
        .map(|&p| {
            let mut best = (f32::INFINITY, f32::INFINITY, 0);
            for (s, (ball, cost)) in balls.iter().zip(costs).enumerate() {
                let d = p.distance(ball.center);
                if d <= ball.radius {
                    // Within the mesh many balls cost nothing: the one the point lies deepest in.
                    let key = (cost.at(d), d / ball.radius.max(f32::MIN_POSITIVE));
                    if key.0 < best.0 || (key.0 == best.0 && key.1 < best.1) {
                        best = (key.0, key.1, s as u32);
                    }
                }
            }
            best.2
        })
        .collect()
}

/// Grows radii until all points are covered.
pub(super) fn grow(points: &[Vec3], balls: &mut [Ball], costs: &[Cost]) {
    let hardness: Vec<f32> = points
        .par_iter()
        .with_min_len(CHUNK)
        .map(|&p| {
            if balls.iter().any(|b| p.distance(b.center) <= b.radius) {
                return -1.0;
            }
            let prices = balls.iter().zip(costs).map(|(b, c)| c.at(p.distance(b.center)) - c.at(b.radius));
            prices.fold(f32::INFINITY, f32::min)
        })
        .collect();
    let mut order: Vec<u32> = (0..points.len() as u32).filter(|&i| hardness[i as usize] >= 0.0).collect();
    order.sort_by(|&a, &b| hardness[b as usize].total_cmp(&hardness[a as usize]).then(a.cmp(&b)));
    for i in order {
        let p = points[i as usize];
        if balls.iter().any(|b| p.distance(b.center) <= b.radius) {
            continue;
        }
        let mut best = (f32::INFINITY, 0);
        for (s, (ball, cost)) in balls.iter().zip(costs).enumerate() {
            let price = cost.at(p.distance(ball.center)) - cost.at(ball.radius);
            if price < best.0 {
                best = (price, s);
            }
        }
        let ball = &mut balls[best.1];
        ball.radius = p.distance(ball.center);
    }
}
