//! `prt`: precomputed radiance transfer, soft shadows and interreflection in a scene that stands still.
//!
//! Each vertex keeps how it answers to each harmonic of the environment: a vector for diffuse surfaces, a matrix for glossy
//! ones. They are found once, by rays; a light that turns or is another costs nothing but dot products. What light is
//! not of the environment, or of higher bands than the order, is left out. If something has moved all is worked out anew.
//!
//! | file | what it does |
//! |---|---|
//! | `receivers` | the surfaces of a frame as triangles |
//! | `tree` | triangles halved |
//! | `directions` | where vertices look |
//! | `cast` | what they see |
//! | `bounce` | light that is given back |
//! | `transfer` | all of it, where it is needed |
//! | `key`, `cache` | kept from run to run |
//! | `shade` | from there to radiance |
//!
//! Sources: Sloan, Kautz & Snyder 2002; seed \[004\].

mod bounce;
mod cache;
mod cast;
mod directions;
mod key;
mod receivers;
mod settings;
mod shade;
#[cfg(test)]
mod tests;
mod transfer;
mod tree;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use halflight_scene::lights::Lights;
use halflight_scene::{Frame, Scene};
use halflight_trace::Instance;

pub use settings::{PrtSettings, TransferKind};

use crate::content::Key;
use crate::film::Film;
use crate::gbuffer::Room;
use crate::looks::{Stages, add_looks};
use crate::sh_light::{LightCache, SHARP_LIGHT, left_out, refuse_too_bright};
use crate::technique::{Budget, Deadline, Progress, RenderReport, Technique, TechniqueError};
use cast::Caster;
use directions::{Cosine, Directions};
use receivers::Receivers;
use shade::{Light, Lit};
use transfer::Transfer;

/// The name of the technique.
const NAME: &str = "prt";
/// More than this, as matrices or vectors, is refused.
const MAX_BYTES: u64 = 16 << 30;

/// The technique `prt`.
pub struct Prt {
    settings: PrtSettings,
    lights: ProjectedLights,
    prepared: Mutex<Option<Arc<Prepared>>>,
    room: Room,
}

/// What is kept from frame to frame.
struct Prepared {
    /// What stood where: kept, so that a geometry at the same address is the same.
    instances: Vec<Instance>,
    key: Key,
    receivers: Receivers,
    transfer: Arc<Transfer>,
    notes: Vec<String>,
}

/// The last light, in each order.
#[derive(Default)]
struct ProjectedLights {
    order3: LightCache<3>,
    order4: LightCache<4>,
    order5: LightCache<5>,
    order6: LightCache<6>,
}

impl ProjectedLights {
    /// The environment in so many bands, and the share of its energy that they keep.
    fn light(&self, lights: &Lights, order: u32) -> Option<(Light, f64)> {
        Some(match order {
            ..=3 => self.order3.light(lights).map(|l| (l.radiance.map(|c| c.resized()), l.kept))?,
            4 => self.order4.light(lights).map(|l| (l.radiance.map(|c| c.resized()), l.kept))?,
            5 => self.order5.light(lights).map(|l| (l.radiance.map(|c| c.resized()), l.kept))?,
            _ => self.order6.light(lights).map(|l| (l.radiance, l.kept))?,
        })
    }
}

impl Prt {
    /// With settings other than the default.
    pub fn new(settings: PrtSettings) -> Self {
        Self {
            settings,
            lights: ProjectedLights::default(),
            prepared: Mutex::new(None),
            room: Room::default(),
        }
    }

    /// Transfer for a frame: what is there if nothing has moved, or made anew. `None` if told to stop.
    fn prepared_for(
        &self,
        frame: &Frame,
        progress: &dyn Progress,
    ) -> Result<Option<Arc<Prepared>>, TechniqueError> {
        let mut slot = self.prepared.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = slot.as_ref().filter(|known| known.is_of(frame)) {
            return Ok(Some(Arc::clone(known)));
        }
        let moved = slot.is_some();
        let receivers = Receivers::of(frame, transfer::longest_edge(frame, &self.settings));
        let key = Key::of(frame, &receivers, &self.settings);
        let instances = frame.world.instances().to_vec();
        let mut notes = Vec::new();
        let transfer = match slot.as_ref().filter(|known| known.key == key) {
            Some(known) => {
                notes.clone_from(&known.notes);
                Arc::clone(&known.transfer)
            }
            None => match self.find_or_make(frame, &receivers, &key, &mut notes, progress)? {
                Some(transfer) => {
                    if moved {
                        notes.push("things have moved: transfer was worked out anew for this frame".into());
                    }
                    Arc::new(transfer)
                }
                None => return Ok(None),
            },
        };
        let prepared = Arc::new(Prepared { instances, key, receivers, transfer, notes });
        *slot = Some(Arc::clone(&prepared));
        Ok(Some(prepared))
    }

    /// From the cache, or by rays.
    fn find_or_make(
        &self,
        frame: &Frame,
        receivers: &Receivers,
        key: &Key,
        notes: &mut Vec<String>,
        progress: &dyn Progress,
    ) -> Result<Option<Transfer>, TechniqueError> {
        let path = self.settings.cache.as_ref().map(|cache| cache_file(&cache.path, key));
        if let Some(path) = &path {
            check_cache(path)?;
            match cache::load(path, key, frame, receivers, &self.settings) {
                Ok(Some(transfer)) => {
                    notes.push(format!("transfer is from {}; {}", path.display(), said(&transfer)));
                    return Ok(Some(transfer));
                }
                Ok(None) => {}
                Err(reason) => notes.push(format!("transfer was made anew: {reason}")),
            }
        }
        self.refuse_too_much()?;
        let start = Instant::now();
        let Some(transfer) = transfer::work_out(frame, receivers, &self.settings, progress) else {
            return Ok(None);
        };
        notes.push(format!(
            "transfer took {:.1} s and {:.1} million rays; {}",
            start.elapsed().as_secs_f64(),
            transfer.rays as f64 * 1e-6,
            said(&transfer)
        ));
        if transfer.is_cut_short {
            notes.push("there were more edges to halve than `max_vertices` allows".into());
        }
        if let Some(path) = &path {
            let albedos = key::albedos(&transfer, frame, receivers, &self.settings);
            match cache::save(path, key, albedos, &transfer) {
                Ok(()) => notes.push(format!("transfer is kept in {}", path.display())),
                Err(error) => notes.push(format!("transfer is not kept: {error}")),
            }
        }
        Ok(Some(transfer))
    }

    fn refuse_too_much(&self) -> Result<(), TechniqueError> {
        let (n, colors) =
            (u64::from(self.settings.order.pow(2)), if self.settings.bounces() > 0 { 3 } else { 1 });
        let bytes = u64::from(self.settings.max_vertices) * colors * n * (n + 1) * 4;
        if bytes > MAX_BYTES {
            let reason = format!(
                "{} vertices of order {} may take {} GiB (lower `max_vertices` or `order`)",
                self.settings.max_vertices,
                self.settings.order,
                bytes >> 30
            );
            return Err(TechniqueError { technique: NAME, reason });
        }
        Ok(())
    }

    /// What the picture leaves out.
    fn notes(&self, frame: &Frame, kept: f64, prepared: &Prepared) -> Vec<String> {
        let mut notes = prepared.notes.clone();
        notes.push(format!(
            "light of the environment only, in {} bands, which keep {:.1} % of its energy",
            self.settings.order,
            100.0 * kept
        ));
        if kept < SHARP_LIGHT {
            notes.push(
                "the rest sits in small bright places such as a sun: shadows are softer than they should be"
                    .into(),
            );
        }
        notes.extend(left_out(&frame.lights));
        notes
    }
}

/// What there is of transfer, and how good it is.
fn said(transfer: &Transfer) -> String {
    let [mean, high] = transfer.error.map(|e| 100.0 * e);
    format!(
        "{} vertices; between them direct transfer is off by {mean:.2} % of the unshadowed in the mean, by less than {high:.1} % at 95 % of places",
        transfer.normals.len()
    )
}

/// A file in a folder that is there, or the file itself.
fn cache_file(path: &std::path::Path, key: &Key) -> PathBuf {
    if path.is_dir() { path.join(format!("{key}.prt.safetensors")) } else { path.to_path_buf() }
}

/// Refuses names that cannot be those of a cache before anything is worked out.
fn check_cache(path: &std::path::Path) -> Result<(), TechniqueError> {
    let refuse = |why: String| {
        let reason = format!("`cache` names {}, {why}", path.display());
        Err(TechniqueError { technique: NAME, reason })
    };
    if path.extension().is_none_or(|ending| ending != cache::ENDING) {
        return refuse(format!(
            "whose name does not end in .{} (other files are never written over; or name a folder)",
            cache::ENDING
        ));
    }
    if path.parent().is_some_and(|folder| !folder.as_os_str().is_empty() && !folder.is_dir()) {
        return refuse("whose folder is not there (make it first)".into());
    }
    Ok(())
}

impl Prepared {
    /// Whether everything stands where it stood.
    fn is_of(&self, frame: &Frame) -> bool {
        let now = frame.world.instances();
        now.len() == self.instances.len()
            && now
                .iter()
                .zip(&self.instances)
                .all(|(a, b)| Arc::ptr_eq(&a.geometry, &b.geometry) && a.transform.open == b.transform.open)
    }
}

impl Technique for Prt {
    fn divides(&self) -> bool {
        true
    }

    fn prepare(&mut self, scene: &Scene, progress: &dyn Progress) -> Result<(), TechniqueError> {
        *self.prepared.get_mut().unwrap_or_else(PoisonError::into_inner) = None;
        // Of what moves, only a frame that is asked for is worth the work.
        if !scene.is_animated() {
            let frame = scene
                .at(0.0)
                .map_err(|error| TechniqueError { technique: NAME, reason: error.to_string() })?;
            self.prepared_for(&frame, progress)?;
        }
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
        refuse_too_bright(&frame.lights, NAME)?;
        let Some((light, kept)) = self.lights.light(&frame.lights, self.settings.order) else {
            let reason =
                "it has no environment, and this technique shades by nothing else (give it one, or use path)";
            return Err(TechniqueError { technique: NAME, reason: reason.into() });
        };
        let Some(prepared) = self.prepared_for(frame, progress)? else {
            return Ok(RenderReport { interrupted: true, ..RenderReport::default() });
        };
        let mut report =
            RenderReport { notes: self.notes(frame, kept, &prepared), ..RenderReport::default() };
        // Each pixel has neighbours, and each look others: fewer rays than a vertex has are enough.
        let n = (self.settings.order * self.settings.order) as usize;
        let directions = Directions::new((self.settings.rays as usize / 2).max(64), n, 0.0);
        let cosine = Cosine::new();
        let caster = Caster {
            world: &frame.world,
            directions: &directions,
            cosine: &cosine,
            n,
            is_shadowed: self.settings.transfer != TransferKind::Unshadowed,
            with_matrices: true,
        };
        let lit = Lit::new(frame, &prepared.receivers, &prepared.transfer, &light, &caster);
        let (mut unknown, mut strange) = (0, 0);
        let work = (&mut report, Stages::default());
        let region = film.region();
        add_looks(frame, (film, region), (budget, &deadline), progress, work, &self.room, |view, stages| {
            let (picture, without, here) = stages.time("pixels", || lit.picture(view));
            unknown = unknown.max(without);
            strange = strange.max(here);
            picture
        });
        if strange > 0 {
            let without = if self.settings.bounces() > 0 {
                "; what surfaces give back is left out on them"
            } else {
                ""
            };
            report.notes.push(format!(
                "{strange} pixels see a learned field: their transfer was worked out one by one, by {} rays each, and is not kept{without}",
                directions.vectors.len() / 2
            ));
        }
        if unknown > 0 {
            report.notes.push(format!(
                "{unknown} pixels see a side of a surface that no transfer is worked out for (the inside of a closed body, height fields from below), and are black"
            ));
        }
        Ok(report)
    }
}
