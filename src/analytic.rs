//! Loads from closed formulas: hydrostatics (E1), form drag (E2) and skin friction (E8).
//!
//! They need no training, so they stand in for CFD until it is there: the first weights are learnt from them and say so.

use crate::condition::{Condition, GroundContact};
use crate::effects::{form_drag, skin_friction};
use crate::frame::Vec3;
use crate::geometry::hydrostatics::surface_hydrostatics_into;
use crate::vehicle::Vehicle;
use crate::wrench::Wrench;

/// What weights learnt from these loads are labelled as.
pub const PROVENANCE: &str = "analytic";

/// Force on each surface, body frame [N], in the order of the vehicle's surfaces.
///
/// Quasi-steady: velocity and attitude count, angular rates and accelerations do not.
pub fn loads(vehicle: &Vehicle, condition: &Condition) -> Vec<Vec3> {
    let mut forces = hydrostatic(vehicle, condition);
    form_drag::add(vehicle, condition, &mut forces);
    skin_friction::add(vehicle, condition, &mut forces);
    forces
}

fn hydrostatic(vehicle: &Vehicle, condition: &Condition) -> Vec<Vec3> {
    let plane = condition.water_plane(vehicle.z0);
    let mut wrenches = vec![Wrench::default(); vehicle.surfaces.len()];
    surface_hydrostatics_into(&vehicle.hull, &plane, condition.density, &Vec3::zeros(), &mut wrenches);
    let mut forces: Vec<Vec3> = wrenches.iter().map(|w| w.force).collect();
    if condition.ground_contact == GroundContact::Dry {
        for patch in &vehicle.contacts {
            forces[patch.surface] += patch.lost_pressure(&plane, condition.density, &patch.center).force;
        }
    }
    forces
}
