//! Queries, vehicles and latencies as JSON: the messages of `wade.v1.Hydrodynamics`, but the answers to a query and of how a vehicle
//! stands, which are the documents of `wade query --json` and `wade stability --json` too.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes, to_bytes};
use axum::extract::{Extension, Path, RawQuery, State};
use axum::response::Response;
use axum::routing::get;

use super::Shared;
use super::json;
use super::rejection::Rejection;
use crate::metrics::{Resource, Transport};
use crate::service::accounts::{Computing, Connection, Place};
use crate::service::answer::Answer;
use crate::service::call::{self, Call, answer_state};
use crate::service::stability::{Document, stability};
use wade_wire::{Refusal, proto};

/// Longest body [bytes]: a query with every field takes about one kilobyte.
const MAX_BODY: usize = 64 << 10;

/// The paths of this module.
pub fn routes() -> Router<Arc<Shared>> {
    Router::new()
        .route("/v1/query", get(by_parameters).post(by_body))
        .route("/v1/stability", get(stability_by_parameters).post(stability_by_body))
        .route("/v1/vehicles", get(vehicles))
        .route("/v1/vehicles/{name}", get(vehicle))
        .route("/v1/latency", get(latency))
}

async fn by_parameters(
    State(shared): State<Arc<Shared>>,
    Extension(connection): Extension<Arc<Connection>>,
    RawQuery(parameters): RawQuery,
) -> Result<Response, Rejection> {
    let text = json::from_parameters("wade.v1.EvaluateRequest", &parameters.unwrap_or_default())?;
    evaluate(&shared, &connection, &text)
}

async fn by_body(
    State(shared): State<Arc<Shared>>,
    Extension(connection): Extension<Arc<Connection>>,
    body: Body,
) -> Result<Response, Rejection> {
    let text = whole(&shared, body, MAX_BODY).await?;
    let _computing = Computing::begin(&connection);
    evaluate(&shared, &connection, &text)
}

/// A body that has arrived in time.
pub(super) async fn whole(shared: &Shared, body: Body, longest: usize) -> Result<Bytes, Rejection> {
    let late = |_| Refusal::DeadlineExceeded { answered: None };
    let patience = Duration::from_secs_f64(shared.config.request_s);
    let text = tokio::time::timeout(patience, to_bytes(body, longest)).await.map_err(late)?;
    // the other errors are those of a connection that is gone, whom no answer reaches
    text.map_err(|_| Rejection::TooLong { limit: longest })
}

/// A place among the requests or the batches, held while one is computed.
pub(super) fn admit(
    shared: &Shared,
    connection: &Arc<Connection>,
    resource: Resource,
) -> Result<Place, Refusal> {
    let overloaded = |overloaded| Refusal::Overloaded { what: resource.name(), overloaded };
    shared.accounts.take(connection, resource, 1).map_err(overloaded)
}

/// Answers on this thread, as gRPC does on its own.
fn evaluate(shared: &Shared, connection: &Arc<Connection>, text: &[u8]) -> Result<Response, Rejection> {
    let call = Call::arriving(&shared.grpc, Transport::http, None);
    let request: proto::EvaluateRequest = read(shared, "wade.v1.EvaluateRequest", text)?;
    let mut names = Vec::new();
    let answer = admit(shared, connection, Resource::requests).and_then(|_place| {
        let vehicle = shared.grpc.engine.vehicle(&request.vehicle)?;
        names = vehicle.model().vehicle().surfaces.iter().map(|surface| surface.name.clone()).collect();
        answer_state(&vehicle, request.state.as_ref(), None)
    });
    let response = call.record(answer)?;
    Ok(json::document(&Answer::new(&request.vehicle, &names, response)))
}

/// Reads a message of this name; what is none is counted.
pub(super) fn read<M: prost::Message + Default>(
    shared: &Shared,
    name: &str,
    text: &[u8],
) -> Result<M, Rejection> {
    json::read(name, text).inspect_err(|_| shared.grpc.metrics.refuse(Transport::http, "invalid_argument"))
}

async fn stability_by_parameters(
    State(shared): State<Arc<Shared>>,
    Extension(connection): Extension<Arc<Connection>>,
    RawQuery(parameters): RawQuery,
) -> Result<Response, Rejection> {
    let text = json::from_parameters("wade.v1.GetStabilityRequest", &parameters.unwrap_or_default())?;
    stand(&shared, &connection, &text).await
}

async fn stability_by_body(
    State(shared): State<Arc<Shared>>,
    Extension(connection): Extension<Arc<Connection>>,
    body: Body,
) -> Result<Response, Rejection> {
    let text = whole(&shared, body, MAX_BODY).await?;
    let _computing = Computing::begin(&connection);
    stand(&shared, &connection, &text).await
}

/// How a vehicle stands, on this thread and between others.
async fn stand(shared: &Shared, connection: &Arc<Connection>, text: &[u8]) -> Result<Response, Rejection> {
    let call = Call::arriving(&shared.grpc, Transport::http, None);
    let request: proto::GetStabilityRequest = read(shared, "wade.v1.GetStabilityRequest", text)?;
    let answer = async {
        let _place = admit(shared, connection, Resource::batches)?;
        stability(&call, shared.grpc.engine.vehicle(&request.vehicle)?, &request).await
    };
    let answer = answer.await;
    let response = call.record(answer)?;
    Ok(json::compact(&Document::new(&request, &response, false)))
}

async fn vehicles(State(shared): State<Arc<Shared>>) -> Response {
    let vehicles = shared.grpc.engine.vehicles();
    let vehicles = vehicles.values().map(|vehicle| wade_wire::summary(vehicle)).collect();
    json::write("wade.v1.ListVehiclesResponse", &proto::ListVehiclesResponse { vehicles })
}

async fn vehicle(State(shared): State<Arc<Shared>>, Path(name): Path<String>) -> Result<Response, Rejection> {
    let vehicle = shared.grpc.engine.vehicle(&name).map_err(Refusal::from)?;
    Ok(json::write("wade.v1.GetVehicleResponse", &wade_wire::vehicle(&vehicle, false)))
}

async fn latency(State(shared): State<Arc<Shared>>) -> Response {
    let latencies = shared.grpc.metrics.latencies().into_iter().map(call::latency).collect();
    let response = proto::GetLatencyResponse { latencies, window_s: shared.grpc.window_s };
    json::write("wade.v1.GetLatencyResponse", &response)
}
