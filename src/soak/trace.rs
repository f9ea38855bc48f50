//! A recorded trace: the state columns of a trial (CSV, SI units by name).

use std::io::Read;

use serde::Deserialize;

use crate::{frame::up_from_roll_pitch, service::wire::State};

/// Columns of a trial that say nothing about the state.
const NOT_STATE: [&str; 17] = [
    "yaw", "wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr", "fx", "fy", "fz", "mx", "my", "mz", "sim_fx",
    "sim_fy", "sim_fz", "sim_mx", "sim_my", "sim_mz",
];
const STATE: [&str; 17] = [
    "t", "vx", "vy", "vz", "wx", "wy", "wz", "roll", "pitch", "depth", "ax", "ay", "az", "alx", "aly", "alz",
    "rho",
];

/// Why a trace cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// The file is no CSV with the columns of a trial.
    #[error("the trace cannot be read: {0}")]
    Csv(#[from] csv::Error),
    /// Time must increase.
    #[error("row {row}: t = {t} s does not increase")]
    Time {
        /// Number of the row after the header, from 1.
        row: usize,
        /// Its time [s].
        t: f64,
    },
    /// A value is infinite or not a number.
    #[error("row {row}: a value is not finite")]
    NotFinite {
        /// Number of the row after the header, from 1.
        row: usize,
    },
    /// Fewer than two rows make no trace.
    #[error("the trace has {rows} rows; at least 2 are needed")]
    TooShort {
        /// How many rows there are.
        rows: usize,
    },
}

#[derive(Debug, Deserialize)]
struct Row {
    t: f64,
    vx: f32,
    vy: f32,
    vz: f32,
    wx: f32,
    wy: f32,
    wz: f32,
    depth: f32,
    roll: Option<f64>,
    pitch: Option<f64>,
    ax: Option<f32>,
    ay: Option<f32>,
    az: Option<f32>,
    alx: Option<f32>,
    aly: Option<f32>,
    alz: Option<f32>,
    rho: Option<f32>,
}

impl Row {
    fn state(&self) -> State {
        let or_zero = |v: Option<f32>| v.unwrap_or(0.0);
        let up = up_from_roll_pitch(self.roll.unwrap_or(0.0), self.pitch.unwrap_or(0.0));
        let level = State::default();
        State {
            velocity: [self.vx, self.vy, self.vz],
            angular_velocity: [self.wx, self.wy, self.wz],
            acceleration: [self.ax, self.ay, self.az].map(or_zero),
            angular_acceleration: [self.alx, self.aly, self.alz].map(or_zero),
            gravity: [-up.x as f32, -up.y as f32, -up.z as f32],
            depth: self.depth,
            density: self.rho.unwrap_or(level.density),
            ..level
        }
    }

    fn is_finite(&self) -> bool {
        let State { velocity, angular_velocity, acceleration, angular_acceleration, gravity, .. } =
            self.state();
        let vectors = [velocity, angular_velocity, acceleration, angular_acceleration, gravity];
        let scalars = [self.depth, self.rho.unwrap_or(0.0)];
        self.t.is_finite() && vectors.as_flattened().iter().chain(&scalars).all(|v| v.is_finite())
    }
}

/// States by time.
#[derive(Debug, Clone)]
pub(super) struct Trace {
    times: Vec<f64>,
    states: Vec<State>,
    /// Columns that no trial has.
    pub unknown_columns: Vec<String>,
}

impl Trace {
    /// Reads all rows; time is counted from the first.
    pub(super) fn read(reader: impl Read) -> Result<Self, TraceError> {
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(reader);
        let known = |name: &str| STATE.contains(&name) || NOT_STATE.contains(&name);
        let unknown_columns = reader.headers()?.iter().filter(|h| !known(h)).map(str::to_owned).collect();
        let mut trace = Self { times: Vec::new(), states: Vec::new(), unknown_columns };
        for (index, row) in reader.deserialize::<Row>().enumerate() {
            trace.push(index + 1, &row?)?;
        }
        if trace.states.len() < 2 {
            return Err(TraceError::TooShort { rows: trace.states.len() });
        }
        let first = trace.times[0];
        trace.times.iter_mut().for_each(|t| *t -= first);
        Ok(trace)
    }

    fn push(&mut self, number: usize, row: &Row) -> Result<(), TraceError> {
        if !row.is_finite() {
            return Err(TraceError::NotFinite { row: number });
        }
        if self.times.last().is_some_and(|&last| row.t <= last) {
            return Err(TraceError::Time { row: number, t: row.t });
        }
        self.times.push(row.t);
        self.states.push(row.state());
        Ok(())
    }

    /// The last row at or before a time [s], the recording repeated for ever. Rows are not blended: what is sent
    /// is what was recorded.
    pub(super) fn at(&self, at: f64) -> State {
        let length = self.times[self.times.len() - 1];
        let after = self.times.partition_point(|&t| t <= at.rem_euclid(length));
        self.states[after.saturating_sub(1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "t,vx,vy,vz,wx,wy,wz,depth,roll,note,fx\n";

    fn read(rows: &str) -> Result<Trace, TraceError> {
        Trace::read(format!("{HEAD}{rows}").as_bytes())
    }

    #[test]
    fn rows_hold_until_the_next_and_start_again_at_the_end() {
        let trace = read("5,1,0,0,0,0,0,0.3,,a,1\n6,2,0,0,0,0,0,0.3,0.1,b,\n7,3,0,0,0,0,0,0.3,0,c,9\n")
            .expect("valid");
        let speeds = [0.0, 0.99, 1.0, 1.5, 2.0, 3.2].map(|t| trace.at(t).velocity[0]);
        assert_eq!(speeds, [1.0, 1.0, 2.0, 2.0, 1.0, 2.0]);
        assert_eq!(trace.unknown_columns, ["note"]);
    }

    #[test]
    fn a_missing_optional_value_is_level_fresh_water() {
        let trace = read("0,1,0,0,0,0,0,0.3,,a,1\n1,2,0,0,0,0,0,0.3,0.5,b,\n").expect("valid");
        let (first, second) = (trace.at(0.0), trace.states[1]);
        assert_eq!((first.gravity[2], first.density), (-1.0, 1000.0));
        assert!(
            (second.gravity[1] + 0.5_f32.sin()).abs() < 1e-6,
            "a roll to the right lowers the right side"
        );
    }

    #[test]
    fn bad_traces_are_refused_with_the_row() {
        let good = "0,1,0,0,0,0,0,0.3,,a,1\n";
        assert!(matches!(read(good), Err(TraceError::TooShort { rows: 1 })));
        assert!(matches!(read(&good.repeat(2)), Err(TraceError::Time { row: 2, .. })));
        let nan = format!("{good}1,NaN,0,0,0,0,0,0.3,,a,1\n");
        assert!(matches!(read(&nan), Err(TraceError::NotFinite { row: 2 })));
        let missing = Trace::read("t,vx\n0,1\n1,1\n".as_bytes()).expect_err("vy is missing").to_string();
        assert!(missing.contains("vy"), "{missing}");
    }
}
