//! Several models on the same held-out states: the one that is served, the simple ones, and the ablations. Parts of a
//! split that are held out in turn are pooled.

use std::collections::BTreeMap;

use super::EvaluateError;
use super::baseline::{self, Baseline};
use super::predict::{Prediction, by_trainer, served};
use super::states::{State, states};
use crate::dataset::split::Split;
use crate::train::{Published, Source, Trained};
use wade_core::model::Model;

/// What one model says of every held-out state of a vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The model.
    pub name: String,
    /// One prediction a state.
    pub predictions: Vec<Prediction>,
}

/// The held-out states of one vehicle and what is said of them; the first entry is the model under evaluation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Heat {
    /// The states.
    pub states: Vec<State>,
    /// The models.
    pub entries: Vec<Entry>,
}

/// Heats by vehicle.
pub type Contest = BTreeMap<String, Heat>;

/// Models to judge beside the simple ones, which are fitted here.
#[derive(Debug)]
pub struct Contestants<'a> {
    /// The models of each vehicle, as they are served; the first of each is the one under evaluation.
    pub models: &'a BTreeMap<String, Vec<Model>>,
    /// Networks that cannot be served.
    pub ablations: &'a [Trained<Published>],
}

/// Adds the held-out side of a split to a contest.
pub fn enter(
    contest: &mut Contest,
    source: &Source,
    split: &Split,
    contestants: &Contestants<'_>,
) -> Result<(), EvaluateError> {
    let (training, held_out) = (states(source, &split.training)?, states(source, &split.held_out)?);
    for (name, vehicle) in &source.vehicles {
        let held_out: Vec<&State> = held_out.iter().filter(|state| state.vehicle == *name).collect();
        if held_out.is_empty() {
            continue;
        }
        let no_model = || EvaluateError::NoModel { vehicle: name.clone() };
        let models = contestants.models.get(name).ok_or_else(no_model)?;
        let name_of = |model: &Model| {
            model.weights().map_or(model.provenance(), |weights| weights.form.name()).to_owned()
        };
        let mut entries: Vec<_> =
            models.iter().map(|model| (name_of(model), served(model, &held_out))).collect();
        entries.push((baseline::KNOWN.to_owned(), baseline::known(vehicle, &held_out)));
        let learnt: Vec<&State> = training.iter().filter(|state| state.vehicle == *name).collect();
        // a vehicle that is held out as a whole leaves nothing to fit its simple models to
        if !learnt.is_empty() {
            for baseline in Baseline::fit(vehicle, &learnt)? {
                entries.push((baseline.name().to_owned(), baseline.predict(vehicle, &held_out)));
            }
        }
        for ablation in contestants.ablations {
            entries.push((ablation.name.to_owned(), by_trainer(ablation, &held_out)));
        }
        let heat = contest.entry(name.clone()).or_default();
        heat.states.extend(held_out.into_iter().cloned());
        for (name, predictions) in entries {
            match heat.entries.iter_mut().find(|entry| entry.name == name) {
                Some(entry) => entry.predictions.extend(predictions),
                None => heat.entries.push(Entry { name, predictions }),
            }
        }
    }
    if contest.is_empty() { Err(EvaluateError::NothingHeldOut) } else { Ok(()) }
}
