//! `halflight render`: from a scene or a bare asset to pictures.

mod options;
mod shot;
mod stats;
mod targets;

pub(crate) use options::RenderArgs;

use std::path::{Path, PathBuf};
use std::time::Instant;

use halflight::job;
use serde_json::json;

use super::console::Console;
use super::failure::Failure;
use super::output::{self, Format};
use super::sequence::{self, Shot};
use super::{interrupt, resources, stage, words};
use shot::{FirstShot, Kept, Studio};
use stats::Stats;
use targets::Inputs;

/// Frames per second where neither the command nor the scene says: film's.
const DEFAULT_FPS: f64 = 24.0;

pub(crate) fn run(args: &RenderArgs, console: Console) -> Result<(), Failure> {
    let mut inputs = Inputs::named(args);
    let mut shots = choose_shots(args, &inputs);
    let output = shots[0].output.clone();
    let format = Format::of(&output)?;
    if args.tile.is_some() && format != Format::Exr {
        return Err(Failure::usage(format!(
            "cannot write a tile to {}: tiles are .exr, which says what they belong to (merge joins them to any format)",
            output.display()
        )));
    }
    let layers = job::choose_layers(args.layers.as_deref(), format)?;
    if args.resume && args.checkpoint.is_none() {
        return Err(Failure::usage("--resume goes on from a checkpoint: name it with --checkpoint FILE"));
    }
    targets::refuse_twins(args, &shots)?;
    inputs.refuse(args, &shots)?;
    // All of one folder, so the first speaks for the others.
    let firsts = [Some(&shots[0].output), args.checkpoint.as_ref(), args.stats.as_ref()];
    firsts.into_iter().flatten().try_for_each(|path| output::check_writable(path))?;
    args.machine.apply()?;
    interrupt::listen();

    let start = Instant::now();
    let stage = stage::load(&args.scene, &args.scene_options(), &args.machine)?;
    let load_seconds = start.elapsed().as_secs_f64();
    stage.warnings().iter().for_each(|warning| console.warn(warning));
    if targets::any_exists(args, &shots) {
        inputs.add(stage.scene().files());
        shots = choose_shots(args, &inputs);
        targets::refuse_twins(args, &shots)?;
        inputs.refuse(args, &shots)?;
    }
    if args.output.is_none()
        && args.tile.is_none()
        && shots[0].output != shots_of(args, &default_output(&args.scene))[0].output
    {
        let name = shots[0].output.display();
        console.note(&format!("the picture goes to {name}: the scene is made from a file of the usual name"));
    }
    let mut studio = Studio::new(args, &stage, layers, console)?;
    studio.prepare()?;
    let FirstShot { index: first, mut film } = studio.first_shot(&shots)?;

    let mut stats = Stats::new(args, &stage, &studio, load_seconds);
    let mut interrupted = false;
    for shot in &shots[first..] {
        let taken = studio.shoot(shot, film.take())?;
        tell(console, shot, &taken, shots.len());
        interrupted = taken.interrupted;
        stats.add(shot, &taken);
        if interrupted {
            break;
        }
    }
    let stats = stats.finish();
    if let Some(path) = &args.stats {
        stats::save(path, &stats)?;
    }
    console.event("done", stats);
    if interrupted { Err(Failure::Interrupted) } else { Ok(()) }
}

/// The pictures to make: where the command names none, the first default names under which no file of the scene lies.
fn choose_shots(args: &RenderArgs, inputs: &Inputs) -> Vec<Shot> {
    let Some(output) = &args.output else {
        let mut usual = default_output(&args.scene);
        if args.tile.is_some() {
            usual.set_extension("exr");
        }
        let extension = if args.tile.is_some() { "exr" } else { "png" };
        let others = (1_u32..).map(|number| {
            let number = if number == 1 { String::new() } else { number.to_string() };
            usual.with_extension(format!("render{number}.{extension}"))
        });
        let mut names = std::iter::once(usual.clone()).chain(others).map(|name| shots_of(args, &name));
        return names.find(|shots| !inputs.meet(shots)).unwrap_or_default();
    };
    shots_of(args, output)
}

fn shots_of(args: &RenderArgs, output: &Path) -> Vec<Shot> {
    let mut shots = match args.frames {
        Some(range) => sequence::sequence(range, args.fps(), output),
        None => sequence::still(args.frame.unwrap_or(0.0), args.fps(), output),
    };
    if let Some(tile) = args.tile {
        shots.iter_mut().for_each(|shot| shot.output = job::part_name(&shot.output, tile));
    }
    shots
}

/// `bunny.ply.xz` becomes `bunny.png` in the current folder.
fn default_output(scene: &Path) -> PathBuf {
    let name = scene.file_name().unwrap_or_default().to_string_lossy();
    let mut stem = PathBuf::from(name.rsplit(':').next().unwrap_or_default());
    if stem.extension().is_some_and(|e| e.eq_ignore_ascii_case("xz")) {
        stem.set_extension("");
    }
    stem.set_extension("png");
    stem
}

fn tell(console: Console, shot: &Shot, kept: &Kept, shots: usize) {
    let samples = words::count(kept.samples, "sample");
    let name = shot.output.display();
    let text = match (kept.interrupted, kept.written) {
        (false, _) => format!("wrote {name}: {samples} a pixel in {}", words::seconds(kept.seconds)),
        (true, true) => format!("interrupted: wrote {name} with {samples} a pixel"),
        (true, false) => "interrupted before the first sample: nothing was written".to_string(),
    };
    console.note(&text);
    if kept.non_finite > 0 {
        let number = words::count(kept.non_finite as f64, "sample");
        console.warn(&format!("{number} of {name} were not finite and are left out (counted as black)"));
    }
    if shots > 1 {
        console
            .event("frame", json!({ "frame": shot.frame, "output": shot.output, "samples": kept.samples }));
    }
    if let (Some(memory), false) = (resources::peak_memory_bytes(), shots > 1) {
        console.note(&format!("peak memory {}", words::bytes(memory)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_named_after_its_scene_in_the_current_folder() {
        assert_eq!(default_output(Path::new("a/bunny.ply.xz")), Path::new("bunny.png"));
        assert_eq!(default_output(Path::new("demo:terrain")), Path::new("terrain.png"));
        assert_eq!(default_output(Path::new("scenes/still-life.toml")), Path::new("still-life.png"));
    }
}
