//! The analytic loads in the form of a data set.

use super::{Image, Rest, Sample, SurfaceLoad};
use wade_core::analytic;
use wade_core::condition::Condition;
use wade_core::frame::Vec3;
use wade_core::vehicle::Vehicle;
use wade_core::wrench::Wrench;

/// One steady sample a state, with the hydrostatic load as the load at rest. Cases are named by vehicle and number.
///
/// The formulas give forces without points of application, so there are no moments.
pub fn samples(vehicle: &Vehicle, set: &str, states: &[Condition]) -> Vec<Sample> {
    let sample = |(number, condition): (usize, &Condition)| {
        let loads = analytic::loads(vehicle, condition).into_iter().zip(vehicle.at_rest(condition));
        let load = |(force, rest): (Vec3, Wrench)| {
            let rest = Some(Rest { force: rest.force, moment: rest.moment });
            SurfaceLoad { force, moment: None, viscous: None, rest }
        };
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
