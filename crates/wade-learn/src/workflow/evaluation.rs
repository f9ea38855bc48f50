//! Models on states that their training held out: those of the bundles, or trained for each part of a split in turn.

use std::collections::BTreeMap;
use std::path::Path;

use wade_core::bundle::{Bundle, Library};
use wade_core::model::Model;
use wade_core::model::kernel::Isa;

use super::training::{Origin, begins, with_weights};
use super::{DataSource, Event, ModelKind, SplitRule, TrainingData, WorkflowError};
use crate::evaluate::contest::{Contest, Contestants, enter};
use crate::evaluate::held_out;
use crate::evaluate::report::{About, Report};
use crate::train::report::Record;
use crate::train::{self, Config, Published, Run, Sides, Trained, Variant};

/// What is judged, and by what.
#[derive(Debug, Clone, Copy)]
pub struct Evaluation<'a> {
    /// The data set.
    pub data: &'a DataSource,
    /// Settings of the trainings, TOML.
    pub settings: Option<&'a Path>,
    /// Whether the paper's three ablations are trained on the same split.
    pub ablations: bool,
    /// Name, version and commit of the program, for the report.
    pub program: &'a str,
}

/// What was trained for one part of a split.
#[derive(Debug, Default)]
struct OfKinds {
    /// Models of each vehicle, in the order of the kinds.
    models: BTreeMap<String, Vec<Model>>,
    /// Settings of each kind, by its name.
    settings: BTreeMap<String, Config>,
}

impl Evaluation<'_> {
    /// Judges the weights of the bundles by the states that their training held out, which the record in `trained` names.
    pub fn of_bundles(
        &self,
        trained: &Path,
        library: &Library,
        hear: &dyn Fn(Event<'_>),
    ) -> Result<Report, WorkflowError> {
        let record = Record::read(trained).map_err(WorkflowError::NotKnown)?;
        let loaded = self.data.load(&record.config, library, hear)?;
        let source = loaded.source(&record.config)?;
        let split = held_out::of(&record, &loaded.file, &source)?;
        let mut models = BTreeMap::new();
        for name in loaded.bundles.keys() {
            let bundle = library.read(name)?;
            let no_weights = || WorkflowError::NoWeights { vehicle: name.clone() };
            let (weights, _) = bundle.trained.as_ref().ok_or_else(no_weights)?;
            held_out::check_weights(&record, name, weights)?;
            models.insert(name.clone(), vec![model(bundle)?]);
        }
        let rule = if record.split.by_sample { SplitRule::Sample } else { SplitRule::Case };
        let by = rule.by(record.config.held_out_share, record.config.parts);
        let of_paper = match record.variant == train::anchored::NAME {
            true => {
                let Config { seed, front_rear, held_out_share, parts, .. } = record.config.clone();
                let suited = self.data.settings(ModelKind::Paper, None)?;
                Config { seed, front_rear, held_out_share, parts, ..suited }
            }
            false => record.config.clone(),
        };
        let mut contest = Contest::new();
        let sides = Sides { split: &split, by };
        let run = Run { source: &source, sides, config: &of_paper, checkpoint: None };
        self.enter(&mut contest, run, &models, hear)?;
        let mut settings = self.ablation_settings(&of_paper);
        settings.insert(record.variant.clone(), record.config);
        let about = About {
            data: loaded.file,
            splits: vec![split.name.clone()],
            by_sample: record.split.by_sample,
            settings,
            history: record.history,
        };
        Ok(Report::new(&contest, &source.vehicles, about, self.program)?)
    }

    /// One training of each kind a part; the held-out states of all parts are pooled. The first kind is the one under evaluation.
    pub fn by_split(
        &self,
        rule: SplitRule,
        kinds: &[ModelKind],
        library: &Library,
        hear: &dyn Fn(Event<'_>),
    ) -> Result<Report, WorkflowError> {
        let first = kinds.first().copied().unwrap_or(ModelKind::Anchored);
        let config = self.data.settings(first, self.settings)?;
        let of_paper = self.data.settings(ModelKind::Paper, self.settings)?;
        let mut settings = self.ablation_settings(&of_paper);
        let loaded = self.data.load(&config, library, hear)?;
        let source = loaded.source(&config)?;
        let by = rule.by(config.held_out_share, config.parts);
        let splits = loaded.splits(&source, by, &config)?;
        let mut contest = Contest::new();
        for split in &splits {
            let sides = Sides { split, by };
            let run = Run { source: &source, sides, config: &of_paper, checkpoint: None };
            let OfKinds { models, settings: of_kinds } = self.train_kinds(&loaded, run, kinds, hear)?;
            settings.extend(of_kinds);
            self.enter(&mut contest, run, &models, hear)?;
        }
        let splits = splits.iter().map(|split| split.name.clone()).collect();
        let by_sample = rule == SplitRule::Sample;
        let about = About { data: loaded.file, splits, by_sample, settings, history: Vec::new() };
        Ok(Report::new(&contest, &source.vehicles, about, self.program)?)
    }

    /// Trains a model of each kind for each vehicle.
    fn train_kinds(
        &self,
        loaded: &TrainingData,
        run: Run<'_>,
        kinds: &[ModelKind],
        hear: &dyn Fn(Event<'_>),
    ) -> Result<OfKinds, WorkflowError> {
        let OfKinds { mut models, mut settings } = OfKinds::default();
        let origin = Origin { part: 1, program: self.program };
        for kind in kinds {
            let config = self.data.settings(*kind, self.settings)?;
            let trained = kind.train(loaded, Run { config: &config, ..run }, origin, hear)?;
            settings.insert(trained.record.variant, trained.record.config);
            for (name, weights) in trained.weights {
                let bundle = with_weights(&loaded.bundles[&name], weights);
                models.entry(name).or_default().push(model(bundle)?);
            }
        }
        Ok(OfKinds { models, settings })
    }

    /// Settings of the ablations, by their names.
    fn ablation_settings(&self, of_paper: &Config) -> BTreeMap<String, Config> {
        let ablations = Variant::ABLATIONS.iter().filter(|_| self.ablations);
        ablations.map(|variant| (variant.name().to_owned(), of_paper.clone())).collect()
    }

    /// Adds models and, where they are asked for, ablations with the settings of the run to the comparison.
    fn enter(
        &self,
        contest: &mut Contest,
        run: Run<'_>,
        models: &BTreeMap<String, Vec<Model>>,
        hear: &dyn Fn(Event<'_>),
    ) -> Result<(), WorkflowError> {
        let ablations = Variant::ABLATIONS.into_iter().filter(|_| self.ablations);
        let ablations =
            ablations.map(|variant| ablation(variant, run, hear)).collect::<Result<Vec<_>, _>>()?;
        let contestants = Contestants { models, ablations: &ablations };
        Ok(enter(contest, run.source, run.sides.split, &contestants)?)
    }
}

/// A bundle as it is served.
fn model(bundle: Bundle) -> Result<Model, WorkflowError> {
    let vehicle = bundle.vehicle.name.clone();
    bundle.into_model(Isa::available()[0]).map_err(|source| WorkflowError::Serve { vehicle, source })
}

fn ablation(
    variant: Variant,
    run: Run<'_>,
    hear: &dyn Fn(Event<'_>),
) -> Result<Trained<Published>, WorkflowError> {
    hear(begins(variant.name(), &run));
    let epoch = |epoch: &_| hear(Event::Epoch(epoch));
    Ok(train::train(run, variant, &epoch)?)
}
