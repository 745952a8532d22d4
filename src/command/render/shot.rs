//! One picture after another, with the same scene, technique and settings.

use std::cell::RefCell;
use std::path::Path;
use std::time::{Duration, Instant};

use halflight_image::Picture;
use halflight_render::{Budget, Film, Technique, features};

use super::exposure;
use super::options::RenderArgs;
use crate::command::console::Console;
use crate::command::failure::Failure;
use crate::command::output::{self, Encoding, Format};
use crate::command::parse::Size;
use crate::command::progress::{self, Checkpoint, Meter};
use crate::command::resources;
use crate::command::sequence::Shot;
use crate::command::stage::Stage;
use crate::command::techniques;

/// Rays a pixel for the layers of an interrupted picture: seconds at any size.
const INTERRUPTED_LAYER_RAYS: u32 = 16;

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
        Ok(Self {
            args,
            stage,
            technique_text: made.identity,
            technique: made.technique,
            size,
            layers,
            console,
            said: RefCell::default(),
        })
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
        let mut refusal = None;
        for (index, shot) in shots.iter().enumerate() {
            match progress::load_checkpoint(path, &self.identity(shot), self.size.width, self.size.height) {
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
        let start = Instant::now();
        let frame = self.stage.frame(shot.time)?;
        let build_seconds = start.elapsed().as_secs_f64();
        let mut film = film.unwrap_or_else(|| Film::new(self.size.width, self.size.height));
        let checkpoint = self.args.checkpoint.as_ref().map(|path| Checkpoint {
            path: path.clone(),
            identity: self.identity(shot),
            every: Duration::try_from_secs_f64(self.args.checkpoint_every).unwrap_or(Duration::MAX),
        });
        let budget = self.budget();
        let title = format!("frame {}", shot.frame);
        let meter = Meter::new(self.console, &title, &budget, checkpoint.as_ref());
        let cpu_before = resources::cpu_seconds();
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
        // Who interrupts does not want to wait for smooth edges.
        let layer_rays = if kept.interrupted { INTERRUPTED_LAYER_RAYS } else { features::MAX_RAYS };
        features::add_layers(&frame, &mut film, self.args.seed, &self.layers, layer_rays);
        let picture = self.with_metadata(film.picture(), shot, &kept);
        output::save(&shot.output, &picture, &self.encoding(&film, &shot.output)?)?;
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

    /// How the picture is written; says so where the exposure is chosen by what it shows.
    fn encoding(&self, film: &Film, output: &Path) -> Result<Encoding, Failure> {
        let of_scene = self.stage.exposure_ev();
        let is_automatic = exposure::is_automatic(&self.args.scene) && of_scene == 0.0;
        let exposure_ev = match self.args.exposure {
            Some(ev) => ev as f32,
            None if is_automatic && Format::of(output)? == Format::Png => {
                let ev = exposure::automatic(&film.image());
                let text =
                    format!("exposure {ev:+.1} EV, by the mean of the picture (--exposure sets another)");
                self.console.note(&text);
                ev
            }
            None => of_scene,
        };
        Ok(Encoding {
            exposure_ev,
            tone: self.args.tone.unwrap_or_else(|| self.stage.tone()),
            half: self.args.half,
        })
    }

    /// Everything that must be the same for the samples to be the same.
    fn identity(&self, shot: &Shot) -> String {
        format!(
            "halflight {} scene {} time {} technique {} seed {} size {}x{} simd {}",
            env!("CARGO_PKG_VERSION"),
            self.stage.hash(),
            shot.time,
            self.technique_text,
            self.args.seed,
            self.size.width,
            self.size.height,
            self.stage.simd_name(),
        )
    }

    fn with_metadata(&self, mut picture: Picture, shot: &Shot, kept: &Kept) -> Picture {
        let command: Vec<String> = std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect();
        let entries = [
            ("version", format!("halflight {}", env!("CARGO_PKG_VERSION"))),
            ("scene", self.args.scene.display().to_string()),
            ("scene_hash", self.stage.hash().to_string()),
            ("command", command.join(" ")),
            ("technique", self.technique_text.clone()),
            ("seed", self.args.seed.to_string()),
            ("frame", shot.frame.to_string()),
            ("time_seconds", shot.time.to_string()),
            ("samples", kept.samples.to_string()),
            ("seconds", format!("{:.3}", kept.seconds)),
            ("simd", self.stage.simd_name().to_string()),
        ];
        picture.metadata.extend(entries.map(|(key, value)| (key.to_string(), value)));
        picture
    }
}
