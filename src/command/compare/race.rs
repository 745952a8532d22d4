//! Several techniques on one scene, each within the same budgets.

use std::path::Path;
use std::time::Instant;

use halflight::job::Stage;
use halflight_image::RgbImage;
use halflight_image::metrics::relative_mse;
use halflight_image::report::{Candidate, Comparison, Curve, CurvePoint};
use halflight_render::{Budget, Film};
use halflight_scene::Frame;

use super::{CompareArgs, note_origin};
use crate::command::console::Console;
use crate::command::failure::Failure;
use crate::command::output::Format;
use crate::command::parse::Size;
use crate::command::progress::Meter;
use crate::command::stage::{self, SceneArgs};
use crate::command::techniques::{self, TechniqueSpec};
use crate::command::{interrupt, resources, words};

/// Samples a pixel when no budget is given: noisy enough to tell techniques apart, and quick.
const DEFAULT_SAMPLES: u32 = 16;
/// Added to the seed of the reference, whose noise must not be that of the candidates.
const REFERENCE_SEED: u64 = 0x5EED_0000_0000;

/// What every technique meets.
struct Course<'a> {
    stage: &'a Stage,
    frame: Frame,
    size: Size,
    console: Console,
}

/// Where a technique stood when a budget was spent.
struct Station {
    image: RgbImage,
    samples: f64,
    seconds: f64,
    cpu_seconds: Option<f64>,
    peak_memory_bytes: Option<u64>,
    /// What the technique says of itself.
    notes: Vec<String>,
}

pub(super) fn run(args: &CompareArgs, console: Console) -> Result<Comparison, Failure> {
    args.machine.apply()?;
    interrupt::listen();
    let changes = SceneArgs { size: args.size, ..args.scene.clone() };
    let stage = stage::load(&args.input, &changes, &args.machine)?;
    stage.warnings().iter().for_each(|warning| console.warn(warning));
    let size = args.size.unwrap_or_else(|| stage.size());
    let course = Course { stage: &stage, frame: stage.frame(args.time)?, size, console };

    let specs =
        if args.technique.is_empty() { vec![TechniqueSpec::default()] } else { args.technique.clone() };
    // All settings are looked at before the long work begins.
    specs.iter().try_for_each(|spec| techniques::create(spec, &stage).map(|_| ()))?;
    let (reference, reference_name) = reference(args, &course)?;
    let names: Vec<String> = specs.iter().map(name_of).collect();
    let title = format!("{}: {}", args.input.display(), names.join(", "));
    let mut comparison = Comparison::new(title, reference_name, reference);
    comparison.exposure_ev = args.exposure.map_or_else(|| stage.exposure_ev(), |ev| ev as f32);
    comparison.reference_noise = args.reference_noise;
    for (spec, name) in specs.iter().zip(names) {
        let stations = course.run(spec, &budgets(args), args.seed)?;
        add(&mut comparison, name, stations)?;
    }
    note_origin(&mut comparison);
    comparison.note("scene", format!("{}, content hash {}", args.input.display(), stage.hash()));
    comparison.note(
        "machine",
        format!(
            "{}, {} threads, {}",
            resources::cpu_model(),
            rayon::current_num_threads(),
            stage.simd_name()
        ),
    );
    comparison.note("budgets", "each goes on from the one before it; seconds of wall time are added up");
    Ok(comparison)
}

fn name_of(spec: &TechniqueSpec) -> String {
    if spec.settings.is_empty() {
        spec.name.clone()
    } else {
        format!("{}:{}", spec.name, spec.settings.join(","))
    }
}

/// In rising order, so that each goes on from the one before.
fn budgets(args: &CompareArgs) -> Vec<Budget> {
    let mut seconds = args.time_limit.clone();
    seconds.sort_by(f64::total_cmp);
    if !seconds.is_empty() {
        return seconds.into_iter().map(|s| Budget { seconds: Some(s), ..Budget::default() }).collect();
    }
    let mut samples = if args.spp.is_empty() { vec![DEFAULT_SAMPLES] } else { args.spp.clone() };
    samples.sort_unstable();
    samples.into_iter().map(|n| Budget { samples: Some(n), ..Budget::default() }).collect()
}

/// A picture if `--reference` names one, else a render with many samples.
fn reference(args: &CompareArgs, course: &Course) -> Result<(RgbImage, String), Failure> {
    let spec = match args.reference.as_deref() {
        None => TechniqueSpec::default(),
        Some(name) => {
            let path = Path::new(name);
            if Format::of(path).is_ok() || path.is_file() {
                return Ok((super::load(path)?.image, name.to_string()));
            }
            name.parse().map_err(|e| Failure::usage(format!("{e}, and it is no picture either")))?
        }
    };
    let budget = Budget { samples: Some(args.reference_spp), ..Budget::default() };
    let name = format!("{} at {} samples", name_of(&spec), args.reference_spp);
    let seed = args.seed.wrapping_add(REFERENCE_SEED);
    match course.run(&spec, &[budget], seed)?.pop() {
        Some(station) => Ok((station.image, name)),
        None => Err(Failure::failed("the reference has no budget")),
    }
}

/// The last station as a candidate, all of them as a curve.
fn add(comparison: &mut Comparison, name: String, mut stations: Vec<Station>) -> Result<(), Failure> {
    let point = |station: &Station| -> Result<CurvePoint, Failure> {
        let relative_mse = relative_mse(&station.image, &comparison.reference)?;
        Ok(CurvePoint { seconds: station.seconds, samples: station.samples, relative_mse })
    };
    let points = stations.iter().map(point).collect::<Result<_, _>>()?;
    comparison.curves.push(Curve { name: name.clone(), points });
    let Some(last) = stations.pop() else { return Ok(()) };
    for note in last.notes {
        comparison.note(name.clone(), note);
    }
    if let Some(cpu) = last.cpu_seconds {
        comparison.note(format!("CPU time of {name}"), words::seconds(cpu));
    }
    comparison.candidates.push(Candidate {
        samples: Some(last.samples),
        seconds: Some(last.seconds),
        peak_memory_bytes: last.peak_memory_bytes,
        ..Candidate::new(name, last.image)
    });
    Ok(())
}

impl Course<'_> {
    /// One technique through all budgets. Its preparation counts as time of the first.
    fn run(&self, spec: &TechniqueSpec, budgets: &[Budget], seed: u64) -> Result<Vec<Station>, Failure> {
        let name = name_of(spec);
        let mut technique = techniques::create(spec, self.stage)?.technique;
        resources::reset_peak_memory();
        let (start, cpu_start) = (Instant::now(), resources::cpu_seconds());
        let meter = Meter::new(self.console, &name, &Budget::default(), None);
        technique.prepare(self.stage.scene(), &meter)?;
        meter.finish();
        let mut film = Film::new(self.size.width, self.size.height);
        let mut stations = Vec::new();
        // Copying the film out is not the technique's work.
        let (mut idle, mut idle_cpu) = (0.0, 0.0);
        for budget in budgets {
            let spent = start.elapsed().as_secs_f64() - idle;
            let seconds = budget.seconds.map(|s| (s - spent).max(0.0));
            let left = Budget { seconds, seed, ..budget.clone() };
            let meter = Meter::new(self.console, &name, &left, None);
            let result = technique.render(&self.frame, &mut film, &left, &meter);
            meter.finish();
            let report = result?;
            if report.interrupted {
                return Err(Failure::Interrupted);
            }
            let (seconds, cpu_now) = (start.elapsed().as_secs_f64() - idle, resources::cpu_seconds());
            stations.push(Station {
                image: film.image(),
                samples: film.mean_samples(),
                seconds,
                cpu_seconds: cpu_start.zip(cpu_now).map(|(before, now)| now - before - idle_cpu),
                peak_memory_bytes: resources::peak_memory_bytes(),
                notes: report.notes,
            });
            idle = start.elapsed().as_secs_f64() - seconds;
            idle_cpu += cpu_now.zip(resources::cpu_seconds()).map_or(0.0, |(before, after)| after - before);
        }
        Ok(stations)
    }
}
