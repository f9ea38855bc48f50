//! The benchmark of a wrench that is inferred from motion alone.
//!
//! A vehicle drives on a flat bed: surge, sway and yaw are integrated, the bed holds heave, pitch and roll. The water's
//! force is the simulator's prediction and what is hidden. Two driven wheels amidships steer by skid; they resist sideways
//! motion with a force through the center of mass, which no column states, so that fy cannot be inferred. Cameras record
//! the pose, which the source paper's processing turns into velocities and accelerations. All of it is generated.
//!
//! Words: the *change* of a trial is the wrench inferred from its exact motion less the prediction for the exact state.
//! The *floor* is the root mean square of the recorded gap of the same trials with nothing hidden in them; the *strength*
//! is that of the change over the floor (`hidden::strength`). Both are of fx, since `trials.toml` states no yaw inertia, and
//! both less the dry twin's where there is one.
//!
//! Reading order: `cause` (what is hidden), `command` (what the drive does), `dynamics` (the exact motion),
//! `capture` (what cameras and the drive record), `case` (what is hidden where), `generate`, `key` (what is true and which
//! answers are allowed), `score`.

mod capture;
mod case;
mod cause;
mod command;
mod dynamics;
mod generate;
mod key;
mod score;
#[cfg(test)]
mod tests;

pub use case::{Case, Flaw, Group, MarkerNoise, cases};
pub use cause::{Cause, Planted};
pub use command::Plan;
pub use generate::{Generated, generate};
pub use key::{Allowed, Answered, Grade, Key, Rule};
pub use score::{Graded, rows, run};

use super::{Hull, Prediction, Simulator};

/// Name of the generated vehicle.
const VEHICLE: &str = "generated-box";
/// Mass of the vehicle [kg]: its wheels bear load at every depth of the trials.
const MASS: f64 = 300.0;

/// The vehicle: the generated box, heavier.
fn hull() -> Hull {
    let mut hull = Hull::generated_box();
    hull.mass = MASS;
    hull
}

/// Moment of inertia of a box of even density about its vertical axis [kg m2].
fn yaw_inertia(hull: &Hull) -> f64 {
    hull.mass * (hull.length * hull.length + hull.width * hull.width) / 12.0
}

fn simulator(hull: &Hull) -> Simulator<'_> {
    Simulator { hull, prediction: Prediction::Analytic, vehicle: VEHICLE }
}
