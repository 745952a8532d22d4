//! One path, from the ray that the camera sent to the radiance it brings back: the estimator in its plainest form, which
//! the paths of a [`block`](super::block) are held against.

use glam::{Vec2, Vec3};
use halflight_trace::{Hit, Ray};

use super::integrator::{Departure, Integrator};
use crate::sampler::Sampler;
use crate::vertex::Vertex;

impl Integrator<'_> {
    /// Radiance along `ray`, whose nearest hit is known.
    pub(super) fn radiance_alone(&self, mut ray: Ray, mut hit: Option<Hit>, sampler: &mut Sampler) -> Vec3 {
        let (frame, lights) = (self.frame, &self.frame.lights);
        let mut radiance = Vec3::ZERO;
        let mut throughput = Vec3::ONE;
        let mut departure: Option<Departure> = None;
        for depth in 0.. {
            let sent = ray;
            hit = self.cutouts.stopping(frame, &mut ray, hit);
            let collision = if self.in_media {
                self.collision(&sent, &ray, hit.as_ref(), sampler.next_four(), &mut throughput)
            } else {
                None
            };
            if hit.is_none() && collision.is_none() {
                if let Some(environment) = lights.environment() {
                    let point = environment.locate(ray.direction);
                    let found = (point, environment.radiance_at(point));
                    radiance += self.escaped(throughput, departure.as_ref(), found, depth);
                }
                break;
            }
            let vertex = match (collision, &hit) {
                (Some(collision), _) => Vertex::in_medium(frame, &sent, collision.t, collision.anisotropy),
                (None, Some(found)) => Vertex::stopped(frame, &ray, found),
                (None, None) => break,
            };
            radiance += self.emitted_by(&vertex, throughput, departure.as_ref(), ray.time, depth);
            if depth >= self.settings.max_depth {
                break;
            }
            let u = sampler.next_four();
            let passage = if self.in_media { sampler.next_four() } else { [0.0; 4] };
            let v = sampler.next_four();
            if !vertex.bsdf.is_delta_only() {
                let direct = self.direct(&vertex, [u[0], u[1], u[2]], passage, ray.time);
                radiance += self.bounded(throughput * direct, depth + 1);
            }
            let next = self.next(&vertex, u[3], Vec2::new(v[0], v[1]), v[2], depth, &mut throughput);
            let Some((direction, from)) = next else { break };
            departure = from;
            ray = vertex.surface.spawn(direction, ray.time);
            hit = frame.world.closest(&ray);
        }
        radiance
    }
}
