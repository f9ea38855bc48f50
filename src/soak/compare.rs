//! Two reports side by side.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::Value;

/// What must be the same for two runs to be comparable, by its name in `soak.json`.
const SETTINGS: [&str; 9] = [
    "vehicle",
    "transport",
    "input",
    "batch",
    "clients",
    "target_rate_hz",
    "duration_s",
    "interrupted",
    "machine",
];
/// Distributions that are compared.
const TIMES: [(&str, &str); 3] = [
    ("response_time_us", "response time"),
    ("service_time_us", "service time"),
    ("control_us", "control (the machine alone)"),
];
const POINTS: [&str; 5] = ["p50", "p95", "p99", "p99_9", "max"];
const COUNTS: [&str; 5] = ["rate_hz", "sent", "errors", "lost", "unsent"];

/// A report that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The file cannot be read.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is no report.
    #[error("{}: {source}", .path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
    /// The file lacks a figure.
    #[error("{} has no number {name}: it is no report of wade soak", .path.display())]
    Lacks {
        /// The file.
        path: PathBuf,
        /// The figure.
        name: String,
    },
}

/// Two runs.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// Settings in which the runs differ, with both values.
    pub differences: Vec<Difference>,
    /// The figures.
    pub figures: Vec<Figure>,
}

/// A setting in which two runs differ.
#[derive(Debug, Serialize)]
pub struct Difference {
    /// Its name in `soak.json`.
    pub setting: &'static str,
    /// Of the first run.
    pub before: Value,
    /// Of the second run.
    pub after: Value,
}

/// One figure of both runs.
#[derive(Debug, Serialize)]
pub struct Figure {
    /// What it is.
    pub name: String,
    /// Of the first run.
    pub before: f64,
    /// Of the second run.
    pub after: f64,
    /// Second over first; none where the first is 0.
    pub ratio: Option<f64>,
}

impl Comparison {
    /// Reads `soak.json` of both folders.
    pub fn read(before: &Path, after: &Path) -> Result<Self, CompareError> {
        let [first, second] = [Run::read(before)?, Run::read(after)?];
        let differs = |setting: &'static str| {
            let [before, after] = [&first, &second].map(|run| run.json[setting].clone());
            (before != after).then_some(Difference { setting, before, after })
        };
        let times = TIMES.into_iter().flat_map(|(key, name)| {
            POINTS
                .map(|point| (format!("/{key}/{point}"), format!("{name} {} [us]", point.replace('_', "."))))
        });
        let counts = COUNTS.map(|key| (format!("/{key}"), key.replace("_hz", " [Hz]")));
        let figure = |(place, name): (String, String)| {
            let (before, after) = (first.number(&place)?, second.number(&place)?);
            Ok(Figure { name, before, after, ratio: (before != 0.0).then(|| after / before) })
        };
        Ok(Self {
            differences: SETTINGS.into_iter().filter_map(differs).collect(),
            figures: times.chain(counts).map(figure).collect::<Result<_, CompareError>>()?,
        })
    }

    /// As a table for people.
    pub fn text(&self) -> String {
        let p99 = self.figures.iter().find(|figure| figure.name == "response time p99 [us]");
        let mut text = p99.and_then(|figure| figure.ratio).map_or_else(String::new, |ratio| {
            format!("p99 of the response time: {ratio:.2} times that of the first run\n")
        });
        for Difference { setting, before, after } in &self.differences {
            text += &format!("the runs differ in {setting}: {before} and {after}\n");
        }
        text += &format!("\n{:<38} {:>12} {:>12} {:>7}\n", "", "first", "second", "ratio");
        for Figure { name, before, after, ratio } in &self.figures {
            let ratio = ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.2}"));
            text += &format!("{name:<38} {before:>12.1} {after:>12.1} {ratio:>7}\n");
        }
        text
    }
}

struct Run {
    path: PathBuf,
    json: Value,
}

impl Run {
    fn read(folder: &Path) -> Result<Self, CompareError> {
        let path = folder.join("soak.json");
        let bytes = std::fs::read(&path).map_err(|source| CompareError::Io { path: path.clone(), source })?;
        let json = serde_json::from_slice(&bytes)
            .map_err(|source| CompareError::Json { path: path.clone(), source })?;
        Ok(Self { path, json })
    }

    fn number(&self, place: &str) -> Result<f64, CompareError> {
        let lacks = || CompareError::Lacks { path: self.path.clone(), name: place[1..].replace('/', ".") };
        self.json.pointer(place).and_then(Value::as_f64).ok_or_else(lacks)
    }
}
