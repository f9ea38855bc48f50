//! What a training takes: a data set or loads by formula, the settings that suit it, and the bundles of its vehicles.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use wade_core::bundle::{Bundle, Library};
use wade_core::digest::sha256_of;
use wade_core::domain::Domain;

use super::{Event, WorkflowError};
use crate::dataset::{self, Dataset};
use crate::train::report::DataFile;
use crate::train::{self, Config, Source};

/// Where the loads come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DataSource {
    /// Loads by formula over the parameter tables of the settings, generated with their seed.
    Analytic,
    /// A data set on disk.
    File(PathBuf),
}

/// A kind of model that can be trained and served.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// Exact hydrostatics, a simple drag, and a trained dimensionless remainder.
    Anchored,
    /// The source paper's network as published.
    Paper,
}

/// A data set with all that a training needs besides.
#[derive(Debug)]
pub struct TrainingData {
    /// What it is.
    pub file: DataFile,
    /// The bundles of its vehicles, by name, without the weights in place.
    pub bundles: BTreeMap<String, Bundle>,
    /// Its samples.
    pub data: Dataset,
    /// Ranges that the states were drawn from, where that is known.
    pub domains: BTreeMap<String, Domain>,
}

impl DataSource {
    /// The settings that suit the data and the kind of model, and over them those of a file.
    ///
    /// # Errors
    ///
    /// Where the file cannot be read, is no TOML, or has a key that there is not.
    pub fn settings(&self, kind: ModelKind, file: Option<&Path>) -> Result<Config, WorkflowError> {
        let suited = match (kind, self) {
            (ModelKind::Anchored, _) => Config::anchored(),
            (ModelKind::Paper, Self::Analytic) => Config::analytic(),
            (ModelKind::Paper, Self::File(_)) => Config::default(),
        };
        let Some(path) = file else { return Ok(suited) };
        let text = std::fs::read_to_string(path).map_err(|error| WorkflowError::io(path, error))?;
        let parsed = |error| WorkflowError::Settings { path: path.to_owned(), source: Box::new(error) };
        // as a whole first: its errors know their lines
        let _: Config = toml::from_str(&text).map_err(parsed)?;
        let mut whole = toml::Table::try_from(&suited).expect("settings are a table");
        lay_over(&mut whole, toml::from_str(&text).map_err(parsed)?);
        whole.try_into().map_err(parsed)
    }

    /// Reads or generates the data set, and reads the bundles of its vehicles but for their weights.
    pub fn load(
        &self,
        config: &Config,
        library: &Library,
        hear: &dyn Fn(Event<'_>),
    ) -> Result<TrainingData, WorkflowError> {
        config.validate()?;
        match self {
            Self::Analytic => generate(config, library, hear),
            Self::File(path) => read(path, library),
        }
    }
}

fn generate(
    config: &Config,
    library: &Library,
    hear: &dyn Fn(Event<'_>),
) -> Result<TrainingData, WorkflowError> {
    let tables = &config.analytic.tables;
    let (known, unknown): (Vec<_>, Vec<_>) =
        library.names()?.into_iter().partition(|name| tables.contains_key(name));
    unknown.iter().for_each(|vehicle| hear(Event::NoTable { vehicle }));
    let bundles = bundles(library, known.iter())?;
    let vehicles = bundles.iter().map(|(name, bundle)| (name.clone(), bundle.vehicle.clone())).collect();
    let data = train::analytic::dataset(&vehicles, &config.analytic, config.seed)?;
    let provenance = data.meta.provenance.clone();
    let domains = known.iter().map(|name| (name.clone(), tables[name].domain())).collect();
    let file = DataFile { name: "analytic".to_owned(), sha256: None, provenance };
    Ok(TrainingData { file, bundles, data, domains })
}

fn read(path: &Path, library: &Library) -> Result<TrainingData, WorkflowError> {
    let data = dataset::read(path)?;
    let sha256 = Some(sha256_of(path).map_err(|error| WorkflowError::io(path, error))?);
    // its folder is of this machine alone
    let name = path.file_name().unwrap_or(path.as_os_str());
    let (name, provenance) = (name.to_string_lossy().into_owned(), data.meta.provenance.clone());
    let bundles = bundles(library, data.meta.vehicles.keys())?;
    let file = DataFile { name, sha256, provenance };
    Ok(TrainingData { file, bundles, data, domains: BTreeMap::new() })
}

fn bundles<'a>(
    library: &Library,
    names: impl Iterator<Item = &'a String>,
) -> Result<BTreeMap<String, Bundle>, WorkflowError> {
    names.map(|name| Ok((name.clone(), library.read_without_weights(name)?))).collect()
}

/// Lays what a table states over another, key by key.
fn lay_over(under: &mut toml::Table, over: toml::Table) {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(toml::Value::Table(under)), toml::Value::Table(over)) => lay_over(under, over),
            (_, value) => {
                under.insert(key, value);
            }
        }
    }
}

impl TrainingData {
    /// The samples with their mirror images.
    pub fn source(&self, config: &Config) -> Result<Source, WorkflowError> {
        let vehicles =
            self.bundles.iter().map(|(name, bundle)| (name.clone(), bundle.vehicle.clone())).collect();
        let source = Source::new(self.data.clone(), &vehicles, config.front_rear);
        source.map_err(|source| WorkflowError::Data { name: self.file.name.clone(), source })
    }
}
