//! Signals. Of those that interrupt, the first asks the work to stop soon and keep what is there, the second ends it at
//! once. That a file grew beyond the limit is an error of writing it, which is told like any other.

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

/// From now on, a file beyond the limit on their size (`ulimit -f`) does not end the program: writing it fails, as on a
/// full disk.
pub(crate) fn survive_large_files() {
    #[cfg(unix)]
    {
        // Nobody asks whether it came: to have a handler is enough. Without one, the signal still ends the program.
        let unread = std::sync::Arc::new(AtomicBool::new(false));
        let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, unread);
    }
}

/// Whether a signal has come.
pub(crate) fn is_asked_to_stop() -> bool {
    ASKED_TO_STOP.load(Ordering::Relaxed)
}
