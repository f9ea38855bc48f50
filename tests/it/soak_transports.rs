//! Promise: `wade soak` loads every transport, starts and ends its own server, and its exit status tells.

use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

fn soak(transport: &str, more: &[&str]) -> (Option<i32>, Value, String) {
    let out = TempDir::new().expect("a folder");
    let output = Command::new(env!("CARGO_BIN_EXE_wade"))
        .args([
            "soak",
            "--vehicle",
            "husky",
            "--transport",
            transport,
            "--duration",
            "300ms",
            "--warm-up",
            "100ms",
            "--json",
        ])
        .args(more)
        .arg("--out")
        .arg(out.path())
        .arg("--vehicles")
        .arg(crate::common::vehicles())
        .output()
        .expect("the program runs");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    let report = serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {stderr}"));
    for file in ["soak.json", "soak.hlog", "soak.html"] {
        assert!(out.path().join(file).metadata().expect("written").len() > 100, "{file}");
    }
    (output.status.code(), report, stderr)
}

#[test]
fn every_transport_is_loaded_without_an_error() {
    for transport in ["inproc", "shm-spin", "shm-block", "grpc", "grpc-stream", "uds", "uds-stream"] {
        // one after the other, so that a busy machine makes nobody late
        let (code, report, stderr) = soak(transport, &["--rate", "max", "--pin", "off"]);
        assert_eq!(code, Some(0), "{transport}: {stderr}");
        assert!(report["answered"].as_u64() > Some(10), "{transport}: {report}");
        assert_eq!((&report["errors"], &report["lost"]), (&Value::from(0), &Value::from(0)), "{transport}");
        for key in ["response_time_us", "service_time_us", "send_lag_us", "control_us"] {
            assert!(report[key]["p99_9"].is_number(), "{transport}: {key}");
        }
    }
}

#[test]
fn batches_are_loaded_over_every_transport() {
    for transport in ["inproc", "shm-spin", "grpc"] {
        let (code, report, stderr) =
            soak(transport, &["--rate", "max", "--pin", "off", "--batch", "64", "--input", "varying"]);
        assert_eq!(code, Some(0), "{transport}: {stderr}");
        assert_eq!(report["batch"], 64);
    }
}

#[test]
fn a_missed_objective_sets_the_exit_status() {
    let (code, report, stderr) = soak("inproc", &["--rate", "max", "--pin", "off", "--slo", "p50=1ns"]);
    assert_eq!(code, Some(1), "{stderr}");
    assert_eq!(report["passed"], Value::Bool(false));
    let (code, ..) = soak("inproc", &["--rate", "max", "--pin", "off", "--slo", "max=100s"]);
    assert_eq!(code, Some(0));
}

/// A soak of the husky, unless told otherwise, that leaves its report in this folder.
fn command(out: &std::path::Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    command.args(["soak", "--pin", "off", "--warm-up", "50ms"]).args(more).arg("--out").arg(out);
    command.arg("--vehicles").arg(crate::common::vehicles());
    command
}

#[test]
fn ctrl_c_ends_a_soak_with_its_report_and_its_server() {
    let out = TempDir::new().expect("a folder");
    let log = out.path().join("log");
    let soak = ["--vehicle", "husky", "--transport", "uds", "--rate", "200", "--duration", "120s"];
    let mut child = command(out.path(), &soak)
        .stderr(std::fs::File::create(&log).expect("a file"))
        .spawn()
        .expect("the program runs");
    let children = format!("/proc/{0}/task/{0}/children", child.id());
    let begun = Instant::now();
    let server = loop {
        let pids = std::fs::read_to_string(&children).expect("/proc");
        if let Some(pid) = pids.split_whitespace().next() {
            break pid.to_owned();
        }
        assert!(begun.elapsed() < crate::common::PATIENCE, "no server was started");
        std::thread::sleep(Duration::from_millis(20));
    };
    // the thread that waits for Ctrl-C is there once the server has answered and the load begins
    let tasks = format!("/proc/{}/task", child.id());
    let waits = || {
        let names = std::fs::read_dir(&tasks).into_iter().flatten().flatten();
        names
            .map(|task| std::fs::read_to_string(task.path().join("comm")).unwrap_or_default())
            .any(|name| name.trim() == "wade-signals")
    };
    while !waits() {
        assert!(begun.elapsed() < 2 * crate::common::PATIENCE, "the load never began");
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_secs(1));
    let pid = nix::unistd::Pid::from_raw(child.id().cast_signed());
    nix::sys::signal::kill(pid, nix::sys::signal::Signal::SIGINT).expect("it lives");
    let status = child.wait().expect("it ends");
    let log = std::fs::read_to_string(log).expect("readable");
    assert_eq!(status.code(), Some(130), "{log}");
    let report = std::fs::read(out.path().join("soak.json")).expect("written");
    let report: Value = serde_json::from_slice(&report).expect("JSON");
    assert_eq!((&report["interrupted"], &report["passed"]), (&Value::Bool(true), &Value::Bool(false)));
    assert!(report["answered"].as_u64() > Some(0), "{report}");
    assert_eq!(report["errors"], 0, "the server ends after the load: {log}");
    assert!(!std::path::Path::new("/proc").join(server).exists(), "the server ends with its soak");
}

#[test]
fn several_clients_vehicles_and_rates_are_one_soak() {
    let out = TempDir::new().expect("a folder");
    let load = ["--vehicle", "husky", "--vehicle", "warthog", "--transport", "uds", "--clients", "4"];
    let rates = ["--rate", "40,80", "--duration", "500ms", "--slo", "max=100s", "--json"];
    let output = command(out.path(), &[&load[..], &rates].concat()).output().expect("the program runs");
    let steps: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(&output.stderr)));
    assert_eq!(steps["steps"].as_array().map(Vec::len), Some(2));
    for (rate, folder) in [(40.0, "40hz"), (80.0, "80hz")] {
        let report = std::fs::read(out.path().join(folder).join("soak.json")).expect("written");
        let report: Value = serde_json::from_slice(&report).expect("JSON");
        assert_eq!((&report["vehicle"], &report["clients"]), (&"husky,warthog".into(), &4.into()));
        assert_eq!(report["target_rate_hz"], rate);
        assert!(report["answered"].as_u64() > Some(0));
    }
    assert!(std::fs::read_to_string(out.path().join("steps.html")).expect("written").contains("<svg"));
    let again = command(out.path(), &[&load[..], &rates].concat()).output().expect("the program runs");
    assert_eq!(again.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&again.stderr).contains("--force"));
}

#[test]
fn an_address_and_a_transport_that_contradict_each_other_are_refused() {
    let out = TempDir::new().expect("a folder");
    for (transport, address) in
        [("grpc", "unix:/tmp/x.sock"), ("uds", "127.0.0.1:1"), ("shm-spin", "unix:/x"), ("inproc", "shm:x")]
    {
        let more = ["--vehicle", "husky", "--transport", transport, "--addr", address];
        let output = command(out.path(), &more).output().expect("the program runs");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && text.contains(transport), "{text}");
    }
    let query = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
        command.args(["query", "--vehicle", "husky", "--depth", "0.1"]).args(more);
        command.output().expect("the program runs")
    };
    assert_eq!(query(&["--transport", "uds", "--addr", "127.0.0.1:1"]).status.code(), Some(2));
    let text = String::from_utf8_lossy(&query(&["--addr", "/tmp/wade.sock"]).stderr).into_owned();
    assert!(text.contains("unix:PATH"), "{text}");
}
