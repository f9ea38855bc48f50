//! The machine's own control: a thread that only sleeps, and how late it wakes.
//!
//! What it sees no server could have answered faster through. It must not become what it measures: it wakes ten
//! to a hundred times a second, and halfway between two requests, since a period that the schedule divides would hit
//! the same point of the same requests every time.

use std::sync::atomic::{AtomicBool, Ordering};

use nix::sys::prctl;

use super::{clock::Clock, schedule::Rate};
use crate::cores;

/// About how often the control wakes where requests are far apart [ns].
const PERIOD_NS: f64 = 10e6;

/// About how often it wakes where they are not [ns].
const SELDOM_NS: f64 = 100e6;

/// Requests are far apart from here on [ns]. Waking on a core that is polled takes it away for some 20 to 50 us;
/// half of this interval hides that, and below it a waking delays a request, or in a load near the limit the
/// twenty that queue behind it. A hundred of those a second can reach the p99.
const FAR_APART_NS: f64 = 200e3;

/// Deadlines of the control, in step with the schedule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Deadlines {
    period_ns: f64,
    offset_ns: f64,
}

impl Deadlines {
    /// Deadlines as far from the intended starts as can be.
    pub(super) fn beside(rate: Rate) -> Self {
        let Some(interval) = rate.interval_ns() else {
            return Self { period_ns: SELDOM_NS, offset_ns: 0.0 };
        };
        let about = if interval < FAR_APART_NS { SELDOM_NS } else { PERIOD_NS };
        let period_ns = if interval < about {
            (about / interval).ceil() * interval
        } else {
            interval / (interval / about).floor()
        };
        Self { period_ns, offset_ns: period_ns.min(interval) / 2.0 }
    }

    fn at(&self, index: u64) -> u64 {
        (index as f64 * self.period_ns + self.offset_ns) as u64
    }

    fn count_before(&self, end: u64) -> usize {
        (end as f64 / self.period_ns).ceil() as usize + 1
    }
}

/// One waking of the control.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Overshoot {
    /// When it was due [ns].
    pub due: u64,
    /// How late it was [ns].
    pub late: u64,
}

/// What the control saw.
#[derive(Debug, Default)]
pub(super) struct Hiccups {
    /// Every waking, in order.
    pub overshoots: Vec<Overshoot>,
    /// The core on which it slept; none where it was free to move.
    pub core: Option<usize>,
}

/// Memory for all wakings before `end` [ns], touched.
pub(super) fn prepare(deadlines: Deadlines, end: u64) -> Vec<Overshoot> {
    let mut overshoots = vec![Overshoot { due: 1, late: 1 }; deadlines.count_before(end)];
    overshoots.clear();
    overshoots
}

/// What is watched.
#[derive(Debug, Clone, Copy)]
pub(super) struct Watch {
    /// When to wake.
    pub deadlines: Deadlines,
    /// When to end [ns].
    pub end: u64,
    /// Which core.
    pub core: Option<usize>,
}

/// Lets a sleep of this thread end when it is due: by default the kernel may delay it by 50 us to save wake-ups. Where it
/// refuses, the median shows it.
pub(super) fn sleep_exactly() {
    let _ = prctl::set_timerslack(1);
}

/// Sleeps from deadline to deadline until the end or until told to stop.
///
/// A stall over several deadlines counts for each of them, as it would for requests.
pub(super) fn watch(
    clock: &impl Clock,
    watch: Watch,
    mut overshoots: Vec<Overshoot>,
    stop: &AtomicBool,
) -> Hiccups {
    let Watch { deadlines, end, core } = watch;
    let core = core.filter(|&core| cores::pin_to(&[core]).is_ok());
    sleep_exactly();
    for due in (0..).map(|index| deadlines.at(index)).take_while(|&due| due < end) {
        let mut now = clock.now();
        while now < due && !stop.load(Ordering::Relaxed) {
            clock.sleep(due - now);
            now = clock.now();
        }
        if now < due {
            break;
        }
        overshoots.push(Overshoot { due, late: now - due });
    }
    Hiccups { overshoots, core }
}

/// Tells the control to stop when the load ends, whichever way it ends.
pub(super) struct StopOnDrop<'a>(pub &'a AtomicBool);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::{super::clock::simulated::Simulated, *};

    #[test]
    fn the_control_never_wakes_near_an_intended_start() {
        for hz in [0.7, 7.0, 60.0, 333.0, 1000.0, 1001.0, 50_000.0] {
            let (interval, deadlines) = (1e9 / hz, Deadlines::beside(Rate::Hz(hz)));
            let about = if hz > 5000.0 { SELDOM_NS } else { PERIOD_NS };
            assert!((about * 0.5..about * 2.0).contains(&deadlines.period_ns), "{hz} Hz");
            for index in 0..1000 {
                let phase = deadlines.at(index) as f64 % interval;
                let distance = phase.min(interval - phase);
                assert!(distance > 0.49 * interval.min(deadlines.period_ns), "{hz} Hz: {distance} ns");
            }
        }
    }

    #[test]
    fn a_stall_counts_for_every_deadline_in_it() {
        let clock = Simulated::default();
        clock.pass(35_000_000);
        let deadlines = Deadlines { period_ns: PERIOD_NS, offset_ns: 0.0 };
        let memory = prepare(deadlines, 100_000_000);
        let control = Watch { deadlines, end: 100_000_000, core: None };
        let hiccups = watch(&clock, control, memory, &AtomicBool::new(false));
        let long: Vec<_> = hiccups.overshoots.iter().map(|o| o.late / 1_000_000).take(5).collect();
        assert_eq!(long, [35, 25, 15, 5, 0]);
        assert_eq!(hiccups.overshoots.len(), 10);
    }
}
