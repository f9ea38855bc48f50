//! Why a workflow did not end.

use std::io;
use std::path::{Path, PathBuf};

use wade_core::bundle::{BundleError, Fault, LibraryError};

use crate::dataset::DatasetError;
use crate::dataset::split::SplitError;
use crate::evaluate::EvaluateError;
use crate::train::TrainError;
use crate::train::report::RecordError;

/// Why a workflow did not end.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum WorkflowError {
    /// The disk refused.
    #[error("{}: {source}", .path.display())]
    Io { path: PathBuf, source: io::Error },
    /// Settings that are none.
    #[error("{}: {source}", .path.display())]
    Settings { path: PathBuf, source: Box<toml::de::Error> },
    /// A data set that cannot be split in this way.
    #[error("{name}: {source}")]
    Split { name: String, source: SplitError },
    /// A data set that cannot be trained on.
    #[error("{name}: {source}")]
    Data { name: String, source: TrainError },
    /// The split has no such part.
    #[error("part {part} of the split was asked for, and there are {parts}")]
    Part { part: usize, parts: usize },
    /// A file of a bundle would pass for one of a report.
    #[error("{} holds a vehicle bundle: name another folder for the report", .folder.display())]
    ReportInBundle { folder: PathBuf },
    /// A vehicle of the data set without a bundle.
    #[error("{vehicle}: there is no bundle of it")]
    NoBundle { vehicle: String },
    /// A bundle that was to be judged.
    #[error("{vehicle}: the bundle has no weights")]
    NoWeights { vehicle: String },
    /// A bundle that cannot answer.
    #[error("{vehicle}: {source}")]
    Serve { vehicle: String, source: Fault },
    /// The record that says what was held out.
    #[error("which states were held out is not known: {0}")]
    NotKnown(RecordError),
    #[error(transparent)]
    Train(#[from] TrainError),
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    #[error(transparent)]
    Library(#[from] LibraryError),
    #[error(transparent)]
    Bundle(#[from] BundleError),
    #[error(transparent)]
    Record(#[from] RecordError),
}

impl WorkflowError {
    pub(super) fn io(path: &Path, source: io::Error) -> Self {
        Self::Io { path: path.to_owned(), source }
    }
}
