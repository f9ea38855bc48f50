//! Remote use: age and error of what a client gives behind a network, and recovery after a cut.

use serde_json::Value;

use super::{digits, json, markdown, newest, number, word};

/// What the page shows of steady use: client, steps a second, budget [us].
const USES: [(&str, u64, u64); 4] =
    [("C client", 1000, 300), ("C client", 60, 5000), ("Unreal core", 60, 300), ("Unreal core", 60, 5000)];

/// Least share of the steps whose status is shown [%].
const SHOWN_PERCENT: f64 = 1.0;

fn result() -> Value {
    json(newest("remote.json"))
}

fn rows<'a>(result: &'a Value, name: &str) -> impl Iterator<Item = &'a Value> {
    result[name].as_array().expect("rows").iter()
}

/// `median / 95th percentile / maximum`
fn numbers(value: &Value) -> String {
    if value.is_null() {
        return String::new();
    }
    ["p50", "p95", "max"].map(|name| digits(number(&value[name]))).join(" / ")
}

fn network(row: &Value) -> String {
    if row["added_ms"].is_null() { "no relay".to_owned() } else { row["added_ms"].to_string() }
}

fn condition(result: &Value) -> String {
    let machine = &result["machine"];
    format!("Condition: {}, {}, {} cores.", word(&machine["server"]), word(&machine["cpu"]), machine["cores"])
}

/// Shares of the steps by status, the largest first.
fn shares(row: &Value) -> String {
    let steps = number(&row["steps"]);
    let counts = row["status"].as_object().expect("counts");
    let mut shares: Vec<(f64, &str)> =
        counts.iter().map(|(name, count)| (100.0 * number(count) / steps, name.as_str())).collect();
    shares.sort_by(|a, b| b.0.total_cmp(&a.0));
    shares.retain(|(share, _)| *share >= SHOWN_PERCENT);
    shares.iter().map(|(share, name)| format!("{name} {share:.0} %")).collect::<Vec<_>>().join(", ")
}

fn use_of(row: &Value) -> (&str, u64, u64) {
    let whole = |name: &str| row[name].as_u64().expect("a whole number");
    (word(&row["client"]), whole("rate_hz"), whole("budget_us"))
}

fn named(row: &Value) -> String {
    let (client, rate, budget) = use_of(row);
    format!("{client}, {rate} Hz, {} ms", budget as f64 * 1e-3)
}

/// What the relay adds by measurement.
pub fn relay() -> String {
    let result = result();
    let rows = rows(&result, "relay").map(|row| {
        vec![
            row["stated_ms"].to_string(),
            digits(number(&row["added_p50_ms"])),
            numbers(&row["direct_ms"]),
            numbers(&row["through_ms"]),
        ]
    });
    let header = [
        "stated [ms]",
        "measured, difference of the medians [ms]",
        "round trip without the relay, p50 / p95 / max [ms]",
        "through the relay [ms]",
    ];
    format!("{}\n\n{}", condition(&result), markdown(&header, rows.collect()))
}

/// Steady use, with the recovery after a cut where one was measured.
pub fn steady() -> String {
    let result = result();
    let weight = number(&result["weight_n"]);
    let shown = rows(&result, "steady").filter(|row| USES.contains(&use_of(row)));
    let table = shown.map(|row| {
        let cut = rows(&result, "cuts")
            .find(|cut| use_of(cut) == use_of(row) && cut["added_ms"] == row["added_ms"]);
        let recovery = cut.map_or_else(String::new, |cut| {
            let times = &cut["recovery_ms"];
            format!("{} / {}", digits(number(&times["p50"])), digits(number(&times["max"])))
        });
        vec![
            named(row),
            network(row),
            shares(row),
            numbers(&row["age_ms"]),
            numbers(&row["vertical_n"]),
            format!("{:.1}", 100.0 * number(&row["vertical_n"]["p95"]) / weight),
            numbers(&row["horizontal_n"]),
            recovery,
        ]
    });
    let header = [
        "client, steps, budget",
        "added [ms]",
        "status, or link state",
        "age, p50 / p95 / max [ms]",
        "vertical error [N]",
        "its p95 [% of weight]",
        "horizontal error [N]",
        "recovery, p50 / max [ms]",
    ];
    format!("{}\n\n{}", condition(&result), markdown(&header, table.collect()))
}

/// What a client gives while it is cut off.
pub fn cuts() -> String {
    let result = result();
    let table = rows(&result, "cuts").map(|row| {
        let shown = row["shown"].as_object().expect("times");
        let shown =
            shown.iter().filter(|(event, _)| event.starts_with("cut to ") || event.ends_with("Serving"));
        let shown = shown.map(|(event, times)| format!("{event} {}", digits(number(&times["ms"]["p50"]))));
        let during = &row["during"];
        vec![
            named(row),
            network(row),
            format!("{} of {}", row["found_again"], row["cuts"]),
            shares(during),
            digits(number(&row["age_at_end_ms"]["max"])),
            numbers(&during["vertical_n"]),
            numbers(&during["horizontal_n"]),
            shown.collect::<Vec<_>>().join(", "),
        ]
    });
    let header = [
        "client, steps, budget",
        "added [ms]",
        "found again",
        "status, or link state",
        "age at the end, max [ms]",
        "vertical error, p50 / p95 / max [N]",
        "horizontal error [N]",
        "first shown after, p50 [ms]",
    ];
    markdown(&header, table.collect())
}
