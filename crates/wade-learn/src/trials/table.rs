//! A CSV file of numbers by column.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::trial::BED;
use super::{Fault, TrialError};
use wade_core::at::At;
use wade_core::condition::bed_from_word;

/// The numbers of a CSV file, every one finite, with the rows they stand in.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The file.
    pub path: PathBuf,
    /// Line of the file of each row, for messages.
    pub rows: Vec<u64>,
    /// The columns that were asked for and are there.
    pub columns: BTreeMap<String, Vec<f64>>,
    /// The columns that nobody asked for.
    pub unknown_columns: Vec<String>,
    /// What a column `vehicle` says, the only one that holds no numbers; empty without one.
    pub vehicles: Vec<String>,
}

/// The column that names the vehicle.
const VEHICLE: &str = "vehicle";

impl Table {
    /// Reads the columns of a file by name; lines that start with # are comments.
    pub fn read(path: &Path, required: &[&str], optional: &[&str]) -> Result<Self, TrialError> {
        Self::read_columns(path, required, optional).map_err(At::path(path))
    }

    fn read_columns(path: &Path, required: &[&str], optional: &[&str]) -> Result<Self, Fault> {
        let file = std::fs::File::open(path)?;
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(file);
        let headers = reader.headers()?.clone();
        if headers.is_empty() {
            return Err(Fault::Empty);
        }
        check_names(&headers, required)?;
        let known = |name: &str| required.contains(&name) || optional.contains(&name);
        let vehicle = headers.iter().position(|name| name == VEHICLE);
        let mut vehicles = Vec::new();
        let (used, unknown): (Vec<_>, Vec<_>) = headers.iter().enumerate().partition(|(_, n)| known(n));
        let mut values: Vec<Vec<f64>> = vec![Vec::new(); used.len()];
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record?;
            let row = record.position().map_or(0, csv::Position::line);
            for ((index, name), values) in used.iter().zip(&mut values) {
                values.push(number(row, name, &record[*index])?);
            }
            vehicles.extend(vehicle.map(|index| record[index].to_owned()));
            rows.push(row);
        }
        let columns = used.into_iter().map(|(_, name)| name.to_owned()).zip(values).collect();
        let unknown = unknown.into_iter().map(|(_, name)| name.to_owned());
        let unknown_columns = unknown.filter(|name| name != VEHICLE).collect();
        Ok(Self { path: path.to_owned(), rows, columns, unknown_columns, vehicles })
    }

    /// A column; empty where the file has none of that name.
    pub fn column(&self, name: &str) -> &[f64] {
        self.columns.get(name).map(Vec::as_slice).unwrap_or_default()
    }

    /// True where the file has the column.
    pub fn has(&self, name: &str) -> bool {
        self.columns.contains_key(name)
    }

    /// Takes out rows by their places.
    pub(super) fn leave_out(&mut self, places: &[usize]) {
        let stays = |at: usize| !places.contains(&at);
        let mut at = 0..;
        self.rows.retain(|_| at.next().is_none_or(stays));
        for values in self.columns.values_mut() {
            let mut at = 0..;
            values.retain(|_| at.next().is_none_or(stays));
        }
    }

    /// Refuses a table with fewer rows, or whose column `t` does not increase from row to row.
    pub fn check_time(&self, least: usize) -> Result<(), TrialError> {
        let t = self.column("t");
        if t.len() < least {
            return Err(At::path(&self.path)(Fault::TooShort { rows: t.len(), least }));
        }
        match (1..t.len()).find(|&row| t[row] <= t[row - 1]) {
            Some(row) => {
                Err(At::path(&self.path)(Fault::Time { row: self.rows[row], t: t[row], before: t[row - 1] }))
            }
            None => Ok(()),
        }
    }

    /// The fault of having no such column.
    pub(super) fn missing(&self, column: &str) -> TrialError {
        At::path(&self.path)(Fault::MissingColumn { column: column.into(), present: self.present() })
    }

    /// The columns of the file, for messages.
    pub(super) fn present(&self) -> String {
        self.columns.keys().chain(&self.unknown_columns).cloned().collect::<Vec<_>>().join(", ")
    }
}

fn check_names(headers: &csv::StringRecord, required: &[&str]) -> Result<(), Fault> {
    let names: Vec<&str> = headers.iter().collect();
    for (index, name) in names.iter().enumerate() {
        if let Some(first) = names[..index].iter().position(|before| before == name) {
            let (first, second) = (first + 1, index + 1);
            return Err(Fault::DuplicateColumn { column: (*name).into(), first, second });
        }
    }
    match required.iter().find(|name| !names.contains(name)) {
        Some(column) => Err(Fault::MissingColumn { column: (*column).into(), present: names.join(", ") }),
        None => Ok(()),
    }
}

fn number(row: u64, column: &str, text: &str) -> Result<f64, Fault> {
    let word = (column == BED).then(|| bed_from_word(text)).flatten();
    let parsed = word.or_else(|| text.parse::<f64>().ok()).filter(|value| value.is_finite());
    parsed.ok_or_else(|| Fault::NotANumber { row, column: column.into(), value: text.into() })
}

/// Columns of equal length as CSV, to seven decimals: a tenth of a micrometer.
pub fn csv_text(columns: &[(&str, &[f64])]) -> String {
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let mut text = names.join(",") + "\n";
    for row in 0..columns.first().map_or(0, |(_, values)| values.len()) {
        for (index, (_, values)) in columns.iter().enumerate() {
            let separator = if index == 0 { "" } else { "," };
            let _ = write!(text, "{separator}{}", (values[row] * 1e7).round() / 1e7);
        }
        text.push('\n');
    }
    text
}
