//! What a network is to say of a sample: the load of the data set with the vehicle's own hydrostatics.

use super::Sample;
use wade_core::frame::Vec3;
use wade_core::vehicle::Vehicle;
use wade_core::wrench::Wrench;

/// The load on one surface, body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Label {
    /// Force [N].
    pub force: Vec3,
    /// Moment about the body origin [N m]; `None` where the data set has none.
    pub moment: Option<Vec3>,
}

/// The loads to learn and to be judged by, in the order of the vehicle's surfaces.
///
/// `load - load at rest on the case's own mesh + exact hydrostatics of the hull`: a castellated CFD mesh displaces
/// another volume than the hull, by several per cent, and that difference is no property of the flow. Where a load has no
/// part at rest it is taken as it is. `order` says where each of the vehicle's surfaces stands in the data set.
pub fn labels(vehicle: &Vehicle, order: &[usize], sample: &Sample) -> Vec<Label> {
    let exact = vehicle.at_rest(&sample.condition);
    let add = |(label, exact): (Label, &Wrench)| Label {
        force: label.force + exact.force,
        moment: label.moment.map(|moment| moment + exact.moment),
    };
    beyond(order, sample, &exact).zip(&exact).map(add).collect()
}

/// What the motion adds to the load of still water, in the order of the vehicle's surfaces.
pub fn dynamic(vehicle: &Vehicle, order: &[usize], sample: &Sample) -> Vec<Label> {
    beyond(order, sample, &vehicle.at_rest(&sample.condition)).collect()
}

/// Each load less its part at rest, or less the hull's own where the data set states none.
fn beyond<'a>(
    order: &'a [usize],
    sample: &'a Sample,
    exact: &'a [Wrench],
) -> impl Iterator<Item = Label> + 'a {
    order.iter().zip(exact).map(|(&index, exact)| {
        let load = &sample.surfaces[index];
        let (force, moment) = load.rest.map_or((exact.force, exact.moment), |rest| (rest.force, rest.moment));
        Label { force: load.force - force, moment: load.moment.map(|found| found - moment) }
    })
}

/// Surfaces of another version of the vehicle.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "vehicle `{vehicle}`: the bundle and the data set do not name the same surfaces; `{surface}` is in one of them"
)]
pub struct OtherSurfaces {
    /// The vehicle.
    pub vehicle: String,
    /// A surface that only one of them has.
    pub surface: String,
}

/// Where each of the vehicle's surfaces stands among those of a data set.
pub fn order(vehicle: &Vehicle, surfaces: &[String]) -> Result<Vec<usize>, OtherSurfaces> {
    let unknown =
        |surface: &String| OtherSurfaces { vehicle: vehicle.name.clone(), surface: surface.clone() };
    if let Some(extra) = surfaces.iter().find(|surface| vehicle.surface_index(surface).is_none()) {
        return Err(unknown(extra));
    }
    let place = |surface: &wade_core::vehicle::Surface| {
        surfaces.iter().position(|name| *name == surface.name).ok_or_else(|| unknown(&surface.name))
    };
    vehicle.surfaces.iter().map(place).collect()
}
