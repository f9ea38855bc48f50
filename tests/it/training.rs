//! Training: lowers the loss, repeats bit for bit whatever the threads and interruptions, keeps its split, and says what
//! it cannot do.

#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;
use wade_core::bundle;
use wade_learn::dataset;
use wade_learn::train::report::Record;

fn wade(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    command.args(arguments).stdin(Stdio::null());
    command
}

fn output(arguments: &[&str]) -> Output {
    wade(arguments).output().unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn success(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A Parquet file with both vehicles.
fn parquet(folder: &Path) -> String {
    let path = folder.join("data.parquet");
    dataset::write(&path, &crate::common::analytic(12)).unwrap();
    text(&path).to_owned()
}

#[test]
fn a_parquet_file_ends_in_bundles_that_say_where_they_come_from() {
    let (vehicles, folder) = (crate::common::copy_of_vehicles(), TempDir::new().unwrap());
    let (data, out) = (parquet(folder.path()), folder.path().join("report"));
    let before = bundle::read(&vehicles.path().join("husky")).unwrap();
    let vehicles_folder = text(vehicles.path());
    let arguments = ["train", "--data", &data, "--vehicles", vehicles_folder, "--variant", "paper"];
    success(&output(&[&arguments[..], &["--epochs", "2", "--out", text(&out)]].concat()));
    let record = Record::read(&out).unwrap();
    assert_eq!(record.history.len(), 2);
    assert!(record.split.training_cases.is_disjoint(&record.split.held_out_cases));
    assert_eq!(record.split.training_cases.len() + record.split.held_out_cases.len(), 12 + 24);
    let page = std::fs::read_to_string(out.join("index.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("learning rate"));
    for name in crate::common::VEHICLES {
        let bundle = bundle::read(&vehicles.path().join(name)).unwrap();
        let (weights, _) = bundle.trained.unwrap();
        let sha256 = record.data.sha256.as_ref().unwrap();
        assert_eq!(weights.provenance, format!("analytic, data sha256 {sha256}"));
        assert_eq!(wade_learn::train::report::fingerprint(&weights.network), record.weights_sha256);
    }
    let husky = vehicles.path().join("husky");
    assert_eq!(bundle::read(&husky).unwrap().version, before.version + 1);
    // what was served before is not lost
    assert_eq!(bundle::kept(&husky).unwrap().len(), 1);
    assert_eq!(bundle::roll_back(&husky, None).unwrap(), before.version);
    assert_eq!(bundle::read(&husky).unwrap().trained, before.trained);
}

#[test]
fn a_run_that_was_killed_ends_as_one_that_was_not() {
    let folder = TempDir::new().unwrap();
    let data = parquet(folder.path());
    let state = folder.path().join("state");
    let out = folder.path().join("report");
    let arguments = |vehicles: &Path, more: &[&str]| {
        let fixed = ["train", "--data", &data, "--variant", "paper", "--epochs", "60"];
        let places = ["--out", text(&out), "--vehicles", text(vehicles)];
        fixed.iter().chain(&places).chain(more).map(|s| (*s).to_owned()).collect::<Vec<String>>()
    };
    let (killed, whole) = (crate::common::copy_of_vehicles(), crate::common::copy_of_vehicles());
    let checkpoint = ["--checkpoint", text(&state)];
    let mut child =
        wade(&[]).args(arguments(killed.path(), &checkpoint)).stderr(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    while !state.exists() && begun.elapsed() < Duration::from_secs(120) {
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    assert!(!child.wait().unwrap().success(), "it was killed on its way");
    let untouched = std::fs::read(crate::common::vehicles().join("husky/SHA256SUMS")).unwrap();
    assert_eq!(std::fs::read(killed.path().join("husky/SHA256SUMS")).unwrap(), untouched);

    let resume = ["--checkpoint", text(&state), "--resume"];
    success(&wade(&[]).args(arguments(killed.path(), &resume)).output().unwrap());
    success(&wade(&[]).args(arguments(whole.path(), &[])).output().unwrap());
    for vehicle in crate::common::VEHICLES {
        let sums = |folder: &TempDir| std::fs::read(folder.path().join(vehicle).join("SHA256SUMS")).unwrap();
        assert_eq!(sums(&killed), sums(&whole));
    }
    assert!(!state.exists(), "the end of a training removes its checkpoint");
}

#[test]
fn bad_input_names_the_file_and_leaves_everything_as_it_was() {
    let (vehicles, folder) = (crate::common::copy_of_vehicles(), TempDir::new().unwrap());
    let (data, out) = (parquet(folder.path()), folder.path().join("report"));
    let refused = |data: &str, more: &[&str]| {
        let arguments = ["train", "--data", data, "--vehicles", text(vehicles.path()), "--out", text(&out)];
        let output = output(&[&arguments, more].concat());
        assert!(!output.status.success());
        let sums = |folder: &Path| std::fs::read(folder.join("husky/SHA256SUMS")).unwrap();
        assert_eq!(sums(vehicles.path()), sums(&crate::common::vehicles()));
        assert!(!out.exists() || std::fs::read_dir(&out).unwrap().next().is_none(), "nothing half-written");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    assert!(refused("absent.parquet", &[]).contains("absent.parquet"));
    let cut = folder.path().join("cut.parquet");
    let bytes = std::fs::read(&data).unwrap();
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    assert!(refused(text(&cut), &[]).contains("cut.parquet: cannot be read as Parquet"));
    assert!(refused(&data, &["--split", "depth", "--part", "6"]).contains("--part must be 1 to 5"));
    let settings = folder.path().join("train.toml");
    std::fs::write(&settings, "epochs = 2\npatiense = 3\n").unwrap();
    let error = refused(&data, &["--config", text(&settings)]);
    assert!(
        error.contains("train.toml") && error.contains("patiense") && error.contains("line 2"),
        "{error}"
    );
    std::fs::write(&settings, "held_out_share = 1.0").unwrap();
    let error = refused(&data, &["--config", text(&settings)]);
    assert!(error.contains("data.parquet") && error.contains("a share of 1 is held out"), "{error}");
    // before the first epoch, of which a line would tell
    let error = refused(&data, &["--checkpoint", text(&folder.path().join("absent/state"))]);
    assert!(error.contains("absent/state") && !error.contains("held out:"), "{error}");
}
