//! Measured data: a folder with `trials.toml` and one CSV file a trial, checked on entry.
//!
//! Columns are SI by name, in any order; a column that no trial has is reported and ignored. After `read` the numbers
//! are finite, time increases, angles are radians and accelerations m/s2 without gravity, as far as that can be told.
//!
//! Reading order: `manifest` (`trials.toml`), `table` (a CSV file), `units` (limits, and columns that contradict each
//! other), `glitch` (samples that stand alone), `acceleration` (where none was measured), `trial`, `write`.

mod acceleration;
mod glitch;
mod manifest;
mod table;
mod trial;
mod units;
mod write;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

pub use glitch::Glitch;
pub use manifest::{Body, MANIFEST_FILE, Manifest, Measured, Method, SimIs, component_of};
pub use table::{Table, csv_text};
pub use trial::{Gap, SIMULATED, Trial, WHEELS, WRENCH};
pub use write::{Columns, write};

/// Why measured data was refused. The message names the file, and the row and column where there is one.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", .path.display())]
pub struct TrialError {
    /// The file or folder.
    pub path: PathBuf,
    /// What is wrong.
    pub fault: Fault,
}

/// What is wrong with a file of measured data. Rows are lines of the file, the header being row 1.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// Missing or unreadable.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Not TOML, or a key is missing, unknown or of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// Not CSV.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// A folder without a manifest.
    #[error("there is no {MANIFEST_FILE}: it names at least the vehicle (vehicle = \"warthog\")")]
    NoManifest,
    /// A folder without a trial.
    #[error("there is no trial: a trial is a CSV file beside {MANIFEST_FILE}")]
    NoTrial,
    /// Two files whose names differ in the case of their endings alone.
    #[error(
        "{name}.csv is there twice, its ending once in capitals: rename one, a trial is named after its file"
    )]
    SameName {
        /// The name of both.
        name: String,
    },
    /// A column that is needed.
    #[error("column {column} is missing; there are: {present}")]
    MissingColumn {
        /// The column.
        column: String,
        /// Those in the file.
        present: String,
    },
    /// Another vehicle than the folder's.
    #[error(
        "row {row}, column vehicle: \"{found}\" is not the vehicle of trials.toml, \"{expected}\": put the trials of each vehicle into a folder of their own"
    )]
    Vehicle {
        /// The row.
        row: u64,
        /// In the row.
        found: String,
        /// In the manifest.
        expected: String,
    },
    /// Two columns of one name.
    #[error(
        "column \"{column}\" is there twice, as number {first} and {second}: leave one out or name it otherwise"
    )]
    DuplicateColumn {
        /// The column.
        column: String,
        /// Its place, from 1.
        first: usize,
        /// The place of the other.
        second: usize,
    },
    /// A cell without a finite number.
    #[error(
        "row {row}, column {column}: \"{value}\" is no finite number: mend the value or leave the row out"
    )]
    NotANumber {
        /// The row.
        row: u64,
        /// The column.
        column: String,
        /// What stands there.
        value: String,
    },
    /// Time does not increase.
    #[error(
        "row {row}, column t: {t} s does not come after {before} s: sort the rows and leave repeated ones out"
    )]
    Time {
        /// The row.
        row: u64,
        /// Its time [s].
        t: f64,
        /// The time of the row before [s].
        before: f64,
    },
    /// Samples that stand alone, too many to leave them out.
    #[error(
        "{count} of {rows} rows stand alone among those around them, the first in row {}, column {} ({}): the recording is damaged; mend it, or take the column out of measured.columns",
        .first.row, .first.column, .first.value
    )]
    Glitches {
        /// How many.
        count: usize,
        /// Rows in the file.
        rows: usize,
        /// One of them.
        first: Glitch,
    },
    /// No header.
    #[error("the file is empty: its first line names the columns")]
    Empty,
    /// Too few rows.
    #[error("{rows} rows are too few, at least {least} are needed")]
    TooShort {
        /// Rows in the file.
        rows: usize,
        /// Rows needed.
        least: usize,
    },
    /// A value beyond what the quantity can be.
    #[error("row {row}, column {column}: {value} lies outside {min} to {max} {unit}: is it in another unit?")]
    Implausible {
        /// The row.
        row: u64,
        /// The column.
        column: String,
        /// The value.
        value: f64,
        /// Least plausible value.
        min: f64,
        /// Largest plausible value.
        max: f64,
        /// The unit of the column.
        unit: &'static str,
    },
    /// Angles that change as fast in degrees as the angular velocity says in radians.
    #[error(
        "row {row}, column {column}: {value} seems to be in degrees, since the column changes {ratio:.0} times as fast as {rate_column} says: convert it to radians"
    )]
    Degrees {
        /// The row of the largest value.
        row: u64,
        /// The angle.
        column: &'static str,
        /// The largest value.
        value: f64,
        /// The angular velocity.
        rate_column: &'static str,
        /// How many times as fast.
        ratio: f64,
    },
    /// An angular velocity in degrees per second.
    #[error(
        "row {row}, column {rate_column}: {value} seems to be in degrees a second, since it is {ratio:.0} times what {column} shows: convert it to rad/s"
    )]
    DegreesPerSecond {
        /// The row of the largest value.
        row: u64,
        /// The angle.
        column: &'static str,
        /// The largest value.
        value: f64,
        /// The angular velocity.
        rate_column: &'static str,
        /// How many times as large.
        ratio: f64,
    },
    /// An accelerometer in multiples of gravity.
    #[error(
        "row {row}, column {column}: {value} seems to be an accelerometer in g, since it is {ratio:.2} of what the velocity shows: multiply by 9.81"
    )]
    AccelerometerInG {
        /// The row of the largest value.
        row: u64,
        /// The column.
        column: &'static str,
        /// The largest value.
        value: f64,
        /// The column over the derivative of the velocity.
        ratio: f64,
    },
    /// An accelerometer that feels gravity.
    #[error(
        "row {row}, column {column}: its mean of {mean:.2} holds gravity{in_g}, while the velocity shows {from_velocity:.2} m/s2: take gravity off"
    )]
    Gravity {
        /// The first row.
        row: u64,
        /// The column with most of it.
        column: &'static str,
        /// Its mean.
        mean: f64,
        /// The mean derivative of the velocity [m/s2].
        from_velocity: f64,
        /// Says so where the unit is g.
        in_g: &'static str,
    },
    /// A name in the manifest that no file has.
    #[error("{key} names \"{name}\", but there is no {name}.csv")]
    UnknownTrial {
        /// The key of the manifest.
        key: &'static str,
        /// The name.
        name: String,
    },
    /// A name in the manifest that is no component of the wrench.
    #[error("{key} names \"{name}\", which is none of fx, fy, fz, mx, my, mz")]
    UnknownComponent {
        /// The key of the manifest.
        key: &'static str,
        /// The name.
        name: String,
    },
    /// A column of known forces whose name does not say on what it acts.
    #[error(
        "{key} names \"{name}\", which ends in none of _fx, _fy, _fz, _mx, _my, _mz: name it after the component it acts on"
    )]
    NoComponentInName {
        /// The key of the manifest.
        key: &'static str,
        /// The name.
        name: String,
    },
    /// Known loads of a cell where there is none.
    #[error(
        "measured.known_loads is what a load cell bears; with inverse_dynamics name the columns in other_forces"
    )]
    KnownLoadsInferred,
    /// No component at all.
    #[error(
        "measured.columns is empty: list the measured components, or leave the key out for those that a trial has"
    )]
    NoColumns,
    /// A trial that is listed twice among the repeats.
    #[error(
        "measured.repeats lists \"{name}\" twice: put all trials that repeat each other into one list, each once"
    )]
    RepeatTwice {
        /// The trial.
        name: String,
    },
    /// A dry twin that is itself a trial in water.
    #[error(
        "measured.dry_twins makes \"{dry}\" the dry twin of \"{wet}\" and a trial in water, too: name the run of the same command without water"
    )]
    WetTwin {
        /// The trial in water.
        wet: String,
        /// Its twin.
        dry: String,
    },
    /// A column that is promised and that no trial has.
    #[error("{key} names \"{name}\", which is a column of no trial")]
    UnknownColumn {
        /// The key of the manifest.
        key: &'static str,
        /// The name.
        name: String,
    },
    /// A number in the manifest that makes no sense.
    #[error("{key} = {value} must be {expected}")]
    Number {
        /// The key of the manifest.
        key: String,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
}

fn at(path: &Path) -> impl FnOnce(Fault) -> TrialError {
    let path = path.to_owned();
    move |fault| TrialError { path, fault }
}

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
}

impl Trials {
    /// Reads and checks a folder.
    pub fn read(directory: &Path) -> Result<Self, TrialError> {
        let path = directory.join(MANIFEST_FILE);
        let text = fs::read_to_string(&path).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound if directory.is_dir() => at(directory)(Fault::NoManifest),
            _ => at(&path)(error.into()),
        })?;
        let manifest: Manifest = toml::from_str(&text).map_err(|error| at(&path)(error.into()))?;
        let files = csv_files(directory).map_err(|error| at(directory)(error.into()))?;
        if files.is_empty() {
            return Err(at(directory)(Fault::NoTrial));
        }
        let mut names = BTreeSet::new();
        if let Some(name) = files.iter().map(|file| stem(file)).find(|name| !names.insert(name.clone())) {
            return Err(at(directory)(Fault::SameName { name }));
        }
        manifest.check(&files).map_err(at(&path))?;
        let trials: Vec<Trial> =
            files.iter().map(|file| Trial::read(file, &manifest)).collect::<Result<_, _>>()?;
        let nowhere = |name: &&String| !trials.iter().any(|trial| trial.known_loads.contains_key(*name));
        if let Some(name) = manifest.measured.known_loads.iter().find(nowhere) {
            let key = "measured.known_loads";
            return Err(at(&path)(Fault::UnknownColumn { key, name: name.clone() }));
        }
        Ok(Self { manifest, trials })
    }

    /// What one should know about the data.
    pub fn remarks(&self) -> Vec<Remark> {
        self.trials.iter().flat_map(Trial::remarks).collect()
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
