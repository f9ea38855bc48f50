//! From a data set to the next version of each bundle, and the record of the training.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use wade_core::bundle::{self, Bundle, Library};
use wade_core::domain::Domain;
use wade_core::model::Weights;
use wade_core::physics::radiation::Radiation;

use super::{DataSource, Event, ModelKind, SplitRule, TrainingData, WorkflowError};
use crate::dataset::split;
use crate::files::StagedFile;
use crate::train::checkpoint::Checkpoint;
use crate::train::fit::Epoch;
use crate::train::report::Record;
use crate::train::{self, Config, Run, Sides, Source, Trained, TrainedVehicle, Variant, anchored};

/// One training that ends in bundles.
#[derive(Debug)]
pub struct Training<'a> {
    /// What it is trained on.
    pub data: &'a DataSource,
    /// What is trained.
    pub kind: ModelKind,
    /// The settings.
    pub config: &'a Config,
    /// What is held out.
    pub split: SplitRule,
    /// Which part is held out, from 1, where a split has several.
    pub part: usize,
    /// Folder for the record and its page.
    pub out: &'a Path,
    /// Where the state of the training is kept.
    pub checkpoint: Option<Checkpoint>,
    /// Name, version and commit of the program, for the record.
    pub program: &'a str,
}

/// What a training left on disk.
#[derive(Debug)]
pub struct Written {
    /// The record.
    pub record: Record,
    /// Place and version of the bundle of each vehicle, in the order of the record.
    pub bundles: Vec<(PathBuf, u32)>,
}

/// What a training comes to: weights for each vehicle, and its record.
#[derive(Debug)]
pub struct TrainedModels {
    /// Weights and domain by vehicle.
    pub weights: BTreeMap<String, (Weights, Domain)>,
    /// The record.
    pub record: Record,
}

/// What the record of a training says besides: which part was held out, from 1, and which program trained.
#[derive(Debug, Clone, Copy)]
pub(super) struct Origin<'a> {
    pub part: usize,
    pub program: &'a str,
}

impl Training<'_> {
    /// Trains, and writes the next version of each bundle and then the record.
    ///
    /// # Errors
    ///
    /// Before anything is computed: a data set, bundle, folder or part that will not do. A data set without a sample on a side,
    /// a loss that is not finite, a disk that is full.
    pub fn run(self, library: &Library, hear: &dyn Fn(Event<'_>)) -> Result<Written, WorkflowError> {
        let Self { data, kind, config, split: rule, part, out, checkpoint, program } = self;
        let loaded = data.load(config, library, hear)?;
        let source = loaded.source(config)?;
        let by = rule.by(config.held_out_share, config.parts);
        let splits = loaded.splits(&source, by, config)?;
        let no_such_part = || WorkflowError::Part { part, parts: splits.len() };
        let split = part.checked_sub(1).and_then(|index| splits.get(index)).ok_or_else(no_such_part)?;
        check_places(out, &loaded, library, checkpoint.as_ref())?;
        let sides = Sides { split, by };
        let run = Run { source: &source, sides, config, checkpoint: checkpoint.as_ref() };
        let trained = kind.train(&loaded, run, Origin { part, program }, hear)?;
        let next = loaded.next(&trained, hear)?;
        let bundles = library.succeed_together(next)?;
        // after the bundles: who finds it finds the weights that it is about
        trained.record.write(out)?;
        if let Some(checkpoint) = &checkpoint {
            checkpoint.remove().map_err(|error| WorkflowError::io(&checkpoint.path, error))?;
        }
        Ok(Written { record: trained.record, bundles })
    }
}

/// A bundle with other weights. Anchored ones stand on the physical base, which bundles of version 0.1 lack.
pub(super) fn with_weights(bundle: &Bundle, trained: (Weights, Domain)) -> Bundle {
    let estimate = || Radiation::estimate(&bundle.vehicle);
    let radiation = Some(bundle.radiation.clone().unwrap_or_else(estimate));
    Bundle { trained: Some(trained), effects: None, radiation, ..bundle.clone() }
}

/// A long training is not to end in a place that cannot be written.
fn check_places(
    out: &Path,
    loaded: &TrainingData,
    library: &Library,
    checkpoint: Option<&Checkpoint>,
) -> Result<(), WorkflowError> {
    if out.join(bundle::VEHICLE_FILE).exists() {
        return Err(WorkflowError::ReportInBundle { folder: out.to_owned() });
    }
    std::fs::create_dir_all(out).map_err(|error| WorkflowError::io(out, error))?;
    let names: Vec<&str> = loaded.bundles.keys().map(String::as_str).collect();
    for (place, name) in library.targets(&names)?.iter().zip(names) {
        bundle::check_place(place, name)?;
    }
    if let Some(Checkpoint { path, .. }) = checkpoint {
        StagedFile::new(path).map_err(|error| WorkflowError::io(path, error))?;
    }
    Ok(())
}

impl ModelKind {
    /// The name by which events and pages call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Anchored => anchored::NAME,
            Self::Paper => Variant::Paper.name(),
        }
    }

    pub(super) fn train(
        self,
        loaded: &TrainingData,
        run: Run<'_>,
        origin: Origin<'_>,
        hear: &dyn Fn(Event<'_>),
    ) -> Result<TrainedModels, WorkflowError> {
        hear(begins(self.name(), &run));
        let epoch = |epoch: &Epoch| hear(Event::Epoch(epoch));
        let label = loaded.file.label();
        Ok(match self {
            Self::Paper => {
                let trained = train::train(run, Variant::Paper, &epoch)?;
                let contact = loaded.data.meta.ground_contact;
                let weights = |of_vehicle: &_| trained.weights(of_vehicle, contact, label.clone());
                loaded.models(&trained, weights, &run, origin)
            }
            Self::Anchored => {
                let trained = anchored::train(run, &epoch)?;
                let weights = |of_vehicle: &_| trained.weights(of_vehicle, label.clone());
                loaded.models(&trained, weights, &run, origin)
            }
        })
    }
}

pub(super) fn begins<'e>(model: &'e str, run: &Run<'e>) -> Event<'e> {
    let (split, epochs) = (run.sides.split, run.config.epochs);
    Event::Begins { model, held_out: &split.name, samples: split.training.len(), epochs }
}

impl TrainingData {
    pub(super) fn splits(
        &self,
        source: &Source,
        by: split::By,
        config: &Config,
    ) -> Result<Vec<split::Split>, WorkflowError> {
        let failed = |source| WorkflowError::Split { name: self.file.name.clone(), source };
        split::split(&source.data, by, config.seed).map_err(failed)
    }

    /// Weights of each vehicle with the ranges that their states were drawn from, and the record.
    fn models<L>(
        &self,
        trained: &Trained<L>,
        weights: impl Fn(&TrainedVehicle) -> Weights,
        run: &Run<'_>,
        origin: Origin<'_>,
    ) -> TrainedModels {
        let of = |of_vehicle: &TrainedVehicle| {
            let domain = self.domains.get(&of_vehicle.name).copied().unwrap_or(of_vehicle.domain);
            (of_vehicle.name.clone(), (weights(of_vehicle), domain))
        };
        TrainedModels {
            weights: trained.vehicles.iter().map(of).collect(),
            record: Record::new(trained, run, origin.part, self.file.clone(), origin.program),
        }
    }

    /// The next version of each bundle: effects close the gap of the weights that they were fitted to, and go with these.
    fn next(&self, trained: &TrainedModels, hear: &dyn Fn(Event<'_>)) -> Result<Vec<Bundle>, WorkflowError> {
        let of = |vehicle: &String| {
            let (Some(bundle), Some(weights)) = (self.bundles.get(vehicle), trained.weights.get(vehicle))
            else {
                return Err(WorkflowError::NoBundle { vehicle: vehicle.clone() });
            };
            if bundle.effects.is_some() {
                hear(Event::EffectsRemoved { vehicle });
            }
            Ok(with_weights(bundle, weights.clone()))
        };
        trained.record.vehicles.iter().map(|of_vehicle| of(&of_vehicle.name)).collect()
    }
}
