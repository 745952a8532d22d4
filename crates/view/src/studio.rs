//! What is rendered when: the loop between the wishes of the page and its pictures.
//!
//! While something moves, each side is sketched at a size that keeps up with the hand; once nothing moves, it is rendered
//! at full size and gets better until it is done or somebody wants something else. One thread does all of it, so that a
//! picture always belongs to one state of the scene.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{Vec2, Vec3};
use halflight_image::{Picture, Precision, encode_png};
use halflight_render::features::{FEATURE_LAYERS, add_layers};
use halflight_render::techniques::bandwidth::BandwidthTechnique;
use halflight_render::vertex::Vertex;
use halflight_render::{Quiet, Technique};
use halflight_scene::camera::FieldOfView;
use halflight_scene::spec::ToneName;
use halflight_scene::{Frame, schema};
use serde_json::{Value, json};

use crate::eye::Eye;
use crate::hub::{Asked, Hub, Reply};
use crate::pictures::{self, Shot};
use crate::server::error;
use crate::side::{Shown, catalogue, table_of};
use crate::wire::{Ask, Side, pack};
use crate::{Kept, Library, Stage, Swap, ViewError};

/// Nothing has moved for so long: the picture at rest begins.
const REST: Duration = Duration::from_millis(120);
/// How long the loop sleeps when there is nothing to do.
const IDLE: Duration = Duration::from_millis(40);
/// Rays a pixel for the layers of a saved picture, at most: a person waits for it.
const SAVED_RAYS: u32 = 16;
/// Columns and rows at most.
const MAX_SIDE: usize = 4096;
/// Pixels at most.
const MAX_PIXELS: usize = 4 << 20;
/// Pixels up to which differences between sides are worked out.
const MAX_COMPARED: usize = 1 << 20;

pub(crate) struct Studio {
    hub: Arc<Hub>,
    library: Box<dyn Library>,
    stage: Stage,
    swap: Swap,
    /// The scene at `seconds`, without turned light and moved objects.
    posed: Frame,
    /// With them, and with the eye's camera.
    frame: Frame,
    eye: Eye,
    size: [usize; 2],
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
    /// The error between the sides, at rest.
    errors: Value,
    last_motion: Instant,
    /// What has to be done.
    stale: Stale,
    encode_milliseconds: f64,
    /// What may be opened and swapped in, as last looked for: that reads folders, which is nothing for every picture.
    scenes: Vec<String>,
    environments: Vec<String>,
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
        let eye = Eye::new(posed.camera, posed.bounds);
        let size = fitting(image.size.map(|side| side as usize));
        let (exposure_ev, filmic) = (image.exposure_ev, matches!(image.tone, ToneName::Filmic));
        let other = if technique == "path" { "shexp" } else { "path" };
        let mut studio = Self {
            hub,
            scenes: library.names(),
            environments: library.environments(),
            techniques: catalogue(),
            library,
            swap: Swap::default(),
            frame: posed.clone(),
            posed,
            eye,
            size,
            seconds: 0.0,
            playing: None,
            turn_degrees: 0.0,
            moved: BTreeMap::new(),
            exposure_ev,
            filmic,
            layer: "color".into(),
            compare: false,
            sides: [Shown::new(technique), Shown::new(other)],
            errors: Value::Null,
            last_motion: Instant::now(),
            stale: Stale { pictures: true, sent: true, state: true },
            encode_milliseconds: 0.0,
            stage,
        };
        studio.arrange();
        Ok(studio)
    }

    /// Renders and answers until told to stop.
    pub(crate) fn run(&mut self, stop: &(dyn Fn() -> bool + Sync)) {
        while !stop() && !self.hub.is_stopped() {
            let asks = self.hub.take(if self.is_busy() { Duration::ZERO } else { IDLE });
            for (client, asked) in asks {
                if let Err(reason) = self.obey(client, asked) {
                    self.hub.reply(client, Reply::Text(error(&reason)));
                }
            }
            self.advance();
            if self.hub.clients() > 0 {
                self.draw(stop);
            }
            if std::mem::take(&mut self.stale.state) {
                self.hub.state.put(self.state().to_string());
            }
        }
    }

    fn shown(&self) -> usize {
        if self.compare { 2 } else { 1 }
    }

    fn is_busy(&self) -> bool {
        let unfinished = self.sides[..self.shown()].iter().any(|side| side.wants_more(self.size));
        self.hub.clients() > 0
            && (self.stale.pictures || self.stale.sent || self.playing.is_some() || unfinished)
    }

    /// Time runs on while it is played.
    fn advance(&mut self) {
        let Some(last) = self.playing else { return };
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

    fn draw(&mut self, stop: &(dyn Fn() -> bool + Sync)) {
        let count = self.shown();
        if std::mem::take(&mut self.stale.pictures) {
            self.last_motion = Instant::now();
            for number in 0..count {
                self.sides[number].sketch(&self.stage, &self.frame, self.size, &self.hub, stop);
                self.send(number);
            }
            self.stale = Stale { sent: false, state: true, ..self.stale };
            return;
        }
        if std::mem::take(&mut self.stale.sent) {
            (0..count).for_each(|number| self.send(number));
            self.stale.state = true;
        }
        if self.playing.is_some() || self.last_motion.elapsed() < REST {
            std::thread::sleep(Duration::from_millis(2));
            return;
        }
        let mut better = false;
        for number in 0..count {
            if self.hub.is_asked() {
                break;
            }
            if self.sides[number].refine(&self.stage, &self.frame, self.size, &self.hub, stop) {
                self.send(number);
                better = true;
            }
        }
        if better {
            self.measure();
            self.stale.state = true;
        }
    }

    /// Sends the picture of a side, and the map between the sides after the last.
    fn send(&mut self, number: usize) {
        let mapping = pictures::tone_mapping(self.exposure_ev, self.filmic);
        let begun = Instant::now();
        let side = &mut self.sides[number];
        let layered = match self.layer.as_str() {
            "color" | "flip" | "difference" => None,
            name => pictures::layer(&self.frame, &mut side.film, name),
        };
        let shot = layered.unwrap_or_else(|| pictures::color(&side.film, &mapping));
        let moving = side.moving;
        let mut header = side.header();
        header["kind"] = json!("picture");
        header["side"] = json!(if number == 0 { "a" } else { "b" });
        self.put(number, header, &shot, moving);
        self.encode_milliseconds = 1e3 * begun.elapsed().as_secs_f64();
        let maps = matches!(self.layer.as_str(), "flip" | "difference");
        if self.compare && number == 1 && maps && !moving && self.is_comparable() {
            let (a, b) = (self.sides[0].film.image(), self.sides[1].film.image());
            let map = match self.layer.as_str() {
                "flip" => pictures::flip_map(&a, &b, self.exposure_ev).map(|(shot, _)| shot),
                _ => pictures::difference_map(&a, &b),
            };
            if let Some(shot) = map {
                self.put(2, json!({ "kind": "picture", "side": "map" }), &shot, false);
            }
        }
    }

    fn put(&self, place: usize, mut header: Value, shot: &Shot, moving: bool) {
        header["width"] = json!(shot.width);
        header["height"] = json!(shot.height);
        header["legend"] = json!(shot.legend);
        match pictures::jpeg(shot, moving) {
            Ok(bytes) => self.hub.pictures[place].put(pack(&header, &bytes)),
            Err(reason) => self.say(&reason),
        }
    }

    /// Tells whoever has the controls.
    fn say(&self, reason: &str) {
        self.hub.reply_to_holder(Reply::Text(error(reason)));
    }

    fn is_comparable(&self) -> bool {
        let of = |side: &Shown| [side.film.width(), side.film.height()];
        of(&self.sides[0]) == of(&self.sides[1])
            && self.size[0] * self.size[1] <= MAX_COMPARED
            && self.sides.iter().all(|side| side.film.min_samples() > 0 && side.failed.is_none())
    }

    /// The error of the first side against the second.
    fn measure(&mut self) {
        self.errors = Value::Null;
        if !self.compare || !self.is_comparable() {
            return;
        }
        let (a, b) = (self.sides[0].film.image(), self.sides[1].film.image());
        let relative = halflight_image::metrics::relative_mse(&a, &b).ok();
        let psnr = halflight_image::metrics::psnr(&a, &b, self.exposure_ev).ok();
        let flip = pictures::flip_map(&a, &b, self.exposure_ev).map(|(_, mean)| mean);
        self.errors = json!({ "relative_mse": relative, "psnr": psnr, "flip": flip });
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
        self.frame = frame;
        self.stale = Stale { pictures: true, state: true, ..self.stale };
    }

    fn go_to(&mut self, seconds: f64) -> Result<(), String> {
        self.posed = self.stage.scene.at(seconds).map_err(|error| error.to_string())?;
        self.seconds = seconds;
        self.arrange();
        Ok(())
    }

    fn look(&mut self, change: impl FnOnce(&mut Eye, f32)) {
        let fov = self.eye.vertical_fov(self.aspect());
        change(&mut self.eye, fov);
        self.frame.camera = self.eye.camera;
        self.stale = Stale { pictures: true, state: true, ..self.stale };
    }

    fn side(&mut self, side: Side) -> &mut Shown {
        &mut self.sides[usize::from(side == Side::B)]
    }

    /// Looks again for what may be opened.
    fn list(&mut self) {
        (self.scenes, self.environments) = (self.library.names(), self.library.environments());
    }

    /// Another scene on the stage; the old one stays if that cannot be shown.
    fn enter(&mut self, stage: Stage, keep_eye: bool) -> Result<(), String> {
        let posed = stage.scene.at(self.seconds).map_err(|error| error.to_string())?;
        let image = stage.scene.image();
        if !keep_eye {
            self.eye = Eye::new(posed.camera, posed.bounds);
            self.size = fitting(image.size.map(|side| side as usize));
            (self.exposure_ev, self.filmic) = (image.exposure_ev, matches!(image.tone, ToneName::Filmic));
            self.moved.clear();
            self.turn_degrees = 0.0;
        }
        (self.posed, self.stage) = (posed, stage);
        self.list();
        self.sides.iter_mut().for_each(Shown::forget);
        self.arrange();
        Ok(())
    }

    fn obey(&mut self, client: u64, asked: Asked) -> Result<(), String> {
        let ask = match asked {
            Asked::Ask(ask) => ask,
            Asked::File { name, bytes } => {
                let stage = self.library.take(&name, &bytes)?;
                (self.seconds, self.playing) = (0.0, None);
                self.swap = Swap::default();
                return self.enter(stage, false);
            }
        };
        match ask {
            Ask::Orbit { x, y } => self.look(|eye, _| eye.orbit(x as f32, y as f32)),
            Ask::Pan { x, y } => self.look(|eye, fov| eye.pan(x as f32, y as f32, fov)),
            Ask::Look { x, y } => self.look(|eye, fov| eye.look(x as f32, y as f32, fov)),
            Ask::Dolly { by } => self.look(|eye, _| eye.dolly(by as f32)),
            Ask::Fly { by } => self.look(|eye, _| eye.fly(by.map(|x| x as f32))),
            Ask::Home => {
                self.eye = Eye::new(self.posed.camera, self.posed.bounds);
                self.look(|_, _| ());
            }
            Ask::Frame => {
                let bounds = self.posed.bounds;
                self.look(|eye, fov| eye.frame(bounds, fov));
            }
            Ask::FieldOfView { degrees } => {
                let angle = degrees.clamp(0.5, 170.0).to_radians() as f32;
                self.look(|eye, _| eye.camera.field_of_view = FieldOfView::Vertical(angle));
            }
            Ask::Aperture { radius } => {
                self.look(|eye, _| eye.camera.aperture_radius = radius.clamp(0.0, 1e3) as f32);
            }
            Ask::Focus { x, y } => self.focus(x, y)?,
            Ask::Time { seconds } => self.go_to(seconds.clamp(-1e6, 1e6))?,
            Ask::Play { on } => {
                self.playing = on.then(Instant::now);
                self.stale.state = true;
            }
            Ask::Environment { degrees } => {
                self.turn_degrees = degrees.rem_euclid(360.0);
                self.arrange();
            }
            Ask::Move { object, by } => {
                if !(0..self.posed.world.instances().len() as u32).any(|i| self.posed.shape_name(i) == object)
                {
                    return Err(format!("there is no object {object:?} in this scene"));
                }
                self.moved.insert(object, Vec3::from(by).clamp(Vec3::splat(-1e6), Vec3::splat(1e6)));
                self.arrange();
            }
            Ask::Exposure { ev } => {
                self.exposure_ev = ev.clamp(-60.0, 60.0) as f32;
                self.stale = Stale { sent: true, state: true, ..self.stale };
            }
            Ask::Tone { filmic } => {
                self.filmic = filmic;
                self.stale = Stale { sent: true, state: true, ..self.stale };
            }
            Ask::Technique { side, name } => {
                halflight_render::techniques::find(&name).map_err(|error| error.to_string())?;
                *self.side(side) = Shown::new(&name);
                self.stale = Stale { pictures: true, state: true, ..self.stale };
            }
            Ask::Set { side, key, value } => {
                let shown = &mut self.sides[usize::from(side == Side::B)];
                shown.set(&self.stage, &key, &value)?;
                self.stale = Stale { pictures: true, state: true, ..self.stale };
            }
            Ask::Compare { on } => {
                self.compare = on;
                self.errors = Value::Null;
                self.stale = Stale { pictures: true, state: true, ..self.stale };
            }
            Ask::Layer { name } => {
                let known = ["color", "flip", "difference"].contains(&name.as_str());
                if !known && !pictures::layer_names(&self.sides[0].film).contains(&name) {
                    return Err(format!("there is no layer {name:?}"));
                }
                self.layer = name;
                self.stale = Stale { sent: true, state: true, ..self.stale };
            }
            Ask::Size { width, height } => {
                self.size = fitting([width, height]);
                self.stale = Stale { pictures: true, state: true, ..self.stale };
            }
            Ask::Explain { x, y } => {
                let text = self.explain(x, y);
                self.hub.reply(client, Reply::Text(json!({ "kind": "explain", "text": text }).to_string()));
            }
            Ask::Save { format } => {
                let (name, bytes) = self.save(&format)?;
                let header = json!({ "kind": "file", "name": name });
                self.hub.reply(client, Reply::Bytes(pack(&header, &bytes)));
            }
            Ask::Keep => {
                let place = self.library.keep(&self.kept())?;
                self.list();
                self.stale.state = true;
                self.hub.reply(client, Reply::Text(json!({ "kind": "kept", "text": place }).to_string()));
            }
            Ask::Open { name } => {
                let stage = self.library.open(&name, &Swap::default())?;
                (self.seconds, self.playing) = (0.0, None);
                self.swap = Swap::default();
                self.enter(stage, false)?;
            }
            Ask::Swap { environment, material } => {
                let swap = Swap { environment, material };
                let stage = self.library.open(&self.stage.name, &swap)?;
                self.enter(stage, true)?;
                self.swap = swap;
            }
            Ask::Control => {}
        }
        Ok(())
    }

    /// The pixel at a place of the picture from 0 to 1.
    fn pixel(&self, x: f64, y: f64) -> [usize; 2] {
        let at = |part: f64, side: usize| ((part.clamp(0.0, 1.0) * side as f64) as usize).min(side - 1);
        [at(x, self.size[0]), at(y, self.size[1])]
    }

    fn focus(&mut self, x: f64, y: f64) -> Result<(), String> {
        let [x, y] = self.pixel(x, y);
        let view = self.frame.camera.view(self.size[0], self.size[1]);
        let ray = view.ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), Vec2::splat(0.5), 0.0);
        let hit = self.frame.world.closest(&ray).ok_or("there is nothing to focus on")?;
        let point = self.frame.world.surface(&ray, &hit).position;
        let depth = view.depth(point, 0.0);
        self.look(|eye, _| {
            eye.camera.focus_distance = depth.max(1e-4);
            // Things are looked at where they are sharp.
            let forward = eye.forward();
            eye.target = eye.origin() + forward * depth.max(1e-4);
        });
        Ok(())
    }

    fn explain(&self, x: f64, y: f64) -> String {
        let pixel = self.pixel(x, y);
        let side = &self.sides[0];
        let mut lines =
            vec![format!("pixel {}, {} of {} × {}", pixel[0], pixel[1], self.size[0], self.size[1])];
        let view = self.frame.camera.view(self.size[0], self.size[1]);
        let place = Vec2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5);
        let ray = view.ray(place, Vec2::splat(0.5), 0.0);
        match self.frame.world.closest(&ray) {
            None => lines.push(format!(
                "nothing but the environment, {}",
                triple(self.frame.lights.escaped(ray.direction))
            )),
            Some(hit) => {
                let vertex = Vertex::new(&self.frame, &ray, &hit);
                lines.push(format!(
                    "{} · material {}",
                    self.frame.shape_name(hit.instance),
                    vertex.material.name
                ));
                lines.push(format!("position {} m", triple(vertex.surface.position)));
                lines.push(format!("normal {}", triple(vertex.shading_normal())));
                lines.push(format!("depth {:.4} m", view.depth(vertex.surface.position, 0.0)));
                lines.push(format!("albedo {}", triple(vertex.bsdf.albedo())));
            }
        }
        if [side.film.width(), side.film.height()] == self.size {
            let index = pixel[1] * self.size[0] + pixel[0];
            let found = side.film.map(|pixel| *pixel)[index];
            let [r, g, b] = found.mean();
            lines.push(format!("radiance {}", triple(Vec3::new(r as f32, g as f32, b as f32))));
            let error = found.variance_of_mean().map(|variance| variance.sqrt());
            let error = error.map_or(String::new(), |error| format!(", standard error {error:.3e}"));
            lines.push(format!("{} samples{error}", found.samples));
        }
        lines.extend(side.notes.iter().map(|note| format!("{}: {note}", side.name)));
        if side.name == "bandwidth" {
            lines.extend(self.explain_bandwidth(pixel));
        }
        lines.join("\n")
    }

    /// The chain that `halflight explain` prints.
    fn explain_bandwidth(&self, pixel: [usize; 2]) -> Option<String> {
        let side = &self.sides[0];
        let table = table_of(&side.name, &self.stage, &side.settings).ok()?;
        let mut technique = BandwidthTechnique::new(schema::read(&table).ok()?);
        technique.prepare(&self.stage.scene, &Quiet).ok()?;
        technique.explain(&self.frame, self.size, pixel).map(|text| text.trim_end().to_string())
    }

    /// A picture of the first side as a file.
    fn save(&mut self, format: &str) -> Result<(String, Vec<u8>), String> {
        let film = &mut self.sides[0].film;
        if film.min_samples() == 0 {
            return Err("there is no picture yet".into());
        }
        let name = |ending: &str| format!("{}.{ending}", file_name(&self.stage.name));
        match format {
            "png" => {
                let mapping = pictures::tone_mapping(self.exposure_ev, self.filmic);
                Ok((name("png"), encode_png(&film.image(), &mapping)?))
            }
            "exr" => {
                let all: Vec<&str> = FEATURE_LAYERS.iter().map(|(name, _)| *name).collect();
                add_layers(&self.frame, film, 0, &all, SAVED_RAYS);
                let mut picture: Picture = film.picture();
                let side = &self.sides[0];
                let entries = [
                    ("technique", side.name.clone()),
                    ("samples", side.film.min_samples().to_string()),
                    ("scene", self.stage.name.clone()),
                    ("time", self.seconds.to_string()),
                ];
                picture.metadata.extend(entries.map(|(key, value)| (key.to_string(), value)));
                Ok((name("exr"), picture.encode_exr(Precision::Float)?))
            }
            other => Err(format!("pictures are saved as exr or png, not as {other:?}")),
        }
    }

    fn kept(&self) -> Kept {
        Kept {
            origin: self.eye.origin(),
            target: self.eye.target,
            vertical_fov_degrees: self.eye.vertical_fov(self.aspect()).to_degrees(),
            aperture_radius: self.eye.camera.aperture_radius,
            focus_distance: self.eye.camera.focus_distance,
            exposure_ev: self.exposure_ev,
            technique: self.sides[0].name.clone(),
            settings: self.sides[0].settings.clone(),
        }
    }

    /// Everything that the page shows beside the pictures.
    fn state(&self) -> Value {
        let names =
            (0..self.posed.world.instances().len() as u32).map(|i| self.posed.shape_name(i).to_string());
        let mut shapes: Vec<String> = names.collect();
        shapes.dedup();
        shapes.truncate(200);
        let of = |side: &Shown| json!({ "technique": side.name, "settings": side.settings });
        json!({
            "kind": "state",
            "scene": self.stage.name,
            "scenes": self.scenes,
            "environments": self.environments,
            "swap": { "environment": self.swap.environment, "material": self.swap.material },
            "description": self.stage.scene.description(),
            "shapes": shapes,
            "moved": self.moved.iter().map(|(name, by)| json!([name, by.to_array()])).collect::<Vec<_>>(),
            "size": self.size,
            "seconds": self.seconds,
            "duration": self.stage.scene.duration(),
            "animated": self.stage.scene.is_animated(),
            "playing": self.playing.is_some(),
            "turn_degrees": self.turn_degrees,
            "exposure_ev": self.exposure_ev,
            "filmic": self.filmic,
            "field_of_view_degrees": self.eye.vertical_fov(self.aspect()).to_degrees(),
            "aperture_radius": self.eye.camera.aperture_radius,
            "focus_distance": self.eye.camera.focus_distance,
            "layer": self.layer,
            "layers": pictures::layer_names(&self.sides[0].film),
            "compare": self.compare,
            "sides": self.sides.iter().map(of).collect::<Vec<_>>(),
            "errors": self.errors,
            "encode_milliseconds": self.encode_milliseconds,
            "techniques": self.techniques,
        })
    }
}

fn triple(v: Vec3) -> String {
    format!("({:.4}, {:.4}, {:.4})", v.x, v.y, v.z)
}

/// Letters, digits and dashes of a name.
fn file_name(name: &str) -> String {
    let last = name.rsplit(['/', '\\', ':']).next().unwrap_or(name);
    let stem = last.split('.').next().unwrap_or(last);
    let plain: String =
        stem.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-' || *c == '_').take(64).collect();
    if plain.is_empty() { "picture".into() } else { plain }
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

    #[test]
    fn names_of_files_hold_nothing_but_letters() {
        assert_eq!(file_name("demo:cone-man"), "cone-man");
        assert_eq!(file_name("../../etc/passwd"), "passwd");
        assert_eq!(file_name("…"), "picture");
    }
}
