//! Lights of a frame: the environment, shining surfaces, points and directions, sampled as one.
//!
//! A light is chosen by how strongly it may light a scene of this size: the environment by its mean radiance, the
//! others by power over squared distance, each kind with at least a quarter of the choices when both are there. With
//! up to [`NEARBY_LIMIT`] local lights the distance is taken from the point to be lit, with more from the scene's radius.

pub mod emitter;
pub mod environment;
mod many;
pub mod sky;
mod solid_angle;

use glam::{Vec2, Vec3};

pub use emitter::{Emitter, EmitterShape};
pub use environment::{Environment, EnvironmentMap, MANY, MapPoint, luminance};
pub use many::LightSamples;
pub use sky::{Sky, studio};

use crate::sampling::Choice;

/// With at most this many local lights, each point chooses among them by its own distances.
pub const NEARBY_LIMIT: usize = 16;

/// A light without extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DeltaLight {
    /// Shines from a point with `intensity` in radiance × m² (W/sr).
    Point {
        /// Where it stands when the shutter opens and when it closes.
        position: [Vec3; 2],
        /// Radiant intensity.
        intensity: Vec3,
    },
    /// Shines from a point into a cone, fading from the inner to the outer angle as glTF has it: by the square of the
    /// share of the way between their cosines.
    Spot {
        /// Where it stands when the shutter opens and when it closes.
        position: [Vec3; 2],
        /// Unit direction of the cone's axis, away from the light.
        axis: Vec3,
        /// Radiant intensity within the inner angle.
        intensity: Vec3,
        /// Cosine of half the angle within which it has full intensity.
        cos_inner: f32,
        /// Cosine of half the angle beyond which it has none.
        cos_outer: f32,
    },
    /// Shines from infinitely far away.
    Directional {
        /// Unit direction towards the light.
        towards: Vec3,
        /// Irradiance of a surface that faces it.
        irradiance: Vec3,
    },
}

/// Light that may arrive at a point from one direction.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Where from, and how much.
    pub arrival: Arrival,
    /// Density over solid angle, the choice of the light included; for a delta light, the probability of its choice.
    pub pdf: f32,
    /// Whether the light has no extent, so that no other way of sampling can find it.
    pub delta: bool,
}

/// Where light comes from.
#[derive(Clone, Copy, Debug)]
pub enum Arrival {
    /// From this point of the environment; [`Environment::radiance_at`] tells how much, for those who know that nothing
    /// is in the way.
    Environment(MapPoint),
    /// From a light.
    From {
        /// The lit end of the shadow ray; `None` for a light at infinity.
        point: Option<Vec3>,
        /// Radiance; for a delta light, radiance times the solid angle that it stands for.
        radiance: Vec3,
    },
}

/// All lights of a frame.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    environment: Option<Environment>,
    emitters: Vec<Emitter>,
    deltas: Vec<DeltaLight>,
    environment_probability: f32,
    /// Centres and strengths of the local lights, emitters first: for the choice by distance.
    nearby: Vec<(Vec3, f32)>,
    local_choice: Option<Choice>,
    /// Emitter of an instance's primitive: per instance, pairs sorted by primitive.
    lookup: Vec<Vec<(u32, u32)>>,
}

impl Lights {
    /// Gathers the lights of a scene whose extent is about `scene_radius` metres.
    pub fn new(
        environment: Option<Environment>,
        emitters: Vec<Emitter>,
        deltas: Vec<DeltaLight>,
        scene_radius: f32,
    ) -> Self {
        let per_square = 1.0 / (scene_radius * scene_radius).max(f32::MIN_POSITIVE);
        let strengths: Vec<f32> = emitters
            .iter()
            .map(|e| e.strength() * per_square)
            .chain(deltas.iter().map(|d| match d {
                DeltaLight::Point { intensity, .. } | DeltaLight::Spot { intensity, .. } => {
                    luminance(*intensity) * per_square
                }
                DeltaLight::Directional { irradiance, .. } => luminance(*irradiance),
            }))
            .collect();
        let local_sum: f32 = strengths.iter().sum();
        let environment_strength =
            environment.as_ref().map_or(0.0, |e| std::f32::consts::PI * luminance(e.mean_radiance()));
        let environment_probability = match (environment.is_some(), strengths.is_empty()) {
            (true, false) => (environment_strength
                / (environment_strength + local_sum).max(f32::MIN_POSITIVE))
            .clamp(0.25, 0.75),
            (present, _) => f32::from(u8::from(present)),
        };
        let mut lookup: Vec<Vec<(u32, u32)>> = Vec::new();
        for (index, emitter) in emitters.iter().enumerate() {
            let instance = emitter.instance as usize;
            if lookup.len() <= instance {
                lookup.resize(instance + 1, Vec::new());
            }
            lookup[instance].push((emitter.primitive, index as u32));
        }
        lookup.iter_mut().for_each(|entries| entries.sort_unstable());
        let nearby = if strengths.len() <= NEARBY_LIMIT
            && !deltas.iter().any(|d| matches!(d, DeltaLight::Directional { .. }))
        {
            let points = deltas.iter().map(|d| match d {
                DeltaLight::Point { position, .. } | DeltaLight::Spot { position, .. } => position[0],
                DeltaLight::Directional { .. } => Vec3::ZERO,
            });
            let centers = emitters.iter().map(Emitter::center).chain(points);
            centers.zip(&strengths).map(|(center, &s)| (center, s)).collect()
        } else {
            Vec::new()
        };
        let weights: Vec<f64> = strengths.iter().map(|&s| f64::from(s)).collect();
        let local_choice = Choice::new(&weights);
        Self { environment, emitters, deltas, environment_probability, nearby, local_choice, lookup }
    }

    /// The environment, if there is one.
    pub fn environment(&self) -> Option<&Environment> {
        self.environment.as_ref()
    }

    /// Turns the environment about the vertical by an angle in radians.
    pub fn turn_environment(&mut self, angle: f32) {
        if let Some(environment) = &mut self.environment {
            environment.rotation = (environment.rotation + angle).rem_euclid(std::f32::consts::TAU);
        }
    }

    /// The shining surfaces.
    pub fn emitters(&self) -> &[Emitter] {
        &self.emitters
    }

    /// The lights without extent.
    pub fn deltas(&self) -> &[DeltaLight] {
        &self.deltas
    }

    /// Whether nothing shines.
    pub fn is_empty(&self) -> bool {
        self.environment.is_none() && self.emitters.is_empty() && self.deltas.is_empty()
    }

    /// Radiance that a ray which hits nothing brings.
    pub fn escaped(&self, direction: Vec3) -> Vec3 {
        self.environment.as_ref().map_or(Vec3::ZERO, |e| e.radiance(direction))
    }

    /// Density over solid angle with which [`Self::sample`] chooses a point of the environment.
    pub fn environment_pdf(&self, point: MapPoint) -> f32 {
        self.environment.as_ref().map_or(0.0, |e| self.environment_probability * e.pdf_at(point))
    }

    /// The emitter that a primitive is.
    pub fn emitter_of(&self, instance: u32, primitive: u32) -> Option<u32> {
        let entries = self.lookup.get(instance as usize)?;
        let found = entries.binary_search_by_key(&primitive, |entry| entry.0).ok()?;
        Some(entries[found].1)
    }

    /// Density over solid angle with which [`Self::sample`] from `from` chooses `point` on an emitter.
    pub fn emitter_pdf(&self, emitter: u32, from: Vec3, point: Vec3, normal: Vec3, time: f32) -> f32 {
        let chosen = (1.0 - self.environment_probability) * self.local_probability(emitter as usize, from);
        chosen * self.emitters[emitter as usize].pdf(from, point, normal, time)
    }

    /// Light for the point `from`; `None` where the chosen light cannot reach it.
    #[inline]
    pub fn sample(&self, from: Vec3, u_choice: f32, u: Vec2, time: f32) -> Option<LightSample> {
        self.sample_on(from, u_choice, u, time).map(|(sample, _)| sample)
    }

    /// [`Self::sample`], and of a shining surface which one it is, and the texture coordinates there.
    #[inline]
    pub fn sample_on(
        &self,
        from: Vec3,
        u_choice: f32,
        u: Vec2,
        time: f32,
    ) -> Option<(LightSample, Option<(u32, Vec2)>)> {
        if u_choice < self.environment_probability {
            let (direction, point, pdf) = self.environment.as_ref()?.sample(u);
            let pdf = pdf * self.environment_probability;
            let sample = LightSample { direction, arrival: Arrival::Environment(point), pdf, delta: false };
            return (pdf > 0.0).then_some((sample, None));
        }
        let rest = (u_choice - self.environment_probability) / (1.0 - self.environment_probability);
        let (index, chosen) = self.choose_local(rest, from)?;
        let chosen = chosen * (1.0 - self.environment_probability);
        if let Some(emitter) = self.emitters.get(index) {
            let sample = emitter.sample(from, u, time)?;
            let to = sample.point - from;
            let direction = to.normalize_or_zero();
            let radiance = emitter.radiance(sample.uv, sample.normal, -direction);
            let pdf = sample.pdf * chosen;
            let arrival = Arrival::From { point: Some(sample.point), radiance };
            let place = (index as u32, sample.uv);
            return Some((LightSample { direction, arrival, pdf, delta: false }, Some(place)));
        }
        let sample = match self.deltas[index - self.emitters.len()] {
            DeltaLight::Point { position, intensity } => {
                from_point(position, from, time, chosen, |_| intensity)
            }
            DeltaLight::Spot { position, axis, intensity, cos_inner, cos_outer } => {
                from_point(position, from, time, chosen, |direction| {
                    let share = (-direction.dot(axis) - cos_outer) / (cos_inner - cos_outer).max(1e-3);
                    intensity * share.clamp(0.0, 1.0).powi(2)
                })
            }
            DeltaLight::Directional { towards, irradiance } => Some(LightSample {
                direction: towards,
                arrival: Arrival::From { point: None, radiance: irradiance },
                pdf: chosen,
                delta: true,
            }),
        };
        sample.map(|sample| (sample, None))
    }

    /// A local light and the probability of its choice from `from`.
    fn choose_local(&self, u: f32, from: Vec3) -> Option<(usize, f32)> {
        if self.nearby.len() > 1 {
            let total: f32 = self.nearby.iter().map(|light| importance(light, from)).sum();
            if total > 0.0 && total.is_finite() {
                let mut rest = u * total;
                let mut last = None;
                for (index, light) in self.nearby.iter().enumerate() {
                    let weight = importance(light, from);
                    if weight > 0.0 {
                        last = Some((index, weight / total));
                        if rest < weight {
                            break;
                        }
                    }
                    rest -= weight;
                }
                return last;
            }
        }
        self.local_choice.as_ref().map(|choice| choice.sample(u))
    }

    fn local_probability(&self, index: usize, from: Vec3) -> f32 {
        if self.nearby.len() > 1 {
            let total: f32 = self.nearby.iter().map(|light| importance(light, from)).sum();
            if total > 0.0 && total.is_finite() {
                return importance(&self.nearby[index], from) / total;
            }
        }
        self.local_choice.as_ref().map_or(0.0, |choice| choice.probability(index))
    }
}

/// Light of a point whose intensity depends on the direction towards it.
fn from_point(
    [open, close]: [Vec3; 2],
    from: Vec3,
    time: f32,
    pdf: f32,
    intensity: impl Fn(Vec3) -> Vec3,
) -> Option<LightSample> {
    let point = open.lerp(close, time);
    let to = point - from;
    let direction = to.try_normalize()?;
    let radiance = intensity(direction) / to.length_squared();
    let arrival = Arrival::From { point: Some(point), radiance };
    radiance.is_finite().then_some(LightSample { direction, arrival, pdf, delta: true })
}

/// How much a light of some strength may matter at a point.
fn importance(&(center, strength): &(Vec3, f32), from: Vec3) -> f32 {
    strength / center.distance_squared(from).max(1e-12)
}
