//! What a technique is, and what it is told and says while it works.

use std::time::{Duration, Instant};

use halflight_scene::{Frame, Scene};

use crate::film::Film;

/// A way to turn one instant of a scene into radiance.
pub trait Technique: Send {
    /// Work that outlives a frame: transfer vectors, tables, fields. Called once, and again when the scene itself changes.
    ///
    /// # Errors
    /// If the technique cannot show this scene at all.
    fn prepare(&mut self, scene: &Scene, progress: &dyn Progress) -> Result<(), TechniqueError> {
        let (_, _) = (scene, progress);
        Ok(())
    }

    /// Whether a part of a film takes but its share of the time of the whole. Where not, the technique works on the whole
    /// picture and keeps what the film is of; the bits are the same either way.
    fn divides(&self) -> bool {
        false
    }

    /// Goes on filling the film for one instant until the budget is spent or the progress says to stop. The same
    /// inputs give the same bits, whatever the number of threads.
    ///
    /// # Errors
    /// If the technique cannot show this frame; an interrupted one is not an error.
    fn render(
        &self,
        frame: &Frame,
        film: &mut Film,
        budget: &Budget,
        progress: &dyn Progress,
    ) -> Result<RenderReport, TechniqueError>;
}

/// When to stop. The first limit that is reached ends the work.
#[derive(Clone, Debug, Default)]
pub struct Budget {
    /// Samples a pixel.
    pub samples: Option<u32>,
    /// Seconds of wall time.
    pub seconds: Option<f64>,
    /// Estimated relative error, see [`Film::relative_error`].
    pub error: Option<f64>,
    /// Chooses another set of random numbers.
    pub seed: u64,
}

/// Told how far the work is, and asked whether to go on. Called from any thread, many times a second.
pub trait Progress: Sync {
    /// `done` of `total` steps of the thing named `what` are done.
    fn report(&self, what: &str, done: u64, total: u64) {
        let (_, _, _) = (what, done, total);
    }

    /// Whether to stop early and keep what is there.
    fn stop(&self) -> bool {
        false
    }

    /// Whether nobody wants what is under way any more: a technique may leave it half-done, and adds none of it to the film.
    /// Once true it stays true.
    fn unwanted(&self) -> bool {
        false
    }

    /// A moment between passes when the film is consistent, for checkpoints and previews.
    fn pass(&self, film: &Film) {
        let _ = film;
    }
}

/// A progress that says nothing and never stops.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quiet;

impl Progress for Quiet {}

/// Why a technique cannot show a scene.
#[derive(Clone, Debug, thiserror::Error)]
#[error("the technique `{technique}` cannot show this scene: {reason}")]
pub struct TechniqueError {
    /// Its name.
    pub technique: &'static str,
    /// What it cannot do, and what to try.
    pub reason: String,
}

/// What a call of [`Technique::render`] did.
#[derive(Clone, Debug, Default)]
pub struct RenderReport {
    /// Wall time it took.
    pub elapsed: Duration,
    /// Rays that were traced, of any kind.
    pub rays: u64,
    /// Samples that were not finite and were kept out.
    pub non_finite: u64,
    /// Whether it was told to stop before its budget was spent.
    pub interrupted: bool,
    /// Estimated relative error at the end, if there were samples enough to tell.
    pub relative_error: Option<f64>,
    /// Approximations in force and what was left out, in words for the user.
    pub notes: Vec<String>,
    /// Wall time of the stages of the work, summed over samples, in the order in which they come; empty for techniques
    /// that have but one.
    pub stages: Vec<(&'static str, Duration)>,
}

/// A deadline that may be absent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deadline {
    start: Instant,
    end: Option<Instant>,
}

impl Deadline {
    pub(crate) fn new(seconds: Option<f64>) -> Self {
        let start = Instant::now();
        // A limit too long for the clock is no limit.
        let limit = seconds.and_then(|s| Duration::try_from_secs_f64(s.max(0.0)).ok());
        Self { start, end: limit.and_then(|l| start.checked_add(l)) }
    }

    pub(crate) fn passed(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }

    pub(crate) fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }
}
