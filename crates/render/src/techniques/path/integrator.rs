//! What the estimator is made of: the parts that a path alone and the paths of a block have in common.
//!
//! At every vertex light is sought in two ways, by sampling the lights and by sampling the material, and the two are
//! joined by the balance heuristic (Veach 1997, eq. 9.8): what a strategy finds with density p counts p / (p + q),
//! q the density with which the other strategy would have found it. Lights without extent and perfectly smooth
//! materials can be found in one way only and count whole.

use glam::{Vec2, Vec3};
use halflight_scene::Frame;
use halflight_scene::lights::{Arrival, LightSample, MapPoint};
use halflight_trace::{Hit, Ray};

use super::PathSettings;
use crate::cutouts::Cutouts;
use crate::tracking::{self, Collision, Stream};
use crate::vertex::Vertex;

/// A path never survives the roulette with more than this, so that even white enclosures end.
const MAX_SURVIVAL: f32 = 0.95;

/// What all paths of a frame share.
pub(in crate::techniques) struct Integrator<'a> {
    pub(in crate::techniques) frame: &'a Frame,
    pub(in crate::techniques) settings: PathSettings,
    pub(in crate::techniques) cutouts: Cutouts,
    /// Whether there is anything between surfaces.
    pub(in crate::techniques) in_media: bool,
}

/// How the ray that is under way was chosen, for the weight of the light it may find.
#[derive(Clone, Copy)]
pub(in crate::techniques) struct Departure {
    position: Vec3,
    pdf: f32,
}

impl Departure {
    /// The density of the direction.
    pub(in crate::techniques) fn pdf(&self) -> f32 {
        self.pdf
    }
}

impl<'a> Integrator<'a> {
    pub(in crate::techniques) fn new(frame: &'a Frame, settings: PathSettings) -> Self {
        Self { frame, settings, cutouts: Cutouts::of(frame), in_media: !frame.media.is_empty() }
    }
}

impl Integrator<'_> {
    /// Where a ray scatters in a medium before it comes to `hit`; `stopped` is the ray that the hit belongs to, which begins
    /// later on `ray` if that has passed a hole.
    pub(in crate::techniques) fn collision(
        &self,
        ray: &Ray,
        stopped: &Ray,
        hit: Option<&Hit>,
        u: [f32; 4],
        throughput: &mut Vec3,
    ) -> Option<Collision> {
        let end = hit.map_or(f32::INFINITY, |hit| (stopped.at(hit.t) - ray.origin).dot(ray.direction));
        tracking::collide(&self.frame.media, ray, end, &mut Stream::new(u), throughput)
    }

    /// How much of the light of a shadow ray media let pass.
    pub(in crate::techniques) fn transmittance(&self, ray: &Ray, u: [f32; 4]) -> Vec3 {
        tracking::transmittance(&self.frame.media, ray, &mut Stream::new(u))
    }

    /// What a path brings whose ray met nothing but the environment.
    #[inline]
    pub(in crate::techniques) fn escaped(
        &self,
        throughput: Vec3,
        departure: Option<&Departure>,
        (point, radiance): (MapPoint, Vec3),
        depth: u32,
    ) -> Vec3 {
        let weight = departure.map_or(1.0, |d| balance(d.pdf, self.frame.lights.environment_pdf(point)));
        self.bounded(throughput * radiance * weight, depth)
    }

    /// What a path brings from a surface that shines.
    #[inline]
    pub(in crate::techniques) fn emitted_by(
        &self,
        vertex: &Vertex,
        throughput: Vec3,
        departure: Option<&Departure>,
        time: f32,
        depth: u32,
    ) -> Vec3 {
        let emitted = vertex.emitted();
        if emitted == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let weight = departure.map_or(1.0, |d| self.weight_of_emitter(d, vertex, time));
        self.bounded(throughput * emitted * weight, depth)
    }

    fn weight_of_emitter(&self, departure: &Departure, vertex: &Vertex, time: f32) -> f32 {
        let surface = &vertex.surface;
        match self.frame.lights.emitter_of(surface.instance, surface.primitive) {
            Some(emitter) => {
                let (point, normal) = (surface.position, surface.geometric_normal);
                let pdf = self.frame.lights.emitter_pdf(emitter, departure.position, point, normal, time);
                balance(departure.pdf, pdf)
            }
            None => 1.0,
        }
    }

    /// Where a path goes on by a sample of the material, with its throughput brought up to date; `None` where it ends.
    #[inline]
    pub(in crate::techniques) fn next(
        &self,
        vertex: &Vertex,
        u_lobe: f32,
        u: Vec2,
        u_roulette: f32,
        depth: u32,
        throughput: &mut Vec3,
    ) -> Option<(Vec3, Option<Departure>)> {
        let sample = vertex.bsdf.sample(vertex.wo, u_lobe, u)?;
        let direction = vertex.to_world(sample.wi).normalize();
        if !vertex.same_side(direction, sample.wi) {
            return None;
        }
        *throughput *= sample.weight;
        if depth >= self.settings.roulette_depth {
            let survival = throughput.max_element().min(MAX_SURVIVAL);
            if u_roulette >= survival {
                return None;
            }
            *throughput /= survival;
        }
        if *throughput == Vec3::ZERO {
            return None;
        }
        let departure = Departure { position: vertex.surface.position, pdf: sample.pdf };
        Some((direction, (!sample.delta).then_some(departure)))
    }

    /// Radiance towards the eye from one sample of the lights.
    pub(in crate::techniques) fn direct(
        &self,
        vertex: &Vertex,
        u: [f32; 3],
        passage: [f32; 4],
        time: f32,
    ) -> Vec3 {
        let lights = &self.frame.lights;
        let light = lights.sample(vertex.surface.position, u[2], Vec2::new(u[0], u[1]), time);
        let Some(light) = light else { return Vec3::ZERO };
        let Some((scattered, scale)) = scattered(vertex, &light) else { return Vec3::ZERO };
        let ray = shadow_ray(vertex, &light, time);
        let blocked = self.frame.world.occluded(&ray);
        if blocked && (!self.cutouts.any || self.cutouts.blocked(self.frame, &ray)) {
            return Vec3::ZERO;
        }
        let radiance = match light.arrival {
            Arrival::Environment(point) => lights.environment().map_or(Vec3::ZERO, |e| e.radiance_at(point)),
            Arrival::From { radiance, .. } => radiance,
        };
        let direct = scattered * radiance * scale;
        if self.in_media { direct * self.transmittance(&ray, passage) } else { direct }
    }

    /// The contribution of light that was scattered `depth` times, with indirect light clamped if that is asked for.
    #[inline]
    pub(in crate::techniques) fn bounded(&self, contribution: Vec3, depth: u32) -> Vec3 {
        match self.settings.clamp {
            Some(limit) if depth > 1 => {
                let largest = contribution.max_element();
                if largest > limit { contribution * (limit / largest) } else { contribution }
            }
            _ => contribution,
        }
    }
}

/// What a vertex scatters to the eye of the light that a sample found, and what that sample counts; `None` if nothing.
#[inline]
pub(in crate::techniques) fn scattered(vertex: &Vertex, light: &LightSample) -> Option<(Vec3, f32)> {
    if matches!(light.arrival, Arrival::From { radiance: Vec3::ZERO, .. }) {
        return None;
    }
    let wi = vertex.to_local(light.direction);
    if !vertex.same_side(light.direction, wi) {
        return None;
    }
    let (scattered, pdf) = vertex.bsdf.eval_pdf(vertex.wo, wi);
    let weight = if light.delta { 1.0 } else { balance(light.pdf, pdf) };
    (scattered != Vec3::ZERO).then_some((scattered, weight / light.pdf))
}

/// The ray that must meet nothing for light to arrive.
#[inline]
pub(in crate::techniques) fn shadow_ray(vertex: &Vertex, light: &LightSample, time: f32) -> Ray {
    match light.arrival {
        Arrival::From { point: Some(point), .. } => vertex.surface.spawn_to(point, time),
        _ => vertex.surface.spawn(light.direction, time),
    }
}

/// The balance heuristic for one sample of each strategy. Written as a ratio, so that large densities do not
/// overflow; an infinite one, of a light too small to see, wins. (The power heuristic was measured to be worse on
/// the reference scenes, by a fifth.)
#[inline]
fn balance(own: f32, other: f32) -> f32 {
    if own.is_infinite() { 1.0 } else { 1.0 / (1.0 + other / own) }
}
