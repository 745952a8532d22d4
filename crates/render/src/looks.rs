//! Looks through every pixel, one after another: the loop of the techniques that shade visible points.

use std::time::{Duration, Instant};

use glam::{Vec2, Vec3};
use halflight_scene::Frame;

use crate::film::Film;
use crate::gbuffer::GBuffer;
use crate::sampler::Sampler;
use crate::technique::{Budget, Deadline, Progress, RenderReport};

/// Looks when nothing limits the work: enough for smooth edges.
const DEFAULT_SAMPLES: u32 = 4;
/// More change nothing that shows.
const MAX_SAMPLES: u32 = 64;

/// Wall time by stage, summed.
#[derive(Default)]
pub(crate) struct Stages(Vec<(&'static str, Duration)>);

impl Stages {
    pub(crate) fn time<T>(&mut self, stage: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        let taken = start.elapsed();
        match self.0.iter_mut().find(|(name, _)| *name == stage) {
            Some((_, sum)) => *sum += taken,
            None => self.0.push((stage, taken)),
        }
        result
    }

    /// The stages in the order in which they came first.
    pub(crate) fn into_list(self) -> Vec<(&'static str, Duration)> {
        self.0
    }
}

/// Adds looks to the film until the budget is spent, each the picture that `shade` makes of what is visible, and puts
/// into the report what they took.
pub(crate) fn add_looks(
    frame: &Frame,
    film: &mut Film,
    (budget, deadline): (&Budget, &Deadline),
    progress: &dyn Progress,
    (report, mut stages): (&mut RenderReport, Stages),
    mut shade: impl FnMut(&GBuffer, &mut Stages) -> Vec<Vec3>,
) {
    let target = budget.samples.unwrap_or(DEFAULT_SAMPLES).clamp(1, MAX_SAMPLES);
    for sample in film.min_samples()..target {
        if progress.stop() {
            report.interrupted = true;
            break;
        }
        if deadline.passed() && sample > 0 {
            break;
        }
        let offset = if target == 1 {
            Vec2::splat(0.5)
        } else {
            // The same point in every pixel, so that neighbours stay comparable.
            let u = Sampler::new(budget.seed, 0, 0, sample).next_four();
            Vec2::new(u[0], u[1])
        };
        let view = stages.time("g-buffer", || GBuffer::look(frame, film.width(), film.height(), offset));
        report.rays += view.pixels.len() as u64;
        let picture = shade(&view, &mut stages);
        report.non_finite += stages.time("film", || film.add_picture(&picture));
        progress.report("samples", u64::from(sample + 1), u64::from(target));
        progress.pass(film);
    }
    report.elapsed = deadline.elapsed();
    report.stages = stages.0;
}
