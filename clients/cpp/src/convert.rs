//! Between what crosses the boundary and what travels.

use std::ffi::c_char;
use std::time::Instant;

use wade_client::Reply;
use wade_core::physics::Physics;
use wade_core::vehicle::PerWheel;
use wade_wire::shm::layout::{self, Answer, Status};
use wade_wire::{Field, InvalidState, Problem, State};

use crate::abi::{
    WADE_DRY_CONTACT, WADE_HAS_ADDED_MASS, WADE_HAS_BASE, WADE_HAS_BED, WADE_HAS_BED_CLEARANCE,
    WADE_HAS_CURRENT_EXPONENT, WADE_HAS_DEPTH_RATE, WADE_HAS_HEADING, WADE_HAS_WATER_LEVEL, WADE_HAS_WAVE,
    WADE_HAS_WHEEL_LEVELS, WADE_HAS_WHEEL_SPEEDS, WADE_IMPLICIT_ADDED_MASS, WADE_IN_DOMAIN, WADE_MAX_EFFECTS,
    WADE_MAX_SURFACES, WADE_MAX_WHEELS, WADE_NAME_SIZE, WADE_NEVER, WADE_PHYSICS_FULL,
    WADE_PHYSICS_HYDROSTATIC, WADE_PHYSICS_QUASI_STEADY, WADE_SESSION_BEGINS, WadeEffectLoad, WadeForces,
    WadeState, WadeStatus,
};
use crate::last::nanoseconds_since;

/// Wheels of a state that does not say how many it has.
const WHEELS: usize = 4;

/// Flags of a state that are known.
const STATE_FLAGS: u32 = WADE_DRY_CONTACT
    | WADE_IMPLICIT_ADDED_MASS
    | WADE_HAS_HEADING
    | WADE_HAS_DEPTH_RATE
    | WADE_HAS_WHEEL_SPEEDS
    | WADE_HAS_WATER_LEVEL
    | WADE_HAS_BED_CLEARANCE
    | WADE_HAS_BED
    | WADE_HAS_WHEEL_LEVELS
    | WADE_HAS_WAVE
    | WADE_HAS_CURRENT_EXPONENT
    | WADE_PHYSICS_HYDROSTATIC
    | WADE_PHYSICS_QUASI_STEADY
    | WADE_PHYSICS_FULL;

/// Flags of which a state has one at most.
const PHYSICS: [(u32, Physics); 3] = [
    (WADE_PHYSICS_HYDROSTATIC, Physics::Hydrostatic),
    (WADE_PHYSICS_QUASI_STEADY, Physics::QuasiSteady),
    (WADE_PHYSICS_FULL, Physics::Full),
];

impl From<&WadeState> for State {
    fn from(state: &WadeState) -> Self {
        let has = |flag: u32| state.flags & flag != 0;
        let count = if state.wheel_count == 0 { WHEELS } else { state.wheel_count as usize };
        let of_wheels = |values: &[f32]| values.get(..count).and_then(PerWheel::new);
        let set = |flag: u32, value: f32| if has(flag) { value } else { 0.0 };
        Self {
            velocity: state.velocity_mps,
            current: state.current_mps,
            angular_velocity: state.angular_velocity_radps,
            acceleration: state.acceleration_mps2,
            angular_acceleration: state.angular_acceleration_radps2,
            gravity: state.gravity_direction,
            depth: if has(WADE_HAS_WATER_LEVEL) { f32::NAN } else { state.depth_m },
            water_level: has(WADE_HAS_WATER_LEVEL).then_some(state.water_level_m),
            bed_clearance: has(WADE_HAS_BED_CLEARANCE).then_some(state.bed_clearance_m),
            bed: has(WADE_HAS_BED).then_some(state.bed),
            density: state.density_kgpm3,
            dry_contact: has(WADE_DRY_CONTACT),
            heading: has(WADE_HAS_HEADING).then_some(state.heading_rad),
            depth_rate: has(WADE_HAS_DEPTH_RATE).then_some(state.depth_rate_mps),
            wheel_speeds: of_wheels(&state.wheel_speed_radps).filter(|_| has(WADE_HAS_WHEEL_SPEEDS)),
            time_step: state.time_step_s,
            implicit_added_mass: has(WADE_IMPLICIT_ADDED_MASS),
            physics: PHYSICS.into_iter().find(|(flag, _)| has(*flag)).map(|(_, physics)| physics),
            jacobian: false,
            wave_vector: state.wave_vector_radpm.map(|part| set(WADE_HAS_WAVE, part)),
            wave_amplitude: set(WADE_HAS_WAVE, state.wave_amplitude_m),
            wave_phase: set(WADE_HAS_WAVE, state.wave_phase_rad),
            wheel_levels: of_wheels(&state.wheel_water_level_m).filter(|_| has(WADE_HAS_WHEEL_LEVELS)),
            current_exponent: set(WADE_HAS_CURRENT_EXPONENT, state.current_exponent),
        }
    }
}

/// A state as it travels, or what the server would refuse in it.
pub fn checked(state: &WadeState) -> Result<State, InvalidState> {
    let wrong = |field, problem| Err(InvalidState::new(field, problem));
    let has = |flags: u32| state.flags & flags == flags;
    if state.flags & !STATE_FLAGS != 0 {
        return wrong(Field::Flags, Problem::Unsupported);
    }
    if PHYSICS.into_iter().filter(|(flag, _)| has(*flag)).count() > 1 {
        return wrong(Field::Physics, Problem::Unknown);
    }
    for (flag, field) in
        [(WADE_HAS_WHEEL_SPEEDS, Field::WheelSpeed), (WADE_HAS_WHEEL_LEVELS, Field::WheelWaterLevel)]
    {
        if has(flag) && state.wheel_count as usize > WADE_MAX_WHEELS {
            return wrong(field, Problem::Count);
        }
    }
    let state = State::from(state);
    state.check()?;
    Ok(state)
}

const NO_LOAD: WadeEffectLoad =
    WadeEffectLoad { effect: 0, left_out: 0, force_n: [0.0; 3], moment_nm: [0.0; 3] };

impl WadeForces {
    /// No answer.
    pub const NONE: Self = Self {
        age_ns: WADE_NEVER,
        answer: 0,
        compute_ns: 0,
        flags: 0,
        invalid_field: 0,
        invalid_problem: 0,
        bundle_version: 0,
        surface_count: 0,
        effect_count: 0,
        shaft_power_w: 0.0,
        force_n: [0.0; 3],
        moment_nm: [0.0; 3],
        about_m: [0.0; 3],
        uncertainty_n: [0.0; 3],
        moment_uncertainty_nm: [0.0; 3],
        water_level_m: 0.0,
        bed_clearance_m: 0.0,
        bed: 0.0,
        outside: [0.0; 8],
        effects_outside: [0.0; 5],
        added_mass: [0.0; 36],
        damping: [0.0; 36],
        surface_force_n: [[0.0; 3]; WADE_MAX_SURFACES],
        surface_point_m: [[0.0; 3]; WADE_MAX_SURFACES],
        surface_couple_nm: [[0.0; 3]; WADE_MAX_SURFACES],
        wetted_fraction: [0.0; WADE_MAX_SURFACES],
        effect_surface_force_n: [[0.0; 3]; WADE_MAX_SURFACES],
        effects: [NO_LOAD; WADE_MAX_EFFECTS],
        provenance: [0; WADE_NAME_SIZE],
    };

    /// Copies the answers to a batch to its caller, all as old as its question.
    pub fn copy_batch(answers: &[Self], asked: Instant, to: &mut [Self]) {
        let age_ns = nanoseconds_since(asked);
        for (forces, answer) in to.iter_mut().zip(answers) {
            *forces = Self { age_ns, ..*answer };
        }
    }

    /// Names what is wrong with the state that was asked about.
    pub fn blame(&mut self, invalid: &InvalidState) {
        (self.invalid_field, self.invalid_problem) = (invalid.field as u32, invalid.problem as u32);
    }
}

/// Why there are no forces, and what was wrong with the state where something was.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    pub status: WadeStatus,
    pub invalid: Option<InvalidState>,
}

/// What an answer over shared memory says: the forces, or why there are none.
pub fn answered(answer: &Answer) -> Result<WadeForces, Refused> {
    if answer.status == Status::Ok as u32 {
        return Ok(answer.into());
    }
    Err(refused(answer.status, answer.refusal()))
}

/// Why there are no forces, for the status of an answer. A state was checked before it was sent: a server that refuses it has
/// other limits, or the vehicle has other wheels.
pub fn refused(status: u32, invalid: Option<InvalidState>) -> Refused {
    let status = if status == Status::NotServed as u32 {
        WadeStatus::UnknownVehicle
    } else if invalid.is_some() {
        WadeStatus::InvalidState
    } else {
        WadeStatus::Refused
    };
    Refused { status, invalid }
}

impl From<&Answer> for WadeForces {
    fn from(answer: &Answer) -> Self {
        let flag = |set: bool, flag: u32| if set { flag } else { 0 };
        let (surfaces, effects) = (answer.surfaces(), answer.effects());
        let has = |flag: u64| answer.flags & flag != 0;
        let (has_added_mass, has_base) = (has(layout::HAS_ADDED_MASS), has(layout::HAS_DAMPING));
        let mut forces = Self {
            compute_ns: answer.compute_ns,
            flags: flag(!answer.is_outside(), WADE_IN_DOMAIN)
                | flag(has(layout::SESSION_BEGINS), WADE_SESSION_BEGINS)
                | flag(has_added_mass, WADE_HAS_ADDED_MASS)
                | flag(has_base, WADE_HAS_BASE),
            bundle_version: answer.bundle_version,
            surface_count: surfaces.len().min(WADE_MAX_SURFACES) as u32,
            effect_count: effects.len().min(WADE_MAX_EFFECTS) as u32,
            force_n: answer.force_n,
            moment_nm: answer.moment_nm,
            about_m: answer.about_m,
            uncertainty_n: answer.force_deviation_n,
            outside: answer.outside().excess.map(|excess| excess as f32),
            effects_outside: answer.effects_outside().map(|excess| excess as f32),
            moment_uncertainty_nm: answer.moment_deviation_nm,
            added_mass: if has_added_mass { answer.added_mass } else { [0.0; 36] },
            ..Self::NONE
        };
        if has_base {
            forces.damping = answer.damping;
            (forces.water_level_m, forces.bed_clearance_m) = (answer.water_level_m, answer.bed_clearance_m);
            (forces.bed, forces.shaft_power_w) = (answer.bed, answer.shaft_power());
        }
        for (i, load) in surfaces.iter().take(WADE_MAX_SURFACES).enumerate() {
            forces.surface_force_n[i] = load.force_n;
            forces.surface_point_m[i] = load.point_m;
            if has_base {
                forces.surface_couple_nm[i] = load.couple_nm;
            }
            forces.wetted_fraction[i] = load.wetted_fraction;
            if !effects.is_empty() {
                forces.effect_surface_force_n[i] = load.effect_force_n;
            }
        }
        for (slot, load) in forces.effects.iter_mut().zip(effects) {
            *slot = WadeEffectLoad {
                effect: load.effect,
                left_out: load.left_out,
                force_n: load.force_n,
                moment_nm: load.moment_nm,
            };
        }
        write_text(&mut forces.provenance, answer.provenance());
        forces
    }
}

impl From<&Reply> for WadeForces {
    fn from(reply: &Reply) -> Self {
        let flag = |set: bool, flag: u32| if set { flag } else { 0 };
        let outside = reply.outside.excess.map(|excess| excess as f32);
        let mut forces = Self {
            compute_ns: reply.compute_ns,
            flags: flag(outside == [0.0; 8], WADE_IN_DOMAIN)
                | flag(reply.added_mass.is_some(), WADE_HAS_ADDED_MASS)
                | flag(reply.base.is_some(), WADE_HAS_BASE),
            bundle_version: reply.version,
            surface_count: reply.surfaces.len().min(WADE_MAX_SURFACES) as u32,
            effect_count: reply.effects.len().min(WADE_MAX_EFFECTS) as u32,
            force_n: reply.force,
            moment_nm: reply.moment,
            about_m: reply.about,
            uncertainty_n: reply.uncertainty,
            moment_uncertainty_nm: reply.moment_uncertainty,
            outside,
            effects_outside: reply.effects_outside.map(|excess| excess as f32),
            added_mass: reply.added_mass.unwrap_or([0.0; 36]),
            ..Self::NONE
        };
        if let Some(base) = &reply.base {
            forces.damping = base.damping;
            (forces.water_level_m, forces.bed_clearance_m) = (base.water_level, base.bed_clearance);
            (forces.bed, forces.shaft_power_w) = (base.bed, base.shaft_power);
        }
        for (i, surface) in reply.surfaces.iter().take(WADE_MAX_SURFACES).enumerate() {
            forces.surface_force_n[i] = surface.force;
            forces.surface_point_m[i] = surface.point;
            forces.surface_couple_nm[i] = surface.couple;
            forces.wetted_fraction[i] = surface.wetted_fraction;
        }
        for (slot, force) in forces.effect_surface_force_n.iter_mut().zip(&reply.effect_surface_forces) {
            *slot = *force;
        }
        for (slot, load) in forces.effects.iter_mut().zip(&reply.effects) {
            *slot = WadeEffectLoad {
                effect: load.effect.code(),
                left_out: load.left_out.map_or(0, |reason| reason as u32),
                force_n: load.force,
                moment_nm: load.moment,
            };
        }
        write_text(&mut forces.provenance, &reply.provenance);
        forces
    }
}

/// Writes a text with its end, cut to the room there is.
pub fn write_text(room: &mut [c_char], text: &str) {
    let len = text.floor_char_boundary(room.len() - 1);
    room.fill(0);
    for (place, byte) in room.iter_mut().zip(&text.as_bytes()[..len]) {
        *place = *byte as c_char;
    }
}
