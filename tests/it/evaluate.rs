//! Evaluation: simple models find the coefficients that were planted, the figures are those of planted errors, and what
//! was learnt from is no judge.

#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;
use wade_learn::dataset::{self};
use wade_learn::train::report::Record;

fn wade(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_wade")).args(arguments).output().unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn the_program_judges_bundles_by_what_their_training_held_out() {
    let (vehicles, folder) = (crate::common::copy_of_vehicles(), TempDir::new().unwrap());
    let at = |name: &str| folder.path().join(name);
    dataset::write(&at("data.parquet"), &crate::common::analytic(10)).unwrap();
    dataset::write(&at("other.parquet"), &crate::common::analytic(9)).unwrap();
    let (data, other, training) = (at("data.parquet"), at("other.parquet"), at("training"));
    let eval = |data: &Path, more: &[&str]| {
        let fixed =
            ["eval", "--vehicles", text(vehicles.path()), "--data", text(data), "--trained", text(&training)];
        wade(&[&fixed, more].concat())
    };
    let none = eval(&data, &[]);
    assert!(!none.status.success() && stderr(&none).contains("report.json"), "{}", stderr(&none));
    let settings = at("short.toml");
    std::fs::write(&settings, "epochs = 3").unwrap();
    let train = [
        "train",
        "--vehicles",
        text(vehicles.path()),
        "--data",
        text(&data),
        "--out",
        text(&training),
        "--config",
        text(&settings),
        "--variant",
        "paper",
    ];
    let output = wade(&train);
    assert!(output.status.success(), "{}", stderr(&output));

    // neither the data nor the record is written over by a page, and a place that is none is known before the work
    let record = at("training").join("report.json");
    for read in [&data, &record] {
        let before = std::fs::read(read).expect("readable");
        let output = eval(&data, &["--html", text(read)]);
        assert!(!output.status.success() && stderr(&output).contains("which is read"), "{}", stderr(&output));
        assert_eq!(std::fs::read(read).expect("readable"), before);
    }
    let nowhere = at("nowhere").join("eval.html");
    let output = eval(&data, &["--html", text(&nowhere)]);
    assert!(!output.status.success() && stderr(&output).contains("cannot write"), "{}", stderr(&output));
    let page = at("eval.html");
    let output = eval(&data, &["--ablations", "--json", "--html", text(&page)]);
    assert!(output.status.success(), "{}", stderr(&output));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let record = Record::read(&training).unwrap();
    for (index, vehicle) in record.vehicles.iter().enumerate() {
        let served = &report["vehicles"][index];
        let models: Vec<_> =
            served["models"].as_array().unwrap().iter().map(|m| m["name"].as_str().unwrap()).collect();
        assert_eq!(models.len(), 8, "{models:?}");
        assert_eq!(
            (models[0], &models[5..]),
            ("paper", &["no_dimensions", "merged_plates", "global_only"][..])
        );
        // as it is served, and as its trainer judged it
        for c in 0..3 {
            let mae = served["models"][0]["force"]["mae"][c].as_f64().unwrap();
            assert!((mae - vehicle.score.mae[c]).abs() < 1e-4 * mae.max(1.0), "{mae} {:?}", vehicle.score);
        }
    }
    assert!(std::fs::read_to_string(&page).unwrap().contains("global_only"));

    let refused = eval(&other, &[]);
    assert!(
        stderr(&refused).contains("is not the data set that the weights were trained on"),
        "{}",
        stderr(&refused)
    );
    let shipped = crate::common::copy_of_vehicles();
    let refused = wade(&[
        "eval",
        "--vehicles",
        text(shipped.path()),
        "--data",
        text(&data),
        "--trained",
        text(&training),
    ]);
    assert!(stderr(&refused).contains("are not those of the training report"), "{}", stderr(&refused));
}

#[test]
fn the_program_trains_anew_for_every_part_that_is_held_out() {
    let folder = TempDir::new().unwrap();
    let (data, settings) = (folder.path().join("data.parquet"), folder.path().join("short.toml"));
    dataset::write(&data, &crate::common::analytic(10)).unwrap();
    std::fs::write(&settings, "epochs = 2\nparts = 2").unwrap();
    let vehicles = crate::common::vehicles();
    let eval =
        ["eval", "--vehicles", text(&vehicles), "--data", text(&data), "--config", text(&settings), "--json"];
    for (rule, parts, models) in [("depth", 2, 5), ("vehicle", 2, 2)] {
        let output = wade(&[&eval[..], &["--split", rule, "--variants", "paper"]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(report["splits"].as_array().unwrap().len(), parts);
        for vehicle in report["vehicles"].as_array().unwrap() {
            // every case is held out once; of a vehicle held out as a whole nothing is left to fit simple models to
            let cases = if vehicle["name"] == "husky" { 10 } else { 20 };
            assert_eq!(vehicle["cases"], cases);
            assert_eq!(vehicle["models"].as_array().unwrap().len(), models);
        }
    }
}
