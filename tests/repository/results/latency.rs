//! Latency: soaks, queries in process, round trips.

use std::collections::HashMap;

use serde_json::Value;

use super::{csv, digits, json, markdown, newest, number, word, wrapped};

/// Transports of the soak, as its files name them, and what people call them.
const TRANSPORTS: [(&str, &str); 6] = [
    ("shm-spin", "shared memory, polling"),
    ("shm-block", "shared memory, sleeping"),
    ("grpc-stream", "gRPC stream, TCP"),
    ("grpc", "gRPC unary, TCP"),
    ("uds-stream", "gRPC stream, Unix socket"),
    ("uds", "gRPC unary, Unix socket"),
];

/// Those of README: shared memory, and gRPC in both forms.
const SUMMARY: [usize; 3] = [0, 2, 3];

const PERCENTILES: [&str; 4] = ["p50", "p95", "p99", "p99_9"];

fn soak_of(transport: &str) -> Value {
    json(newest(&format!("soak-{transport}.json")))
}

fn percentiles(soak: &Value, field: &str) -> Vec<String> {
    PERCENTILES.iter().map(|name| digits(number(&soak[field][name]))).collect()
}

fn machine(soak: &Value) -> String {
    let machine = &soak["machine"];
    format!("{} ({} cores)", word(&machine["cpu"]), machine["cores"])
}

/// README's one table of speed and accuracy.
pub fn summary() -> String {
    let mut rows = Vec::new();
    let mut runs = Vec::new();
    let (mut sent, mut failed) = (0.0, 0.0);
    for (transport, name) in SUMMARY.map(|index| TRANSPORTS[index]) {
        let soak = soak_of(transport);
        for (title, field) in [
            (format!("{name} [us]"), "response_time_us"),
            ("its control: lateness of a sleeping thread [us]".to_owned(), "control_us"),
        ] {
            rows.push([vec![title], percentiles(&soak, field)].concat());
        }
        sent += number(&soak["sent"]);
        failed += number(&soak["errors"]) + number(&soak["lost"]);
        runs.push(format!("commit {}, {}", word(&soak["commit"]), machine(&soak)));
    }
    let (comments, queries) = csv(newest("query.csv"));
    let query =
        queries.iter().find(|row| row["subject"] == "husky query avx512").expect("the query is measured");
    let cell = |name| cell(query, name);
    let title = "one query in process, AVX-512 [us]".to_owned();
    rows.push(vec![title, cell("p50_us"), String::new(), cell("p99_us"), cell("p99_9_us")]);
    rows.extend(super::accuracy::summary());
    runs.dedup();
    let table = markdown(
        &["300 s at 1 kHz, Husky, server and client on a core each", "p50", "p95", "p99", "p99.9"],
        rows,
    );
    let condition = wrapped(&format!(
        "Runs: {}; {failed} of {sent} queries failed, each timed from when it was due. Query: {}. \
         MAE: mean absolute error against CFD.",
        runs.join("; "),
        condition(&comments)
    ));
    format!("{table}\n{condition}\n")
}

pub fn soak() -> String {
    let header = [
        "transport",
        "quantity [us]",
        "p50",
        "p95",
        "p99",
        "p99.9",
        "max",
        "errors, lost of sent",
        "machine",
        "commit",
    ];
    let mut rows = Vec::new();
    for (transport, name) in TRANSPORTS {
        let soak = soak_of(transport);
        for (title, field) in
            [("response", "response_time_us"), ("service", "service_time_us"), ("control", "control_us")]
        {
            let counts = format!("{}, {} of {}", soak["errors"], soak["lost"], soak["sent"]);
            rows.push(
                [
                    vec![name.to_owned(), title.to_owned()],
                    percentiles(&soak, field),
                    vec![digits(number(&soak[field]["max"])), counts, machine(&soak)],
                    vec![format!("`{}`", word(&soak["commit"]))],
                ]
                .concat(),
            );
        }
    }
    markdown(&header, rows)
}

/// Machine and commit of the first comment of a bench, without its time stamp.
fn condition(comments: &str) -> String {
    let first = comments.lines().next().unwrap_or_default();
    let parts: Vec<&str> = first.trim_start_matches("# ").split(", ").take(3).collect();
    parts.join(", ")
}

fn cell(row: &HashMap<String, String>, name: &str) -> String {
    row.get(name).and_then(|value| value.parse().ok()).map(digits).unwrap_or_default()
}

fn bench(file: &str, columns: [&str; 5]) -> String {
    let (comments, rows) = csv(newest(file));
    let rows = rows.iter().map(|row| {
        let cells = columns[1..].iter().map(|name| cell(row, name));
        std::iter::once(row[columns[0]].clone()).chain(cells).collect()
    });
    let table = markdown(&["subject", "p50 [us]", "p99 [us]", "p99.9 [us]", "max [us]"], rows.collect());
    format!("Condition: {}.\n\n{table}", condition(&comments))
}

pub fn query() -> String {
    bench("query.csv", ["subject", "p50_us", "p99_us", "p99_9_us", "max_us"])
}

/// Queries with derivatives, each beside the same query without.
pub fn derivatives() -> String {
    let (comments, rows) = csv(newest("derivatives.csv"));
    let plain =
        |subject: &str| rows.iter().find(|row| row["subject"] == subject).expect("measured in the same run");
    let with = rows.iter().filter(|row| row["subject"].contains(" with derivatives")).map(|row| {
        let plain = plain(&row["subject"].replace(" with derivatives", ""));
        let median = |row: &HashMap<String, String>| row["p50_us"].parse::<f64>().expect("a number");
        let cells = ["p50_us", "p99_us"].into_iter().flat_map(|name| [cell(plain, name), cell(row, name)]);
        let cells: Vec<String> = cells.collect();
        [vec![plain["subject"].clone()], cells, vec![format!("{:.1}", median(row) / median(plain))]].concat()
    });
    let header =
        ["query", "p50 [us]", "with derivatives", "p99 [us]", "with derivatives", "ratio of the p50"];
    format!("Condition: {}.\n\n{}", condition(&comments), markdown(&header, with.collect()))
}

/// Error of the base's drag against the time of an evaluation, by the number of elements.
pub fn elements() -> String {
    let (comments, rows) = csv(newest("elements.csv"));
    let columns = ["vehicle", "elements", "evaluated", "us", "force", "force_p90", "moment", "moment_p90"];
    let rows = rows.iter().map(|row| columns.map(|name| row[name].clone()).to_vec());
    let header = [
        "vehicle",
        "elements",
        "with padding",
        "time [us]",
        "force error, median",
        "90 %",
        "moment error, median",
        "90 %",
    ];
    format!("Condition: {}.\n\n{}", condition(&comments), markdown(&header, rows.collect()))
}

pub fn round_trips() -> String {
    bench("latency.csv", ["subject", "p50_us", "p99_us", "p99_9_us", "max_us"])
}

/// A stream beside a bad neighbour, and beside one who asks another port.
pub fn storms() -> String {
    let (comments, rows) = csv(newest("storms.csv"));
    let columns = ["attacker_percent", "p50_us", "p99_us", "control_p99_us", "probes_p99_us"];
    let rows = rows.iter().map(|row| {
        let cells = columns.map(|name| row[name].clone());
        std::iter::once(row["subject"].clone()).chain(cells).collect()
    });
    let header =
        ["storm", "attacker [% of a core]", "p50 [us]", "p99 [us]", "control p99 [us]", "probes p99 [us]"];
    format!("Condition: {}.\n\n{}", condition(&comments), markdown(&header, rows.collect()))
}

pub fn python() -> String {
    let result = json(newest("python.json"));
    let machine = &result["machine"];
    let rows = result["results"].as_object().expect("rows").iter().map(|(name, row)| {
        let times = ["p50_us", "p95_us", "p99_us"].map(|field| digits(number(&row[field])));
        [vec![name.clone()], times.to_vec()].concat()
    });
    let table = markdown(&["Python client to", "p50 [us]", "p95 [us]", "p99 [us]"], rows.collect());
    let commit = &word(&machine["commit"])[..12];
    format!("Condition: commit {commit}, {}, {} cores.\n\n{table}", word(&machine["cpu"]), machine["cores"])
}

/// One epoch of the paper's training, `wade train` beside PyTorch: medians of five.
pub fn epoch() -> String {
    let result = json(newest("epoch.json"));
    let rows = result["seconds_an_epoch"].as_object().expect("rows").iter().map(|(name, seconds)| {
        let mut seconds: Vec<f64> = seconds.as_array().expect("a list").iter().map(number).collect();
        seconds.sort_by(f64::total_cmp);
        vec![name.clone(), digits(seconds[seconds.len() / 2])]
    });
    let table = markdown(&["program", "one epoch, median [s]"], rows.collect());
    format!(
        "Condition: {}, {}, torch {}.\n\n{table}",
        word(&result["wade"]),
        word(&result["machine"]),
        word(&result["torch"])
    )
}
