//! What clients saw, and what the server owes them.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::rc::Rc;
use std::time::Duration;

use tokio::time::Instant;

/// A kind of place that an open call holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// A single query.
    Request,
    /// A stream.
    Stream,
}

#[derive(Debug, Clone, Copy)]
struct Open {
    place: Place,
    since: Instant,
}

/// What all clients of a world write into.
#[derive(Debug, Clone)]
pub struct Ledger(Rc<RefCell<Book>>);

#[derive(Debug)]
struct Book {
    begun: Instant,
    trace: String,
    broken: Vec<String>,
    open: BTreeMap<u64, Open>,
    next: u64,
    answered: usize,
    failed: usize,
    /// Versions: the newest that was put on disk, and the newest that an administrator was told is served.
    written: u32,
    told: u32,
    reloads_asked: u64,
}

impl Ledger {
    /// Nothing has happened.
    pub fn new() -> Self {
        Self(Rc::new(RefCell::new(Book {
            begun: Instant::now(),
            trace: String::new(),
            broken: Vec::new(),
            open: BTreeMap::new(),
            next: 0,
            answered: 0,
            failed: 0,
            written: 1,
            told: 1,
            reloads_asked: 0,
        })))
    }

    /// Notes what happened, for the comparison of two runs of a seed.
    pub fn note(&self, what: &str) {
        let mut book = self.0.borrow_mut();
        let at = book.begun.elapsed().as_micros();
        let _ = writeln!(book.trace, "{at} {what}");
    }

    /// Something that must not be.
    pub fn breaks(&self, what: String) {
        self.note(&what);
        self.0.borrow_mut().broken.push(what);
    }

    /// A call was answered, or not.
    pub fn ended(&self, answered: bool) {
        let mut book = self.0.borrow_mut();
        if answered { book.answered += 1 } else { book.failed += 1 }
    }

    /// A call that is open until its guard is dropped, and that the server must count meanwhile.
    pub fn open(&self, place: Place) -> Opened {
        let mut book = self.0.borrow_mut();
        book.next += 1;
        let id = book.next;
        book.open.insert(id, Open { place, since: Instant::now() });
        Opened { ledger: self.clone(), id }
    }

    /// The calls that were open before this time and are open still, by kind.
    pub fn open_since(&self, before: Instant) -> BTreeMap<Place, usize> {
        let mut counts = BTreeMap::new();
        for open in self.0.borrow().open.values().filter(|open| open.since < before) {
            *counts.entry(open.place).or_default() += 1;
        }
        counts
    }

    /// The next version, which is on disk from now on.
    pub fn writes(&self) -> u32 {
        let mut book = self.0.borrow_mut();
        book.written += 1;
        book.written
    }

    /// Versions that a query that is asked now may be answered with, from the oldest.
    pub fn told(&self) -> u32 {
        self.0.borrow().told
    }

    /// The newest version that is on disk.
    pub fn written(&self) -> u32 {
        self.0.borrow().written
    }

    /// An administrator was told that this version is served.
    pub fn tells(&self, version: u32) {
        let mut book = self.0.borrow_mut();
        book.told = book.told.max(version);
    }

    /// An administrator asks.
    pub fn asks_for_reload(&self) {
        self.0.borrow_mut().reloads_asked += 1;
    }

    /// How often administrators asked.
    pub fn reloads_asked(&self) -> u64 {
        self.0.borrow().reloads_asked
    }

    /// Everything: what was broken, what happened, and how many calls were answered and failed.
    pub fn close(self) -> (Vec<String>, String, usize, usize) {
        let book = self.0.borrow();
        (book.broken.clone(), book.trace.clone(), book.answered, book.failed)
    }
}

/// An open call.
#[derive(Debug)]
pub struct Opened {
    ledger: Ledger,
    id: u64,
}

impl Drop for Opened {
    fn drop(&mut self) {
        self.ledger.0.borrow_mut().open.remove(&self.id);
    }
}

/// Longest time that anything is under way, with room.
pub const SETTLED: Duration = Duration::from_millis(700);
