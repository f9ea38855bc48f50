//! Motion-capture recordings: a folder with `recordings.toml` and one CSV file a recording.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, UnitQuaternion};
use serde::{Deserialize, Serialize};

use super::reading::{Misreading, direction, explanation};
use crate::signal::FilterError;
use crate::trials::{Table, TrialError, csv_text};
use wade_core::at::At;
use wade_core::condition::FRESH_WATER;
use wade_core::frame::Vec3;

/// Name of the file that describes the recordings.
pub const RECORDINGS_FILE: &str = "recordings.toml";

const COLUMNS: [&str; 8] = ["t", "x", "y", "z", "qw", "qx", "qy", "qz"];

/// No position of a recording lies further from the origin [m].
const FARTHEST: f64 = 1000.0;
/// How far from 1 the length of a quaternion may be: what a few decimals lose, and no more.
const LENGTH_TOLERANCE: f64 = 0.02;

/// `recordings.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingsFile {
    /// Name of the vehicle.
    pub vehicle: String,
    /// How the recordings were generated, where they were not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub generated: Option<String>,
    /// Density of the water [kg/m3].
    #[serde(default = "fresh_water")]
    pub fluid_density_kgpm3: f64,
    /// From the marker origin to the center of mass, vehicle frame [m]; the paper's is (0.2, 0, -0.63).
    pub center_of_mass_from_marker_m: [f64; 3],
    /// The recordings, by file name without `.csv`.
    pub recording: BTreeMap<String, RecordingEntry>,
}

/// One recording.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingEntry {
    /// Altitude of the still water in the frame of the cameras [m].
    pub water_level_m: f64,
    /// Water depth over the flat ground, measured at rest [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_m: Option<f64>,
}

fn fresh_water() -> f64 {
    FRESH_WATER
}

/// One recording: pose of the marker frame, whose axes are the vehicle's, in the frame of the cameras, z up.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Time [s], increasing.
    pub t: Vec<f64>,
    /// Marker origin [m].
    pub position: Vec<Vec3>,
    /// Rotation `world_from_body`.
    pub rotation: Vec<UnitQuaternion<f64>>,
}

/// A folder of recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Recordings {
    /// The folder.
    pub directory: PathBuf,
    /// What describes them.
    pub file: RecordingsFile,
    /// By name, one for each entry of the file.
    pub recordings: BTreeMap<String, Recording>,
}

/// Why a folder of recordings was refused. The message names the file.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The recording is no table of numbers by time.
    #[error(transparent)]
    Table(#[from] TrialError),
    /// Anything else, with the file.
    #[error(transparent)]
    File(#[from] At<RecordingFault>),
}

/// What is wrong with a recording or its description.
#[derive(Debug, thiserror::Error)]
pub enum RecordingFault {
    /// Missing or unreadable.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Not TOML, or a key is missing, unknown or of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// A folder without a description.
    #[error("there is no {RECORDINGS_FILE}, which states vehicle, marker and water level")]
    NoDescription,
    /// A description of nothing.
    #[error("it lists no recording: add [recording.NAME] with water_level_m for each NAME.csv")]
    NoRecording,
    /// A recording without a water level.
    #[error("{RECORDINGS_FILE} has no [recording.{name}] with its water_level_m")]
    Unlisted {
        /// Name of the recording.
        name: String,
    },
    /// A number that makes no sense.
    #[error("{key} = {value} must be {expected}")]
    Number {
        /// The key.
        key: String,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// Another vehicle.
    #[error("the recordings are of vehicle \"{recordings}\", not \"{asked}\": give --vehicle {recordings}")]
    Vehicle {
        /// In the description.
        recordings: String,
        /// Asked for.
        asked: String,
    },
    /// A place that no camera sees.
    #[error("row {row}, column {column}: {value} m is farther than {FARTHEST} m: is it in another unit?")]
    Position {
        /// The row.
        row: u64,
        /// The column.
        column: &'static str,
        /// The value [m].
        value: f64,
    },
    /// A quaternion that is no rotation.
    #[error(
        "row {row}, columns qw qx qy qz: the quaternion has length {length:.4} instead of 1; leave rows without a solved pose out"
    )]
    Quaternion {
        /// The row.
        row: u64,
        /// Its length.
        length: f64,
    },
    /// Another depth than the one that was measured.
    #[error(
        "it puts the vehicle {deepest:.3} m deep, tilted by {tilt:.0} degrees, but depth_m = {measured} of {RECORDINGS_FILE} was measured at rest over flat ground; {}",
        explanation(.mistakes)
    )]
    Depth {
        /// Measured at rest [m].
        measured: f64,
        /// Largest depth of the recording, but for a twentieth of its frames [m].
        deepest: f64,
        /// Median tilt of the vehicle [deg].
        tilt: f64,
        /// The mistakes that explain it; empty where none do.
        mistakes: Vec<Misreading>,
    },
    /// Wheels that do not roll ahead.
    #[error("it moves {astray:.0} degrees off the vehicle's x axis, but wheels roll along it; {}", direction(.mistakes))]
    Direction {
        /// Angle between velocity and x, rms [deg].
        astray: f64,
        /// The mistakes that explain it; empty where none do.
        mistakes: Vec<Misreading>,
    },
    /// A pose that stays the same to the last bit between frames in which the vehicle moves.
    #[error(
        "the pose stays the same from t = {from:.3} s to {to:.3} s while the vehicle moves before or after: tracking was lost; leave those rows out"
    )]
    Frozen {
        /// First frame of it [s].
        from: f64,
        /// Last frame of it [s].
        to: f64,
    },
    /// A pose that no vehicle reaches from the one before it.
    #[error(
        "from t = {from:.3} s to {to:.3} s it moves by {distance:.3} m and turns by {turn:.0} degrees, faster than any vehicle: markers were taken for others, or tracking was lost; leave the rows before or after out"
    )]
    Jump {
        /// Before it [s].
        from: f64,
        /// After it [s].
        to: f64,
        /// How far [m].
        distance: f64,
        /// By how much [deg].
        turn: f64,
    },
    /// Stamps that are no seconds.
    #[error(
        "column t: {rows} rows span {span} s without holes, which are {samples:.0} samples at {rate_hz} Hz: t must be in seconds, or rate_hz be lower"
    )]
    Clock {
        /// Rows of the recording.
        rows: usize,
        /// What they span, were it seconds, less the holes [s].
        span: f64,
        /// Samples that this makes.
        samples: f64,
        /// Rate after resampling [Hz].
        rate_hz: f64,
    },
    /// The filter has no answer.
    #[error("at {rate_hz} Hz, between holes in time: {source}")]
    Filter {
        /// Rate after resampling [Hz].
        rate_hz: f64,
        /// Why.
        source: FilterError,
    },
}

impl RecordingFault {
    /// True where a mistake in how the recording is read is named.
    pub(super) fn is_explained(&self) -> bool {
        matches!(self, Self::Depth { mistakes, .. } | Self::Direction { mistakes, .. } if !mistakes.is_empty())
    }
}

pub(super) fn at(path: &Path) -> impl FnOnce(RecordingFault) -> RecordingError {
    let at = At::path(path);
    move |fault| at(fault).into()
}

impl Recordings {
    /// Reads and checks a folder; every CSV file needs an entry and every entry its file.
    pub fn read(directory: &Path) -> Result<Self, RecordingError> {
        let path = directory.join(RECORDINGS_FILE);
        let text = fs::read_to_string(&path).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound if directory.is_dir() => {
                at(directory)(RecordingFault::NoDescription)
            }
            _ => at(&path)(error.into()),
        })?;
        let file: RecordingsFile = toml::from_str(&text).map_err(|error| at(&path)(error.into()))?;
        file.check().map_err(at(&path))?;
        let unlisted = unlisted(directory, &file).map_err(|error| at(directory)(error.into()))?;
        if let Some(name) = unlisted {
            return Err(at(&directory.join(format!("{name}.csv")))(RecordingFault::Unlisted { name }));
        }
        let read = |name: &String| {
            let recording = Recording::read(&directory.join(format!("{name}.csv")))?;
            Ok::<_, RecordingError>((name.clone(), recording))
        };
        let recordings = file.recording.keys().map(read).collect::<Result<_, _>>()?;
        Ok(Self { directory: directory.to_owned(), file, recordings })
    }
}

/// The first CSV file without an entry.
fn unlisted(directory: &Path, file: &RecordingsFile) -> std::io::Result<Option<String>> {
    for entry in fs::read_dir(directory)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if let Some(stem) = name.strip_suffix(".csv").filter(|stem| !file.recording.contains_key(*stem)) {
            return Ok(Some(stem.to_owned()));
        }
    }
    Ok(None)
}

impl RecordingsFile {
    /// The text of the file.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("plain numbers, strings and tables are always TOML")
    }

    fn check(&self) -> Result<(), RecordingFault> {
        if self.recording.is_empty() {
            return Err(RecordingFault::NoRecording);
        }
        let number = |key: &str, value: f64, expected: &'static str| {
            Err(RecordingFault::Number { key: key.to_owned(), value, expected })
        };
        let density = self.fluid_density_kgpm3;
        if !(500.0..=3000.0).contains(&density) {
            return number("fluid_density_kgpm3", density, "between 500 and 3000 kg/m3");
        }
        let far = |value: &&f64| !(-10.0..=10.0).contains(*value);
        if let Some(&value) = self.center_of_mass_from_marker_m.iter().find(far) {
            return number("center_of_mass_from_marker_m", value, "within 10 m");
        }
        for (name, entry) in &self.recording {
            let level = entry.water_level_m;
            if !(-FARTHEST..=FARTHEST).contains(&level) {
                return number(&format!("recording.{name}.water_level_m"), level, "an altitude in meters");
            }
            if let Some(depth) = entry.depth_m.filter(|depth| !(*depth > 0.0 && *depth < 20.0)) {
                return number(&format!("recording.{name}.depth_m"), depth, "a depth in meters");
            }
        }
        Ok(())
    }
}

impl Recording {
    /// The file of a recording.
    pub fn to_csv(&self) -> String {
        let place = [0, 1, 2].map(|axis| self.position.iter().map(|p| p[axis]).collect::<Vec<f64>>());
        // nalgebra stores i, j, k, w
        let turn = [3, 0, 1, 2].map(|at| self.rotation.iter().map(|q| q.coords[at]).collect::<Vec<f64>>());
        let mut columns: Vec<(&str, &[f64])> = vec![("t", &self.t)];
        columns.extend(COLUMNS[1..].iter().copied().zip(place.iter().chain(&turn).map(Vec::as_slice)));
        csv_text(&columns)
    }

    /// Reads and checks one file.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let table = Table::read(path, &COLUMNS, &[])?;
        table.check_time(2)?;
        let column = |name: &str| table.column(name);
        let [x, y, z] = ["x", "y", "z"].map(column);
        let [w, i, j, k] = ["qw", "qx", "qy", "qz"].map(column);
        let mut recording = Self {
            t: column("t").to_vec(),
            position: Vec::with_capacity(x.len()),
            rotation: Vec::with_capacity(x.len()),
        };
        for (index, &row) in table.rows.iter().enumerate() {
            for (name, values) in [("x", x), ("y", y), ("z", z)] {
                if values[index].abs() > FARTHEST {
                    let (column, value) = (name, values[index]);
                    return Err(at(path)(RecordingFault::Position { row, column, value }));
                }
            }
            let quaternion = Quaternion::new(w[index], i[index], j[index], k[index]);
            let length = quaternion.norm();
            if (length - 1.0).abs() > LENGTH_TOLERANCE {
                return Err(at(path)(RecordingFault::Quaternion { row, length }));
            }
            recording.position.push(Vec3::new(x[index], y[index], z[index]));
            recording.rotation.push(UnitQuaternion::from_quaternion(quaternion));
        }
        Ok(recording)
    }
}
