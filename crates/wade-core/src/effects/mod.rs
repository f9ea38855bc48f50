//! Physical effects, one a file: equation, source, validity, coefficients with their units.
//!
//! Two families. `form_drag` and `skin_friction` are the loads from which the first weights were learnt: each `add` puts
//! its share onto the force of every surface. The others are the library of [`Effect`]: what a model may lack, or what a
//! measuring chain may add. A physical effect is linear in its coefficients once its [`Shape`] (the form of its law, a time
//! constant, a rate) is fixed, so the same function serves two ends: fitting takes the load of each coefficient at 1, serving
//! the sum with the fitted values. Nothing here allocates once a [`Body`] is prepared. Hydrostatics lies in
//! `geometry::hydrostatics`.
//!
//! An effect describes itself: its file implements `Law` with an [`EffectSpec`], and everything else reads that. A new effect
//! is a file here, a line in the list of `library`, and a number in the proto where it is a load of the water.
//!
//! Reading order: `spec` (what an effect says of itself), `law` (what its file defines), `body` (what an effect needs to
//! know of a hull), `immersion` (where the water reaches), `input` (a state), then the effects and `library`, their list. `file`
//! is `effects.toml`, `validity` the box in which they were seen, `region` the part of it in which one acts, `active` the request path.

pub mod form_drag;
pub mod skin_friction;

pub mod added_mass;
pub mod bed_motion;
pub mod channel_blockage;
pub mod current;
pub mod density_error;
pub mod drag_coefficient_error;
pub mod drive;
pub mod hull_flooding;
pub mod hull_lift;
pub mod linear_damping;
pub mod rotation;
pub mod sensor;
mod spec;
pub mod squat;
pub mod water_entry_slamming;
pub mod water_level_offset;
pub mod wave_memory;
pub mod wheel_paddle_thrust;

mod active;
mod body;
mod channel_flow;
mod file;
mod hydrotable;
mod immersion;
mod input;
mod law;
mod library;
mod region;
mod validity;

pub use active::{ActiveEffects, Answer, Circumstances, EffectLoad, EffectLoads, EffectsSession, LeftOut};
pub use body::{Block, Body, Panel};
pub use channel_flow::is_choked;
pub use file::{ActiveEffect, Between, EffectsFile, EffectsFileError, Evidence, ParameterValue};
pub use hull_flooding::level_after;
pub use immersion::{Immersion, WetPanel};
pub use input::{BaseDrag, DragSpeed, Elsewhere, Input, Memory, Part};
pub use law::{Numbers, ShapeFault};
pub use library::{Effect, MAX_COEFFICIENTS, PHYSICS, Shape};
pub use region::{EffectRegion, RegionLimit, RegionQuantity};
pub use spec::{Coefficient, EffectSpec, Kind, Parameter, Quantity, Rate};
pub use validity::{BoxQuantity, OutsideBox, Validity};
