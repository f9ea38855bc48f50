//! What `wade soak` promises to scripts and to people: the JSON names, the three files, the verdict.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::{cell::Cell, fs, num::NonZeroUsize, time::Duration};

use serde_json::Value;
use wade::soak::steps::Steps;
use wade::soak::{
    Ask, Clients, Config, Domain, Input, Rate, Report, SendError, compare::Comparison, report, run,
    run_clients,
};

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

/// So many clients of 500 Hz together for 200 ms, each of which asks `ask` with its number.
fn soak_of_clients(
    count: usize,
    stop: &AtomicBool,
    ask: &(dyn Fn(usize) -> Result<u64, SendError> + Sync),
) -> Result<Report, String> {
    let config = Config {
        rate: Rate::Hz(500.0),
        clients: NonZeroUsize::new(count).expect("some"),
        duration: Duration::from_millis(200),
        warm_up: Duration::ZERO,
        ..Config::default()
    };
    let inputs = [Input::varying(&DOMAIN)];
    let connect = |index: usize| -> Result<Ask<'_>, String> {
        let first = ask(index).map_err(|error| error.to_string())?;
        Ok(Box::new(move |_: &[_]| ask(index).map(|_| first)))
    };
    run_clients(&config, &Clients { inputs: &inputs, connect: &connect }, &|_| {}, stop)
}

#[test]
fn clients_share_the_rate_and_the_report_is_of_all() {
    let asked = Mutex::new([0; 4]);
    let report = soak_of_clients(4, &AtomicBool::new(false), &|index| {
        asked.lock().expect("not poisoned")[index] += 1;
        Ok(1000)
    });
    let report = report.expect("all connect");
    // one request of each is that of its connection
    assert_eq!((asked.into_inner().expect("not poisoned"), report.sent + report.unsent), ([26; 4], 100));
    assert_eq!((report.clients, report.target_rate_hz), (4, Some(500.0)));
}

#[test]
fn a_client_that_cannot_connect_ends_the_run_for_all() {
    for broken in [0, 2] {
        let outcome = soak_of_clients(3, &AtomicBool::new(false), &|index| match index == broken {
            true => Err(SendError::Refused("no place".into())),
            false => Ok(0),
        });
        assert_eq!(outcome.expect_err("it cannot connect"), "refused: no place");
    }
}

#[test]
fn a_run_that_is_stopped_reports_the_part_until_then() {
    let stop = AtomicBool::new(false);
    let count = AtomicBool::new(false);
    let report = soak_of_clients(1, &stop, &|_| {
        // the first request is that of the connection
        stop.store(count.swap(true, Ordering::Relaxed), Ordering::Relaxed);
        Ok(0)
    });
    let report = report.expect("connected");
    assert!(report.interrupted && !report.passed && report.sent == 1, "{:?}", report.failures);
    assert!(
        report.duration_s < 0.2 && report.failures[0].contains("Interrupted after"),
        "{:?}",
        report.failures
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    report::write(folder.path(), &report).expect("written");
    let page = fs::read_to_string(folder.path().join("soak.html")).expect("readable");
    assert!(page.contains("Interrupted after"));
}

#[test]
fn a_report_is_replaced_on_demand_alone() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    report::prepare(folder.path(), false).expect("an empty folder");
    report::write(folder.path(), &soak(&[], None)).expect("written");
    let error = report::prepare(folder.path(), false).expect_err("there is a report").to_string();
    assert!(error.contains("--force") && error.contains("--out"), "{error}");
    report::prepare(folder.path(), true).expect("on demand");
}

#[test]
fn failed_requests_within_the_objective_are_no_failure() {
    let tenth = |slo: &[&str]| soak(slo, Some(SendError::Lost));
    // a busy machine makes the generator late, which is another failure
    let of_requests = |report: &Report| {
        let said = |failure: &&String| failure.contains("no answer in time") || failure.contains("Failed");
        report.failures.iter().find(said).cloned()
    };
    for slo in ["errors=10%", "errors=10"] {
        let report = tenth(&[slo]);
        assert!(of_requests(&report).is_none() && report.slo["errors"].holds, "{:?}", report.failures);
    }
    let over = of_requests(&tenth(&["errors=9%"])).expect("a failure");
    assert!(over.contains("over 9"), "{over}");
    assert!(!soak(&["rate=501"], None).passed);
}

#[test]
fn two_reports_are_compared_with_what_differs_in_their_settings() {
    let folders = [tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder")];
    let mut second = soak(&[], None);
    second.transport = "uds".into();
    second.response_time_us.p99 *= 2.0;
    let first = soak(&[], None);
    for (folder, report) in folders.iter().zip([&first, &second]) {
        report::write(folder.path(), report).expect("written");
    }
    let [before, after] = [folders[0].path(), folders[1].path()];
    let comparison = Comparison::read(before, after).expect("two reports");
    assert_eq!(comparison.differences[0].setting, "transport");
    let p99 = comparison.figures.iter().find(|figure| figure.name == "response time p99 [us]").expect("p99");
    assert_eq!((p99.before, p99.after), (first.response_time_us.p99, second.response_time_us.p99));
    assert!(comparison.text().contains("the runs differ in transport: \"inproc\" and \"uds\""));
    fs::write(after.join("soak.json"), "{}").expect("written");
    let error = Comparison::read(before, after).expect_err("no report").to_string();
    assert!(error.contains("soak.json") && error.contains("response_time_us.p50"), "{error}");
}

#[test]
fn the_knee_is_the_last_rate_before_the_first_that_is_not_held() {
    let step = |hz: f64, p95: f64, failed: bool| {
        let mut report = soak(&[], None);
        (report.target_rate_hz, report.rate_hz) = (Some(hz), hz);
        report.response_time_us.p95 = p95;
        report.failures = failed.then(|| "failed".to_owned()).into_iter().collect();
        report
    };
    let knee = |reports: &[Report]| Steps::new(reports).knee_hz;
    assert_eq!(knee(&[step(1000.0, 10.0, false), step(2000.0, 29.0, false)]), Some(2000.0));
    assert_eq!(knee(&[step(2000.0, 31.0, false), step(1000.0, 10.0, false)]), Some(1000.0));
    let failed = [step(1000.0, 10.0, false), step(2000.0, 10.0, true), step(4000.0, 10.0, false)];
    assert_eq!(knee(&failed), Some(1000.0));
    assert_eq!(knee(&failed[1..]), None);
    let mut slow = step(2000.0, 10.0, false);
    slow.rate_hz = 1900.0;
    assert_eq!(knee(&[step(1000.0, 10.0, false), slow]), Some(1000.0));
}
