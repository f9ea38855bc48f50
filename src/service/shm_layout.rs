//! What lies in shared memory: fixed-size, little-endian as the machine is, versioned in the service's name.
//!
//! | service | pattern | request | response |
//! | --- | --- | --- | --- |
//! | `<namespace>/v2/evaluate/<vehicle>` | request-response | [`Query`] | [`Answer`] |
//! | `<namespace>/v2/evaluate_batch/<vehicle>` | request-response | [`BatchQuery`] | [`BatchAnswer`] |
//! | `<namespace>/v2/wake` | event | a client wakes the server | |
//! | `<namespace>/v2/done` | event | the server wakes the one client whose listener is called [`wake_name`] | |
//!
//! The namespace is `wade` unless the server's configuration says otherwise.
//!
//! A field is never reused with another meaning: a change of layout is a new version in the names.

use iceoryx2::prelude::ZeroCopySend;

use super::wire::{Field, InvalidState, Problem, State};
use crate::domain::{Outside, Quantity};
use crate::forces::Forces;
use crate::model::Model;
use crate::vehicle::MAX_SURFACES;

use super::grpc::single;

/// Most states in one batch request.
pub const MAX_BATCH: usize = 256;
/// Length of the provenance, which is cut to fit.
pub const PROVENANCE_LEN: usize = 32;

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
        format!("{}/v2/evaluate/{vehicle}", self.namespace)
    }

    /// A vehicle's service for batches.
    pub fn evaluate_batch(&self, vehicle: &str) -> String {
        format!("{}/v2/evaluate_batch/{vehicle}", self.namespace)
    }

    /// Event service on which clients wake the server.
    pub fn wake(&self) -> String {
        format!("{}/v2/wake", self.namespace)
    }

    /// Event service on which the server wakes clients.
    pub fn done(&self) -> String {
        format!("{}/v2/done", self.namespace)
    }
}

/// Name of the listener of a client with this wake key.
pub fn wake_name(key: u64) -> String {
    format!("{key:016x}")
}

/// Flag of [`Query::flags`]: no water pressure under the contact patches.
pub const DRY_CONTACT: u32 = 1;
/// Flag of [`Answer::flags`]: the server polls, so that waking it is of no use.
pub const SERVER_POLLS: u32 = 1;

/// A state and who asks. 104 bytes.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v2::Query")]
pub struct Query {
    /// The client's own number, given back in the answer.
    pub sequence: u64,
    /// Name, as a number, of the client's listener on [`Names::done`]; 0 where the client polls.
    pub wake_key: u64,
    /// [`DRY_CONTACT`]
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
    /// Zero.
    pub reserved: u32,
}

/// The answer to a [`Query`]. 1,944 bytes.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v2::Answer")]
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
    /// [`SERVER_POLLS`]
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
}

/// What comes before the states of a batch.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v2::BatchHeader")]
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
#[type_name("wade::v2::BatchQuery")]
pub struct BatchQuery {
    /// How many and who asks.
    pub header: BatchHeader,
    /// The states.
    pub queries: [Query; MAX_BATCH],
}

/// The answer to a [`BatchQuery`]: all of its states, or the first that is wrong.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v2::BatchAnswer")]
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
        }
    }
}

impl From<&State> for Query {
    fn from(state: &State) -> Self {
        Self {
            sequence: 0,
            wake_key: 0,
            flags: if state.dry_contact { DRY_CONTACT } else { 0 },
            depth_m: state.depth,
            density_kgpm3: state.density,
            velocity_mps: state.velocity,
            current_mps: state.current,
            angular_velocity_radps: state.angular_velocity,
            acceleration_mps2: state.acceleration,
            angular_acceleration_radps2: state.angular_acceleration,
            gravity_direction: state.gravity,
            reserved: 0,
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
    };

    /// The forces of a model.
    pub fn new(model: &Model, forces: &Forces, compute_ns: u64) -> Self {
        let mut answer = Self {
            compute_ns,
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

const _: () = assert!(size_of::<Query>() == 104 && align_of::<Query>() == 8);
const _: () = assert!(size_of::<Answer>() == 1944 && align_of::<Answer>() == 8);
const _: () = assert!(size_of::<BatchQuery>() == 24 + 104 * MAX_BATCH);
const _: () = assert!(size_of::<BatchAnswer>() == 32 + 1944 * MAX_BATCH);
const _: () = assert!(Quantity::ALL.len() == 8);
