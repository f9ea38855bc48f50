//! Why a training did not start or did not end well.

use super::checkpoint::CheckpointError;
use crate::dataset::label::OtherSurfaces;
use crate::dataset::mirror::MirrorError;
use crate::dataset::split::SplitError;

/// Why training did not start or did not end well.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// No vehicle with a parameter table.
    #[error("no vehicle was given for which there is a parameter table: state one under [analytic.tables]")]
    NoTable,
    /// A table with a range upside down or without a positive speed or density.
    #[error("the parameter table of `{vehicle}` has a range that is not one")]
    Table {
        /// Name of the vehicle.
        vehicle: String,
    },
    /// A number that makes no sense.
    #[error("`{key}` is {value}, which is not {expected}")]
    Config {
        /// Name of the key.
        key: &'static str,
        /// What it is.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// A vehicle of which the hull is not known.
    #[error("vehicle `{vehicle}` is in the data set, but there is no bundle of it")]
    UnknownVehicle {
        /// Its name.
        vehicle: String,
    },
    /// Surfaces of another version of the vehicle.
    #[error(transparent)]
    Surfaces(#[from] OtherSurfaces),
    /// A state that accelerates: what is learnt has no input for it.
    #[error(
        "case `{case}` accelerates by {acceleration:.2} m/s2, which is not an input of any network here: leave its set out with `wade dataset merge --set`"
    )]
    Unsteady {
        /// The case.
        case: String,
        /// Magnitude [m/s2].
        acceleration: f64,
    },
    /// Two kinds of bed for one vehicle: states that look the same to the network have different loads.
    #[error(
        "vehicle `{vehicle}`: the bed moves with the water in case `{moving}` and is at rest in `{resting}`, which is not an input of the paper's network: keep one of the sets with `wade dataset merge --set`, or train the anchored network"
    )]
    Beds {
        /// The vehicle.
        vehicle: String,
        /// A case of the one kind.
        moving: String,
        /// A case of the other.
        resting: String,
    },
    /// A vehicle off the bed, which is no input of the paper's network.
    #[error(
        "case `{case}` stands {clearance} m off the bed, which is not an input of the paper's network: keep other sets with `wade dataset merge --set`, or train the anchored network"
    )]
    OffTheBed {
        /// The case.
        case: String,
        /// Distance of the ground-contact plane from the bed [m].
        clearance: f64,
    },
    /// Cases that no regression can be fitted to.
    #[error(
        "vehicle `{vehicle}`: the covariance of its cases is not positive definite: their loads are not finite"
    )]
    Covariance {
        /// The vehicle.
        vehicle: String,
    },
    /// No mirror image.
    #[error("{0}")]
    Mirror(#[from] MirrorError),
    /// A side of the split without a sample.
    #[error("the {side} side of the split is empty")]
    EmptySide {
        /// Training, held-out or validation.
        side: &'static str,
    },
    /// A state on both sides of a split that promises to keep states together.
    #[error(
        "the split leaks: the states of {count} held-out cases are training states too, the first is `{first}`"
    )]
    Leak {
        /// How many.
        count: usize,
        /// One of them.
        first: String,
    },
    /// A training side of which no share can be taken for validation.
    #[error("validation_share of the training side: {0}")]
    Validation(#[from] SplitError),
    /// Nothing in a batch.
    #[error("a batch is empty")]
    EmptyBatch,
    /// Samples of two vehicles, which differ in the number of surfaces, in a batch.
    #[error("a batch mixes the vehicles {} and {}", .vehicles[0], .vehicles[1])]
    MixedBatch {
        /// Their indices.
        vehicles: [usize; 2],
    },
    /// The loss is no longer a number.
    #[error("the loss is not finite after epoch {epoch}")]
    Diverged {
        /// Number of the epoch.
        epoch: u32,
    },
    /// A checkpoint.
    #[error("{0}")]
    Checkpoint(#[from] CheckpointError),
}
