//! Streams that can be looked at while they run: the latest state and answer of each, kept only while somebody looks.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::time::Instant;

use crate::metrics::Transport;
use wade_wire::proto;

/// Shortest time between two answers that are kept: what a person sees.
const EVERY: Duration = Duration::from_millis(20);

/// A stream that nobody has looked at for so long keeps nothing.
const LOOKED_AT: Duration = Duration::from_secs(2);

/// The streams that are open.
#[derive(Debug, Default)]
pub struct Taps {
    streams: Mutex<BTreeMap<u64, Arc<Tap>>>,
    last_id: AtomicU64,
}

/// One of them.
#[derive(Debug)]
pub struct Tap {
    /// Its number; the next stream has a greater one.
    pub id: u64,
    /// What it came by.
    pub transport: Transport,
    /// When it was opened.
    pub since: Instant,
    /// Whether somebody looks.
    watched: AtomicBool,
    kept: Mutex<Kept>,
}

#[derive(Debug, Default)]
struct Kept {
    looked: Option<Instant>,
    seen: Option<Seen>,
}

/// A state and its answer.
#[derive(Debug, Clone)]
pub struct Seen {
    /// When it was answered.
    pub at: Instant,
    /// The vehicle.
    pub vehicle: String,
    /// What was asked.
    pub state: proto::State,
    /// What was answered.
    pub answer: proto::EvaluateResponse,
}

/// A stream's own end: it leaves the list when it is dropped.
#[derive(Debug)]
pub struct Tapped {
    taps: Arc<Taps>,
    tap: Arc<Tap>,
    kept_at: Option<Instant>,
}

impl Taps {
    /// Lists a stream until what this gives is dropped.
    pub fn open(self: &Arc<Self>, transport: Transport) -> Tapped {
        let id = self.last_id.fetch_add(1, Ordering::Relaxed) + 1;
        let (watched, kept) = (AtomicBool::new(false), Mutex::default());
        let tap = Arc::new(Tap { id, transport, since: Instant::now(), watched, kept });
        locked(&self.streams).insert(id, Arc::clone(&tap));
        Tapped { taps: Arc::clone(self), tap, kept_at: None }
    }

    /// The streams that are open, the oldest first.
    pub fn list(&self) -> Vec<Arc<Tap>> {
        locked(&self.streams).values().cloned().collect()
    }

    /// The stream of this number.
    pub fn find(&self, id: u64) -> Option<Arc<Tap>> {
        locked(&self.streams).get(&id).cloned()
    }
}

impl Tap {
    /// The latest state and answer, and from now on the ones after it; none before the next answer where nobody has looked before.
    pub fn look(&self) -> Option<Seen> {
        let mut kept = locked(&self.kept);
        kept.looked = Some(Instant::now());
        self.watched.store(true, Ordering::Relaxed);
        kept.seen.clone()
    }
}

impl Tapped {
    /// Keeps what `seen` gives where somebody looks and the time has come; else costs a load.
    pub fn offer(&mut self, seen: impl FnOnce() -> Seen) {
        if !self.tap.watched.load(Ordering::Relaxed) {
            return;
        }
        let seen_at = Instant::now();
        if self.kept_at.is_some_and(|before| seen_at.duration_since(before) < EVERY) {
            return;
        }
        self.kept_at = Some(seen_at);
        let mut kept = locked(&self.tap.kept);
        if kept.looked.is_some_and(|looked| seen_at.duration_since(looked) < LOOKED_AT) {
            kept.seen = Some(seen());
        } else {
            kept.seen = None;
            self.tap.watched.store(false, Ordering::Relaxed);
        }
    }
}

impl Drop for Tapped {
    fn drop(&mut self) {
        locked(&self.taps.streams).remove(&self.tap.id);
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen() -> Seen {
        Seen {
            at: Instant::now(),
            vehicle: "husky".into(),
            state: proto::State::default(),
            answer: proto::EvaluateResponse::default(),
        }
    }

    #[test]
    fn a_stream_keeps_its_latest_answer_only_while_somebody_looks() {
        let taps = Arc::new(Taps::default());
        let mut stream = taps.open(Transport::grpc_stream);
        stream.offer(|| panic!("nobody looks"));
        let tap = taps.find(stream.tap.id).expect("open");
        assert!(tap.look().is_none());
        stream.offer(seen);
        assert!(tap.look().is_some());
        stream.offer(|| panic!("too soon after the last"));
        locked(&tap.kept).looked = Instant::now().checked_sub(LOOKED_AT);
        std::thread::sleep(EVERY);
        stream.offer(|| panic!("nobody has looked for long"));
        assert!(!tap.watched.load(Ordering::Relaxed));
        assert_eq!(taps.list().len(), 1);
        drop(stream);
        assert!(taps.list().is_empty());
    }
}
