//! Looks through every pixel, one after another: the loop of the techniques that shade visible points.

use std::time::{Duration, Instant};

use glam::{Vec2, Vec3};
use halflight_scene::Frame;

use crate::film::{Film, Region};
use crate::gbuffer::{GBuffer, Room};
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
    /// What each took, in the order in which they came.
    pub(crate) fn into_times(self) -> Vec<(&'static str, Duration)> {
        self.0
    }

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
}

/// Adds looks to the film until the budget is spent, each the picture that `shade` makes of what is visible, and puts
/// into the report what they took. What is visible outside of `region` is not asked for.
pub(crate) fn add_looks(
    frame: &Frame,
    (film, region): (&mut Film, Region),
    (budget, deadline): (&Budget, &Deadline),
    progress: &dyn Progress,
    (report, stages): (&mut RenderReport, Stages),
    room: &Room,
    mut shade: impl FnMut(&GBuffer, &mut Stages) -> Vec<Vec3>,
) {
    report.notes.extend(left_out(frame));
    each_look(
        film,
        (budget, deadline),
        (DEFAULT_SAMPLES, MAX_SAMPLES),
        progress,
        (report, stages),
        |size, offset, _, stages| {
            let view = stages.time("g-buffer", || GBuffer::look(frame, size, region, offset, room));
            let rays = view.pixels.len() as u64;
            let picture = shade(&view, stages);
            view.leave(room);
            (picture, rays)
        },
    );
}

/// What a g-buffer shows of a camera's lens and shutter, if that is less than there is.
fn left_out(frame: &Frame) -> Option<String> {
    let lens = frame.camera.aperture_radius > 0.0;
    let what = match (lens, frame.shutter_is_open()) {
        (false, false) => return None,
        (true, false) => "the lens counts as a pinhole",
        (false, true) => "the shutter counts as the moment it opens",
        (true, true) => "the lens counts as a pinhole, the shutter as the moment it opens",
    };
    Some(format!("{what}: nothing is blurred (path and covariance blur)"))
}

/// The loop of [`add_looks`], for techniques with a g-buffer of their own: `look` is given the size of the picture, the
/// point of the pixels to look through, the number of the look and the stages, and gives the picture and its rays. Looks are
/// as many as the budget says, `default` if nothing limits them, at most `most`. A look may be left half-done once
/// [`Progress::unwanted`] says so.
pub(crate) fn each_look(
    film: &mut Film,
    (budget, deadline): (&Budget, &Deadline),
    (default, most): (u32, u32),
    progress: &dyn Progress,
    (report, mut stages): (&mut RenderReport, Stages),
    mut look: impl FnMut([usize; 2], Vec2, u32, &mut Stages) -> (Vec<Vec3>, u64),
) {
    let target = budget.samples.unwrap_or(default).clamp(1, most);
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
        let (picture, rays) = look([film.width(), film.height()], offset, sample, &mut stages);
        report.rays += rays;
        if progress.unwanted() {
            // It may be half-done.
            report.interrupted = true;
            break;
        }
        report.non_finite += stages.time("film", || film.add_picture(&picture));
        progress.report("samples", u64::from(sample + 1), u64::from(target));
        progress.pass(film);
    }
    report.elapsed = deadline.elapsed();
    report.stages = stages.0;
}
