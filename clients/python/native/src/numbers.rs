//! States as the client passes them: single-precision numbers in the order of `State.floats`, and flags.

use wade_core::physics::Physics;
use wade_core::vehicle::{MAX_WHEELS, PerWheel};
use wade_wire::State;
use wade_wire::shm::layout::{
    DRY_CONTACT, FULL, HAS_BED, HAS_BED_CLEARANCE, HAS_CURRENT_EXPONENT, HAS_DEPTH_RATE, HAS_HEADING,
    HAS_WATER_LEVEL, HAS_WAVE, HAS_WHEEL_LEVELS, HAS_WHEEL_SPEEDS, HYDROSTATIC, IMPLICIT_ADDED_MASS,
    JACOBIAN, QUASI_STEADY,
};

/// Numbers of a state.
pub const NUMBERS: usize = 32 + 2 * MAX_WHEELS;

/// Those of them that say how the water moves, and the time step.
const MOVING: usize = 7 + MAX_WHEELS;

/// Bytes that are no rows of states.
#[derive(Debug, thiserror::Error)]
#[error("{len} bytes of {what} are not {expected}: module and client differ in version")]
pub struct Misshapen {
    what: &'static str,
    len: usize,
    expected: &'static str,
}

/// A state of its numbers and of the flags of shared memory.
pub fn state(numbers: &[f32; NUMBERS], flags: u64) -> State {
    let (still, moving) = numbers.split_at(NUMBERS - MOVING);
    let &[depth, density, ref middle @ .., water_level, bed_clearance, bed] = still else { unreachable!() };
    let &[kx, ky, kz, amplitude, phase, ref levels @ .., exponent, time_step] = moving else {
        unreachable!()
    };
    let vector = |i: usize| [middle[3 * i], middle[3 * i + 1], middle[3 * i + 2]];
    let (heading, depth_rate, wheels) = (middle[18], middle[19], &middle[20..]);
    // places behind the last wheel are NaN
    let per_wheel = |places: &[f32]| places.first_chunk().map(PerWheel::stated);
    let has = |flag: u64| flags & flag != 0;
    State {
        velocity: vector(0),
        current: vector(1),
        angular_velocity: vector(2),
        acceleration: vector(3),
        angular_acceleration: vector(4),
        gravity: vector(5),
        depth,
        density,
        dry_contact: has(DRY_CONTACT),
        heading: has(HAS_HEADING).then_some(heading),
        depth_rate: has(HAS_DEPTH_RATE).then_some(depth_rate),
        wheel_speeds: per_wheel(wheels).filter(|_| has(HAS_WHEEL_SPEEDS)),
        time_step,
        implicit_added_mass: has(IMPLICIT_ADDED_MASS),
        water_level: has(HAS_WATER_LEVEL).then_some(water_level),
        bed_clearance: has(HAS_BED_CLEARANCE).then_some(bed_clearance),
        bed: has(HAS_BED).then_some(bed),
        physics: match flags & (HYDROSTATIC | QUASI_STEADY | FULL) {
            HYDROSTATIC => Some(Physics::Hydrostatic),
            QUASI_STEADY => Some(Physics::QuasiSteady),
            FULL => Some(Physics::Full),
            _ => None,
        },
        jacobian: has(JACOBIAN),
        wave_vector: if has(HAS_WAVE) { [kx, ky, kz] } else { [0.0; 3] },
        wave_amplitude: if has(HAS_WAVE) { amplitude } else { 0.0 },
        wave_phase: if has(HAS_WAVE) { phase } else { 0.0 },
        wheel_levels: per_wheel(levels).filter(|_| has(HAS_WHEEL_LEVELS)),
        current_exponent: if has(HAS_CURRENT_EXPONENT) { exponent } else { 0.0 },
    }
}

/// A row of a batch, of which NaN says that it states none.
fn stated(state: State) -> State {
    let stated = |value: Option<f32>| value.filter(|value| !value.is_nan());
    State {
        water_level: stated(state.water_level),
        bed_clearance: stated(state.bed_clearance),
        bed: stated(state.bed),
        ..state
    }
}

/// The states of a batch, and the number of the session of each: none, or one a state.
pub fn batch(numbers: &[u8], flags: u64, sessions: &[u8]) -> Result<(Vec<State>, Vec<u64>), Misshapen> {
    let misshapen = |what, len, expected| Misshapen { what, len, expected };
    let (words, rest) = numbers.as_chunks::<4>();
    let words: Vec<f32> = words.iter().map(|&word| f32::from_le_bytes(word)).collect();
    let (rows, beyond) = words.as_chunks::<NUMBERS>();
    if !rest.is_empty() || !beyond.is_empty() {
        return Err(misshapen("numbers", numbers.len(), "whole states"));
    }
    let (numbered, rest) = sessions.as_chunks::<8>();
    if !rest.is_empty() || !(numbered.is_empty() || numbered.len() == rows.len()) {
        return Err(misshapen("sessions", sessions.len(), "one a state"));
    }
    let numbered = numbered.iter().map(|&word| u64::from_le_bytes(word)).collect();
    Ok((rows.iter().map(|row| stated(state(row, flags))).collect(), numbered))
}
