//! What is rendered when: the loop between the wishes of the page and its pictures.
//!
//! While something moves, each side is sketched at a size that keeps up with the hand; once nothing moves, it is rendered
//! at full size and gets better until it is done or somebody wants something else. One thread decides all of it and
//! answers; pictures are made on threads of their own, one at a time, so that a technique which prepares for long holds
//! up nobody. A picture always belongs to one state of the scene, its *moment*.

mod state;
mod wishes;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use glam::Vec3;
use halflight_scene::Frame;
use halflight_scene::spec::ToneName;
use serde_json::{Value, json};

use crate::answers::{self, Question};
use crate::compare::{self, Compared, Pair};
use crate::eye::Eye;
use crate::hub::{Hub, Reply};
use crate::pictures::{self, Shot};
use crate::server::error;
use crate::side::{Arrival, Shown, catalogue};
use crate::wire::{Side, pack};
use crate::{Library, Stage, Swap, ViewError};

/// Nothing has moved for so long: the picture at rest begins.
const REST: Duration = Duration::from_millis(120);
/// How long the loop sleeps when there is nothing to do.
const IDLE: Duration = Duration::from_millis(40);
/// How often the page hears of work that takes long.
const TELL: Duration = Duration::from_millis(500);
/// Between two comparisons of pictures that get better.
const AGAIN: Duration = Duration::from_secs(2);
/// Columns and rows at most.
const MAX_SIDE: usize = 4096;
/// Pixels at most.
const MAX_PIXELS: usize = 4 << 20;
/// Questions and files that wait for a picture, at most.
const MAX_WAITING: usize = 32;

pub(crate) struct Studio {
    hub: Arc<Hub>,
    library: Box<dyn Library>,
    stage: Arc<Stage>,
    swap: Swap,
    /// The scene at `seconds`, without turned light and moved objects.
    posed: Frame,
    /// With them, and with the eye's camera.
    frame: Arc<Frame>,
    eye: Eye,
    size: [usize; 2],
    /// Whether a person chose the size.
    own_size: bool,
    seconds: f64,
    /// When time was last advanced, while it runs.
    playing: Option<Instant>,
    turn_degrees: f64,
    moved: BTreeMap<String, Vec3>,
    exposure_ev: f32,
    filmic: bool,
    layer: String,
    compare: bool,
    sides: [Shown; 2],
    /// The moment that the picture of each side shows, and the one that is now.
    shows: [u64; 2],
    moment: u64,
    /// The side whose turn it is to get better.
    turn: usize,
    /// The error between the sides, at rest.
    errors: Value,
    comparison: Option<Receiver<Compared>>,
    /// The pictures have changed since they were compared.
    compares: bool,
    questions: Vec<Question>,
    /// Who waits for a file of which kind.
    savers: Vec<(u64, String)>,
    last_compared: Instant,
    last_motion: Instant,
    last_told: Instant,
    /// What has to be done.
    stale: Stale,
    encode_milliseconds: f64,
    /// What may be opened, swapped in and compared with, as last looked for: that reads folders, which is nothing for
    /// every picture.
    scenes: Vec<String>,
    environments: Vec<String>,
    references: Vec<String>,
    /// The techniques with their settings.
    techniques: Value,
}

/// What no longer fits the state.
#[derive(Clone, Copy, Debug, Default)]
struct Stale {
    /// The pictures, because something moved.
    pictures: bool,
    /// What is sent of them: exposure, layer.
    sent: bool,
    /// What the page says beside them.
    state: bool,
}

impl Studio {
    pub(crate) fn new(
        hub: Arc<Hub>,
        library: Box<dyn Library>,
        stage: Stage,
        technique: &str,
    ) -> Result<Self, ViewError> {
        let posed = stage.scene.at(0.0).map_err(|error| ViewError::Failed(error.to_string()))?;
        let image = stage.scene.image();
        let eye = Eye::new(posed.camera, stage.scene.camera_up(), posed.bounds);
        let size = fitting(image.size.map(|side| side as usize));
        let (exposure_ev, filmic) = (image.exposure_ev, matches!(image.tone, ToneName::Filmic));
        let other = if technique == "path" { "shexp" } else { "path" };
        let mut studio = Self {
            hub,
            scenes: Vec::new(),
            environments: Vec::new(),
            references: Vec::new(),
            techniques: catalogue(),
            library,
            swap: Swap::default(),
            frame: Arc::new(posed.clone()),
            posed,
            eye,
            size,
            own_size: false,
            seconds: 0.0,
            playing: None,
            turn_degrees: 0.0,
            moved: BTreeMap::new(),
            exposure_ev,
            filmic,
            layer: "color".into(),
            compare: false,
            sides: [Shown::new(technique), Shown::new(other)],
            shows: [0; 2],
            moment: 0,
            turn: 0,
            errors: Value::Null,
            comparison: None,
            compares: false,
            questions: Vec::new(),
            savers: Vec::new(),
            last_compared: Instant::now(),
            last_motion: Instant::now(),
            last_told: Instant::now(),
            stale: Stale { pictures: true, sent: true, state: true },
            encode_milliseconds: 0.0,
            stage: Arc::new(stage),
        };
        studio.list();
        studio.arrange();
        Ok(studio)
    }

    /// Renders and answers until told to stop.
    pub(crate) fn run(&mut self, stop: &(dyn Fn() -> bool + Sync)) {
        while !stop() && !self.hub.is_stopped() {
            for (client, asked) in self.hub.take(self.patience()) {
                if let Err(reason) = self.obey(client, asked) {
                    self.hub.reply(client, Reply::Text(error(&reason)));
                    // What the page has put into its fields is taken back.
                    self.stale.state = true;
                }
            }
            self.collect();
            self.answer();
            self.advance();
            if self.hub.clients() > 0 {
                self.draw();
            }
            let is_busy = self.sides[..self.shown()].iter().any(|side| side.busy().is_some());
            if std::mem::take(&mut self.stale.state) || (is_busy && self.last_told.elapsed() > TELL) {
                self.last_told = Instant::now();
                self.hub.state.put(self.state().to_string());
            }
        }
        self.sides.iter_mut().for_each(Shown::forget);
    }

    fn shown(&self) -> usize {
        if self.compare { 2 } else { 1 }
    }

    /// How long to wait for wishes before there is something else to do.
    fn patience(&self) -> Duration {
        let sides = &self.sides[..self.shown()];
        if self.hub.clients() == 0 || sides.iter().any(Shown::is_out) {
            return IDLE;
        }
        let outdated = sides.iter().any(|side| side.outdated);
        if self.stale.pictures || self.stale.sent || self.playing.is_some() || outdated {
            return Duration::ZERO;
        }
        if sides.iter().any(|side| side.wants_more(self.size)) {
            return REST.saturating_sub(self.last_motion.elapsed());
        }
        IDLE
    }

    /// Time runs on while it is played, from picture to picture.
    fn advance(&mut self) {
        let Some(last) = self.playing else { return };
        if self.sides[..self.shown()].iter().any(Shown::is_out) {
            return;
        }
        let now = Instant::now();
        let mut seconds = self.seconds + (now - last).as_secs_f64();
        if let Some(duration) = self.stage.scene.duration().filter(|duration| *duration > 0.0) {
            seconds = seconds.rem_euclid(duration);
        }
        self.playing = Some(now);
        if let Err(reason) = self.go_to(seconds) {
            self.playing = None;
            self.say(&reason);
        }
    }

    /// Takes in the work that is done.
    fn collect(&mut self) {
        for number in 0..2 {
            let Some(arrival) = self.sides[number].collect() else { continue };
            let known = ["color", "flip", "difference"].contains(&self.layer.as_str());
            if number == 0
                && arrival != Arrival::Nothing
                && !known
                && !self.layer_names().contains(&self.layer)
            {
                // The technique before had it.
                self.layer = "color".into();
            }
            let side = &self.sides[number];
            let is_shown = number < self.shown();
            // A picture at rest of what has moved since is not one any more.
            let is_late = arrival == Arrival::Better && side.outdated && side.failed.is_none();
            if is_shown && arrival != Arrival::Nothing && !is_late {
                self.send(number);
                self.compares |= arrival == Arrival::Better;
            }
            self.stale.state = true;
        }
        let compared = self.comparison.as_ref().and_then(|receiver| receiver.try_recv().ok());
        if let Some(compared) = compared {
            self.comparison = None;
            if self.compare && compared.moment == self.moment {
                self.errors = compared.errors;
                if let Some(shot) = compared.map {
                    let header = json!({
                        "kind": "picture", "side": "map", "layer": compared.layer, "moment": compared.moment,
                    });
                    self.put(2, header, &shot, false);
                }
                self.stale.state = true;
            }
        }
        self.start_comparison();
    }

    /// Compares the sides if they are at rest and have changed.
    fn start_comparison(&mut self) {
        let settled = self.sides.iter().all(|side| side.has_settled(self.size));
        let now = self.shows == [self.moment; 2];
        let is_soon = self.last_compared.elapsed() < AGAIN
            && !self.errors.is_null()
            && self.sides.iter().any(|side| side.wants_more(self.size));
        if is_soon || !self.compare || !self.compares || self.comparison.is_some() || !settled || !now {
            return;
        }
        let (Some(a), Some(b)) = (self.sides[0].image(), self.sides[1].image()) else { return };
        self.compares = false;
        self.last_compared = Instant::now();
        let (exposure_ev, layer, moment) = (self.exposure_ev, self.layer.clone(), self.moment);
        self.comparison = compare::start(Pair { a, b, exposure_ev, layer, moment }, Arc::clone(&self.hub));
    }

    /// Starts what there is to do.
    fn draw(&mut self) {
        let count = self.shown();
        if std::mem::take(&mut self.stale.pictures) {
            self.moment += 1;
            self.last_motion = Instant::now();
            self.errors = Value::Null;
            for side in &mut self.sides {
                side.outdated = true;
                side.hurry();
            }
            self.stale.state = true;
        }
        if !self.sides[..count].iter().all(Shown::leaves_room) {
            if self.stale.sent {
                self.sides.iter_mut().for_each(Shown::hurry_if_there_is_something);
            }
            return;
        }
        for number in 0..count {
            let side = &mut self.sides[number];
            if !side.outdated || side.is_out() {
                continue;
            }
            self.shows[number] = self.moment;
            side.sketch(&self.stage, &self.frame, self.size, &self.hub);
            if self.sides[number].is_out() {
                return;
            }
            self.send(number);
            (self.compares, self.stale.state) = (true, true);
        }
        if std::mem::take(&mut self.stale.sent) {
            (0..count)
                .filter(|&number| !self.sides[number].is_out())
                .collect::<Vec<_>>()
                .into_iter()
                .for_each(|number| self.send(number));
            (self.compares, self.stale.state) = (true, true);
            self.start_comparison();
        }
        if self.playing.is_some() || self.last_motion.elapsed() < REST {
            return;
        }
        for step in 0..count {
            let number = (self.turn + step) % count;
            if !self.sides[number].is_out()
                && self.sides[number].refine(&self.stage, &self.frame, self.size, &self.hub)
            {
                self.turn = number + 1;
                return;
            }
        }
    }

    /// Sends the picture of a side.
    fn send(&mut self, number: usize) {
        let mapping = pictures::tone_mapping(self.exposure_ev, self.filmic);
        let begun = Instant::now();
        let frame = Arc::clone(&self.frame);
        let side = &mut self.sides[number];
        let layered = match self.layer.as_str() {
            "color" | "flip" | "difference" => None,
            _ if side.reference.is_some() => None,
            name => pictures::layer(&frame, &mut side.film, name),
        };
        let shot = layered.unwrap_or_else(|| match &side.reference {
            Some(reference) => pictures::of_image(&reference.image, &mapping),
            None => pictures::color(&side.film, &mapping),
        });
        let moving = side.moving && side.reference.is_none();
        let mut header = side.header();
        header["kind"] = json!("picture");
        header["side"] = json!(if number == 0 { "a" } else { "b" });
        header["moment"] = json!(self.shows[number]);
        self.put(number, header, &shot, moving);
        self.encode_milliseconds = 1e3 * begun.elapsed().as_secs_f64();
    }

    fn put(&self, place: usize, mut header: Value, shot: &Shot, moving: bool) {
        header["width"] = json!(shot.width);
        header["height"] = json!(shot.height);
        header["legend"] = shot.legend.clone();
        match pictures::jpeg(shot, moving) {
            Ok(bytes) => self.hub.pictures[place].put(pack(&header, &bytes)),
            Err(reason) => self.say(&reason),
        }
    }

    /// Tells whoever has the controls.
    fn say(&self, reason: &str) {
        self.hub.reply_to_holder(Reply::Text(error(reason)));
    }

    /// Answers questions, and sends files, whose pictures are there.
    fn answer(&mut self) {
        for question in std::mem::take(&mut self.questions) {
            let side = &self.sides[question.side];
            let drawn = side.film.min_samples() > 0 && !side.is_out() && self.playing.is_some();
            if side.has_settled(self.size) || drawn || side.busy().is_some() {
                answers::explain(&question, side, (&self.stage, &self.frame), self.size, &self.hub);
            } else {
                self.sides[question.side].hurry_if_there_is_something();
                self.questions.push(question);
            }
        }
        if self.savers.is_empty() || !self.sides[0].has_settled(self.size) {
            return;
        }
        for (client, format) in std::mem::take(&mut self.savers) {
            match self.save(&format) {
                Ok((name, bytes)) => {
                    let header = json!({ "kind": "file", "name": name });
                    self.hub.reply(client, Reply::Bytes(pack(&header, &bytes)));
                }
                Err(reason) => self.hub.reply(client, Reply::Text(error(&reason))),
            }
        }
    }

    /// A picture of the first side as a file.
    fn save(&mut self, format: &str) -> Result<(String, Vec<u8>), String> {
        if let Some(reason) = &self.sides[0].failed {
            return Err(format!("there is no picture: {reason}"));
        }
        let mapping = pictures::tone_mapping(self.exposure_ev, self.filmic);
        let up = self.stage.scene.camera_up();
        let facts = answers::Facts {
            stage: &self.stage,
            frame: &self.frame,
            camera: [self.eye.origin(), self.eye.target, up],
            seconds: self.seconds,
            turn_degrees: self.turn_degrees,
            swap: &self.swap,
            moved: &self.moved,
            exposure_ev: self.exposure_ev,
            vertical_fov_degrees: self.eye.vertical_fov(self.aspect()).to_degrees(),
        };
        answers::save(&mut self.sides[0], format, &mapping, &facts)
    }

    fn aspect(&self) -> f32 {
        self.size[0] as f32 / self.size[1] as f32
    }

    /// The frame from the posed scene: light turned, objects moved, the eye's camera.
    fn arrange(&mut self) {
        let mut frame = self.posed.clone();
        frame.lights.turn_environment(self.turn_degrees.to_radians() as f32);
        for (name, by) in &self.moved {
            frame.shift_shape(name, *by);
        }
        frame.camera = self.eye.camera;
        self.frame = Arc::new(frame);
        self.stale = Stale { pictures: true, state: true, ..self.stale };
    }

    fn go_to(&mut self, seconds: f64) -> Result<(), String> {
        self.posed = self.stage.scene.at(seconds).map_err(|error| error.to_string())?;
        self.seconds = seconds;
        self.eye.follow(self.posed.camera, self.posed.bounds);
        self.arrange();
        Ok(())
    }

    fn look(&mut self, change: impl FnOnce(&mut Eye, f32)) {
        let fov = self.eye.vertical_fov(self.aspect());
        change(&mut self.eye, fov);
        Arc::make_mut(&mut self.frame).camera = self.eye.camera;
        self.stale = Stale { pictures: true, state: true, ..self.stale };
    }

    fn side(&mut self, side: Side) -> &mut Shown {
        &mut self.sides[usize::from(side == Side::B)]
    }

    /// Looks again for what may be opened.
    fn list(&mut self) {
        (self.scenes, self.environments) = (self.library.names(), self.library.environments());
        self.references = self.library.pictures();
    }

    /// Another scene on the stage; the old one stays if that cannot be shown.
    fn enter(&mut self, stage: Stage, keep_eye: bool) -> Result<(), String> {
        let posed = stage.scene.at(self.seconds).map_err(|error| error.to_string())?;
        let image = stage.scene.image();
        if !keep_eye {
            self.eye = Eye::new(posed.camera, stage.scene.camera_up(), posed.bounds);
            self.size = fitting(image.size.map(|side| side as usize));
            self.own_size = false;
            (self.exposure_ev, self.filmic) = (image.exposure_ev, matches!(image.tone, ToneName::Filmic));
            self.moved.clear();
            self.turn_degrees = 0.0;
        }
        (self.posed, self.stage) = (posed, Arc::new(stage));
        self.list();
        self.sides.iter_mut().for_each(Shown::forget);
        self.arrange();
        Ok(())
    }
}

/// A size within the limits, of nearly the same shape.
fn fitting([width, height]: [usize; 2]) -> [usize; 2] {
    let (width, height) = (width.clamp(1, MAX_SIDE), height.clamp(1, MAX_SIDE));
    let scale = (MAX_PIXELS as f64 / (width * height) as f64).sqrt().min(1.0);
    [width, height].map(|side| ((side as f64 * scale) as usize).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_held_within_limits() {
        assert_eq!(fitting([640, 360]), [640, 360]);
        assert_eq!(fitting([0, 0]), [1, 1]);
        let [width, height] = fitting([usize::MAX, usize::MAX]);
        assert!(width * height <= MAX_PIXELS && width == height);
    }
}
