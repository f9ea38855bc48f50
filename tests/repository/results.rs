//! Tables of figures are written from raw results, between `<!-- results: NAME -->` and `<!-- end -->` of README.md and the
//! pages in docs/src/results, and the tables of effects from what the effects say of themselves.
//! `WADE_WRITE=1 cargo test --test repository results` (`just results`) writes them; without it the test compares.

mod accuracy;
mod cfd;
mod effects;
mod gap;
mod latency;
mod remote;
mod robustness;

use std::path::PathBuf;

use serde_json::Value;

use super::{root, text};

/// Largest raw result in benches/results [bytes]: what is larger belongs beside a release, not in the tree.
const LARGEST_RAW: u64 = 50_000;

const BEGIN: &str = "<!-- results: ";
const END: &str = "<!-- end -->";

/// A table by its name.
fn table(name: &str) -> String {
    match name {
        "summary" => latency::summary(),
        "soak" => latency::soak(),
        "query" => latency::query(),
        "derivatives" => latency::derivatives(),
        "round trips" => latency::round_trips(),
        "storms" => latency::storms(),
        "elements" => latency::elements(),
        "python" => latency::python(),
        "epoch" => latency::epoch(),
        "long memory" => robustness::memory(),
        "long tails" => robustness::tails(),
        "relay" => remote::relay(),
        "remote use" => remote::steady(),
        "remote cuts" => remote::cuts(),
        "forces" => accuracy::forces(),
        "moments" => accuracy::moments(),
        "surfaces" => accuracy::surfaces(),
        "splits" => accuracy::splits(),
        "ablations" => accuracy::ablations(),
        "physics" => accuracy::physics(),
        "cases" => cfd::cases(),
        "rest" => cfd::rest(),
        "meshes" => cfd::meshes(),
        "driving" => cfd::driving(),
        "benchmark" => gap::benchmark(),
        "baselines" => gap::baselines(),
        "bundles" => gap::bundles(),
        "motion" => gap::motion(),
        "ramps" => gap::ramps(),
        "floods" => accuracy::floods(),
        "physical effects" => effects::physics(),
        "totals" => effects::totals(),
        "faults" => effects::faults(),
        "separating trials" => effects::experiments(),
        _ => panic!("no table is called {name}"),
    }
}

/// The page with its tables written, and their number.
fn rendered(page: &str) -> (String, usize) {
    let mut parts = page.split(BEGIN);
    let mut out = parts.next().unwrap_or_default().to_owned();
    let mut count = 0;
    for part in parts {
        let (name, rest) = part.split_once(" -->").expect("the marker ends");
        let (_, after) = rest.split_once(END).unwrap_or_else(|| panic!("{name} has no end"));
        out += &format!("{BEGIN}{name} -->\n\n{}\n\n{END}{after}", table(name).trim_end());
        count += 1;
    }
    (out, count)
}

#[test]
fn pages_hold_what_the_raw_results_say() {
    let mut pages = ["README.md", "docs/src/concepts/effects.md"].map(PathBuf::from).to_vec();
    let folder = std::fs::read_dir(root().join("docs/src/results")).expect("readable");
    pages.extend(
        folder.map(|entry| PathBuf::from("docs/src/results").join(entry.expect("readable").file_name())),
    );
    for page in pages {
        let committed = text(&page);
        let (written, tables) = rendered(&committed);
        assert!(tables > 0, "{} has no table that is written", page.display());
        if std::env::var_os("WADE_WRITE").is_some() {
            std::fs::write(root().join(&page), &written).expect("written");
        } else {
            assert!(committed == written, "{} is not what the results say: just results", page.display());
        }
    }
}

#[test]
fn raw_results_are_small() {
    for file in raw() {
        let length = file.metadata().expect("readable").len();
        assert!(length <= LARGEST_RAW, "{}: {length} bytes", file.display());
    }
}

/// Every file below benches/results.
fn raw() -> Vec<PathBuf> {
    let files = |folder: PathBuf| -> Vec<PathBuf> {
        let entries =
            std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
        entries.map(|entry| entry.expect("readable").path()).collect()
    };
    let mut found: Vec<PathBuf> = files(root().join("benches/results"))
        .into_iter()
        .filter(|path| path.is_dir())
        .flat_map(files)
        .collect();
    found.sort();
    found
}

/// The newest raw result of this name: folders are called by date.
fn newest(name: &str) -> PathBuf {
    let found = raw().into_iter().rfind(|path| path.ends_with(name));
    found.unwrap_or_else(|| panic!("benches/results has no {name}"))
}

fn json(path: PathBuf) -> Value {
    serde_json::from_str(&text(&path)).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn word(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("{value} is no text"))
}

/// Three significant digits, as many as these measurements have.
fn digits(value: f64) -> String {
    let decimals = match value.abs() {
        size if size >= 99.95 => 0,
        size if size >= 9.995 => 1,
        size if size >= 0.9995 => 2,
        _ => 3,
    };
    format!("{value:.decimals$}")
}

/// The components of a list as cells: `1.12 / 2.19 / 5.94`.
fn triple(values: &Value) -> String {
    let values = values.as_array().expect("a list");
    values.iter().map(|value| digits(number(value))).collect::<Vec<_>>().join(" / ")
}

/// Prose in lines that end before the column at which prose ends here.
fn wrapped(prose: &str) -> String {
    let mut lines = vec![String::new()];
    for word in prose.split_whitespace() {
        let line = lines.last_mut().expect("never empty");
        if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > super::prose::COLUMNS {
            lines.push(word.to_owned());
        } else {
            let gap = if line.is_empty() { "" } else { " " };
            *line += &format!("{gap}{word}");
        }
    }
    lines.join("\n")
}

/// A table in Markdown.
fn markdown(header: &[&str], rows: Vec<Vec<String>>) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let names: Vec<String> = header.iter().map(|&name| name.to_owned()).collect();
    let rule = vec!["---".to_owned(); header.len()];
    let rows = rows.iter().map(|row| {
        assert_eq!(row.len(), header.len(), "{row:?}");
        line(row)
    });
    line(&names) + &line(&rule) + &rows.collect::<String>()
}

/// A table of comma-separated values: the comments above it, and its rows by column name.
fn csv(path: PathBuf) -> (String, Vec<std::collections::HashMap<String, String>>) {
    let text = text(&path);
    let comments = text.lines().filter(|line| line.starts_with('#')).collect::<Vec<_>>().join("\n");
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).flexible(true).from_reader(text.as_bytes());
    let rows =
        reader.deserialize().map(|row| row.unwrap_or_else(|error| panic!("{}: {error}", path.display())));
    let rows = rows.collect();
    (comments, rows)
}
