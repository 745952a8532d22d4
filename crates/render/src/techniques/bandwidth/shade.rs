//! The radiance of one point by a number of samples.
//!
//! L = (1/N) Σ L(ω_i) f(ω_i, ω) cos θ_i/p(ω_i), directions by the tables of its material or by the material itself; local
//! lights are sampled directly; [001] eq. (2). In pre-convolved shading a sample sees the environment convolved with a Phong
//! lobe as broad as the gap 1/(N p) between samples, but never of more than half, and with many samples of no more than the
//! target error's share, of the variance of the material's own lobe: eq. (10) takes all of it, which blurs twice.
//!
//! Shadow rays, where they are asked for, are traced together; the same seam, a share of light by point and direction,
//! is where another visibility would go.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use halflight_frequency::importance::point as sequence;
use halflight_scene::Frame;
use halflight_scene::lights::{Arrival, Environment};
use halflight_trace::Ray;

use super::light::FrameLight;
use super::lobes::{Directions, HalfSample, Lobe, elevations, run};
use super::predict::turned;
use super::settings::{BandwidthSettings, Mode, Visibility};
use super::surface::SurfacePoint;
use crate::sampler::Sampler;
use crate::samplers::LANES;

/// Widths of the gaps between samples that a convolution may span.
const OVERLAP: f32 = 8.0;
/// The part of a shadow ray that is left out at the light, as `Surface::spawn_to` has it.
const SHADOW_MARGIN: f32 = 1e-4;

/// All that shading needs of a frame.
pub(super) struct Shader<'a> {
    pub(super) frame: &'a Frame,
    pub(super) light: &'a FrameLight<'a>,
    pub(super) lobes: &'a [Arc<Lobe>],
    pub(super) settings: &'a BandwidthSettings,
    /// Of this look.
    pub(super) seed: u64,
}

/// What arrives along some directions, added up once it is known which of them are open.
pub(super) struct Gathered<'a> {
    frame: &'a Frame,
    traced: bool,
    sum: Vec3,
    rays: [Ray; LANES],
    values: [Vec3; LANES],
    waiting: usize,
    /// Rays that were traced.
    pub(super) count: u64,
}

impl<'a> Gathered<'a> {
    fn new(frame: &'a Frame, traced: bool) -> Self {
        let rays = [Ray::new(Vec3::ZERO, Vec3::Z); LANES];
        Self { frame, traced, sum: Vec3::ZERO, rays, values: [Vec3::ZERO; LANES], waiting: 0, count: 0 }
    }

    #[inline]
    fn add(&mut self, point: &SurfacePoint, value: Vec3, direction: Vec3, t_max: f32) {
        if !self.traced {
            self.sum += value;
            return;
        }
        if value == Vec3::ZERO {
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
            self.sum += if blocked { Vec3::ZERO } else { *value };
        }
        self.count += count as u64;
        self.waiting = 0;
    }

    /// What was gathered since the last call, over a number of samples.
    fn mean(&mut self, number: u32) -> Vec3 {
        if self.waiting > 0 {
            self.settle();
        }
        let mean = self.sum / number.max(1) as f32;
        self.sum = Vec3::ZERO;
        mean
    }
}

impl<'a> Shader<'a> {
    /// Room to gather light in, one for each thread.
    pub(super) fn room(&self) -> Gathered<'a> {
        Gathered::new(self.frame, self.settings.visibility == Visibility::Rays)
    }

    /// Radiance from a point towards the eye by so many samples of the environment and of local lights. `place` decides
    /// which samples.
    pub(super) fn radiance(
        &self,
        point: &SurfacePoint,
        place: [u32; 2],
        samples: [u32; 2],
        gathered: &mut Gathered,
    ) -> Vec3 {
        let mut radiance = self.emitted(point);
        let lobe = &self.lobes[point.material as usize];
        if matches!(lobe.directions, Directions::None) {
            return radiance;
        }
        if let Some(environment) = self.light.environment {
            match (&lobe.directions, self.settings.mode) {
                (_, Mode::Reference) => self.joined(point, environment, place, samples[0], gathered),
                (Directions::Table(table), Mode::Plain | Mode::Preconvolved) => {
                    self.by_table(point, lobe, table, environment, place, samples[0], gathered);
                }
                _ => self.by_itself(point, environment, place, samples[0], gathered),
            }
            radiance += gathered.mean(samples[0]);
        }
        if self.light.has_local() && samples[1] > 0 {
            self.by_lights(point, place, samples[1], gathered);
            radiance += gathered.mean(samples[1]);
        }
        radiance
    }

    /// Radiance that a surface sends by itself.
    pub(super) fn emitted(&self, point: &SurfacePoint) -> Vec3 {
        let material = &self.frame.materials[point.material as usize];
        if !material.is_emissive() {
            return Vec3::ZERO;
        }
        let front = point.side > 0.0;
        if !front && !material.two_sided {
            return Vec3::ZERO;
        }
        material.emitted(&halflight_material::SurfaceInput { uv: point.uv, color: Vec3::ONE })
    }

    /// Which of many sets of samples a place takes.
    fn choice(&self, place: [u32; 2], kind: u32) -> u32 {
        let mut sampler = Sampler::new(self.seed ^ u64::from(kind) << 32, place[0], place[1], 0);
        (sampler.next_four()[0] * 16_777_216.0) as u32
    }

    fn by_table(
        &self,
        point: &SurfacePoint,
        lobe: &Lobe,
        table: &[HalfSample],
        environment: &Environment,
        place: [u32; 2],
        number: u32,
        gathered: &mut Gathered,
    ) {
        let view = point.view();
        let [x, y, z] = turned(point.axes(), view);
        let view = Vec3::new(view.x.hypot(view.y), 0.0, view.z);
        let convolved = self.settings.mode == Mode::Preconvolved;
        // A convolution widens the lobe by this share of its variance.
        let sharper = 1.0 / self.settings.target_error();
        // Where the lobe is the same everywhere, the values stand in the table; elsewhere the point's own is asked.
        let own = (!lobe.is_even || point.color != Vec3::ONE).then(|| point.bsdf(self.frame));
        // Two elevations, in proportion to how near they are.
        let choice = self.choice(place, 1);
        let (below, share) = elevations(view.z);
        let upper = ((number as f32 * share + (choice & 1023) as f32 / 1024.0) as u32).min(number);
        for (elevation, number_here) in [(below, number - upper), (below + 1, upper)] {
            if number_here == 0 {
                continue;
            }
            for sample in run(table, elevation, number_here as usize, choice >> 10) {
                let along = view.dot(sample.half);
                let local = 2.0 * along * sample.half - view;
                if along <= 0.0 || local.z <= 0.0 {
                    continue;
                }
                let direction = local.x * x + local.y * y + local.z * z;
                if point.geometric_normal.dot(direction) <= 0.0 {
                    continue;
                }
                let pdf = sample.density / along;
                let arriving = if convolved {
                    let gap = 4.0 * PI * number as f32 * pdf / OVERLAP;
                    let exponent = gap.min(sample.exponent * sharper).max(2.0 * sample.exponent);
                    self.light.convolved(environment, self.light.to_map * direction, exponent)
                } else {
                    environment.radiance(direction)
                };
                let weight = match &own {
                    Some(bsdf) => bsdf.eval(view, local) / pdf,
                    None => sample.weight * (along * local.z),
                };
                gathered.add(point, weight * arriving, direction, f32::INFINITY);
            }
        }
    }

    /// The material chooses the directions.
    fn by_itself(
        &self,
        point: &SurfacePoint,
        environment: &Environment,
        place: [u32; 2],
        number: u32,
        gathered: &mut Gathered,
    ) {
        let bsdf = point.bsdf(self.frame);
        let axes = point.axes();
        let mut view = point.view();
        view.z *= point.side;
        for i in 0..number {
            let u = Sampler::new(self.seed, place[0], place[1], i).next_four();
            let Some(sample) = bsdf.sample(view, u[2], Vec2::new(u[0], u[1])) else { continue };
            let Some(direction) = leaving(point, &axes, sample.wi) else { continue };
            gathered.add(point, sample.weight * environment.radiance(direction), direction, f32::INFINITY);
        }
    }

    /// Material and environment choose directions in turn, joined by the balance heuristic.
    fn joined(
        &self,
        point: &SurfacePoint,
        environment: &Environment,
        place: [u32; 2],
        number: u32,
        gathered: &mut Gathered,
    ) {
        let bsdf = point.bsdf(self.frame);
        let axes = point.axes();
        let mut view = point.view();
        view.z *= point.side;
        for i in 0..number {
            let mut sampler = Sampler::new(self.seed, place[0], place[1], i);
            let (u, v) = (sampler.next_four(), sampler.next_four());
            if let Some(sample) = bsdf.sample(view, u[2], Vec2::new(u[0], u[1]))
                && let Some(direction) = leaving(point, &axes, sample.wi)
            {
                let met = environment.locate(direction);
                let other = if sample.delta { 0.0 } else { environment.pdf_at(met) };
                let share = sample.pdf / (sample.pdf + other);
                let value = share * sample.weight * environment.radiance_at(met);
                gathered.add(point, value, direction, f32::INFINITY);
            }
            let (direction, met, pdf) = environment.sample(Vec2::new(v[0], v[1]));
            let [x, y, z] = axes.map(|axis| axis.dot(direction));
            let local = Vec3::new(x, y, point.side * z);
            if pdf <= 0.0 || point.geometric_normal.dot(direction) * z <= 0.0 {
                continue;
            }
            let (value, other) = bsdf.eval_pdf(view, local);
            let value = value * environment.radiance_at(met) / (pdf + other);
            gathered.add(point, value, direction, f32::INFINITY);
        }
    }

    /// Shining surfaces and lamps, sampled themselves.
    fn by_lights(&self, point: &SurfacePoint, place: [u32; 2], number: u32, gathered: &mut Gathered) {
        let bsdf = point.bsdf(self.frame);
        let axes = point.axes();
        let mut view = point.view();
        view.z *= point.side;
        let choice = self.choice(place, 2);
        let turn = choice as f32 / 16_777_216.0;
        for i in 0..number {
            let which = ((i as f32 + turn) * 0.618_034).fract();
            let u = sequence(i, choice);
            let Some(light) = self.light.local.sample(point.position, which, u, 0.0) else { continue };
            let Arrival::From { point: from, radiance } = light.arrival else { continue };
            let [x, y, z] = axes.map(|axis| axis.dot(light.direction));
            if point.geometric_normal.dot(light.direction) * z <= 0.0 {
                continue;
            }
            let value = bsdf.eval(view, Vec3::new(x, y, point.side * z)) * radiance / light.pdf;
            let end = from.map_or(f32::INFINITY, |p| p.distance(point.position) * (1.0 - SHADOW_MARGIN));
            gathered.add(point, value, light.direction, end);
        }
    }
}

/// A sampled direction in the world; `None` where geometry and shading disagree on the side that it leaves by.
fn leaving(point: &SurfacePoint, axes: &[Vec3; 3], wi: Vec3) -> Option<Vec3> {
    let direction = wi.x * axes[0] + wi.y * axes[1] + point.side * wi.z * axes[2];
    (point.geometric_normal.dot(direction) * wi.z * point.side > 0.0).then_some(direction)
}
