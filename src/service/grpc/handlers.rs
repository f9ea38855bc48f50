//! The calls.

use std::cell::RefCell;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::watch;
use tonic::{Request, Response, Status, Streaming};

use super::Shared;
use super::convert;
use super::stream::Answers;
use crate::effects::Session;
use crate::metrics::Transport;
use crate::served::ServedVehicle;
use crate::service::admin::{Job, Jobs};
use crate::service::proto::admin_server::Admin;
use crate::service::proto::hydrodynamics_server::Hydrodynamics;
use crate::service::wire::Refusal;
use crate::service::{Evaluator, nanoseconds_since, proto};

/// States of a batch or a stream that are computed before others get their turn: about a millisecond.
pub(super) const STATES_PER_TURN: usize = 64;

thread_local! {
    static EVALUATOR: RefCell<Evaluator> = RefCell::default();
}

/// What the metrics call the calls of one listener.
#[derive(Debug, Clone, Copy)]
pub struct Names {
    pub(super) unary: Transport,
    pub(super) batch: Transport,
    pub(super) stream: Transport,
    pub(super) infer: Transport,
    pub(super) other: Transport,
}

/// The TCP listener's.
pub(super) const TCP: Names = Names {
    unary: Transport::grpc_unary,
    batch: Transport::grpc_batch,
    stream: Transport::grpc_stream,
    infer: Transport::grpc_infer,
    other: Transport::grpc_other,
};
/// The Unix socket's.
pub(super) const UNIX: Names = Names {
    unary: Transport::uds_unary,
    batch: Transport::uds_batch,
    stream: Transport::uds_stream,
    infer: Transport::uds_infer,
    other: Transport::uds_other,
};

/// The handlers of `wade.v1.Hydrodynamics`.
#[derive(Debug, Clone)]
pub struct Handlers {
    pub(super) shared: Shared,
    pub(super) names: Names,
    pub(super) max_batch: usize,
    pub(super) stop: watch::Receiver<bool>,
}

#[tonic::async_trait]
impl Hydrodynamics for Handlers {
    type StreamStream = Answers;

    async fn evaluate(
        &self,
        request: Request<proto::EvaluateRequest>,
    ) -> Result<Response<proto::EvaluateResponse>, Status> {
        let call = Call::begin(&self.shared, self.names.unary, &request);
        let request = request.get_ref();
        let vehicle = self.shared.engine.vehicle(&request.vehicle).map_err(Refusal::from);
        let answer = vehicle.and_then(|vehicle| {
            call.check_deadline(None)?;
            answer_state(&vehicle, request.state.as_ref(), None)
        });
        call.end(answer)
    }

    async fn evaluate_batch(
        &self,
        request: Request<proto::EvaluateBatchRequest>,
    ) -> Result<Response<proto::EvaluateBatchResponse>, Status> {
        let call = Call::begin(&self.shared, self.names.batch, &request);
        let answer = self.batch(&call, request.get_ref()).await;
        call.end(answer)
    }

    async fn stream(
        &self,
        request: Request<Streaming<proto::EvaluateRequest>>,
    ) -> Result<Response<Self::StreamStream>, Status> {
        let call = Call::begin(&self.shared, self.names.stream, &request);
        let (shared, names) = (self.shared.clone(), self.names);
        let deadline = call.deadline;
        Ok(Response::new(Answers::new(request.into_inner(), shared, names.stream, deadline)))
    }

    async fn list_vehicles(
        &self,
        _: Request<proto::ListVehiclesRequest>,
    ) -> Result<Response<proto::ListVehiclesResponse>, Status> {
        let vehicles =
            self.shared.engine.vehicles().values().map(|vehicle| convert::summary(vehicle)).collect();
        Ok(Response::new(proto::ListVehiclesResponse { vehicles }))
    }

    async fn get_vehicle(
        &self,
        request: Request<proto::GetVehicleRequest>,
    ) -> Result<Response<proto::GetVehicleResponse>, Status> {
        let request = request.get_ref();
        let vehicle = self.shared.engine.vehicle(&request.vehicle).map_err(Refusal::from)?;
        Ok(Response::new(convert::vehicle(&vehicle, request.include_mesh)))
    }

    async fn get_latency(
        &self,
        _: Request<proto::GetLatencyRequest>,
    ) -> Result<Response<proto::GetLatencyResponse>, Status> {
        let latencies = self.shared.metrics.latencies().into_iter().map(convert::latency).collect();
        Ok(Response::new(proto::GetLatencyResponse { latencies, window_s: self.shared.window_s }))
    }
}

impl Handlers {
    async fn batch(
        &self,
        call: &Call<'_>,
        request: &proto::EvaluateBatchRequest,
    ) -> Result<(proto::EvaluateBatchResponse, Answered), Refusal> {
        self.batch_of(call, self.shared.engine.vehicle(&request.vehicle)?, request).await
    }

    /// Answers a batch for this version of its vehicle.
    pub(super) async fn batch_of(
        &self,
        call: &Call<'_>,
        vehicle: Arc<ServedVehicle>,
        request: &proto::EvaluateBatchRequest,
    ) -> Result<(proto::EvaluateBatchResponse, Answered), Refusal> {
        let states = convert::batch(request, self.max_batch)?;
        let with_surfaces = !request.omit_surfaces;
        let mut response = convert::batch_response(&vehicle, states.len(), with_surfaces);
        for (turn, states) in states.chunks(STATES_PER_TURN).enumerate() {
            if turn > 0 {
                tokio::task::yield_now().await;
            }
            EVALUATOR.with_borrow_mut(|evaluator| {
                for (i, state) in states.iter().enumerate() {
                    let index = turn * STATES_PER_TURN + i;
                    call.check_deadline(Some(index))?;
                    let evaluated = evaluator
                        .evaluate(&vehicle, state, None)
                        .map_err(|invalid| Refusal::Invalid { invalid, index: Some(index) })?;
                    convert::push(&mut response, &evaluated, index as u32, with_surfaces);
                }
                Ok::<(), Refusal>(())
            })?;
        }
        let mut outside: Vec<u32> = response.outside.iter().map(|outside| outside.index).collect();
        outside.dedup();
        let out_of_domain = outside.len() as u64;
        Ok((response, Answered { vehicle, out_of_domain }))
    }
}

/// What the metrics need to know of an answer.
#[derive(Debug)]
pub(in crate::service) struct Answered {
    vehicle: Arc<ServedVehicle>,
    out_of_domain: u64,
}

/// Answers one state on the thread that read it.
pub(in crate::service) fn answer_state(
    vehicle: &Arc<ServedVehicle>,
    state: Option<&proto::State>,
    session: Option<&mut Session>,
) -> Result<(proto::EvaluateResponse, Answered), Refusal> {
    let state = convert::state(state.ok_or(Refusal::MissingState)?)?;
    EVALUATOR.with_borrow_mut(|evaluator| {
        let evaluated = evaluator.evaluate(vehicle, &state, session)?;
        let response = convert::response(vehicle, &evaluated);
        let out_of_domain = u64::from(!response.in_domain);
        Ok((response, Answered { vehicle: Arc::clone(vehicle), out_of_domain }))
    })
}

/// One request from its arrival to its answer: deadline, metrics and, where asked for, a line in the log.
pub(in crate::service) struct Call<'s> {
    shared: &'s Shared,
    transport: Transport,
    arrived: Instant,
    deadline: Option<Instant>,
}

impl<'s> Call<'s> {
    pub(super) fn begin<T>(shared: &'s Shared, transport: Transport, request: &Request<T>) -> Self {
        let arrived = Instant::now();
        let timeout = request.metadata().get("grpc-timeout").and_then(|header| header.to_str().ok());
        let deadline = timeout.and_then(convert::timeout).and_then(|timeout| arrived.checked_add(timeout));
        Self { shared, transport, arrived, deadline }
    }

    /// A request that arrives now.
    pub(in crate::service) fn arriving(
        shared: &'s Shared,
        transport: Transport,
        deadline: Option<Instant>,
    ) -> Self {
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
    pub(in crate::service) fn record<T>(self, outcome: Result<(T, Answered), Refusal>) -> Result<T, Refusal> {
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
        let elapsed_ns = nanoseconds_since(self.arrived);
        tracing::debug!(target: "wade::request", transport = self.transport.name(), %refusal, elapsed_ns);
        refusal
    }
}

/// The handlers of `wade.v1.Admin`.
#[derive(Debug)]
pub struct AdminHandlers {
    pub(super) jobs: Arc<Jobs>,
}

#[tonic::async_trait]
impl Admin for AdminHandlers {
    async fn reload(
        &self,
        request: Request<proto::ReloadRequest>,
    ) -> Result<Response<proto::ReloadResponse>, Status> {
        let proto::ReloadRequest { vehicle, bundle } = request.into_inner();
        let vehicles = self.jobs.run(Job::Reload { vehicle, bundle: bundle.into() }).await?;
        Ok(Response::new(proto::ReloadResponse { vehicles }))
    }
}
