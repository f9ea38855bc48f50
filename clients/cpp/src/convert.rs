//! Between what crosses the boundary and what travels.

use std::ffi::c_char;
use std::time::Instant;

use wade_client::Reply;
use wade_wire::shm::layout::{self, Answer, Status};
use wade_wire::{InvalidState, State};

use crate::abi::{
    WADE_DRY_CONTACT, WADE_HAS_ADDED_MASS, WADE_HAS_DEPTH_RATE, WADE_HAS_HEADING, WADE_HAS_WHEEL_SPEEDS,
    WADE_IMPLICIT_ADDED_MASS, WADE_IN_DOMAIN, WADE_MAX_EFFECTS, WADE_MAX_SURFACES, WADE_NAME_SIZE,
    WADE_NEVER, WADE_SESSION_BEGINS, WadeEffectLoad, WadeForces, WadeState, WadeStatus,
};
use crate::last::nanoseconds_since;

impl From<&WadeState> for State {
    fn from(state: &WadeState) -> Self {
        let has = |flag: u32| state.flags & flag != 0;
        Self {
            velocity: state.velocity_mps,
            current: state.current_mps,
            angular_velocity: state.angular_velocity_radps,
            acceleration: state.acceleration_mps2,
            angular_acceleration: state.angular_acceleration_radps2,
            gravity: state.gravity_direction,
            depth: state.depth_m,
            density: state.density_kgpm3,
            dry_contact: has(WADE_DRY_CONTACT),
            heading: has(WADE_HAS_HEADING).then_some(state.heading_rad),
            depth_rate: has(WADE_HAS_DEPTH_RATE).then_some(state.depth_rate_mps),
            wheel_speeds: has(WADE_HAS_WHEEL_SPEEDS).then_some(state.wheel_speed_radps),
            time_step: state.time_step_s,
            implicit_added_mass: has(WADE_IMPLICIT_ADDED_MASS),
            ..Self::default()
        }
    }
}

/// A state as it travels, or what the server would refuse in it.
pub fn checked(state: &WadeState) -> Result<State, InvalidState> {
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
        reserved: 0,
        force_n: [0.0; 3],
        moment_nm: [0.0; 3],
        about_m: [0.0; 3],
        uncertainty_n: [0.0; 3],
        outside: [0.0; 8],
        effects_outside: [0.0; 5],
        added_mass: [0.0; 36],
        surface_force_n: [[0.0; 3]; WADE_MAX_SURFACES],
        surface_point_m: [[0.0; 3]; WADE_MAX_SURFACES],
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
    pub fn blame(&mut self, invalid: InvalidState) {
        (self.invalid_field, self.invalid_problem) = (invalid.field as u32, invalid.problem as u32);
    }
}

/// What an answer over shared memory says: the forces, or why there are none.
pub fn answered(answer: &Answer) -> Result<WadeForces, WadeStatus> {
    if answer.status == Status::Ok as u32 {
        return Ok(answer.into());
    }
    Err(refused(answer.status, answer.refusal().is_some()))
}

/// Why there are no forces, for the status of an answer. A state was checked before it was sent: a server that refuses it has
/// other limits.
pub fn refused(status: u32, names_a_field: bool) -> WadeStatus {
    if status == Status::NotServed as u32 {
        WadeStatus::UnknownVehicle
    } else if names_a_field {
        WadeStatus::InvalidState
    } else {
        WadeStatus::Refused
    }
}

impl From<&Answer> for WadeForces {
    fn from(answer: &Answer) -> Self {
        let flag = |set: bool, flag: u32| if set { flag } else { 0 };
        let (surfaces, effects) = (answer.surfaces(), answer.effects());
        let has_added_mass = answer.flags & layout::HAS_ADDED_MASS != 0;
        let mut forces = Self {
            compute_ns: answer.compute_ns,
            flags: flag(!answer.is_outside(), WADE_IN_DOMAIN)
                | flag(answer.flags & layout::SESSION_BEGINS != 0, WADE_SESSION_BEGINS)
                | flag(has_added_mass, WADE_HAS_ADDED_MASS),
            bundle_version: answer.bundle_version,
            surface_count: surfaces.len().min(WADE_MAX_SURFACES) as u32,
            effect_count: effects.len().min(WADE_MAX_EFFECTS) as u32,
            force_n: answer.force_n,
            moment_nm: answer.moment_nm,
            about_m: answer.about_m,
            uncertainty_n: answer.force_deviation_n,
            outside: answer.outside().excess.map(|excess| excess as f32),
            effects_outside: answer.effects_outside().map(|excess| excess as f32),
            added_mass: if has_added_mass { answer.added_mass } else { [0.0; 36] },
            ..Self::NONE
        };
        for (i, load) in surfaces.iter().take(WADE_MAX_SURFACES).enumerate() {
            forces.surface_force_n[i] = load.force_n;
            forces.surface_point_m[i] = load.point_m;
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
                | flag(reply.added_mass.is_some(), WADE_HAS_ADDED_MASS),
            bundle_version: reply.version,
            surface_count: reply.surfaces.len().min(WADE_MAX_SURFACES) as u32,
            effect_count: reply.effects.len().min(WADE_MAX_EFFECTS) as u32,
            force_n: reply.force,
            moment_nm: reply.moment,
            about_m: reply.about,
            uncertainty_n: reply.uncertainty,
            outside,
            effects_outside: reply.effects_outside.map(|excess| excess as f32),
            added_mass: reply.added_mass.unwrap_or([0.0; 36]),
            ..Self::NONE
        };
        for (i, surface) in reply.surfaces.iter().take(WADE_MAX_SURFACES).enumerate() {
            forces.surface_force_n[i] = surface.force;
            forces.surface_point_m[i] = surface.point;
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
