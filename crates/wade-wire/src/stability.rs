//! Requests for how a vehicle stands, and their answers.

use wade_core::frame::up_from_roll_pitch;
use wade_core::served::ServedVehicle;
use wade_core::stability::{Friction, Modes, Stability, Stance};

use super::evaluator::{Evaluator, nanoseconds_since};
use super::proto;
use super::refusal::Refusal;
use super::state::{CheckedState, Field, InvalidState, State, limit};
use super::{convert, single};

/// Most pairs of a depth and a speed in one request: the answer to these fits into a message of 4 MiB.
pub const MAX_STATES: usize = 100_000;

/// Greatest friction that a request may state [-]: no tire has more.
const MAX_FRICTION: f32 = 10.0;

/// Why a request has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StabilityFault {
    /// No depth, or no speed.
    #[error("{field} must have at least one value")]
    Empty {
        /// Which.
        field: &'static str,
    },
    /// More than [`MAX_STATES`].
    #[error("{depths} depths and {speeds} speeds are {} states, the limit is {MAX_STATES}", depths * speeds)]
    TooMany {
        /// Number of depths.
        depths: usize,
        /// Number of speeds.
        speeds: usize,
    },
    /// A number outside its range.
    #[error("{field} must lie between {low} and {high}, and is {value}")]
    OutOfRange {
        /// Its name, with its place in an array.
        field: String,
        /// Least.
        low: f64,
        /// Greatest.
        high: f64,
        /// What was given.
        value: f32,
    },
    /// The vehicle lies on its side or its back.
    #[error("roll_pitch must leave the vehicle on its wheels")]
    NotUpright,
    /// Nothing of the vehicle touches the ground-contact plane.
    #[error(
        "{vehicle} stands on nothing: no wheel, track or corner of its hull reaches its ground-contact plane"
    )]
    NoFeet {
        /// The vehicle.
        vehicle: String,
    },
}

impl StabilityFault {
    /// The field of the request.
    pub fn field(&self) -> &str {
        match self {
            Self::Empty { field } => field,
            Self::TooMany { .. } => "depth_m",
            Self::OutOfRange { field, .. } => field,
            Self::NotUpright => "roll_pitch",
            Self::NoFeet { .. } => "vehicle",
        }
    }
}

/// A number between two; a NaN is not.
fn between(field: impl Fn() -> String, value: f32, [low, high]: [f64; 2]) -> Result<f32, StabilityFault> {
    if (low..=high).contains(&f64::from(value)) {
        return Ok(value);
    }
    Err(StabilityFault::OutOfRange { field: field(), low, high, value })
}

/// A request that has been checked.
#[derive(Debug)]
pub struct StabilityStates<'r> {
    request: &'r proto::GetStabilityRequest,
    friction: Friction,
    stance: Stance,
    /// All but depth and speed.
    state: State,
    /// Share of the motion through the water that is motion over the bed.
    bed: f32,
}

impl<'r> StabilityStates<'r> {
    /// Checks a request for a vehicle.
    pub fn check(request: &'r proto::GetStabilityRequest, vehicle: &ServedVehicle) -> Result<Self, Refusal> {
        let (depths, speeds) = (request.depth_m.len(), request.speed_mps.len());
        for (field, count) in [("depth_m", depths), ("speed_mps", speeds)] {
            if count == 0 {
                return Err(StabilityFault::Empty { field }.into());
            }
        }
        if depths.saturating_mul(speeds) > MAX_STATES {
            return Err(StabilityFault::TooMany { depths, speeds }.into());
        }
        let fastest = limit(Field::Velocity);
        for (i, &speed) in request.speed_mps.iter().enumerate() {
            between(|| format!("speed_mps[{i}]"), speed, [0.0, fastest])?;
        }
        for (i, &depth) in request.depth_m.iter().enumerate() {
            let deepest = limit(Field::Depth);
            between(|| format!("depth_m[{i}]"), depth, [-deepest, deepest])?;
        }
        let turns = limit(Field::RollPitch);
        between(|| "heading_rad".into(), request.heading_rad, [-turns, turns])?;
        let bed = between(|| "bed".into(), request.bed.unwrap_or(0.0), [0.0, 1.0])?;
        let stance = Stance::of(vehicle.model().vehicle());
        if stance.footing().feet().is_empty() {
            return Err(StabilityFault::NoFeet { vehicle: vehicle.model().vehicle().name.clone() }.into());
        }
        let slope = request.roll_pitch.unwrap_or_default();
        let roll = between(|| "roll_pitch.roll_rad".into(), slope.roll_rad, [-turns, turns])?;
        let pitch = between(|| "roll_pitch.pitch_rad".into(), slope.pitch_rad, [-turns, turns])?;
        let up = up_from_roll_pitch(roll.into(), pitch.into());
        if up.z < wade_core::condition::LEAST_UPRIGHT {
            return Err(StabilityFault::NotUpright.into());
        }
        let default = State::default();
        let thin = f64::from(f32::MIN_POSITIVE);
        let density = request.density_kgpm3.unwrap_or(default.density);
        let state = State {
            gravity: single(&-up.into_inner()),
            // the vehicle stands, also in water that would lift it
            bed_clearance: Some(0.0),
            bed: Some(bed),
            density: between(|| "density_kgpm3".into(), density, [thin, limit(Field::Density)])?,
            dry_contact: convert::is_dry(request.ground_contact)?,
            ..default
        };
        Ok(Self { request, friction: friction(request)?, stance, state, bed })
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.request.depth_m.len() * self.request.speed_mps.len()
    }

    /// Never true.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn state(&self, index: usize, vehicle: &ServedVehicle) -> Result<CheckedState, InvalidState> {
        let speeds = &self.request.speed_mps;
        let (depth, speed) = (self.request.depth_m[index / speeds.len()], speeds[index % speeds.len()]);
        let (sine, cosine) = self.request.heading_rad.sin_cos();
        let through = [speed * cosine, speed * sine, 0.0];
        let state = State {
            depth,
            velocity: through.map(|part| part * self.bed),
            current: through.map(|part| part * (self.bed - 1.0)),
            ..self.state
        };
        state.check_for(vehicle)
    }

    /// An answer without rows.
    pub fn response(&self, vehicle: &ServedVehicle) -> proto::GetStabilityResponse {
        let names = &vehicle.model().vehicle().surfaces;
        let feet = self.stance.footing().feet();
        let foot = |foot: &wade_core::stability::Foot| proto::Foot {
            surface: names[foot.surface].name.clone(),
            x_m: foot.at.x as f32,
            y_m: foot.at.y as f32,
        };
        proto::GetStabilityResponse {
            probability: Some(proto::StabilityModes::default()),
            margin: Some(proto::StabilityModes::default()),
            feet: feet.iter().map(foot).collect(),
            friction_min: self.friction.min as f32,
            friction_max: self.friction.max as f32,
            bundle_version: vehicle.model().version(),
            provenance: vehicle.model().provenance().to_owned(),
            ..proto::GetStabilityResponse::default()
        }
    }

    /// Adds the rows of these states to an answer.
    pub fn push(
        &self,
        response: &mut proto::GetStabilityResponse,
        states: std::ops::Range<usize>,
        (vehicle, evaluator): (&ServedVehicle, &mut Evaluator),
    ) -> Result<(), InvalidState> {
        let start = std::time::Instant::now();
        for index in states {
            let state = self.state(index, vehicle)?;
            let forces = evaluator.evaluate(vehicle, &state, None).forces;
            let up = &state.condition().up;
            let Stability { chances, margins, friction_needed } =
                self.stance.stability(forces, up, &self.friction);
            add(response.probability.get_or_insert_default(), &chances);
            add(response.margin.get_or_insert_default(), &margins);
            response.friction_needed.push(friction_needed as f32);
            response.in_domain.push(forces.outside.is_inside());
            if self.request.normal_forces {
                let normal_forces = self.stance.normal_forces(forces, up);
                response.normal_force_n.extend(normal_forces.into_iter().map(|force| force as f32));
            }
        }
        response.compute_ns += nanoseconds_since(start);
        Ok(())
    }
}

/// Answers a whole request on this thread.
pub fn stability(
    request: &proto::GetStabilityRequest,
    vehicle: &ServedVehicle,
    evaluator: &mut Evaluator,
) -> Result<proto::GetStabilityResponse, Refusal> {
    let states = StabilityStates::check(request, vehicle)?;
    let mut response = states.response(vehicle);
    states.push(&mut response, 0..states.len(), (vehicle, evaluator))?;
    Ok(response)
}

fn add(rows: &mut proto::StabilityModes, modes: &Modes<f64>) {
    rows.floats.push(modes.floats as f32);
    rows.slides.push(modes.slides as f32);
    rows.topples.push(modes.topples as f32);
    rows.steers.extend(modes.steers.map(|steers| steers as f32));
}

fn friction(request: &proto::GetStabilityRequest) -> Result<Friction, StabilityFault> {
    let least = f64::from(f32::MIN_POSITIVE);
    let checked = |field: &'static str, value: Option<f32>, low: f64| {
        value.map(|value| between(|| field.into(), value, [low, MAX_FRICTION.into()])).transpose()
    };
    let min = checked("friction_min", request.friction_min, least)?;
    let max = checked("friction_max", request.friction_max, min.map_or(least, f64::from))?;
    Ok(match (min, max) {
        (None, None) => Friction::PUBLISHED,
        (Some(friction), None) | (None, Some(friction)) => Friction::of(friction.into()),
        (Some(min), Some(max)) => Friction { min: min.into(), max: max.into() },
    })
}
