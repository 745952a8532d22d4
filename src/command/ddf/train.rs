//! `halflight ddf train`.

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use halflight_ddf::{
    Cloud, DirectedField, Evaluation, FastShape, FieldSample, Provenance, TrainOptions, UnitSpace,
    chamfer_e3, evaluate, evaluate_while, field_points, mesh_hash, mesh_points,
};
use halflight_file::extension;
use halflight_shape::TriangleMesh;
use indicatif::{ProgressBar, ProgressStyle as BarStyle};
use serde_json::json;

use super::super::console::{Console, ProgressStyle};
use super::super::failure::Failure;
use super::super::parse::positive;
use super::super::stage::MachineArgs;
use super::super::{interrupt, output, words};
use super::learner::{Learner, Network, Said, Schedule, no_checkpoints};

#[derive(Args, Debug)]
pub(super) struct TrainArgs {
    /// A .ply, .obj, .gltf or .glb file
    mesh: PathBuf,
    /// The file, .ddf [default: the mesh's name with .ddf, in the current folder]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Train for so many seconds [default: 120, unless --steps or --target is given]
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    seconds: Option<f64>,
    /// Train for so many steps: the result depends on nothing but the mesh, the options and the seed
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    steps: Option<u64>,
    /// Stop when the Chamfer distance × 10³ is estimated to be at most this
    #[arg(long, value_name = "CHAMFER", value_parser = positive)]
    target: Option<f64>,
    /// Cells along the bounding cube; more is sharper and larger [default: 128]
    #[arg(long, value_name = "N")]
    resolution: Option<u32>,
    /// Which network learns
    #[arg(long, value_enum, default_value_t)]
    network: Network,
    /// The rates of the seed's network [default: ours]
    #[arg(long, value_enum)]
    schedule: Option<Schedule>,
    /// Learn from the samples of this file, which `halflight ddf samples` wrote of this mesh
    #[arg(long, value_name = "FILE")]
    samples: Option<PathBuf>,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Save the training here every minute, and when it ends
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Go on from the checkpoint, if there is one
    #[arg(long, requires = "checkpoint")]
    resume: bool,
    #[command(flatten)]
    machine: MachineArgs,
}

/// Steps of a training that only a target ends: beyond, more steps hardly help.
const MOST_STEPS: u64 = 100_000;
/// Between two checkpoints.
const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(60);
/// Between two estimates of the Chamfer distance, as a multiple of what the last one took: they cost a twentieth.
const ESTIMATE_SHARE: f64 = 20.0;

pub(super) fn run(args: &TrainArgs, console: Console) -> Result<(), Failure> {
    args.machine.apply()?;
    let beside = || PathBuf::from(args.mesh.file_stem().unwrap_or_default()).with_extension("ddf");
    let path = args.output.clone().unwrap_or_else(beside);
    if extension(&path) != "ddf" {
        return Err(Failure::usage(format!("cannot write {}: fields are .ddf files", path.display())));
    }
    if args.network == Network::Fast && args.schedule.is_some() {
        return Err(Failure::usage(
            "`--schedule` is that of `--network seed`: the fast network has one of its own",
        ));
    }
    if args.network == Network::Seed && args.resolution.is_some() {
        return Err(Failure::usage(
            "`--resolution` is that of the fast network: `--network seed` has no cells",
        ));
    }
    output::check_writable(&path)?;
    let begun = Instant::now();
    let mesh = super::load_mesh(&args.mesh, console)?;
    let options = TrainOptions {
        shape: FastShape {
            resolution: args.resolution.unwrap_or(FastShape::default().resolution),
            ..FastShape::default()
        },
        seed: args.seed,
        ..TrainOptions::default()
    };
    if args.network == Network::Seed && args.checkpoint.is_some() {
        return Err(no_checkpoints());
    }
    let name = |error| Failure::failed(format!("{}: {error}", args.mesh.display()));
    let samples = match &args.samples {
        Some(path) => Some(FieldSample::load(path, &mesh_hash(&mesh))?),
        None => None,
    };
    if args.network == Network::Seed && samples.is_none() {
        console.note("drawing about a million samples to learn from");
    }
    warn_of_rounding(&mesh, &args.mesh, console);
    let schedule = args.schedule.unwrap_or_default();
    let mut trainer = Learner::new(&mesh, samples, args.network, schedule, options).map_err(name)?;
    if args.resume
        && let Some(path) = args.checkpoint.as_deref().filter(|path| path.exists())
    {
        trainer.resume(path)?;
        console.note(&format!("going on from step {} of {}", trainer.steps_done(), path.display()));
    }
    interrupt::listen();
    let mut watch = Watch::new(args, &trainer, begun, console);
    let mut stopped = false;
    while !watch.is_done(&trainer) {
        if interrupt::is_asked_to_stop() {
            stopped = true;
            break;
        }
        let report = trainer.step(watch.progress(&trainer)).map_err(name)?;
        watch.after(&trainer, &report)?;
    }
    watch.finish(&trainer)?;
    let mut field = trainer.field();
    field.provenance = Provenance {
        source: args.mesh.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
        source_hash: mesh_hash(&mesh),
        source_triangles: mesh.triangles.len() as u64,
        steps: trainer.steps_done(),
        // A file of so many steps is the same whenever it is made.
        seconds: if args.steps.is_some() { 0.0 } else { begun.elapsed().as_secs_f64() },
        seed: args.seed,
    };
    let measured = measure(&field, &trainer, stopped, console);
    stopped |= interrupt::is_asked_to_stop();
    field.error = measured.measured();
    field.save(&path)?;
    let size = std::fs::metadata(&path).map(|m| m.len()).unwrap_or(0);
    console.note(&format!(
        "wrote {} ({}, {} steps) in {}; Chamfer × 10³ {} (of two clouds of the mesh itself {}), {:.2} % of hits and misses right",
        path.display(),
        words::bytes(size),
        trainer.steps_done(),
        words::seconds(begun.elapsed().as_secs_f64()),
        words::figure(measured.clouds.chamfer_e3),
        words::figure(measured.floor_e3),
        100.0 * measured.primary.visibility,
    ));
    console.event(
        "done",
        json!({
            "output": path, "seconds": begun.elapsed().as_secs_f64(), "steps": trainer.steps_done(), "bytes": size,
            "parameters": field.parameters(), "chamfer_e3": measured.clouds.chamfer_e3,
            "floor_e3": measured.floor_e3, "visibility": measured.primary.visibility,
        }),
    );
    if stopped { Err(Failure::Interrupted) } else { Ok(()) }
}

/// Errors of a field, of fewer rays if there is no time for more.
fn measure(field: &DirectedField, trainer: &Learner, stopped: bool, console: Console) -> Evaluation {
    let shown = Cell::new(Instant::now());
    let go_on = |part: f32| {
        if shown.get().elapsed() > Duration::from_secs(5) {
            shown.set(Instant::now());
            super::tell(console, "trained; measured", part);
        }
        !interrupt::is_asked_to_stop()
    };
    let whole = if stopped { None } else { evaluate_while(field, trainer.unit_mesh(), 30_000, 1, &go_on) };
    whole.unwrap_or_else(|| {
        let few = if field.prefers_many() { 1_000 } else { 30_000 };
        evaluate(field, trainer.unit_mesh(), few, 1)
    })
}

/// Says so where coordinates are rounded so much that it shows.
fn warn_of_rounding(mesh: &TriangleMesh, path: &Path, console: Console) {
    let Some(rounding) = UnitSpace::of_mesh(mesh).map(|unit| unit.rounding()).filter(|&part| part > 1e-4)
    else {
        return;
    };
    console.warn(&format!(
        "{}: it stands so far from the origin for its size that its coordinates are rounded to {} of its radius; move it to \
         the origin, and place it with a transform",
        path.display(),
        words::figure(f64::from(rounding))
    ));
}

/// When to stop, what to show, when to save.
struct Watch<'a> {
    args: &'a TrainArgs,
    console: Console,
    begun: Instant,
    seconds: Option<f64>,
    of_mesh: Cloud,
    chamfer: Option<f64>,
    estimate_at: Instant,
    saved_at: Instant,
    shown_at: Instant,
    bar: Option<ProgressBar>,
}

impl<'a> Watch<'a> {
    fn new(args: &'a TrainArgs, trainer: &Learner, begun: Instant, console: Console) -> Self {
        let unlimited = args.steps.is_none() && args.target.is_none();
        let seconds = args.seconds.or(unlimited.then_some(120.0));
        let bar = (console.progress_style() == ProgressStyle::Bar).then(|| {
            let bar = ProgressBar::new(1000);
            if let Ok(style) = BarStyle::with_template("{bar:30} {percent:>3} %  {msg}") {
                bar.set_style(style);
            }
            bar
        });
        let now = Instant::now();
        Watch {
            args,
            console,
            begun,
            seconds,
            of_mesh: Cloud::new(mesh_points(trainer.unit_mesh(), 30_000, 2)),
            chamfer: None,
            estimate_at: now + Duration::from_secs(2),
            saved_at: now,
            shown_at: now,
            bar,
        }
    }

    /// How much is done, 0 to 1: of the time, or of the steps, whichever is further.
    fn progress(&self, trainer: &Learner) -> f32 {
        let steps = self.args.steps.or(self.seconds.is_none().then_some(MOST_STEPS));
        let of_steps = steps.map_or(0.0, |steps| trainer.steps_done() as f64 / steps.max(1) as f64);
        let of_time = self.seconds.map_or(0.0, |seconds| self.begun.elapsed().as_secs_f64() / seconds);
        of_steps.max(of_time).min(1.0) as f32
    }

    fn is_done(&self, trainer: &Learner) -> bool {
        let reached = self.args.target.zip(self.chamfer).is_some_and(|(target, found)| found <= target);
        reached || self.progress(trainer) >= 1.0
    }

    fn after(&mut self, trainer: &Learner, report: &Said) -> Result<(), Failure> {
        if Instant::now() >= self.estimate_at {
            let start = Instant::now();
            let points = Cloud::new(field_points(&trainer.field(), 30_000, 3));
            self.chamfer = Some(chamfer_e3(&points, &self.of_mesh));
            self.estimate_at = Instant::now() + start.elapsed().mul_f64(ESTIMATE_SHARE);
        }
        if self.saved_at.elapsed() > CHECKPOINT_INTERVAL {
            self.save(trainer)?;
        }
        let every = match self.console.progress_style() {
            ProgressStyle::None => return Ok(()),
            ProgressStyle::Bar => 0.1,
            ProgressStyle::Json => 0.5,
            ProgressStyle::Lines => 5.0,
        };
        if self.shown_at.elapsed().as_secs_f64() < every {
            return Ok(());
        }
        self.shown_at = Instant::now();
        let progress = self.progress(trainer);
        let chamfer =
            self.chamfer.map_or(String::new(), |found| format!(", Chamfer × 10³ {}", words::figure(found)));
        let sentence = format!(
            "step {}, {}{chamfer}, {}",
            trainer.steps_done(),
            report.sentence,
            words::seconds(self.begun.elapsed().as_secs_f64()),
        );
        if let Some(bar) = &self.bar {
            bar.set_position((f64::from(progress) * 1000.0) as u64);
            bar.set_message(sentence);
        } else if self.console.progress_style() == ProgressStyle::Json {
            let mut event = json!({
                "fraction": progress, "step": trainer.steps_done(), "chamfer_e3": self.chamfer,
                "seconds": self.begun.elapsed().as_secs_f64(),
            });
            if let (Some(to), Some(from)) = (event.as_object_mut(), report.figures.as_object()) {
                to.extend(from.clone());
            }
            self.console.event("progress", event);
        } else {
            self.console.note(&format!("{:.0} %, {sentence}", 100.0 * progress));
        }
        Ok(())
    }

    fn save(&mut self, trainer: &Learner) -> Result<(), Failure> {
        self.saved_at = Instant::now();
        let path: Option<&Path> = self.args.checkpoint.as_deref();
        path.map_or(Ok(()), |path| trainer.save_checkpoint(path))
    }

    fn finish(&mut self, trainer: &Learner) -> Result<(), Failure> {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        self.save(trainer)
    }
}
