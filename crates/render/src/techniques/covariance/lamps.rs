//! How fast the lights themselves vary, as a point that they shine on sees them: where every walk of covariance begins.
//!
//! A lamp is a window: the solid angle that all of it fills from there. A map of the sky has its own spectrum, the local bandwidth B of the
//! map in that direction (`[001]` §2.3; [`EnvironmentBandwidth`]), which holds most of the energy: two standard deviations. The
//! map is everywhere, so its window is the sphere. Point lights and suns without extent fill next to nothing.

use std::collections::HashMap;
use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use halflight_frequency::mapping::EnvironmentBandwidth;
use halflight_frequency::wavelet::{Filter, Rule};
use halflight_image::Plane;
use halflight_scene::Frame;
use halflight_scene::lights::{Arrival, Emitter, EmitterShape, LightSample, luminance};

use super::trail::Source;

/// The lights of a frame.
pub(super) struct Lamps<'a> {
    frame: &'a Frame,
    /// Of each emitter, how many times its own area all of its lamp has.
    wholes: Vec<f32>,
    map: Option<Map>,
}

/// An emitter with a surface, and where on it.
pub(super) type Place = Option<(u32, Vec2)>;

/// Where light was found, from which its source follows for the few that are walked.
#[derive(Clone, Copy)]
pub(super) enum Origin {
    /// In the sky, in this direction.
    Sky(Vec3),
    /// By a ray that met a lamp: from where and in which direction, the lamp's instance and primitive, point and normal, and when.
    Met { from: Vec3, direction: Vec3, lamp: [u32; 2], point: Vec3, normal: Vec3, time: f32 },
    /// By sampling the lights: where on which emitter, and when.
    Sampled { light: LightSample, place: Place, from: Vec3, time: f32 },
}

struct Map {
    bandwidth: EnvironmentBandwidth,
    /// Sine and cosine of its rotation.
    turn: [f32; 2],
}

impl<'a> Lamps<'a> {
    pub(super) fn new(frame: &'a Frame) -> Self {
        let emitters = frame.lights.emitters();
        let mut of_instance: HashMap<u32, f32> = HashMap::new();
        for emitter in emitters {
            *of_instance.entry(emitter.instance).or_default() += emitter.area();
        }
        let whole = |e: &Emitter| (of_instance[&e.instance] / e.area().max(1e-20)).max(1.0);
        let map = frame.lights.environment().map(|environment| {
            let (width, height) = environment.map.size();
            let texel = |i: usize| luminance(environment.map.texel(i % width, i / width));
            let plane = Plane { width, height, values: (0..width * height).map(texel).collect() };
            let (sin, cos) = environment.rotation.sin_cos();
            let bandwidth = EnvironmentBandwidth::new(&plane, Filter::Smooth, Rule::Within);
            Map { bandwidth, turn: [sin, cos] }
        });
        Self { frame, wholes: emitters.iter().map(whole).collect(), map }
    }

    /// The light that was found there.
    pub(super) fn source(&self, origin: &Origin) -> Source {
        match *origin {
            Origin::Sky(direction) => self.sky(direction),
            Origin::Met { from, direction, lamp, point, normal, time } => {
                let solid_angle = self.met(from, lamp, point, normal, time);
                Source { direction, solid_angle, distance: point.distance(from), bandwidth: 0.0 }
            }
            Origin::Sampled { light, place, from, time } => {
                let Arrival::From { point, .. } = light.arrival else { return self.sky(light.direction) };
                let distance = point.map_or(f32::INFINITY, |point| point.distance(from));
                let solid_angle = match (place, point) {
                    (Some((emitter, uv)), Some(point)) => self.of_sample(emitter, uv, from, point, time),
                    _ => 0.0,
                };
                Source { direction: light.direction, solid_angle, distance, bandwidth: 0.0 }
            }
        }
    }

    /// The sky in a direction.
    pub(super) fn sky(&self, direction: Vec3) -> Source {
        let bandwidth = self.map.as_ref().map_or(0.0, |map| {
            // The azimuth atan2(x, −z) grows by the rotation.
            let [sin, cos] = map.turn;
            let turned = Vec3::new(
                direction.x * cos - direction.z * sin,
                direction.y,
                direction.z * cos + direction.x * sin,
            );
            map.bandwidth.along(turned)
        });
        Source { direction, solid_angle: 4.0 * PI, distance: f32::INFINITY, bandwidth }
    }

    /// Steradians of the lamp that a ray from `from` has met.
    fn met(&self, from: Vec3, [lamp, primitive]: [u32; 2], point: Vec3, normal: Vec3, time: f32) -> f32 {
        if let Some(emitter) = self.frame.lights.emitter_of(lamp, primitive) {
            return self.solid_angle(emitter, from, point, normal, time);
        }
        // A shape that is not sampled as a light: the ball about it.
        self.frame.world.instances().get(lamp as usize).map_or(0.0, |instance| {
            let (low, high) = instance.geometry.as_rays().bounds();
            let scale = instance.transform.at(time).matrix3.determinant().abs().cbrt();
            let radius = 0.5 * scale * low.distance(high);
            let sin2 = (radius * radius / from.distance_squared(point).max(1e-12)).min(1.0);
            2.0 * PI * (1.0 - (1.0 - sin2).sqrt())
        })
    }

    /// The same of a sample of an emitter, given by its point and texture coordinates.
    pub(super) fn of_sample(&self, emitter: u32, uv: Vec2, from: Vec3, point: Vec3, time: f32) -> f32 {
        let lamp = &self.frame.lights.emitters()[emitter as usize];
        let normal = match (&lamp.shape, lamp.derivatives(uv)) {
            (EmitterShape::Sphere { .. }, _) | (_, None) => from - point,
            (_, Some([u, v])) => u.cross(v),
        };
        self.solid_angle(emitter, from, point, normal.normalize_or(Vec3::Y), time)
    }

    /// Steradians that all of the lamp fills which an emitter is part of, as the part about a point of it tells.
    pub(super) fn solid_angle(&self, emitter: u32, from: Vec3, point: Vec3, normal: Vec3, time: f32) -> f32 {
        let pdf = self.frame.lights.emitters()[emitter as usize].pdf(from, point, normal, time);
        if pdf > 0.0 { (self.wholes[emitter as usize] / pdf).min(4.0 * PI) } else { 0.0 }
    }
}
