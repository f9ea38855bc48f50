//! What lies in shared memory: fixed-size, little-endian as the machine is, versioned in the service's name.
//!
//! | service | pattern | request | response |
//! | --- | --- | --- | --- |
//! | `<namespace>/v4/evaluate/<vehicle>` | request-response | [`Query`] | [`Answer`] |
//! | `<namespace>/v4/evaluate_batch/<vehicle>` | request-response | [`BatchQuery`] | [`BatchAnswer`] |
//! | `<namespace>/v4/evaluate_jacobian/<vehicle>` | request-response | [`Query`] | [`JacobianAnswer`] |
//! | `<namespace>/v4/vehicle/<vehicle>` | request-response | [`Query`], whose state is not read | [`VehicleAnswer`] |
//! | `<namespace>/v4/wake` | event | a client wakes the server | |
//! | `<namespace>/v4/done` | event | the server wakes the one client whose listener is called [`wake_name`] | |
//! | `<namespace>/served` | event | nobody connects: its attributes tell [`SERVED_LAYOUT`] and [`SERVED_VEHICLES`], in every version | |
//!
//! The namespace is `wade` unless the server's configuration says otherwise.
//!
//! Version 4 is the last of this line. Its arrays have room for what is to come, and a new quantity, effect or wheel takes a
//! place that is free, or one of the reserved bytes, together with a flag of its own. So:
//!
//! - A field is never used again with another meaning, and keeps its place (`tests/shm_pages.rs` reads pages of the first day).
//! - What is not set is NaN, and where a value is set by a flag, the flag is clear. It is never 0.
//! - A query that sets what the server cannot use, or a flag that it does not know, is refused with field and problem.
//! - A field that a client does not know is not read by it; reserved bytes are zero where nobody has given them a meaning.

use iceoryx2::prelude::ZeroCopySend;

use crate::DERIVATIVES;
use wade_core::domain::Quantity;
use wade_core::effects::{BoxQuantity, PHYSICS};
use wade_core::vehicle::MAX_SURFACES;

/// Most states in one batch request.
pub const MAX_BATCH: usize = 256;
/// Room for the effects of a vehicle.
pub const MAX_EFFECTS: usize = 32;
/// Room for the quantities of a training domain, and of the box in which effects were seen.
pub const MAX_QUANTITIES: usize = 16;
/// Room for wheels.
pub const MAX_WHEELS: usize = wade_core::vehicle::MAX_WHEELS;
/// Room for the description of a vehicle [bytes]: 64 surfaces and 32 effects with long names take 40,000.
pub const DESCRIPTION_LEN: usize = 65_376;
/// Length of the provenance, which is cut to fit.
pub const PROVENANCE_LEN: usize = 64;
/// Bytes that each message had without a meaning when the layout began.
pub const RESERVED_LEN: usize = 128;
/// Those of them that an [`Answer`] has left.
pub const RESERVED_LEFT: usize = 120;
/// Those of them that a [`Query`] has left.
pub const QUERY_RESERVED: usize = 96;

/// Version of the layout, as the names of the services have it.
pub const VERSION: &str = "v4";

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

    /// A vehicle's service for single queries with derivatives.
    pub fn evaluate_jacobian(&self, vehicle: &str) -> String {
        format!("{}/{VERSION}/evaluate_jacobian/{vehicle}", self.namespace)
    }

    /// The service that describes a vehicle.
    pub fn vehicle(&self, vehicle: &str) -> String {
        format!("{}/{VERSION}/vehicle/{vehicle}", self.namespace)
    }

    /// Every service of a vehicle.
    pub fn of_vehicle(&self, vehicle: &str) -> [String; 4] {
        let [single, batch] = [self.evaluate(vehicle), self.evaluate_batch(vehicle)];
        [single, batch, self.evaluate_jacobian(vehicle), self.vehicle(vehicle)]
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
pub const DRY_CONTACT: u64 = 1;
/// Flag of [`Query::flags`]: the caller adds [`Answer::added_mass`] to his own mass matrix, so that forces leave
/// `-M_A nu_dot` out and keep the rest.
pub const IMPLICIT_ADDED_MASS: u64 = 2;
/// Flag of [`Query::flags`]: `heading_rad` is set.
pub const HAS_HEADING: u64 = 4;
/// Flag of [`Query::flags`]: `depth_rate_mps` is set.
pub const HAS_DEPTH_RATE: u64 = 8;
/// Flag of [`Query::flags`]: `wheel_speed_radps` is set.
pub const HAS_WHEEL_SPEEDS: u64 = 16;
/// Flag of [`Query::flags`]: `water_level_m` is set, instead of `depth_m`.
pub const HAS_WATER_LEVEL: u64 = 32;
/// Flag of [`Query::flags`]: `bed_clearance_m` is set.
pub const HAS_BED_CLEARANCE: u64 = 64;
/// Flag of [`Query::flags`]: `bed` is set.
pub const HAS_BED: u64 = 128;
/// Flag of [`Query::flags`]: `wheel_water_level_m` is set.
pub const HAS_WHEEL_LEVELS: u64 = 256;
/// Flag of [`Query::flags`]: of the physical base the pressure of still water alone.
pub const HYDROSTATIC: u64 = 512;
/// Flag of [`Query::flags`]: of the physical base the pressure of still water and the drag.
pub const QUASI_STEADY: u64 = 1024;
/// Flag of [`Query::flags`]: the whole physical base, however the server is set.
pub const FULL: u64 = 2048;
/// Flag of [`Query::flags`]: the derivatives of the wrench are asked for, for which only [`Names::evaluate_jacobian`] has room: it
/// gives them with the flag and without it.
pub const JACOBIAN: u64 = 4096;
/// Flag of [`Query::flags`]: `wave_vector_radpm`, `wave_amplitude_m` and `wave_phase_rad` are set. Without it they are not read:
/// clients of the first day have zeros there.
pub const HAS_WAVE: u64 = 8192;
/// Flag of [`Query::flags`]: `current_exponent` is set. Without it it is not read.
pub const HAS_CURRENT_EXPONENT: u64 = 16384;
/// Flag of [`Answer::flags`]: the server polls, so that waking it is of no use.
pub const SERVER_POLLS: u64 = 1;
/// Flag of [`Answer::flags`]: the session begins with this query, at rest and dry. In the middle of a run it says that the
/// server has forgotten the session, for another server or for too many sessions.
pub const SESSION_BEGINS: u64 = 2;
/// Flag of [`Answer::flags`]: `added_mass` holds a matrix.
pub const HAS_ADDED_MASS: u64 = 4;
/// Flag of [`Answer::flags`]: `damping` holds a matrix.
pub const HAS_DAMPING: u64 = 8;
/// Flag of [`Answer::flags`]: `wheel_count` is set.
pub const HAS_WHEEL_COUNT: u64 = 16;
/// Flag of [`Answer::flags`]: `shaft_power_w` is set.
pub const HAS_SHAFT_POWER: u64 = 32;

/// A state and who asks. 328 bytes.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v4::Query")]
pub struct Query {
    /// The client's own number, given back in the answer.
    pub sequence: u64,
    /// Name, as a number, of the client's listener on [`Names::done`]; 0 where the client polls.
    pub wake_key: u64,
    /// The client's own number of a run of states that follow each other, for effects that remember; 0 for none. A client
    /// may run many at a time, one an environment; those of other clients are apart.
    pub session: u64,
    /// [`DRY_CONTACT`], [`IMPLICIT_ADDED_MASS`] and those named `HAS_`
    pub flags: u64,
    /// Water depth at the body origin, above the ground-contact plane [m].
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
    /// Time since the query before it in the session [s].
    pub time_step_s: f32,
    /// Angle from the world's x to the body's x [rad].
    pub heading_rad: f32,
    /// Rate at which the water rises at the body origin [m/s].
    pub depth_rate_mps: f32,
    /// Signed height of the still-water plane above the body origin, along up [m].
    pub water_level_m: f32,
    /// Distance from the ground-contact plane down to the bed [m]: 0 on the bed.
    pub bed_clearance_m: f32,
    /// Whether the bed moves under the vehicle: 0 parked to 1 driving.
    pub bed: f32,
    /// Speed of each wheel of the vehicle by axle from the front, left before right [rad/s]; of four wheels front left, front
    /// right, rear left, rear right. Places beyond the vehicle's wheels are NaN.
    pub wheel_speed_radps: [f32; MAX_WHEELS],
    /// Height of the water surface above the body origin along up at each wheel [m], in the same order.
    pub wheel_water_level_m: [f32; MAX_WHEELS],
    /// The client's own number, drawn at random: its sessions are the same on the services for single queries with derivatives
    /// and without. 0 for none: they are apart.
    pub owner: u64,
    /// Wave number of a regular wave along the direction in which it travels [rad/m].
    pub wave_vector_radpm: [f32; 3],
    /// Half its height [m].
    pub wave_amplitude_m: f32,
    /// Its phase at the body origin [rad]: a crest at 0, and after it the water falls.
    pub wave_phase_rad: f32,
    /// Exponent of the profile of the current over the height over the bed; 0 of one that is even.
    pub current_exponent: f32,
    /// Zero.
    pub reserved: [u8; QUERY_RESERVED],
}

/// The load of one effect. 32 bytes.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v4::EffectAnswer")]
pub struct EffectAnswer {
    /// Which: the number of `Effect` in proto/wade/v1/hydrodynamics.proto.
    pub effect: u32,
    /// Why it has no load: the number of `LeftOut` there; 0 where it is not left out.
    pub left_out: u32,
    /// Force, body frame [N].
    pub force_n: [f32; 3],
    /// Moment about `about_m` [N m].
    pub moment_nm: [f32; 3],
}

/// The load on one surface. 52 bytes.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v4::SurfaceAnswer")]
pub struct SurfaceAnswer {
    /// Force, body frame [N].
    pub force_n: [f32; 3],
    /// Point at which it acts, body frame [m].
    pub point_m: [f32; 3],
    /// Couple beside the force at that point [N m].
    pub couple_nm: [f32; 3],
    /// Share of the effects' forces that acts on this surface [N]: a part of `effects`, not to be added to them.
    pub effect_force_n: [f32; 3],
    /// Share of the surface under water.
    pub wetted_fraction: f32,
}

/// The answer to a [`Query`]. 5,080 bytes.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v4::Answer")]
pub struct Answer {
    /// The query's number.
    pub sequence: u64,
    /// Time from the checked state to the forces [ns].
    pub compute_ns: u64,
    /// [`SERVER_POLLS`], [`SESSION_BEGINS`] and those named `HAS_`
    pub flags: u64,
    /// [`Status`]
    pub status: u32,
    /// [`Field`](super::wire::Field) that is wrong, where the status says so; else 0.
    pub field: u32,
    /// [`Problem`](super::wire::Problem) with it; else 0.
    pub problem: u32,
    /// Version of the bundle that answered; 0 where there are no forces.
    pub bundle_version: u32,
    /// How many of `surfaces` hold a load.
    pub surface_count: u32,
    /// How many of `effects` hold a load: with those of the surfaces they sum to `force_n` and `moment_nm`.
    pub effect_count: u32,
    /// Net force, body frame [N].
    pub force_n: [f32; 3],
    /// Net moment about `about_m` [N m].
    pub moment_nm: [f32; 3],
    /// Center of mass, body frame [m].
    pub about_m: [f32; 3],
    /// One standard deviation of the net force [N].
    pub force_deviation_n: [f32; 3],
    /// One standard deviation of the net moment [N m].
    pub moment_deviation_nm: [f32; 3],
    /// Distance from the training domain by [`Quantity`]; 0 within.
    pub outside: [f32; MAX_QUANTITIES],
    /// Distance from the box in which the effects were seen by [`BoxQuantity`]; 0 within, NaN where there are no effects.
    pub effects_outside: [f32; MAX_QUANTITIES],
    /// Height of the still-water plane above the body origin that the forces are for [m].
    pub water_level_m: f32,
    /// Distance from the ground-contact plane to the bed that the forces are for [m].
    pub bed_clearance_m: f32,
    /// Bed motion that the forces are for: 0 parked to 1 driving.
    pub bed: f32,
    /// Source of the training data, UTF-8 padded with zeros.
    pub provenance: [u8; PROVENANCE_LEN],
    /// The loads of the effects that were added to the model.
    pub effects: [EffectAnswer; MAX_EFFECTS],
    /// The loads on the surfaces, in the vehicle's order.
    pub surfaces: [SurfaceAnswer; MAX_SURFACES],
    /// Added mass and inertia about `about_m` by rows, forces first [kg, kg m, kg m2].
    pub added_mass: [f32; 36],
    /// Linear damping about `about_m` by rows, forces first [N s/m, N s, N m s].
    pub damping: [f32; 36],
    /// How many wheels the vehicle has, each of which takes a speed; in a refusal too. Of a server that does not state it the
    /// flag is clear.
    pub wheel_count: u32,
    /// Power that the shafts of the wheels put in [W]. Of a model without the physical base it is NaN; of a server that does not
    /// state it the flag is clear.
    pub shaft_power_w: f32,
    /// Zero.
    pub reserved: [u8; RESERVED_LEFT],
}

/// The answer to a [`Query`] with the derivatives of its wrench. 5,472 bytes.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v4::JacobianAnswer")]
pub struct JacobianAnswer {
    /// As of the service for single queries.
    pub answer: Answer,
    /// Derivatives of `force_n` and `moment_nm` by rows, with the columns of [`Jacobian`](wade_core::model::Jacobian); NaN where
    /// there are no forces.
    pub jacobian: [f32; DERIVATIVES],
    /// Zero.
    pub reserved: [u8; RESERVED_LEN],
}

/// What a server says of a vehicle. 65,528 bytes.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v4::VehicleAnswer")]
pub struct VehicleAnswer {
    /// The query's number.
    pub sequence: u64,
    /// [`SERVER_POLLS`]
    pub flags: u64,
    /// [`Status`]
    pub status: u32,
    /// How many bytes of `description` count.
    pub len: u32,
    /// Zero.
    pub reserved: [u8; RESERVED_LEN],
    /// The bytes of a `GetVehicleResponse` of proto/wade/v1/hydrodynamics.proto, without the mesh.
    pub description: [u8; DESCRIPTION_LEN],
}

/// What comes before the states of a batch. 160 bytes.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v4::BatchHeader")]
pub struct BatchHeader {
    /// The client's own number, given back in the answer.
    pub sequence: u64,
    /// As [`Query::wake_key`], which is not read in a batch.
    pub wake_key: u64,
    /// None is known: 0.
    pub flags: u64,
    /// How many of the queries count, 1 to [`MAX_BATCH`]; what lies behind them is not read.
    pub count: u32,
    /// Zero.
    pub spare: u32,
    /// Zero.
    pub reserved: [u8; RESERVED_LEN],
}

/// Up to [`MAX_BATCH`] states.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v4::BatchQuery")]
pub struct BatchQuery {
    /// How many and who asks.
    pub header: BatchHeader,
    /// The states.
    pub queries: [Query; MAX_BATCH],
}

/// The answer to a [`BatchQuery`]: all of its states, or the first that is wrong.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[repr(C)]
#[type_name("wade::v4::BatchAnswer")]
pub struct BatchAnswer {
    /// The query's number.
    pub sequence: u64,
    /// Time from the copied header to the last answer [ns].
    pub compute_ns: u64,
    /// [`SERVER_POLLS`]
    pub flags: u64,
    /// [`Status`] of the whole.
    pub status: u32,
    /// Index of the state that is wrong, whose answer says why.
    pub index: u32,
    /// How many answers hold forces; those behind them say nothing, but for that of a state that is wrong.
    pub count: u32,
    /// Zero.
    pub spare: u32,
    /// Zero.
    pub reserved: [u8; RESERVED_LEN],
    /// The answers.
    pub answers: [Answer; MAX_BATCH],
}

/// Whether a query was answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Status {
    /// The forces are valid.
    Ok = 0,
    /// A field is wrong; there are no forces.
    InvalidState = 1,
    /// The batch is empty or longer than [`MAX_BATCH`], or has a flag that the server does not know.
    InvalidBatch = 2,
    /// The vehicle is not served any more; there are no forces.
    NotServed = 3,
    /// The description is longer than [`DESCRIPTION_LEN`]; it is answered over gRPC.
    TooLong = 4,
}

impl Query {
    /// Level and at rest in fresh water of a depth that is not set, nor is anything else.
    pub const UNSET: Self = Self {
        sequence: 0,
        wake_key: 0,
        session: 0,
        flags: 0,
        depth_m: f32::NAN,
        density_kgpm3: wade_core::condition::FRESH_WATER as f32,
        velocity_mps: [0.0; 3],
        current_mps: [0.0; 3],
        angular_velocity_radps: [0.0; 3],
        acceleration_mps2: [0.0; 3],
        angular_acceleration_radps2: [0.0; 3],
        gravity_direction: [0.0, 0.0, -1.0],
        time_step_s: 0.0,
        heading_rad: f32::NAN,
        depth_rate_mps: f32::NAN,
        water_level_m: f32::NAN,
        bed_clearance_m: f32::NAN,
        bed: f32::NAN,
        wheel_speed_radps: [f32::NAN; MAX_WHEELS],
        wheel_water_level_m: [f32::NAN; MAX_WHEELS],
        owner: 0,
        wave_vector_radpm: [f32::NAN; 3],
        wave_amplitude_m: f32::NAN,
        wave_phase_rad: f32::NAN,
        current_exponent: f32::NAN,
        reserved: [0; QUERY_RESERVED],
    };
}

impl EffectAnswer {
    /// No effect.
    pub const UNSET: Self = Self { effect: 0, left_out: 0, force_n: [f32::NAN; 3], moment_nm: [f32::NAN; 3] };
}

impl SurfaceAnswer {
    /// No surface.
    pub const UNSET: Self = Self {
        force_n: [f32::NAN; 3],
        point_m: [f32::NAN; 3],
        couple_nm: [f32::NAN; 3],
        effect_force_n: [f32::NAN; 3],
        wetted_fraction: f32::NAN,
    };
}

impl Answer {
    /// An answer that says nothing yet.
    pub const UNSET: Self = Self {
        sequence: 0,
        compute_ns: 0,
        flags: 0,
        status: 0,
        field: 0,
        problem: 0,
        bundle_version: 0,
        surface_count: 0,
        effect_count: 0,
        force_n: [f32::NAN; 3],
        moment_nm: [f32::NAN; 3],
        about_m: [f32::NAN; 3],
        force_deviation_n: [f32::NAN; 3],
        moment_deviation_nm: [f32::NAN; 3],
        outside: [f32::NAN; MAX_QUANTITIES],
        effects_outside: [f32::NAN; MAX_QUANTITIES],
        water_level_m: f32::NAN,
        bed_clearance_m: f32::NAN,
        bed: f32::NAN,
        provenance: [0; PROVENANCE_LEN],
        effects: [EffectAnswer::UNSET; MAX_EFFECTS],
        surfaces: [SurfaceAnswer::UNSET; MAX_SURFACES],
        added_mass: [f32::NAN; 36],
        damping: [f32::NAN; 36],
        wheel_count: 0,
        shaft_power_w: f32::NAN,
        reserved: [0; RESERVED_LEFT],
    };
}

impl JacobianAnswer {
    /// An answer that says nothing yet.
    pub const UNSET: Self =
        Self { answer: Answer::UNSET, jacobian: [f32::NAN; DERIVATIVES], reserved: [0; RESERVED_LEN] };
}

impl BatchHeader {
    /// Nobody asks for anything.
    pub const UNSET: Self =
        Self { sequence: 0, wake_key: 0, flags: 0, count: 0, spare: 0, reserved: [0; RESERVED_LEN] };
}

const _: () = assert!(size_of::<Query>() == 328 && align_of::<Query>() == 8);
const _: () = assert!(size_of::<EffectAnswer>() == 32 && size_of::<SurfaceAnswer>() == 52);
const _: () = assert!(size_of::<Answer>() == 5080 && align_of::<Answer>() == 8);
const _: () = assert!(size_of::<JacobianAnswer>() == 5080 + 4 * DERIVATIVES + RESERVED_LEN);
const _: () = assert!(size_of::<VehicleAnswer>() == 152 + DESCRIPTION_LEN);
const _: () = assert!(size_of::<BatchHeader>() == 160);
const _: () = assert!(size_of::<BatchQuery>() == 160 + 328 * MAX_BATCH);
const _: () = assert!(size_of::<BatchAnswer>() == 168 + 5080 * MAX_BATCH);
const _: () = assert!(Quantity::ALL.len() <= MAX_QUANTITIES && BoxQuantity::ALL.len() <= MAX_QUANTITIES);
const _: () = assert!(PHYSICS <= MAX_EFFECTS);
