//! Where photons set out: a light by its power, a point of it, and a direction towards what is worth hitting.
//!
//! A photon carries Φ = L cos θ/(N p): for one drawn with the density p (of light, point and direction) of N in all. Directions are
//! drawn from a mixture of balls about all that is smooth, since only that gathers light, and with media of everything else
//! too; p is that of the whole mixture, so that no way of light counts twice. Light from far away starts on discs
//! across its direction as wide as those balls.

use std::collections::HashMap;
use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use halflight_frequency::covariance::Covariance5;
use halflight_material::{Material, SurfaceInput};
use halflight_scene::Frame;
use halflight_scene::lights::{DeltaLight, luminance};
use halflight_scene::media::Region;
use halflight_scene::sampling::{Choice, concentric_disk, uniform_sphere};
use halflight_trace::Ray;

use super::super::trail::Beam;
use crate::sampler::Sampler;

/// A ball that something lies in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ball {
    pub(super) center: Vec3,
    pub(super) radius: f32,
}

impl Ball {
    fn around((low, high): (Vec3, Vec3)) -> Option<Self> {
        let ball = Self { center: 0.5 * (low + high), radius: 0.5 * low.distance(high) };
        (ball.center.is_finite() && ball.radius.is_finite() && ball.radius > 0.0).then_some(ball)
    }

    /// How far inside the outline a ray passes; negative outside.
    pub(super) fn margin(&self, ray: &Ray) -> f32 {
        let to = self.center - ray.origin;
        self.radius - (to - ray.direction * to.dot(ray.direction)).length()
    }

    /// The solid angle that it fills from a point.
    fn solid_angle(&self, from: Vec3) -> f32 {
        2.0 * PI * self.height(from)
    }

    /// 1 − cos of half the angle that it fills; 2 from inside.
    fn height(&self, from: Vec3) -> f32 {
        let squared = from.distance_squared(self.center);
        let sin2 = self.radius * self.radius / squared;
        if sin2 < 1.0 { sin2 / (1.0 + (1.0 - sin2).sqrt()) } else { 2.0 }
    }

    fn holds(&self, from: Vec3, direction: Vec3) -> bool {
        let axis = (self.center - from).normalize_or(Vec3::Y);
        1.0 - axis.dot(direction) <= self.height(from)
    }

    fn direction(&self, from: Vec3, u: Vec2) -> Vec3 {
        let axis = (self.center - from).normalize_or(Vec3::Y);
        let down = u.x * self.height(from);
        let (sin, cos) = ((down * (2.0 - down)).max(0.0).sqrt(), 1.0 - down);
        let (x, y) = axis.any_orthonormal_pair();
        let (s, c) = (2.0 * PI * u.y).sin_cos();
        (axis * cos + (x * c + y * s) * sin).normalize()
    }
}

/// A photon as it sets out.
pub(super) struct Start {
    pub(super) ray: Ray,
    pub(super) power: Vec3,
    pub(super) beam: Beam,
}

/// All lights of a frame, and what to aim at.
pub(super) struct Sources<'a> {
    frame: &'a Frame,
    /// Emitters, then lights without extent, then the environment.
    choice: Option<Choice>,
    /// Smooth things, by instance.
    pub(super) targets: Vec<(u32, Ball)>,
    /// Media and the world, for light that comes to media from anywhere.
    wide: Vec<Ball>,
    /// Area of the whole light that an emitter is part of.
    areas: Vec<f32>,
}

/// Whether a surface may reflect or refract a ray without spreading it.
fn is_smooth(material: &Material) -> bool {
    if let halflight_material::MaterialKind::Mix { parts, .. } = &material.kind {
        return parts.iter().any(is_smooth);
    }
    let bsdf = material.bsdf(&SurfaceInput::default());
    if matches!(material.kind, halflight_material::MaterialKind::Black) {
        return false;
    }
    bsdf.is_delta_only()
        || (bsdf.transmits() && material.opacity.is_none())
        || !material.is_uniform() && {
            use halflight_material::MaterialKind::{Conductor, Dielectric};
            matches!(material.kind, Conductor { .. } | Dielectric { .. })
        }
}

/// The ball about an instance over the shutter.
fn ball_of(frame: &Frame, instance: usize) -> Option<Ball> {
    let instance = frame.world.instances().get(instance)?;
    let (low, high) = instance.geometry.as_rays().bounds();
    let (mut least, mut most) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for time in [0.0, 1.0] {
        let to_world = instance.transform.at(time);
        for i in 0..8 {
            let pick = |bit: usize, axis: usize| if i >> bit & 1 == 0 { low[axis] } else { high[axis] };
            let corner = to_world.transform_point3(Vec3::new(pick(0, 0), pick(1, 1), pick(2, 2)));
            (least, most) = (least.min(corner), most.max(corner));
        }
    }
    let mut ball = Ball::around((least, most))?;
    if let halflight_trace::Geometry::Spheres(spheres) = &*instance.geometry
        && spheres.spheres().len() == 1
    {
        // The ball of a cube is wider than the ball in it.
        ball.radius = 0.5 * (most - least).max_element() * 1.001;
    }
    Some(ball)
}

impl<'a> Sources<'a> {
    pub(super) fn new(frame: &'a Frame) -> Self {
        let targets: Vec<(u32, Ball)> = (0..frame.world.instances().len())
            .filter(|&i| frame.materials_of(i as u32).any(is_smooth))
            .filter_map(|i| Some((i as u32, ball_of(frame, i)?)))
            .collect();
        let mut wide = Vec::new();
        if !frame.media.is_empty() {
            let world = Ball::around(frame.bounds);
            let of_media = |region: &Region| match region {
                Region::Everywhere => None,
                Region::Sphere { center, radius } => Some(Ball { center: *center, radius: *radius }),
                Region::Box { .. } => Ball::around(region.bounds()),
            };
            wide.extend(frame.media.volumes().iter().filter_map(|volume| of_media(&volume.region)));
            wide.extend(world);
        }
        let far = targets.iter().map(|(_, ball)| ball).chain(&wide).map(|b| b.radius * b.radius);
        let disc = PI * far.fold(0.0, f32::max).max(1e-6);
        let lights = &frame.lights;
        let mut weights: Vec<f64> = lights.emitters().iter().map(|e| f64::from(PI * e.strength())).collect();
        weights.extend(lights.deltas().iter().map(|light| {
            f64::from(match light {
                DeltaLight::Point { intensity, .. } => 4.0 * PI * luminance(*intensity),
                DeltaLight::Spot { intensity, cos_outer, .. } => {
                    2.0 * PI * (1.0 - cos_outer) * luminance(*intensity)
                }
                DeltaLight::Directional { irradiance, .. } => disc * luminance(*irradiance),
            })
        }));
        if let Some(environment) = lights.environment() {
            weights.push(f64::from(disc * 4.0 * PI * luminance(environment.mean_radiance())));
        }
        let largest = weights.iter().copied().fold(0.0, f64::max);
        // Dim lights are drawn often enough that no photon of theirs is much stronger than others.
        let weights: Vec<f64> =
            weights.into_iter().map(|w| if w > 0.0 { w.max(0.02 * largest) } else { 0.0 }).collect();
        let choice = Choice::new(&weights).filter(|_| largest > 0.0);
        let mut of_instance: HashMap<u32, f32> = HashMap::new();
        for emitter in lights.emitters() {
            *of_instance.entry(emitter.instance).or_default() += emitter.area();
        }
        let areas = lights.emitters().iter().map(|e| of_instance[&e.instance]).collect();
        Self { frame, choice, targets, wide, areas }
    }

    /// Whether photons could bring anything.
    pub(super) fn are_of_use(&self) -> bool {
        self.choice.is_some() && !(self.targets.is_empty() && self.wide.is_empty())
    }

    /// The box about all media that end, cut to about what there is; for shadows in them.
    pub(super) fn region(&self) -> Option<(Vec3, Vec3)> {
        let media = self.frame.media.volumes().iter();
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for volume in media {
            let (a, b) = match &volume.region {
                Region::Everywhere => self.frame.bounds,
                region => region.bounds(),
            };
            (low, high) = (low.min(a), high.max(b));
        }
        let within = (low.max(self.frame.bounds.0), high.min(self.frame.bounds.1));
        ((within.1 - within.0).min_element() > 0.0).then_some(within)
    }

    /// The balls to aim at.
    fn balls(&self) -> impl Iterator<Item = &Ball> {
        self.targets.iter().map(|(_, ball)| ball).chain(&self.wide)
    }

    /// One ball by a random number, and what is left of the number.
    fn one(&self, u: f32) -> (&Ball, f32) {
        let count = self.targets.len() + self.wide.len();
        let place = u * count as f32;
        let index = (place as usize).min(count - 1);
        let ball = self.targets.get(index).map_or_else(|| &self.wide[index - self.targets.len()], |t| &t.1);
        (ball, place - index as f32)
    }

    /// A direction from a point near, and its density.
    fn aim(&self, from: Vec3, u: f32, v: Vec2) -> (Vec3, f32) {
        // In media light goes everywhere: half of it.
        let anywhere = if self.wide.is_empty() { 0.0 } else { 0.5 };
        let direction = if u < anywhere {
            uniform_sphere(v)
        } else {
            self.one((u - anywhere) / (1.0 - anywhere)).0.direction(from, v)
        };
        let count = (self.targets.len() + self.wide.len()) as f32;
        let of_balls: f32 = self
            .balls()
            .filter(|ball| ball.holds(from, direction))
            .map(|ball| 1.0 / ball.solid_angle(from))
            .sum();
        (direction, anywhere / (4.0 * PI) + (1.0 - anywhere) * of_balls / count)
    }

    /// Where light from far away comes in, and its density over the area across it.
    fn far(&self, towards: Vec3, u: f32, v: Vec2) -> (Vec3, f32) {
        let (x, y) = towards.any_orthonormal_pair();
        let (ball, _) = self.one(u);
        let disc = concentric_disk(v) * ball.radius;
        let through = ball.center + x * disc.x + y * disc.y;
        let count = (self.targets.len() + self.wide.len()) as f32;
        let inside = |ball: &&Ball| {
            let to = through - ball.center;
            (to - towards * to.dot(towards)).length_squared() <= ball.radius * ball.radius
        };
        let pdf: f32 = self.balls().filter(inside).map(|b| 1.0 / (PI * b.radius * b.radius)).sum();
        // Before everything that there is.
        let (low, high) = self.frame.bounds;
        let mut back = low.distance(high) + through.distance(0.5 * (low + high));
        for ball in &self.wide {
            back = back.max(through.distance(ball.center) + ball.radius);
        }
        (through + towards * back, pdf / count)
    }

    /// A photon of `count`, with two sets of random numbers.
    pub(super) fn start(&self, sampler: &mut Sampler, time: f32, count: f32) -> Option<Start> {
        let (u, v) = (sampler.next_four(), sampler.next_four());
        let lights = &self.frame.lights;
        let (index, chosen) = self.choice.as_ref()?.sample(u[0]);
        let share = 1.0 / (chosen * count);
        let (place, aim) = (Vec2::new(u[2], u[3]), Vec2::new(v[2], v[3]));
        let (emitters, deltas) = (lights.emitters(), lights.deltas());
        let ray = |origin, direction| Ray { origin, direction, t_max: f32::INFINITY, time };
        if let Some(emitter) = emitters.get(index) {
            let at = emitter.sample_surface(place, time)?;
            let (direction, pdf) = self.aim(at.point, u[1], aim);
            let radiance = emitter.radiance(at.uv, at.normal, direction);
            let cos = at.normal.dot(direction);
            let two_sided = emitter.material.two_sided;
            if cos <= 0.0 && !two_sided || radiance == Vec3::ZERO || pdf <= 0.0 {
                return None;
            }
            let power = radiance * (cos.abs() * share / (at.pdf * pdf));
            // Off the surface by about what rounding makes of it.
            let away = at.normal * (cos.signum() * 1e-4 * (1.0 + at.point.abs().max_element()) * 0.1);
            let round = matches!(emitter.shape, halflight_scene::lights::EmitterShape::Sphere { .. });
            let area = self.areas[index] * if round { 0.25 } else { cos.abs() };
            let extent = 0.5 * (area / PI).sqrt();
            let beam = near(direction, extent.max(1e-5));
            return power.is_finite().then(|| Start { ray: ray(at.point + away, direction), power, beam });
        }
        if let Some(light) = deltas.get(index - emitters.len()) {
            let from_point = |position: [Vec3; 2], intensity: &dyn Fn(Vec3) -> Vec3| {
                let point = position[0].lerp(position[1], time);
                let (direction, pdf) = self.aim(point, u[1], aim);
                let power = intensity(direction) * (share / pdf);
                let beam = near(direction, 1e-5);
                (power != Vec3::ZERO && power.is_finite()).then(|| Start {
                    ray: ray(point, direction),
                    power,
                    beam,
                })
            };
            return match *light {
                DeltaLight::Point { position, intensity } => from_point(position, &|_| intensity),
                DeltaLight::Spot { position, axis, intensity, cos_inner, cos_outer } => {
                    from_point(position, &|direction| {
                        let share = (direction.dot(axis) - cos_outer) / (cos_inner - cos_outer).max(1e-3);
                        intensity * share.clamp(0.0, 1.0).powi(2)
                    })
                }
                DeltaLight::Directional { towards, irradiance } => {
                    self.arriving(towards, irradiance * share, 1e-9, u[1], aim, time)
                }
            };
        }
        let environment = lights.environment()?;
        let (towards, point, pdf) = environment.sample(place);
        if pdf <= 0.0 {
            return None;
        }
        let radiance = environment.radiance_at(point);
        self.arriving(towards, radiance * (share / pdf), 1.0 / pdf, u[1], aim, time)
    }

    fn arriving(
        &self,
        towards: Vec3,
        irradiance: Vec3,
        solid_angle: f32,
        u: f32,
        v: Vec2,
        time: f32,
    ) -> Option<Start> {
        let (origin, pdf) = self.far(towards, u, v);
        let mut power = irradiance / pdf;
        // A medium without end lets no light of its colours through from without end.
        for volume in self.frame.media.volumes() {
            if volume.region == Region::Everywhere {
                power = Vec3::select(volume.extinction().cmpgt(Vec3::ZERO), Vec3::ZERO, power);
            }
        }
        if power == Vec3::ZERO || !power.is_finite() {
            return None;
        }
        let s = f64::from(solid_angle.clamp(1e-9, 12.6) / (4.0 * PI)).sqrt();
        let nothing = f64::INFINITY;
        let covariance = Covariance5::of_window([nothing, nothing, s, s, nothing]);
        let x = towards.any_orthonormal_vector();
        let beam = Beam { covariance, axes: [x, towards.cross(x)] };
        Some(Start { ray: Ray { origin, direction: -towards, t_max: f32::INFINITY, time }, power, beam })
    }
}

/// Light of a source of this deviation across, which shines about alike within a radian.
fn near(direction: Vec3, extent: f32) -> Beam {
    let (s, nothing) = (f64::from(extent), f64::INFINITY);
    let covariance = Covariance5::of_window([s, s, 1.0, 1.0, nothing]);
    let x = direction.any_orthonormal_vector();
    Beam { covariance, axes: [x, (-direction).cross(x)] }
}
