//! The states of a data set with the loads that belong to them.

use crate::dataset::label::{Label, labels, order};
use crate::dataset::{Image, flows};
use crate::train::samples::Sample;
use crate::train::{Source, TrainError};
use wade_core::condition::Condition;
use wade_core::frame::Vec3;
use wade_core::vehicle::Vehicle;

/// One state; body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the case.
    pub case: String,
    /// The set that it was planned in.
    pub set: String,
    /// Which image of it.
    pub image: Image,
    /// The state, in the ground-contact convention of the data set.
    pub condition: Condition,
    /// The load on each surface, with the vehicle's own hydrostatics, in its order.
    pub labels: Vec<Label>,
    /// Features and targets.
    pub features: Sample,
}

impl State {
    /// Net force [N].
    pub fn force(&self) -> Vec3 {
        self.labels.iter().map(|label| label.force).sum()
    }

    /// Net moment about a point [N m]; `None` where a load has none.
    pub fn moment(&self, about: &Vec3) -> Option<Vec3> {
        let about_origin: Option<Vec3> = self.labels.iter().map(|label| label.moment).sum();
        Some(about_origin? - about.cross(&self.force()))
    }

    /// Horizontal speed through the water [m/s].
    pub fn speed(&self) -> f64 {
        self.condition.velocity.x.hypot(self.condition.velocity.y)
    }

    /// Lateral share of the speed: 0 ahead or astern, 1 to a side; 0 at rest.
    pub fn obliqueness(&self) -> f64 {
        let speed = self.speed();
        if speed > 0.0 { self.condition.velocity.y.abs() / speed } else { 0.0 }
    }
}

/// Places of the sections of each flow among the states.
pub(super) fn sections(states: &[State]) -> Vec<Vec<usize>> {
    flows(states.iter().map(|state| (state.case.as_str(), state.image, &state.condition)))
}

/// The states of these numbers.
pub fn states(source: &Source, numbers: &[usize]) -> Result<Vec<State>, TrainError> {
    let mut known: Vec<(&String, &Vehicle, Vec<usize>)> = Vec::new();
    for (name, vehicle) in &source.vehicles {
        known.push((name, vehicle, order(vehicle, &source.data.meta.vehicles[name])?));
    }
    let state = |&number: &usize| {
        let sample = &source.data.samples[number];
        let (index, (name, vehicle, order)) = known
            .iter()
            .enumerate()
            .find(|(_, (name, ..))| **name == sample.vehicle)
            .ok_or_else(|| TrainError::UnknownVehicle { vehicle: sample.vehicle.clone() })?;
        let labels = labels(vehicle, order, sample);
        Ok(State {
            vehicle: (*name).clone(),
            case: sample.case.clone(),
            set: sample.set.clone(),
            image: sample.image,
            condition: sample.condition,
            features: Sample::new(vehicle, index, sample, &labels),
            labels,
        })
    };
    numbers.iter().map(state).collect()
}
