//! What one connection holds, how long it has kept the server waiting, and why it is closed.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use tokio::sync::Notify;

use super::{Accounts, Closed, Held, Peer, Place};
use crate::metrics::Resource;
use wade_wire::Overloaded;

/// How long a connection counts as heavy after its last heavy call: longer than the pause between two of a loop.
const HEAVY_FOR: Duration = Duration::from_secs(1);

/// One connection.
#[derive(Debug)]
pub struct Connection {
    pub(super) accounts: Arc<Accounts>,
    pub(super) id: u64,
    pub(super) peer: Peer,
    pub(super) peer_held: Arc<Held>,
    pub(super) held: Held,
    /// Calls that are complete and not answered: the server's turn.
    computing: AtomicUsize,
    /// Bytes of answers that the peer has not taken.
    unsent: AtomicUsize,
    /// When data last moved in either direction [ms].
    moved_ms: AtomicU64,
    /// When data of an answer last left, or began to wait [ms].
    sent_ms: AtomicU64,
    opened_ms: u64,
    shaken: AtomicBool,
    called: AtomicBool,
    dear_calls: AtomicU32,
    stands_back: AtomicBool,
    /// Heavy calls under way, and when one last began or ended [ms].
    heavy: AtomicUsize,
    heavy_ms: AtomicU64,
    closed: OnceLock<Closed>,
    closing: Notify,
}

impl Connection {
    pub(super) fn new(accounts: Arc<Accounts>, id: u64, peer: Peer, peer_held: Arc<Held>) -> Self {
        let now = accounts.now_ms();
        Self {
            accounts,
            id,
            peer,
            peer_held,
            held: Held::default(),
            computing: AtomicUsize::new(0),
            unsent: AtomicUsize::new(0),
            moved_ms: AtomicU64::new(now),
            sent_ms: AtomicU64::new(now),
            opened_ms: now,
            shaken: AtomicBool::new(false),
            called: AtomicBool::new(false),
            dear_calls: AtomicU32::new(0),
            stands_back: AtomicBool::new(false),
            heavy: AtomicUsize::new(0),
            heavy_ms: AtomicU64::new(0),
            closed: OnceLock::new(),
            closing: Notify::new(),
        }
    }

    /// The account that this one is part of.
    pub fn accounts(&self) -> &Arc<Accounts> {
        &self.accounts
    }

    /// Who is at the other end.
    pub fn peer(&self) -> Peer {
        self.peer
    }

    /// Has the connection closed by the task that serves it; the first reason counts.
    pub fn close(&self, reason: Closed) {
        if self.closed.set(reason).is_ok() {
            if matches!(reason, Closed::control_frames | Closed::broke_protocol | Closed::no_tls) {
                self.accounts.fault.store(true, Relaxed);
            }
            self.accounts.metrics.count_closed(reason);
            tracing::debug!(peer = %self.peer, reason = reason.name(), "closing a connection");
        }
        self.closing.notify_one();
    }

    /// Resolves when the connection is to be closed.
    pub async fn closing(&self) -> Closed {
        loop {
            if let Some(&reason) = self.closed.get() {
                return reason;
            }
            self.closing.notified().await;
        }
    }

    /// Notes that data moved.
    pub fn moved(&self) {
        self.moved_ms.store(self.accounts.now_ms(), Relaxed);
    }

    /// Notes that data of an answer left.
    pub fn sent(&self) {
        let now = self.accounts.now_ms();
        self.moved_ms.store(now, Relaxed);
        self.sent_ms.store(now, Relaxed);
    }

    /// Notes that the peer has said which protocol it speaks.
    pub fn shakes_hands(&self) {
        self.shaken.store(true, Relaxed);
    }

    /// Whether the peer has said which protocol it speaks.
    pub fn has_shaken_hands(&self) -> bool {
        self.shaken.load(Relaxed)
    }

    /// Notes that something was asked.
    pub fn asks(&self) {
        self.called.store(true, Relaxed);
    }

    /// Notes a call that its peer pays for where it goes on regardless: it was refused, or is the administrator's.
    pub fn pays_for_call(&self) {
        self.dear_calls.fetch_add(1, Relaxed);
    }

    /// How many such calls there were since this was asked.
    pub fn take_dear_calls(&self) -> u32 {
        // a swap writes even where there is nothing to take
        if self.dear_calls.load(Relaxed) == 0 { 0 } else { self.dear_calls.swap(0, Relaxed) }
    }

    /// Notes whether the connection has had its turn on the thread, so that others go first.
    pub fn set_stands_back(&self, stands_back: bool) {
        self.stands_back.store(stands_back, Relaxed);
    }

    /// Whether others go first.
    pub fn stands_back(&self) -> bool {
        self.stands_back.load(Relaxed)
    }

    /// Whether calls that take milliseconds are under way, or were a moment ago.
    pub fn is_heavy(&self) -> bool {
        let last = self.heavy_ms.load(Relaxed);
        self.heavy.load(Relaxed) > 0 || (last > 0 && self.since(last) < HEAVY_FOR)
    }

    /// Whether anything was ever asked.
    pub fn has_called(&self) -> bool {
        self.called.load(Relaxed)
    }

    /// Whether a call is open.
    pub fn has_calls(&self) -> bool {
        use Resource::{batches, probes, requests, streams, watches};
        [requests, batches, streams, watches, probes].iter().any(|&resource| self.held.get(resource) > 0)
    }

    /// Whether the server is at work for this connection, so that it is not the peer that lets others wait.
    pub fn is_computing(&self) -> bool {
        self.computing.load(Relaxed) > 0
    }

    /// Time since data last moved.
    pub fn waits_for(&self) -> Duration {
        self.since(self.moved_ms.load(Relaxed))
    }

    /// How long the peer has kept the server waiting, for anything or with an answer that it does not take.
    pub fn keeps_waiting_for(&self) -> Duration {
        self.waits_for().max(self.stalled_for())
    }

    /// Time since the connection was opened.
    pub fn age(&self) -> Duration {
        self.since(self.opened_ms)
    }

    /// How long an answer has waited for the peer to take any of it.
    pub fn stalled_for(&self) -> Duration {
        if self.unsent.load(Relaxed) == 0 { Duration::ZERO } else { self.since(self.sent_ms.load(Relaxed)) }
    }

    /// Bytes of an answer begin to wait.
    pub(super) fn unsent(&self, bytes: usize) {
        for held in [&self.held, &*self.peer_held, &self.accounts.total] {
            // they exist already: what bounds them is that no call is admitted while there are too many
            held.add(Resource::bytes, bytes, usize::MAX);
        }
        if self.unsent.fetch_add(bytes, Relaxed) == 0 {
            self.sent();
        }
    }

    /// Bytes of an answer have left, or never will.
    pub(super) fn no_longer_unsent(&self, bytes: usize) {
        self.unsent.fetch_sub(bytes, Relaxed);
        self.accounts.give_back(self, Resource::bytes, bytes);
    }

    fn since(&self, ms: u64) -> Duration {
        Duration::from_millis(self.accounts.now_ms().saturating_sub(ms))
    }

    /// Adds received bytes to a charge, where there is room for them.
    pub fn charge(self: &Arc<Self>, charge: &mut Option<Place>, bytes: usize) -> Result<(), Overloaded> {
        self.accounts.add(self, Resource::bytes, bytes)?;
        match charge {
            Some(place) => place.amount += bytes,
            None => {
                *charge =
                    Some(Place { connection: Arc::clone(self), resource: Resource::bytes, amount: bytes });
            }
        }
        Ok(())
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.accounts.forget(self.id, self.peer);
    }
}

/// Says while it lives that a call which takes milliseconds is under way.
#[derive(Debug)]
pub struct Heavy(Arc<Connection>);

impl Heavy {
    /// The call begins.
    pub fn begin(connection: &Arc<Connection>) -> Self {
        connection.heavy.fetch_add(1, Relaxed);
        Self(Arc::clone(connection))
    }
}

impl Drop for Heavy {
    fn drop(&mut self) {
        self.0.heavy_ms.store(self.0.accounts.now_ms().max(1), Relaxed);
        self.0.heavy.fetch_sub(1, Relaxed);
    }
}

/// Says while it lives that the server is at work for a connection.
#[derive(Debug)]
pub struct Computing(Arc<Connection>);

impl Computing {
    /// Work begins.
    pub fn begin(connection: &Arc<Connection>) -> Self {
        connection.computing.fetch_add(1, Relaxed);
        Self(Arc::clone(connection))
    }
}

impl Drop for Computing {
    fn drop(&mut self) {
        self.0.computing.fetch_sub(1, Relaxed);
        // the peer's time begins when the answer is there
        self.0.moved();
    }
}
