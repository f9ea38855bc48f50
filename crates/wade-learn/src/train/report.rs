//! The record of a training: settings, curves, errors, and which cases were held out. The latter travel with the weights
//! by their fingerprint, so that nobody judges them by what they learnt from.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::fit::Epoch;
use super::score::Score;
use super::{Config, Run, Trained, page};
use crate::dataset::split::By;
use crate::files::write_whole;
use crate::page::PlotError;
use wade_core::digest::hexadecimal;
use wade_core::model::network::Network;

/// The record for programs.
const RECORD: &str = "report.json";
/// The record for people.
const PAGE: &str = "index.html";

/// What was learnt from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataFile {
    /// The file, or "analytic" for loads by formula that were generated with the seed of the settings.
    pub name: String,
    /// Its SHA-256; none for generated loads.
    pub sha256: Option<String>,
    /// Where its loads come from.
    pub provenance: String,
}

impl DataFile {
    /// What weights learnt from it are labelled as.
    pub fn label(&self) -> String {
        match &self.sha256 {
            Some(sha256) => format!("{}, data sha256 {sha256}", self.provenance),
            None => self.provenance.clone(),
        }
    }
}

/// How the samples were dealt out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SplitRecord {
    /// What is held out, in words.
    pub name: String,
    /// True where cases may be on both sides: a split by sample.
    pub by_sample: bool,
    /// Training samples, mirror images included.
    pub training_samples: usize,
    /// Held-out samples.
    pub held_out_samples: usize,
    /// Cases that were learnt from.
    pub training_cases: BTreeSet<String>,
    /// Cases that were held out.
    pub held_out_cases: BTreeSet<String>,
}

/// Errors on held-out samples of a vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VehicleRecord {
    /// Its name.
    pub name: String,
    /// Errors of the net force [N].
    pub score: Score,
}

/// The record of a training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Version and commit of this program.
    pub program: String,
    /// What was learnt: "paper", or "anchored".
    pub variant: String,
    /// What it was learnt from.
    pub data: DataFile,
    /// How the samples were dealt out.
    pub split: SplitRecord,
    /// Number of the part that was held out, from 1, where a split has several.
    pub part: usize,
    /// The settings.
    pub config: Config,
    /// SHA-256 of the weights.
    pub weights_sha256: String,
    /// The epoch whose weights were kept.
    pub kept_epoch: u32,
    /// Seconds an epoch took [s].
    pub epoch_s: Option<f64>,
    /// By vehicle.
    pub vehicles: Vec<VehicleRecord>,
    /// Every epoch.
    pub history: Vec<Epoch>,
}

/// Why a record could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The disk refused, or there is none.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not a record.
    #[error("{}: not the report of a training: {source}", .path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
    /// A figure could not be drawn.
    #[error("a figure could not be drawn: {0}")]
    Plot(#[from] PlotError),
}

/// SHA-256 of the weights of a network, in the order of their tensors.
pub fn fingerprint(network: &Network) -> String {
    let mut hash = Sha256::new();
    for (_, _, values) in network.tensors() {
        values.iter().for_each(|x| hash.update(x.to_le_bytes()));
    }
    hexadecimal(&hash.finalize())
}

impl Record {
    /// What the errors on the held-out side are of.
    pub fn judged(&self) -> &'static str {
        if self.variant == super::anchored::NAME {
            "states, each the mean of its sections"
        } else {
            "sections"
        }
    }

    /// The record of a training.
    pub fn new<L>(trained: &Trained<L>, run: &Run<'_>, part: usize, data: DataFile, program: &str) -> Self {
        let Run { source, sides, config, .. } = *run;
        let cases = |numbers: &[usize]| -> BTreeSet<String> {
            numbers.iter().map(|&number| source.data.samples[number].case.clone()).collect()
        };
        let split = sides.split;
        let score = |v: &super::TrainedVehicle| VehicleRecord { name: v.name.clone(), score: v.score };
        Self {
            program: program.to_owned(),
            variant: trained.name.to_owned(),
            data,
            split: SplitRecord {
                name: split.name.clone(),
                by_sample: matches!(sides.by, By::Sample { .. }),
                training_samples: split.training.len(),
                held_out_samples: split.held_out.len(),
                training_cases: cases(&split.training),
                held_out_cases: cases(&split.held_out),
            },
            part,
            config: config.clone(),
            weights_sha256: fingerprint(&trained.layers.network()),
            kept_epoch: trained.kept_epoch,
            epoch_s: trained.epoch_s,
            vehicles: trained.vehicles.iter().map(score).collect(),
            history: trained.history.clone(),
        }
    }

    /// Writes both forms into a folder, each as a whole.
    pub fn write(&self, folder: &Path) -> Result<(), RecordError> {
        let json = |source| RecordError::Json { path: folder.join(RECORD), source };
        let record = serde_json::to_string_pretty(self).map_err(json)? + "\n";
        let page = page::page(self)?;
        for (name, text) in [(PAGE, page), (RECORD, record)] {
            let path = folder.join(name);
            fs::create_dir_all(folder)
                .and_then(|()| write_whole(&path, text.as_bytes()))
                .map_err(|source| RecordError::Io { path, source })?;
        }
        Ok(())
    }

    /// Where the record of a folder lies.
    pub fn path(folder: &Path) -> PathBuf {
        folder.join(RECORD)
    }

    /// Reads the record of a folder.
    pub fn read(folder: &Path) -> Result<Self, RecordError> {
        let path = Self::path(folder);
        let text =
            fs::read_to_string(&path).map_err(|source| RecordError::Io { path: path.clone(), source })?;
        serde_json::from_str(&text).map_err(|source| RecordError::Json { path, source })
    }
}
