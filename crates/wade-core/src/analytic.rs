//! Loads from closed formulas: hydrostatics, form drag and skin friction.
//!
//! They need no training, so they stand in for CFD until it is there: the first weights are learnt from them and say so.

use crate::condition::Condition;
use crate::effects::{form_drag, skin_friction};
use crate::frame::Vec3;
use crate::vehicle::Vehicle;

/// What weights learnt from these loads are labelled as.
pub const PROVENANCE: &str = "analytic";

/// Force on each surface, body frame [N], in the order of the vehicle's surfaces.
///
/// Quasi-steady: velocity and attitude count, angular rates and accelerations do not.
pub fn loads(vehicle: &Vehicle, condition: &Condition) -> Vec<Vec3> {
    let mut forces: Vec<Vec3> = vehicle.at_rest(condition).iter().map(|load| load.force).collect();
    form_drag::add(vehicle, condition, &mut forces);
    skin_friction::add(vehicle, condition, &mut forces);
    forces
}
