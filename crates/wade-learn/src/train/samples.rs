//! Features and targets of the samples of a data set, in physical units.

use std::collections::BTreeMap;

use super::TrainError;
use crate::dataset::label::{self, Label};
use crate::dataset::{self, Dataset};
use wade_core::features::{self, DYNAMIC, GLOBAL, STATIC};
use wade_core::model::network::OUTPUTS;
use wade_core::vehicle::Vehicle;

/// Features of one surface.
pub type SurfaceRow = [f32; STATIC + DYNAMIC];

/// One state of one vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Index of the vehicle, among those of the data set.
    pub vehicle: usize,
    /// Fluid density [kg/m3].
    pub density: f64,
    /// Global features, not standardised.
    pub global: [f64; GLOBAL],
    /// Features of each surface.
    pub surfaces: Vec<SurfaceRow>,
    /// Force over density on each surface [m4/s2].
    pub targets: Vec<[f64; OUTPUTS]>,
    /// Share of each surface under water.
    pub fractions: Vec<f32>,
}

impl Sample {
    /// The features of a state and the loads that belong to it.
    pub fn new(vehicle: &Vehicle, index: usize, sample: &dataset::Sample, labels: &[Label]) -> Self {
        let condition = &sample.condition;
        let plane = condition.water_plane(vehicle.z0);
        let direction = features::direction(&condition.velocity);
        let (mut surfaces, mut fractions) = (Vec::new(), Vec::new());
        for (surface, samples) in vehicle.surfaces.iter().zip(&vehicle.samples.surfaces) {
            let wet = samples.submergence(&plane);
            let fixed = features::surface_static(surface, &vehicle.dimensions);
            let moving = features::surface_dynamic(surface, &wet, &direction, &vehicle.dimensions);
            let mut row = fixed.into_iter().chain(moving).map(|x| x as f32);
            surfaces.push(std::array::from_fn(|_| row.next().unwrap_or(0.0)));
            fractions.push(wet.fraction as f32);
        }
        Self {
            vehicle: index,
            density: condition.density,
            global: features::global(condition, &vehicle.dimensions),
            surfaces,
            targets: labels.iter().map(|label| (label.force / condition.density).into()).collect(),
            fractions,
        }
    }

    /// True net force over density [m4/s2].
    pub fn net_force_over_density(&self) -> [f64; OUTPUTS] {
        sum(&self.targets)
    }
}

/// Sum over surfaces.
pub(super) fn sum(forces: &[[f64; OUTPUTS]]) -> [f64; OUTPUTS] {
    std::array::from_fn(|c| forces.iter().map(|force| force[c]).sum())
}

/// The samples of a data set of these numbers; vehicles are counted in the order of their names.
pub fn samples(
    data: &Dataset,
    numbers: &[usize],
    vehicles: &BTreeMap<String, Vehicle>,
) -> Result<Vec<Sample>, TrainError> {
    let mut known = BTreeMap::new();
    for (index, (name, surfaces)) in data.meta.vehicles.iter().enumerate() {
        let vehicle =
            vehicles.get(name).ok_or_else(|| TrainError::UnknownVehicle { vehicle: name.clone() })?;
        known.insert(name, (index, vehicle, label::order(vehicle, surfaces)?));
    }
    let of = |number: &usize| {
        let sample = &data.samples[*number];
        let (index, vehicle, order) = &known[&sample.vehicle];
        Sample::new(vehicle, *index, sample, &label::labels(vehicle, order, sample))
    };
    Ok(numbers.iter().map(of).collect())
}
