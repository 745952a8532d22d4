//! The newest of something, for readers that may be slow: what they miss is dropped, never queued.

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// A place for the newest value, with a number that grows with each.
pub(crate) struct Newest<T> {
    held: Mutex<(u64, Option<Arc<T>>)>,
    changed: Condvar,
}

impl<T> Default for Newest<T> {
    fn default() -> Self {
        Self { held: Mutex::new((0, None)), changed: Condvar::new() }
    }
}

impl<T> Newest<T> {
    /// Puts a value in the place of the one before.
    pub(crate) fn put(&self, value: T) {
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        *held = (held.0 + 1, Some(Arc::new(value)));
        drop(held);
        self.changed.notify_all();
    }

    /// The newest value, if it is newer than number `seen`, which becomes its number. Waits for it for so long.
    pub(crate) fn after(&self, seen: &mut u64, wait: Duration) -> Option<Arc<T>> {
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        if held.0 <= *seen && !wait.is_zero() {
            held = self.changed.wait_timeout(held, wait).unwrap_or_else(PoisonError::into_inner).0;
        }
        if held.0 <= *seen {
            return None;
        }
        *seen = held.0;
        held.1.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_reader_gets_the_last_and_misses_the_others() {
        let (newest, mut seen) = (Newest::default(), 0);
        assert_eq!(newest.after(&mut seen, Duration::ZERO), None);
        (1..=5).for_each(|i| newest.put(i));
        assert_eq!(newest.after(&mut seen, Duration::ZERO).as_deref(), Some(&5));
        assert_eq!(newest.after(&mut seen, Duration::from_millis(1)), None);
    }
}
