//! A recorded trace: the state columns of a trial (CSV, SI units by name).

use std::io::Read;

use crate::states::{BadValue, Row, WheelColumns, unknown_columns};
use wade_wire::{InvalidState, State};

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
    /// A value is missing, infinite or no number.
    #[error("row {row}: {source}")]
    Value {
        /// Number of the row after the header, from 1.
        row: usize,
        /// Column and value.
        source: BadValue,
    },
    /// A state that no server would answer.
    #[error("row {row}: {source}")]
    State {
        /// Number of the row after the header, from 1.
        row: usize,
        /// What is wrong with it.
        source: InvalidState,
    },
    /// Fewer than two rows make no trace.
    #[error("the trace has {rows} rows; at least 2 are needed")]
    TooShort {
        /// How many rows there are.
        rows: usize,
    },
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
        let headers = reader.headers()?.clone();
        // which vehicle is asked is the server's affair
        let wheels = WheelColumns::of_four();
        let unknown_columns = unknown_columns(&headers, &wheels);
        let mut trace = Self { times: Vec::new(), states: Vec::new(), unknown_columns };
        for (index, record) in reader.records().enumerate() {
            let row = index + 1;
            trace.push(
                row,
                &Row::read(&record?, &headers, &wheels)
                    .map_err(|source| TraceError::Value { row, source })?,
            )?;
        }
        if trace.states.len() < 2 {
            return Err(TraceError::TooShort { rows: trace.states.len() });
        }
        let first = trace.times[0];
        trace.times.iter_mut().for_each(|t| *t -= first);
        Ok(trace)
    }

    fn push(&mut self, number: usize, row: &Row) -> Result<(), TraceError> {
        let state = row.state();
        state.check().map_err(|source| TraceError::State { row: number, source })?;
        // a table without a clock has none to play by
        let t = row.t.unwrap_or(f64::NAN);
        if !t.is_finite() || self.times.last().is_some_and(|&last| t <= last) {
            return Err(TraceError::Time { row: number, t });
        }
        self.times.push(t);
        self.states.push(state);
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
        assert!(matches!(read(&nan), Err(TraceError::State { row: 2, .. })));
        let missing = Trace::read("t,vx\n0,1\n1,1\n".as_bytes()).expect_err("vy is missing").to_string();
        assert!(missing.contains("vy"), "{missing}");
    }
}
