//! How far the work is, on a terminal, in a log or for a program; and the checkpoints that are written on the way.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

use halflight_render::{Budget, Film, Progress, checkpoint};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle as BarStyle};
use serde_json::json;

use super::console::{self, Console, ProgressStyle};
use super::{interrupt, words};

/// Between two redraws of the bar, and between two events: fast enough to look alive.
const BAR_INTERVAL: Duration = Duration::from_millis(100);
const JSON_INTERVAL: Duration = Duration::from_millis(500);
/// Between two lines of a log: it should stay readable over hours.
const LINE_INTERVAL: Duration = Duration::from_secs(5);
/// Steps of the bar.
const BAR_STEPS: u64 = 1000;

/// Where and how often the film is saved.
#[derive(Debug)]
pub(crate) struct Checkpoint {
    pub(crate) path: PathBuf,
    pub(crate) identity: String,
    pub(crate) every: Duration,
}

/// Watches one render.
pub(crate) struct Meter<'a> {
    console: Console,
    style: ProgressStyle,
    title: String,
    budget: Budget,
    checkpoint: Option<&'a Checkpoint>,
    start: Instant,
    /// Milliseconds since the start when progress was last shown.
    shown_at: AtomicU64,
    /// The fraction done when this run began, which is not this run's merit.
    first: OnceLock<f64>,
    bar: Option<ProgressBar>,
    state: Mutex<State>,
}

/// What is known between passes.
struct State {
    samples: u32,
    error: Option<f64>,
    error_at: Instant,
    saved_at: Instant,
    save_failed: bool,
}

impl<'a> Meter<'a> {
    /// Starts the clock. `title` says what is being made: `frame 12`.
    pub(crate) fn new(
        console: Console,
        title: &str,
        budget: &Budget,
        checkpoint: Option<&'a Checkpoint>,
    ) -> Self {
        let style = console.progress_style();
        let now = Instant::now();
        let state = State { samples: 0, error: None, error_at: now, saved_at: now, save_failed: false };
        Self {
            console,
            style,
            title: title.into(),
            budget: budget.clone(),
            checkpoint,
            start: now,
            shown_at: AtomicU64::new(0),
            first: OnceLock::new(),
            bar: (style == ProgressStyle::Bar).then(new_bar),
            state: Mutex::new(state),
        }
    }

    /// Clears the bar away.
    pub(crate) fn finish(self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    /// Whether this thread is the one to show progress now.
    fn is_due(&self) -> bool {
        let interval = match self.style {
            ProgressStyle::None => return false,
            ProgressStyle::Bar => BAR_INTERVAL,
            ProgressStyle::Lines => LINE_INTERVAL,
            ProgressStyle::Json => JSON_INTERVAL,
        };
        let now = self.start.elapsed().as_millis() as u64;
        let last = self.shown_at.load(Ordering::Relaxed);
        now >= last + interval.as_millis() as u64
            && self.shown_at.compare_exchange(last, now, Ordering::Relaxed, Ordering::Relaxed).is_ok()
    }

    fn show(&self, what: &str, done: u64, total: u64) {
        let Ok(state) = self.state.lock() else { return };
        let elapsed = self.start.elapsed().as_secs_f64();
        let of_steps = done as f64 / total.max(1) as f64;
        let first = self.first.get().copied().unwrap_or(of_steps);
        let share = Share {
            of_steps,
            first,
            elapsed,
            error: state.error,
            samples_are_limit: self.samples_are_limit(),
        };
        let fraction = share.fraction(&self.budget).clamp(0.0, 1.0);
        let left = share.seconds_left(&self.budget);
        match self.style {
            ProgressStyle::None => {}
            ProgressStyle::Bar => {
                if let Some(bar) = &self.bar {
                    bar.set_position((fraction * BAR_STEPS as f64) as u64);
                    bar.set_prefix(self.title.clone());
                    bar.set_message(self.sentence(&state, what, elapsed, left));
                }
            }
            ProgressStyle::Lines => self.console.note(&format!(
                "{}: {:.0} %, {}",
                self.title,
                100.0 * fraction,
                self.sentence(&state, what, elapsed, left)
            )),
            ProgressStyle::Json => console::line(
                std::io::stdout(),
                &console::event_line(
                    "progress",
                    json!({
                        "title": self.title, "what": what, "fraction": fraction, "samples": state.samples,
                        "relative_error": state.error, "seconds": elapsed, "seconds_left": left,
                    }),
                ),
            ),
        }
    }

    fn samples_are_limit(&self) -> bool {
        self.budget.samples.is_some() || (self.budget.seconds.is_none() && self.budget.error.is_none())
    }

    fn sentence(&self, state: &State, what: &str, elapsed: f64, left: Option<f64>) -> String {
        let mut text = match what {
            "samples" => format!("{} a pixel", words::count(f64::from(state.samples), "sample")),
            other => other.to_string(),
        };
        if let Some(error) = state.error {
            text += &format!(", error {}", words::figure(error));
        }
        text += &format!(", {}", words::seconds(elapsed));
        if let Some(left) = left {
            text += &format!(", about {} left", words::seconds(left));
        }
        text
    }

    /// Saves the film if it is time to; a failure is told once and the render goes on.
    fn save_if_due(&self, state: &mut State, film: &Film) {
        let Some(checkpoint) = self.checkpoint else { return };
        if state.saved_at.elapsed() < checkpoint.every {
            return;
        }
        if let Err(error) = checkpoint::save(&checkpoint.path, &checkpoint.identity, film)
            && !std::mem::replace(&mut state.save_failed, true)
        {
            self.console.warn(&format!("{error}; the render goes on without"));
        }
        state.saved_at = Instant::now();
    }
}

impl Progress for Meter<'_> {
    fn report(&self, what: &str, done: u64, total: u64) {
        self.first.get_or_init(|| done as f64 / total.max(1) as f64);
        if self.is_due() {
            self.show(what, done, total);
        }
    }

    fn stop(&self) -> bool {
        interrupt::is_asked_to_stop()
    }

    fn pass(&self, film: &Film) {
        /// The error costs a walk over the film.
        const ERROR_INTERVAL: Duration = Duration::from_secs(1);
        let Ok(mut state) = self.state.lock() else { return };
        state.samples = film.min_samples();
        if self.budget.error.is_some() && (state.error.is_none() || state.error_at.elapsed() > ERROR_INTERVAL)
        {
            state.error = film.relative_error();
            state.error_at = Instant::now();
        }
        self.save_if_due(&mut state, film);
    }
}

fn new_bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(BAR_STEPS), ProgressDrawTarget::stderr());
    // The template is a constant; should it ever be wrong, the default bar does.
    if let Ok(style) = BarStyle::with_template("{prefix} {bar:32} {percent:>3} % {wide_msg}") {
        bar.set_style(style.progress_chars("━╸─"));
    }
    bar
}

/// What can be known of the way there is to go.
struct Share {
    /// Steps done of all.
    of_steps: f64,
    /// The same when the run began.
    first: f64,
    elapsed: f64,
    error: Option<f64>,
    samples_are_limit: bool,
}

impl Share {
    /// Done, by whichever limit is nearest to end the work.
    fn fraction(&self, budget: &Budget) -> f64 {
        let by_samples = if self.samples_are_limit { self.of_steps } else { 0.0 };
        let by_time = budget.seconds.map_or(0.0, |limit| self.elapsed / limit);
        by_samples.max(by_time).max(self.by_error(budget).unwrap_or(0.0))
    }

    /// The error falls with the square root of the work.
    fn by_error(&self, budget: &Budget) -> Option<f64> {
        Some((budget.error? / self.error?).powi(2))
    }

    fn seconds_left(&self, budget: &Budget) -> Option<f64> {
        let work = self.of_steps - self.first;
        let by_samples =
            (self.samples_are_limit && work > 0.0).then(|| self.elapsed * (1.0 - self.of_steps) / work);
        let by_time = budget.seconds.map(|limit| limit - self.elapsed);
        let by_error = self.by_error(budget).map(|done| self.elapsed * (1.0 / done - 1.0));
        let nearest = [by_samples, by_time, by_error].into_iter().flatten().fold(f64::INFINITY, f64::min);
        nearest.is_finite().then_some(nearest.max(0.0))
    }
}

/// Shows nothing, and stops when asked to.
pub(crate) fn silent() -> Meter<'static> {
    Meter::new(Console::new(true, false), "", &Budget::default(), None)
}

/// Saves a finished or interrupted film, so that it can be gone on with.
pub(crate) fn save_checkpoint(checkpoint: &Checkpoint, film: &Film) -> Result<(), halflight_file::SaveError> {
    checkpoint::save(&checkpoint.path, &checkpoint.identity, film)
}

/// The film of a checkpoint in place of an empty one, or `None` if there is no such file yet.
pub(crate) fn load_checkpoint(
    path: &Path,
    identity: &str,
    film: Film,
) -> Result<Option<Film>, halflight_file::LoadError> {
    if !path.exists() {
        return Ok(None);
    }
    checkpoint::load_into(path, identity, film).map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn share(of_steps: f64, elapsed: f64, error: Option<f64>) -> Share {
        Share { of_steps, first: 0.0, elapsed, error, samples_are_limit: true }
    }

    #[test]
    fn the_nearest_limit_tells_the_time_left() {
        let budget = Budget { samples: Some(64), seconds: Some(10.0), ..Budget::default() };
        assert_eq!(share(0.5, 2.0, None).seconds_left(&budget), Some(2.0));
        assert_eq!(share(0.1, 4.0, None).seconds_left(&budget), Some(6.0));
        assert_eq!(share(0.1, 4.0, None).fraction(&budget), 0.4);
    }

    #[test]
    fn half_the_error_takes_four_times_the_work() {
        let budget = Budget { error: Some(0.01), ..Budget::default() };
        let share = Share { samples_are_limit: false, ..share(0.0, 5.0, Some(0.02)) };
        assert!((share.seconds_left(&budget).unwrap() - 15.0).abs() < 1e-9);
        assert!((share.fraction(&budget) - 0.25).abs() < 1e-9);
    }

    #[test]
    fn a_resumed_run_is_timed_from_where_it_began() {
        let share = Share { first: 0.5, ..share(0.75, 3.0, None) };
        assert_eq!(share.seconds_left(&Budget::default()), Some(3.0));
    }
}
