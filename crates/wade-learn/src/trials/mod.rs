//! Measured data: a folder with `trials.toml` and one CSV file a trial, checked on entry.
//!
//! Columns are SI by name, in any order; a column that no trial has is reported and ignored. After `read` the numbers
//! are finite, time increases, angles are radians and accelerations m/s2 without gravity, as far as that can be told.
//!
//! Reading order: `manifest` (`trials.toml`), `table` (a CSV file), `units` (limits, and columns that contradict each
//! other), `glitch` (samples that stand alone), `acceleration` (where none was measured), `trial`, `averaged` (means over
//! windows), `write`.

mod acceleration;
mod averaged;
mod fault;
mod glitch;
mod manifest;
mod table;
mod trial;
mod units;
mod write;

use acceleration::settle_convention;
pub use acceleration::{Recorded, acceleration, are_rates, derivative, turning};
pub use fault::Fault;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use wade_core::at::At;

pub use glitch::Glitch;
pub use manifest::{Body, MANIFEST_FILE, Manifest, Measured, Method, SimIs, component_of};
pub use table::{Table, csv_text};
pub use trial::{Gap, SIMULATED, StillWater, Trial, WHEELS, WRENCH, long_step};
pub use write::{Columns, write};

/// Why measured data was refused. The message names the file, and the row and column where there is one.
pub type TrialError = At<Fault>;

/// Something that does not stop anyone but that one should know.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Remark {
    /// A column that no trial has.
    #[error("{trial}: column {column} is not used")]
    UnknownColumn {
        /// The trial.
        trial: String,
        /// The column.
        column: String,
    },
    /// A hole in time.
    #[error("{trial}: a gap of {seconds:.3} s before row {row}")]
    Gap {
        /// The trial.
        trial: String,
        /// The row after the hole.
        row: u64,
        /// Its length [s].
        seconds: f64,
    },
    /// A measured sample that is far from those around it, alone.
    #[error(
        "{trial}: row {}, column {}: {} stands alone, {:.0} standard deviations from the samples around it, and is left out",
        .glitch.row, .glitch.column, .glitch.value, .glitch.ratio
    )]
    Glitch {
        /// The trial.
        trial: String,
        /// The sample.
        glitch: Glitch,
    },
    /// Accelerations that are rates of the components of the velocity.
    #[error(
        "ax, ay, az are the rates of vx, vy, vz: omega x v is added to them, for the acceleration in an inertial frame"
    )]
    Rates,
    /// Steps that look like another unit of time.
    #[error("{trial}: a step of {step} is long for seconds; is t in another unit?")]
    Clock {
        /// The trial.
        trial: String,
        /// The median step.
        step: f64,
    },
}

/// A folder of trials.
#[derive(Debug, Clone, PartialEq)]
pub struct Trials {
    /// What holds for all of them.
    pub manifest: Manifest,
    /// By file name.
    pub trials: Vec<Trial>,
    /// True where the recorded accelerations were rates of the velocity's components, and `omega x v` was added.
    pub accelerations_were_rates: bool,
}

impl Trials {
    /// Reads and checks a folder.
    pub fn read(directory: &Path) -> Result<Self, TrialError> {
        let path = directory.join(MANIFEST_FILE);
        let text = fs::read_to_string(&path).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound if directory.is_dir() => At::path(directory)(Fault::NoManifest),
            _ => At::path(&path)(error.into()),
        })?;
        let mut manifest: Manifest = toml::from_str(&text).map_err(|error| At::path(&path)(error.into()))?;
        manifest.without_extensions();
        let files = csv_files(directory).map_err(|error| At::path(directory)(error.into()))?;
        if files.is_empty() {
            return Err(At::path(directory)(Fault::NoTrial));
        }
        let mut names = BTreeSet::new();
        if let Some(name) = files.iter().map(|file| stem(file)).find(|name| !names.insert(name.clone())) {
            return Err(At::path(directory)(Fault::SameName { name }));
        }
        manifest.check(&files).map_err(At::path(&path))?;
        let mut trials: Vec<Trial> =
            files.iter().map(|file| Trial::read(file, &manifest)).collect::<Result<_, _>>()?;
        let nowhere = |name: &&String| !trials.iter().any(|trial| trial.known_loads.contains_key(*name));
        if let Some(name) = manifest.measured.known_loads.iter().find(nowhere) {
            let key = "measured.known_loads";
            return Err(At::path(&path)(Fault::UnknownColumn { key, name: name.clone() }));
        }
        trials.iter().try_for_each(|trial| trial.check_depth(&manifest)).map_err(At::path(&path))?;
        let accelerations_were_rates = settle_convention(&mut trials);
        Ok(Self { manifest, trials, accelerations_were_rates })
    }

    /// What one should know about the data.
    pub fn remarks(&self) -> Vec<Remark> {
        let rates = self.accelerations_were_rates.then_some(Remark::Rates);
        self.trials.iter().flat_map(Trial::remarks).chain(rates).collect()
    }
}

/// The CSV files of a folder by name.
fn csv_files(directory: &Path) -> std::io::Result<Vec<PathBuf>> {
    let paths = fs::read_dir(directory)?.map(|entry| Ok(entry?.path()));
    let mut paths = paths.collect::<std::io::Result<Vec<_>>>()?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")));
    paths.sort();
    Ok(paths)
}

/// Name of a trial: its file's without `.csv`.
fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}
