//! Two data sets as one, such as those of two vehicles that share a network, and the sets of a campaign apart.

use std::collections::{BTreeSet, HashSet};

use super::Dataset;
use wade_core::condition::GroundContact;

/// Why two data sets are not one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MergeError {
    /// Different conventions.
    #[error("one has ground contact {first:?}, the other {second:?}: keep the two apart")]
    GroundContact {
        /// Convention of the first.
        first: GroundContact,
        /// Convention of the second.
        second: GroundContact,
    },
    /// One vehicle with two lists of surfaces.
    #[error("vehicle `{vehicle}` has other surfaces in one than in the other")]
    Surfaces {
        /// The vehicle.
        vehicle: String,
    },
    /// One name for two cases.
    #[error("both have a case `{case}`")]
    Case {
        /// The case.
        case: String,
    },
    /// A set that is asked for and not there.
    #[error("there is no case of the set `{set}`: there are {}", .known.join(", "))]
    NoSet {
        /// Its name.
        set: String,
        /// The sets that there are.
        known: Vec<String>,
    },
}

impl Dataset {
    /// Adds the samples of another data set, and what its meta data say.
    pub fn merge(&mut self, other: Self) -> Result<(), MergeError> {
        let (first, second) = (self.meta.ground_contact, other.meta.ground_contact);
        if first != second {
            return Err(MergeError::GroundContact { first, second });
        }
        let known = &mut self.meta.vehicles;
        if let Some((vehicle, _)) =
            other.meta.vehicles.iter().find(|(v, s)| known.get(*v).is_some_and(|k| k != *s))
        {
            return Err(MergeError::Surfaces { vehicle: vehicle.clone() });
        }
        let cases: HashSet<&str> = self.samples.iter().map(|sample| sample.case.as_str()).collect();
        if let Some(sample) = other.samples.iter().find(|sample| cases.contains(sample.case.as_str())) {
            return Err(MergeError::Case { case: sample.case.clone() });
        }
        known.extend(other.meta.vehicles);
        join(&mut self.meta.provenance, other.meta.provenance);
        for (key, note) in other.meta.notes {
            match self.meta.notes.get_mut(&key) {
                Some(here) => join(here, note),
                None => _ = self.meta.notes.insert(key, note),
            }
        }
        self.samples.extend(other.samples);
        Ok(())
    }

    /// Keeps the cases of some sets alone.
    pub fn keep_sets(&mut self, sets: &[String]) -> Result<(), MergeError> {
        let known: BTreeSet<&String> = self.samples.iter().map(|sample| &sample.set).collect();
        if let Some(set) = sets.iter().find(|set| !known.contains(set)) {
            let known = known.into_iter().cloned().collect();
            return Err(MergeError::NoSet { set: set.clone(), known });
        }
        self.samples.retain(|sample| sets.contains(&sample.set));
        Ok(())
    }
}

fn join(here: &mut String, other: String) {
    if *here != other {
        here.push_str("; ");
        here.push_str(&other);
    }
}
