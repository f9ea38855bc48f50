//! Fluent's report files (`.out`): a quoted title, a quoted summary, the names of the columns in quotes and
//! parentheses, then rows of numbers. Columns are found by name, since their order changes from file to file.
//!
//! A folder holds other files that end in `.out` too: the log of a job, residuals by iteration. What is wrong with a file
//! stops the import only where a column of it is asked for.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::history::{History, HistoryError};
use super::lines::{CutOff, LineError, Lines, finite};

/// The column of time.
const TIME: &str = "flow-time";

/// Part of a step by which the starts of two runs must be closer than a step to count as one start: the rest is rounding.
const STEP_ROUNDING: f64 = 1e-3;

/// Rounding of a time that two files print [s].
const TIME_ROUNDING: f64 = 1e-9;

/// The report files of one case.
#[derive(Debug, Clone, PartialEq)]
pub struct Reports {
    folder: PathBuf,
    files: Vec<File>,
}

/// One file: the names of its columns, and its rows with their lines.
#[derive(Debug, Clone, PartialEq)]
struct File {
    path: PathBuf,
    /// None where it has no line with names.
    names: Vec<String>,
    time: usize,
    rows: Vec<(usize, Vec<f64>)>,
    /// Why its columns cannot be used.
    fault: Option<FileFault>,
}

/// What is wrong with a report file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FileFault {
    /// No line with the names of the columns, or a second one that differs.
    #[error(
        "line {line}: before the first row there must be one line such as (\"Time Step\" \"flow-time\" \"drag\")"
    )]
    Header {
        /// Number of the line, from 1.
        line: usize,
    },
    /// No time.
    #[error("no column {TIME}: add it to the report file in Fluent")]
    NoTime,
    /// A line that is no row.
    #[error("{0}")]
    Line(LineError),
    /// Rows that are no history.
    #[error("{0}")]
    History(HistoryError),
}

impl FileFault {
    /// What stands between the file and the fault in a message.
    fn separator(&self) -> &'static str {
        match self {
            Self::Header { .. } | Self::Line(_) => ", ",
            Self::NoTime | Self::History(_) => ": ",
        }
    }
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
    #[error("{}: no report file in it: none (.out) has a line such as (\"Time Step\" \"flow-time\" \"drag\")", .path.display())]
    NoFile {
        /// The folder of the case.
        path: PathBuf,
    },
    /// A compressed file, which may be a later run than those that can be read.
    #[error("{} is compressed: unpack it with gunzip, or move it out of the folder", .path.display())]
    Compressed {
        /// The file.
        path: PathBuf,
    },
    /// A report file with a fault.
    #[error("{}{}{fault}", .path.display(), .fault.separator())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        fault: FileFault,
    },
    /// The same column in two files, of which neither names nor times say which is the later run.
    #[error(
        "column {column} is in {} and in {}, and neither names nor times say which is the later run: remove the outdated file",
        .paths[0].display(), .paths[1].display()
    )]
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
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if name.ends_with(".out.gz") {
                return Err(FluentError::Compressed { path });
            }
            if name.ends_with(".out") && !path.is_dir() {
                paths.push(path);
            }
        }
        paths.sort();
        let files: Vec<File> =
            paths.into_iter().map(|path| File::read(path, cut_off)).collect::<Result<_, _>>()?;
        match files.iter().any(|file| !file.names.is_empty()) {
            true => Ok(Self { folder: folder.to_owned(), files }),
            false => Err(FluentError::NoFile { path: folder.to_owned() }),
        }
    }

    /// Files without the header of a report file, and report files with a fault: none of their columns was asked for if
    /// every call of `column` returned one.
    pub fn passed_over(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().filter(|file| file.fault.is_some()).map(|file| file.path.as_path())
    }

    /// The history of a column and the file with its end; where several files hold it, the one that begins later counts from there
    /// on.
    pub fn column(&self, name: &str) -> Result<(History<1>, &Path), FluentError> {
        let mut parts = Vec::new();
        for file in &self.files {
            for index in (0..file.names.len()).filter(|&index| file.names[index] == name) {
                let history = file.column(index).map_err(|fault| file.error(fault))?;
                parts.push((file, history));
            }
        }
        self.check_headers(&parts)?;
        let start = |history: &History<1>| history.times()[0];
        let end = |history: &History<1>| history.times()[history.times().len() - 1];
        // of two that begin together the longer one counts
        parts.sort_by(|(_, a), (_, b)| start(a).total_cmp(&start(b)).then(end(a).total_cmp(&end(b))));
        let ambiguous = parts.iter().enumerate().find_map(|(at, later)| {
            let before = parts[..at].iter().find(|before| !is_continued(before, later))?;
            Some([before.0.path.clone(), later.0.path.clone()])
        });
        if let Some(mut paths) = ambiguous {
            paths.sort();
            return Err(FluentError::Ambiguous { column: name.to_owned(), paths });
        }
        let joined = parts.into_iter().reduce(|(_, mut history), (file, later)| {
            let start = start(&later);
            history.overlay(later, start);
            (file, history)
        });
        joined.map(|(file, history)| (history, file.path.as_path())).ok_or_else(|| {
            let names: BTreeSet<&String> = self.files.iter().flat_map(|file| &file.names).collect();
            let found = names.into_iter().filter(|name| *name != TIME).cloned().collect();
            FluentError::MissingColumn { path: self.folder.clone(), column: name.to_owned(), found }
        })
    }

    /// Refuses a file without a header whose name makes it a later run of a report file: what it lost may be this column.
    fn check_headers(&self, parts: &[(&File, History<1>)]) -> Result<(), FluentError> {
        let is_run = |file: &&File| parts.iter().any(|(part, _)| part.base() == file.base());
        let lost = self.files.iter().filter(|file| file.names.is_empty()).find(is_run);
        match lost.and_then(|file| Some(file.error(file.fault.clone()?))) {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }
}

/// True where the part that begins later goes on from the other, or repeats it.
fn is_continued((first, before): &(&File, History<1>), (second, later): &(&File, History<1>)) -> bool {
    let (start, end) = (later.times()[0], before.times()[before.times().len() - 1]);
    let step = |history: &History<1>| history.times().windows(2).next().map_or(0.0, |pair| pair[1] - pair[0]);
    let apart = start - before.times()[0];
    let one_start = apart == 0.0 || apart < step(before).max(step(later)) * (1.0 - STEP_ROUNDING);
    // Fluent numbers the files of one report in the order of its runs
    let ((base, number), (other_base, other_number)) = (first.base_and_numbers(), second.base_and_numbers());
    let misnumbered = base == other_base && number > other_number && start <= end;
    !(one_start || misnumbered) || agree(before, later)
}

/// True where both have the same values at the times that they share, and share some.
fn agree(before: &History<1>, later: &History<1>) -> bool {
    let end = before.times()[before.times().len() - 1];
    let inside = later.times().iter().zip(later.values()).take_while(|(time, _)| **time <= end);
    let mut pairs = inside
        .filter_map(|(time, value)| {
            let at = before.times().partition_point(|before| *before < time - TIME_ROUNDING);
            let shared = before.times().get(at).is_some_and(|before| *before <= time + TIME_ROUNDING);
            shared.then(|| (before.values()[at], *value))
        })
        .peekable();
    pairs.peek().is_some() && pairs.all(|(before, later)| before == later)
}

impl File {
    fn read(path: PathBuf, cut_off: CutOff) -> Result<Self, FluentError> {
        match fs::read(&path) {
            // names of zones may be in any encoding, the numbers are ASCII
            Ok(bytes) => Ok(Self::parse(path, &String::from_utf8_lossy(&bytes), cut_off)),
            Err(fault) => Err(FluentError::Io { path, fault }),
        }
    }

    fn parse(path: PathBuf, text: &str, cut_off: CutOff) -> Self {
        let mut file = Self { path, names: Vec::new(), time: 0, rows: Vec::new(), fault: None };
        let lines = Lines::new(text, cut_off);
        let fault = lines.iter().find_map(|(line, text)| file.line(&lines, line, text).err());
        let no_header = || file.names.is_empty().then_some(FileFault::Header { line: 1 });
        file.fault = fault.or_else(no_header);
        file
    }

    fn line(&mut self, lines: &Lines, line: usize, text: &str) -> Result<(), FileFault> {
        if text.starts_with('"') {
            return Ok(());
        }
        if text.starts_with('(') {
            let found = quoted(text);
            if found.is_empty() || !(self.names.is_empty() || self.names == found) {
                return Err(FileFault::Header { line });
            }
            let time = found.iter().position(|name| name == TIME);
            self.names = found;
            self.time = time.ok_or(FileFault::NoTime)?;
            return Ok(());
        }
        if self.names.is_empty() {
            return Err(FileFault::Header { line });
        }
        let row = lines.numbers(line, text, self.names.len()).map_err(FileFault::Line)?;
        if let Some(row) = row {
            let time = row[self.time];
            finite(line, self.time, time).map_err(FileFault::Line)?;
            // a run that was started again from an earlier time may go on in the same file
            self.rows.truncate(self.rows.partition_point(|(_, before)| before[self.time] < time));
            self.rows.push((line, row));
        }
        Ok(())
    }

    fn column(&self, index: usize) -> Result<History<1>, FileFault> {
        match &self.fault {
            Some(fault) => return Err(fault.clone()),
            None => self.rows.iter().try_for_each(|(line, row)| finite(*line, index, row[index])),
        }
        .map_err(FileFault::Line)?;
        let rows = self.rows.iter().map(|(_, row)| (row[self.time], [row[index]]));
        History::new(rows).map_err(FileFault::History)
    }

    fn error(&self, fault: FileFault) -> FluentError {
        FluentError::File { path: self.path.clone(), fault }
    }

    /// The name without the numbers that Fluent adds for a further run, `_1` or `_1_200`, and these numbers.
    fn base_and_numbers(&self) -> (&str, Vec<u64>) {
        let mut base = self.path.file_stem().and_then(|name| name.to_str()).unwrap_or_default();
        let mut numbers = Vec::new();
        while let Some((before, number)) = base.rsplit_once('_')
            && let Ok(number) = number.parse()
        {
            base = before;
            numbers.insert(0, number);
        }
        (base, numbers)
    }

    fn base(&self) -> &str {
        self.base_and_numbers().0
    }
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
        let longer = file("drag", "1 1 0.1\n2 5 0.2\n");
        assert_eq!(drag(&[&longer, &one]).unwrap().times(), [0.1, 0.2], "a copy that was made earlier");
    }

    /// The column `drag` of files with these names and rows.
    fn drag(files: &[(&str, &str)]) -> Result<Vec<[f64; 1]>, FluentError> {
        let folder = tempfile::TempDir::new().unwrap();
        for (name, text) in files {
            fs::write(folder.path().join(name), text).unwrap();
        }
        let reports = Reports::read(folder.path(), CutOff::Refuse)?;
        reports.column("drag").map(|(history, _)| history.values().to_vec())
    }

    #[test]
    fn a_whole_new_run_with_another_step_beside_the_old_one_is_refused_by_both_names() {
        let old = file("drag", "1 1 0.01\n2 1 0.02\n3 1 0.03\n");
        let new = file("drag", "1 2 0.005\n2 2 0.01\n3 2 0.02\n4 2 0.03\n");
        for (rep, rep_1) in [(&old, &new), (&new, &old)] {
            let said = drag(&[("rep.out", rep), ("rep_1.out", rep_1)]).unwrap_err().to_string();
            assert!(said.contains("rep.out and in ") && said.contains("rep_1.out"), "{said}");
            assert!(said.contains("remove the outdated file"), "{said}");
        }
        let other_steps = file("drag", "2 1 0.02\n");
        assert!(
            drag(&[("rep.out", &old), ("coarse.out", &other_steps)]).is_ok(),
            "the same run, other steps"
        );
        let restart = file("drag", "2 2 0.02\n3 2 0.03\n");
        let joined = drag(&[("rep.out", &old), ("rep_1_2.out", &restart)]).unwrap();
        assert_eq!(joined, [[1.0], [2.0], [2.0]], "a restart one step after the start");
    }

    #[test]
    fn a_later_run_that_begins_earlier_than_the_run_before_it_is_refused() {
        let run = |value: i32, steps: std::ops::Range<i32>| {
            file("drag", &steps.map(|step| format!("{step} {value} 0.{step}\n")).collect::<String>())
        };
        let first = ("rep.out", &*run(1, 1..5));
        let (third, fifth) = (run(3, 3..9), run(5, 5..9));
        let in_order = drag(&[first, ("rep_1.out", &third), ("rep_2.out", &fifth)]).unwrap();
        assert_eq!(in_order.last(), Some(&[5.0]));
        let said = drag(&[first, ("rep_1.out", &fifth), ("rep_2.out", &third)]).unwrap_err().to_string();
        assert!(said.contains("rep_1.out and in ") && said.contains("rep_2.out"), "{said}");
    }

    #[test]
    fn what_is_no_report_is_passed_over_by_name() {
        let folder = tempfile::TempDir::new().unwrap();
        let residuals = "\"res\"\n\"Iteration\" \"residuals\"\n(\"Iteration\" \"continuity\")\n1 1e-3\n";
        let good = file("drag", "1 1 0.1\n");
        let damaged = file("lift", "1 1\n2 2 0.2\n");
        for (name, text) in [
            ("rep.out", &*good),
            ("slurm-12345.out", "starting job\n"),
            ("residuals.out", residuals),
            ("lift.out", &*damaged),
            ("empty.out", ""),
        ] {
            fs::write(folder.path().join(name), text).unwrap();
        }
        let reports = Reports::read(folder.path(), CutOff::Refuse).unwrap();
        assert_eq!(reports.column("drag").unwrap().0.values(), [[1.0]]);
        let passed_over: Vec<_> = reports.passed_over().filter_map(Path::file_name).collect();
        assert_eq!(passed_over, ["empty.out", "lift.out", "residuals.out", "slurm-12345.out"]);
        for (column, expected) in [
            ("lift", "lift.out, line 4: 2 numbers can be read where there must be 3"),
            ("continuity", "residuals.out: no column flow-time: add it"),
        ] {
            let said = reports.column(column).unwrap_err().to_string();
            assert!(said.contains(expected), "what is asked for is not passed over: {said}");
        }
    }

    #[test]
    fn a_later_run_that_lost_its_header_or_is_compressed_is_not_passed_over() {
        let good = file("drag", "1 1 0.1\n");
        let said = drag(&[("rep.out", &good), ("rep_1.out", "2 2 0.2\n")]).unwrap_err().to_string();
        assert!(said.contains("rep_1.out, line 1: before the first row there must be one line"), "{said}");
        let said = drag(&[("rep.out", &good), ("rep_1.out.gz", "")]).unwrap_err().to_string();
        assert!(said.contains("rep_1.out.gz is compressed") && said.contains("gunzip"), "{said}");
    }

    #[test]
    fn a_number_that_is_not_finite_counts_only_in_its_column() {
        let text = "\"rfile\"\n(\"Time Step\" \"drag\" \"lift\" \"flow-time\")\n1 5 1 0.1\n2 6 nan 0.2\n";
        let found = reports(&[text]).unwrap();
        assert_eq!(found.column("drag").unwrap().0.values(), [[5.0], [6.0]]);
        let said = found.column("lift").unwrap_err().to_string();
        assert!(said.contains("a.out, line 4, number 3: NaN is not finite"), "{said}");
        let without_time = reports(&[&text.replace("0.2", "nan")]).unwrap();
        assert!(without_time.column("drag").is_err(), "a row without its time");
    }

    #[test]
    fn what_is_no_report_is_refused() {
        assert!(matches!(reports(&[]), Err(FluentError::NoFile { .. })));
        assert!(matches!(reports(&["1 2 3\n"]), Err(FluentError::NoFile { .. })));
        let fault = |text: &str| match reports(&[text]).unwrap().column("drag").map(|(history, _)| history) {
            Err(FluentError::File { fault, .. }) => fault,
            other => panic!("{other:?}"),
        };
        assert!(matches!(fault(&file("drag", "")), FileFault::History(HistoryError::Empty)));
        let changed = format!("{}(\"Time Step\" \"lift\" \"flow-time\")\n", file("drag", "1 1 0.1\n"));
        assert!(matches!(fault(&changed), FileFault::Header { line: 5 }));
    }
}
