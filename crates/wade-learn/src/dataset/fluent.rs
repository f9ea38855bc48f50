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
    columns: BTreeMap<String, Vec<Column>>,
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
    /// Reads every `.out` file of a folder.
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
        let mut columns: BTreeMap<String, Vec<Column>> = BTreeMap::new();
        for path in paths {
            for (name, column) in read_file(&path, cut_off)? {
                columns.entry(name).or_default().push(column);
            }
        }
        let start = |column: &Column| column.history.times()[0];
        columns.values_mut().for_each(|parts| parts.sort_by(|a, b| start(a).total_cmp(&start(b))));
        Ok(Self { folder: folder.to_owned(), columns })
    }

    /// The history of a column and the file with its end; where several files hold it, the one that begins later counts from there
    /// on.
    pub fn column(&self, name: &str) -> Result<(History<1>, &Path), FluentError> {
        let Some([first, later @ ..]) = self.columns.get(name).map(Vec::as_slice) else {
            let (path, found) = (self.folder.clone(), self.columns.keys().cloned().collect());
            return Err(FluentError::MissingColumn { path, column: name.to_owned(), found });
        };
        let mut history = first.history.clone();
        for (before, part) in [first].into_iter().chain(later).zip(later) {
            let start = part.history.times()[0];
            if before.history.times()[0] == start && before.history != part.history {
                let paths = [before.path.clone(), part.path.clone()];
                return Err(FluentError::Ambiguous { column: name.to_owned(), paths });
            }
            history.overlay(part.history.clone(), start);
        }
        Ok((history, &later.last().unwrap_or(first).path))
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    /// Reports of the given files, named a.out, b.out and so on.
    fn reports(files: &[&str]) -> Result<Reports, FluentError> {
        let folder = tempfile::TempDir::new().unwrap();
        for (name, text) in ["a.out", "b.out", "c.out"].iter().zip(files) {
            fs::write(folder.path().join(name), text).unwrap();
        }
        Reports::read(folder.path(), CutOff::Refuse)
    }

    fn file(name: &str, rows: &str) -> String {
        format!("\"rfile\"\n\"Time Step\" \"{name}\"\n(\"Time Step\" \"{name}\" \"flow-time\")\n{rows}")
    }

    #[test]
    fn columns_are_found_by_name_across_files() {
        let found =
            reports(&[&file("front drag", "1 -5 0.1\n2 -6 0.2\n"), &file("lift", "1 7 0.1\n")]).unwrap();
        let (drag, _) = found.column("front drag").unwrap();
        assert_eq!((drag.times(), drag.values()), (&[0.1, 0.2][..], &[[-5.0], [-6.0]][..]));
        let error = found.column("side").unwrap_err().to_string();
        assert!(error.contains("column side") && error.contains("front drag, lift"), "{error}");
    }

    #[test]
    fn a_run_started_again_goes_on_in_the_same_file_or_in_another() {
        let again = file("drag", "1 1 0.1\n2 2 0.2\n3 3 0.3\n2 20 0.2\n3 30 0.3\n");
        assert_eq!(reports(&[&again]).unwrap().column("drag").unwrap().0.values(), [[1.0], [20.0], [30.0]]);
        let (first, second) = (file("drag", "2 20 0.2\n3 30 0.3\n"), file("drag", "1 1 0.1\n2 2 0.2\n"));
        let joined = reports(&[&first, &second]).unwrap();
        assert_eq!(joined.column("drag").unwrap().0.values(), [[1.0], [20.0], [30.0]]);
    }

    #[test]
    fn two_files_that_contradict_each_other_are_refused() {
        let (one, other) = (file("drag", "1 1 0.1\n"), file("drag", "1 2 0.1\n"));
        let drag = |files: &[&str]| reports(files).unwrap().column("drag").map(|(history, _)| history);
        assert!(drag(&[&one, &one]).is_ok(), "the same column in two report files");
        assert!(matches!(drag(&[&one, &other]), Err(FluentError::Ambiguous { .. })));
    }

    #[test]
    fn what_is_no_report_is_refused() {
        assert!(matches!(reports(&[]), Err(FluentError::NoFile { .. })));
        assert!(matches!(reports(&["1 2 3\n"]), Err(FluentError::Header { line: 1, .. })));
        assert!(matches!(reports(&[&file("drag", "")]), Err(FluentError::History { .. })));
        let changed = format!("{}(\"Time Step\" \"lift\" \"flow-time\")\n", file("drag", "1 1 0.1\n"));
        assert!(matches!(reports(&[&changed]), Err(FluentError::Header { line: 5, .. })));
    }
}
