//! `bandwidth`: measured materials at interactive rates, shaded only where the picture varies.
//!
//! Before anything is shaded the bandwidth of the light that reaches each pixel and the noise of its estimate are
//! predicted, from the light, the lobe of the material, curvature and distance. Pixels are then shaded from coarse to fine
//! where the prediction asks for it, by as many samples as it asks for, and interpolated between. Nothing is prepared from
//! geometry: it may change in every frame, as may light and normal maps. One bounce of the environment and of area lights;
//! shadows only if asked for, by rays or by the spheres that stand for meshes.
//!
//! | file | what it does |
//! |---|---|
//! | `surface`, `curvature` | what each pixel shows |
//! | `light`, `octahedral`, `convolved`, `suns`, `lamps` | the light of a frame |
//! | `lobes`, `samples`, `parts`, `paint` | materials: bandwidth, importance samples, what pictures paint on them |
//! | `kept` | tables of measured materials in files |
//! | `predict`, `pyramid` | the bandwidth buffer |
//! | `hierarchy` | which pixels are shaded |
//! | `shade`, `gather` | the light of one |
//! | `antialias` | edges and what varies within a pixel |
//! | `explain` | the chain of one pixel, in words |
//!
//! Source: seed \[001\] (Bagher et al. 2013), corrected as `docs/errata.md` says. Costs: `halflight bench bandwidth`.

mod antialias;
mod convolved;
mod curvature;
mod explain;
mod gather;
mod hierarchy;
mod kept;
mod lamps;
mod light;
mod lobes;
#[cfg(test)]
mod mixes;
mod octahedral;
mod paint;
mod parts;
mod predict;
mod pyramid;
mod samples;
mod settings;
mod shade;
mod suns;
mod surface;
#[cfg(test)]
mod tests;

use std::sync::{Arc, Mutex, PoisonError};

use glam::{Vec2, Vec3};
use halflight_scene::lights::{MANY, MapPoint};
use halflight_scene::{Frame, Scene};
use rayon::prelude::*;

pub use settings::{Antialias, BandwidthSettings, Mode, Preset, Visibility};

use crate::film::Film;
use crate::looks::{Stages, each_look};
use crate::technique::{Budget, Deadline, Progress, RenderReport, Technique, TechniqueError};
use crate::techniques::shexp::Openness;
use gather::{Blocking, TOGETHER};
use hierarchy::{Known, Shaded};
use light::{FrameLight, LightCache};
use lobes::{Lobe, LobeCache};
use predict::{Buffer, Judge};
use samples::MOST_SAMPLES;
use shade::Shader;
use surface::{SurfacePoint, Surfaces};

/// Most looks at a picture.
const MAX_LOOKS: u32 = 1 << 16;

/// Most points whose memory is kept for the next picture: 100 MB.
const MOST_KEPT: usize = 1 << 20;

/// The technique `bandwidth`.
#[derive(Default)]
pub struct BandwidthTechnique {
    settings: BandwidthSettings,
    lobes: LobeCache,
    light: LightCache,
    /// The points of the last picture, whose memory serves the next.
    room: Mutex<Vec<SurfacePoint>>,
    /// What stands for the scene's shapes as blockers, if it is asked for.
    openness: Option<Openness>,
}

/// One look at a picture; without pixels if it was given up.
#[derive(Default)]
struct Look {
    picture: Vec<Vec3>,
    shaded: Shaded,
    /// Absent where every pixel is shaded.
    buffer: Option<Buffer>,
    /// Pixels that show a surface.
    covered: usize,
    /// Pixels that were looked through more than once.
    finer: usize,
}

impl BandwidthTechnique {
    /// With settings other than the default.
    pub fn new(settings: BandwidthSettings) -> Self {
        Self { settings, ..Self::default() }
    }

    /// The materials that are to be seen, analysed.
    fn lobes_of(&self, frame: &Frame) -> Vec<Arc<Lobe>> {
        let mut used = vec![false; frame.materials.len()];
        for instance in 0..frame.world.instances().len() as u32 {
            // Slots beyond the last one are the last one again.
            let mut slot = 0;
            loop {
                let index = frame.material_index(instance, slot) as usize;
                used[index] = true;
                slot += 1;
                if slot > 64 || frame.material_index(instance, slot) as usize == index {
                    break;
                }
            }
        }
        let count = self.settings.directions as usize;
        self.lobes.lobes(&frame.materials, &|index| used[index], count, self.settings.cache)
    }

    /// One picture through the point `offset` of its pixels.
    fn look(&self, shader: &Shader, size: [usize; 2], offset: Vec2, stages: &mut Stages) -> Look {
        let frame = shader.frame;
        let room = std::mem::take(&mut *self.room.lock().unwrap_or_else(PoisonError::into_inner));
        let surfaces = stages.time("g-buffer", || Surfaces::look(frame, size, offset, room));
        let covered = surfaces.points.par_iter().with_min_len(4096).filter(|p| p.is_there()).count();
        if shader.progress.unwanted() {
            return Look::default();
        }
        let mut look = if self.settings.is_exhaustive() {
            let shaded = stages.time("shading", || shade_all(shader, &surfaces));
            Look { picture: Vec::new(), shaded, buffer: None, covered, finer: 0 }
        } else {
            let buffer = stages.time("bandwidth", || {
                Buffer::new(&Judge::new(frame, shader.light, shader.lobes, &self.settings, size), &surfaces)
            });
            let shaded = stages.time("shading", || hierarchy::shade(shader, &surfaces, &buffer));
            Look { picture: Vec::new(), shaded, buffer: Some(buffer), covered, finer: 0 }
        };
        look.picture = stages.time("composing", || composed(shader, &surfaces, &look.shaded));
        let side = match self.settings.antialias {
            Antialias::One => 1,
            Antialias::Four => 2,
            Antialias::Sixteen => 4,
        };
        if let Some(buffer) = look.buffer.as_ref().filter(|_| side > 1) {
            let pixels = (&mut look.shaded, look.picture.as_mut_slice());
            look.finer = stages
                .time("antialiasing", || antialias::refine(shader, &surfaces, buffer, pixels, side, offset));
        }
        if surfaces.points.len() <= MOST_KEPT {
            *self.room.lock().unwrap_or_else(PoisonError::into_inner) = surfaces.points;
        }
        look
    }
}

/// The radiance of every pixel, of what the parts of its material send.
fn composed(shader: &Shader, surfaces: &Surfaces, shaded: &Shaded) -> Vec<Vec3> {
    let mut picture = vec![Vec3::ZERO; surfaces.points.len()];
    let pieces = picture.par_chunks_mut(MANY).enumerate();
    pieces.with_min_len(64).for_each(|(piece, out)| {
        let first = piece * MANY;
        let (mut away, mut places, mut many) = ([Vec3::Y; MANY], [0u8; MANY], 0);
        for (i, out) in out.iter_mut().enumerate() {
            let point = &surfaces.points[first + i];
            if point.is_there() {
                *out = shader.composed(point, shaded.pixels[first + i].shares);
            } else {
                (away[many], places[many]) = (-point.towards_eye, i as u8);
                many += 1;
            }
        }
        if let Some(environment) = shader.light.environment.filter(|_| many > 0) {
            let (mut met, mut radiance) = ([MapPoint::default(); MANY], [Vec3::ZERO; MANY]);
            environment.locate_many(shader.frame.world.simd(), &away, many, &mut met);
            environment.radiance_many(shader.frame.world.simd(), &met, many, &mut radiance);
            for (&i, radiance) in places[..many].iter().zip(&radiance) {
                out[usize::from(i)] = *radiance;
            }
        }
    });
    picture
}

/// Shades every pixel by the same number of samples.
fn shade_all(shader: &Shader, surfaces: &Surfaces) -> Shaded {
    let number = shader.settings.samples;
    let mut pixels = vec![Known::default(); surfaces.points.len()];
    let rays = pixels
        .par_chunks_mut(surfaces.width)
        .enumerate()
        .map(|(y, row)| {
            let mut room = shader.room();
            if shader.progress.unwanted() {
                return 0;
            }
            let there: Vec<usize> = (0..row.len()).filter(|&x| surfaces.at(x, y).is_there()).collect();
            for group in there.chunks(TOGETHER) {
                room.look_around(group.iter().map(|&x| surfaces.at(x, y)));
                for &x in group {
                    let place = [x as u32, y as u32];
                    let shares = shader.shares(surfaces.at(x, y), place, [number, number], &mut room);
                    row[x] = Known { shares, samples: number.min(u32::from(u16::MAX)) as u16, shaded: true };
                }
            }
            room.count
        })
        .sum();
    Shaded { pixels, rays }
}

impl Technique for BandwidthTechnique {
    fn prepare(&mut self, scene: &Scene, progress: &dyn Progress) -> Result<(), TechniqueError> {
        self.openness = match self.settings.visibility {
            Visibility::Spheres => Some(Openness::learn(scene, progress)?),
            Visibility::Off | Visibility::Rays => None,
        };
        let frame = scene
            .at(0.0)
            .map_err(|error| TechniqueError { technique: "bandwidth", reason: error.to_string() })?;
        self.lobes_of(&frame);
        Ok(())
    }

    fn render(
        &self,
        frame: &Frame,
        film: &mut Film,
        budget: &Budget,
        progress: &dyn Progress,
    ) -> Result<RenderReport, TechniqueError> {
        let deadline = Deadline::new(budget.seconds);
        let mut stages = Stages::default();
        let mut report = RenderReport::default();
        let (lobes, light) = stages.time("light and materials", || {
            (self.lobes_of(frame), FrameLight::new(frame, &self.light, self.settings.mode))
        });
        let openness = stages.time("blockers", || self.openness.as_ref().map(|known| known.of(frame)));
        let blocking = match (&openness, self.settings.visibility) {
            (Some(openness), _) => Blocking::Spheres(openness),
            (None, Visibility::Rays) => Blocking::Rays,
            (None, _) => Blocking::Nothing,
        };
        let mut last = None;
        let work = (&mut report, stages);
        each_look(
            film,
            (budget, &deadline),
            (1, MAX_LOOKS),
            progress,
            work,
            |size, offset, sample, stages| {
                let seed = budget.seed.wrapping_add(u64::from(sample) << 40);
                let settings = &self.settings;
                let shader =
                    Shader { frame, light: &light, lobes: &lobes, settings, blocking, seed, progress };
                let mut look = self.look(&shader, size, offset, stages);
                let picture = std::mem::take(&mut look.picture);
                let rays = (size[0] * size[1]) as u64 + look.shaded.rays;
                if !progress.unwanted() {
                    last = Some(look);
                }
                (picture, rays)
            },
        );
        if let Some(look) = &last {
            add_layers(film, look);
            report.notes = self.notes(look, &lobes, &light);
        }
        Ok(report)
    }
}

impl BandwidthTechnique {
    /// What the picture leaves out, and what it took.
    fn notes(&self, look: &Look, lobes: &[Arc<Lobe>], light: &FrameLight) -> Vec<String> {
        let shadows = match self.settings.visibility {
            Visibility::Off => "without shadows",
            Visibility::Rays => "with shadow rays",
            Visibility::Spheres => "with shadows of spheres and height fields in four bands of harmonics",
        };
        let shaded = look.shaded.pixels.iter().filter(|p| p.shaded).count();
        let samples: u64 = look.shaded.pixels.iter().map(|p| u64::from(p.samples)).sum();
        let memory: usize =
            lobes::memory_bytes(lobes) + light.tables.as_ref().map_or(0, |tables| tables.memory_bytes());
        let mut notes = vec![format!("one bounce of light, {shadows}")];
        if look.buffer.is_some() {
            notes.push(format!(
                "shaded {:.1} % of the {} pixels that show something, by {:.0} samples each on the average; tables of {:.0} MB",
                (100.0 * shaded as f64 / look.covered.max(1) as f64).min(100.0),
                look.covered,
                samples as f64 / shaded.max(1) as f64,
                memory as f64 / 1e6,
            ));
        }
        if self.settings.antialias != Antialias::One && look.buffer.is_some() {
            let share = 100.0 * look.finer as f64 / look.shaded.pixels.len() as f64;
            notes.push(format!("{share:.1} % of all pixels are antialiased"));
        }
        if !light.suns.is_empty() {
            let suns = match light.suns.len() {
                1 => "one narrow bright light of the map is shaded by itself".to_string(),
                n => format!("{n} narrow bright lights of the map are shaded by themselves"),
            };
            notes.push(suns);
        }
        if let Some(buffer) = &look.buffer {
            let most = |p: &&predict::Predicted| p.samples.iter().any(|&n| usize::from(n) >= MOST_SAMPLES);
            let capped = buffer.pixels.iter().filter(most).count();
            if capped * 100 > look.covered {
                notes.push(format!(
                    "{:.0} % of the pixels would need more than {MOST_SAMPLES} samples for an error of {} %",
                    100.0 * capped as f64 / look.covered as f64,
                    100.0 * self.settings.target_error(),
                ));
            }
        }
        notes.extend(self.openness.iter().flat_map(Openness::notes).cloned());
        notes.extend(self.lobes.notes.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned());
        notes
    }
}

/// What was predicted and done, as layers of the picture.
fn add_layers(film: &mut Film, look: &Look) {
    let mut add = |name: &str, values: Vec<f32>| film.layers.insert(name.to_string(), values);
    add("shaded", look.shaded.pixels.iter().map(|p| f32::from(u8::from(p.shaded))).collect());
    add("shading-samples", look.shaded.pixels.iter().map(|p| f32::from(p.samples)).collect());
    if let Some(buffer) = &look.buffer {
        add("bandwidth", buffer.pixels.iter().map(|p| p.bandwidth).collect());
        add("level", buffer.pixels.iter().map(|p| f32::from(p.level)).collect());
        add("predicted-variance", buffer.pixels.iter().map(|p| p.variance).collect());
    }
}
