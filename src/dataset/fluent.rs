//! Fluent's report files (`.out`): a quoted title, a quoted summary, the names of the columns in quotes and
//! parentheses, then rows of numbers. Columns are found by name, since their order changes from file to file.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::history::{History, HistoryError};
use super::lines::{CutOff, LineError, Lines};

/// The column of time.
const TIME: &str = "flow-time";

/// Every column of the report files of one case, by its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Reports {
    folder: PathBuf,
    columns: BTreeMap<String, Column>,
}

#[derive(Debug, Clone, PartialEq)]
struct Column {
    path: PathBuf,
    history: History<1>,
}

/// Why report files were refused.
#[derive(Debug, thiserror::Error)]
pub enum FluentError {
    /// A file or folder that cannot be read.
    #[error("{}: {fault}", .path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// Why.
        fault: std::io::Error,
    },
    /// No report file.
    #[error("{}: no report file (.out) in it", .path.display())]
    NoFile {
        /// The folder of the case.
        path: PathBuf,
    },
    /// No line with the names of the columns, or a second one that differs.
    #[error("{}, line {line}: before the first row there must be one line such as (\"Time Step\" \"flow-time\" \"drag\")", .path.display())]
    Header {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
    },
    /// No time.
    #[error("{}: no column {TIME}: add it to the report file in Fluent", .path.display())]
    NoTime {
        /// The file.
        path: PathBuf,
    },
    /// A line that is no row.
    #[error("{}, {fault}", .path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line and what is wrong with it.
        fault: LineError,
    },
    /// Rows that are no history.
    #[error("{}: {fault}", .path.display())]
    History {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        fault: HistoryError,
    },
    /// The same column in two files that begin at the same time and differ.
    #[error("column {column} is in {} and in {}, from the same time on: remove the outdated file", .paths[0].display(), .paths[1].display())]
    Ambiguous {
        /// Name of the column.
        column: String,
        /// Both files.
        paths: [PathBuf; 2],
    },
    /// A column that case.toml asks for.
    #[error("{}: no report file has a column {column}; there are: {}", .path.display(), .found.join(", "))]
    MissingColumn {
        /// The folder of the case.
        path: PathBuf,
        /// Name of the column.
        column: String,
        /// The columns that are there.
        found: Vec<String>,
    },
}

impl Reports {
    /// Reads every `.out` file of a folder; where two hold the same column, the one that begins later counts from there.
    pub fn read(folder: &Path, cut_off: CutOff) -> Result<Self, FluentError> {
        let io = |fault| FluentError::Io { path: folder.to_owned(), fault };
        let mut paths = Vec::new();
        for entry in fs::read_dir(folder).map_err(io)? {
            let path = entry.map_err(io)?.path();
            if path.extension().is_some_and(|extension| extension == "out") {
                paths.push(path);
            }
        }
        if paths.is_empty() {
            return Err(FluentError::NoFile { path: folder.to_owned() });
        }
        let mut found = Vec::new();
        for path in paths {
            found.extend(read_file(&path, cut_off)?);
        }
        found.sort_by(|(_, a), (_, b)| a.history.times()[0].total_cmp(&b.history.times()[0]));
        let mut reports = Self { folder: folder.to_owned(), columns: BTreeMap::new() };
        for (name, column) in found {
            reports.add(name, column)?;
        }
        Ok(reports)
    }

    fn add(&mut self, name: String, later: Column) -> Result<(), FluentError> {
        let Some(column) = self.columns.get_mut(&name) else {
            self.columns.insert(name, later);
            return Ok(());
        };
        let start = later.history.times()[0];
        if column.history.times()[0] == start && column.history != later.history {
            let paths = [column.path.clone(), later.path];
            return Err(FluentError::Ambiguous { column: name, paths });
        }
        column.history.overlay(later.history, start);
        Ok(())
    }

    /// The history of a column.
    pub fn column(&self, name: &str) -> Result<&History<1>, FluentError> {
        let column = self.columns.get(name).map(|column| &column.history);
        column.ok_or_else(|| FluentError::MissingColumn {
            path: self.folder.clone(),
            column: name.to_owned(),
            found: self.columns.keys().cloned().collect(),
        })
    }
}

fn read_file(path: &Path, cut_off: CutOff) -> Result<Vec<(String, Column)>, FluentError> {
    let at = || path.to_owned();
    let bytes = fs::read(path).map_err(|fault| FluentError::Io { path: at(), fault })?;
    // names of zones may be in any encoding, the numbers are ASCII
    let text = String::from_utf8_lossy(&bytes);
    let lines = Lines::new(&text, cut_off);
    let mut names: Vec<String> = Vec::new();
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut time = 0;
    for (line, text) in lines.iter() {
        if text.starts_with('"') {
            continue;
        }
        if text.starts_with('(') {
            let found = quoted(text);
            if found.is_empty() || !(names.is_empty() || names == found) {
                return Err(FluentError::Header { path: at(), line });
            }
            time = found
                .iter()
                .position(|name| name == TIME)
                .ok_or_else(|| FluentError::NoTime { path: at() })?;
            names = found;
            continue;
        }
        if names.is_empty() {
            return Err(FluentError::Header { path: at(), line });
        }
        let row = lines.row(line, text, names.len());
        if let Some(row) = row.map_err(|fault| FluentError::Line { path: at(), fault })? {
            // a run that was started again from an earlier time may go on in the same file
            rows.truncate(rows.partition_point(|before| before[time] < row[time]));
            rows.push(row);
        }
    }
    let column = |(index, name): (usize, String)| {
        let history = History::new(rows.iter().map(|row| (row[time], [row[index]])));
        let history = history.map_err(|fault| FluentError::History { path: at(), fault })?;
        Ok((name, Column { path: at(), history }))
    };
    names.into_iter().enumerate().filter(|(index, _)| *index != time).map(column).collect()
}

/// What stands between quotes.
fn quoted(line: &str) -> Vec<String> {
    line.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}
