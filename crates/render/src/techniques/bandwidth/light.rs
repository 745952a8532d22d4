//! The light of a frame, as prediction and shading ask for it.
//!
//! From the environment's map, whenever it changes: a pyramid of directions, each with the mean of L, the mean of L² and
//! the bandwidth weighted by L within the texel, by which a few directions tell what many would meet, a sun included;
//! and for pre-convolved shading its convolutions. All are kept in the space of the map, so that turning it costs nothing.
//! Its suns are taken out first; they are lamps, [`super::suns`].
//! Shining surfaces and lamps are sampled as they are; how finely they shine is in `lamps`.

use std::sync::{Arc, Mutex, PoisonError};

use glam::{Mat3, Vec2, Vec3};
use halflight_frequency::mapping::EnvironmentBandwidth;
use halflight_frequency::preconvolved::{LEVELS, Preconvolved};
use halflight_frequency::wavelet::{Filter, Rule};
use halflight_image::{Plane, RgbImage};
use halflight_scene::Frame;
use halflight_scene::lights::{Environment, EnvironmentMap, Lights, luminance};

use super::convolved::{self, Convolved};
use super::lamps::{LampPictures, Lamps};
use super::octahedral::Octahedral;
use super::settings::Mode;
use super::suns::{self, Sun};

/// Texels along the finest level of the pyramid: 1.6° each.
const FINEST: usize = 128;
/// Directions along a texel of it at which the map is read.
const WITHIN: usize = 4;

/// What a cone of directions brings: luminances.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Brought {
    pub(super) mean: f32,
    pub(super) mean_square: f32,
    /// Cycles per radian, weighted by luminance.
    pub(super) bandwidth: f32,
}

/// What was made from a map.
pub(super) struct MapTables {
    map: Arc<EnvironmentMap>,
    /// The map without its suns: itself where it has none.
    rest: Arc<EnvironmentMap>,
    suns: Vec<Sun>,
    /// L, L², Lν; the finest first, each half as large as the one before.
    pyramid: Vec<Octahedral>,
    convolved: Option<Convolved>,
}

/// Tables of the last map that was asked for, and of the pictures on lamps.
#[derive(Default)]
pub(super) struct LightCache {
    map: Mutex<Option<Arc<MapTables>>>,
    lamps: LampPictures,
}

impl LightCache {
    /// The tables of this map, with convolutions if they are wanted.
    pub(super) fn tables(&self, map: &Arc<EnvironmentMap>, convolved: bool) -> Arc<MapTables> {
        let known = self.map.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let serves = |tables: &Arc<MapTables>| {
            Arc::ptr_eq(&tables.map, map) && (tables.convolved.is_some() || !convolved)
        };
        if let Some(tables) = known.filter(serves) {
            return tables;
        }
        // Not under the lock: threads that wait for their own work may take up that of another picture.
        let made = Arc::new(MapTables::new(map, convolved));
        *self.map.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(&made));
        made
    }
}

impl MapTables {
    fn new(map: &Arc<EnvironmentMap>, convolved: bool) -> Self {
        let (width, height) = map.size();
        let whole = RgbImage::from_fn(width, height, |x, y| map.texel(x, y).to_array());
        let (suns, rest, image) = match suns::split(&whole) {
            Some((suns, rest)) => (suns, Arc::new(EnvironmentMap::new(rest.clone())), rest),
            None => (Vec::new(), Arc::clone(map), whole),
        };
        let values = image.pixels.iter().map(|&p| luminance(Vec3::from(p))).collect();
        let plane = Plane { width, height, values };
        let bandwidth = EnvironmentBandwidth::new(&plane, Filter::Smooth, Rule::Within);
        let environment = Environment { map: Arc::clone(&rest), rotation: 0.0, intensity: Vec3::ONE };
        let fine = |direction: Vec3| {
            let l = luminance(environment.radiance(direction));
            [l, l * l, l * bandwidth.along(direction), 0.0]
        };
        // Every texel by the middles of its parts.
        let finest = Octahedral::new(FINEST, |middle| {
            let centre = super::octahedral::encode(middle);
            let mut sum = [0.0; 4];
            for i in 0..WITHIN * WITHIN {
                let part = Vec2::new((i % WITHIN) as f32, (i / WITHIN) as f32) + Vec2::splat(0.5);
                let at = centre + (part / WITHIN as f32 - Vec2::splat(0.5)) / FINEST as f32;
                add(&mut sum, fine(super::octahedral::decode(at)), 1.0 / (WITHIN * WITHIN) as f32);
            }
            sum
        });
        let mut pyramid = vec![finest];
        while pyramid[pyramid.len() - 1].size() > 2 {
            let below = &pyramid[pyramid.len() - 1];
            let size = below.size() / 2;
            let next = Octahedral::new(size, |middle| {
                let centre = super::octahedral::encode(middle);
                let mut sum = [0.0; 4];
                for part in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
                    let at = centre + Vec2::from(part) / size as f32;
                    add(&mut sum, below.nearest(super::octahedral::decode(at)), 0.25);
                }
                sum
            });
            pyramid.push(next);
        }
        let convolved = convolved.then(|| {
            let levels = Preconvolved::new(&image);
            let table = |level: usize| {
                // As many texels as the convolution has: of 0.4 standard deviations of its lobe.
                let exponent = ((LEVELS - level) as f32).exp2();
                let size = ((9.0 * exponent.sqrt()) as usize).max(32).next_multiple_of(8);
                Octahedral::new(size, |d| levels.radiance(d, level as f32).extend(0.0).to_array())
            };
            // Texels of about the map's own size at the equator.
            let size = (width / 2).clamp(32, convolved::FINEST).next_multiple_of(8);
            let itself = Octahedral::new(size, |d| environment.radiance(d).extend(0.0).to_array());
            Convolved::new(&std::iter::once(itself).chain((1..=LEVELS).map(table)).collect::<Vec<_>>())
        });
        Self { map: Arc::clone(map), rest, suns, pyramid, convolved }
    }

    /// Bytes that all tables occupy.
    pub(super) fn memory_bytes(&self) -> usize {
        self.pyramid.iter().map(Octahedral::memory_bytes).sum::<usize>()
            + self.convolved.as_ref().map_or(0, Convolved::memory_bytes)
    }
}

fn add(sum: &mut [f32; 4], value: [f32; 4], share: f32) {
    for (sum, value) in sum.iter_mut().zip(value) {
        *sum += share * value;
    }
}

/// All light of one frame.
pub(super) struct FrameLight<'a> {
    pub(super) environment: Option<&'a Environment>,
    /// The same without its suns, as tables of materials see it.
    pub(super) sky: Option<Environment>,
    /// Its suns, in the world.
    pub(super) suns: Vec<Sun>,
    /// The map's tables, where there is an environment.
    pub(super) tables: Option<Arc<MapTables>>,
    /// Everything that is not the environment.
    pub(super) local: Lights,
    /// How finely that shines.
    pub(super) lamps: Lamps,
    /// From the world to the space of the map.
    pub(super) to_map: Mat3,
    /// Luminance of the intensity that the map is multiplied by.
    scale: f32,
}

impl<'a> FrameLight<'a> {
    pub(super) fn new(frame: &'a Frame, cache: &LightCache, mode: Mode) -> Self {
        let environment = frame.lights.environment();
        let tables = environment.map(|e| cache.tables(&e.map, mode == Mode::Preconvolved));
        let rotation = environment.map_or(0.0, |e| e.rotation);
        let (sin, cos) = rotation.sin_cos();
        // The azimuth atan2(x, −z) grows by the rotation.
        let to_map = Mat3::from_cols(Vec3::new(cos, 0.0, sin), Vec3::Y, Vec3::new(-sin, 0.0, cos));
        let (low, high) = frame.bounds;
        let radius = (0.5 * low.distance(high)).max(1e-6);
        let emitters = frame.lights.emitters().to_vec();
        let deltas = frame.lights.deltas().to_vec();
        let local = Lights::new(None, emitters, deltas, radius);
        let (mut sky, mut suns) = (environment.cloned(), Vec::new());
        if let (Some(tables), Some(sky)) = (&tables, &mut sky)
            && matches!(mode, Mode::Plain | Mode::Preconvolved)
        {
            sky.map = Arc::clone(&tables.rest);
            suns = suns::seen(&tables.suns, to_map.transpose(), sky.intensity);
        }
        Self {
            environment,
            sky,
            suns,
            tables,
            lamps: Lamps::new(local.emitters(), &cache.lamps),
            local,
            to_map,
            scale: environment.map_or(0.0, |e| luminance(e.intensity)),
        }
    }

    /// Whether a lobe of this bandwidth, in cycles per radian, shows the texels of the map: half a period to a texel.
    pub(super) fn tells_texels(&self, lobe: f32) -> bool {
        let texel = self.environment.map_or(0.0, |e| std::f32::consts::TAU / e.map.size().0 as f32);
        2.0 * lobe * texel > 1.0
    }

    /// Whether anything but the environment shines.
    pub(super) fn has_local(&self) -> bool {
        !self.local.is_empty()
    }

    /// What a cone of `solid_angle` about a direction in the space of the map brings, on the average.
    #[inline]
    pub(super) fn brought(&self, direction: Vec3, solid_angle: f32) -> Brought {
        let Some(tables) = &self.tables else { return Brought::default() };
        // Texels of level k fill about 4π/(128/2^k)²; half the logarithm of the quotient of areas, rounded.
        let texels = solid_angle * (FINEST * FINEST) as f32 / (4.0 * std::f32::consts::PI);
        let level = ((texels.to_bits() >> 23) as i32 - 126).max(0) as usize / 2;
        let table = &tables.pyramid[level.min(tables.pyramid.len() - 1)];
        let [l, square, bandwidth, _] = table.nearest(direction);
        Brought {
            mean: l * self.scale,
            mean_square: square * self.scale * self.scale,
            bandwidth: if l > 0.0 { bandwidth / l } else { 0.0 },
        }
    }

    /// The convolutions of the map, where they were asked for.
    #[inline]
    pub(super) fn convolved(&self) -> Option<&Convolved> {
        self.tables.as_ref().and_then(|tables| tables.convolved.as_ref())
    }
}
