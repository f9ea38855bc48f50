//! A table of states: CSV with the columns of a trial, SI units and radians by name.

use std::borrow::Cow;

use serde::Deserialize;

use wade_core::condition::bed_from_word;
use wade_core::frame::{Vec3, up_from_roll_pitch};
use wade_core::model::Model;
use wade_core::vehicle::PerWheel;
use wade_wire::State;
use wade_wire::single;

/// Columns that describe a state.
const STATE: [&str; 24] = [
    "t",
    "vx",
    "vy",
    "vz",
    "cx",
    "cy",
    "cz",
    "wx",
    "wy",
    "wz",
    "roll",
    "pitch",
    "yaw",
    "depth",
    "ax",
    "ay",
    "az",
    "alx",
    "aly",
    "alz",
    "rho",
    "water_level",
    "bed_clearance",
    "bed",
];
/// Columns of a trial that say nothing about the state.
const NOT_STATE: [&str; 12] =
    ["fx", "fy", "fz", "mx", "my", "mz", "sim_fx", "sim_fy", "sim_fz", "sim_mx", "sim_my", "sim_mz"];

/// Columns of the speeds of four wheels.
const FOUR_WHEELS: [&str; 4] = ["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"];

/// The columns of a table that have the speeds of a vehicle's wheels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WheelColumns {
    /// In the order of the wheels.
    names: Vec<String>,
}

impl WheelColumns {
    /// Of any vehicle with four wheels.
    pub fn of_four() -> Self {
        Self { names: FOUR_WHEELS.map(str::to_owned).into() }
    }

    /// Of a vehicle: the names of its wheels; of four wheels `wheel_fl`, `wheel_fr`, `wheel_rl` and `wheel_rr`, unless the table has
    /// the names of the vehicle.
    pub fn of_model(model: &Model, headers: &csv::StringRecord) -> Self {
        let name = |&wheel: &usize| model.vehicle().surfaces[wheel].name.clone();
        let names: Vec<String> = model.wheels().iter().map(name).collect();
        let has_none = !headers.iter().any(|header| names.iter().any(|name| name == header.trim()));
        if names.len() == FOUR_WHEELS.len() && has_none { Self::of_four() } else { Self { names } }
    }

    /// The speeds in a row, where it has that of each wheel.
    fn read(
        &self,
        record: &csv::StringRecord,
        headers: &csv::StringRecord,
    ) -> Result<Option<PerWheel<f32>>, BadValue> {
        let mut speeds = Vec::with_capacity(self.names.len());
        for column in &self.names {
            let place = headers.iter().position(|header| header.trim() == column);
            let Some(value) = place.and_then(|place| record.get(place)).map(str::trim) else { continue };
            if !value.is_empty() {
                let speed: Result<f64, _> = value.parse();
                let bad = |_| BadValue { column: column.clone(), value: value.to_owned() };
                speeds.push(speed.map_err(bad)? as f32);
            }
        }
        let are_all = speeds.len() == self.names.len() && !speeds.is_empty();
        Ok(if are_all { PerWheel::new(&speeds) } else { None })
    }
}

/// Columns that no trial has: to be reported, and ignored.
pub fn unknown_columns(headers: &csv::StringRecord, wheels: &WheelColumns) -> Vec<String> {
    let is_wheel = |name: &str| wheels.names.iter().any(|wheel| wheel == name);
    let known = |name: &str| STATE.contains(&name) || NOT_STATE.contains(&name) || is_wheel(name);
    headers.iter().map(str::trim).filter(|header| !known(header)).map(str::to_owned).collect()
}

/// One row; an optional column that is missing or blank has its default.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Row {
    /// Time [s].
    pub t: Option<f64>,
    vx: f64,
    vy: f64,
    vz: f64,
    depth: Option<f64>,
    water_level: Option<f64>,
    bed_clearance: Option<f64>,
    bed: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    cz: Option<f64>,
    wx: Option<f64>,
    wy: Option<f64>,
    wz: Option<f64>,
    roll: Option<f64>,
    pitch: Option<f64>,
    ax: Option<f64>,
    ay: Option<f64>,
    az: Option<f64>,
    alx: Option<f64>,
    aly: Option<f64>,
    alz: Option<f64>,
    rho: Option<f64>,
    yaw: Option<f64>,
    #[serde(skip)]
    wheel_speeds: Option<PerWheel<f32>>,
}

/// A row that holds no state.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{value}\" in column {column} is no number")]
pub struct BadValue {
    /// Name of the column; or what is wrong with the row as a whole.
    pub column: String,
    /// What stands there.
    pub value: String,
}

/// The record with the share that a word in column `bed` stands for.
fn with_numbers<'a>(
    record: &'a csv::StringRecord,
    headers: &csv::StringRecord,
) -> Cow<'a, csv::StringRecord> {
    let place = headers.iter().position(|header| header == "bed");
    let word = place.and_then(|place| Some((place, bed_from_word(record.get(place)?)?)));
    word.map_or(Cow::Borrowed(record), |(place, share)| {
        let share = share.to_string();
        let cells = record.iter().enumerate();
        Cow::Owned(cells.map(|(at, cell)| if at == place { &share } else { cell }).collect())
    })
}

impl Row {
    /// Reads a record under these headers.
    pub fn read(
        record: &csv::StringRecord,
        headers: &csv::StringRecord,
        wheels: &WheelColumns,
    ) -> Result<Self, BadValue> {
        let row: Result<Self, csv::Error> = with_numbers(record, headers).deserialize(Some(headers));
        let row = row.map_err(|error| {
            let field = match error.kind() {
                csv::ErrorKind::Deserialize { err, .. } => err.field(),
                _ => None,
            };
            let at = |record: &csv::StringRecord, field: u64| record.get(field as usize).map(str::to_owned);
            let column = field.and_then(|field| at(headers, field)).unwrap_or_else(|| error.to_string());
            BadValue { column, value: field.and_then(|field| at(record, field)).unwrap_or_default() }
        })?;
        Ok(Self { wheel_speeds: wheels.read(record, headers)?, ..row })
    }

    /// Velocity [m/s] and angular velocity [rad/s].
    pub fn motion(&self) -> [Vec3; 2] {
        let angular = [self.wx, self.wy, self.wz].map(|value| value.unwrap_or(0.0));
        [Vec3::new(self.vx, self.vy, self.vz), angular.into()]
    }

    /// Acceleration [m/s2]; 0 where none is stated.
    pub fn acceleration(&self) -> Vec3 {
        [self.ax, self.ay, self.az].map(|value| value.unwrap_or(0.0)).into()
    }

    /// The state of the row.
    pub fn state(&self) -> State {
        let or_zero = |value: Option<f64>| value.unwrap_or(0.0) as f32;
        let up = up_from_roll_pitch(self.roll.unwrap_or(0.0), self.pitch.unwrap_or(0.0));
        let level = State::default();
        State {
            velocity: [self.vx, self.vy, self.vz].map(|value| value as f32),
            current: [self.cx, self.cy, self.cz].map(or_zero),
            angular_velocity: [self.wx, self.wy, self.wz].map(or_zero),
            acceleration: [self.ax, self.ay, self.az].map(or_zero),
            angular_acceleration: [self.alx, self.aly, self.alz].map(or_zero),
            gravity: single(&-up.into_inner()),
            depth: self.depth.map_or(f32::NAN, |depth| depth as f32),
            water_level: self.water_level.map(|level| level as f32),
            bed_clearance: self.bed_clearance.map(|clearance| clearance as f32),
            bed: self.bed.map(|bed| bed as f32),
            density: self.rho.map_or(level.density, |rho| rho as f32),
            heading: self.yaw.map(|yaw| yaw as f32),
            wheel_speeds: self.wheel_speeds,
            ..level
        }
    }
}
