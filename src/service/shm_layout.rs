//! What lies in shared memory: fixed-size, little-endian as the machine is, versioned in the service's name.
//!
//! | service | pattern | request | response |
//! | --- | --- | --- | --- |
//! | `<namespace>/v3/evaluate/<vehicle>` | request-response | [`Query`] | [`Answer`] |
//! | `<namespace>/v3/evaluate_batch/<vehicle>` | request-response | [`BatchQuery`] | [`BatchAnswer`] |
//! | `<namespace>/v3/wake` | event | a client wakes the server | |
//! | `<namespace>/v3/done` | event | the server wakes the one client whose listener is called [`wake_name`] | |
//! | `<namespace>/served` | event | nobody connects: its attributes tell [`SERVED_LAYOUT`] and [`SERVED_VEHICLES`], in every version | |
//!
//! The namespace is `wade` unless the server's configuration says otherwise.
//!
//! A field is never reused with another meaning: a change of layout is a new version in the names.

use iceoryx2::prelude::ZeroCopySend;

use super::wire::{Field, InvalidState, Problem, State};
use crate::domain::{Outside, Quantity};
use crate::effects::{BoxQuantity, PHYSICS};
use crate::served::ServedVehicle;
use crate::vehicle::MAX_SURFACES;

use super::Evaluated;
use super::grpc::{added_mass, single};

/// Most states in one batch request.
pub const MAX_BATCH: usize = 256;
/// Length of the provenance, which is cut to fit.
pub const PROVENANCE_LEN: usize = 32;

/// Version of the layout, as the names of the services have it.
pub const VERSION: &str = "v3";

/// Attribute of [`Names::served`]: the version of the layout.
pub const SERVED_LAYOUT: &str = "layout";
/// Attribute of [`Names::served`], as often as it takes: names of vehicles that are served, with a space between them.
pub const SERVED_VEHICLES: &str = "vehicles";

/// Names of the services of one server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Names {
    namespace: String,
}

impl Names {
    /// The names that begin with a namespace.
    pub fn new(namespace: &str) -> Self {
        Self { namespace: namespace.to_owned() }
    }

    /// A vehicle's service for single queries.
    pub fn evaluate(&self, vehicle: &str) -> String {
        format!("{}/{VERSION}/evaluate/{vehicle}", self.namespace)
    }

    /// A vehicle's service for batches.
    pub fn evaluate_batch(&self, vehicle: &str) -> String {
        format!("{}/{VERSION}/evaluate_batch/{vehicle}", self.namespace)
    }

    /// Service whose attributes tell which layout and vehicles are served, whatever the version of the layout.
    pub fn served(&self) -> String {
        format!("{}/served", self.namespace)
    }

    /// Event service on which clients wake the server.
    pub fn wake(&self) -> String {
        format!("{}/{VERSION}/wake", self.namespace)
    }

    /// Event service on which the server wakes clients.
    pub fn done(&self) -> String {
        format!("{}/{VERSION}/done", self.namespace)
    }
}

/// Name of the listener of a client with this wake key.
pub fn wake_name(key: u64) -> String {
    format!("{key:016x}")
}

/// Flag of [`Query::flags`]: no water pressure under the contact patches.
pub const DRY_CONTACT: u32 = 1;
/// Flag of [`Query::flags`]: the caller adds [`Answer::added_mass`] to his own mass matrix, so that forces leave
/// `-M_A nu_dot` out and keep the rest.
pub const IMPLICIT_ADDED_MASS: u32 = 2;
/// Flag of [`Query::flags`]: `heading_rad` holds a value.
pub const HAS_HEADING: u32 = 4;
/// Flag of [`Query::flags`]: `depth_rate_mps` holds a value.
pub const HAS_DEPTH_RATE: u32 = 8;
/// Flag of [`Query::flags`]: `wheel_speed_radps` holds values.
pub const HAS_WHEEL_SPEEDS: u32 = 16;
/// Flag of [`Answer::flags`]: the server polls, so that waking it is of no use.
pub const SERVER_POLLS: u32 = 1;
/// Flag of [`Answer::flags`]: the session begins with this query, at rest and dry. In the middle of a run it says that the
/// server has forgotten the session, for another server or for too many sessions.
pub const SESSION_BEGINS: u32 = 2;
/// Flag of [`Answer::flags`]: `added_mass` holds a matrix.
pub const HAS_ADDED_MASS: u32 = 4;

/// A state and who asks. 136 bytes.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v3::Query")]
pub struct Query {
    /// The client's own number, given back in the answer.
    pub sequence: u64,
    /// Name, as a number, of the client's listener on [`Names::done`]; 0 where the client polls.
    pub wake_key: u64,
    /// The client's own number of a run of states that follow each other, for effects that remember; 0 for none. A client
    /// may run many at a time, one an environment; those of other clients are apart.
    pub session: u64,
    /// [`DRY_CONTACT`], [`IMPLICIT_ADDED_MASS`], [`HAS_HEADING`], [`HAS_DEPTH_RATE`], [`HAS_WHEEL_SPEEDS`]
    pub flags: u32,
    /// Water depth [m].
    pub depth_m: f32,
    /// Density [kg/m3].
    pub density_kgpm3: f32,
    /// Velocity over ground, body frame [m/s].
    pub velocity_mps: [f32; 3],
    /// Velocity of the water over ground, body frame [m/s].
    pub current_mps: [f32; 3],
    /// Angular velocity [rad/s].
    pub angular_velocity_radps: [f32; 3],
    /// Acceleration [m/s2].
    pub acceleration_mps2: [f32; 3],
    /// Angular acceleration [rad/s2].
    pub angular_acceleration_radps2: [f32; 3],
    /// Unit vector along gravity (down), body frame.
    pub gravity_direction: [f32; 3],
    /// Angle from the world's x to the body's x [rad].
    pub heading_rad: f32,
    /// Rate at which the water rises at the body origin [m/s].
    pub depth_rate_mps: f32,
    /// Wheel speeds front left, front right, rear left, rear right [rad/s].
    pub wheel_speed_radps: [f32; 4],
    /// Time since the query before it in the session [s].
    pub time_step_s: f32,
}

/// The load of one effect. 32 bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v3::EffectAnswer")]
pub struct EffectAnswer {
    /// Which: the number of `Effect` in proto/wade/v1/hydrodynamics.proto.
    pub effect: u32,
    /// Why it is zero: the number of `LeftOut` there; 0 where it is not left out.
    pub left_out: u32,
    /// Force, body frame [N].
    pub force_n: [f32; 3],
    /// Moment about `about_m` [N m].
    pub moment_nm: [f32; 3],
}

/// The answer to a [`Query`]. 3,328 bytes.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v3::Answer")]
pub struct Answer {
    /// The query's number.
    pub sequence: u64,
    /// Time from the checked state to the forces [ns].
    pub compute_ns: u64,
    /// [`Status`]
    pub status: u32,
    /// [`Field`] that is wrong, where the status says so.
    pub field: u32,
    /// [`Problem`] with it.
    pub problem: u32,
    /// [`SERVER_POLLS`], [`SESSION_BEGINS`], [`HAS_ADDED_MASS`]
    pub flags: u32,
    /// Version of the bundle that answered.
    pub bundle_version: u32,
    /// How many entries of the arrays per surface hold a value; the others are zero.
    pub surface_count: u32,
    /// Net force, body frame [N].
    pub force_n: [f32; 3],
    /// Net moment about `about_m` [N m].
    pub moment_nm: [f32; 3],
    /// Center of mass, body frame [m].
    pub about_m: [f32; 3],
    /// One standard deviation of the net force [N].
    pub uncertainty_n: [f32; 3],
    /// Distance from the training domain by [`Quantity`]; 0 within.
    pub outside: [f32; 8],
    /// Source of the training data, UTF-8 padded with zeros.
    pub provenance: [u8; PROVENANCE_LEN],
    /// Force on each surface, body frame [N].
    pub surface_force_n: [[f32; 3]; MAX_SURFACES],
    /// Point at which it acts, body frame [m].
    pub surface_point_m: [[f32; 3]; MAX_SURFACES],
    /// Share of each surface under water.
    pub wetted_fraction: [f32; MAX_SURFACES],
    /// How many of `effects` hold a load: with those of the surfaces they sum to `force_n` and `moment_nm`.
    pub effect_count: u32,
    /// The loads of the effects that were added to the model.
    pub effects: [EffectAnswer; PHYSICS],
    /// Share of the effects' forces that acts on each surface [N]: a part of `effects`, not to be added to them.
    pub effect_surface_force_n: [[f32; 3]; MAX_SURFACES],
    /// Distance from the box in which the effects were seen: depth, speed, acceleration, angular speed, density.
    pub effects_outside: [f32; 5],
    /// Added mass and inertia about `about_m` by rows, forces first [kg, kg m, kg m2].
    pub added_mass: [f32; 36],
}

/// What comes before the states of a batch.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v3::BatchHeader")]
pub struct BatchHeader {
    /// The client's own number, given back in the answer.
    pub sequence: u64,
    /// As [`Query::wake_key`], which is not read in a batch.
    pub wake_key: u64,
    /// How many of the queries count, 1 to [`MAX_BATCH`].
    pub count: u32,
    /// Zero.
    pub reserved: u32,
}

/// Up to [`MAX_BATCH`] states.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v3::BatchQuery")]
pub struct BatchQuery {
    /// How many and who asks.
    pub header: BatchHeader,
    /// The states.
    pub queries: [Query; MAX_BATCH],
}

/// The answer to a [`BatchQuery`]: all of its states, or the first that is wrong.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v3::BatchAnswer")]
pub struct BatchAnswer {
    /// The query's number.
    pub sequence: u64,
    /// Time from the copied header to the last answer [ns].
    pub compute_ns: u64,
    /// [`Status`] of the whole.
    pub status: u32,
    /// Index of the state that is wrong, whose answer says why.
    pub index: u32,
    /// How many answers hold forces.
    pub count: u32,
    /// [`SERVER_POLLS`]
    pub flags: u32,
    /// The answers.
    pub answers: [Answer; MAX_BATCH],
}

/// Whether a query was answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Status {
    /// The forces are valid.
    Ok = 0,
    /// A field is wrong; the forces are zero.
    InvalidState = 1,
    /// The batch is empty or longer than [`MAX_BATCH`].
    InvalidBatch = 2,
}

impl From<&Query> for State {
    fn from(query: &Query) -> Self {
        Self {
            velocity: query.velocity_mps,
            current: query.current_mps,
            angular_velocity: query.angular_velocity_radps,
            acceleration: query.acceleration_mps2,
            angular_acceleration: query.angular_acceleration_radps2,
            gravity: query.gravity_direction,
            depth: query.depth_m,
            density: query.density_kgpm3,
            dry_contact: query.flags & DRY_CONTACT != 0,
            heading: (query.flags & HAS_HEADING != 0).then_some(query.heading_rad),
            depth_rate: (query.flags & HAS_DEPTH_RATE != 0).then_some(query.depth_rate_mps),
            wheel_speeds: (query.flags & HAS_WHEEL_SPEEDS != 0).then_some(query.wheel_speed_radps),
            time_step: query.time_step_s,
            implicit_added_mass: query.flags & IMPLICIT_ADDED_MASS != 0,
        }
    }
}

impl From<&State> for Query {
    fn from(state: &State) -> Self {
        let flag = |set: bool, flag: u32| if set { flag } else { 0 };
        Self {
            sequence: 0,
            wake_key: 0,
            session: 0,
            flags: flag(state.dry_contact, DRY_CONTACT)
                | flag(state.implicit_added_mass, IMPLICIT_ADDED_MASS)
                | flag(state.heading.is_some(), HAS_HEADING)
                | flag(state.depth_rate.is_some(), HAS_DEPTH_RATE)
                | flag(state.wheel_speeds.is_some(), HAS_WHEEL_SPEEDS),
            depth_m: state.depth,
            density_kgpm3: state.density,
            velocity_mps: state.velocity,
            current_mps: state.current,
            angular_velocity_radps: state.angular_velocity,
            acceleration_mps2: state.acceleration,
            angular_acceleration_radps2: state.angular_acceleration,
            gravity_direction: state.gravity,
            heading_rad: state.heading.unwrap_or(0.0),
            depth_rate_mps: state.depth_rate.unwrap_or(0.0),
            wheel_speed_radps: state.wheel_speeds.unwrap_or_default(),
            time_step_s: state.time_step,
        }
    }
}

impl Answer {
    /// An answer that says nothing yet.
    pub const EMPTY: Self = Self {
        sequence: 0,
        compute_ns: 0,
        status: 0,
        field: 0,
        problem: 0,
        flags: 0,
        bundle_version: 0,
        surface_count: 0,
        force_n: [0.0; 3],
        moment_nm: [0.0; 3],
        about_m: [0.0; 3],
        uncertainty_n: [0.0; 3],
        outside: [0.0; 8],
        provenance: [0; PROVENANCE_LEN],
        surface_force_n: [[0.0; 3]; MAX_SURFACES],
        surface_point_m: [[0.0; 3]; MAX_SURFACES],
        wetted_fraction: [0.0; MAX_SURFACES],
        effect_count: 0,
        effects: [EffectAnswer { effect: 0, left_out: 0, force_n: [0.0; 3], moment_nm: [0.0; 3] }; PHYSICS],
        effect_surface_force_n: [[0.0; 3]; MAX_SURFACES],
        effects_outside: [0.0; 5],
        added_mass: [0.0; 36],
    };

    /// The forces of a vehicle.
    pub fn new(vehicle: &ServedVehicle, evaluated: &Evaluated<'_>) -> Self {
        let (model, Evaluated { forces, effects, compute_ns }) = (vehicle.model(), evaluated);
        let matrix = added_mass(effects);
        let mut answer = Self {
            compute_ns: *compute_ns,
            flags: if matrix.is_some() { HAS_ADDED_MASS } else { 0 },
            effect_count: effects.loads.len() as u32,
            effects_outside: effects.outside.map(|excess| excess as f32),
            added_mass: matrix.unwrap_or([0.0; 36]),
            bundle_version: model.version(),
            surface_count: forces.surfaces.len() as u32,
            force_n: single(&forces.wrench.force),
            moment_nm: single(&forces.wrench.moment),
            about_m: single(&model.vehicle().center_of_mass),
            uncertainty_n: single(&forces.uncertainty),
            outside: forces.outside.excess.map(|excess| excess as f32),
            ..Self::EMPTY
        };
        let provenance = model.provenance().as_bytes();
        let len = provenance.len().min(PROVENANCE_LEN);
        answer.provenance[..len].copy_from_slice(&provenance[..len]);
        for (i, load) in forces.surfaces.iter().enumerate() {
            answer.surface_force_n[i] = single(&load.force);
            answer.surface_point_m[i] = single(&load.point);
            answer.wetted_fraction[i] = load.wetted_fraction as f32;
        }
        for (slot, load) in answer.effects.iter_mut().zip(&effects.loads) {
            *slot = EffectAnswer {
                effect: load.effect.code(),
                left_out: load.left_out.map_or(0, |reason| reason as u32),
                force_n: single(&load.wrench.force),
                moment_nm: single(&load.wrench.moment),
            };
        }
        for (slot, force) in answer.effect_surface_force_n.iter_mut().zip(&effects.surface_forces) {
            *slot = single(force);
        }
        answer
    }

    /// Says which field is wrong.
    pub fn invalid(invalid: InvalidState) -> Self {
        Self {
            status: Status::InvalidState as u32,
            field: invalid.field as u32,
            problem: invalid.problem as u32,
            ..Self::EMPTY
        }
    }

    /// What was wrong with the state, where something was.
    pub fn refusal(&self) -> Option<InvalidState> {
        (self.status == Status::InvalidState as u32)
            .then(|| {
                Some(InvalidState {
                    field: Field::from_code(self.field)?,
                    problem: Problem::from_code(self.problem)?,
                })
            })
            .flatten()
    }

    /// True where a quantity lies outside the training domain.
    pub fn is_outside(&self) -> bool {
        self.outside.iter().any(|&excess| excess != 0.0)
    }

    /// How far each quantity lies outside the training domain.
    pub fn outside(&self) -> Outside {
        Outside { excess: self.outside.map(f64::from) }
    }

    /// The provenance up to its padding.
    pub fn provenance(&self) -> &str {
        let end = self.provenance.iter().position(|&b| b == 0).unwrap_or(PROVENANCE_LEN);
        let bytes = &self.provenance[..end];
        // a name that was cut within a character is shown up to it
        std::str::from_utf8(bytes)
            .or_else(|e| std::str::from_utf8(&bytes[..e.valid_up_to()]))
            .unwrap_or_default()
    }
}

impl BatchAnswer {
    /// What was wrong with which state, where something was.
    pub fn refusal(&self) -> Option<(InvalidState, usize)> {
        let index = self.index as usize % MAX_BATCH;
        (self.status == Status::InvalidState as u32)
            .then(|| Some((self.answers[index].refusal()?, index)))
            .flatten()
    }
}

const _: () = assert!(size_of::<Query>() == 136 && align_of::<Query>() == 8);
const _: () = assert!(size_of::<EffectAnswer>() == 32);
const _: () = assert!(size_of::<Answer>() == 3328 && align_of::<Answer>() == 8);
const _: () = assert!(size_of::<BatchQuery>() == 24 + 136 * MAX_BATCH);
const _: () = assert!(size_of::<BatchAnswer>() == 32 + 3328 * MAX_BATCH);
const _: () = assert!(Quantity::ALL.len() == 8 && BoxQuantity::ALL.len() == 5 && PHYSICS == 14);
