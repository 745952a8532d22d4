//! Long work: on threads of its own, without the interpreter's lock, while the calling thread listens for Ctrl-C and tells
//! of progress.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use halflight::Progress;
use pyo3::prelude::*;

use crate::errors::{Interrupted, failed, usage};

/// Between two looks at signals and progress: quick to answer a key, too seldom to cost.
const INTERVAL: Duration = Duration::from_millis(40);

/// As many as the command takes.
const MOST_THREADS: usize = 1024;

/// What the work says, and whether it is to stop.
#[derive(Default)]
pub(crate) struct Watch {
    stop: AtomicBool,
    said: Mutex<Option<(String, u64, u64)>>,
}

impl Watch {
    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn ask_to_stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    fn said(&self) -> Option<(String, u64, u64)> {
        self.said.lock().ok()?.take()
    }
}

impl Progress for Watch {
    fn report(&self, what: &str, done: u64, total: u64) {
        // Whoever finds it taken leaves it: another report comes soon.
        if let Ok(mut said) = self.said.try_lock() {
            *said = Some((what.to_string(), done, total));
        }
    }

    fn stop(&self) -> bool {
        self.is_stopped()
    }
}

/// What work has made, and why it was ended before its time: a signal, or an error of the progress function.
pub(crate) struct Outcome<T> {
    pub(crate) result: T,
    pub(crate) trouble: Option<PyErr>,
}

/// Does the work on so many threads (all without a number). `progress(what, done, total)` is called on the calling thread;
/// what it gives back is asked for `False`, which ends the work early.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch) -> T + Send,
) -> PyResult<Outcome<T>> {
    if let Some(threads) = threads.filter(|threads| !(1..=MOST_THREADS).contains(threads)) {
        return Err(usage(format!("threads: expected 1 to {MOST_THREADS}, found {threads}")));
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .build()
        .map_err(|e| failed(format!("cannot start threads: {e}")))?;
    let watch = Watch::default();
    let (done, mut over) = mpsc::channel::<()>();
    let mut trouble = None;
    let result = std::thread::scope(|scope| {
        let (watch, pool) = (&watch, &pool);
        let worker = scope.spawn(move || {
            let result = pool.install(|| work(watch));
            drop(done);
            result
        });
        loop {
            let receiver = &mut over;
            let news = py.detach(move || receiver.recv_timeout(INTERVAL));
            if trouble.is_none() {
                trouble = py.check_signals().and_then(|()| tell(watch, progress)).err();
                if trouble.is_some() {
                    watch.ask_to_stop();
                }
            }
            if news != Err(RecvTimeoutError::Timeout) {
                break;
            }
        }
        py.detach(move || worker.join())
    });
    match result {
        Ok(result) => Ok(Outcome { result, trouble }),
        Err(panic) => std::panic::resume_unwind(panic),
    }
}

fn tell(watch: &Watch, progress: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
    let Some(progress) = progress.filter(|_| !watch.is_stopped()) else { return Ok(()) };
    let Some((what, done, total)) = watch.said() else { return Ok(()) };
    let answer = progress.call1((what, done, total))?;
    if answer.is(pyo3::types::PyBool::new(progress.py(), false)) {
        watch.ask_to_stop();
    }
    Ok(())
}

/// The exception for work that was ended early: of a Ctrl-C one that carries what there was.
pub(crate) fn ended(py: Python<'_>, trouble: PyErr, result: Option<Py<PyAny>>) -> PyErr {
    if !trouble.is_instance_of::<pyo3::exceptions::PyKeyboardInterrupt>(py) {
        return trouble;
    }
    let error = Interrupted::new_err("interrupted; .result holds what there was");
    match error.value(py).setattr("result", result) {
        Ok(()) => error,
        Err(other) => other,
    }
}
