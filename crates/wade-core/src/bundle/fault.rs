//! What can be wrong with a bundle.

use std::path::PathBuf;

use super::tensors::TensorError;
use super::{FORMAT, NETWORK_FILE, SUMS_FILE};
use crate::effects::EffectsFileError;
use crate::geometry::stl::StlError;
use crate::geometry::submergence::SamplesError;
use crate::vehicle::VehicleError;

/// What is wrong with a file of a bundle.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// Missing or unreadable.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Larger than any bundle's file is.
    #[error("{bytes} bytes, more than the {most} that are read of such a file")]
    TooLarge {
        /// Its size.
        bytes: u64,
        /// The most.
        most: u64,
    },
    /// A pipe, a socket, a device or a folder.
    #[error("is no regular file")]
    NotAFile,
    /// A link out of the bundle.
    #[error("is a link to {}, outside the bundle: copy the file in its place", .to.display())]
    LeadsOut {
        /// What it leads to.
        to: PathBuf,
    },
    /// Another process writes the bundle.
    #[error("{} is writing this bundle: wait for it to end", if .by.is_empty() { "another process" } else { .by.as_str() })]
    Locked {
        /// The process, as it said.
        by: String,
    },
    /// Written by a newer program.
    #[error("format {found} is newer than {FORMAT}, the newest that this program reads: update wade")]
    NewerFormat {
        /// The format of the file.
        found: u32,
    },
    /// Not TOML, or a key is missing, unknown or of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// The bundle's name is not its folder's.
    #[error("name = \"{name}\" differs from the folder's name")]
    Name {
        /// The name in the file.
        name: String,
    },
    /// A name that could not be part of a path or of a service's name.
    #[error("name = \"{name}\" must be 1 to 64 of a-z, 0-9, - and _")]
    NameSyntax {
        /// The name in the file.
        name: String,
    },
    /// A file that is no part of a bundle, in a folder that a bundle would replace.
    #[error("holds {name}, which is no part of a bundle: writing a bundle here would delete it")]
    ForeignFile {
        /// The file.
        name: String,
    },
    /// A line that is no checksum and file name.
    #[error("line {line} is not a checksum, two spaces and a file name")]
    ChecksumSyntax {
        /// Number of the line, from 1.
        line: usize,
    },
    /// A file of the bundle without a checksum.
    #[error("no checksum in {SUMS_FILE}")]
    NoChecksum,
    /// Bytes that are not those that were written.
    #[error("damaged: its SHA-256 is not the one in {SUMS_FILE}")]
    Checksum,
    /// A tensor file.
    #[error("{0}")]
    Tensor(#[from] TensorError),
    /// The hull.
    #[error("{0}")]
    Stl(#[from] StlError),
    /// The samples.
    #[error("{0}")]
    Samples(#[from] SamplesError),
    /// Values that make no vehicle.
    #[error("{0}")]
    Vehicle(#[from] VehicleError),
    /// A reference to a surface that does not exist.
    #[error("there is no surface called \"{name}\"")]
    UnknownSurface {
        /// The name.
        name: String,
    },
    /// A range whose ends are not finite and in order.
    #[error("domain.{quantity} is no range")]
    Domain {
        /// The quantity.
        quantity: &'static str,
    },
    /// The two places that state where the weights come from disagree.
    #[error("provenance \"{weights}\" in {NETWORK_FILE}, \"{vehicle}\" here")]
    Provenance {
        /// In the weights.
        weights: String,
        /// In the vehicle file.
        vehicle: String,
    },
    /// The vehicle file speaks of weights that are not there, or the other way round.
    #[error("provenance and domain are stated where there are weights, and only there")]
    Untrained,
    /// The effects.
    #[error(
        "{0}; write it again with wade gap --apply, or restore the previous version with wade vehicle rollback"
    )]
    Effects(#[from] EffectsFileError),
    /// A folder of kept versions that holds another.
    #[error("holds version {found}")]
    KeptVersion {
        /// The version in it.
        found: u32,
    },
    /// A version of the same number that is another.
    #[error("is another version {version} than the one that would be kept there: move it away")]
    KeptOther {
        /// The number of both.
        version: u32,
    },
    /// There is no number above that of a kept version.
    #[error("version {last} is the last that can be numbered: move it away")]
    NoVersion {
        /// The highest number there is.
        last: u32,
    },
    /// Nothing to go back to.
    #[error("{}", .asked.map_or_else(|| "no version before this one was kept".to_owned(), |version| format!("version {version} was not kept")))]
    NotKept {
        /// The version asked for.
        asked: Option<u32>,
    },
    /// Serving needs weights.
    #[error(
        "the bundle has neither weights nor radiation.safetensors, so nothing can be answered: build it again with `wade vehicle build`, which adds the latter, or train it"
    )]
    NoWeights,
    /// Weights that are a remainder of the physical base stand on nothing without it.
    #[error(
        "the weights are a remainder of the physical base, and radiation.safetensors is missing: restore it, or build the bundle again with `wade vehicle build` and train it"
    )]
    NoBase,
}
