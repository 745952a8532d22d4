//! Timing on a machine that others may use too.

use std::time::Instant;

use crate::command::resources;

/// What a repeated piece of work took, each time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timing {
    /// Median wall time in seconds.
    pub(super) wall: f64,
    /// Mean processor time of all threads in seconds; the wall time where the system does not tell.
    pub(super) cpu: f64,
}

/// Rounds of which the median is taken.
const ROUNDS: usize = 3;

/// Repeats the work until each of three rounds has lasted `seconds`, which must be long against the hundredth of a
/// second in which processor time is counted.
pub(super) fn time(seconds: f64, mut work: impl FnMut()) -> Timing {
    work();
    let (mut walls, mut cpus) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let (start, cpu_start) = (Instant::now(), resources::cpu_seconds());
        let mut repetitions = 0.0;
        while repetitions == 0.0 || start.elapsed().as_secs_f64() < seconds {
            work();
            repetitions += 1.0;
        }
        let wall = start.elapsed().as_secs_f64();
        let cpu = cpu_start.zip(resources::cpu_seconds()).map_or(wall, |(before, after)| after - before);
        walls.push(wall / repetitions);
        cpus.push(if cpu > 0.0 { cpu } else { wall } / repetitions);
    }
    Timing { wall: median(walls), cpu: median(cpus) }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Runs the work on that many threads of its own.
pub(super) fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T, String> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    Ok(pool.map_err(|e| format!("cannot start {threads} threads: {e}"))?.install(work))
}
