//! Pilot paths: those of `path`, with the same estimator, that also say how fast their light varies at the film.

use std::f64::consts::PI;

use glam::{Vec2, Vec3};
use halflight_frequency::covariance::{
    Covariance5, Mean, Steps, remaining, sampling_density, spatial_block, variance_within,
};
use halflight_scene::Frame;
use halflight_scene::lights::{Arrival, LightSample, luminance};
use halflight_trace::{Hit, Ray};

use super::super::path::integrator::{Departure, Integrator, scattered, shadow_ray};
use super::film_axes::FilmAxes;
use super::lamps::{Lamps, Origin, Place};
use super::trail::{MOST, Node, carried};
use crate::sampler::Sampler;
use crate::vertex::Vertex;

/// What the pilots of a place found about it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    /// Mean covariance at the film, edges left out.
    pub(super) covariance: Mean<5>,
    /// The part of its weight that comes from surfaces: what a medium sends on the way is not cut by their edges.
    pub(super) of_surfaces: f64,
}

impl Found {
    /// Adds what others have found.
    pub(super) fn merge(&mut self, other: &Self) {
        self.covariance.merge(&other.covariance);
        self.of_surfaces += other.of_surfaces;
    }

    /// All together, with what an edge adds to the light of surfaces.
    pub(super) fn beside(&self, edge: &Covariance5) -> Covariance5 {
        let total = self.covariance.weight;
        let share = if total > 0.0 { (self.of_surfaces / total).clamp(0.0, 1.0) } else { 1.0 };
        let edge = Covariance5 { rows: edge.rows.map(|row| row.map(|v| v * share)) };
        self.covariance.covariance().plus(&edge)
    }
}

/// What follows for samples and filter.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Forecast {
    /// S = [xx, xy, yy] of the widest filter, in 1/pixels².
    pub(super) precision: [f32; 3],
    /// The same as if there were no edges.
    pub(super) open: [f32; 3],
    /// The share of the light's square that samples of this pixel, lens and shutter differ by.
    pub(super) varies: f32,
    /// √det of the spatial block, cycles per pixel squared.
    pub(super) density: f32,
    /// How many samples the lens and the shutter ask for, each by itself: √det(1 + 4π² W Σ) of its block; 1 where nothing varies.
    pub(super) lens: f32,
    pub(super) shutter: f32,
}

/// What the covariance at the film, and an edge there, ask for.
pub(super) fn forecast(found: &Found, edge: &Covariance5, axes: &FilmAxes) -> Forecast {
    let windows = axes.windows();
    let covariance = &found.beside(edge);
    // Lens and shutter are integrated; a pinhole's lens has nothing to integrate, so the block stands as it is.
    let widest = |covariance: &Covariance5| {
        let picture = remaining(covariance, &windows);
        spatial_block(&picture).map(|v| (4.0 * PI * PI * v) as f32)
    };
    let over = |axes: std::ops::Range<usize>| {
        let mut w = [0.0; 5];
        w[axes.clone()].copy_from_slice(&windows[axes]);
        (1.0 / (1.0 - variance_within(covariance, &w)).max(1e-6)) as f32
    };
    Forecast {
        precision: widest(covariance),
        open: widest(&found.covariance.covariance()),
        varies: variance_within(covariance, &windows) as f32,
        density: sampling_density(spatial_block(covariance)) as f32,
        lens: over(2..4),
        shutter: over(4..5),
    }
}

/// Paths of which one is walked to the eye, as likely as what it brings: in the mean all are, and carrying costs each of them
/// its share of one walk.
#[derive(Default)]
pub(super) struct Group<'a> {
    /// Vertices of the path under way, and of the one that will be walked.
    nodes: Vec<Node<'a>>,
    kept: Vec<Node<'a>>,
    /// Its light, and the direction in which it left the eye.
    begin: Option<(Origin, Vec3)>,
    /// What all bring together, and from surfaces.
    weight: f32,
    of_surfaces: f32,
    state: u64,
}

impl Group<'_> {
    /// Takes the path under way or leaves it.
    fn offer(&mut self, chosen: &Chosen, first: Vec3) {
        let Some((origin, length)) = chosen.origin else { return };
        self.weight += chosen.weight;
        if length == 0 || self.nodes.first().is_none_or(|node| node.anisotropy.is_none()) {
            self.of_surfaces += chosen.weight;
        }
        let u = random(&mut self.state, chosen.state);
        if self.begin.is_some() && u * self.weight >= chosen.weight {
            return;
        }
        self.nodes.truncate(length);
        if chosen.direct
            && let Some(last) = self.nodes.last_mut()
        {
            // Where the path went on from there is not where this light came from.
            last.delta = false;
        }
        std::mem::swap(&mut self.nodes, &mut self.kept);
        self.begin = Some((origin, first));
    }
}

/// A number in [0, 1) from a state, which goes on.
fn random(state: &mut u64, salt: u64) -> f32 {
    *state = (*state ^ salt).wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 40) as f32 / (1u64 << 24) as f32
}

/// What pilots need to know.
pub(super) struct Pilots<'a> {
    pub(super) integrator: Integrator<'a>,
    pub(super) axes: &'a FilmAxes,
    pub(super) lamps: &'a Lamps<'a>,
    /// Off to measure what carrying covariance costs.
    pub(super) carry: bool,
}

/// One of the lights that a path finds, as likely as what it brings: the mean over paths is that of all of them, weighted by
/// what they bring, and a path walks to the eye but once.
struct Chosen {
    /// Where it is, and how many vertices lead to it.
    origin: Option<(Origin, usize)>,
    /// What all bring together.
    weight: f32,
    /// Whether it was found by sampling the lights.
    direct: bool,
    state: u64,
}

impl Chosen {
    /// Chance comes from the path's first direction: none of its random numbers are used up.
    fn new(first: Vec3) -> Self {
        let [x, y, z] = first.to_array().map(|v| u64::from(v.to_bits()));
        Self { origin: None, weight: 0.0, direct: false, state: x ^ y << 21 ^ z << 42 }
    }

    /// Takes a light or leaves it; says which.
    fn offer(&mut self, origin: Origin, weight: f32, length: usize) -> bool {
        self.weight += weight;
        let u = random(&mut self.state, 0);
        let taken = self.origin.is_none() || u * self.weight < weight;
        if taken {
            (self.origin, self.direct) = (Some((origin, length)), false);
        }
        taken
    }
}

impl<'a> Pilots<'a> {
    /// The radiance along a ray, as the technique `path` finds it; the path joins the group. `steps` takes down the events of the
    /// strongest contribution.
    pub(super) fn trace(
        &self,
        ray: Ray,
        sampler: &mut Sampler,
        group: &mut Group<'a>,
        mut steps: Option<&mut (f32, Steps<5>)>,
    ) -> Vec3 {
        let Integrator { frame, settings, cutouts, in_media } = &self.integrator;
        let lights = &frame.lights;
        let first = ray.direction;
        let mut ray = ray;
        let mut hit = frame.world.closest(&ray);
        let mut radiance = Vec3::ZERO;
        let mut throughput = Vec3::ONE;
        let mut departure: Option<Departure> = None;
        let nodes = &mut group.nodes;
        nodes.clear();
        let mut chosen = Chosen::new(first);
        let mut strongest = |nodes: &[Node<'a>], origin: Origin, weight: f32| {
            if let Some((most, steps)) = &mut steps
                && weight > *most
            {
                *most = weight;
                *steps = Steps::default();
                carried(frame, nodes, &self.lamps.source(&origin), first, self.axes, Some(steps));
            }
        };
        let weight_of = |brought: Vec3| {
            let weight = luminance(brought);
            if self.carry && weight > 0.0 && weight.is_finite() { weight } else { 0.0 }
        };
        for depth in 0.. {
            let sent = ray;
            hit = cutouts.stopping(frame, &mut ray, hit);
            let collision = if *in_media {
                self.integrator.collision(&sent, &ray, hit.as_ref(), sampler.next_four(), &mut throughput)
            } else {
                None
            };
            if hit.is_none() && collision.is_none() {
                if let Some(environment) = lights.environment() {
                    let point = environment.locate(ray.direction);
                    let shown = (point, environment.radiance_at(point));
                    let brought = self.integrator.escaped(throughput, departure.as_ref(), shown, depth);
                    radiance += brought;
                    let weight = weight_of(brought);
                    if weight > 0.0 && nodes.len() == depth as usize {
                        let origin = Origin::Sky(ray.direction);
                        chosen.offer(origin, weight, nodes.len());
                        strongest(nodes, origin, weight);
                    }
                }
                break;
            }
            let vertex = match (collision, &hit) {
                (Some(at), _) => Vertex::in_medium(frame, &sent, at.t, at.anisotropy),
                (None, Some(hit)) => Vertex::stopped(frame, &ray, hit),
                (None, None) => break,
            };
            let emitted =
                self.integrator.emitted_by(&vertex, throughput, departure.as_ref(), ray.time, depth);
            radiance += emitted;
            let distance = vertex.surface.position.distance(sent.origin);
            let shining = weight_of(emitted);
            if shining > 0.0 && nodes.len() == depth as usize {
                let surface = &vertex.surface;
                let origin = Origin::Met {
                    from: sent.origin,
                    direction: ray.direction,
                    lamp: [surface.instance, surface.primitive],
                    point: surface.position,
                    normal: surface.geometric_normal,
                    time: ray.time,
                };
                chosen.offer(origin, shining, nodes.len());
                strongest(nodes, origin, shining);
            }
            if depth >= settings.max_depth {
                break;
            }
            if self.carry && nodes.len() < MOST {
                nodes.push(Node {
                    vertex,
                    distance,
                    hit: hit.filter(|_| collision.is_none()),
                    time: ray.time,
                    anisotropy: collision.map(|at| at.anisotropy),
                    ratio: vertex.bsdf.transmits().then(|| vertex.bsdf.index_beyond(vertex.wo)),
                    delta: vertex.bsdf.is_delta_only(),
                });
            }
            let u = sampler.next_four();
            let passage = if *in_media { sampler.next_four() } else { [0.0; 4] };
            let v = sampler.next_four();
            if !vertex.bsdf.is_delta_only()
                && let Some((direct, light, place)) =
                    self.direct(&vertex, [u[0], u[1], u[2]], passage, ray.time)
            {
                let brought = self.integrator.bounded(throughput * direct, depth + 1);
                radiance += brought;
                let weight = weight_of(brought);
                if weight > 0.0 && nodes.len() > depth as usize {
                    let origin =
                        Origin::Sampled { light, place, from: vertex.surface.position, time: ray.time };
                    chosen.direct |= chosen.offer(origin, weight, nodes.len());
                    strongest(nodes, origin, weight);
                }
            }
            let next =
                self.integrator.next(&vertex, u[3], Vec2::new(v[0], v[1]), v[2], depth, &mut throughput);
            let Some((direction, from)) = next else { break };
            if let Some(node) = nodes.get_mut(depth as usize) {
                node.delta = from.is_none() && node.anisotropy.is_none();
            }
            departure = from;
            ray = vertex.surface.spawn(direction, ray.time);
            hit = frame.world.closest(&ray);
        }
        group.offer(&chosen, first);
        radiance
    }

    /// Walks the path of a group that was chosen, for all of them; the group is empty then.
    pub(super) fn walk(&self, group: &mut Group<'a>, found: &mut Found) {
        if let Some((origin, first)) = group.begin.take() {
            let frame = self.integrator.frame;
            let covariance = carried(frame, &group.kept, &self.lamps.source(&origin), first, self.axes, None);
            found.covariance.add(&covariance, f64::from(group.weight));
            found.of_surfaces += f64::from(group.of_surfaces);
        }
        (group.weight, group.of_surfaces, group.state) = (0.0, 0.0, 0);
    }

    /// Light that comes straight to a vertex, the sample of it, and where on which emitter that is.
    fn direct(
        &self,
        vertex: &Vertex,
        u: [f32; 3],
        passage: [f32; 4],
        time: f32,
    ) -> Option<(Vec3, LightSample, Place)> {
        let Integrator { frame, cutouts, in_media, .. } = &self.integrator;
        let lights = &frame.lights;
        let position = vertex.surface.position;
        let (light, place) = lights.sample_on(position, u[2], Vec2::new(u[0], u[1]), time)?;
        let (scattered, scale) = scattered(vertex, &light)?;
        let ray = shadow_ray(vertex, &light, time);
        let blocked = frame.world.occluded(&ray);
        if blocked && (!cutouts.any || cutouts.blocked(frame, &ray)) {
            return None;
        }
        let radiance = match light.arrival {
            Arrival::Environment(point) => lights.environment().map_or(Vec3::ZERO, |e| e.radiance_at(point)),
            Arrival::From { radiance, .. } => radiance,
        };
        let mut direct = scattered * radiance * scale;
        if *in_media {
            direct *= self.integrator.transmittance(&ray, passage);
        }
        Some((direct, light, place))
    }
}

/// How the normal turns from a vertex to two neighbours of it, seen from where the ray came from: by the shape's own gradients,
/// or by rays beside the one that found it. Only where the surface may be shiny.
pub(super) fn bend(
    frame: &Frame,
    vertex: &Vertex,
    hit: &Hit,
    time: f32,
    distance: f32,
) -> Option<[[Vec3; 2]; 2]> {
    /// The angle between the rays.
    const STEP: f32 = 2e-3;
    if vertex.surface.instance == u32::MAX || vertex.material.is_matt() {
        return None;
    }
    let facing = |n: Vec3| if n.dot(vertex.towards_eye) < 0.0 { -n } else { n };
    let normal = vertex.shading_normal();
    let size = STEP * distance.max(1e-6);
    if let Some(found) = frame.world.gradients(hit, time, &vertex.surface) {
        let side = if vertex.surface.shading_normal.dot(vertex.towards_eye) < 0.0 { -size } else { size };
        let (x, y) = vertex.surface.geometric_normal.any_orthonormal_pair();
        return Some([x, y].map(|axis| [size * axis, side * (found.normal * axis)]));
    }
    let ahead = -vertex.towards_eye;
    let origin = vertex.surface.position - ahead * distance;
    let x = ahead.any_orthonormal_vector();
    let y = ahead.cross(x);
    let step = |axis: Vec3| {
        let ray = Ray { time, ..Ray::new(origin, (ahead + STEP * axis).normalize()) };
        let near: Hit = frame.world.closest(&ray)?;
        if near.instance != vertex.surface.instance {
            return None;
        }
        let other = frame.world.surface(&ray, &near);
        Some([other.position - vertex.surface.position, facing(other.shading_normal) - facing(normal)])
    };
    Some([step(x)?, step(y)?])
}
