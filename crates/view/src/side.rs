//! One side of the picture: a technique, its settings, and the film that it fills.

use std::time::{Duration, Instant};

use halflight_render::techniques::{self, TECHNIQUES};
use halflight_render::{Budget, Film, Progress, Technique};
use halflight_scene::Frame;
use halflight_scene::schema::Table;
use serde_json::{Value, json};

use crate::Stage;
use crate::hub::Hub;

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

pub(crate) struct Shown {
    pub(crate) name: String,
    /// What was set here, beyond the scene.
    pub(crate) settings: Vec<(String, String)>,
    technique: Option<Box<dyn Technique>>,
    pub(crate) film: Film,
    /// Why there is no picture.
    pub(crate) failed: Option<String>,
    pub(crate) notes: Vec<String>,
    pub(crate) stages: Vec<(&'static str, Duration)>,
    /// Milliseconds that the last picture took, and what a pixel costs.
    pub(crate) milliseconds: f64,
    per_pixel: Option<f64>,
    pub(crate) moving: bool,
}

/// Ends the work as soon as somebody wants something else, unless something moves: then pictures have to be finished.
struct Until<'a> {
    hub: &'a Hub,
    lively: bool,
    stop: &'a (dyn Fn() -> bool + Sync),
}

impl Progress for Until<'_> {
    fn stop(&self) -> bool {
        (self.stop)() || (!self.lively && self.hub.is_asked())
    }
}

impl Shown {
    pub(crate) fn new(name: &str) -> Self {
        Self {
            name: name.into(),
            settings: Vec::new(),
            technique: None,
            film: Film::new(1, 1),
            failed: None,
            notes: Vec::new(),
            stages: Vec::new(),
            milliseconds: 0.0,
            per_pixel: None,
            moving: false,
        }
    }

    /// Another technique, or the same for another scene: made again when it is needed.
    pub(crate) fn forget(&mut self) {
        self.technique = None;
        self.failed = None;
        self.per_pixel = None;
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

    fn make(&mut self, stage: &Stage, progress: &dyn Progress) {
        if self.technique.is_some() || self.failed.is_some() {
            return;
        }
        let made = create(&self.name, stage, &self.settings).and_then(|mut technique| {
            technique.prepare(&stage.scene, progress).map_err(|error| error.to_string())?;
            Ok(technique)
        });
        match made {
            Ok(technique) => self.technique = Some(technique),
            Err(reason) => self.failed = Some(reason),
        }
    }

    /// One sample a pixel at a size that keeps up with the hand.
    pub(crate) fn sketch(
        &mut self,
        stage: &Stage,
        frame: &Frame,
        size: [usize; 2],
        hub: &Hub,
        stop: &(dyn Fn() -> bool + Sync),
    ) {
        let full = (size[0] * size[1]) as f64;
        let wanted = self.per_pixel.map_or(0.25, |cost| (LIVELY / (cost * full)).sqrt());
        // In steps, so that the picture does not flicker between sizes.
        let scale = ((wanted * 8.0).floor() / 8.0).clamp(COARSEST, 1.0);
        let of = |side: usize| ((side as f64 * scale).round() as usize).max(1);
        self.film = Film::new(of(size[0]), of(size[1]));
        self.moving = true;
        let budget = Budget { samples: Some(1), ..Budget::default() };
        self.work(stage, frame, &budget, &Until { hub, lively: true, stop });
        let cost = self.milliseconds / (self.film.width() * self.film.height()) as f64;
        self.per_pixel = Some(self.per_pixel.map_or(cost, |before| 0.5 * (before + cost)));
    }

    /// Makes the picture at rest better; true if there is something new to show.
    pub(crate) fn refine(
        &mut self,
        stage: &Stage,
        frame: &Frame,
        size: [usize; 2],
        hub: &Hub,
        stop: &(dyn Fn() -> bool + Sync),
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
        let budget = Budget { samples: Some(samples), ..Budget::default() };
        self.work(stage, frame, &budget, &Until { hub, lively: false, stop });
        let done = self.film.min_samples() - before;
        if done > 0 {
            self.milliseconds /= f64::from(done);
        }
        done > 0 || self.failed.is_some()
    }

    /// Whether the picture at rest is not finished.
    pub(crate) fn wants_more(&self, size: [usize; 2]) -> bool {
        let other = self.moving || [self.film.width(), self.film.height()] != size;
        self.failed.is_none() && (other || self.film.min_samples() < self.most())
    }

    fn most(&self) -> u32 {
        if self.is_by_paths() { SAMPLES_BY_PATHS } else { SAMPLES_OF_LOOKS }
    }

    /// Whether noise falls for as long as one waits.
    fn is_by_paths(&self) -> bool {
        matches!(self.name.as_str(), "path" | "covariance")
    }

    fn work(&mut self, stage: &Stage, frame: &Frame, budget: &Budget, progress: &dyn Progress) {
        self.make(stage, progress);
        let Some(technique) = &self.technique else { return };
        let begun = Instant::now();
        match technique.render(frame, &mut self.film, budget, progress) {
            Ok(report) => {
                self.notes = report.notes;
                self.stages = report.stages;
            }
            Err(error) => self.failed = Some(error.to_string()),
        }
        self.milliseconds = 1e3 * begun.elapsed().as_secs_f64();
    }

    /// What the page says beside the picture.
    pub(crate) fn header(&self) -> Value {
        let stages: Vec<Value> =
            self.stages.iter().map(|(name, time)| json!([name, 1e3 * time.as_secs_f64()])).collect();
        json!({
            "technique": self.name,
            "milliseconds": self.milliseconds,
            "samples": self.film.min_samples(),
            "relative_error": self.film.relative_error(),
            "stages": stages,
            "notes": self.notes,
            "failed": self.failed,
            "moving": self.moving,
        })
    }
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

fn create(name: &str, stage: &Stage, settings: &[(String, String)]) -> Result<Box<dyn Technique>, String> {
    let entry = techniques::find(name).map_err(|error| error.to_string())?;
    let table = table_of(name, stage, settings)?;
    Ok(entry.create(&table).map_err(|error| error.to_string())?.technique)
}

/// The techniques with their settings, for the page.
pub(crate) fn catalogue() -> Value {
    let techniques = TECHNIQUES.iter().map(|entry| {
        let settings: Vec<Value> = entry
            .settings()
            .iter()
            .map(|field| {
                json!({
                    "key": field.name, "about": field.about, "kind": field.kind, "unit": field.unit,
                    "limits": field.limits, "default": field.default,
                })
            })
            .collect();
        json!({ "name": entry.name, "settings": settings })
    });
    Value::Array(techniques.collect())
}
