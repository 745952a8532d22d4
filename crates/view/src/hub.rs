//! Between the threads of the clients and the one that renders: wishes in, the newest pictures and states out.

use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::newest::Newest;
use crate::wire::{Ask, Dropped};

/// Clients at once, at most.
pub(crate) const MAX_CLIENTS: usize = 8;
/// Wishes that wait, at most.
const MAX_ASKS: usize = 256;
/// Answers that wait for one client, at most.
const MAX_REPLIES: usize = 32;

/// Something that a client sent.
#[derive(Debug)]
pub(crate) enum Asked {
    Ask(Ask),
    /// Files that were dropped on the page, and whether they are a picture to compare with.
    Files {
        files: Dropped,
        reference: bool,
    },
}

/// An answer to one client.
#[derive(Clone, Debug)]
pub(crate) enum Reply {
    Text(String),
    Bytes(Vec<u8>),
}

/// What all threads share.
#[derive(Default)]
pub(crate) struct Hub {
    asks: Mutex<VecDeque<(u64, Asked)>>,
    asked: Condvar,
    /// Work is done that somebody waits for.
    woken: AtomicBool,
    /// The sides and the map between them.
    pub(crate) pictures: [Newest<Vec<u8>>; 3],
    pub(crate) state: Newest<String>,
    replies: Mutex<HashMap<u64, VecDeque<Reply>>>,
    /// Who has the controls.
    holder: Mutex<Option<u64>>,
    numbers: AtomicU64,
    stopped: AtomicBool,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Hub {
    /// A new client's number; `None` if there are enough. The first has the controls.
    pub(crate) fn join(&self) -> Option<u64> {
        let mut replies = lock(&self.replies);
        if replies.len() >= MAX_CLIENTS {
            return None;
        }
        let number = 1 + self.numbers.fetch_add(1, Ordering::Relaxed);
        replies.insert(number, VecDeque::new());
        lock(&self.holder).get_or_insert(number);
        Some(number)
    }

    /// A client has gone; the oldest of the others gets its controls.
    pub(crate) fn leave(&self, client: u64) {
        let mut replies = lock(&self.replies);
        replies.remove(&client);
        let mut holder = lock(&self.holder);
        if *holder == Some(client) {
            *holder = replies.keys().min().copied();
        }
    }

    pub(crate) fn clients(&self) -> usize {
        lock(&self.replies).len()
    }

    pub(crate) fn has_controls(&self, client: u64) -> bool {
        *lock(&self.holder) == Some(client)
    }

    pub(crate) fn take_controls(&self, client: u64) {
        *lock(&self.holder) = Some(client);
    }

    /// Hands on what a client asked; false if too much waits already. Motions that follow each other become one.
    pub(crate) fn ask(&self, client: u64, asked: Asked) -> bool {
        let mut asks = lock(&self.asks);
        if let (Some((last, Asked::Ask(before))), Asked::Ask(ask)) = (asks.back_mut(), &asked)
            && *last == client
            && join(before, ask)
        {
            return true;
        }
        if asks.len() >= MAX_ASKS {
            return false;
        }
        asks.push_back((client, asked));
        drop(asks);
        self.asked.notify_all();
        true
    }

    /// Ends the wait for wishes: work is done.
    pub(crate) fn wake(&self) {
        let asks = lock(&self.asks);
        self.woken.store(true, Ordering::Release);
        drop(asks);
        self.asked.notify_all();
    }

    /// Everything that was asked; waits for it, or for work that ends, for so long.
    pub(crate) fn take(&self, wait: Duration) -> VecDeque<(u64, Asked)> {
        let mut asks = lock(&self.asks);
        let is_woken = self.woken.load(Ordering::Acquire);
        if asks.is_empty() && !is_woken && !wait.is_zero() && !self.is_stopped() {
            asks = self.asked.wait_timeout(asks, wait).unwrap_or_else(PoisonError::into_inner).0;
        }
        self.woken.store(false, Ordering::Release);
        std::mem::take(&mut asks)
    }

    /// An answer for one client; dropped if it is gone or does not read.
    pub(crate) fn reply(&self, client: u64, reply: Reply) {
        if let Some(queue) = lock(&self.replies).get_mut(&client).filter(|queue| queue.len() < MAX_REPLIES) {
            queue.push_back(reply);
        }
    }

    /// An answer for whoever has the controls.
    pub(crate) fn reply_to_holder(&self, reply: Reply) {
        let holder = *lock(&self.holder);
        if let Some(client) = holder {
            self.reply(client, reply);
        }
    }

    pub(crate) fn replies_for(&self, client: u64) -> VecDeque<Reply> {
        lock(&self.replies).get_mut(&client).map(std::mem::take).unwrap_or_default()
    }

    pub(crate) fn stop(&self) {
        self.stopped.store(true, Ordering::Release);
        self.asked.notify_all();
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Acquire)
    }
}

/// Adds a motion to the one before it, if both are of one kind.
fn join(before: &mut Ask, ask: &Ask) -> bool {
    match (before, ask) {
        (Ask::Orbit { x, y }, Ask::Orbit { x: dx, y: dy })
        | (Ask::Pan { x, y }, Ask::Pan { x: dx, y: dy })
        | (Ask::Look { x, y }, Ask::Look { x: dx, y: dy }) => {
            (*x, *y) = (*x + dx, *y + dy);
            true
        }
        (Ask::Dolly { by }, Ask::Dolly { by: factor }) => {
            *by *= factor;
            true
        }
        (Ask::Fly { by }, Ask::Fly { by: step }) => {
            by.iter_mut().zip(step).for_each(|(a, b)| *a += b);
            true
        }
        (
            before @ (Ask::Time { .. }
            | Ask::Environment { .. }
            | Ask::Exposure { .. }
            | Ask::FieldOfView { .. }
            | Ask::Aperture { .. }),
            ask,
        ) if std::mem::discriminant(before) == std::mem::discriminant(ask) => {
            *before = ask.clone();
            true
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_become_one_and_wishes_keep_their_order() {
        let hub = Hub::default();
        let me = hub.join().unwrap();
        for _ in 0..1000 {
            assert!(hub.ask(me, Asked::Ask(Ask::Orbit { x: 0.5, y: -0.25 })));
        }
        hub.ask(me, Asked::Ask(Ask::Time { seconds: 1.0 }));
        hub.ask(me, Asked::Ask(Ask::Time { seconds: 2.0 }));
        hub.ask(me, Asked::Ask(Ask::Orbit { x: 1.0, y: 0.0 }));
        let asks: Vec<Asked> = hub.take(Duration::ZERO).into_iter().map(|(_, asked)| asked).collect();
        assert!(matches!(asks[0], Asked::Ask(Ask::Orbit { x: 500.0, y: -250.0 })));
        assert!(matches!(asks[1], Asked::Ask(Ask::Time { seconds: 2.0 })));
        assert_eq!(asks.len(), 3);
    }

    #[test]
    fn what_waits_is_bounded() {
        let hub = Hub::default();
        let clients: Vec<u64> = std::iter::from_fn(|| hub.join()).take(100).collect();
        assert_eq!(clients.len(), MAX_CLIENTS);
        let taken = (0..10_000).filter(|_| hub.ask(clients[0], Asked::Ask(Ask::Keep {}))).count();
        assert_eq!(taken, MAX_ASKS);
        (0..10_000).for_each(|_| hub.reply(clients[1], Reply::Text("x".into())));
        assert_eq!(hub.replies_for(clients[1]).len(), MAX_REPLIES);
        hub.reply(77, Reply::Text("to nobody".into()));
    }

    #[test]
    fn controls_go_to_the_oldest_of_those_that_stay() {
        let hub = Hub::default();
        let (a, b, c) = (hub.join().unwrap(), hub.join().unwrap(), hub.join().unwrap());
        assert!(hub.has_controls(a) && !hub.has_controls(b));
        hub.take_controls(c);
        hub.leave(c);
        assert!(hub.has_controls(a));
        hub.leave(a);
        assert!(hub.has_controls(b));
    }
}
