//! Long runs: what memory and descriptors did, and the tails beside their control.

use serde_json::Value;

use super::{digits, markdown, newest, number, word};
use crate::text;

/// A server fills what it keeps in the first of these minutes.
const WARM_UP: usize = 10;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// One row a run: the minutes of `minutes.csv`.
pub fn memory() -> String {
    let table = text(newest("minutes.csv"));
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().expect("a header");
    let rows: Vec<Vec<f64>> =
        lines.map(|row| row.iter().map(|cell| cell.parse().expect("a number")).collect()).collect();
    let column = |name: &str| names.iter().position(|found| *found == name).expect("a column");
    let [run, resident, descriptors, reloads, killed] =
        ["run", "resident_kib", "descriptors", "reloads", "killed"].map(column);
    let runs: std::collections::BTreeSet<u64> = rows.iter().map(|row| row[run] as u64).collect();
    let shown = runs.into_iter().map(|number| {
        let of: Vec<_> = rows.iter().filter(|row| row[run] as u64 == number).collect();
        let mean = |part: &[&Vec<f64>], column: usize| {
            part.iter().map(|row| row[column]).sum::<f64>() / part.len() as f64
        };
        let settled = &of[WARM_UP.min(of.len() - 1)..];
        let thirds = [0, 1, 2].map(|i| &settled[settled.len() * i / 3..settled.len() * (i + 1) / 3]);
        let megabytes = thirds.map(|third| digits(mean(third, resident) * 1024.0 / 1e6)).join(" / ");
        let files = thirds.map(|third| digits(mean(third, descriptors))).join(" / ");
        let last = of.last().expect("a minute");
        vec![
            number.to_string(),
            of.len().to_string(),
            last[reloads].to_string(),
            last[killed].to_string(),
            megabytes,
            files,
        ]
    });
    let header = ["run", "minutes", "reloads", "clients killed", "resident [MB]", "descriptors"];
    markdown(&header, shown.collect())
}

/// One row a transport: the reports of `pieces.jsonl`.
pub fn tails() -> String {
    let lines = text(newest("pieces.jsonl"));
    let reports: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let rows = ["shm-block", "grpc-stream"].map(|transport| {
        let of: Vec<_> = reports.iter().filter(|report| word(&report["transport"]) == transport).collect();
        let sum = |names: &[&str]| of.iter().flat_map(|r| names.iter().map(|n| number(&r[*n]))).sum::<f64>();
        let middle =
            |kind: &str, name: &str| digits(median(of.iter().map(|r| number(&r[kind][name])).collect()));
        let numbers = |kind: &str| ["p50", "p99", "p99_9", "max"].map(|name| middle(kind, name)).join(" / ");
        vec![
            transport.to_owned(),
            of.len().to_string(),
            sum(&["answered"]).to_string(),
            sum(&["errors", "lost", "unsent"]).to_string(),
            numbers("response_time_us"),
            numbers("control_us"),
        ]
    });
    let header = ["transport", "reports", "answered", "failed", "response [us]", "control [us]"];
    markdown(&header, rows.into())
}
