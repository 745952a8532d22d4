//! One picture after another, with the same scene, technique and settings.

use std::cell::RefCell;
use std::sync::Arc;
use std::time::{Duration, Instant};

use halflight::job::{Facts, Order, Showing, Size, Stage, automatic_exposure, save_part};
use halflight_image::Picture;
use halflight_render::{Budget, Film, Technique};
use halflight_scene::Frame;
use halflight_trace::FallbackCounts;

use super::options::RenderArgs;
use crate::command::console::Console;
use crate::command::failure::Failure;
use crate::command::output::{self, Encoding, Format};
use crate::command::progress::{self, Checkpoint, Meter};
use crate::command::resources;
use crate::command::sequence::Shot;
use crate::command::techniques;

/// All that the pictures of one command share.
pub(super) struct Studio<'a> {
    args: &'a RenderArgs,
    stage: &'a Stage,
    pub(super) technique_text: String,
    technique: Box<dyn Technique>,
    pub(super) size: Size,
    layers: Vec<&'static str>,
    console: Console,
    /// What the technique last said of its approximations.
    said: RefCell<Vec<String>>,
}

/// How often the fields of a frame asked their meshes so far.
fn fallback_counts(frame: &Frame) -> FallbackCounts {
    // Copies of a shape share their counts.
    let mut seen = Vec::new();
    let mut sum = FallbackCounts::default();
    for instance in frame.world.instances() {
        let geometry = Arc::as_ptr(&instance.geometry);
        let Some(counts) = instance.geometry.as_rays().fallback() else { continue };
        if !seen.contains(&geometry) {
            seen.push(geometry);
            sum.asked += counts.asked;
            sum.confirmed += counts.confirmed;
            sum.fell_back += counts.fell_back;
        }
    }
    sum
}

/// Where a resumed sequence begins, and with what.
pub(super) struct FirstShot {
    pub(super) index: usize,
    pub(super) film: Option<Film>,
}

/// What became of a shot.
#[derive(Clone, Debug, Default)]
pub(super) struct Kept {
    /// Samples a pixel, on the average.
    pub(super) samples: f64,
    pub(super) interrupted: bool,
    pub(super) written: bool,
    pub(super) non_finite: u64,
    pub(super) relative_error: Option<f64>,
    pub(super) rays: u64,
    /// Wall time of posing the scene and building what answers rays.
    pub(super) build_seconds: f64,
    /// Wall time of the technique.
    pub(super) seconds: f64,
    /// Processor time of the technique, all threads.
    pub(super) cpu_seconds: Option<f64>,
}

impl<'a> Studio<'a> {
    pub(super) fn new(
        args: &'a RenderArgs,
        stage: &'a Stage,
        layers: Vec<&'static str>,
        console: Console,
    ) -> Result<Self, Failure> {
        let mut spec = args.technique.clone();
        spec.settings.extend(args.max_depth.map(|depth| format!("max_depth={depth}")));
        let made = techniques::create(&spec, stage)?;
        let size = args.size.unwrap_or_else(|| stage.size());
        let studio = Self {
            args,
            stage,
            technique_text: made.identity,
            technique: made.technique,
            size,
            layers,
            console,
            said: RefCell::default(),
        };
        studio.check_tile()?;
        Ok(studio)
    }

    /// What is to be rendered, frame by frame.
    fn order(&self) -> Order<'_> {
        Order {
            stage: self.stage,
            technique: self.technique.as_ref(),
            technique_text: &self.technique_text,
            size: self.size,
            budget: self.budget(),
            layers: self.layers.clone(),
            share: self.args.tile,
        }
    }

    /// Refuses tiles that could not be joined, and says so where they save no time.
    fn check_tile(&self) -> Result<(), Failure> {
        self.order().check()?;
        if self.args.tile.is_none() || self.technique.divides() {
            return Ok(());
        }
        let name = &self.args.technique.name;
        if self.args.checkpoint.is_some() {
            return Err(Failure::usage(format!(
                "a tile by {name} cannot be gone on with: it works on the whole picture and keeps a part (leave \
                 --checkpoint out)"
            )));
        }
        self.console.note(&format!(
            "{name} works on the whole picture, of which the tile is kept: to share the work, divide a sequence by \
             its frames"
        ));
        Ok(())
    }

    /// The technique's work that all frames share.
    pub(super) fn prepare(&mut self) -> Result<(), Failure> {
        let meter = Meter::new(self.console, "preparing", &self.budget(), None);
        let result = self.technique.prepare(self.stage.scene(), &meter);
        meter.finish();
        Ok(result?)
    }

    /// The shot that the checkpoint belongs to; those before it are done. Without a checkpoint, the first.
    pub(super) fn first_shot(&self, shots: &[Shot]) -> Result<FirstShot, Failure> {
        let Some(path) = self.args.checkpoint.as_ref().filter(|_| self.args.resume) else {
            return Ok(FirstShot { index: 0, film: None });
        };
        let order = self.order();
        let mut refusal = None;
        for (index, shot) in shots.iter().enumerate() {
            match progress::load_checkpoint(path, &order.identity(shot.time), order.film()?) {
                Ok(None) => {
                    self.console
                        .note(&format!("there is no {} yet: starting from the beginning", path.display()));
                    return Ok(FirstShot { index: 0, film: None });
                }
                Ok(Some(film)) => {
                    let samples = film.mean_samples();
                    self.console
                        .note(&format!("going on from {samples:.0} samples a pixel of {}", path.display()));
                    return Ok(FirstShot { index, film: Some(film) });
                }
                Err(error) => refusal = refusal.or(Some(error)),
            }
        }
        Err(refusal.map_or_else(|| Failure::failed("there is nothing to render"), Failure::from))
    }

    /// Renders one picture and writes it, also if an interrupt comes after the first samples.
    pub(super) fn shoot(&self, shot: &Shot, film: Option<Film>) -> Result<Kept, Failure> {
        let order = self.order();
        let start = Instant::now();
        let frame = self.stage.frame(shot.time)?;
        let build_seconds = start.elapsed().as_secs_f64();
        let mut film = match film {
            Some(film) => film,
            None => order.film()?,
        };
        let checkpoint = self.args.checkpoint.as_ref().map(|path| Checkpoint {
            path: path.clone(),
            identity: order.identity(shot.time),
            every: Duration::try_from_secs_f64(self.args.checkpoint_every).unwrap_or(Duration::MAX),
        });
        let budget = self.budget();
        let title = format!("frame {}", shot.frame);
        let meter = Meter::new(self.console, &title, &budget, checkpoint.as_ref());
        let cpu_before = resources::cpu_seconds();
        let fallback_before = fallback_counts(&frame);
        let result = self.technique.render(&frame, &mut film, &budget, &meter);
        let cpu_after = resources::cpu_seconds();
        meter.finish();
        let report = result?;
        if *self.said.borrow() != report.notes {
            for note in &report.notes {
                self.console.note(&format!("{}: {note}", self.args.technique.name));
            }
            self.said.replace(report.notes);
        }
        let fallback = fallback_counts(&frame);
        let asked = fallback.asked - fallback_before.asked;
        if asked > 0 {
            let share = |now: u64, before: u64| 100.0 * (now - before) as f64 / asked as f64;
            self.console.note(&format!(
                "fields with a mesh: of {asked} rays {:.1} % were confirmed on the mesh, {:.1} % were asked of the whole mesh",
                share(fallback.confirmed, fallback_before.confirmed),
                share(fallback.fell_back, fallback_before.fell_back)
            ));
        }
        let mut kept = Kept {
            samples: film.mean_samples(),
            interrupted: report.interrupted,
            written: false,
            non_finite: report.non_finite,
            relative_error: report.relative_error,
            rays: report.rays,
            build_seconds,
            seconds: report.elapsed.as_secs_f64(),
            cpu_seconds: cpu_before.zip(cpu_after).map(|(before, after)| after - before),
        };
        if kept.samples == 0.0 {
            return Ok(kept);
        }
        if let Some(checkpoint) = &checkpoint {
            // The picture is worth more than the checkpoint.
            if let Err(error) = progress::save_checkpoint(checkpoint, &film) {
                self.console
                    .warn(&format!("{error}; the picture is written, but there is nothing to resume from"));
            }
        }
        let facts = Facts { samples: kept.samples, seconds: kept.seconds, interrupted: kept.interrupted };
        let mut picture = order.picture(&frame, &mut film, (shot.frame, shot.time), &facts);
        picture.metadata.insert("command".into(), command_line());
        self.save(&picture, &film, shot, &order)?;
        kept.written = true;
        Ok(kept)
    }

    fn budget(&self) -> Budget {
        Budget {
            samples: self.args.spp,
            seconds: self.args.time_limit,
            error: self.args.error,
            seed: self.args.seed,
        }
    }

    /// Writes the picture; says so where the exposure is chosen by what it shows.
    fn save(&self, picture: &Picture, film: &Film, shot: &Shot, order: &Order) -> Result<(), Failure> {
        let tone = self.args.tone.map_or_else(|| self.stage.tone(), Into::into);
        let exposure_ev = match self.args.exposure {
            Some(ev) => Some(ev as f32),
            None => (!self.stage.exposes_itself()).then(|| self.stage.exposure_ev()),
        };
        let half = self.args.half;
        if order.share.is_some() {
            save_part(&shot.output, picture.clone(), order, Showing { exposure_ev, tone }, half)?;
            return Ok(());
        }
        let exposure_ev = match exposure_ev {
            Some(ev) => ev,
            None if Format::of(&shot.output)? == Format::Png => {
                let ev = automatic_exposure(&film.image());
                let text =
                    format!("exposure {ev:+.1} EV, by the mean of the picture (--exposure sets another)");
                self.console.note(&text);
                ev
            }
            None => 0.0,
        };
        output::save(&shot.output, picture, &Encoding { exposure_ev, tone, half })
    }
}

/// What was typed.
fn command_line() -> String {
    let words: Vec<String> = std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect();
    words.join(" ")
}
