//! The calls.

use std::sync::Arc;

use tokio::sync::watch;
use tonic::{Request, Response, Status, Streaming};

use super::stream::Answers;
use crate::metrics::Transport;
use crate::service::admin::{Job, Jobs};
use crate::service::batch::batch;
use crate::service::call::{self, Answered, Call, Shared, answer_state};
use crate::service::stability::stability;
use wade_core::served::ServedVehicle;
use wade_wire::proto::admin_server::Admin;
use wade_wire::proto::hydrodynamics_server::Hydrodynamics;
use wade_wire::{Refusal, proto};

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
            self.shared.engine.vehicles().values().map(|vehicle| wade_wire::summary(vehicle)).collect();
        Ok(Response::new(proto::ListVehiclesResponse { vehicles }))
    }

    async fn get_vehicle(
        &self,
        request: Request<proto::GetVehicleRequest>,
    ) -> Result<Response<proto::GetVehicleResponse>, Status> {
        let request = request.get_ref();
        let vehicle = self.shared.engine.vehicle(&request.vehicle).map_err(Refusal::from)?;
        Ok(Response::new(wade_wire::vehicle(&vehicle, request.include_mesh)))
    }

    async fn get_stability(
        &self,
        request: Request<proto::GetStabilityRequest>,
    ) -> Result<Response<proto::GetStabilityResponse>, Status> {
        let call = Call::begin(&self.shared, self.names.batch, &request);
        let request = request.get_ref();
        let answer = match self.shared.engine.vehicle(&request.vehicle) {
            Ok(vehicle) => stability(&call, vehicle, request).await,
            Err(unknown) => Err(unknown.into()),
        };
        call.end(answer)
    }

    async fn get_latency(
        &self,
        _: Request<proto::GetLatencyRequest>,
    ) -> Result<Response<proto::GetLatencyResponse>, Status> {
        let latencies = self.shared.metrics.latencies().into_iter().map(call::latency).collect();
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
        batch(call, vehicle, request, self.max_batch).await
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
        let caller = request.extensions().get().cloned();
        let proto::ReloadRequest { vehicle, bundle } = request.into_inner();
        let job = Job::Reload { vehicle, bundle: bundle.into() };
        let vehicles = self.jobs.run(job, caller.as_ref()).await?;
        Ok(Response::new(proto::ReloadResponse { vehicles }))
    }
}
