//! The generator's clock and how it waits for a point in time.

use std::{
    thread,
    time::{Duration, Instant},
};

use super::config::Pace;

/// Above this the wait sleeps, below it spins [ns]. A sleep ends up to some 0.1 ms late on a quiet machine and
/// leaves the core's clock and caches cold, so rates of 500 Hz and more never sleep.
const SLEEP_ABOVE_NS: u64 = 2_000_000;

/// A sleep ends this long before the intended time; the rest is spun [ns].
const SPIN_NS: u64 = 1_000_000;

/// A monotonic clock; tests pass one that they move themselves.
pub(super) trait Clock {
    /// Time since the start of the schedule [ns]; zero before it.
    fn now(&self) -> u64;
    /// Sleeps for about `ns` [ns].
    fn sleep(&self, ns: u64);
}

/// The machine's monotonic clock from a chosen start.
#[derive(Debug, Clone, Copy)]
pub(super) struct Monotonic {
    /// Where the schedule starts.
    pub start: Instant,
}

impl Clock for Monotonic {
    fn now(&self) -> u64 {
        self.start.elapsed().as_nanos() as u64
    }

    fn sleep(&self, ns: u64) {
        thread::sleep(Duration::from_nanos(ns));
    }
}

/// What a wait saw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Wait {
    /// When the wait ended: the last reading of the clock [ns].
    pub ended: u64,
    /// The longest time between two readings while spinning [ns]; none where there was nothing to wait for.
    pub stall: Option<u64>,
}

/// Waits until `due` [ns] and returns the first clock reading that is not before it.
pub(super) fn wait_until(clock: &impl Clock, due: u64, pace: Pace) -> Wait {
    let mut last = clock.now();
    let mut stall = None;
    while last < due {
        if pace == Pace::Sleep {
            clock.sleep(due - last);
            last = clock.now();
            continue;
        }
        if due - last > SLEEP_ABOVE_NS {
            clock.sleep(due - last - SPIN_NS);
            last = clock.now();
            continue;
        }
        let now = clock.now();
        stall = stall.max(Some(now - last));
        last = now;
    }
    Wait { ended: last, stall }
}

#[cfg(test)]
pub(super) mod simulated {
    //! A clock that moves only when read, slept on, or pushed.

    use std::cell::Cell;

    use super::Clock;

    /// Each reading takes this long [ns].
    pub const TICK: u64 = 100;

    #[derive(Default)]
    pub struct Simulated(Cell<u64>);

    impl Simulated {
        /// Lets `ns` pass.
        pub fn pass(&self, ns: u64) {
            self.0.set(self.0.get() + ns);
        }
    }

    impl Clock for Simulated {
        fn now(&self) -> u64 {
            self.pass(TICK);
            self.0.get()
        }

        fn sleep(&self, ns: u64) {
            self.pass(ns);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        simulated::{Simulated, TICK},
        *,
    };

    #[test]
    fn a_wait_ends_at_the_first_reading_after_the_due_time() {
        let clock = Simulated::default();
        let wait = wait_until(&clock, 10_000_050, Pace::Spin);
        assert!((10_000_050..10_000_050 + TICK).contains(&wait.ended));
        assert_eq!(wait.stall, Some(TICK));
    }

    #[test]
    fn a_wait_that_sleeps_reads_the_clock_once_before_and_once_after() {
        let clock = Simulated::default();
        let wait = wait_until(&clock, 1_000_000, Pace::Sleep);
        assert_eq!(wait, Wait { ended: 1_000_000 + TICK, stall: None });
    }

    #[test]
    fn a_time_already_past_is_not_waited_for() {
        let clock = Simulated::default();
        clock.pass(5_000);
        assert_eq!(wait_until(&clock, 1_000, Pace::Spin), Wait { ended: 5_000 + TICK, stall: None });
    }
}
