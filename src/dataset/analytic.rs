//! The analytic loads in the form of a data set.

use super::{Image, Rest, Sample, SurfaceLoad};
use crate::analytic;
use crate::condition::{Condition, GroundContact};
use crate::frame::Vec3;
use crate::geometry::hydrostatics::surface_hydrostatics;
use crate::vehicle::Vehicle;

/// One steady sample a state, with the hydrostatic load as the load at rest. Cases are named by vehicle and number.
///
/// The formulas give forces without points of application, so there are no moments.
pub fn samples(vehicle: &Vehicle, set: &str, states: &[Condition]) -> Vec<Sample> {
    let sample = |(number, condition): (usize, &Condition)| {
        let loads = analytic::loads(vehicle, condition).into_iter().zip(rest(vehicle, condition));
        let load = |(force, rest)| SurfaceLoad { force, moment: None, viscous: None, rest: Some(rest) };
        Sample {
            vehicle: vehicle.name.clone(),
            case: format!("{}-{number:04}", vehicle.name),
            set: set.to_owned(),
            image: Image::Original,
            section: 0,
            start_s: 0.0,
            end_s: 0.0,
            condition: *condition,
            surfaces: loads.map(load).collect(),
        }
    };
    states.iter().enumerate().map(sample).collect()
}

/// The hydrostatic load on each surface, by the convention of the state.
fn rest(vehicle: &Vehicle, condition: &Condition) -> Vec<Rest> {
    let (plane, origin) = (condition.water_plane(vehicle.z0), Vec3::zeros());
    let mut loads =
        surface_hydrostatics(&vehicle.hull, vehicle.surfaces.len(), &plane, condition.density, &origin);
    if condition.ground_contact == GroundContact::Dry {
        for patch in &vehicle.contacts {
            loads[patch.surface] += patch.lost_pressure(&plane, condition.density, &origin);
        }
    }
    loads.into_iter().map(|load| Rest { force: load.force, moment: load.moment }).collect()
}
