//! The three scenes, frame by frame.

use std::path::Path;
use std::time::{Duration, Instant};

use glam::Vec2;
use halflight::job::Stage;
use halflight_render::techniques::shexp::ShexpSettings;
use halflight_render::{Budget, Film};
use halflight_scene::{Frame, schema};
use halflight_trace::Geometry;

use crate::command::bench::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::progress::silent;
use crate::command::stage::{self, SceneArgs};
use crate::command::table::Table;
use crate::command::techniques::{self, TechniqueSpec};
use crate::command::{interrupt, resources, words};

/// A scene, and frames a second that the seed states for its own on a GTX 480.
pub(super) const SCENES: [(&str, f64); 3] =
    [("wrecking-ball", 15.0), ("whale-in-the-ocean", 10.0), ("cone-man", 68.0)];
const WIDTH: usize = 960;
const HEIGHT: usize = 540;
pub(super) const FRAMES_A_SECOND: f64 = 30.0;

/// What one scene took.
struct Run {
    name: &'static str,
    seed: f64,
    spheres: usize,
    /// Part of the pixels that show something.
    covered: f64,
    frames: u32,
    wall: Duration,
    cpu: Option<f64>,
    /// Each stage, summed over the frames.
    stages: Vec<(&'static str, Duration)>,
}

pub(in crate::command::bench) fn measure(args: &BenchArgs) -> Result<Findings, Failure> {
    let frames = if args.quick { 3 } else { 60 };
    let mut runs = Vec::new();
    for (name, seed) in SCENES {
        runs.push(run(name, seed, frames, args)?);
        if interrupt::is_asked_to_stop() {
            break;
        }
    }
    let mut stages: Vec<&'static str> = Vec::new();
    for (name, _) in runs.iter().flat_map(|run| &run.stages) {
        if !stages.contains(name) {
            stages.push(name);
        }
    }
    let mut heading = vec!["scene", "blockers", "covered"];
    heading.extend(&stages);
    heading.extend(["ms a frame", "CPU ms", "frames/s", "seed's, GTX 480"]);
    let mut table = Table::new(heading);
    for run in &runs {
        let a_frame = |seconds: f64| format!("{:.1}", 1e3 * seconds / f64::from(run.frames));
        let mut cells =
            vec![run.name.to_string(), run.spheres.to_string(), format!("{:.0} %", 100.0 * run.covered)];
        cells.extend(stages.iter().map(|stage| {
            let spent = run.stages.iter().find(|(name, _)| name == stage);
            spent.map_or_else(|| "–".into(), |(_, time)| a_frame(time.as_secs_f64()))
        }));
        cells.push(a_frame(run.wall.as_secs_f64()));
        cells.push(run.cpu.map_or_else(|| "–".into(), a_frame));
        cells.push(words::figure(f64::from(run.frames) / run.wall.as_secs_f64()));
        cells.push(words::figure(run.seed));
        table.row(cells);
    }
    let notes = vec![
        format!(
            "{WIDTH} × {HEIGHT} pixels, one sample each, {frames} frames at {FRAMES_A_SECOND} a second; wall time in ms"
        ),
        "everything that changes per frame is included; the fit of the spheres and the first frame are not"
            .into(),
    ];
    Ok(Findings { title: "Spherical-harmonic exponentiation, scenes", table, notes })
}

fn run(name: &'static str, seed: f64, frames: u32, args: &BenchArgs) -> Result<Run, Failure> {
    let stage = stage::load(Path::new(&format!("demo:{name}")), &SceneArgs::default(), &args.machine)?;
    let spec = TechniqueSpec { name: "shexp".into(), settings: Vec::new() };
    let mut technique = techniques::create(&spec, &stage)?.technique;
    technique.prepare(stage.scene(), &silent())?;
    let first = stage.frame(0.0)?;
    let budget = Budget { samples: Some(1), ..Budget::default() };
    technique.render(&first, &mut Film::new(WIDTH, HEIGHT), &budget, &silent())?;
    let mut run = Run {
        name,
        seed,
        spheres: spheres(&stage, &first)?,
        covered: covered(&first),
        frames: 0,
        wall: Duration::ZERO,
        cpu: None,
        stages: vec![("pose and build", Duration::ZERO)],
    };
    let cpu = resources::cpu_seconds();
    for number in 0..frames {
        let begun = Instant::now();
        let frame = stage.frame(f64::from(number) / FRAMES_A_SECOND)?;
        run.stages[0].1 += begun.elapsed();
        let report = technique.render(&frame, &mut Film::new(WIDTH, HEIGHT), &budget, &silent())?;
        run.wall += begun.elapsed();
        for (name, time) in report.stages {
            match run.stages.iter_mut().find(|(known, _)| *known == name) {
                Some((_, total)) => *total += time,
                None => run.stages.push((name, time)),
            }
        }
        run.frames += 1;
        if interrupt::is_asked_to_stop() {
            break;
        }
    }
    run.cpu = cpu.zip(resources::cpu_seconds()).map(|(before, after)| after - before);
    Ok(run)
}

/// Spheres that block light: those of the scene, and those that stand for its meshes.
fn spheres(stage: &Stage, frame: &Frame) -> Result<usize, Failure> {
    let settings: ShexpSettings =
        schema::read(&stage.technique_settings("shexp")?).map_err(Failure::failed)?;
    let count = |object: &halflight_scene::PosedObject| {
        let instance = &frame.world.instances()[object.instances.start as usize];
        match instance.geometry.as_ref() {
            Geometry::Spheres(tracer) => tracer.spheres().len() * object.places.len(),
            Geometry::Mesh(_) => settings.spheres as usize * object.places.len(),
            _ => 0,
        }
    };
    Ok(frame.objects.iter().filter(|object| !object.instances.is_empty()).map(count).sum())
}

/// The part of the pixels that show something.
fn covered(frame: &Frame) -> f64 {
    let view = frame.camera.view(WIDTH, HEIGHT);
    let shows = |i: usize| {
        let pixel = Vec2::new((i % WIDTH) as f32 + 0.5, (i / WIDTH) as f32 + 0.5);
        frame.world.closest(&view.ray(pixel, Vec2::splat(0.5), 0.0)).is_some()
    };
    (0..WIDTH * HEIGHT).filter(|&i| shows(i)).count() as f64 / (WIDTH * HEIGHT) as f64
}
