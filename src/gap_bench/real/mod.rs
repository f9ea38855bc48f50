//! Published measurements as folders of trials, one source a file. The measurements are not part of this repository.
//!
//! What does not fit is left out: ten single states of a ship near banks (Lataire, Vantorre, Eloot, 2009) have neither a
//! simulation beside them nor a column for the bank.

pub mod falling_balls;
pub mod kvlcc2;
pub mod rm2_rotor;

use std::fs;
use std::path::{Path, PathBuf};

use crate::signal::FilterError;
use crate::trials::{MANIFEST_FILE, Manifest, TrialError, csv_text};

/// Why measurements could not be turned into trials.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A table of the source.
    #[error("{0}")]
    Table(#[from] TrialError),
    /// A file that cannot be read or written.
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

/// Columns of a trial with its name.
type Series = (String, Vec<(&'static str, Vec<f64>)>);

/// Writes a folder of trials; columns that a trial must have and that are not given are 0.
fn write(out: &Path, manifest: &Manifest, trials: &[Series]) -> Result<(), ImportError> {
    let io = |path: &Path| {
        let path = path.to_owned();
        move |error| ImportError::Io { path, error }
    };
    fs::create_dir_all(out).map_err(io(out))?;
    let path = out.join(MANIFEST_FILE);
    fs::write(&path, manifest.to_toml()).map_err(io(&path))?;
    for (name, columns) in trials {
        let rows = columns.first().map_or(0, |(_, values)| values.len());
        let still = vec![0.0; rows];
        let mut all: Vec<(&str, &[f64])> =
            columns.iter().map(|(name, values)| (*name, values.as_slice())).collect();
        for required in ["vx", "vy", "vz", "wx", "wy", "wz"] {
            if !all.iter().any(|(name, _)| *name == required) {
                all.push((required, &still));
            }
        }
        let path = out.join(format!("{name}.csv"));
        fs::write(&path, csv_text(&all)).map_err(io(&path))?;
    }
    Ok(())
}
