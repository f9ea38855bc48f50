//! Promise: `wade soak` loads every transport, starts and ends its own server, and its exit status tells.

mod common;

use std::process::Command;

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
        .arg(common::vehicles())
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
