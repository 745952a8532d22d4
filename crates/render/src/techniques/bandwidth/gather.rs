//! Light gathered along directions, in batches: what arrives, whether it is open, and the sums by part of the material.
//!
//! Visibility comes in at two places: [`Gathered::hide`] takes away what does not get through along a batch of directions, and
//! [`Gathered::add`] along one. It is told by shadow rays, or by the spheres that stand for meshes, whose visibility is worked
//! out for groups of points before they are shaded.

use glam::{Mat3, Vec3};
use halflight_scene::Frame;
use halflight_sh::{Sh, batch};
use halflight_trace::{Kernel, Ray, Simd};

use super::parts::Shares;
use super::samples::{LANES, Reflected};
use super::surface::SurfacePoint;
use crate::sh_light::axes;
use crate::techniques::shexp::{FrameOpenness, OPENNESS_ORDER, OpennessRoom, Receiver};

/// Points whose visibility is worked out together.
pub(super) const TOGETHER: usize = 32;
/// Blocks of lanes that hold a batch.
const BLOCKS: usize = LANES / batch::WIDTH;

/// What stops light.
#[derive(Clone, Copy)]
pub(super) enum Blocking<'a> {
    Nothing,
    /// What shadow rays meet.
    Rays,
    /// What stands for it in spherical harmonics.
    Spheres(&'a FrameOpenness<'a>),
}

type Visible = Sh<OPENNESS_ORDER>;

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
    blocking: Blocking<'a>,
    /// What is visible from the points that come next, the number of those that are done, and of the point at work.
    around: Vec<Visible>,
    done: usize,
    visible: Visible,
    receivers: Vec<Receiver>,
    openness: OpennessRoom,
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
    pub(super) fn new(frame: &'a Frame, blocking: Blocking<'a>) -> Self {
        Self {
            frame,
            blocking,
            around: Vec::new(),
            done: 0,
            visible: Visible::one(),
            receivers: Vec::new(),
            openness: OpennessRoom::default(),
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

    /// Works out what is visible from the points that are shaded next, in their order: near each other, up to [`TOGETHER`].
    pub(super) fn look_around<'p>(&mut self, points: impl Iterator<Item = &'p SurfacePoint>) {
        let Blocking::Spheres(openness) = self.blocking else { return };
        self.receivers.clear();
        self.receivers.extend(points.map(|point| Receiver {
            position: point.position,
            normal: point.geometric_normal,
            owner: openness.owner(point.instance, point.primitive),
            instance: point.instance,
        }));
        self.around.clear();
        self.around.resize(self.receivers.len(), Visible::one());
        openness.visible(&self.receivers, &mut self.openness, &mut self.around);
        self.done = 0;
    }

    /// Goes on to a point: the next of those that were looked around from, or one alone, which costs as much as sixteen.
    pub(super) fn turn_to(&mut self, point: &SurfacePoint) {
        if !matches!(self.blocking, Blocking::Spheres(_)) {
            return;
        }
        if self.done == self.around.len() {
            self.look_around(std::iter::once(point));
        }
        self.visible = self.around[self.done];
        self.done += 1;
    }

    /// Adds what one direction brings.
    #[inline]
    pub(super) fn add(&mut self, point: &SurfacePoint, value: Shares, direction: Vec3, t_max: f32) {
        let share = match self.blocking {
            Blocking::Rays => None,
            Blocking::Nothing => Some(1.0),
            Blocking::Spheres(_) => Some(self.visible.at(axes(direction)).clamp(0.0, 1.0)),
        };
        if let Some(share) = share {
            self.sum[0] += share * value[0];
            self.sum[1] += share * value[1];
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

    /// Takes light away from the first `number` directions of the batch that does not get through to a point. `to_world`
    /// turns them from the space that they are in.
    pub(super) fn hide(&mut self, point: &SurfacePoint, number: usize, to_world: Mat3) {
        match self.blocking {
            Blocking::Nothing => {}
            Blocking::Rays => self.hide_by_rays(point, number, to_world),
            Blocking::Spheres(_) => self.dim(number, to_world),
        }
    }

    /// What is visible in each direction of the batch, by harmonics.
    fn dim(&mut self, number: usize, to_world: Mat3) {
        let mut directions = [[batch::Lanes::default(); 3]; BLOCKS];
        let mut basis = [Visible::zero().map(batch::Lanes::splat); BLOCKS];
        let mut shares = [batch::Lanes::default(); BLOCKS];
        for i in 0..number {
            let direction =
                to_world * Vec3::new(self.reflected.x[i], self.reflected.y[i], self.reflected.z[i]);
            for (lanes, value) in directions[i / batch::WIDTH].iter_mut().zip(axes(direction)) {
                lanes.0[i % batch::WIDTH] = value;
            }
        }
        let simd = crate::sh_light::simd(self.frame.world.simd());
        batch::basis(simd, &directions, &mut basis);
        batch::dot(simd, &basis, &[self.visible.map(batch::Lanes::splat); BLOCKS], &mut shares);
        for i in 0..number {
            self.reflected.scale[i] *= shares[i / batch::WIDTH].0[i % batch::WIDTH].clamp(0.0, 1.0);
        }
    }

    fn hide_by_rays(&mut self, point: &SurfacePoint, number: usize, to_world: Mat3) {
        let mut places = [0u8; LANES];
        let mut count = 0;
        for i in 0..number {
            if self.reflected.scale[i] == 0.0 {
                continue;
            }
            let direction =
                to_world * Vec3::new(self.reflected.x[i], self.reflected.y[i], self.reflected.z[i]);
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
