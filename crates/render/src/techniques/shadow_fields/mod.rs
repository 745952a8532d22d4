//! `shadow-fields`: precomputed shadow fields, soft shadows among rigid things that move, with lamps that move among them.
//!
//! Each object carries what it hides from its own surface, and on concentric shells around it what it hides from
//! others (and, if it shines, how it shines), as spherical harmonics. In a frame these are interpolated at each
//! visible point, turned with the object, and multiplied in order of distance. Direct light of the environment and
//! of shining objects, in a few bands. Flat shapes hide analytically and need no field; height fields have a lattice.
//!
//! | file | what it does |
//! |---|---|
//! | `cast` | vectors by ray casting |
//! | `shells`, `own`, `relief`, `flat` | fields around objects, on their surfaces, over height fields; flat shapes |
//! | `entity` | what is prepared for a scene |
//! | `pose` | where it stands in a frame |
//! | `shade` | the loop at each visible point |
//! | `accuracy` | error and memory of fields |
//!
//! Sources: Zhou, Hu, Lin, Guo and Shum 2005; seed \[004\]. Cost at order 4: about 0.1 µs for each object at each point.

mod accuracy;
mod cast;
mod entity;
mod flat;
mod own;
mod pose;
mod relief;
mod settings;
mod shade;
mod shells;
#[cfg(test)]
mod tests;

use halflight_scene::{Frame, Scene};

pub use accuracy::{FieldAccuracy, field_accuracy};
pub use settings::ShadowFieldsSettings;

use crate::film::Film;
use crate::gbuffer::Room;
use crate::looks::{Stages, add_looks};
use crate::sh_light::{FrameLight, LightCache, SHARP_LIGHT, refuse_too_bright, simd};
use crate::technique::{Budget, Deadline, Progress, RenderReport, Technique, TechniqueError};
use entity::Cast;
use flat::FlatTable;
use pose::Stage;
use shade::Shader;

/// The name of the technique.
const NAME: &str = "shadow-fields";

/// The technique `shadow-fields`.
pub struct ShadowFields {
    settings: ShadowFieldsSettings,
    state: State,
}

/// What depends on the order.
enum State {
    Order3(Prepared<3>),
    Order4(Prepared<4>),
    Order5(Prepared<5>),
    Order6(Prepared<6>),
}

struct Prepared<const ORDER: usize> {
    cast: Option<Cast<ORDER>>,
    flats: FlatTable<ORDER>,
    light: LightCache<ORDER>,
    room: Room,
}

impl<const ORDER: usize> Prepared<ORDER> {
    fn new() -> Self {
        Self { cast: None, flats: FlatTable::new(), light: LightCache::default(), room: Room::default() }
    }
}

impl ShadowFields {
    /// With settings other than the default.
    pub fn new(settings: ShadowFieldsSettings) -> Self {
        let state = match settings.order {
            ..=3 => State::Order3(Prepared::new()),
            4 => State::Order4(Prepared::new()),
            5 => State::Order5(Prepared::new()),
            _ => State::Order6(Prepared::new()),
        };
        Self { settings, state }
    }
}

fn failure(reason: impl Into<String>) -> TechniqueError {
    TechniqueError { technique: NAME, reason: reason.into() }
}

impl Technique for ShadowFields {
    fn divides(&self) -> bool {
        true
    }

    fn prepare(&mut self, scene: &Scene, progress: &dyn Progress) -> Result<(), TechniqueError> {
        let frame = scene.at(0.0).map_err(|error| failure(error.to_string()))?;
        let settings = &self.settings;
        match &mut self.state {
            State::Order3(prepared) => prepared.cast = Some(Cast::new(scene, &frame, settings, progress)),
            State::Order4(prepared) => prepared.cast = Some(Cast::new(scene, &frame, settings, progress)),
            State::Order5(prepared) => prepared.cast = Some(Cast::new(scene, &frame, settings, progress)),
            State::Order6(prepared) => prepared.cast = Some(Cast::new(scene, &frame, settings, progress)),
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
        match &self.state {
            State::Order3(prepared) => prepared.render(frame, film, budget, progress),
            State::Order4(prepared) => prepared.render(frame, film, budget, progress),
            State::Order5(prepared) => prepared.render(frame, film, budget, progress),
            State::Order6(prepared) => prepared.render(frame, film, budget, progress),
        }
    }
}

impl<const ORDER: usize> Prepared<ORDER> {
    fn render(
        &self,
        frame: &Frame,
        film: &mut Film,
        budget: &Budget,
        progress: &dyn Progress,
    ) -> Result<RenderReport, TechniqueError> {
        let deadline = Deadline::new(budget.seconds);
        refuse_too_bright(&frame.lights, NAME)?;
        let cast = self.cast.as_ref().ok_or_else(|| failure("its fields are not prepared"))?;
        let stage = Stage::new(cast, frame)
            .ok_or_else(|| failure("its fields were prepared for a scene of other objects"))?;
        let light = self.light.light(&frame.lights);
        let lamps = stage.entities.iter().filter(|posed| posed.entity.radiance.is_some()).count();
        if light.is_none() && lamps == 0 {
            return Err(failure(
                "it has neither an environment nor shining objects, and this technique shades by nothing else (give \
                 it one, or use path)",
            ));
        }
        let shader = Shader {
            simd: simd(frame.world.simd()),
            stage: &stage,
            flats: &self.flats,
            environment: light.as_ref().map(|light| &light.radiance),
            frame,
        };
        let notes = notes(frame, light.as_ref(), lamps, cast, &stage);
        let mut report = RenderReport { notes, ..RenderReport::default() };
        let work = (&mut report, Stages::default());
        let region = film.region();
        add_looks(frame, (film, region), (budget, &deadline), progress, work, &self.room, |view, stages| {
            stages.time("pixels", || shade::shade(&shader, view))
        });
        Ok(report)
    }
}

/// Approximations in force.
fn notes<const ORDER: usize>(
    frame: &Frame,
    light: Option<&FrameLight<ORDER>>,
    lamps: usize,
    cast: &Cast<ORDER>,
    stage: &Stage<ORDER>,
) -> Vec<String> {
    let from = match (light, lamps) {
        (Some(_), 0) => "the environment".to_string(),
        (Some(_), lamps) => format!("the environment and {lamps} shining {}", objects(lamps)),
        (None, lamps) => format!("{lamps} shining {}", objects(lamps)),
    };
    let mut notes = vec![format!("direct light of {from} only, in {ORDER} bands")];
    if let Some(light) = light.filter(|light| light.kept < SHARP_LIGHT) {
        notes.push(format!(
            "{ORDER} bands keep {:.1} % of the environment's energy; the rest sits in small bright places such as a \
             sun: shadows are softer than they should be",
            100.0 * light.kept
        ));
    }
    let deltas = frame.lights.deltas().len();
    if deltas > 0 {
        notes.push(format!("{deltas} lights without extent are left out: give them a size, as spheres"));
    }
    let [fields, surfaces] = cast.memory_bytes().map(|bytes| bytes as f64 / f64::from(1 << 20));
    notes.push(format!("fields take {fields:.1} MiB, vectors on surfaces {surfaces:.1} MiB"));
    notes.extend(stage.notes.iter().cloned());
    notes
}

fn objects(count: usize) -> &'static str {
    if count == 1 { "object" } else { "objects" }
}
