//! Why an evaluation did not end.

use super::baseline::BaselineError;
use crate::train::TrainError;

/// Why there is no evaluation.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// Another file than the one that was learnt from.
    #[error(
        "{file} is not the data set that the weights were trained on, {learnt_from} (sha256 {sha256}): which of its cases they \
         have seen is not known. Give that data set, or train on this one"
    )]
    OtherData {
        /// The file.
        file: String,
        /// What was learnt from.
        learnt_from: String,
        /// Its SHA-256.
        sha256: String,
    },
    /// Weights that the report of the training does not know.
    #[error(
        "the weights of `{vehicle}` are not those of the training report: which cases they were trained on is not known. \
         Give the report of their training with --trained"
    )]
    OtherWeights {
        /// The vehicle.
        vehicle: String,
    },
    /// A case that the report of the training does not list.
    #[error("case `{case}` is neither a training case nor a held-out one of the training report")]
    UnknownCase {
        /// The case.
        case: String,
    },
    /// A report that lists a case on both sides of a split that keeps cases together.
    #[error("case `{case}` was trained on and is listed as held out: it cannot judge the model")]
    TrainingCase {
        /// The case.
        case: String,
    },
    /// A split by sample that does not come out as it was recorded.
    #[error("the split of the training report cannot be reproduced: another version of wade made it")]
    OtherSplit,
    /// Nothing to judge by.
    #[error("nothing is held out")]
    NothingHeldOut,
    /// A vehicle without a model.
    #[error("there is no model of vehicle `{vehicle}`")]
    NoModel {
        /// The vehicle.
        vehicle: String,
    },
    /// A data set that does not fit the vehicles, or a training that failed.
    #[error("{0}")]
    Train(#[from] TrainError),
    /// A simple model that cannot be fitted.
    #[error("{0}")]
    Baseline(#[from] BaselineError),
}
