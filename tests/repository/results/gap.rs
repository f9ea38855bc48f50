//! The gap workflow: the benchmark, plain regressions beside it, motion alone, computed ramps.

use serde_json::Value;

use super::{csv, json, markdown, newest, number, root, word, wrapped};

/// Measures of the benchmark whose names say more plainly what they are.
const NAMES: [(&str, &str); 8] = [
    ("nulls in which any effect is named", "cases without a hidden effect in which one is named"),
    ("right name, one effect, 3 x the floor", "one effect, three times the noise: right name"),
    ("right name, one effect, 1 x the floor", "one effect, as large as the noise: right name"),
    ("right name, one effect, 0.3 x the floor", "one effect, 0.3 times the noise: right name"),
    ("the same after a trial that tells: right name", "the same after the proposed trial: right name"),
    ("not excited: said so", "effect not excited: reported as such"),
    ("parameter error, median, 3 x the floor", "parameter error, median, three times the noise"),
    ("parameter error, median, 1 x the floor", "parameter error, median, as large as the noise"),
];

fn called(measure: &str) -> String {
    NAMES.iter().find(|(from, _)| *from == measure).map_or(measure, |(_, to)| to).to_owned()
}

fn condition(result: &Value) -> String {
    wrapped(&format!(
        "Command `{}`, commit `{}`, {}; {}. All trials are generated.",
        word(&result["command"]),
        word(&result["commit"]),
        word(&result["date"]),
        word(&result["machine"])
    ))
}

fn with_interval(value: &Value) -> String {
    match value["interval"].as_array() {
        Some(interval) => {
            let [low, high] = [0, 1].map(|index: usize| number(&interval[index]));
            format!("{:.3} ({low:.2} to {high:.2})", number(&value["value"]))
        }
        None => format!("{:.3}", number(&value["value"])),
    }
}

fn target(reach: &Value) -> String {
    let bound = |name: &str, sign: &str| reach[name].as_f64().map(|value| format!("{sign} {value}"));
    let within = || {
        let ends: Vec<f64> = reach["within"].as_array()?.iter().map(number).collect();
        Some(format!("{} to {}", ends[0], ends[1]))
    };
    bound("at_most", "<=").or_else(|| bound("at_least", ">=")).or_else(within).unwrap_or_default()
}

/// The whole benchmark. Rows that the later run of single effects and sets gives again stand in that table alone.
pub fn benchmark() -> String {
    let singles = json(newest("gap-bench-singles.json"));
    let again: Vec<&Value> =
        singles["measures"].as_array().expect("a list").iter().map(|row| &row["measure"]).collect();
    let mut whole = json(newest("gap-bench.json"));
    whole["measures"].as_array_mut().expect("a list").retain(|row| !again.contains(&&row["measure"]));
    format!("{}\n{}", measures(&whole), measures(&singles))
}

fn measures(result: &Value) -> String {
    let rows = result["measures"].as_array().expect("a list").iter().map(|measure| {
        let holds = match measure["holds"].as_bool() {
            Some(true) => "yes",
            Some(false) => "**no**",
            None => "",
        };
        vec![
            called(word(&measure["measure"])),
            target(&measure["reach"]),
            with_interval(measure),
            measure["count"].to_string(),
            holds.to_owned(),
        ]
    });
    let header = ["measure", "target", "value (90 % interval)", "count", "met"];
    format!("{}\n\n{}", condition(result), markdown(&header, rows.collect()))
}

const TOOLS: [&str; 5] = ["wade gap", "LASSO", "best R2", "stepwise BIC", "thresholded sparse"];

pub fn baselines() -> String {
    let mut out = String::new();
    let folder = root().join("benches/results");
    // two runs: the families of each are in its command
    for date in ["2026-11-24", "2026-11-25"] {
        let result = json(folder.join(date).join("gap-bench-baselines.json"));
        let rows = result["measures"].as_array().expect("a list").iter().map(|measure| {
            let values = TOOLS.map(|tool| format!("{:.3}", number(&measure["values"][tool]["value"])));
            let target = measure["target"].as_str().unwrap_or_default().to_owned();
            [vec![called(word(&measure["measure"])), target], values.to_vec()].concat()
        });
        let header = [&["measure", "target"], &TOOLS[..]].concat();
        out += &format!("{}\n\n{}\n", condition(&result), markdown(&header, rows.collect()));
    }
    out
}

/// The benchmark on the shipped bundles; measures of which there is no case are left out.
pub fn bundles() -> String {
    let of = |vehicle: &str| measures(&json(newest(&format!("gap-bench-{vehicle}.json"))));
    format!("{}\n{}", of("warthog"), of("husky"))
}

/// Driven vehicles whose wrench is inferred from their motion: first what has a target, then each group of cases in a row.
pub fn motion() -> String {
    let result = json(newest("gap-bench-motion.json"));
    let all = result["measures"].as_array().expect("a list");
    let grade = |group: &str, grade: &str| {
        all.iter()
            .find(|row| word(&row["measure"]) == format!("{group}: {grade}"))
            .expect("each has all three")
    };
    let groups = all.iter().filter_map(|row| word(&row["measure"]).strip_suffix(": right"));
    let groups = groups.map(|group| {
        let right = grade(group, "right");
        let others =
            ["abstained", "wrong"].map(|other| format!("{:.3}", number(&grade(group, other)["value"])));
        let [abstained, wrong] = others;
        vec![group.to_owned(), with_interval(right), abstained, wrong, right["count"].to_string()]
    });
    let header = ["group", "right (90 % interval)", "abstained", "wrong", "count"];
    let groups = markdown(&header, groups.collect());
    let graded = |row: &Value| {
        ["right", "abstained", "wrong"]
            .iter()
            .any(|grade| word(&row["measure"]).ends_with(&format!(": {grade}")))
    };
    let mut judged = result.clone();
    judged["measures"].as_array_mut().expect("a list").retain(|row| !graded(row));
    format!("{}\n{groups}", measures(&judged))
}

/// What the workflow makes of computed ramps, by the trials that were held out.
pub fn ramps() -> String {
    let (comments, rows) = csv(root().join("campaigns/ramps-gap.csv"));
    let columns = [
        "vehicle",
        "seed",
        "verdict",
        "named",
        "before_x_n",
        "after_x_n",
        "before_y_n",
        "after_y_n",
        "explained_percent",
    ];
    let rows = rows.iter().map(|row| columns.map(|column| row[column].clone()).to_vec());
    let header = [
        "vehicle",
        "seed",
        "verdict",
        "named",
        "x before [N]",
        "x after [N]",
        "y before [N]",
        "y after [N]",
        "explained [%]",
    ];
    let condition = comments.replace("# ", "").replace('\n', ".\n");
    format!("```text\n{condition}\n```\n\n{}", markdown(&header, rows.collect()))
}
