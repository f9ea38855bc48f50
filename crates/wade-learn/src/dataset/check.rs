//! What holds for every data set: checked when one is read and before one is written.

use std::collections::{HashMap, HashSet};

use super::schema::LOADS;
use super::{Dataset, Rest, Sample};
use wade_core::condition::GroundContact;

/// What is wrong with a data set, and where.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Flaw {
    /// No sample.
    #[error("there is no sample in it")]
    Empty,
    /// A vehicle of which the meta data does not list the surfaces.
    #[error("case `{case}` is of vehicle `{vehicle}`, which the meta data does not list")]
    UnknownVehicle {
        /// The case.
        case: String,
        /// The vehicle.
        vehicle: String,
    },
    /// One name for the runs of two vehicles.
    #[error("case `{case}` mixes vehicles: {} and {}", .vehicles[0], .vehicles[1])]
    MixedVehicles {
        /// The case.
        case: String,
        /// Both vehicles.
        vehicles: [String; 2],
    },
    /// One name in two sets.
    #[error("case `{case}` is in two sets: {} and {}", .sets[0], .sets[1])]
    MixedSets {
        /// The case.
        case: String,
        /// Both sets.
        sets: [String; 2],
    },
    /// Not one load a surface.
    #[error("case `{case}`, section {section}: {found} loads for {expected} surfaces")]
    SurfaceCount {
        /// The case.
        case: String,
        /// The section.
        section: u32,
        /// Loads that are there.
        found: usize,
        /// Surfaces of the vehicle.
        expected: usize,
    },
    /// The same section twice.
    #[error("case `{case}`, section {section}, image {image} is there twice")]
    Duplicate {
        /// The case.
        case: String,
        /// The section.
        section: u32,
        /// The image.
        image: super::Image,
    },
    /// A number that is not finite, or out of its range.
    #[error("case `{case}`, section {section}: {quantity} is {value}, which is not {expected}")]
    Number {
        /// The case.
        case: String,
        /// The section.
        section: u32,
        /// The quantity, with the surface where it belongs to one.
        quantity: String,
        /// What it is.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// A load that the file, which holds loads in single precision, cannot hold.
    #[error(
        "case `{case}`, section {section}, surface `{surface}`: {column} is {value:e}, beyond single precision; did the run diverge?"
    )]
    Single {
        /// The case.
        case: String,
        /// The section.
        section: u32,
        /// The surface.
        surface: String,
        /// The column.
        column: &'static str,
        /// What it would hold.
        value: f64,
    },
    /// A sample of the other convention.
    #[error("case `{case}` has ground contact {found:?}, the data set {expected:?}: keep the two apart")]
    GroundContact {
        /// The case.
        case: String,
        /// Its convention.
        found: GroundContact,
        /// That of the meta data.
        expected: GroundContact,
    },
}

impl Dataset {
    /// Checks all that the rest of the program relies on.
    pub fn check(&self) -> Result<(), Flaw> {
        if self.samples.is_empty() {
            return Err(Flaw::Empty);
        }
        let mut cases: HashMap<&str, &Sample> = HashMap::new();
        let mut seen = HashSet::new();
        for sample in &self.samples {
            let first = cases.entry(&sample.case).or_insert(sample);
            same_run(first, sample)?;
            if !seen.insert((&sample.case, sample.image, sample.section)) {
                let Sample { case, section, image, .. } = sample.clone();
                return Err(Flaw::Duplicate { case, section, image });
            }
            self.check_sample(sample)?;
        }
        Ok(())
    }

    fn check_sample(&self, sample: &Sample) -> Result<(), Flaw> {
        let (case, section) = (sample.case.clone(), sample.section);
        let Some(surfaces) = self.meta.vehicles.get(&sample.vehicle) else {
            return Err(Flaw::UnknownVehicle { case, vehicle: sample.vehicle.clone() });
        };
        let (found, expected) = (sample.surfaces.len(), surfaces.len());
        if found != expected {
            return Err(Flaw::SurfaceCount { case, section, found, expected });
        }
        let (found, expected) = (sample.condition.ground_contact, self.meta.ground_contact);
        if found != expected {
            return Err(Flaw::GroundContact { case, found, expected });
        }
        if let Some((quantity, value, expected)) = bad_number(sample, surfaces) {
            return Err(Flaw::Number { case, section, quantity, value, expected });
        }
        match too_large(sample, surfaces) {
            Some((surface, column, value)) => {
                Err(Flaw::Single { case, section, surface: surface.to_owned(), column, value })
            }
            None => Ok(()),
        }
    }
}

/// The first number that is not what it must be: which, its value, and what it must be.
fn bad_number(sample: &Sample, surfaces: &[String]) -> Option<(String, f64, &'static str)> {
    for (quantity, value, least, expected) in ranges(sample) {
        if !(value >= least && value.is_finite()) {
            return Some((quantity.to_owned(), value, expected));
        }
    }
    let c = &sample.condition;
    let vectors = [
        ("velocity", c.velocity),
        ("velocity over ground", c.ground_velocity),
        ("angular velocity", c.angular_velocity),
        ("acceleration", c.acceleration),
        ("angular acceleration", c.angular_acceleration),
    ];
    for (quantity, vector) in vectors {
        if let Some(&value) = vector.iter().find(|x| !x.is_finite()) {
            return Some((quantity.to_owned(), value, "finite"));
        }
    }
    let length = c.up.norm();
    // NaN is neither near nor far
    if (length - 1.0).abs() > 1e-6 || length.is_nan() {
        return Some(("length of the up vector".to_owned(), length, "1"));
    }
    sample.surfaces.iter().zip(surfaces).find_map(|(load, surface)| {
        let rest = load.rest.map(|Rest { force, moment }| [force, moment]).into_iter().flatten();
        let parts = [Some(load.force), load.moment, load.viscous].into_iter().flatten().chain(rest);
        let value = parts.flat_map(<[f64; 3]>::from).find(|x| !x.is_finite())?;
        Some((format!("a load on `{surface}`"), value, "finite"))
    })
}

/// The first load that is infinite in single precision: its surface, its column and its value.
fn too_large<'a>(sample: &Sample, surfaces: &'a [String]) -> Option<(&'a str, &'static str, f64)> {
    sample.surfaces.iter().zip(surfaces).find_map(|(load, surface)| {
        LOADS.iter().find_map(|column| {
            let vector = (column.of)(load)?;
            let axis = (0..3).find(|&axis| !(vector[axis] as f32).is_finite())?;
            Some((surface.as_str(), column.names[axis], vector[axis]))
        })
    })
}

fn same_run(first: &Sample, sample: &Sample) -> Result<(), Flaw> {
    let case = || sample.case.clone();
    if first.vehicle != sample.vehicle {
        let vehicles = [first.vehicle.clone(), sample.vehicle.clone()];
        return Err(Flaw::MixedVehicles { case: case(), vehicles });
    }
    if first.set != sample.set {
        return Err(Flaw::MixedSets { case: case(), sets: [first.set.clone(), sample.set.clone()] });
    }
    Ok(())
}

fn ranges(sample: &Sample) -> [(&'static str, f64, f64, &'static str); 5] {
    [
        ("start", sample.start_s, f64::MIN, "finite"),
        ("end", sample.end_s, sample.start_s, "at or after the start"),
        // below zero where a tilted hull is wet only lower down than its origin
        ("depth", sample.condition.depth, f64::MIN, "finite"),
        ("bed clearance", sample.condition.bed_clearance.unwrap_or(0.0), 0.0, "0 or more"),
        ("density", sample.condition.density, f64::MIN_POSITIVE, "positive"),
    ]
}
