//! One side of the picture: a technique with its settings and the film that it fills, or a stored picture.

use std::sync::Arc;
use std::time::Duration;

use halflight_image::RgbImage;
use halflight_render::techniques::{self, TECHNIQUES};
use halflight_render::{Budget, Film, Technique};
use halflight_scene::Frame;
use halflight_scene::schema::{FieldDoc, Table};
use serde_json::{Value, json};

use crate::Stage;
use crate::hub::Hub;
use crate::job::{Done, Job, Kind, Order};
use crate::pictures;

/// Milliseconds that a picture may take while something moves: with what it costs to send it, less than a tenth of a
/// second passes from the hand to the eye.
const LIVELY: f64 = 55.0;
/// The coarsest a moving picture gets, in parts of the size at rest.
const COARSEST: f64 = 0.125;
/// Samples of pictures at rest: path tracing goes on, the others are smooth soon.
const SAMPLES_BY_PATHS: u32 = 4096;
const SAMPLES_OF_LOOKS: u32 = 16;
/// Milliseconds between the pictures that go out while one gets better.
const BETWEEN: f64 = 250.0;
/// A picture that takes longer than this is being prepared, and the page says so.
const LONG: Duration = Duration::from_millis(350);

/// A stored picture in the place of a technique.
pub(crate) struct Reference {
    pub(crate) name: String,
    pub(crate) image: Arc<RgbImage>,
}

pub(crate) struct Shown {
    pub(crate) name: String,
    /// What was set here, beyond the scene.
    pub(crate) settings: Vec<(String, String)>,
    /// Shown instead of what the technique makes.
    pub(crate) reference: Option<Reference>,
    technique: Option<Box<dyn Technique>>,
    /// Empty while a job has it.
    pub(crate) film: Film,
    job: Option<Job>,
    /// The layers that the technique left in its last film.
    pub(crate) layers: Vec<String>,
    /// A picture of what is there now has to be sketched.
    pub(crate) outdated: bool,
    /// Why there is no picture.
    pub(crate) failed: Option<String>,
    pub(crate) notes: Vec<String>,
    /// Milliseconds of each stage, for one sample.
    stages: Vec<(String, f64)>,
    /// Milliseconds that a sample took, and what a pixel costs.
    pub(crate) milliseconds: f64,
    per_pixel: Option<f64>,
    pub(crate) moving: bool,
}

/// What became of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Arrival {
    /// A coarse picture.
    Sketch,
    /// A better picture at rest.
    Better,
    /// Nothing that could be shown.
    Nothing,
}

impl Shown {
    pub(crate) fn new(name: &str) -> Self {
        Self {
            name: name.into(),
            settings: Vec::new(),
            reference: None,
            technique: None,
            film: Film::new(1, 1),
            job: None,
            layers: Vec::new(),
            outdated: true,
            failed: None,
            notes: Vec::new(),
            stages: Vec::new(),
            milliseconds: 0.0,
            per_pixel: None,
            moving: false,
        }
    }

    /// What it is called on the page.
    pub(crate) fn title(&self) -> &str {
        self.reference.as_ref().map_or(&self.name, |reference| &reference.name)
    }

    /// The same technique for another scene or with other settings: made again when it is needed. Work under way is told
    /// to stop, and what comes of it is dropped.
    pub(crate) fn forget(&mut self) {
        if self.job.take().is_some() {
            self.film = Film::new(1, 1);
        }
        self.technique = None;
        self.failed = None;
        self.per_pixel = None;
        self.outdated = true;
    }

    /// Changes a setting; one that the technique refuses leaves everything as it was.
    pub(crate) fn set(&mut self, stage: &Stage, key: &str, value: &str) -> Result<(), String> {
        let mut settings = self.settings.clone();
        settings.retain(|(known, _)| known != key);
        if !value.is_empty() {
            settings.push((key.into(), value.into()));
        }
        create(&self.name, stage, &settings)?;
        self.settings = settings;
        self.forget();
        Ok(())
    }

    pub(crate) fn is_out(&self) -> bool {
        self.job.is_some()
    }

    /// Work at the picture at rest ends soon, and keeps what it has.
    pub(crate) fn hurry(&mut self) {
        if let Some(job) = self.job.as_ref().filter(|job| job.kind != Kind::Sketch) {
            job.cancel();
        }
    }

    /// The same, but of a picture that has nothing to show yet the first pass is finished: techniques that look at the whole
    /// picture at once would never come to its end.
    pub(crate) fn hurry_if_there_is_something(&mut self) {
        if let Some(job) =
            self.job.as_ref().filter(|job| matches!(job.kind, Kind::Refine { before } if before > 0))
        {
            job.cancel();
        }
    }

    /// Things have moved: work that takes long for where they were ends.
    pub(crate) fn give_up_if_long(&mut self) {
        if let Some(job) = self.job.as_ref().filter(|job| job.begun.elapsed() > LONG) {
            job.cancel();
        }
    }

    /// What takes long, and for how many seconds it has.
    pub(crate) fn busy(&self) -> Option<(String, f64)> {
        let job = self.job.as_ref().filter(|job| job.begun.elapsed() > LONG)?;
        (job.kind == Kind::Sketch || job.prepares()).then(|| (job.told(), job.begun.elapsed().as_secs_f64()))
    }

    /// Whether other work may go on beside this side's.
    pub(crate) fn leaves_room(&self) -> bool {
        self.job.as_ref().is_none_or(|job| job.begun.elapsed() > LONG && self.busy().is_some())
    }

    /// Begins one sample a pixel at a size that keeps up with the hand.
    pub(crate) fn sketch(
        &mut self,
        stage: &Arc<Stage>,
        frame: &Arc<Frame>,
        size: [usize; 2],
        hub: &Arc<Hub>,
    ) {
        (self.outdated, self.failed) = (false, None);
        let full = (size[0] * size[1]) as f64;
        let wanted = self.per_pixel.map_or(0.25, |cost| (LIVELY / (cost * full)).sqrt());
        // In steps, so that the picture does not flicker between sizes.
        let scale = ((wanted * 8.0).floor() / 8.0).clamp(COARSEST, 1.0);
        let of = |side: usize| ((side as f64 * scale).round() as usize).max(1);
        self.film = Film::new(of(size[0]), of(size[1]));
        self.moving = true;
        self.begin(Kind::Sketch, 1, stage, frame, hub);
    }

    /// Begins to make the picture at rest better; false if it is as good as it gets.
    pub(crate) fn refine(
        &mut self,
        stage: &Arc<Stage>,
        frame: &Arc<Frame>,
        size: [usize; 2],
        hub: &Arc<Hub>,
    ) -> bool {
        if !self.wants_more(size) {
            return false;
        }
        if [self.film.width(), self.film.height()] != size || self.moving {
            self.film = Film::new(size[0], size[1]);
            self.moving = false;
        }
        let before = self.film.min_samples();
        let each = if before == 0 { f64::INFINITY } else { self.milliseconds.max(1.0) };
        let more = if each.is_finite() { (BETWEEN / each).clamp(1.0, f64::from(before)) as u32 } else { 1 };
        let samples = (before + more).min(self.most());
        self.begin(Kind::Refine { before }, samples, stage, frame, hub);
        true
    }

    /// Whether the picture at rest is not finished.
    pub(crate) fn wants_more(&self, size: [usize; 2]) -> bool {
        let other = self.moving || [self.film.width(), self.film.height()] != size;
        self.reference.is_none()
            && self.failed.is_none()
            && (self.is_out() || other || self.film.min_samples() < self.most())
    }

    /// Whether there is a picture at rest, however rough, or never will be one.
    pub(crate) fn has_settled(&self, size: [usize; 2]) -> bool {
        self.reference.is_some()
            || self.failed.is_some()
            || (!self.is_out()
                && !self.moving
                && !self.outdated
                && [self.film.width(), self.film.height()] == size
                && self.film.min_samples() > 0)
    }

    fn most(&self) -> u32 {
        if self.is_by_paths() { SAMPLES_BY_PATHS } else { SAMPLES_OF_LOOKS }
    }

    /// Whether noise falls for as long as one waits.
    fn is_by_paths(&self) -> bool {
        matches!(self.name.as_str(), "path" | "covariance")
    }

    fn begin(&mut self, kind: Kind, samples: u32, stage: &Arc<Stage>, frame: &Arc<Frame>, hub: &Arc<Hub>) {
        let technique = match self.technique.take() {
            Some(technique) => (technique, true),
            None => match create(&self.name, stage, &self.settings) {
                Ok(technique) => (technique, false),
                Err(reason) => return self.failed = Some(reason),
            },
        };
        let order = Order {
            technique,
            film: std::mem::replace(&mut self.film, Film::new(1, 1)),
            budget: Budget { samples: Some(samples), ..Budget::default() },
            stage: Arc::clone(stage),
            frame: Arc::clone(frame),
        };
        match Job::start(kind, order, Arc::clone(hub)) {
            Ok(job) => self.job = Some(job),
            Err(reason) => self.failed = Some(reason),
        }
    }

    /// Takes in what a job has done, if it is done.
    pub(crate) fn collect(&mut self) -> Option<Arrival> {
        let job = self.job.as_ref()?;
        let done = job.done()?;
        let (kind, took_long) = (job.kind, job.begun.elapsed() > LONG);
        self.job = None;
        let Done { technique, film, outcome, seconds } = match done {
            Ok(done) => done,
            Err(reason) => {
                self.failed = Some(reason);
                return Some(Arrival::Better);
            }
        };
        (self.technique, self.film) = (technique, film);
        self.layers = pictures::own_layers(&self.film);
        let report = match outcome {
            Ok(report) => report,
            Err(reason) => {
                self.failed = Some(reason);
                return Some(Arrival::Better);
            }
        };
        let before = if let Kind::Refine { before } = kind { before } else { 0 };
        let done = self.film.min_samples().saturating_sub(before);
        if done == 0 && (report.interrupted || self.technique.is_none()) {
            return Some(Arrival::Nothing);
        }
        let samples = f64::from(done.max(1));
        self.milliseconds = 1e3 * seconds / samples;
        let of_stage = |(name, time): &(&'static str, Duration)| {
            ((*name).to_string(), 1e3 * time.as_secs_f64() / samples)
        };
        self.stages = report.stages.iter().map(of_stage).collect();
        let known: f64 = self.stages.iter().map(|(_, time)| time).sum();
        let rest = self.milliseconds - known;
        if self.stages.is_empty() || rest > 0.02 * self.milliseconds {
            let name = match (self.stages.is_empty(), self.name.as_str()) {
                (true, "path") => "paths",
                (true, _) => "all of it",
                (false, _) => "the rest",
            };
            self.stages.push((name.into(), rest.max(0.0)));
        }
        self.notes = report.notes;
        if kind != Kind::Sketch {
            return Some(if done > 0 { Arrival::Better } else { Arrival::Nothing });
        }
        // What took long was prepared as well: it says nothing about the next picture.
        if !took_long {
            let cost = self.milliseconds / (self.film.width() * self.film.height()) as f64;
            self.per_pixel = Some(self.per_pixel.map_or(cost, |before| 0.5 * (before + cost)));
        } else if self.per_pixel.is_some_and(|_| job_repeats(&self.name)) {
            self.per_pixel = None;
        }
        Some(Arrival::Sketch)
    }

    /// What is shown, if there is anything.
    pub(crate) fn image(&self) -> Option<Arc<RgbImage>> {
        match &self.reference {
            Some(reference) => Some(Arc::clone(&reference.image)),
            None if self.is_out() || self.failed.is_some() || self.film.min_samples() == 0 => None,
            None => Some(Arc::new(self.film.image())),
        }
    }

    /// What the page says beside the picture.
    pub(crate) fn header(&self) -> Value {
        if let Some(reference) = &self.reference {
            return json!({
                "technique": reference.name, "milliseconds": null, "samples": null, "stages": [],
                "notes": [], "failed": null, "moving": false, "stored": true,
            });
        }
        let error = self.film.relative_error().filter(|error| error.is_finite());
        json!({
            "technique": self.name,
            "milliseconds": self.milliseconds,
            "samples": self.film.min_samples(),
            "relative_error": error,
            "stages": self.stages,
            "notes": self.notes,
            "failed": self.failed,
            "moving": self.moving,
        })
    }
}

/// Whether a technique works out things anew for each moment, so that the cost of a picture jumps.
fn job_repeats(name: &str) -> bool {
    name == "prt"
}

/// What the scene, the command line and the page say about a technique.
pub(crate) fn table_of(name: &str, stage: &Stage, settings: &[(String, String)]) -> Result<Table, String> {
    let mut table = stage
        .settings
        .iter()
        .find(|(of, _)| of == name)
        .map_or_else(Table::empty, |(_, table)| table.clone());
    for (key, value) in settings {
        table.assign("the page", &format!("{key}={value}")).map_err(|error| error.to_string())?;
    }
    Ok(table)
}

/// The name of a technique with all its settings.
pub(crate) fn identity(name: &str, stage: &Stage, settings: &[(String, String)]) -> Result<String, String> {
    let entry = techniques::find(name).map_err(|error| error.to_string())?;
    let table = table_of(name, stage, settings)?;
    Ok(entry.create(&table).map_err(|error| error.to_string())?.identity)
}

fn create(name: &str, stage: &Stage, settings: &[(String, String)]) -> Result<Box<dyn Technique>, String> {
    let entry = techniques::find(name).map_err(|error| error.to_string())?;
    let table = table_of(name, stage, settings)?;
    Ok(entry.create(&table).map_err(|error| error.to_string())?.technique)
}

/// The techniques with their settings, for the page.
pub(crate) fn catalogue() -> Value {
    let setting = |field: &FieldDoc| {
        json!({
            "key": field.name, "about": field.about, "kind": field.kind, "unit": field.unit,
            "limits": field.limits, "default": field.default, "choices": choices(&field.kind),
        })
    };
    let techniques = TECHNIQUES.iter().map(|entry| {
        let settings: Vec<Value> = entry.settings().iter().map(setting).collect();
        json!({ "name": entry.name, "settings": settings })
    });
    Value::Array(techniques.collect())
}

/// The values of a setting that takes but a few: of `` `"a"` or `"b"` ``, both, as they are written.
fn choices(kind: &str) -> Option<Vec<String>> {
    let word = |part: &str| part.trim().strip_prefix('`')?.strip_suffix('`').map(String::from);
    kind.split(" or ").map(word).collect::<Option<Vec<_>>>().filter(|words| words.len() > 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_of_few_values_are_told_from_others() {
        let words = |kind| choices(kind).map(|words| words.join(" "));
        assert_eq!(words("`\"table\"` or `\"closed-form\"`").as_deref(), Some("\"table\" \"closed-form\""));
        assert_eq!(words("`true` or `false`").as_deref(), Some("true false"));
        assert_eq!(words("a whole number"), None);
        assert_eq!(words("a number or `\"auto\"`"), None);
        let all = catalogue().to_string();
        assert!(all.contains("\"choices\":[\"true\",\"false\"]"), "{all:.300}");
    }
}
