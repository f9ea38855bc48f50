//! Where the measured loop writes: memory that is there before it starts.
//!
//! One histogram an interval (a second, longer in runs of more than ten minutes) and one for the whole, all
//! allocated and touched beforehand, so that a finished second needs no hand-over: the loop goes on to the next
//! histogram, and nothing is read, reset or sent while it measures.

use std::time::Duration;

use hdrhistogram::{Counter, Histogram};
use serde::Serialize;

/// Times of a whole run [ns].
pub(super) type Counts = Histogram<u64>;
/// Times of one interval [ns].
pub(super) type IntervalCounts = Histogram<u32>;

/// A histogram is exact to three digits.
const DIGITS: u8 = 3;
/// More intervals than this are not kept by all clients together; they become longer instead (memory: about 0.25 MB each).
const MOST_INTERVALS: u64 = 600;

/// Points of a distribution of times [us].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Percentiles {
    /// Half are shorter [us].
    pub p50: f64,
    /// 95 of 100 are shorter [us].
    pub p95: f64,
    /// 99 of 100 are shorter [us].
    pub p99: f64,
    /// 999 of 1000 are shorter [us].
    pub p99_9: f64,
    /// The longest [us].
    pub max: f64,
}

impl Percentiles {
    /// Reads the points off a histogram of nanoseconds.
    pub(super) fn of<T: Counter>(times: &Histogram<T>) -> Self {
        let at = |quantile| times.value_at_quantile(quantile) as f64 / 1e3;
        Self { p50: at(0.5), p95: at(0.95), p99: at(0.99), p99_9: at(0.999), max: at(1.0) }
    }
}

/// An empty histogram for times up to `longest_ns`, its memory touched so that the loop meets no page fault.
pub(super) fn histogram<T: Counter>(longest_ns: u64) -> Histogram<T> {
    let mut times = Histogram::new_with_bounds(1, longest_ns.max(2), DIGITS)
        .expect("a lower bound of 1, an upper of at least 2 and 3 digits are always valid");
    times.reset();
    times
}

/// One request as the loop saw it, times from the start of the schedule [ns].
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// When it was due.
    pub intended: u64,
    /// When it was sent.
    pub sent: u64,
    /// When the answer was there, or the wait for it was given up.
    pub done: u64,
    /// The generator's own share of the send lag.
    pub own_lag: u64,
    /// The longest gap between two clock readings in the wait before it.
    pub stall: Option<u64>,
    /// What became of it.
    pub outcome: Outcome,
}

/// What became of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Answered, after the server's own compute time [ns].
    Answered(u64),
    /// Answered with an error.
    Refused,
    /// Not answered in time.
    Lost,
}

/// Everything counted over one phase (the warm-up or the measured part).
#[derive(Debug)]
pub(super) struct Totals {
    pub sent: u64,
    pub answered: u64,
    pub errors: u64,
    pub lost: u64,
    pub response: Counts,
    pub service: Counts,
    pub lag: Counts,
    pub own_lag: Counts,
    pub stall: Counts,
    pub server: Counts,
}

impl Totals {
    /// Adds what another client counted over the same phase.
    fn merge(&mut self, other: &Self) {
        self.sent += other.sent;
        self.answered += other.answered;
        self.errors += other.errors;
        self.lost += other.lost;
        for (ours, theirs) in [
            (&mut self.response, &other.response),
            (&mut self.service, &other.service),
            (&mut self.lag, &other.lag),
            (&mut self.own_lag, &other.own_lag),
            (&mut self.stall, &other.stall),
            (&mut self.server, &other.server),
        ] {
            ours.add(theirs).expect("histograms of one run have the same bounds");
        }
    }

    fn new(longest_ns: u64) -> Self {
        let times = || histogram(longest_ns);
        Self {
            sent: 0,
            answered: 0,
            errors: 0,
            lost: 0,
            response: times(),
            service: times(),
            lag: times(),
            own_lag: times(),
            stall: times(),
            server: times(),
        }
    }

    fn record(&mut self, sample: &Sample) {
        self.sent += 1;
        match sample.outcome {
            Outcome::Answered(compute) => {
                self.answered += 1;
                self.server.saturating_record(compute);
            }
            Outcome::Refused => self.errors += 1,
            Outcome::Lost => self.lost += 1,
        }
        if sample.outcome != Outcome::Refused {
            self.response.saturating_record(sample.done - sample.intended);
            self.service.saturating_record(sample.done - sample.sent);
        }
        self.lag.saturating_record(sample.sent - sample.intended);
        self.own_lag.saturating_record(sample.own_lag);
        if let Some(stall) = sample.stall {
            self.stall.saturating_record(stall);
        }
    }
}

/// One interval of the time line.
#[derive(Debug)]
pub(super) struct Interval {
    pub response: IntervalCounts,
    pub service: IntervalCounts,
    /// The longest stall that the generator saw in its waits [ns].
    pub stall: u64,
}

/// All that a run records.
///
/// A request that was lost counts with the time that was waited for it, and one that was due but could not be
/// sent before the end with the time that it had waited by then: both are lower bounds, and leaving them out
/// would flatter the server. A refused request has no response time, since refusing is quick.
#[derive(Debug)]
pub(super) struct Recording {
    /// Requests due before this belong to the warm-up [ns].
    pub warm_up_ns: u64,
    /// Length of an interval [ns].
    pub interval_ns: u64,
    pub warm_up: Totals,
    pub measured: Totals,
    pub intervals: Vec<Interval>,
    /// Requests that were due but not sent before the end.
    pub unsent: u64,
    /// What the first refusal said.
    pub first_error: Option<String>,
    /// When the last request was done [ns].
    pub last_done: u64,
    /// When the run was stopped, where it was stopped before its end [ns].
    pub stopped: Option<u64>,
}

impl Recording {
    /// Allocates for one of so many clients in a run of these lengths.
    pub(super) fn new(warm_up: Duration, duration: Duration, clients: usize) -> Self {
        // a request can wait as long as the run lasts, and a client's timeout on top
        let longest = (warm_up + duration + Duration::from_secs(60)).as_nanos() as u64;
        let seconds = duration.as_secs_f64().ceil() as u64;
        let most = (MOST_INTERVALS / clients as u64).max(1);
        let interval_s = seconds.div_ceil(most).max(1);
        let interval = || Interval { response: histogram(longest), service: histogram(longest), stall: 0 };
        Self {
            warm_up_ns: warm_up.as_nanos() as u64,
            interval_ns: interval_s * 1_000_000_000,
            warm_up: Totals::new(longest),
            measured: Totals::new(longest),
            intervals: (0..seconds.div_ceil(interval_s).max(1)).map(|_| interval()).collect(),
            unsent: 0,
            first_error: None,
            last_done: 0,
            stopped: None,
        }
    }

    /// Adds what another client of the same run recorded.
    pub(super) fn merge(&mut self, other: &Self) {
        self.warm_up.merge(&other.warm_up);
        self.measured.merge(&other.measured);
        for (ours, theirs) in self.intervals.iter_mut().zip(&other.intervals) {
            let same = "histograms of one run have the same bounds";
            ours.response.add(&theirs.response).expect(same);
            ours.service.add(&theirs.service).expect(same);
            ours.stall = ours.stall.max(theirs.stall);
        }
        self.unsent += other.unsent;
        self.first_error = self.first_error.take().or_else(|| other.first_error.clone());
        self.last_done = self.last_done.max(other.last_done);
        self.stopped = self.stopped.max(other.stopped);
    }

    /// The measured part that was reached [ns].
    pub(super) fn reached(&self, duration: Duration) -> Duration {
        let whole = Duration::from_nanos(self.last_done.saturating_sub(self.warm_up_ns)).max(duration);
        self.stopped.map_or(whole, |at| Duration::from_nanos(at.saturating_sub(self.warm_up_ns)))
    }

    /// Counts one request in the phase and the interval in which it was due.
    pub(super) fn record(&mut self, sample: &Sample) {
        self.last_done = sample.done;
        if sample.intended < self.warm_up_ns {
            return self.warm_up.record(sample);
        }
        self.measured.record(sample);
        let interval = self.interval_at(sample.intended);
        if sample.outcome != Outcome::Refused {
            interval.response.saturating_record(sample.done - sample.intended);
            interval.service.saturating_record(sample.done - sample.sent);
        }
        interval.stall = interval.stall.max(sample.stall.unwrap_or(0));
    }

    /// Counts a request that was due at `intended` and still unsent at `end` [ns].
    pub(super) fn record_unsent(&mut self, intended: u64, end: u64) {
        if intended < self.warm_up_ns {
            return;
        }
        self.unsent += 1;
        self.measured.response.saturating_record(end - intended);
        self.interval_at(intended).response.saturating_record(end - intended);
    }

    /// Which interval of the measured part a time belongs to; none in the warm-up.
    pub(super) fn interval_index(&self, at_ns: u64) -> Option<usize> {
        let since = at_ns.checked_sub(self.warm_up_ns)?;
        Some(((since / self.interval_ns) as usize).min(self.intervals.len() - 1))
    }

    fn interval_at(&mut self, at_ns: u64) -> &mut Interval {
        let index = self.interval_index(at_ns).unwrap_or(0);
        &mut self.intervals[index]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(intended: u64, outcome: Outcome) -> Sample {
        let sent = intended + 10;
        Sample { intended, sent, done: sent + 1000, own_lag: 10, stall: Some(5), outcome }
    }

    #[test]
    fn lost_and_refused_are_counted_apart_and_only_the_lost_has_a_time() {
        let mut recording = Recording::new(Duration::ZERO, Duration::from_secs(1), 1);
        for outcome in [Outcome::Answered(7), Outcome::Refused, Outcome::Lost, Outcome::Lost] {
            recording.record(&sample(0, outcome));
        }
        let totals = &recording.measured;
        assert_eq!((totals.sent, totals.answered, totals.errors, totals.lost), (4, 1, 1, 2));
        assert_eq!((totals.response.len(), recording.intervals[0].response.len()), (3, 3));
        assert_eq!(totals.server.len(), 1);
    }

    #[test]
    fn the_warm_up_is_not_in_the_figures() {
        let mut recording = Recording::new(Duration::from_secs(1), Duration::from_secs(2), 1);
        for intended in [0, 999_999_999, 1_000_000_000, 2_999_999_999] {
            recording.record(&sample(intended, Outcome::Answered(7)));
        }
        assert_eq!((recording.warm_up.sent, recording.measured.sent), (2, 2));
        let lengths: Vec<_> = recording.intervals.iter().map(|i| i.response.len()).collect();
        assert_eq!(lengths, [1, 1]);
    }

    #[test]
    fn long_runs_get_longer_intervals_not_more() {
        let recording = Recording::new(Duration::ZERO, Duration::from_secs(86_400), 1);
        assert_eq!((recording.intervals.len(), recording.interval_ns), (600, 144_000_000_000));
    }

    #[test]
    fn two_clients_together_are_the_sum_of_both() {
        let mut both = Recording::new(Duration::ZERO, Duration::from_secs(1), 2);
        let mut other = Recording::new(Duration::ZERO, Duration::from_secs(1), 2);
        both.record(&sample(0, Outcome::Answered(7)));
        other.record(&sample(5, Outcome::Lost));
        other.stopped = Some(9);
        both.merge(&other);
        let totals = &both.measured;
        assert_eq!((totals.sent, totals.answered, totals.lost, totals.response.len()), (2, 1, 1, 2));
        assert_eq!((both.intervals[0].response.len(), both.last_done), (2, 1015));
        assert_eq!(both.reached(Duration::from_secs(1)), Duration::from_nanos(9));
    }
}
