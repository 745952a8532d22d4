//! Interrupt signals: the first asks the work to stop soon and keep what is there, the second ends it at once.

use std::sync::atomic::{AtomicBool, Ordering};

use super::failure::INTERRUPTED;

static ASKED_TO_STOP: AtomicBool = AtomicBool::new(false);

/// Listens for Ctrl-C and for requests to terminate, from now on.
pub(crate) fn listen() {
    // Without a handler the signal ends the program, which is what a user then expects of it.
    let _ = ctrlc::set_handler(|| {
        if ASKED_TO_STOP.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(INTERRUPTED));
        }
        eprintln!("\nstopping; again to stop at once");
    });
}

/// Whether a signal has come.
pub(crate) fn is_asked_to_stop() -> bool {
    ASKED_TO_STOP.load(Ordering::Relaxed)
}
