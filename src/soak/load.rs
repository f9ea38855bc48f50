//! The measured loop.

use std::{
    sync::{
        Barrier, OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant, SystemTime},
};

use super::{
    clock::{Clock, Monotonic, wait_until},
    config::{Config, Pace},
    hiccup::{self, Deadlines, Hiccups, StopOnDrop},
    input::Input,
    lateness::Ideal,
    record::{Outcome, Recording, Sample},
    report::Report,
    schedule::Rate,
};
use wade_wire::State;

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

/// What one client calls for each request: it gets the states, waits for the answer, and returns the server's own
/// compute time [ns].
pub type Ask<'a> = Box<dyn FnMut(&[State]) -> Result<u64, SendError> + 'a>;

/// Who asks, and about what.
pub struct Clients<'a, E> {
    /// The states; client `i` asks about input `i` modulo their number.
    pub inputs: &'a [Input],
    /// Connects client `i`, on the thread that drives it: the calling one for the first.
    pub connect: &'a (dyn Fn(usize) -> Result<Ask<'a>, E> + Sync),
}

/// Sends requests of one client on schedule and returns what they met.
///
/// `send` is called on this thread, one request at a time; `progress` too, between requests. Pin this thread before the
/// call where that is wanted.
pub fn run(
    config: &Config,
    input: &Input,
    send: &mut dyn FnMut(&[State]) -> Result<u64, SendError>,
    progress: &dyn Fn(&Progress),
) -> Report {
    let prepared = Prepared::new(config);
    let start = Start::soon();
    let (recording, hiccups) = prepared.beside_control(config, start.clock, |recording| {
        let generator = Generator::new(config, input, &start.clock, 0);
        generator.drive(recording, send, progress)
    });
    Report::new(config, input.name(), start.at, recording, hiccups)
}

/// Sends requests of `config.clients` clients until the end, or until `stop` is true; the report then says so. The
/// progress is that of the first client.
pub fn run_clients<E: Send>(
    config: &Config,
    clients: &Clients<'_, E>,
    progress: &dyn Fn(&Progress),
    stop: &AtomicBool,
) -> Result<Report, E> {
    let count = config.clients.get();
    let (gate, start, failed) = (Barrier::new(count), OnceLock::new(), AtomicBool::new(false));
    // what one client does; all begin at one moment, once each has its memory and its connection
    let client = |index: usize, progress: &dyn Fn(&Progress)| -> Result<(Recording, Hiccups), E> {
        let prepared = Prepared::new(config);
        let asked = (clients.connect)(index);
        failed.fetch_or(asked.is_err(), Ordering::Relaxed);
        gate.wait();
        let mut ask = asked?;
        if failed.load(Ordering::Relaxed) {
            return Ok((prepared.recording, Hiccups::default()));
        }
        let Start { clock, .. } = *start.get_or_init(Start::soon);
        let input = &clients.inputs[index % clients.inputs.len()];
        let generator = Generator { stop: Some(stop), ..Generator::new(config, input, &clock, index) };
        Ok(match index {
            0 => prepared
                .beside_control(config, clock, |recording| generator.drive(recording, &mut ask, progress)),
            _ => (generator.drive(prepared.recording, &mut ask, &|_| {}), Hiccups::default()),
        })
    };
    let (first, others) = thread::scope(|scope| {
        let client = &client;
        let others: Vec<_> = (1..count).map(|index| scope.spawn(move || client(index, &|_| {}))).collect();
        let first = client(0, progress);
        let others: Vec<_> = others.into_iter().map(|thread| thread.join()).collect();
        (first, others)
    });
    let (mut recording, hiccups) = first?;
    for other in others {
        let other = other.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        recording.merge(&other?.0);
    }
    let at = start.get().map_or_else(SystemTime::now, |start| start.at);
    Ok(Report::new(config, clients.inputs[0].name(), at, recording, hiccups))
}

/// When the schedule of all clients starts.
#[derive(Clone, Copy)]
struct Start {
    at: SystemTime,
    clock: Monotonic,
}

impl Start {
    fn soon() -> Self {
        Self { at: SystemTime::now() + LEAD, clock: Monotonic { start: Instant::now() + LEAD } }
    }
}

/// Memory of a client, there before the schedule starts.
struct Prepared {
    recording: Recording,
    deadlines: Deadlines,
}

impl Prepared {
    fn new(config: &Config) -> Self {
        Self {
            recording: Recording::new(config.warm_up, config.duration, config.clients.get()),
            deadlines: Deadlines::beside(config.rate_of_client()),
        }
    }

    /// Runs the load with the machine's control beside it.
    fn beside_control(
        self,
        config: &Config,
        clock: Monotonic,
        load: impl FnOnce(Recording) -> Recording,
    ) -> (Recording, Hiccups) {
        let Self { recording, deadlines } = self;
        let end = (config.warm_up + config.duration).as_nanos() as u64;
        let (memory, stop) = (hiccup::prepare(deadlines, end), AtomicBool::new(false));
        thread::scope(|scope| {
            let control = scope.spawn(|| {
                let control = hiccup::Watch { deadlines, end, core: config.control_core };
                hiccup::watch(&clock, control, memory, &stop)
            });
            let stop_on_drop = StopOnDrop(&stop);
            let recording = load(recording);
            drop(stop_on_drop);
            (recording, control.join().unwrap_or_default())
        })
    }
}

/// One client's loop, on any clock.
struct Generator<'a, C> {
    input: &'a Input,
    clock: &'a C,
    rate: Rate,
    /// From the start of the schedule to this client's first request [ns]: clients take turns.
    offset: u64,
    end: u64,
    batch: usize,
    pace: Pace,
    stop: Option<&'a AtomicBool>,
}

impl<'a, C: Clock> Generator<'a, C> {
    fn new(config: &Config, input: &'a Input, clock: &'a C, index: usize) -> Self {
        Self {
            input,
            clock,
            rate: config.rate_of_client(),
            offset: config.rate.intended_ns(index as u64).unwrap_or(0),
            end: (config.warm_up + config.duration).as_nanos() as u64,
            batch: config.batch.get(),
            pace: config.pace,
            stop: None,
        }
    }

    fn due(&self, index: u64) -> Option<u64> {
        self.rate.intended_ns(index).map(|due| due + self.offset)
    }

    fn drive(
        &self,
        mut recording: Recording,
        send: &mut dyn FnMut(&[State]) -> Result<u64, SendError>,
        progress: &dyn Fn(&Progress),
    ) -> Recording {
        let Self { clock, end, .. } = *self;
        if self.pace == Pace::Sleep {
            // as in the control
            hiccup::sleep_exactly();
        }
        let mut states = vec![State::default(); self.batch];
        let (mut ideal, mut teller) = (Ideal::default(), Teller { told: 0, end });
        for index in 0.. {
            if self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
                recording.stopped = Some(clock.now());
                break;
            }
            let due = self.due(index);
            let next = due.unwrap_or_else(|| clock.now());
            if next >= end {
                break;
            }
            teller.tell(&recording, clock.now(), due, progress);
            self.input.fill(next as f64 * 1e-9, &mut states);
            let wait = wait_until(clock, next, self.pace);
            if wait.ended >= end + DRAIN_NS {
                let due_in_all = self.rate.due_before(end.saturating_sub(self.offset)).unwrap_or(index);
                let unsent = (index..due_in_all).filter_map(|index| self.due(index));
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
        let recording = Recording::new(config.warm_up, config.duration, 1);
        Generator::new(config, &Input::varying(&domain), clock, 0).drive(recording, send, progress)
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
