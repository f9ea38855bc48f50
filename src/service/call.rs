//! One request from its arrival to its answer, whichever transport it came by: deadline, evaluation, metrics, and a line in
//! the log where that is asked for.

use std::cell::RefCell;
use std::sync::Arc;
use std::time::Duration;

use tokio::time::Instant;
use tonic::{Request, Response, Status};

use super::admin::Reloader;
use super::taps::Taps;
use super::traces::Traces;
use crate::engine::Engine;
use crate::metrics::{self, Metrics, Transport};
use wade_core::served::ServedVehicle;
use wade_core::served::Session;
use wade_wire::{Evaluator, Refusal, nanoseconds_since, proto};

thread_local! {
    pub(super) static EVALUATOR: RefCell<Evaluator> = RefCell::default();
}

/// States of a batch, a map or a stream that are computed before others get their turn: about a millisecond.
pub(super) const STATES_PER_TURN: usize = 64;

/// What the handlers share.
#[derive(Debug, Clone)]
pub struct Shared {
    /// The models.
    pub engine: Arc<Engine>,
    /// Where requests are counted.
    pub metrics: Arc<Metrics>,
    /// Reads bundles again when an administrator asks.
    pub reloader: Arc<Reloader>,
    /// Length of the latency window [s].
    pub window_s: f64,
    /// Streams that can be looked at.
    pub taps: Arc<Taps>,
    /// Where spans go; none where nobody collects them.
    pub traces: Option<Arc<Traces>>,
}

/// What the metrics need to know of an answer.
#[derive(Debug)]
pub(super) struct Answered {
    pub(super) vehicle: Arc<ServedVehicle>,
    pub(super) out_of_domain: u64,
}

/// Answers one state on the thread that read it.
pub(super) fn answer_state(
    vehicle: &Arc<ServedVehicle>,
    state: Option<&proto::State>,
    session: Option<&mut Session>,
) -> Result<(proto::EvaluateResponse, Answered), Refusal> {
    let state = wade_wire::state(state.ok_or(Refusal::MissingState)?, vehicle)?.check_for(vehicle)?;
    EVALUATOR.with_borrow_mut(|evaluator| {
        let evaluated = evaluator.evaluate(vehicle, &state, session);
        let response = wade_wire::response(vehicle, &evaluated);
        let out_of_domain = u64::from(!response.in_domain);
        Ok((response, Answered { vehicle: Arc::clone(vehicle), out_of_domain }))
    })
}

/// When a request arrived that is answered by another thread than that which read it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrived(pub(super) Instant);

/// One request from its arrival to its answer: deadline, metrics and, where asked for, a line in the log.
pub(super) struct Call<'s> {
    shared: &'s Shared,
    transport: Transport,
    arrived: Instant,
    pub(super) deadline: Option<Instant>,
}

impl<'s> Call<'s> {
    pub(super) fn begin<T>(shared: &'s Shared, transport: Transport, request: &Request<T>) -> Self {
        let arrived = request.extensions().get().map_or_else(Instant::now, |Arrived(arrived)| *arrived);
        let header = request.metadata().get("grpc-timeout").and_then(|header| header.to_str().ok());
        let deadline = header.and_then(timeout).and_then(|timeout| arrived.checked_add(timeout));
        Self { shared, transport, arrived, deadline }
    }

    /// A request that arrives now.
    pub(super) fn arriving(shared: &'s Shared, transport: Transport, deadline: Option<Instant>) -> Self {
        Self { shared, transport, arrived: Instant::now(), deadline }
    }

    /// Brings the deadline forward to this long after the arrival.
    pub(super) fn limit(&mut self, timeout: Duration) {
        let limit = self.arrived.checked_add(timeout);
        self.deadline = [self.deadline, limit].into_iter().flatten().min();
    }

    pub(super) fn check_deadline(&self, answered: Option<usize>) -> Result<(), Refusal> {
        match self.deadline {
            Some(deadline) if Instant::now() >= deadline => Err(Refusal::DeadlineExceeded { answered }),
            _ => Ok(()),
        }
    }

    pub(super) fn end<T>(self, outcome: Result<(T, Answered), Refusal>) -> Result<Response<T>, Status> {
        Ok(Response::new(self.record(outcome)?))
    }

    /// Records the outcome.
    pub(super) fn record<T>(self, outcome: Result<(T, Answered), Refusal>) -> Result<T, Refusal> {
        match outcome {
            Ok((response, answered)) => {
                let vehicle = &answered.vehicle.model().vehicle().name;
                let elapsed = self.arrived.elapsed();
                self.shared.metrics.recorder(self.transport, vehicle).record(elapsed, answered.out_of_domain);
                tracing::debug!(target: "wade::request", transport = self.transport.name(), vehicle, ?elapsed);
                Ok(response)
            }
            Err(refusal) => Err(self.refuse(refusal)),
        }
    }

    fn refuse(self, refusal: Refusal) -> Refusal {
        self.shared.metrics.refuse(self.transport, refusal.reason());
        let elapsed_ns = nanoseconds_since(self.arrived.into_std());
        tracing::debug!(target: "wade::request", transport = self.transport.name(), %refusal, elapsed_ns);
        refusal
    }
}

/// A row of the latency table.
pub(super) fn latency(row: metrics::Latency) -> proto::Latency {
    let percentiles = |p: metrics::Percentiles| {
        Some(proto::Percentiles {
            count: p.count,
            p50_us: p.p50_us,
            p95_us: p.p95_us,
            p99_us: p.p99_us,
            p99_9_us: p.p99_9_us,
            max_us: p.max_us,
        })
    };
    proto::Latency {
        transport: row.transport.name().into(),
        vehicle: row.vehicle,
        since_start: percentiles(row.since_start),
        window: percentiles(row.window),
    }
}

/// The time that a `grpc-timeout` header leaves: up to eight digits and a unit.
fn timeout(header: &str) -> Option<Duration> {
    let (digits, unit) = header.split_at_checked(header.len().checked_sub(1)?)?;
    if digits.len() > 8 || !digits.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let value: u64 = digits.parse().ok()?;
    Some(match unit {
        "H" => Duration::from_secs(value * 3600),
        "M" => Duration::from_secs(value * 60),
        "S" => Duration::from_secs(value),
        "m" => Duration::from_millis(value),
        "u" => Duration::from_micros(value),
        "n" => Duration::from_nanos(value),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timeouts_have_a_value_and_a_unit() {
        assert_eq!(timeout("250m"), Some(Duration::from_millis(250)));
        assert_eq!(timeout("1n"), Some(Duration::from_nanos(1)));
        for bad in ["", "5", "m", "-1m", "123456789S", "5x", "µ"] {
            assert_eq!(timeout(bad), None, "{bad:?}");
        }
    }
}
