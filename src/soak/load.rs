//! The measured loop.

use std::{
    sync::atomic::AtomicBool,
    thread,
    time::{Duration, Instant, SystemTime},
};

use super::{
    clock::{Clock, Monotonic, wait_until},
    config::Config,
    hiccup::{self, Deadlines, StopOnDrop},
    input::Input,
    lateness::Ideal,
    record::{Outcome, Recording, Sample},
    report::Report,
};
use crate::service::wire::State;

/// From the call to the first intended start: time for the control's thread to start.
const LEAD: Duration = Duration::from_millis(20);

/// Requests that were due in time may still be sent this long after the end [ns], so that a hiccup in the last
/// moment does not cut them off.
const DRAIN_NS: u64 = 1_000_000_000;

/// Progress is told this often, where there is time for it [ns].
const PROGRESS_EVERY_NS: u64 = 1_000_000_000;

/// There is time for it with this long to the next request: drawing a line takes about 0.1 ms [ns].
const PROGRESS_NEEDS_NS: u64 = 500_000;

/// Where there is never time for it, progress is told this seldom all the same [ns].
const PROGRESS_AT_LEAST_NS: u64 = 10_000_000_000;

/// Why a request has no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// No answer within the client's own deadline.
    #[error("no answer in time")]
    Lost,
    /// The server answered with an error.
    #[error("refused: {0}")]
    Refused(String),
}

/// How far a soak is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Time since the start, the warm-up included.
    pub elapsed: Duration,
    /// Length of the whole run, the warm-up included.
    pub total: Duration,
    /// Requests sent in the measured part.
    pub sent: u64,
    /// Requests refused in the measured part.
    pub errors: u64,
    /// Requests lost in the measured part.
    pub lost: u64,
    /// Median response time so far.
    pub p50: Duration,
    /// 99th percentile of the response time so far.
    pub p99: Duration,
    /// True before the measured part.
    pub warming_up: bool,
}

/// Sends requests on schedule and returns what they met.
///
/// `send` gets the states of one request, waits for the answer, and returns the server's own compute time [ns].
/// It is called on this thread, one request at a time; `progress` too, between requests. Pin this thread before
/// the call where that is wanted.
pub fn run(
    config: &Config,
    input: &Input,
    send: &mut dyn FnMut(&[State]) -> Result<u64, SendError>,
    progress: &dyn Fn(&Progress),
) -> Report {
    let end = (config.warm_up + config.duration).as_nanos() as u64;
    let deadlines = Deadlines::beside(config.rate);
    let (recording, memory) =
        (Recording::new(config.warm_up, config.duration), hiccup::prepare(deadlines, end));
    let (started_at, clock) = (SystemTime::now() + LEAD, Monotonic { start: Instant::now() + LEAD });
    let stop = AtomicBool::new(false);
    let (recording, hiccups) = thread::scope(|scope| {
        let control =
            scope.spawn(|| hiccup::watch(&clock, deadlines, end, config.control_core, memory, &stop));
        let stop_on_drop = StopOnDrop(&stop);
        let recording = drive(config, input, &clock, recording, send, progress);
        drop(stop_on_drop);
        (recording, control.join().unwrap_or_default())
    });
    Report::new(config, input, started_at, recording, hiccups)
}

/// The loop of `run` on any clock.
pub(super) fn drive(
    config: &Config,
    input: &Input,
    clock: &impl Clock,
    mut recording: Recording,
    send: &mut dyn FnMut(&[State]) -> Result<u64, SendError>,
    progress: &dyn Fn(&Progress),
) -> Recording {
    let end = (config.warm_up + config.duration).as_nanos() as u64;
    let mut states = vec![State::default(); config.batch.get()];
    let (mut ideal, mut teller) = (Ideal::default(), Teller { told: 0, end });
    for index in 0.. {
        let due = config.rate.intended_ns(index);
        let next = due.unwrap_or_else(|| clock.now());
        if next >= end {
            break;
        }
        teller.tell(&recording, clock.now(), due, progress);
        input.fill(next as f64 * 1e-9, &mut states);
        let wait = wait_until(clock, next);
        if wait.ended >= end + DRAIN_NS {
            let due_in_all = config.rate.due_before(end).unwrap_or(index);
            let unsent = (index..due_in_all).filter_map(|index| config.rate.intended_ns(index));
            unsent.for_each(|intended| recording.record_unsent(intended, wait.ended));
            break;
        }
        let sent = wait.ended;
        let result = send(&states);
        let done = clock.now();
        let intended = due.unwrap_or(sent);
        let own_lag = ideal.own_lag(intended, sent, done);
        let outcome = outcome(result, &mut recording.first_error);
        recording.record(&Sample { intended, sent, done, own_lag, stall: wait.stall, outcome });
    }
    teller.finish(&recording, progress);
    recording
}

fn outcome(result: Result<u64, SendError>, first_error: &mut Option<String>) -> Outcome {
    match result {
        Ok(compute) => Outcome::Answered(compute),
        Err(SendError::Lost) => Outcome::Lost,
        Err(SendError::Refused(reason)) => {
            first_error.get_or_insert(reason);
            Outcome::Refused
        }
    }
}

/// Tells the progress when that does not delay a request.
struct Teller {
    told: u64,
    end: u64,
}

impl Teller {
    fn tell(&mut self, recording: &Recording, now: u64, due: Option<u64>, progress: &dyn Fn(&Progress)) {
        let silent = now.saturating_sub(self.told);
        let harmless = due.is_none_or(|due| due >= now + PROGRESS_NEEDS_NS);
        if silent >= PROGRESS_AT_LEAST_NS || (silent >= PROGRESS_EVERY_NS && harmless) {
            self.told = now;
            progress(&self.progress(recording, now));
        }
    }

    fn finish(&self, recording: &Recording, progress: &dyn Fn(&Progress)) {
        progress(&self.progress(recording, self.end));
    }

    fn progress(&self, recording: &Recording, now: u64) -> Progress {
        let warming_up = now < recording.warm_up_ns;
        let totals = if warming_up { &recording.warm_up } else { &recording.measured };
        let at = |quantile| Duration::from_nanos(totals.response.value_at_quantile(quantile));
        Progress {
            elapsed: Duration::from_nanos(now),
            total: Duration::from_nanos(self.end),
            sent: recording.measured.sent,
            errors: recording.measured.errors,
            lost: recording.measured.lost,
            p50: at(0.5),
            p99: at(0.99),
            warming_up,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{cell::Cell, num::NonZeroUsize};

    use super::{
        super::{
            clock::simulated::Simulated,
            input::Domain,
            lateness,
            record::{Counts, Percentiles},
            schedule::Rate,
        },
        *,
    };

    const MS: u64 = 1_000_000;

    fn config(hz: f64, seconds: u64) -> Config {
        Config {
            rate: Rate::Hz(hz),
            duration: Duration::from_secs(seconds),
            warm_up: Duration::ZERO,
            ..Config::default()
        }
    }

    fn soak(
        config: &Config,
        clock: &Simulated,
        send: &mut dyn FnMut(&[State]) -> Result<u64, SendError>,
        progress: &dyn Fn(&Progress),
    ) -> Recording {
        let domain = Domain { speed: [0.0, 2.0], angle: [0.0, 1.6], depth: [0.1, 0.5], density: [1000.0; 2] };
        let recording = Recording::new(config.warm_up, config.duration);
        drive(config, &Input::varying(&domain), clock, recording, send, progress)
    }

    fn longer_than(times: &Counts, ns: u64) -> u64 {
        times.len() - times.count_between(0, ns)
    }

    #[test]
    fn one_stall_delays_every_request_that_was_due_in_it() {
        let (clock, sent) = (Simulated::default(), Cell::new(0));
        let recording = soak(
            &config(1000.0, 2),
            &clock,
            &mut |_| {
                sent.set(sent.get() + 1);
                clock.pass(if sent.get() == 500 { 100 * MS } else { MS / 100 });
                Ok(0)
            },
            &|_| {},
        );
        assert_eq!(recording.measured.sent, 2000);
        let delayed = longer_than(&recording.measured.response, MS);
        assert!((98..=103).contains(&delayed), "{delayed} delayed responses");
        assert_eq!(longer_than(&recording.measured.service, MS), 1);
        assert!(!lateness::is_late(Rate::Hz(1000.0), &recording.measured.own_lag));
    }

    #[test]
    fn a_server_too_slow_for_the_rate_is_not_a_late_generator() {
        let clock = Simulated::default();
        let mut slow = |_: &[State]| {
            clock.pass(3 * MS);
            Ok(0)
        };
        let recording = soak(&config(1000.0, 4), &clock, &mut slow, &|_| {});
        assert!(!lateness::is_late(Rate::Hz(1000.0), &recording.measured.own_lag));
        assert!(Percentiles::of(&recording.measured.lag).p99 > 1e6, "the backlog shows in the send lag");
        let all = recording.measured.sent + recording.unsent;
        assert_eq!((all, recording.measured.response.len()), (4000, 4000), "what was never sent counts too");
    }

    #[test]
    fn a_generator_held_up_between_requests_is_late() {
        let clock = Simulated::default();
        let mut quick = |_: &[State]| {
            clock.pass(MS / 100);
            Ok(0)
        };
        // the progress is told by the generator itself, once a second
        let recording = soak(&config(1000.0, 4), &clock, &mut quick, &|_| clock.pass(50 * MS));
        assert!(lateness::is_late(Rate::Hz(1000.0), &recording.measured.own_lag));
    }

    #[test]
    fn the_closed_loop_has_neither_lag_nor_lateness() {
        let clock = Simulated::default();
        let config = Config { rate: Rate::Max, ..config(1.0, 1) };
        let mut send = |_: &[State]| {
            clock.pass(MS);
            Ok(5)
        };
        let recording = soak(&config, &clock, &mut send, &|_| {});
        assert!((990..=1000).contains(&recording.measured.sent), "{} sent", recording.measured.sent);
        assert_eq!((recording.measured.lag.max(), recording.measured.server.max()), (0, 5));
        assert!(!lateness::is_late(Rate::Max, &recording.measured.own_lag));
    }

    #[test]
    fn every_request_carries_the_batch_and_progress_counts_to_the_end() {
        let (clock, last) = (Simulated::default(), Cell::new(None));
        let config = Config {
            batch: NonZeroUsize::new(7).expect("7 is not 0"),
            warm_up: Duration::from_secs(1),
            ..config(10.0, 2)
        };
        let mut refuse_empty = |states: &[State]| match states.len() {
            7 => Ok(0),
            other => Err(SendError::Refused(format!("{other} states"))),
        };
        let recording = soak(&config, &clock, &mut refuse_empty, &|progress| last.set(Some(*progress)));
        assert_eq!((recording.warm_up.sent, recording.measured.answered), (10, 20));
        let last = last.get().expect("told at least at the end");
        assert_eq!((last.sent, last.elapsed, last.warming_up), (20, last.total, false));
    }
}
