//! A photon's way from its light to where it is kept, with the covariance of the light that it stands for.
//!
//! On surfaces photons are kept that came to them over smooth surfaces alone (light that paths from the eye find badly); in media
//! all are. Power goes by the samples of the materials, with their adjoint: radiance gains n² where power does not, and
//! interpolated normals change sides (Veach 1997, §5.3.2).

use std::f64::consts::PI;

use glam::{Vec2, Vec3};
use halflight_frequency::covariance::Covariance5;
use halflight_scene::lights::luminance;
use halflight_trace::DistanceGrid;

use super::super::look::velocity;
use super::super::pilot::bend;
use super::super::products::facet_slopes;
use super::super::trail::{Meeting, Note, lobe, meet, note, scatter_to};
use super::emit::Sources;
use crate::sampler::Sampler;
use crate::techniques::path::integrator::Integrator;
use crate::vertex::Vertex;

/// The least part of a target's radius that a ray is taken to pass inside its outline.
const RIM: f32 = 0.05;
/// How far about a photon its light is known to first order, as a share d of its last way: the deviation of the Gaussian
/// whose relative Laplacian is that of what spreads from a point. On a plane across it cos θ/d² has −8/d², a Gaussian −2/σ².
/// (In space 1/d² would allow 1.2; kernels so wide gained nothing and lost light at borders.)
const TRUSTED: f64 = 0.5;

/// A photon where it is kept.
#[derive(Clone, Copy, Debug)]
pub(super) struct Landed {
    pub(super) position: Vec3,
    /// Unit direction to where it came from.
    pub(super) towards: Vec3,
    pub(super) power: Vec3,
    /// Of the surface, on the side of the light; zero in a medium.
    pub(super) normal: Vec3,
    /// The medium's mean cosine.
    pub(super) anisotropy: f32,
    /// Scatterings before this place.
    pub(super) depth: u32,
    /// Its number among those that set out.
    pub(super) number: u32,
    /// Across its way.
    pub(super) axes: [Vec3; 2],
    /// [xx, xy, yy] of the inverse covariance of its light's irradiance there, 1/m².
    pub(super) precision: [f32; 3],
    /// The same along its way.
    pub(super) along: f32,
}

/// What a flight needs to know.
pub(super) struct Flights<'a> {
    pub(super) integrator: &'a Integrator<'a>,
    pub(super) sources: &'a Sources<'a>,
    /// What is near in media, for shadows' edges.
    pub(super) near: Option<&'a DistanceGrid>,
    /// Whether covariance is wanted.
    pub(super) carry: bool,
    /// Size of the scene, metres.
    pub(super) size: f32,
}

impl Flights<'_> {
    /// Sends photon `number` of `count` on its way; adds what is kept of it to `landed`.
    pub(super) fn fly(
        &self,
        number: u32,
        count: f32,
        time: f32,
        sampler: &mut Sampler,
        landed: &mut Vec<Landed>,
        mut steps: Note,
    ) {
        let Integrator { frame, settings, cutouts, in_media } = self.integrator;
        let Some(start) = self.sources.start(sampler, time, count) else { return };
        let (mut ray, mut power, mut beam) = (start.ray, start.power, start.beam);
        note(&mut steps, &beam.covariance, || "light".into());
        let (mut smooth, mut turned) = (true, false);
        for depth in 0..settings.max_depth {
            let sent = ray;
            let hit = frame.world.closest(&ray);
            let hit = cutouts.stopping(frame, &mut ray, hit);
            let collision = if *in_media {
                self.integrator.collision(&sent, &ray, hit.as_ref(), sampler.next_four(), &mut power)
            } else {
                None
            };
            let vertex = match (collision, &hit) {
                (Some(at), _) => Vertex::in_medium(frame, &sent, at.t, at.anisotropy),
                (None, Some(hit)) => Vertex::stopped(frame, &ray, hit),
                (None, None) => return,
            };
            let position = vertex.surface.position;
            let way = position.distance(sent.origin);
            let distance = f64::from(way);
            if self.carry {
                let near = self.near.filter(|_| *in_media).map(|grid| grid.open_disc(&sent, 0.0, way));
                let disc = near.filter(|(disc, _)| disc.is_finite() && *disc < way);
                if let Some((disc, at)) = disc {
                    let at = f64::from(at);
                    let disc = f64::from(disc.max(1e-3));
                    beam.covariance = beam.covariance.travel(at).occlude(disc).travel(distance - at);
                    note(&mut steps, &beam.covariance, || {
                        format!("travel {distance:.3} m, past something {disc:.3} m away")
                    });
                } else {
                    beam.covariance = beam.covariance.travel(distance);
                    note(&mut steps, &beam.covariance, || format!("travel {distance:.3} m"));
                }
                if depth == 0
                    && collision.is_none()
                    && let Some((_, ball)) =
                        self.sources.targets.iter().find(|(instance, _)| *instance == vertex.surface.instance)
                {
                    let rim = ball.margin(&sent).max(RIM * ball.radius);
                    beam.covariance = beam.covariance.occlude(f64::from(rim));
                    note(&mut steps, &beam.covariance, || format!("outline {rim:.3} m away"));
                }
            }
            let kept = Landed {
                position,
                towards: vertex.towards_eye,
                power,
                normal: Vec3::ZERO,
                anisotropy: 0.0,
                depth,
                number,
                axes: beam.axes,
                precision: [0.0; 3],
                along: 0.0,
            };
            let reach = if distance.is_finite() { distance } else { f64::from(self.size) };
            let known = TRUSTED * reach.min(f64::from(self.size));
            if let Some(at) = collision {
                landed.push(Landed {
                    anisotropy: at.anisotropy,
                    precision: if self.carry { irradiance(&beam.covariance, 1.0, known) } else { [0.0; 3] },
                    along: (1.0 / (known * known)) as f32,
                    ..kept
                });
            } else if smooth && turned && !vertex.bsdf.is_delta_only() {
                let normal = vertex.surface.geometric_normal;
                let facing = if normal.dot(kept.towards) < 0.0 { -normal } else { normal };
                let cos = f64::from(facing.dot(kept.towards));
                landed.push(Landed {
                    normal: facing,
                    precision: if self.carry { irradiance(&beam.covariance, cos, known) } else { [0.0; 3] },
                    ..kept
                });
            }
            let (u, v) = (sampler.next_four(), sampler.next_four());
            let Some(sample) = vertex.bsdf.sample(vertex.wo, u[3], Vec2::new(v[0], v[1])) else { return };
            if !sample.delta && !*in_media {
                // Nothing beyond is kept.
                return;
            }
            let direction = vertex.to_world(sample.wi).normalize();
            if !vertex.same_side(direction, sample.wi) {
                return;
            }
            let mut weight = sample.weight;
            let ratio = if sample.transmitted { vertex.bsdf.index_beyond(vertex.wo) } else { 1.0 };
            weight *= ratio * ratio;
            if collision.is_none() {
                let (shading, geometric) = (vertex.shading_normal(), vertex.surface.geometric_normal);
                let (from, to) = (vertex.towards_eye, direction);
                let by = (from.dot(shading) * to.dot(geometric)) / (from.dot(geometric) * to.dot(shading));
                weight *= by.abs().min(10.0);
            }
            let survival = weight.max_element().min(1.0);
            // False for NaN too.
            let lives = v[2] < survival;
            if !lives {
                return;
            }
            power *= weight / survival;
            if self.carry {
                let (incoming, outgoing) = (vertex.towards_eye, direction);
                if let Some(at) = collision {
                    scatter_to(&mut beam, incoming, outgoing, at.anisotropy, &mut steps);
                } else {
                    let through =
                        incoming.dot(vertex.shading_normal()) * outgoing.dot(vertex.shading_normal()) < 0.0;
                    let bend =
                        hit.as_ref().and_then(|hit| bend(frame, &vertex, hit, ray.time, way)).map(|bend| {
                            // As seen from where the light goes.
                            let side = if through { -1.0 } else { 1.0 };
                            bend.map(|[step, turn]| [step, side * turn])
                        });
                    let meeting = Meeting {
                        name: &vertex.material.name,
                        normal: vertex.shading_normal(),
                        incoming,
                        outgoing,
                        velocity: velocity(frame, vertex.surface.instance, position, ray.time),
                        ratio: through.then_some(1.0 / ratio),
                        delta: sample.delta,
                        painted: None,
                        facets: facet_slopes(vertex.material, vertex.surface.uv),
                    };
                    let scattered =
                        |d: Vec3| luminance(vertex.bsdf.eval(vertex.to_local(d), vertex.to_local(outgoing)));
                    let lobe = |axes| lobe(incoming, axes, scattered);
                    meet(&mut beam, &meeting, bend.as_ref(), lobe, &mut steps);
                }
            }
            (smooth, turned) = (smooth && sample.delta, true);
            ray = vertex.surface.spawn(direction, ray.time);
        }
    }
}

/// The inverse covariance of the irradiance that light of this spectrum makes, across its way: angles and the shutter integrated,
/// and a window of `known` metres, beyond which it tells nothing.
fn irradiance(light: &Covariance5, cos: f64, known: f64) -> [f32; 3] {
    let cos = cos.max(0.1);
    let seen = light.windowed(2, cos * cos).windowed(3, 1.0).windowed(4, 1.0 / 12.0);
    let seen = seen.integrated(4).integrated(3).integrated(2);
    let (four_pi_squared, beyond) = (4.0 * PI * PI, 1.0 / (known * known).max(1e-12));
    let [xx, xy, yy] = [seen.rows[0][0], seen.rows[0][1], seen.rows[1][1]].map(|v| four_pi_squared * v);
    [(xx + beyond) as f32, xy as f32, (yy + beyond) as f32]
}
