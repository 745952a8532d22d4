//! The estimator: one path, from the ray that the camera sent to the radiance it brings back.
//!
//! At every vertex light is sought in two ways, by sampling the lights and by sampling the material, and the two are
//! joined by the balance heuristic (Veach 1997, eq. 9.8): what a strategy finds with density p counts p / (p + q),
//! q the density with which the other strategy would have found it. Lights without extent and perfectly smooth
//! materials can be found in one way only and count whole.

use glam::{Vec2, Vec3};
use halflight_scene::Frame;
use halflight_scene::lights::{Arrival, MapPoint};
use halflight_trace::{Hit, Ray};

use super::PathSettings;
use crate::sampler::Sampler;
use crate::vertex::Vertex;

/// A path never survives the roulette with more than this, so that even white enclosures end.
const MAX_SURVIVAL: f32 = 0.95;

/// What all paths of a frame share.
pub(super) struct Integrator<'a> {
    pub(super) frame: &'a Frame,
    pub(super) settings: PathSettings,
}

/// How the ray that is under way was chosen, for the weight of the light it may find.
struct Departure {
    position: Vec3,
    pdf: f32,
}

impl Integrator<'_> {
    /// Radiance along `ray`, whose nearest hit is known. Adds the rays it traces to `rays`.
    pub(super) fn radiance(&self, ray: Ray, hit: Option<Hit>, sampler: &mut Sampler, rays: &mut u64) -> Vec3 {
        let (frame, lights) = (self.frame, &self.frame.lights);
        let (mut ray, mut hit) = (ray, hit);
        let mut radiance = Vec3::ZERO;
        let mut throughput = Vec3::ONE;
        // None after the camera and after smooth surfaces: no light sampling could have found what is found then.
        let mut departure: Option<Departure> = None;
        // Where the ray under way meets the environment if nothing is hit, when that was looked for ahead.
        let mut ahead: Option<MapPoint> = None;
        for depth in 0.. {
            let Some(found) = hit else {
                if let Some(environment) = lights.environment() {
                    let point = ahead.unwrap_or_else(|| environment.locate(ray.direction));
                    let pdf = lights.environment_pdf(point);
                    let weight = departure.map_or(1.0, |d| balance(d.pdf, pdf));
                    radiance += self.bounded(throughput * environment.radiance_at(point) * weight, depth);
                }
                break;
            };
            let vertex = Vertex::new(frame, &ray, &found);
            let emitted = vertex.emitted();
            if emitted != Vec3::ZERO {
                let weight = departure.map_or(1.0, |d| self.weight_of_emitter(&d, &vertex, ray.time));
                radiance += self.bounded(throughput * emitted * weight, depth);
            }
            if depth >= self.settings.max_depth {
                break;
            }
            let u = sampler.next_four();
            if !vertex.bsdf.is_delta_only() {
                let direct = self.direct(&vertex, [u[0], u[1], u[2]], ray.time, rays);
                radiance += self.bounded(throughput * direct, depth + 1);
            }
            let v = sampler.next_four();
            let Some(sample) = vertex.bsdf.sample(vertex.wo, u[3], Vec2::new(v[0], v[1])) else { break };
            let direction = vertex.to_world(sample.wi).normalize();
            if !vertex.same_side(direction, sample.wi) {
                break;
            }
            throughput *= sample.weight;
            if depth >= self.settings.roulette_depth {
                let survival = throughput.max_element().min(MAX_SURVIVAL);
                if v[2] >= survival {
                    break;
                }
                throughput /= survival;
            }
            if throughput == Vec3::ZERO {
                break;
            }
            departure =
                (!sample.delta).then_some(Departure { position: vertex.surface.position, pdf: sample.pdf });
            ray = vertex.surface.spawn(direction, ray.time);
            *rays += 1;
            let is_last = depth + 1 >= self.settings.max_depth;
            if is_last && lights.emitters().is_empty() {
                // Only the environment can be found now: whether anything is in the way is all that matters.
                let Some(environment) = lights.environment() else { break };
                ahead = Some(environment.locate(direction));
                if frame.world.occluded(&ray) {
                    break;
                }
                hit = None;
            } else {
                hit = frame.world.closest(&ray);
            }
        }
        radiance
    }

    /// Radiance towards the eye from one sample of the lights.
    #[inline]
    fn direct(&self, vertex: &Vertex, u: [f32; 3], time: f32, rays: &mut u64) -> Vec3 {
        let (position, lights) = (vertex.surface.position, &self.frame.lights);
        let Some(light) = lights.sample(position, u[2], Vec2::new(u[0], u[1]), time) else {
            return Vec3::ZERO;
        };
        let wi = vertex.to_local(light.direction);
        if !vertex.same_side(light.direction, wi) {
            return Vec3::ZERO;
        }
        let (scattered, pdf) = vertex.bsdf.eval_pdf(vertex.wo, wi);
        if scattered == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let shadow_ray = match light.arrival {
            Arrival::From { radiance, .. } if radiance == Vec3::ZERO => return Vec3::ZERO,
            Arrival::From { point: Some(point), .. } => vertex.surface.spawn_to(point, time),
            _ => vertex.surface.spawn(light.direction, time),
        };
        *rays += 1;
        if self.frame.world.occluded(&shadow_ray) {
            return Vec3::ZERO;
        }
        let radiance = match light.arrival {
            Arrival::Environment(point) => lights.environment().map_or(Vec3::ZERO, |e| e.radiance_at(point)),
            Arrival::From { radiance, .. } => radiance,
        };
        let weight = if light.delta { 1.0 } else { balance(light.pdf, pdf) };
        scattered * radiance * (weight / light.pdf)
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

    /// The contribution of light that was scattered `depth` times, with indirect light clamped if that is asked for.
    #[inline]
    fn bounded(&self, contribution: Vec3, depth: u32) -> Vec3 {
        match self.settings.clamp {
            Some(limit) if depth > 1 => {
                let largest = contribution.max_element();
                if largest > limit { contribution * (limit / largest) } else { contribution }
            }
            _ => contribution,
        }
    }
}

/// The balance heuristic for one sample of each strategy. Written as a ratio, so that large densities do not
/// overflow; an infinite one, of a light too small to see, wins. (The power heuristic was measured to be worse on
/// the reference scenes, by a fifth.)
#[inline]
fn balance(own: f32, other: f32) -> f32 {
    if own.is_infinite() { 1.0 } else { 1.0 / (1.0 + other / own) }
}
