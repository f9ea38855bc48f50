//! What a network is to say of a sample: the load of the data set with the vehicle's own hydrostatics.

use super::TrainError;
use crate::condition::{Condition, GroundContact};
use crate::dataset::Sample;
use crate::frame::Vec3;
use crate::geometry::hydrostatics::surface_hydrostatics;
use crate::vehicle::Vehicle;
use crate::wrench::Wrench;

/// The load on one surface, body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Label {
    /// Force [N].
    pub force: Vec3,
    /// Moment about the body origin [N m]; `None` where the data set has none.
    pub moment: Option<Vec3>,
}

/// Hydrostatic load on each surface of the vehicle's hull about the body origin, in the ground-contact convention of the
/// state.
pub fn at_rest(vehicle: &Vehicle, condition: &Condition) -> Vec<Wrench> {
    let (plane, origin) = (condition.water_plane(vehicle.z0), Vec3::zeros());
    let mut loads =
        surface_hydrostatics(&vehicle.hull, vehicle.surfaces.len(), &plane, condition.density, &origin);
    if condition.ground_contact == GroundContact::Dry {
        for patch in &vehicle.contacts {
            loads[patch.surface] += patch.lost_pressure(&plane, condition.density, &origin);
        }
    }
    loads
}

/// The loads to learn and to be judged by, in the order of the vehicle's surfaces.
///
/// `load - load at rest on the case's own mesh + exact hydrostatics of the hull`: a castellated CFD mesh displaces
/// another volume than the hull, by several per cent, and that difference is no property of the flow. Where a load has no
/// part at rest it is taken as it is. `order` says where each of the vehicle's surfaces stands in the data set.
pub fn labels(vehicle: &Vehicle, order: &[usize], sample: &Sample) -> Vec<Label> {
    let exact = at_rest(vehicle, &sample.condition);
    let label = |(&index, exact): (&usize, &Wrench)| {
        let load = &sample.surfaces[index];
        let Some(rest) = load.rest else { return Label { force: load.force, moment: load.moment } };
        Label {
            force: load.force - rest.force + exact.force,
            moment: load.moment.map(|moment| moment - rest.moment + exact.moment),
        }
    };
    order.iter().zip(&exact).map(label).collect()
}

/// Where each of the vehicle's surfaces stands among those of a data set.
pub fn order(vehicle: &Vehicle, surfaces: &[String]) -> Result<Vec<usize>, TrainError> {
    let unknown =
        |surface: &String| TrainError::Surfaces { vehicle: vehicle.name.clone(), surface: surface.clone() };
    if let Some(extra) = surfaces.iter().find(|surface| vehicle.surface_index(surface).is_none()) {
        return Err(unknown(extra));
    }
    let place = |surface: &crate::vehicle::Surface| {
        surfaces.iter().position(|name| *name == surface.name).ok_or_else(|| unknown(&surface.name))
    };
    vehicle.surfaces.iter().map(place).collect()
}
