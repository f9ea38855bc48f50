//! What `wade soak` promises to scripts and to people: the JSON names, the three files, the verdict.

use std::{cell::Cell, fs, time::Duration};

use serde_json::Value;
use wade::soak::{Config, Domain, Input, Rate, Report, SendError, report, run};

const DOMAIN: Domain =
    Domain { speed: [0.2, 1.5], angle: [0.0, 1.6], depth: [0.1, 0.4], density: [1000.0; 2] };

/// A short soak of a server that answers at once, except that it treats every tenth request as `fate` says.
fn soak(slo: &[&str], fate: Option<SendError>) -> Report {
    let config = Config {
        vehicle: "husky".into(),
        transport: "inproc".into(),
        rate: Rate::Hz(500.0),
        duration: Duration::from_millis(200),
        warm_up: Duration::from_millis(20),
        slo: slo.iter().map(|text| text.parse().expect(text)).collect(),
        ..Config::default()
    };
    let count = Cell::new(0);
    let mut send = |_: &[_]| {
        count.set(count.get() + 1);
        fate.clone().filter(|_| count.get() % 10 == 0).map_or(Ok(1000), Err)
    };
    run(&config, &Input::varying(&DOMAIN), &mut send, &|_| {})
}

fn json(report: &Report) -> Value {
    serde_json::to_value(report).expect("a report is JSON")
}

#[test]
fn the_json_has_the_names_that_scripts_rely_on() {
    let json = json(&soak(&["p99=1h", "p99.9=1h"], None));
    for times in ["response_time_us", "service_time_us", "send_lag_us", "control_us"] {
        for point in ["p50", "p95", "p99", "p99_9", "max"] {
            assert!(json[times][point].is_number(), "{times}.{point}");
        }
    }
    for count in ["rate_hz", "sent", "answered", "errors", "lost"] {
        assert!(json[count].is_number(), "{count}");
    }
    assert!(json["generator_late"].is_boolean());
    assert_eq!((&json["sent"], &json["answered"]), (&100.into(), &100.into()));
    for name in ["p99", "p99.9"] {
        assert_eq!(json["slo"][name]["holds"], true, "{name}");
    }
    assert_eq!(json["warm_up"]["sent"], 10);
}

#[test]
fn a_missed_objective_a_refusal_and_a_loss_each_fail_the_run() {
    let missed = soak(&["p50=1ns"], None);
    assert!(!missed.passed && !missed.slo["p50"].holds);
    let refused = soak(&[], Some(SendError::Refused("depth <b>".into())));
    assert_eq!((refused.errors, refused.lost, refused.passed), (10, 0, false));
    let lost = soak(&[], Some(SendError::Lost));
    assert_eq!((lost.errors, lost.lost, lost.passed), (0, 10, false));
}

#[test]
fn three_files_are_written_whole_and_the_page_needs_no_other() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("new/out");
    let report = soak(&["p99=1h"], Some(SendError::Refused("depth <b>".into())));
    report::write(&out, &report).expect("writes");
    let mut names: Vec<_> =
        fs::read_dir(&out).expect("exists").map(|e| e.expect("readable").file_name()).collect();
    names.sort();
    assert_eq!(names, ["soak.hlog", "soak.html", "soak.json"]);
    let written: Value =
        serde_json::from_slice(&fs::read(out.join("soak.json")).expect("readable")).expect("JSON");
    assert_eq!(written["sent"], json(&report)["sent"]);
    let page = fs::read_to_string(out.join("soak.html")).expect("readable");
    assert_eq!(page.matches("<svg").count(), 3);
    assert!(page.contains("depth &lt;b&gt;") && !page.contains("src=") && !page.contains("href="));
}

#[test]
fn a_file_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir(folder.path().join("soak.hlog")).expect("a folder in the way");
    let error = report::write(folder.path(), &soak(&[], None)).expect_err("a folder is no file");
    assert!(error.to_string().contains("soak.hlog"), "{error}");
}
