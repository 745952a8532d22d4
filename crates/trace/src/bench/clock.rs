//! Processor time.

use std::time::Instant;

/// Nanoseconds that a task has run, as Linux tells; the first number of its `schedstat`.
fn ran(path: &std::path::Path) -> Option<f64> {
    let text = std::fs::read_to_string(path).ok()?;
    let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(nanoseconds * 1e-9)
}

fn since_start() -> f64 {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// Seconds that this thread has run, up to a scheduler's tick; where the system does not tell, the wall clock.
#[must_use]
pub fn cpu_seconds_of_thread() -> f64 {
    ran(std::path::Path::new("/proc/thread-self/schedstat")).unwrap_or_else(since_start)
}

/// Seconds that all living threads of this process have run; where the system does not tell, the wall clock.
#[must_use]
pub fn cpu_seconds_of_process() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return since_start() };
    let times: Vec<f64> = tasks.flatten().filter_map(|task| ran(&task.path().join("schedstat"))).collect();
    if times.is_empty() { since_start() } else { times.iter().sum() }
}

/// Wall and processor time of a stretch of work.
pub(super) struct Timer {
    wall: Instant,
    cpu: f64,
}

impl Timer {
    pub(super) fn start() -> Timer {
        let cpu = cpu_seconds_of_process();
        Timer { wall: Instant::now(), cpu }
    }

    pub(super) fn stop(self) -> (f64, f64) {
        (self.wall.elapsed().as_secs_f64(), cpu_seconds_of_process() - self.cpu)
    }
}
