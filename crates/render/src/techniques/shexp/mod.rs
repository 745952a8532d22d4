//! `shexp`: spherical-harmonic exponentiation, soft shadows among things that deform every frame.
//!
//! Meshes block light as sphere sets, height fields through a pyramid of heights; nothing else is prepared from them, so
//! both may change in every frame. Direct light of the environment only, in a few bands of spherical harmonics:
//! shadows of small suns come out soft. Cost: a few nanoseconds for each blocker at each point that is worked out; the
//! points between are interpolated where the result is smooth.
//!
//! | file | what it does |
//! |---|---|
//! | `blockers` | the spheres of a frame |
//! | `horizon`, `plate`, `wedge` | what height fields and rectangles hide |
//! | `solve` | light with visibility at points |
//! | `refine`, `between` | which points, from coarse to fine, and the pixels between them |
//! | `shade` | from light to radiance |
//! | `openness` | the same visibility for techniques that shade by samples |
//!
//! Sources: Ren et al. 2006 and seed \[004\]; height fields: seed \[000\], Snyder & Nowrouzezahrai 2008.

mod between;
mod blockers;
mod horizon;
mod openness;
mod plate;
mod refine;
mod settings;
mod shade;
mod solve;
mod wedge;

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use halflight_scene::lights::Lights;
use halflight_scene::{Frame, Scene};
use halflight_sh::{BlockerTable, ClosedForm};
use halflight_trace::{Geometry, Instance};

pub(crate) use openness::{FrameOpenness, ORDER as OPENNESS_ORDER, Openness, OpennessRoom};
pub use settings::{BlockerLog, Composition, ExponentialKind, GlossyForm, ShexpSettings};

use crate::film::{Film, Region};
use crate::gbuffer::Room;
use crate::looks::{Stages, add_looks};
use crate::sh_light::{FrameLight, LightCache, SHARP_LIGHT, left_out, refuse_too_bright, simd};
use crate::technique::{Budget, Deadline, Progress, RenderReport, Technique, TechniqueError};
use blockers::{BODY_EPSILON, Bodies};
use horizon::FieldVisibility;
use plate::Plate;
use shade::Kernels;
pub(crate) use solve::Receiver;
use solve::{Solver, Tables};
use wedge::WedgeTable;

/// The name of the technique.
const NAME: &str = "shexp";
/// Rectangles that block light.
const MOST_PLATES: usize = 4;

/// The technique `shexp`.
pub struct Shexp {
    settings: ShexpSettings,
    bodies: Bodies,
    state: State,
    room: Room,
}

/// What depends on the order.
enum State {
    Order3(Prepared<3>),
    Order4(Prepared<4>),
    Order5(Prepared<5>),
    Order6(Prepared<6>),
}

struct Prepared<const ORDER: usize> {
    tables: Mutex<Option<Arc<Tables<ORDER>>>>,
    kernels: OnceLock<Kernels<ORDER>>,
    light: LightCache<ORDER>,
    /// Memory that is kept from picture to picture.
    lights: Mutex<refine::Lights<ORDER>>,
}

impl<const ORDER: usize> Default for Prepared<ORDER> {
    fn default() -> Self {
        Self {
            tables: Mutex::new(None),
            kernels: OnceLock::new(),
            light: LightCache::default(),
            lights: Mutex::default(),
        }
    }
}

impl Shexp {
    /// With settings other than the default.
    pub fn new(settings: ShexpSettings) -> Self {
        let state = match settings.order {
            ..=3 => State::Order3(Prepared::default()),
            4 => State::Order4(Prepared::default()),
            5 => State::Order5(Prepared::default()),
            _ => State::Order6(Prepared::default()),
        };
        Self { settings, bodies: Bodies::default(), state, room: Room::default() }
    }
}

impl Technique for Shexp {
    fn prepare(&mut self, scene: &Scene, progress: &dyn Progress) -> Result<(), TechniqueError> {
        self.bodies = learn(scene, &self.settings, progress)?;
        Ok(())
    }

    fn render(
        &self,
        frame: &Frame,
        film: &mut Film,
        budget: &Budget,
        progress: &dyn Progress,
    ) -> Result<RenderReport, TechniqueError> {
        match &self.state {
            State::Order3(prepared) => self.render_in(prepared, frame, film, budget, progress),
            State::Order4(prepared) => self.render_in(prepared, frame, film, budget, progress),
            State::Order5(prepared) => self.render_in(prepared, frame, film, budget, progress),
            State::Order6(prepared) => self.render_in(prepared, frame, film, budget, progress),
        }
    }
}

impl<const ORDER: usize> Prepared<ORDER> {
    fn tables(&self, settings: &ShexpSettings) -> Arc<Tables<ORDER>> {
        let mut tables = self.tables.lock().unwrap_or_else(PoisonError::into_inner);
        let make = || {
            Arc::new(Tables {
                single: settings.closed_form().map_or_else(BlockerTable::new, BlockerTable::closed_form),
                body: BlockerTable::closed_form(ClosedForm::Fixed { epsilon: BODY_EPSILON }),
                wedges: WedgeTable::new(),
            })
        };
        Arc::clone(tables.get_or_insert_with(make))
    }
}

impl Shexp {
    /// What the picture leaves out.
    fn notes<const ORDER: usize>(
        &self,
        light: &FrameLight<ORDER>,
        lights: &Lights,
        spheres: usize,
    ) -> Vec<String> {
        let mut notes = vec![format!(
            "direct light of the environment only, in {ORDER} bands, which keep {:.1} % of its energy; {spheres} spheres \
             block it",
            100.0 * light.kept
        )];
        if light.kept < SHARP_LIGHT {
            notes.push(
                "the rest sits in small bright places such as a sun: shadows are softer than they should be"
                    .into(),
            );
        }
        notes.extend(left_out(lights));
        notes.extend(self.bodies.notes.iter().cloned());
        notes
    }

    fn render_in<const ORDER: usize>(
        &self,
        prepared: &Prepared<ORDER>,
        frame: &Frame,
        film: &mut Film,
        budget: &Budget,
        progress: &dyn Progress,
    ) -> Result<RenderReport, TechniqueError> {
        let deadline = Deadline::new(budget.seconds);
        refuse_too_bright(&frame.lights, NAME)?;
        let Some(light) = prepared.light.light(&frame.lights) else {
            let reason =
                "it has no environment, and this technique shades by nothing else (give it one, or use path)";
            return Err(TechniqueError { technique: NAME, reason: reason.into() });
        };
        let tables = prepared.tables(&self.settings);
        let kernels = prepared.kernels.get_or_init(|| Kernels::new(&self.settings));
        let mut stages = Stages::default();
        let blockers = stages.time("spheres", || self.bodies.pose(frame, self.settings.attenuation));
        let fields = stages.time("heights", || fields(frame));
        let plates = plates(frame);
        let solver = Solver {
            simd: simd(frame.world.simd()),
            tables: &tables,
            blockers: &blockers,
            fields: &fields,
            plates: &plates,
            light: &light.radiance,
            attenuation: self.settings.attenuation,
            composition: self.settings.composition,
            exponential: self.settings.exponential(),
            cut: self.settings.cut_degrees.to_radians().sin(),
        };
        let mut report = RenderReport {
            notes: self.notes(&light, &frame.lights, blockers.len()),
            ..RenderReport::default()
        };
        let (mut solved, mut pixels) = (0, 0);
        let work = (&mut report, stages);
        let region = Region::whole(film.width(), film.height());
        add_looks(frame, (film, region), (budget, &deadline), progress, work, &self.room, |view, stages| {
            let mut lights =
                std::mem::take(&mut *prepared.lights.lock().unwrap_or_else(PoisonError::into_inner));
            let picture = refine::shade(&solver, view, frame, (&self.settings, kernels), &mut lights, stages);
            let points = lights.len();
            *prepared.lights.lock().unwrap_or_else(PoisonError::into_inner) = lights;
            (solved, pixels) = (solved + points, pixels + picture.len());
            picture
        });
        if pixels > 0 {
            let share = 100.0 * solved as f64 / pixels as f64;
            report.notes.push(format!(
                "light was worked out at {share:.1} % of the pixels, and taken from those elsewhere"
            ));
        }
        Ok(report)
    }
}

/// The spheres that stand for the meshes of a scene, and how those that are there overlap.
fn learn(scene: &Scene, settings: &ShexpSettings, progress: &dyn Progress) -> Result<Bodies, TechniqueError> {
    let frame =
        scene.at(0.0).map_err(|error| TechniqueError { technique: NAME, reason: error.to_string() })?;
    let mut bodies = Bodies::fit(scene, &frame, settings.spheres as usize, progress);
    bodies.look_at(&frame);
    Ok(bodies)
}

/// The height fields of a frame, ready to be marched.
fn fields(frame: &Frame) -> Vec<FieldVisibility> {
    let field = |(index, instance): (u32, &Instance)| match instance.geometry.as_ref() {
        Geometry::HeightField(tracer) => {
            FieldVisibility::new(tracer.field(), index, &instance.transform.open)
        }
        _ => None,
    };
    (0..).zip(frame.world.instances()).filter_map(field).collect()
}

/// The flat rectangles of a frame. More than a few would cost more than they hide: only the largest are taken.
fn plates(frame: &Frame) -> Vec<Plate> {
    let area = |instance: &Instance| {
        let matrix = instance.transform.open.matrix3;
        matrix.x_axis.cross(matrix.y_axis).length()
    };
    let mut found: Vec<(u32, &Instance)> = (0..).zip(frame.world.instances()).collect();
    found.retain(|(_, instance)| matches!(instance.geometry.as_ref(), Geometry::Rectangle(_)));
    found.sort_by(|a, b| area(b.1).total_cmp(&area(a.1)).then(a.0.cmp(&b.0)));
    found
        .iter()
        .take(MOST_PLATES)
        .filter_map(|(i, instance)| Plate::new(*i, &instance.transform.open))
        .collect()
}
