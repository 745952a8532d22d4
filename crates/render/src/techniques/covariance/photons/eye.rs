//! Paths from the eye that leave to photons what photons find better.
//!
//! Light is parted by its way, each way counted once: what comes to a surface over smooth surfaces alone is the photons'; and on the
//! way from the eye to the first surface that is not smooth, all that a medium scatters. All else is that of `path`.

use glam::{Vec2, Vec3};
use halflight_material::Bsdf;
use halflight_scene::lights::luminance;
use halflight_trace::Ray;

use super::super::spread::Spread;
use super::Photons;
use super::kernel::Photon;
use crate::sampler::Sampler;
use crate::techniques::path::integrator::{Departure, Integrator};
use crate::tracking::{Passage, Stream};
use crate::vertex::Vertex;

/// What a path brought.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::techniques::covariance) struct Seen {
    pub(super) radiance: Vec3,
    /// Luminance that photons brought, and the same times their radius.
    pub(in crate::techniques::covariance) of_photons: f32,
    pub(in crate::techniques::covariance) radii: f32,
}

impl Seen {
    fn add(&mut self, brought: Vec3, photon: &Photon) {
        self.radiance += brought;
        let weight = luminance(brought);
        if weight.is_finite() {
            self.of_photons += weight;
            self.radii += weight * photon.radius;
        }
    }
}

/// What a path from the eye needs to know.
pub(super) struct Eye<'a> {
    pub(super) integrator: &'a Integrator<'a>,
    pub(super) photons: &'a Photons,
}

impl Eye<'_> {
    /// What comes along a ray of the camera. `told` hears of the photons and what each brought.
    pub(super) fn look(
        &self,
        mut ray: Ray,
        sampler: &mut Sampler,
        mut spread: Option<(Spread, u32)>,
        passage: &mut Passage,
        mut told: impl FnMut(&Photon, f32),
    ) -> Seen {
        let Integrator { frame, settings, cutouts, in_media } = self.integrator;
        let lights = &frame.lights;
        let mut seen = Seen::default();
        let mut throughput = Vec3::ONE;
        let mut departure: Option<Departure> = None;
        // Whether the path has met but smooth surfaces so far.
        let mut open = true;
        // Smooth surfaces since the last one that was not; none after a medium.
        let mut smooth: Option<u32> = None;
        for depth in 0.. {
            let sent = ray;
            let hit = frame.world.closest(&ray);
            let hit = cutouts.stopping(frame, &mut ray, hit);
            let mut collision = None;
            if *in_media && open && self.photons.complete {
                let u = sampler.next_four();
                let end = hit.map_or(f32::INFINITY, |hit| (ray.at(hit.t) - sent.origin).dot(sent.direction));
                passage.walk(&frame.media, &Ray { t_max: end, ..sent }, &mut Stream::new(u));
                if depth < settings.max_depth {
                    let within = passage.within();
                    self.photons.in_media.beside(
                        sent.origin,
                        sent.direction,
                        within,
                        |photon, amount, places| {
                            if depth + 1 + photon.depth > settings.max_depth {
                                return;
                            }
                            let cos = -sent.direction.dot(photon.towards);
                            let wi = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
                            let phase = Bsdf::phase(photon.anisotropy).eval(Vec3::Z, wi);
                            let passed = passage.at(places[0]) + passage.at(places[1]);
                            let brought = throughput * photon.power * (phase * amount * 0.5) * passed;
                            seen.add(brought, photon);
                            told(photon, luminance(brought));
                        },
                    );
                }
                throughput *= passage.at(end);
            } else if *in_media {
                let u = sampler.next_four();
                collision = self.integrator.collision(&sent, &ray, hit.as_ref(), u, &mut throughput);
            }
            let left_out = smooth.is_some_and(|count| count > 0) && self.photons.complete;
            if hit.is_none() && collision.is_none() {
                if let Some(environment) = lights.environment()
                    && !left_out
                {
                    let point = environment.locate(ray.direction);
                    let shown = (point, environment.radiance_at(point));
                    seen.radiance += self.integrator.escaped(throughput, departure.as_ref(), shown, depth);
                }
                break;
            }
            let mut met = None;
            let vertex = match (collision, &hit) {
                (Some(at), _) => Vertex::in_medium(frame, &sent, at.t, at.anisotropy),
                (None, Some(hit)) => match &mut spread {
                    None => Vertex::stopped(frame, &ray, hit),
                    Some((spread, _)) => {
                        let surface = frame.world.surface(&ray, hit);
                        let way = surface.position.distance(sent.origin);
                        let (footprint, found) = spread.arrive(frame, &ray, hit, &surface, way);
                        met = Some(found);
                        Vertex::stopped_over(frame, &ray, surface, footprint)
                    }
                },
                (None, None) => break,
            };
            if !left_out {
                seen.radiance +=
                    self.integrator.emitted_by(&vertex, throughput, departure.as_ref(), ray.time, depth);
            }
            if depth >= settings.max_depth {
                break;
            }
            let u = sampler.next_four();
            let through = if *in_media { sampler.next_four() } else { [0.0; 4] };
            let v = sampler.next_four();
            if !vertex.bsdf.is_delta_only() {
                let direct = self.integrator.direct(&vertex, [u[0], u[1], u[2]], through, ray.time);
                seen.radiance += self.integrator.bounded(throughput * direct, depth + 1);
                if collision.is_none() {
                    self.gather(&vertex, throughput, depth, &mut seen, &mut told);
                }
            }
            let next =
                self.integrator.next(&vertex, u[3], Vec2::new(v[0], v[1]), v[2], depth, &mut throughput);
            let Some((direction, from)) = next else { break };
            if let Some((spread, index)) = &mut spread {
                let pdf = from.as_ref().map(Departure::pdf);
                match (&met, pdf) {
                    (Some(met), pdf) => spread.leave(&vertex, met, direction, pdf, *index),
                    (None, pdf) => {
                        spread.travel(vertex.surface.position.distance(sent.origin));
                        spread.scatter(direction, pdf.unwrap_or(1.0), *index);
                    }
                }
            }
            let is_smooth = from.is_none();
            open &= is_smooth;
            smooth = match (collision.is_some(), is_smooth) {
                (true, _) => None,
                (false, false) => Some(0),
                (false, true) => smooth.map(|count| count + 1),
            };
            departure = from;
            ray = vertex.surface.spawn(direction, ray.time);
        }
        seen
    }

    /// Light that photons brought to a surface.
    fn gather(
        &self,
        vertex: &Vertex,
        throughput: Vec3,
        depth: u32,
        seen: &mut Seen,
        told: &mut impl FnMut(&Photon, f32),
    ) {
        let normal = vertex.surface.geometric_normal;
        let most = self.integrator.settings.max_depth;
        self.photons.on_surfaces.about(vertex.surface.position, |photon| {
            if depth + 1 + photon.depth > most || photon.normal.dot(normal).abs() < 0.5 {
                return;
            }
            let local = vertex.to_local(photon.towards);
            if !vertex.same_side(photon.towards, local) {
                return;
            }
            // Their power went through the surface as it is: the cosine of the material is replaced by none.
            let cos = photon.towards.dot(normal).abs().max(0.02);
            let scattered = vertex.bsdf.eval(vertex.wo, local) / cos;
            let brought = throughput * scattered * photon.power * photon.at(vertex.surface.position);
            seen.add(brought, photon);
            told(photon, luminance(brought));
        });
    }
}
