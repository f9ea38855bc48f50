//! Training, evaluation and campaigns from files to bundles and reports: what the commands of `wade` run, for any program.
//!
//! Reading order: `data` (what a training takes), `split_rule` (what is held out), `training`, `evaluation`, `campaign`. Nothing
//! here prints: a caller hears of [`Event`]s and gets values.

pub mod campaign;
mod data;
mod error;
mod evaluation;
mod split_rule;
mod training;

pub use error::WorkflowError;

pub use data::{DataSource, ModelKind, TrainingData};
pub use evaluation::Evaluation;
pub use split_rule::SplitRule;
pub use training::{TrainedModels, Training, Written};

use crate::train::fit::Epoch;

/// What a caller may want to show while a workflow runs.
#[derive(Debug, Clone, Copy)]
pub enum Event<'a> {
    /// A vehicle of the library is left out: there is no parameter table for it.
    NoTable {
        /// Its name.
        vehicle: &'a str,
    },
    /// A training begins.
    Begins {
        /// What is trained.
        model: &'a str,
        /// What is held out, in words.
        held_out: &'a str,
        /// Samples that it is trained on.
        samples: usize,
        /// Epochs at most.
        epochs: u32,
    },
    /// An epoch has ended.
    Epoch(&'a Epoch),
    /// The effects of a bundle went with the weights that they were fitted to.
    EffectsRemoved {
        /// The vehicle.
        vehicle: &'a str,
    },
}
