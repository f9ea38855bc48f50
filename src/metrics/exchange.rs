//! Latencies that queries write while others look: what is written to is exchanged and not copied, so that no query waits for
//! whoever looks.

use std::sync::PoisonError;

use hdrhistogram::Histogram;

use super::sync::{Mutex, MutexGuard};

/// Latencies are recorded from 1 ns up to this [ns] with three significant digits.
const HIGHEST_NS: u64 = 60_000_000_000;

/// The latencies of one kind of request.
#[derive(Debug)]
pub struct Exchange {
    /// What came since somebody last looked: all that a query waits for.
    current: Mutex<Histogram<u64>>,
    accounts: Mutex<Accounts>,
}

/// Everything up to when somebody last looked.
#[derive(Debug)]
pub struct Accounts {
    /// Since the start.
    pub since_start: Histogram<u64>,
    /// In the window that is open.
    pub window: Histogram<u64>,
    /// In the window before it.
    pub last_window: Histogram<u64>,
    /// Empty, to take the place of what is written to.
    spare: Histogram<u64>,
    /// States outside the training domain that were drained.
    outside_drained: u64,
}

impl Exchange {
    /// Nothing was recorded.
    pub fn new() -> Self {
        let histogram =
            || Histogram::new_with_max(HIGHEST_NS, 3).expect("the constants are valid for a histogram");
        let accounts = Accounts {
            since_start: histogram(),
            window: histogram(),
            last_window: histogram(),
            spare: histogram(),
            outside_drained: 0,
        };
        Self { current: Mutex::new(histogram()), accounts: Mutex::new(accounts) }
    }

    /// Records so many requests that took this long [ns].
    pub fn record(&self, ns: u64, count: u64) {
        lock(&self.current).saturating_record_n(ns, count);
    }

    /// The accounts with everything in them.
    pub fn collect(&self) -> MutexGuard<'_, Accounts> {
        let mut guard = lock(&self.accounts);
        let accounts = &mut *guard;
        std::mem::swap(&mut *lock(&self.current), &mut accounts.spare);
        for account in [&mut accounts.since_start, &mut accounts.window] {
            account.add(&accounts.spare).expect("both have the same bounds");
        }
        accounts.spare.reset();
        guard
    }

    /// Takes out what has come since the last call: times [ns] with how many there were of each, and how much has been added to
    /// the count of states outside the domain, which is now this. For a process that reports to another.
    pub fn drain(&self, outside: impl FnOnce() -> u64) -> (Vec<(u64, u64)>, u64) {
        let mut guard = self.collect();
        let accounts = &mut *guard;
        let times = accounts.window.iter_recorded().map(|at| (at.value_iterated_to(), at.count_at_value()));
        let times = times.collect();
        accounts.window.reset();
        let outside = outside();
        (times, outside - std::mem::replace(&mut accounts.outside_drained, outside))
    }

    /// Begins a new window.
    pub fn rotate(&self) {
        let mut guard = self.collect();
        let accounts = &mut *guard;
        std::mem::swap(&mut accounts.window, &mut accounts.last_window);
        accounts.window.reset();
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
