//! Why published measurements could not be imported.

use std::path::PathBuf;

use wade_learn::signal::FilterError;
use wade_learn::trials::TrialError;

/// Why measurements could not be turned into trials.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A table of the source, or a trial that cannot be written.
    #[error("{0}")]
    Trials(#[from] TrialError),
    /// A file that cannot be read.
    #[error("{}: {error}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// A record that is shorter than its filter.
    #[error("{}: {error}", .path.display())]
    Filter {
        /// The file.
        path: PathBuf,
        /// Why.
        error: FilterError,
    },
    /// A body of which the table of masses says nothing.
    #[error("{}: no row with weight and circumference of \"{name}\"", .path.display())]
    UnknownBody {
        /// The table.
        path: PathBuf,
        /// The body.
        name: String,
    },
    /// A folder without any file of the source.
    #[error("{}: none of the files of this source is here ({expected})", .path.display())]
    Nothing {
        /// The folder.
        path: PathBuf,
        /// What was looked for.
        expected: &'static str,
    },
}
