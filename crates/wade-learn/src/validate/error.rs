//! Why a validation did not end.

use super::planar::NotPlanar;

/// Why there is no verdict.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ValidateError {
    /// Trials of another vehicle.
    #[error("the trials are of vehicle \"{trials}\", not \"{asked}\": give --vehicle {trials}")]
    Vehicle {
        /// In the trials.
        trials: String,
        /// Asked for.
        asked: String,
    },
    /// No flat piece in any trial.
    #[error(
        "none of {trials} trials has a planar section ({trial}: {why}); the limits are in [planar] of the settings"
    )]
    NoSection {
        /// Number of trials.
        trials: usize,
        /// The first.
        trial: String,
        /// Why it has none.
        why: NotPlanar,
    },
    /// Too few points at every depth.
    #[error(
        "{sections} planar sections over {depths} depths: no depth has the {least} that a fit needs; record more trials at one depth"
    )]
    TooFewSections {
        /// Sections found.
        sections: usize,
        /// Depths among them.
        depths: usize,
        /// Sections that one depth needs.
        least: usize,
    },
    /// A force that is no number.
    #[error("{trial}, row {row}: the predicted force is not finite")]
    NotFinite {
        /// Name of the trial.
        trial: String,
        /// Line of its file.
        row: u64,
    },
    /// A setting that makes no sense.
    #[error("{key} = {value} must be {expected}")]
    Config {
        /// The key.
        key: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
}
