//! Physical effects, one a file: equation, source, validity, coefficients with their units.
//!
//! Two families. `form_drag` and `skin_friction` are the loads from which the first weights were learnt: each `add` puts
//! its share onto the force of every surface. The others are the library of [`Effect`]: what a model may lack, or what a
//! measuring chain may add. A physical effect is linear in its coefficients once its shape (a time constant, a rate) is
//! fixed, so the same function serves two ends: fitting takes the load of each coefficient at 1, serving the sum with the
//! fitted values. Nothing here allocates once a [`Body`] is prepared. Hydrostatics lies in `geometry::hydrostatics`.
//!
//! Reading order: `library` (names, coefficients, bounds), `body` (what an effect needs to know of a hull), `immersion`
//! (where the water reaches), `input` (a state), then the effects. `file` is `effects.toml`, `validity` the box in which they
//! were seen, `active` the request path.

pub mod form_drag;
pub mod skin_friction;

mod active;
mod added_mass;
mod bed_motion;
mod body;
mod channel_blockage;
mod channel_flow;
mod current;
mod density_error;
mod drag_coefficient_error;
mod file;
mod hull_flooding;
mod hydrotable;
mod immersion;
mod input;
mod library;
mod linear_damping;
mod rotation;
mod squat;
mod validity;
mod water_entry_slamming;
mod water_level_offset;
mod wave_memory;
mod wheel_paddle_thrust;

pub use active::{ActiveEffects, Answer, Circumstances, EffectLoad, EffectLoads, LeftOut, Session};
pub use added_mass::{coefficients as added_mass_coefficients, matrix as added_mass_matrix};
pub use body::{Block, Body, Panel};
pub use channel_flow::is_choked;
pub use file::{ActiveEffect, Between, EffectsFile, EffectsFileError, Evidence, ParameterValue};
pub use hull_flooding::level_after;
pub use immersion::{Immersion, WetPanel};
pub use input::{BaseDrag, Input, Memory, Part};
pub use library::{Coefficient, Effect, Kind, MAX_COEFFICIENTS, PHYSICS, Shape};
pub use validity::{BoxQuantity, OutsideBox, Validity};

use crate::wrench::Wrench;

/// Emits the load of each coefficient of a physical effect at 1: number of the coefficient, the part of the hull that
/// carries it, and the load about the center of mass, body frame [N, N m]. Effects of the measuring chain or the drive,
/// which are no load of the water, emit nothing.
pub fn basis(
    effect: Effect,
    shape: &Shape,
    memory: &Memory,
    input: &Input,
    mut emit: impl FnMut(usize, Part, Wrench),
) {
    match effect {
        Effect::AddedMass => added_mass::basis(shape, input, &mut emit),
        Effect::LinearDamping => linear_damping::basis(input, &mut emit),
        Effect::DragCoefficientError => drag_coefficient_error::basis(shape, input, &mut emit),
        Effect::Rotation => rotation::basis(shape, input, &mut emit),
        Effect::Current => current::basis(shape, input, &mut emit),
        Effect::WaterLevelOffset => water_level_offset::basis(input, &mut emit),
        Effect::DensityError => density_error::basis(input, &mut emit),
        Effect::HullFlooding => hull_flooding::basis(memory, input, &mut emit),
        Effect::WaterEntrySlamming => water_entry_slamming::basis(shape, input, &mut emit),
        Effect::WaveMemory => wave_memory::basis(shape, memory, input, &mut emit),
        Effect::ChannelBlockage => channel_blockage::basis(shape, input, &mut emit),
        Effect::Squat => squat::basis(shape, input, &mut emit),
        Effect::WheelPaddleThrust => wheel_paddle_thrust::basis(shape, input, &mut emit),
        Effect::BedMotion => bed_motion::basis(shape, input, &mut emit),
        Effect::SensorDelay
        | Effect::SensorBias
        | Effect::SensorBiasStep
        | Effect::SensorDrift
        | Effect::SensorGain
        | Effect::AxisMisalignment
        | Effect::RollingResistance
        | Effect::DriveGain
        | Effect::MassError => {}
    }
}

/// Advances the state of an effect with memory by `dt` [s], of the first state of a run by 0; the others have none.
pub fn advance(effect: Effect, shape: &Shape, memory: &mut Memory, input: &Input, dt: f64) {
    match effect {
        Effect::HullFlooding if dt > 0.0 => hull_flooding::advance(shape, memory, input, dt),
        Effect::WaveMemory => wave_memory::advance(shape, memory, input, dt),
        _ => {}
    }
}
