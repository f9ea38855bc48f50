//! Level and speed of the water ahead of the vehicle, from the function object `gauges`.
//!
//! A vehicle in a channel raises the water ahead of it and slows it down, so the flow of a case is not quite the planned one.

use std::path::{Path, PathBuf};

use crate::dataset::history::{History, HistoryError};

/// Rise of the water level [m] and speed along -x [m/s].
type Row = [f64; 2];

/// Why gauges cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum GaugeError {
    /// A file that cannot be read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A row that does not parse, or a gauge outside of the mesh.
    #[error("{path}: `{row}` is no row of numbers of gauges in the water")]
    Row {
        /// The file.
        path: PathBuf,
        /// The row.
        row: String,
    },
    /// Files that are no history.
    #[error("{path}: {fault}")]
    History {
        /// The folder.
        path: PathBuf,
        /// What is wrong.
        fault: HistoryError,
    },
}

/// What OpenFOAM writes for a gauge outside of the mesh is far above this.
const LARGEST: f64 = 1e12;

/// Means over the gauges against time. `weight` is the weight of the water [N/m3].
pub fn read(case: &Path, weight: f64) -> Result<History<2>, GaugeError> {
    let folder = case.join("postProcessing/gauges/0");
    let (pressures, velocities) = (rows(&folder.join("p_rgh"), 1)?, rows(&folder.join("U"), 3)?);
    let rows = pressures
        .iter()
        .zip(&velocities)
        .map(|((time, pressure), (_, speed))| -> (f64, Row) { (*time, [pressure / weight, -speed]) });
    History::new(rows).map_err(|fault| GaugeError::History { path: folder.clone(), fault })
}

/// Time and mean over the gauges of the first of `components` numbers of each.
fn rows(path: &Path, components: usize) -> Result<Vec<(f64, f64)>, GaugeError> {
    let text =
        std::fs::read_to_string(path).map_err(|source| GaugeError::Io { path: path.to_owned(), source })?;
    let row = |line: &str| {
        let plain = line.replace(['(', ')'], " ");
        let numbers: Option<Vec<f64>> =
            plain.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
        let (time, values) = numbers.as_deref()?.split_first().map(|(time, rest)| (*time, rest.to_vec()))?;
        let firsts: Vec<f64> = values.chunks_exact(components).map(|value| value[0]).collect();
        let is_whole = !firsts.is_empty() && values.len() == components * firsts.len();
        let is_wet = firsts.iter().all(|value| value.abs() < LARGEST);
        (is_whole && is_wet).then(|| (time, firsts.iter().sum::<f64>() / firsts.len() as f64))
    };
    let lines = text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    lines
        .map(|line| row(line).ok_or_else(|| GaugeError::Row { path: path.to_owned(), row: line.to_owned() }))
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn gauges_give_rise_and_speed_and_one_outside_of_the_mesh_is_refused() {
        let case = tempfile::tempdir().unwrap();
        let folder = case.path().join("postProcessing/gauges/0");
        std::fs::create_dir_all(&folder).unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
        write("p_rgh", "# Probe 0 (1 0 0.1)\n#  Time\n  0  0 0\n  0.5  98.1 294.3\n");
        write("U", "#  Time\n  0  (0 0 0) (0 0 0)\n  0.5  (-1 0 0) (-2 0.5 0)\n");
        let history = read(case.path(), 9810.0).unwrap();
        assert_eq!(history.times(), [0.0, 0.5]);
        let [rise, speed] = history.values()[1];
        assert!((rise - 0.02).abs() < 1e-12 && (speed - 1.5).abs() < 1e-12);
        write("p_rgh", "0 0 -1e+300\n");
        assert!(read(case.path(), 9810.0).unwrap_err().to_string().contains("1e+300"));
    }
}
