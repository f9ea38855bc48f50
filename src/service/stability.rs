//! How a vehicle stands over a map of depths and speeds: computed on the thread that read the request, turn by turn, and as JSON, one
//! document for `/v1/stability` and `wade stability --json`.

use std::sync::Arc;

use serde::Serialize;

use super::call::{Answered, Call, EVALUATOR, STATES_PER_TURN};
use wade_core::served::ServedVehicle;
use wade_wire::{Refusal, StabilityStates, proto};

/// Answers a request for this version of its vehicle.
pub(super) async fn stability(
    call: &Call<'_>,
    vehicle: Arc<ServedVehicle>,
    request: &proto::GetStabilityRequest,
) -> Result<(proto::GetStabilityResponse, Answered), Refusal> {
    let states = StabilityStates::check(request, &vehicle)?;
    let mut response = states.response(&vehicle);
    for start in (0..states.len()).step_by(STATES_PER_TURN) {
        if start > 0 {
            tokio::task::yield_now().await;
        }
        call.check_deadline(Some(start))?;
        let turn = start..states.len().min(start + STATES_PER_TURN);
        EVALUATOR
            .with_borrow_mut(|evaluator| states.push(&mut response, turn, (&vehicle, evaluator)))
            .map_err(|invalid| Refusal::Invalid { invalid, index: Some(start) })?;
    }
    let out_of_domain = response.in_domain.iter().filter(|in_domain| !**in_domain).count() as u64;
    Ok((response, Answered { vehicle, out_of_domain }))
}

/// One value, or a row for each depth with a value for each speed.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Shaped<T> {
    One(T),
    Map(Vec<Vec<T>>),
}

#[derive(Debug, Serialize)]
struct Modes {
    floats: Shaped<f32>,
    slides: Shaped<f32>,
    topples: Shaped<f32>,
    steers: Option<Shaped<f32>>,
}

#[derive(Debug, Serialize)]
struct Friction {
    min: f32,
    max: f32,
}

#[derive(Debug, Serialize)]
struct Foot {
    surface: String,
    at: [f32; 2],
    normal_force: Shaped<f32>,
}

/// How a vehicle stands, ready to be written.
#[derive(Debug, Serialize)]
pub struct Document {
    vehicle: String,
    version: u32,
    provenance: String,
    depth: Vec<f32>,
    speed: Vec<f32>,
    heading: f32,
    friction: Friction,
    /// Probabilities.
    #[serde(flatten)]
    probability: Modes,
    margins: Modes,
    /// None where it floats.
    friction_needed: Shaped<f32>,
    normal_forces: Vec<Foot>,
    in_domain: Shaped<bool>,
    compute_ns: u64,
}

impl Document {
    /// The answer to a request; of a single state, where it is for `one`, numbers in the place of rows.
    pub fn new(
        request: &proto::GetStabilityRequest,
        response: &proto::GetStabilityResponse,
        one: bool,
    ) -> Self {
        let shape = Shape { one, row: request.speed_mps.len() };
        let modes = |modes: &Option<proto::StabilityModes>| {
            let modes = modes.clone().unwrap_or_default();
            Modes {
                floats: shape.of(&modes.floats),
                slides: shape.of(&modes.slides),
                topples: shape.of(&modes.topples),
                steers: (!modes.steers.is_empty()).then(|| shape.of(&modes.steers)),
            }
        };
        let forces = &response.normal_force_n;
        let foot = |(i, foot): (usize, &proto::Foot)| {
            let own: Vec<f32> = forces.iter().skip(i).step_by(response.feet.len()).copied().collect();
            Foot { surface: foot.surface.clone(), at: [foot.x_m, foot.y_m], normal_force: shape.of(&own) }
        };
        let feet = response.feet.iter().enumerate().filter(|_| !forces.is_empty());
        Self {
            vehicle: request.vehicle.clone(),
            version: response.bundle_version,
            provenance: response.provenance.clone(),
            depth: request.depth_m.clone(),
            speed: request.speed_mps.clone(),
            heading: request.heading_rad,
            friction: Friction { min: response.friction_min, max: response.friction_max },
            probability: modes(&response.probability),
            margins: modes(&response.margin),
            friction_needed: shape.of(&response.friction_needed),
            normal_forces: feet.map(foot).collect(),
            in_domain: shape.of(&response.in_domain),
            compute_ns: response.compute_ns,
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Shape {
    one: bool,
    /// Values in a row.
    row: usize,
}

impl Shape {
    fn of<T: Copy>(self, values: &[T]) -> Shaped<T> {
        match values {
            [value] if self.one => Shaped::One(*value),
            values => Shaped::Map(values.chunks(self.row.max(1)).map(<[T]>::to_vec).collect()),
        }
    }
}
