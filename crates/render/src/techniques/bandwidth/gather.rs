//! Light gathered along directions, in batches: what arrives, whether it is open, and the sums by part of the material.
//!
//! Visibility comes in at one place, [`Gathered::hide`]: the share of light that is open along each direction of a batch.

use glam::Vec3;
use halflight_scene::Frame;
use halflight_trace::{Kernel, Ray, Simd};

use super::parts::Shares;
use super::samples::{LANES, Reflected};
use super::surface::SurfacePoint;

/// Σ light · scale · weight.
struct Weigh<'a> {
    light: &'a [[f32; 4]],
    scale: &'a [f32],
    weights: &'a [[f32; 4]],
}

impl Kernel for Weigh<'_> {
    type Output = Vec3;
    #[inline(always)]
    fn run(self) -> Vec3 {
        let number = self.light.len().min(self.scale.len()).min(self.weights.len());
        let mut sum = [0.0f32; 4];
        for i in 0..number {
            for c in 0..4 {
                sum[c] += self.weights[i][c] * self.light[i][c] * self.scale[i];
            }
        }
        Vec3::new(sum[0], sum[1], sum[2])
    }
}

/// Room to gather light in, one for each thread.
pub(super) struct Gathered<'a> {
    frame: &'a Frame,
    traced: bool,
    /// Of the batch at work.
    pub(super) reflected: Reflected,
    pub(super) light: [[f32; 4]; LANES],
    pub(super) sharp: [bool; LANES],
    sum: Shares,
    rays: [Ray; LANES],
    values: [Shares; LANES],
    waiting: usize,
    /// Rays that were traced.
    pub(super) count: u64,
}

impl<'a> Gathered<'a> {
    pub(super) fn new(frame: &'a Frame, traced: bool) -> Self {
        Self {
            frame,
            traced,
            reflected: Reflected::default(),
            light: [[0.0; 4]; LANES],
            sharp: [false; LANES],
            sum: Shares::default(),
            rays: [Ray::new(Vec3::ZERO, Vec3::Z); LANES],
            values: [Shares::default(); LANES],
            waiting: 0,
            count: 0,
        }
    }

    /// Adds what one direction brings.
    #[inline]
    pub(super) fn add(&mut self, point: &SurfacePoint, value: Shares, direction: Vec3, t_max: f32) {
        if !self.traced {
            self.sum[0] += value[0];
            self.sum[1] += value[1];
            return;
        }
        if value == Shares::default() {
            return;
        }
        self.rays[self.waiting] = point.shadow_ray(direction, t_max);
        self.values[self.waiting] = value;
        self.waiting += 1;
        if self.waiting == LANES {
            self.settle();
        }
    }

    /// Traces the rays that wait.
    fn settle(&mut self) {
        let mut blocked = [false; LANES];
        let count = self.waiting;
        self.frame.world.occluded_scattered(&self.rays[..count], &mut blocked[..count]);
        for (value, blocked) in self.values[..count].iter().zip(blocked) {
            if !blocked {
                self.sum[0] += value[0];
                self.sum[1] += value[1];
            }
        }
        self.count += count as u64;
        self.waiting = 0;
    }

    /// Takes light away from the first `number` directions of the batch that do not get through to a point. `world` turns
    /// them from the space that they are in.
    pub(super) fn hide(&mut self, point: &SurfacePoint, number: usize, world: impl Fn(Vec3) -> Vec3) {
        if !self.traced {
            return;
        }
        let mut places = [0u8; LANES];
        let mut count = 0;
        for i in 0..number {
            if self.reflected.scale[i] == 0.0 {
                continue;
            }
            let direction = world(Vec3::new(self.reflected.x[i], self.reflected.y[i], self.reflected.z[i]));
            self.rays[count] = point.shadow_ray(direction, f32::INFINITY);
            places[count] = i as u8;
            count += 1;
        }
        let mut blocked = [false; LANES];
        self.frame.world.occluded_scattered(&self.rays[..count], &mut blocked[..count]);
        for (&place, _) in places[..count].iter().zip(blocked).filter(|(_, blocked)| *blocked) {
            self.reflected.scale[usize::from(place)] = 0.0;
        }
        self.count += count as u64;
    }

    /// The sum of the light of the batch by the weights of each of its directions, of both parts; the second may be empty.
    #[inline]
    pub(super) fn weighted(&self, simd: Simd, number: usize, weights: [&[[f32; 4]]; 2]) -> Shares {
        let (light, scale) = (&self.light[..number], &self.reflected.scale[..number]);
        let [first, second] = weights;
        let first = simd.run(Weigh { light, scale, weights: first });
        let second =
            if second.is_empty() { Vec3::ZERO } else { simd.run(Weigh { light, scale, weights: second }) };
        [first, second]
    }

    /// What was gathered since the last call, over a number of samples.
    pub(super) fn mean(&mut self, number: u32) -> Shares {
        if self.waiting > 0 {
            self.settle();
        }
        let scale = 1.0 / number.max(1) as f32;
        let mean = [self.sum[0] * scale, self.sum[1] * scale];
        self.sum = Shares::default();
        mean
    }
}
