//! The streams of clients, looked at while they run.

use std::sync::Arc;

use axum::Router;
use axum::extract::{Path, State};
use axum::response::Response;
use axum::routing::get;
use serde::Serialize;
use tokio::time::Instant;

use super::rejection::Rejection;
use super::{Shared, json};
use crate::service::answer::Answer;
use crate::service::taps::Seen;
use wade_core::served::ServedVehicle;
use wade_wire::Refusal;

/// The paths of this module.
pub fn routes() -> Router<Arc<Shared>> {
    Router::new().route("/v1/streams", get(list)).route("/v1/streams/{id}", get(one))
}

#[derive(Debug, Serialize)]
struct Stream {
    id: u64,
    transport: &'static str,
    /// Since it was opened [s].
    age_s: f64,
}

#[derive(Debug, Serialize)]
struct Streams {
    streams: Vec<Stream>,
}

/// A state as a person sets it; SI units, radians.
#[derive(Debug, Serialize)]
struct Shown {
    /// Through the water, body frame.
    velocity: [f32; 3],
    roll: f32,
    pitch: f32,
    /// At the body origin, over the ground-contact plane.
    depth: f32,
    density: f32,
    dry: bool,
}

#[derive(Debug, Serialize)]
struct Look {
    id: u64,
    vehicle: String,
    /// Since it was answered [s].
    age_s: f64,
    state: Shown,
    answer: Answer,
}

async fn list(State(shared): State<Arc<Shared>>) -> Response {
    let stream = |tap: Arc<crate::service::taps::Tap>| Stream {
        id: tap.id,
        transport: tap.transport.name(),
        age_s: tap.since.elapsed().as_secs_f64(),
    };
    json::document(&Streams { streams: shared.grpc.taps.list().into_iter().map(stream).collect() })
}

/// The latest answer of a stream; an empty document until there is one.
async fn one(State(shared): State<Arc<Shared>>, Path(id): Path<u64>) -> Result<Response, Rejection> {
    let tap = shared.grpc.taps.find(id).ok_or(Rejection::NoSuchStream { id })?;
    let Some(seen) = tap.look() else { return Ok(json::document(&serde_json::json!({}))) };
    let vehicle = shared.grpc.engine.vehicle(&seen.vehicle).map_err(Refusal::from)?;
    let names: Vec<String> =
        vehicle.model().vehicle().surfaces.iter().map(|surface| surface.name.clone()).collect();
    Ok(json::document(&Look {
        id,
        age_s: Instant::now().duration_since(seen.at).as_secs_f64(),
        state: shown(&seen, &vehicle)?,
        answer: Answer::new(&seen.vehicle, &names, seen.answer),
        vehicle: seen.vehicle,
    }))
}

fn shown(seen: &Seen, vehicle: &ServedVehicle) -> Result<Shown, Refusal> {
    let state = wade_wire::state(&seen.state, vehicle)?;
    let checked = state.check_for(vehicle)?;
    let condition = checked.condition().resolved(vehicle.model().vehicle().z0);
    let up = condition.up;
    Ok(Shown {
        velocity: wade_wire::single(&condition.velocity),
        roll: up.y.atan2(up.z) as f32,
        pitch: (-up.x).atan2(up.y.hypot(up.z)) as f32,
        depth: condition.depth as f32,
        density: condition.density as f32,
        dry: state.dry_contact,
    })
}
