//! The loads by formula as a data set to learn from.

use std::collections::BTreeMap;

use super::TrainError;
use super::config::Analytic;
use crate::dataset::{Dataset, Meta, analytic};
use crate::random::Random;
use wade_core::analytic::PROVENANCE;
use wade_core::condition::{Condition, GroundContact};
use wade_core::frame::Vec3;
use wade_core::vehicle::Vehicle;

/// Steady samples over the parameter table of each vehicle that has one; mirror images are left to augmentation.
///
/// A hull that is not symmetric front to rear has no such image of its cases: it gets as many cases astern, planned for
/// themselves, so that none of them is the twin of one ahead and a split by case leaks nothing.
pub fn dataset(
    vehicles: &BTreeMap<String, Vehicle>,
    settings: &Analytic,
    seed: u64,
) -> Result<Dataset, TrainError> {
    let mut random = Random::new(seed);
    let mut data = Dataset {
        meta: Meta {
            provenance: PROVENANCE.to_owned(),
            ground_contact: GroundContact::Wetted,
            vehicles: BTreeMap::new(),
            notes: BTreeMap::from([("seed".to_owned(), seed.to_string())]),
        },
        samples: Vec::new(),
    };
    for (name, vehicle) in vehicles {
        let Some(table) = settings.tables.get(name) else { continue };
        if !table.is_valid() {
            return Err(TrainError::Table { vehicle: name.clone() });
        }
        let mut random = random.fork();
        let mut states = table.latin_hypercube(settings.cases, &mut random);
        if !vehicle.symmetric_front_rear {
            states.extend(table.latin_hypercube(settings.cases, &mut random).iter().map(astern));
        }
        data.samples.extend(analytic::samples(vehicle, "paper", &states));
        let surfaces = vehicle.surfaces.iter().map(|surface| surface.name.clone()).collect();
        data.meta.vehicles.insert(name.clone(), surfaces);
    }
    if data.samples.is_empty() { Err(TrainError::NoTable) } else { Ok(data) }
}

fn astern(ahead: &Condition) -> Condition {
    let velocity = ahead.velocity.component_mul(&Vec3::new(-1.0, 1.0, 1.0));
    Condition { velocity, ground_velocity: velocity, ..*ahead }
}
