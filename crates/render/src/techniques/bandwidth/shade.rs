//! The radiance of one point by a number of samples.
//!
//! L = (1/N) Σ L(ω_i) f(ω_i, ω) cos θ_i/p(ω_i), directions by the tables of its material or by the material itself; local
//! lights are sampled directly; [001] eq. (2). In pre-convolved shading a sample sees the environment convolved with a Phong
//! lobe as broad as the gap 1/(N p) between samples, but never of more than half of the variance of the material's own lobe:
//! eq. (10) takes all of it, which blurs twice.
//!
//! Suns are not left to chance: each is asked for the light that is reflected of it, [`super::suns`].
//!
//! What stops light on its way is the affair of [`super::gather`].

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Mat3, Vec2, Vec3};
use halflight_frequency::importance::point as sequence;
use halflight_material::Bsdf;
use halflight_scene::Frame;
use halflight_scene::lights::{Arrival, Environment, MANY, MapPoint};

use super::convolved::LookUp;
use super::gather::{Blocking, Gathered};
use super::light::FrameLight;
use super::lobes::{Directions, Lobe};
use super::parts::{Scattering, Shares, joined};
use super::predict::turned;
use super::samples::{GROUP, HalfSamples, LANES, Reflect, elevations, run};
use super::settings::{BandwidthSettings, Mode};
use super::surface::SurfacePoint;
use crate::sampler::Sampler;
use crate::technique::Progress;

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
    pub(super) blocking: Blocking<'a>,
    /// Of this look.
    pub(super) seed: u64,
    /// Tells when nobody wants this look any more.
    pub(super) progress: &'a dyn Progress,
}

/// How a point is shaded under the environment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    /// By the tables of its material, not by the material itself.
    pub(super) by_table: bool,
    /// Whether its samples see convolved light.
    pub(super) filtered: bool,
    /// Whether suns are asked by themselves, not found by samples.
    pub(super) suns: bool,
}

impl Way {
    pub(super) fn of(
        point: &SurfacePoint,
        lobe: &Lobe,
        light: &FrameLight,
        settings: &BandwidthSettings,
    ) -> Self {
        let by_table = matches!(lobe.directions, Directions::Table(_))
            && (lobe.is_complete || point.color == Vec3::ONE)
            && settings.mode != Mode::Reference;
        // A mirror, or nearly one, shows the texels of the sun; samples of it find what is there.
        let is_sharp = matches!(lobe.directions, Directions::Single) || light.tells_texels(lobe.sharpness);
        let suns = !light.suns.is_empty() && !is_sharp;
        // Convolutions are those of the map without its suns.
        let sees_all = suns || light.suns.is_empty();
        Self { by_table, filtered: by_table && settings.mode == Mode::Preconvolved && sees_all, suns }
    }
}

impl<'a> Shader<'a> {
    /// Room to gather light in, one for each thread.
    pub(super) fn room(&self) -> Gathered<'a> {
        Gathered::new(self.frame, self.blocking)
    }

    /// What a point sends to the eye by each part of its material, of so many samples of the environment and of local
    /// lights. `place` decides which samples.
    pub(super) fn shares(
        &self,
        point: &SurfacePoint,
        place: [u32; 2],
        samples: [u32; 2],
        gathered: &mut Gathered,
    ) -> Shares {
        let mut shares = Shares::default();
        let lobe = &self.lobes[point.material as usize];
        if matches!(lobe.directions, Directions::None) {
            return shares;
        }
        gathered.turn_to(point);
        if let (Some(environment), Some(sky)) = (self.light.environment, &self.light.sky) {
            let way = Way::of(point, lobe, self.light, self.settings);
            let seen = if way.suns { sky } else { environment };
            shares = match &lobe.directions {
                _ if self.settings.mode == Mode::Reference => {
                    self.joined(point, environment, place, samples[0], gathered)
                }
                Directions::Table(tables) if way.by_table => {
                    let mut by = |table| {
                        self.by_table(point, table, (seen, way.filtered), place, samples[0], gathered)
                    };
                    match tables.as_slice() {
                        [first, second] => [by(first)[0], by(second)[0]],
                        tables => tables.first().map(|table| by(table)).unwrap_or_default(),
                    }
                }
                _ => self.by_itself(point, [environment, seen], place, samples[0], gathered),
            };
            if way.suns {
                let suns = self.by_suns(point, lobe, gathered);
                shares = std::array::from_fn(|part| shares[part] + suns[part]);
            }
        }
        if self.light.has_local() && samples[1] > 0 {
            let local = self.by_lights(point, lobe, place, samples[1], gathered);
            shares = std::array::from_fn(|part| shares[part] + local[part]);
        }
        shares
    }

    /// The radiance of a point, of what its parts send.
    #[inline]
    pub(super) fn composed(&self, point: &SurfacePoint, shares: Shares) -> Vec3 {
        let material = &self.frame.materials[point.material as usize];
        let radiance = if self.settings.mode == Mode::Reference {
            shares[0]
        } else {
            let weights = self.lobes[point.material as usize].parts.weights(material, &point.input());
            joined(shares, weights).max(Vec3::ZERO)
        };
        if material.is_emissive() { radiance + self.emitted(point) } else { radiance }
    }

    /// [`Self::shares`], composed.
    #[cfg(test)]
    pub(super) fn radiance(
        &self,
        point: &SurfacePoint,
        place: [u32; 2],
        samples: [u32; 2],
        gathered: &mut Gathered,
    ) -> Vec3 {
        let shares = self.shares(point, place, samples, gathered);
        self.composed(point, shares)
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
        Sampler::new(self.seed ^ u64::from(kind) << 32, place[0], place[1], 0).pixel_seed() >> 8
    }

    /// Directions by the tables of the material, a batch at a time.
    fn by_table(
        &self,
        point: &SurfacePoint,
        table: &HalfSamples,
        (environment, filtered): (&Environment, bool),
        place: [u32; 2],
        number: u32,
        gathered: &mut Gathered,
    ) -> Shares {
        let view = point.view();
        let simd = self.frame.world.simd();
        let convolved = self.light.convolved().filter(|_| filtered);
        // Convolved light is looked up in the space of the map.
        let mut axes = turned(point.axes(), view);
        let mut front = point.geometric_normal;
        if convolved.is_some() {
            axes = axes.map(|axis| self.light.to_map * axis);
            front = self.light.to_map * front;
        }
        let gap = 4.0 * PI * number as f32 / OVERLAP;
        let view = [(view.x * view.x + view.y * view.y).sqrt(), view.z];
        let (below, share) = elevations(view[1]);
        let mut choice = self.choice(place, 1);
        let runs = if convolved.is_some() {
            // The same samples everywhere: convolved light is smooth from one to the next, and what they miss varies as
            // slowly as the picture instead of from pixel to pixel.
            choice = self.choice([0, 0], 1);
            let half = number.div_ceil(2).next_multiple_of(GROUP as u32);
            [(below, half, 1.0 - share), (below + 1, half, share)]
        } else {
            // In proportion to how near each elevation is, in whole groups.
            let groups = (number as f32 * share / GROUP as f32 + (choice & 1023) as f32 / 1024.0) as u32;
            let upper = (groups * GROUP as u32).min(number);
            let part = |n: u32| n as f32 / number as f32;
            [(below, number - upper, part(number - upper)), (below + 1, upper, part(upper))]
        };
        let mut shares = Shares::default();
        for (elevation, here, part) in runs {
            if here == 0 {
                continue;
            }
            let run = run(elevation, here as usize, choice >> 10);
            let mut sum = Shares::default();
            for first in (0..run.number).step_by(LANES) {
                let start = run.start + first;
                let many = LANES.min(run.number - first);
                let out = &mut gathered.reflected;
                simd.run(Reflect { samples: table, start, number: many, view, axes, front, gap, out });
                match convolved {
                    Some(convolved) => {
                        let any_sharp = simd.run(LookUp {
                            table: convolved,
                            reflected: &gathered.reflected,
                            number: many,
                            place: first,
                            light: &mut gathered.light,
                            sharp: &mut gathered.sharp,
                        });
                        if any_sharp {
                            self.look_sharply(environment, many, gathered);
                        }
                        gathered.hide(point, many, self.light.to_map.transpose());
                    }
                    None => {
                        self.look_up(environment, many, gathered);
                        gathered.hide(point, many, Mat3::IDENTITY);
                    }
                }
                let found = gathered.weighted(simd, many, table.weights(start, many));
                sum[0] += found[0];
                sum[1] += found[1];
            }
            let ratio = table.albedo(below, share, elevation);
            let scale = part / run.number as f32;
            shares[0] += sum[0] * ratio[0] * scale;
            shares[1] += sum[1] * ratio[1] * scale;
        }
        if convolved.is_some() {
            // The tables are those of the map without its intensity.
            shares = shares.map(|share| share * environment.intensity);
        }
        shares
    }

    /// What the map itself has for a batch of directions of the world.
    fn look_up(&self, environment: &Environment, number: usize, gathered: &mut Gathered) {
        let simd = self.frame.world.simd();
        let mut directions = [Vec3::Y; MANY];
        let mut points = [MapPoint::default(); MANY];
        let mut radiance = [Vec3::ZERO; MANY];
        let from = &gathered.reflected;
        for (i, direction) in directions[..number].iter_mut().enumerate() {
            *direction = Vec3::new(from.x[i], from.y[i], from.z[i]);
        }
        environment.locate_many(simd, &directions, number, &mut points);
        environment.radiance_many(simd, &points, number, &mut radiance);
        for (light, radiance) in gathered.light[..number].iter_mut().zip(&radiance) {
            *light = radiance.extend(0.0).to_array();
        }
    }

    /// What the map itself has for those directions of a batch that ask for it, over its intensity.
    fn look_sharply(&self, environment: &Environment, number: usize, gathered: &mut Gathered) {
        let simd = self.frame.world.simd();
        let to_world = self.light.to_map.transpose();
        let mut directions = [Vec3::Y; MANY];
        let mut points = [MapPoint::default(); MANY];
        let mut radiance = [Vec3::ZERO; MANY];
        let mut places = [0u8; MANY];
        let mut many = 0;
        let from = &gathered.reflected;
        for i in (0..number).filter(|&i| gathered.sharp[i]) {
            directions[many] = to_world * Vec3::new(from.x[i], from.y[i], from.z[i]);
            places[many] = i as u8;
            many += 1;
        }
        environment.locate_many(simd, &directions, many, &mut points);
        environment.radiance_many(simd, &points, many, &mut radiance);
        // What has no intensity brings nothing in the end.
        let over = (Vec3::ONE / environment.intensity).map(|v| if v.is_finite() { v } else { 0.0 });
        for (&place, radiance) in places[..many].iter().zip(&radiance) {
            gathered.light[usize::from(place)] = (*radiance * over).extend(0.0).to_array();
        }
    }

    /// The material chooses the directions; ideal mirrors see the first of the environments, all else the second.
    fn by_itself(
        &self,
        point: &SurfacePoint,
        [whole, seen]: [&Environment; 2],
        place: [u32; 2],
        number: u32,
        gathered: &mut Gathered,
    ) -> Shares {
        let bsdf = point.bsdf(self.frame);
        let axes = point.axes();
        let mut view = point.view();
        view.z *= point.side;
        for i in 0..number {
            let u = Sampler::new(self.seed, place[0], place[1], i).next_four();
            let Some(sample) = bsdf.sample(view, u[2], Vec2::new(u[0], u[1])) else { continue };
            let Some(direction) = leaving(point, &axes, sample.wi) else { continue };
            let environment = if sample.delta { whole } else { seen };
            let value = [sample.weight * environment.radiance(direction), Vec3::ZERO];
            gathered.add(point, value, direction, f32::INFINITY);
        }
        gathered.mean(number)
    }

    /// Material and environment choose directions in turn, joined by the balance heuristic.
    fn joined(
        &self,
        point: &SurfacePoint,
        environment: &Environment,
        place: [u32; 2],
        number: u32,
        gathered: &mut Gathered,
    ) -> Shares {
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
                gathered.add(point, [value, Vec3::ZERO], direction, f32::INFINITY);
            }
            let (direction, met, pdf) = environment.sample(Vec2::new(v[0], v[1]));
            let [x, y, z] = axes.map(|axis| axis.dot(direction));
            let local = Vec3::new(x, y, point.side * z);
            if pdf <= 0.0 || point.geometric_normal.dot(direction) * z <= 0.0 {
                continue;
            }
            let (value, other) = bsdf.eval_pdf(view, local);
            let value = value * environment.radiance_at(met) / (pdf + other);
            gathered.add(point, [value, Vec3::ZERO], direction, f32::INFINITY);
        }
        gathered.mean(number)
    }

    /// Shining surfaces and lamps, sampled themselves.
    fn by_lights(
        &self,
        point: &SurfacePoint,
        lobe: &Lobe,
        place: [u32; 2],
        number: u32,
        gathered: &mut Gathered,
    ) -> Shares {
        let asked = self.asked(point, lobe);
        let choice = self.choice(place, 2);
        let turn = choice as f32 / 16_777_216.0;
        for i in 0..number {
            let which = ((i as f32 + turn) * 0.618_034).fract();
            let u = sequence(i, choice);
            let Some(light) = self.light.local.sample(point.position, which, u, 0.0) else { continue };
            let Arrival::From { point: from, radiance } = light.arrival else { continue };
            let Some(values) = asked.values(light.direction) else { continue };
            let end = from.map_or(f32::INFINITY, |p| p.distance(point.position) * (1.0 - SHADOW_MARGIN));
            gathered.add(point, values.map(|value| value * radiance / light.pdf), light.direction, end);
        }
        gathered.mean(number)
    }
}

/// A point that is asked what it reflects of light from given directions.
struct Asked<'a> {
    point: &'a SurfacePoint,
    /// The parts of its material, where it is shaded by them; else the material itself.
    parts: Option<Scattering<'a>>,
    bsdf: Bsdf<'a>,
    axes: [Vec3; 3],
    view: Vec3,
}

impl Asked<'_> {
    /// f cos θ of each part; `None` where geometry and shading disagree on the side that the light comes from.
    #[inline]
    fn values(&self, direction: Vec3) -> Option<Shares> {
        let [x, y, z] = self.axes.map(|axis| axis.dot(direction));
        if self.point.geometric_normal.dot(direction) * z <= 0.0 {
            return None;
        }
        let local = Vec3::new(x, y, self.point.side * z);
        Some(match &self.parts {
            Some(parts) => parts.eval(self.view, local),
            None => [self.bsdf.eval(self.view, local), Vec3::ZERO],
        })
    }
}

impl Shader<'_> {
    fn asked<'b>(&'b self, point: &'b SurfacePoint, lobe: &'b Lobe) -> Asked<'b> {
        let way = Way::of(point, lobe, self.light, self.settings);
        let mut view = point.view();
        view.z *= point.side;
        let parts = way.by_table.then(|| lobe.parts.bsdfs());
        Asked { point, parts, bsdf: point.bsdf(self.frame), axes: point.axes(), view }
    }

    /// What a point reflects of every sun.
    fn by_suns(&self, point: &SurfacePoint, lobe: &Lobe, gathered: &mut Gathered) -> Shares {
        let asked = self.asked(point, lobe);
        for sun in &self.light.suns {
            for (direction, power) in sun.beams(lobe.towards(point, sun.whole().0)) {
                if let Some(values) = asked.values(*direction) {
                    gathered.add(point, values.map(|value| value * *power), *direction, f32::INFINITY);
                }
            }
        }
        gathered.mean(1)
    }
}

/// A sampled direction in the world; `None` where geometry and shading disagree on the side that it leaves by.
fn leaving(point: &SurfacePoint, axes: &[Vec3; 3], wi: Vec3) -> Option<Vec3> {
    let direction = wi.x * axes[0] + wi.y * axes[1] + point.side * wi.z * axes[2];
    (point.geometric_normal.dot(direction) * wi.z * point.side > 0.0).then_some(direction)
}
