//! Work on a thread of its own: preparing a technique and filling a film, while the page stays at hand.
//!
//! A job owns what it works with and gives it back when it is done. Told to stop, it ends where the technique looks
//! (between tiles, samples, rays of the preparation); one that is dropped is told to stop as well, and what comes of it
//! goes nowhere. So a technique that never looks costs processor time for a while, but no hand waits for it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use halflight_render::{Budget, Film, Progress, RenderReport, Technique};
use halflight_scene::Frame;

use crate::Stage;
use crate::hub::Hub;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A coarse picture while something moves; it is finished, as pictures have to be seen.
    Sketch,
    /// The picture at rest, from so many samples on.
    Refine { before: u32 },
}

/// What is to be done.
pub(crate) struct Order {
    /// The technique, and whether it is prepared.
    pub(crate) technique: (Box<dyn Technique>, bool),
    pub(crate) film: Film,
    pub(crate) budget: Budget,
    pub(crate) stage: Arc<Stage>,
    pub(crate) frame: Arc<Frame>,
}

/// What was done.
pub(crate) struct Done {
    /// Absent if it was told to stop before it was prepared.
    pub(crate) technique: Option<Box<dyn Technique>>,
    pub(crate) film: Film,
    pub(crate) outcome: Result<RenderReport, String>,
    /// Of filling the film, without what was prepared.
    pub(crate) seconds: f64,
}

/// Work that goes on.
pub(crate) struct Job {
    pub(crate) kind: Kind,
    pub(crate) begun: Instant,
    told: Arc<Told>,
    receiver: Receiver<Done>,
}

/// What is said between the job and who waits for it.
#[derive(Default)]
struct Told {
    cancelled: AtomicBool,
    prepares: AtomicBool,
    /// What is under way, done of total.
    stage: Mutex<Option<(String, u64, u64)>>,
}

impl Progress for Told {
    fn report(&self, what: &str, done: u64, total: u64) {
        let mut stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        match &mut *stage {
            Some((known, known_done, known_total)) if known == what => {
                (*known_done, *known_total) = (done, total);
            }
            other => *other = Some((what.into(), done, total)),
        }
    }

    fn stop(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Of a picture that is looked at what has moved since is of no use.
    fn unwanted(&self) -> bool {
        self.stop()
    }
}

impl Job {
    pub(crate) fn start(kind: Kind, order: Order, hub: Arc<Hub>) -> Result<Self, String> {
        let told = Arc::new(Told::default());
        let (sender, receiver) = channel();
        let says = Arc::clone(&told);
        let work = move || {
            // The thread that waits finds the channel closed if this one panics.
            let outcome = catch_unwind(AssertUnwindSafe(|| work(order, &says)));
            if let Ok(done) = outcome {
                let _ = sender.send(done);
            }
            hub.wake();
        };
        std::thread::Builder::new()
            .name("viewer work".into())
            .spawn(work)
            .map_err(|error| format!("cannot start a thread: {error}"))?;
        Ok(Self { kind, begun: Instant::now(), told, receiver })
    }

    pub(crate) fn cancel(&self) {
        self.told.cancelled.store(true, Ordering::Relaxed);
    }

    pub(crate) fn prepares(&self) -> bool {
        self.told.prepares.load(Ordering::Relaxed)
    }

    /// What is under way, in words.
    pub(crate) fn told(&self) -> String {
        match &*self.told.stage.lock().unwrap_or_else(PoisonError::into_inner) {
            Some((what, done, total)) if *total > 0 && what != "samples" => {
                format!("{what}, {:.0} %", 100.0 * (*done as f64 / *total as f64).min(1.0))
            }
            _ => String::new(),
        }
    }

    /// What was done; `None` while it goes on.
    pub(crate) fn done(&self) -> Option<Result<Done, String>> {
        match self.receiver.try_recv() {
            Ok(done) => Some(Ok(done)),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err("the technique broke off: this is a bug".into())),
        }
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        self.cancel();
    }
}

fn work(order: Order, told: &Told) -> Done {
    let Order { technique: (mut technique, is_prepared), mut film, budget, stage, frame } = order;
    if !is_prepared {
        told.prepares.store(true, Ordering::Relaxed);
        let prepared = technique.prepare(&stage.scene, told);
        told.prepares.store(false, Ordering::Relaxed);
        if let Err(error) = prepared {
            return Done { technique: None, film, outcome: Err(error.to_string()), seconds: 0.0 };
        }
        if told.stop() {
            // It may have been stopped half-way, and is made again.
            let report = RenderReport { interrupted: true, ..RenderReport::default() };
            return Done { technique: None, film, outcome: Ok(report), seconds: 0.0 };
        }
    }
    let begun = Instant::now();
    let outcome = technique.render(&frame, &mut film, &budget, told).map_err(|error| error.to_string());
    Done { technique: Some(technique), film, outcome, seconds: begun.elapsed().as_secs_f64() }
}
