//! Is the vertical force of CFD that of a hull of this size in this water? A wrong unit, density or depth is a plausible
//! number to everything else.

use std::collections::BTreeMap;
use std::fmt;

use super::{Dataset, Sample};
use wade_core::frame::Vec3;
use wade_core::vehicle::Vehicle;

/// Lift at rest below which a sample says nothing [N].
const LEAST_LIFT: f64 = 1.0;

/// Vertical force over the lift at rest that motion explains: suction under the hull takes up to a third, a bow wave adds
/// as much.
const USUAL_RATIO: [f64; 2] = [0.62, 1.6];

/// The same for half a hull: half of what motion explains would reach into the usual, so it is the middle of that.
const HALF_RATIO: [f64; 2] = [0.4, USUAL_RATIO[0]];

/// Factor by which a ratio may differ from a power that a wrong unit makes.
const UNIT_FACTOR: f64 = 3.0;

/// What may be wrong with the vertical force of a vehicle's cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The force was not multiplied by the density.
    OverDensity,
    /// A symmetry plane cut the hull.
    HalfDomain,
    /// Kilonewtons, or millimeters.
    Unit,
    /// It points down.
    Axis,
    /// The pressure was without its hydrostatic part.
    NoHydrostaticPressure,
    /// Something else.
    Unknown,
}

/// The vertical force of a vehicle's cases beside the lift of its hull.
#[derive(Debug, Clone, PartialEq)]
pub struct Lift {
    /// The vehicle.
    pub vehicle: String,
    /// Vertical force of the sample with the median ratio [N].
    pub force: f64,
    /// Lift of the hull at rest in the same state, by Archimedes [N].
    pub at_rest: f64,
    /// Its case.
    pub case: String,
    /// Number of samples that were compared.
    pub samples: usize,
    /// What may be wrong.
    pub cause: Cause,
}

impl fmt::Display for Lift {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { vehicle, force, at_rest, case, samples, cause } = self;
        let ratio = force / at_rest;
        write!(
            f,
            "{vehicle}: the vertical force is {ratio:.4} of the lift that Archimedes gives the hull at rest, {force:.4} N of \
             {at_rest:.1} N in case `{case}`, the median of {samples} samples: {}",
            match cause {
                Cause::OverDensity => "are the forces over the density (rhoInf 1)?",
                Cause::HalfDomain => "is it half a hull, cut by a symmetry plane?",
                Cause::Unit => "are the forces in another unit than newtons?",
                Cause::Axis => "does z of [frame] in case.toml point up?",
                Cause::NoHydrostaticPressure =>
                    "are the forces without hydrostatic pressure (p_rgh), or is depth_m of case.toml wrong?",
                Cause::Unknown => "are depth_m, origin_m and density_kgpm3 of case.toml right?",
            }
        )
    }
}

/// Vehicles whose vertical force no motion explains.
pub fn questions(dataset: &Dataset, vehicles: &BTreeMap<String, Vehicle>) -> Vec<Lift> {
    let of_vehicle = |(name, vehicle): (&String, &Vehicle)| {
        let samples = dataset.samples.iter().filter(|sample| sample.vehicle == *name);
        let mut found: Vec<Lift> = samples.filter_map(|sample| lift(vehicle, sample)).collect();
        found.sort_by(|a, b| (a.force / a.at_rest).total_cmp(&(b.force / b.at_rest)));
        let count = found.len();
        let mut median = (count > 0).then(|| found.swap_remove(count / 2))?;
        (median.samples, median.cause) = (count, cause(&median, dataset)?);
        Some(median)
    };
    vehicles.iter().filter_map(of_vehicle).collect()
}

fn lift(vehicle: &Vehicle, sample: &Sample) -> Option<Lift> {
    let condition = &sample.condition;
    let at_rest: Vec3 = vehicle.at_rest(condition).iter().map(|load| load.force).sum();
    let force: Vec3 = sample.surfaces.iter().map(|load| load.force).sum();
    let (at_rest, force) = (at_rest.dot(&condition.up), force.dot(&condition.up));
    (at_rest > LEAST_LIFT).then(|| Lift {
        vehicle: vehicle.name.clone(),
        force,
        at_rest,
        case: sample.case.clone(),
        samples: 1,
        cause: Cause::Unknown,
    })
}

fn cause(lift: &Lift, dataset: &Dataset) -> Option<Cause> {
    let ratio = lift.force / lift.at_rest;
    let inside = |[low, high]: [f64; 2]| (low..high).contains(&ratio);
    let near = |value: f64| (value / UNIT_FACTOR..value * UNIT_FACTOR).contains(&ratio);
    let sample = dataset.samples.iter().find(|sample| sample.case == lift.case)?;
    Some(match ratio {
        _ if inside(USUAL_RATIO) => return None,
        _ if inside(HALF_RATIO) => Cause::HalfDomain,
        _ if near(1.0 / sample.condition.density) => Cause::OverDensity,
        _ if near(1e3) || near(1e6) || near(1e-6) => Cause::Unit,
        _ if ratio < -USUAL_RATIO[0] => Cause::Axis,
        _ if ratio.abs() < HALF_RATIO[0] => Cause::NoHydrostaticPressure,
        _ => Cause::Unknown,
    })
}
