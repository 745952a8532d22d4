//! What becomes of each wish of a person at the page.

use std::sync::Arc;
use std::time::Instant;

use glam::{Vec2, Vec3};
use halflight_scene::camera::FieldOfView;
use serde_json::{Value, json};

use super::{MAX_PIXELS, MAX_SIDE, MAX_WAITING, Stale, Studio, fitting};
use crate::answers::Question;
use crate::eye::Eye;
use crate::hub::{Asked, Reply};
use crate::pictures;
use crate::side::{Reference, Shown};
use crate::wire::{Ask, Dropped, Side};
use crate::{Kept, Stage, Swap};

impl Studio {
    /// From the beginning of another scene.
    fn begin(&mut self, stage: Stage) -> Result<(), String> {
        (self.seconds, self.playing) = (0.0, None);
        self.swap = Swap::default();
        self.enter(stage, false)
    }

    /// The scene that is open, with other light or materials.
    fn change(&mut self, swap: Swap) -> Result<(), String> {
        let stage = self.library.open(&self.stage.name, &swap)?;
        self.enter(stage, true)?;
        self.swap = swap;
        Ok(())
    }

    /// Puts a stored picture beside what is rendered.
    fn refer_to(&mut self, name: String, image: halflight_image::RgbImage) -> Result<(), String> {
        if image.width > MAX_SIDE || image.height > MAX_SIDE || image.width * image.height > MAX_PIXELS {
            return Err(format!(
                "{name} has {} × {} pixels; here {MAX_PIXELS} and {MAX_SIDE} along a side are shown (halflight compare takes any)",
                image.width, image.height
            ));
        }
        // Errors are measured pixel by pixel.
        self.size = [image.width, image.height];
        self.own_size = true;
        self.compare = true;
        let technique = self.sides[1].name.clone();
        let settings = std::mem::take(&mut self.sides[1].settings);
        self.sides[1] = Shown::new(&technique);
        self.sides[1].settings = settings;
        self.sides[1].reference = Some(Reference { name, image: Arc::new(image) });
        self.stale = Stale { pictures: true, state: true, ..self.stale };
        Ok(())
    }

    fn take_files(&mut self, files: &Dropped, reference: bool) -> Result<(), String> {
        match files.first().filter(|_| reference) {
            Some((name, bytes)) => {
                let image = self.library.take_picture(name, bytes)?;
                self.refer_to(name.clone(), image)
            }
            None => {
                let stage = self.library.take(files)?;
                self.begin(stage)
            }
        }
    }

    /// The layers that may be chosen.
    pub(super) fn layer_names(&self) -> Vec<String> {
        pictures::layer_names(&self.frame, &self.sides[0].layers)
    }

    /// The number in the scene of an object by its name.
    fn object_number(&self, name: &str) -> Result<usize, String> {
        let mut objects = self.posed.objects.iter();
        let found =
            objects.find(|o| !o.instances.is_empty() && self.posed.shape_name(o.instances.start) == name);
        found.map(|found| found.object).ok_or_else(|| format!("there is no object {name:?} in this scene"))
    }

    pub(super) fn obey(&mut self, client: u64, asked: Asked) -> Result<(), String> {
        let ask = match asked {
            Asked::Ask(ask) => ask,
            Asked::Files { files, reference } => return self.take_files(&files, reference),
        };
        match ask {
            Ask::Orbit { x, y } => self.look(|eye, _| eye.orbit(x as f32, y as f32)),
            Ask::Pan { x, y } => self.look(|eye, fov| eye.pan(x as f32, y as f32, fov)),
            Ask::Look { x, y } => self.look(|eye, fov| eye.look(x as f32, y as f32, fov)),
            Ask::Dolly { by } => self.look(|eye, _| eye.dolly(by as f32)),
            Ask::Fly { by } => self.look(|eye, _| eye.fly(by.map(|x| x as f32))),
            Ask::Home {} => {
                let up = self.stage.scene.camera_up();
                self.eye = Eye::new(self.posed.camera, up, self.posed.bounds);
                self.look(|_, _| ());
            }
            Ask::Frame {} => {
                let bounds = self.posed.bounds;
                self.look(|eye, fov| eye.frame(bounds, fov));
            }
            Ask::FieldOfView { degrees } => {
                let angle = degrees.clamp(0.5, 170.0).to_radians() as f32;
                self.look(|eye, _| eye.zoom(FieldOfView::Vertical(angle)));
            }
            Ask::Aperture { radius } => {
                let radius = radius.clamp(0.0, 1e3) as f32;
                self.look(|eye, _| eye.lens(radius, eye.camera.focus_distance));
            }
            Ask::Focus { x, y } => self.focus(x, y)?,
            Ask::Time { seconds } => {
                self.sides.iter_mut().for_each(Shown::give_up_if_long);
                self.go_to(seconds.clamp(-1e6, 1e6))?;
            }
            Ask::Play { on } => {
                self.playing = on.then(Instant::now);
                self.stale.state = true;
            }
            Ask::Environment { degrees } => {
                self.turn_degrees = degrees.rem_euclid(360.0);
                self.arrange();
            }
            Ask::Move { object, by } => {
                self.object_number(&object)?;
                self.sides.iter_mut().for_each(Shown::give_up_if_long);
                let by = Vec3::from(by).clamp(Vec3::splat(-1e6), Vec3::splat(1e6));
                if by == Vec3::ZERO {
                    self.moved.remove(&object);
                } else {
                    self.moved.insert(object, by);
                }
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
            Ask::Reference { name } => {
                let image = self.library.picture(&name)?;
                self.refer_to(name, image)?;
            }
            Ask::Set { side, key, value } => {
                let shown = &mut self.sides[usize::from(side == Side::B)];
                shown.set(&self.stage, &key, &value)?;
                self.stale = Stale { pictures: true, state: true, ..self.stale };
            }
            Ask::Compare { on } => {
                self.compare = on;
                if !on && matches!(self.layer.as_str(), "flip" | "difference") {
                    self.layer = "color".into();
                }
                self.stale = Stale { pictures: true, sent: true, state: true };
            }
            Ask::Layer { name } => {
                let map = ["flip", "difference"].contains(&name.as_str());
                if map && !self.compare {
                    return Err(format!("the layer {name} is between two sides: compare first"));
                }
                if !map && name != "color" && !self.layer_names().contains(&name) {
                    return Err(format!("there is no layer {name:?}"));
                }
                self.layer = name;
                if map {
                    self.errors = Value::Null;
                }
                self.stale = Stale { sent: true, state: true, ..self.stale };
            }
            Ask::Size { width, height } => {
                self.size = fitting([width, height]);
                self.own_size = true;
                self.stale = Stale { pictures: true, state: true, ..self.stale };
            }
            Ask::Explain { x, y, side } => {
                let (x, y) = (x.clamp(0.0, 1.0), y.clamp(0.0, 1.0));
                let side = usize::from(side == Side::B && self.compare);
                self.questions.retain(|question| question.client != client);
                if self.questions.len() < MAX_WAITING {
                    self.questions.push(Question { client, x, y, side, pixel: self.pixel(x, y) });
                }
            }
            Ask::Save { format } => {
                if !matches!(format.as_str(), "exr" | "png") {
                    return Err(format!("pictures are saved as exr or png, not as {format:?}"));
                }
                if self.savers.len() >= MAX_WAITING {
                    return Err("too many pictures are being saved".into());
                }
                if self.playing.is_some() {
                    if !self.hub.has_controls(client) {
                        return Err("time runs: who has the controls has to hold it first".into());
                    }
                    self.playing = None;
                    self.stale.state = true;
                }
                self.savers.push((client, format));
            }
            Ask::Keep {} => {
                let place = self.library.keep(&self.kept()?)?;
                let text =
                    [Some(place), self.left_out()].into_iter().flatten().collect::<Vec<_>>().join("; ");
                self.list();
                self.stale.state = true;
                self.hub.reply(client, Reply::Text(json!({ "kind": "kept", "text": text }).to_string()));
            }
            Ask::Open { name } => {
                let stage = self.library.open(&name, &Swap::default())?;
                self.begin(stage)?;
            }
            Ask::Swap { environment } => self.change(Swap { environment, ..self.swap.clone() })?,
            Ask::Material { object, material } => {
                let number = self.object_number(&object)?;
                let mut swap = self.swap.clone();
                swap.materials.retain(|(known, _)| *known != number);
                if !material.trim().is_empty() {
                    swap.materials.push((number, material.trim().into()));
                }
                self.change(swap)?;
            }
            Ask::Control {} => {}
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
        let depth = view.depth(point, 0.0).max(1e-4);
        self.look(|eye, _| {
            eye.lens(eye.camera.aperture_radius, depth);
            // Things are looked at where they are sharp.
            eye.aim(depth);
        });
        Ok(())
    }

    fn kept(&self) -> Result<Kept, String> {
        let own = self.eye.own;
        let moved = |(name, by): (&String, &Vec3)| Ok((self.object_number(name)?, *by));
        Ok(Kept {
            place: own.place.then(|| [self.eye.origin(), self.eye.target]),
            vertical_fov_degrees: own
                .field_of_view
                .then(|| self.eye.vertical_fov(self.aspect()).to_degrees()),
            lens: own.lens.then_some([self.eye.camera.aperture_radius, self.eye.camera.focus_distance]),
            exposure_ev: self.exposure_ev,
            filmic: self.filmic,
            size: self.own_size.then_some(self.size),
            turn_degrees: self.turn_degrees,
            has_environment: self.posed.lights.environment().is_some(),
            swap: self.swap.clone(),
            moved: self.moved.iter().map(moved).collect::<Result<_, String>>()?,
            technique: self.sides[0].name.clone(),
            settings: self.sides[0].settings.clone(),
        })
    }

    /// What is shown and no scene file has words for.
    fn left_out(&self) -> Option<String> {
        let mut left = Vec::new();
        if self.seconds != 0.0 {
            left.push(format!("the time, {:.2} s", self.seconds));
        }
        if self.compare {
            left.push(format!("the right side, {}", self.sides[1].title()));
        }
        if self.layer != "color" {
            left.push(format!("the layer, {}", self.layer));
        }
        left.push(format!("which technique is shown (-t {})", self.sides[0].name));
        Some(format!("a scene file does not say {}", left.join("; ")))
    }
}
