//! Processor time of `path` to the error that another renderer has after 64 samples.
//!
//! The picture is rendered with 4, 16, 64 … samples, going on from the one before, until its relMSE (less the noise of
//! the reference) is below the goal; the time to the goal is interpolated on logarithmic axes.

use std::path::Path;

use halflight_image::load_rgb;
use halflight_image::metrics::{relative_mse, without_noise};
use halflight_render::{Budget, Film};

use super::{BenchArgs, Findings};
use crate::command::failure::Failure;
use crate::command::progress::silent;
use crate::command::stage::{self, SceneArgs};
use crate::command::table::Table;
use crate::command::techniques::{self, TechniqueSpec};
use crate::command::{interrupt, resources, words};

/// A picture made by another renderer.
struct Reference {
    /// The scene file and the picture are called so.
    name: &'static str,
    max_depth: u32,
    /// relMSE of the picture's own noise.
    noise: f64,
    /// relMSE to reach: Mitsuba's with 64 samples (multijitter where it was measured so).
    goal: f64,
}

const REFERENCES: [Reference; 5] = [
    Reference { name: "bunny_diffuse.direct", max_depth: 1, noise: 1.0e-4, goal: 5.5e-4 },
    Reference { name: "bunny_diffuse.path8", max_depth: 7, noise: 9.5e-5, goal: 4.7e-3 },
    Reference { name: "bunny_merlfile.direct", max_depth: 1, noise: 3.8e-4, goal: 8.8e-3 },
    Reference { name: "hf25_coneman.direct", max_depth: 1, noise: 3.2e-5, goal: 2.3e-3 },
    Reference { name: "dof_row.direct", max_depth: 1, noise: 1.8e-4, goal: 6.0e-3 },
];

/// More samples than this are not tried.
const MOST_SAMPLES: u32 = 1024;

pub(super) fn measure(args: &BenchArgs) -> Result<Findings, Failure> {
    let mut table =
        Table::new(["scene", "goal relMSE", "CPU s to goal", "samples", "reached", "CPU s", "CPU s at 64"]);
    let mut notes = Vec::new();
    for reference in &REFERENCES {
        let (stem, _) = reference.name.split_once('.').unwrap_or((reference.name, ""));
        let scene = [reference.name, stem].map(|name| args.scenes.join(format!("{name}.toml")));
        let picture = args.data.join("reference").join(format!("{}.exr", reference.name));
        let Some(scene) = scene.iter().find(|path| path.exists()) else {
            notes.push(format!("skipped {}: there is no {}", reference.name, scene[0].display()));
            continue;
        };
        if !picture.exists() {
            notes.push(format!("skipped {}: there is no {}", reference.name, picture.display()));
            continue;
        }
        table.row(race(args, reference, scene, &picture)?);
        if args.quick || interrupt::is_asked_to_stop() {
            break;
        }
    }
    notes.push(
        "relMSE less the reference's own noise; processor time of rendering, all threads, without loading"
            .into(),
    );
    Ok(Findings { title: "Time to a given error", table, notes })
}

fn race(args: &BenchArgs, goal: &Reference, scene: &Path, picture: &Path) -> Result<Vec<String>, Failure> {
    let truth = load_rgb(picture)?;
    let stage = stage::load(scene, &SceneArgs::default(), &args.machine)?;
    let settings = vec![format!("max_depth={}", goal.max_depth)];
    let spec = TechniqueSpec { name: "path".into(), settings };
    let technique = techniques::create(&spec, &stage)?.technique;
    let frame = stage.frame(0.0)?;
    let mut film = Film::new(truth.width, truth.height);
    let (mut cpu, mut at_64) = (0.0, None);
    // Samples, processor time and error of the budget before and of this one.
    let mut curve: Vec<[f64; 3]> = Vec::new();
    let mut samples = 4;
    loop {
        let before = resources::cpu_seconds();
        let report = technique.render(
            &frame,
            &mut film,
            &Budget { samples: Some(samples), ..Budget::default() },
            &silent(),
        )?;
        let used = before.zip(resources::cpu_seconds()).map(|(before, after)| after - before);
        cpu += used.unwrap_or(report.elapsed.as_secs_f64());
        let error = without_noise(relative_mse(&film.image(), &truth)?, goal.noise);
        curve.push([f64::from(samples), cpu, error]);
        if samples == 64 {
            at_64 = Some(cpu);
        }
        if error <= goal.goal || samples >= MOST_SAMPLES || args.quick || interrupt::is_asked_to_stop() {
            break;
        }
        samples *= 4;
    }
    let [samples, cpu, error] = curve[curve.len() - 1];
    let reached = (error <= goal.goal).then(|| time_to(goal.goal, &curve));
    let or_dash = |x: Option<f64>| x.map_or_else(|| "–".to_string(), words::figure);
    Ok(vec![
        goal.name.to_string(),
        words::figure(goal.goal),
        or_dash(reached),
        words::figure(samples),
        words::figure(error),
        words::figure(cpu),
        or_dash(at_64),
    ])
}

/// Where the last stretch of the curve crosses the goal.
fn time_to(goal: f64, curve: &[[f64; 3]]) -> f64 {
    let [.., [_, cpu_before, error_before], [_, cpu, error]] = curve else { return curve[0][1] };
    // An error within the noise of the reference has no logarithm.
    if *error <= 0.0 || error_before <= error {
        return *cpu;
    }
    let share = (error_before / goal).ln() / (error_before / error).ln();
    cpu_before * (cpu / cpu_before).powf(share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_to_the_goal_lies_between_two_budgets() {
        let curve = [[4.0, 1.0, 0.04], [16.0, 4.0, 0.01]];
        assert!((time_to(0.02, &curve) - 2.0).abs() < 1e-9);
        assert_eq!(time_to(0.05, &curve[..1]), 1.0);
    }
}
