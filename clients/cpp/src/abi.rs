//! What crosses the boundary: plain numbers of fixed size. The header is made from these.
//!
//! Names are those of the wire (`proto/wade/v1/hydrodynamics.proto`). A change to any of them raises [`WADE_ABI_VERSION`]; what is
//! added beside them does not.

use std::ffi::c_char;

/// Version of everything in this header. A library of another one refuses to open a client.
pub const WADE_ABI_VERSION: u32 = 2;
/// Most surfaces of a vehicle.
pub const WADE_MAX_SURFACES: usize = 64;
/// Most wheels whose speed a state has.
pub const WADE_MAX_WHEELS: usize = 8;
/// Most effects of a vehicle.
pub const WADE_MAX_EFFECTS: usize = 14;
/// Most states of one batch.
pub const WADE_MAX_BATCH: u32 = 4096;
/// Columns of the derivatives of force and moment; see `wade_evaluate_jacobian`.
pub const WADE_JACOBIAN_COLUMNS: usize = 11;
/// Room for a name and its end.
pub const WADE_NAME_SIZE: usize = 64;
/// The age of forces where there are none yet.
pub const WADE_NEVER: u64 = u64::MAX;

/// Flag of a state: no water pressure under the contact patches.
pub const WADE_DRY_CONTACT: u32 = 1;
/// Flag of a state: the caller adds `added_mass` to his own mass matrix, so that forces leave -M_A nu_dot out.
pub const WADE_IMPLICIT_ADDED_MASS: u32 = 2;
/// Flag of a state: `heading_rad` holds a value.
pub const WADE_HAS_HEADING: u32 = 4;
/// Flag of a state: `depth_rate_mps` holds a value.
pub const WADE_HAS_DEPTH_RATE: u32 = 8;
/// Flag of a state: `wheel_speed_radps` holds values.
pub const WADE_HAS_WHEEL_SPEEDS: u32 = 16;
/// Flag of a state: `water_level_m` holds the level, and `depth_m` is not read.
pub const WADE_HAS_WATER_LEVEL: u32 = 32;
/// Flag of a state: `bed_clearance_m` holds a value.
pub const WADE_HAS_BED_CLEARANCE: u32 = 64;
/// Flag of a state: `bed` holds a value.
pub const WADE_HAS_BED: u32 = 128;
/// Flag of a state: `wheel_water_level_m` holds values.
pub const WADE_HAS_WHEEL_LEVELS: u32 = 256;
/// Flag of a state: of the physical base the pressure of still water alone.
pub const WADE_PHYSICS_HYDROSTATIC: u32 = 512;
/// Flag of a state: of the physical base the pressure of still water and the drag.
pub const WADE_PHYSICS_QUASI_STEADY: u32 = 1024;
/// Flag of a state: the whole physical base, however the server is set.
pub const WADE_PHYSICS_FULL: u32 = 2048;
/// Flag of a state: `wave_vector_radpm`, `wave_amplitude_m` and `wave_phase_rad` hold values.
pub const WADE_HAS_WAVE: u32 = 8192;
/// Flag of a state: `current_exponent` holds a value.
pub const WADE_HAS_CURRENT_EXPONENT: u32 = 16384;

/// Flag of forces: no quantity lies outside the training domain.
pub const WADE_IN_DOMAIN: u32 = 1;
/// Flag of forces: the session begins with the state that these answer, at rest and dry. In the middle of a run it says that
/// the server has forgotten the session.
pub const WADE_SESSION_BEGINS: u32 = 2;
/// Flag of forces: `added_mass` holds a matrix.
pub const WADE_HAS_ADDED_MASS: u32 = 4;
/// Flag of forces: the bundle has the physical base, and `damping`, `water_level_m`, `bed_clearance_m`, `bed` and
/// `shaft_power_w` hold values.
pub const WADE_HAS_BASE: u32 = 8;

/// What came of a call.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WadeStatus {
    /// The forces answer the state of this call.
    Ok = 0,
    /// No answer within the budget: the forces are the last ones, `age_ns` old.
    Timeout = 1,
    /// No server there, or none any more; it is looked for in the background. The forces are the last ones.
    NoServer = 2,
    /// The server serves no such vehicle. The forces are the last ones.
    UnknownVehicle = 3,
    /// The server is of another version: shared memory of another layout, or another service. The forces are the last ones.
    LayoutMismatch = 4,
    /// A field of the state is wrong, which `invalid_field` and `invalid_problem` name. The forces are the last ones.
    InvalidState = 5,
    /// The server is at a limit. The forces are the last ones.
    ResourceExhausted = 6,
    /// The server refused for another reason. The forces are the last ones.
    Refused = 7,
    /// An argument of the call is wrong, such as a null pointer; nothing was written.
    InvalidArgument = 8,
    /// The program was compiled with a header of another version than the library.
    AbiMismatch = 9,
    /// A fault in this library; nothing was written. Please report it.
    Internal = 10,
    /// A file of `wade_credentials` cannot be used, which the reason names; it is read again each second. The forces are the last
    /// ones.
    Credentials = 11,
}

/// How a call over shared memory waits for its answer.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WadeWait {
    /// Sleeps until the server wakes it.
    Block = 0,
    /// Polls without pause: faster by the time it takes to wake up, for the price of a core.
    Spin = 1,
}

impl WadeStatus {
    const ALL: [Self; 12] = [
        Self::Ok,
        Self::Timeout,
        Self::NoServer,
        Self::UnknownVehicle,
        Self::LayoutMismatch,
        Self::InvalidState,
        Self::ResourceExhausted,
        Self::Refused,
        Self::InvalidArgument,
        Self::AbiMismatch,
        Self::Internal,
        Self::Credentials,
    ];

    /// The status of a number.
    pub fn from_code(code: i32) -> Option<Self> {
        Self::ALL.into_iter().find(|&status| status as i32 == code)
    }
}

/// Where the server is and whom it is asked about. Begin with `wade_default_options()`.
#[repr(C)]
pub struct WadeOptions {
    /// WADE_ABI_VERSION
    pub abi_version: u32,
    /// sizeof(wade_state)
    pub state_size: u32,
    /// sizeof(wade_forces)
    pub forces_size: u32,
    /// A `wade_wait`, for shared memory.
    pub wait: u32,
    /// Most states of a batch, up to WADE_MAX_BATCH; their room is reserved when the client is opened. 0: no batches.
    pub max_batch: u32,
    /// 0
    pub reserved: u32,
    /// "shm:NAMESPACE" for shared memory ("shm:wade" unless the server's shm.namespace says otherwise), "HOST:PORT" or
    /// "http://HOST:PORT" for gRPC over TCP, "https://HOST:PORT" for the same over TLS, "unix:PATH" for gRPC over a Unix socket.
    /// Copied.
    pub address: *const c_char,
    /// Name of the vehicle. Copied.
    pub vehicle: *const c_char,
}

/// Which servers a client believes and what it shows them over TCP. Begin with `wade_default_credentials()`.
///
/// Paths of files, each null or empty for none, and copied. The files are read at each connection, so that a client finds what was
/// renewed when it connects again. Over shared memory and a Unix socket none is read: there the server knows its own user.
#[repr(C)]
pub struct WadeCredentials {
    /// sizeof(wade_credentials)
    pub size: u32,
    /// 0
    pub reserved: u32,
    /// PEM of the authorities whose servers are believed. None: those of the system.
    pub ca_file: *const c_char,
    /// PEM of the client's certificate, followed by those between it and its authority. With `key_file` alone.
    pub certificate_file: *const c_char,
    /// PEM of the private key of the certificate.
    pub key_file: *const c_char,
    /// A token, as `wade token` prints it. It is sent to another machine over "https://" alone.
    pub token_file: *const c_char,
}

/// The state of a vehicle in the water. Begin with `wade_default_state()`.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct WadeState {
    /// Number of a run of states that follow each other, for effects that remember; 0 for none. Over shared memory a client may
    /// run many at a time; over gRPC another number begins another run, and batches have none.
    pub session: u64,
    /// WADE_DRY_CONTACT, WADE_IMPLICIT_ADDED_MASS, those named WADE_HAS_ and one of those named WADE_PHYSICS_
    pub flags: u32,
    /// Entries of `wheel_speed_radps` and `wheel_water_level_m` that hold a value, where the flags say so: one for each wheel of the
    /// vehicle; 0 for four.
    pub wheel_count: u32,
    /// Undisturbed water surface above the ground-contact plane at the body origin [m]; negative where it is below.
    pub depth_m: f32,
    /// Signed height of the still-water plane above the body origin along up [m], for any attitude.
    pub water_level_m: f32,
    /// Distance from the ground-contact plane down to the bed [m]. Not given: on the bed up to the level at which the vehicle
    /// floats, and off it from there.
    pub bed_clearance_m: f32,
    /// Share of the motion through the water that is motion over the bed: 0 parked to 1 driving. Not given: from the
    /// velocities.
    pub bed: f32,
    /// Density of the water [kg/m3].
    pub density_kgpm3: f32,
    /// Velocity over ground [m/s]; through the water where there is no current.
    pub velocity_mps: [f32; 3],
    /// Velocity of the water over ground, body frame [m/s].
    pub current_mps: [f32; 3],
    /// Angular velocity [rad/s].
    pub angular_velocity_radps: [f32; 3],
    /// Acceleration [m/s2].
    pub acceleration_mps2: [f32; 3],
    /// Angular acceleration [rad/s2].
    pub angular_acceleration_radps2: [f32; 3],
    /// Unit vector along gravity (down), body frame; see `wade_gravity_from_roll_pitch` and `wade_gravity_from_quaternion`.
    pub gravity_direction: [f32; 3],
    /// Angle from the world's x to the body's x [rad].
    pub heading_rad: f32,
    /// Rate at which the water rises at the body origin [m/s].
    pub depth_rate_mps: f32,
    /// By axle from the front, left before right [rad/s]; of four wheels front left, front right, rear left, rear right.
    pub wheel_speed_radps: [f32; WADE_MAX_WHEELS],
    /// Time since the state before it in the session [s]. The steps of states that could not be asked for want of time are added
    /// to the next one that is.
    pub time_step_s: f32,
    /// A regular wave about the level, of linear theory: wave number along the direction in which it travels, body frame [rad/m].
    /// For this and the next four the vehicle needs the physical base.
    pub wave_vector_radpm: [f32; 3],
    /// Half the height of the wave from trough to crest [m].
    pub wave_amplitude_m: f32,
    /// k . x - w t of the wave at the body origin [rad]: a crest at 0, and after it the water falls. w^2 = g k tanh(k h).
    pub wave_phase_rad: f32,
    /// Height of the water surface above the body origin along up at each wheel [m], in the order of `wheel_speed_radps`; the level
    /// is then that at the body origin. Not beside a wave.
    pub wheel_water_level_m: [f32; WADE_MAX_WHEELS],
    /// Exponent n of the profile of the current over the height s h over the bed, current_mps (1 + n) s^n.
    pub current_exponent: f32,
}

/// The load of one effect that was added to the model.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct WadeEffectLoad {
    /// Number of `Effect` on the wire; see `wade_effect_name`.
    pub effect: u32,
    /// Why it is zero: number of `LeftOut` on the wire; 0 where it is not left out.
    pub left_out: u32,
    /// [N]
    pub force_n: [f32; 3],
    /// About `about_m` [N m].
    pub moment_nm: [f32; 3],
}

/// What the water does to the vehicle, body frame. All zero, with an age of WADE_NEVER, where there was no answer yet.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct WadeForces {
    /// Time from the call whose state these answer to the end of this call [ns]; WADE_NEVER where there was no answer yet.
    pub age_ns: u64,
    /// Counts the answers of this client from 1 on, so that one that was seen before is known; 0 where there was none yet, and in
    /// a batch.
    pub answer: u64,
    /// The server's own time [ns]; in a batch over gRPC that of the whole.
    pub compute_ns: u64,
    /// WADE_IN_DOMAIN, WADE_SESSION_BEGINS, WADE_HAS_ADDED_MASS, WADE_HAS_BASE
    pub flags: u32,
    /// Which field of this call's state is wrong, where the status says so; see `wade_field_name`. Else 0.
    pub invalid_field: u32,
    /// What is wrong with it; see `wade_problem_message`. Else 0.
    pub invalid_problem: u32,
    /// Version of the bundle that answered.
    pub bundle_version: u32,
    /// Entries of the arrays per surface that hold a value, in the order of `wade_vehicle`; the others are zero.
    pub surface_count: u32,
    /// Entries of `effects` that hold a load.
    pub effect_count: u32,
    /// Power that the shafts of the wheels put in [W]; NaN of a server that does not state it.
    pub shaft_power_w: f32,
    /// Net force [N].
    pub force_n: [f32; 3],
    /// Net moment about `about_m` [N m].
    pub moment_nm: [f32; 3],
    /// Center of mass [m].
    pub about_m: [f32; 3],
    /// One standard deviation of the net force [N].
    pub uncertainty_n: [f32; 3],
    /// One standard deviation of the net moment [N m].
    pub moment_uncertainty_nm: [f32; 3],
    /// Height of the still-water plane above the body origin along up [m], as used.
    pub water_level_m: f32,
    /// Distance from the ground-contact plane to the bed [m], as used.
    pub bed_clearance_m: f32,
    /// Share of the motion through the water that is motion over the bed, as used.
    pub bed: f32,
    /// How far each `wade_quantity` lies outside the training domain, in its unit: negative below, positive above, 0 within.
    pub outside: [f32; 8],
    /// How far the state lies outside the box in which the effects were seen: depth, speed, acceleration, angular speed, density.
    pub effects_outside: [f32; 5],
    /// Added mass and inertia about `about_m` by rows, forces first [kg, kg m, kg m2], where the flags say so.
    pub added_mass: [f32; 36],
    /// Linear damping by waves about `about_m` by rows, forces first [kg/s, kg m/s, kg m2/s]: the wrench is -B nu. Zero in a
    /// session, whose memory has it.
    pub damping: [f32; 36],
    /// Force on each surface [N].
    pub surface_force_n: [[f32; 3]; WADE_MAX_SURFACES],
    /// Point at which it acts [m].
    pub surface_point_m: [[f32; 3]; WADE_MAX_SURFACES],
    /// Moment of the load of each surface about that point [N m].
    pub surface_couple_nm: [[f32; 3]; WADE_MAX_SURFACES],
    /// Share of each surface under water.
    pub wetted_fraction: [f32; WADE_MAX_SURFACES],
    /// Share of the effects' forces that acts on each surface [N]: a part of `effects`, not to be added to them.
    pub effect_surface_force_n: [[f32; 3]; WADE_MAX_SURFACES],
    /// The loads of the effects: with those of the surfaces they sum to `force_n` and `moment_nm`.
    pub effects: [WadeEffectLoad; WADE_MAX_EFFECTS],
    /// Where the weights come from, such as "analytic".
    pub provenance: [c_char; WADE_NAME_SIZE],
}

/// What came of a batch beside its forces.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct WadeBatch {
    /// Time from the call that the forces answer to the end of this call [ns]; WADE_NEVER where no batch was answered yet.
    pub age_ns: u64,
    /// Which state is wrong, where the status says so.
    pub invalid_index: u32,
    /// As in `wade_forces`.
    pub invalid_field: u32,
    /// As in `wade_forces`.
    pub invalid_problem: u32,
    /// 0
    pub reserved: u32,
}

/// A quantity of which the training domain states a range; the places of `wade_forces.outside`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WadeQuantity {
    /// Horizontal speed through the water [m/s].
    Speed = 0,
    /// Flow angle [rad]: pi/2 head-on or from behind, 0 from the side.
    Angle = 1,
    /// [kg/m3]
    Density = 2,
    /// [m]
    Depth = 3,
    /// Angle between body z and up [rad].
    Tilt = 4,
    /// Speed along body z [m/s].
    VerticalSpeed = 5,
    /// [rad/s]
    AngularSpeed = 6,
    /// Distance to the nearest state that was learnt from, over what is usual among these [-].
    Distance = 7,
}

/// A named region of the hull.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct WadeSurface {
    /// As in vehicle.toml.
    pub name: [c_char; WADE_NAME_SIZE],
    /// bottom, front, rear, side, wheel or track.
    pub kind: [c_char; 16],
    /// [m]
    pub centroid_m: [f32; 3],
    /// Mean outward normal.
    pub normal: [f32; 3],
    /// [m2]
    pub area_m2: f64,
}

/// A range of the training domain.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct WadeRange {
    /// Smallest value.
    pub minimum: f64,
    /// Largest value.
    pub maximum: f64,
}

/// What the server says of a vehicle.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct WadeVehicle {
    /// Its name.
    pub name: [c_char; WADE_NAME_SIZE],
    /// Where the weights come from, such as "analytic".
    pub provenance: [c_char; WADE_NAME_SIZE],
    /// Version of the bundle.
    pub bundle_version: u32,
    /// Entries of `surfaces` that hold one.
    pub surface_count: u32,
    /// Entries of `effects` that hold one.
    pub effect_count: u32,
    /// Numbers of `Effect` on the wire, in the order of the answers; see `wade_effect_name`.
    pub effects: [u32; WADE_MAX_EFFECTS],
    /// [m]
    pub length_m: f64,
    /// [m]
    pub width_m: f64,
    /// [m]
    pub height_m: f64,
    /// z of the ground-contact plane [m].
    pub z0_m: f64,
    /// [kg]
    pub mass_kg: f64,
    /// [m]
    pub center_of_mass_m: [f32; 3],
    /// About the center of mass, by rows.
    pub inertia_kgm2: [f64; 9],
    /// By `wade_quantity`; infinite where there is no range.
    pub domain: [WadeRange; 8],
    /// In the order of the answers.
    pub surfaces: [WadeSurface; WADE_MAX_SURFACES],
}

// nothing lies between the fields, so that equal values are equal bytes
const _: () = assert!(size_of::<WadeState>() == 208 && size_of::<WadeForces>() == 4304);
