//! Promise: planted motion and planted laws come back from the validation, broken laws are noticed, and the report is
//! there as a whole or not at all.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;
use wade_learn::validate::Config;

fn wade(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    command
        .args(arguments)
        .env("WADE_VEHICLES", crate::common::vehicles())
        .output()
        .expect("the program runs")
}

fn validate(source: &[&str], out: &Path) -> Output {
    let out = out.to_string_lossy();
    let arguments = [&["validate", "--vehicle", "warthog", "--out", &out], source].concat();
    wade(&arguments)
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn report(out: &Path) -> Value {
    let text = std::fs::read_to_string(out.join("report.json")).expect("written");
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn the_whole_way_from_a_seed_to_a_report_and_again_from_its_files() {
    let folder = TempDir::new().expect("a folder");
    let out = folder.path().join("deep/first");
    let output = validate(&["--generated", "1", "--json"], &out);
    assert!(output.status.success(), "{}", stderr(&output));
    let first = report(&out);
    assert_eq!(serde_json::from_slice::<Value>(&output.stdout).expect("JSON"), first);
    for key in ["passed", "failures", "not_tested", "subject", "checks", "left_out", "config", "commit"] {
        assert!(!first[key].is_null(), "{key}");
    }
    assert_eq!(first["paper_label"], "published, different data");
    assert_eq!(first["subject"]["weights"], crate::common::model("warthog").provenance());
    assert_eq!((&first["data"]["trials"], &first["data"]["source"]), (&71.into(), &"generated".into()));
    assert!(first["data"]["generated"].as_str().expect("text").starts_with("generated"));
    let depth = &first["drag_scaling"]["depths"][0];
    for key in ["depth_m", "sections", "c_d_eff", "r2", "r2_about_zero", "c_d"] {
        assert!(depth[key].is_number(), "{key}");
    }
    assert_eq!(depth["paper"]["c_d_eff"], 49.2);
    let depth = &first["vertical_force"]["depths"][2];
    for key in ["mean_fz_n", "f0_n", "c_l", "r2", "mesh_wetted_n", "mesh_dry_n"] {
        assert!(depth[key].is_number(), "{key}");
    }
    assert_eq!(depth["paper"]["f0_n"], 784.0);

    let page = std::fs::read_to_string(out.join("index.html")).expect("written");
    assert!(page.contains("Generated motion, not measured") && page.contains("published, different data"));
    assert_eq!(page.matches("<svg").count(), 3);
    assert_eq!(page.matches("(generated motion)").count(), 3, "every figure says so itself");
    assert!(!page.contains("http://") || page.matches("http://").all(|_| page.contains("www.w3.org")));
    for kind in ["recordings", "trials"] {
        let entries = std::fs::read_dir(out.join(kind)).expect("written");
        let names: Vec<String> = entries
            .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
            .collect();
        assert_eq!(names.len(), 72);
        assert!(names.iter().all(|name| name.starts_with("generated") || name.ends_with(".toml")));
        let toml = std::fs::read_to_string(out.join(kind).join(format!("{kind}.toml"))).expect("written");
        assert!(toml.contains("generated = \"generated, seed 1"), "{toml}");
    }

    // the same seed, its recordings and its trials say the same
    let sections = |out: &Path| report(out)["sections"].clone();
    let again = folder.path().join("again");
    for (flag, source) in [("--mocap", "recordings"), ("--trials", "trials")] {
        let output = validate(&[flag, &out.join(source).to_string_lossy()], &again);
        assert!(output.status.success(), "{}", stderr(&output));
        assert_eq!(sections(&again), first["sections"], "{flag}");
        assert!(!report(&again)["data"]["generated"].is_null(), "{flag}: still labelled");
    }
    assert!(validate(&["--generated", "1"], &again).status.success());
    assert_eq!(std::fs::read(again.join("index.html")).expect("written"), page.into_bytes());
}

#[test]
fn a_threshold_that_is_missed_makes_exit_status_1_and_still_a_report() {
    let folder = TempDir::new().expect("a folder");
    let settings = folder.path().join("strict.toml");
    std::fs::write(&settings, "[thresholds]\nf0_r2 = 0.99999\n").expect("written");
    let out = folder.path().join("out");
    let output = validate(&["--generated", "2", "--config", &settings.to_string_lossy()], &out);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("F0 against depth"), "{}", stderr(&output));
    assert_eq!(report(&out)["passed"], false);
    assert!(std::fs::read_to_string(out.join("index.html")).expect("written").contains("Failed."));
}

#[test]
fn bad_input_names_the_file_and_writes_nothing() {
    let folder = TempDir::new().expect("a folder");
    let root = folder.path();
    let good = root.join("good");
    validate(&["--generated", "3"], &good);
    assert!(good.join("report.json").exists(), "a report, whatever it says of the weights");
    let case = |name: &str, change: &dyn Fn(&Path)| {
        let recordings = root.join(name);
        crate::common::copy_folder(&good.join("recordings"), &recordings);
        change(&recordings);
        let out = root.join(format!("{name}-out"));
        let output = validate(&["--mocap", &recordings.to_string_lossy()], &out);
        assert_eq!(output.status.code(), Some(1), "{name}");
        assert!(!out.exists(), "{name}: nothing is half written");
        stderr(&output)
    };
    let csv = "generated-in-04in-03.csv";
    let edit = |path: &Path, row: usize, change: &dyn Fn(&mut Vec<String>)| {
        let text = std::fs::read_to_string(path.join(csv)).expect("readable");
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let mut cells: Vec<String> = lines[row - 1].split(',').map(str::to_owned).collect();
        change(&mut cells);
        lines[row - 1] = cells.join(",");
        std::fs::write(path.join(csv), lines.join("\n")).expect("written");
    };
    let message = case("backwards", &|path| edit(path, 9, &|cells| cells[0] = "0".into()));
    assert!(message.contains(csv) && message.contains("row 9, column t"), "{message}");
    let message = case("zero", &|path| edit(path, 7, &|cells| cells[4..].fill("0".into())));
    assert!(
        message.contains(csv) && message.contains("row 7") && message.contains("length 0.0000"),
        "{message}"
    );
    let message = case("nan", &|path| edit(path, 5, &|cells| cells[3] = "nan".into()));
    assert!(message.contains(csv) && message.contains("row 5, column z"), "{message}");
    let message = case("millimeters", &|path| edit(path, 6, &|cells| cells[1] = "2500".into()));
    assert!(message.contains(csv) && message.contains("row 6, column x"), "{message}");
    let message = case("jump", &|path| edit(path, 30, &|cells| cells[1] = "90".into()));
    assert!(
        message.contains(csv) && message.contains("t = 0.225 s to 0.234 s it moves by 91.848 m"),
        "{message}"
    );
    // what the recording itself does not show, its trial does
    let message = case("deep", &|path| {
        let count = std::fs::read_to_string(path.join(csv)).expect("readable").lines().count();
        let lower = |cells: &mut Vec<String>| {
            let z: f64 = cells[3].parse().expect("a number");
            cells[3] = (z - 30.0).to_string();
        };
        (2..=count).for_each(|row| edit(path, row, &lower));
        let described = path.join("recordings.toml");
        let text = std::fs::read_to_string(&described).expect("readable");
        let unmeasured: Vec<&str> = text.lines().filter(|line| !line.starts_with("depth_m")).collect();
        std::fs::write(described, unmeasured.join("\n")).expect("written");
    });
    assert!(message.contains(csv) && message.contains("after resampling to 111 Hz"), "{message}");
    let message = case("short", &|path| {
        let text = std::fs::read_to_string(path.join(csv)).expect("readable");
        let cut: Vec<&str> = text.lines().take(6).collect();
        std::fs::write(path.join(csv), cut.join("\n")).expect("written");
    });
    assert!(message.contains(csv) && message.contains("fewer than the window of 9"), "{message}");
    let message = case("unlisted", &|path| {
        std::fs::copy(path.join(csv), path.join("extra.csv")).expect("copied");
    });
    assert!(message.contains("extra.csv") && message.contains("[recording.extra]"), "{message}");
    let message = case("missing", &|path| std::fs::remove_file(path.join(csv)).expect("removed"));
    assert!(message.contains(csv), "{message}");
    let message = case("undescribed", &|path| {
        std::fs::remove_file(path.join("recordings.toml")).expect("removed");
    });
    assert!(message.contains("recordings.toml"), "{message}");
    let message = case("husky", &|path| {
        let file = path.join("recordings.toml");
        let text = std::fs::read_to_string(&file).expect("readable").replace("warthog", "husky");
        std::fs::write(file, text).expect("written");
    });
    assert!(message.contains("--vehicle husky"), "{message}");

    let out = root.join("none");
    for (arguments, expected) in [
        (vec!["--trials", "nowhere"], "nowhere"),
        (vec!["--generated", "1", "--vehicles", "nowhere"], "nowhere: there is no such folder"),
        (vec!["--generated", "1", "--config", "nowhere.toml"], "nowhere.toml"),
    ] {
        let output = validate(&arguments, &out);
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
        assert!(!out.exists());
    }
    for usage in [vec![], vec!["--generated", "1", "--mocap", "there"], vec!["--generated", "one"]] {
        assert_eq!(validate(&usage, &out).status.code(), Some(2));
    }
    let leftovers: Vec<_> = std::fs::read_dir(root)
        .expect("readable")
        .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
        .filter(|name| name.starts_with(".wade"))
        .collect();
    assert!(leftovers.is_empty(), "{leftovers:?}");
}

#[test]
fn a_report_never_takes_the_place_of_other_files() {
    let folder = TempDir::new().expect("a folder");
    let work = folder.path().join("work");
    let first = folder.path().join("first");
    validate(&["--generated", "4"], &first);
    assert!(first.join("report.json").exists(), "a report, whatever it says of the weights");
    crate::common::copy_folder(&first.join("trials"), &work.join("trials"));
    // the trials of a user, in a folder named as a report's own
    for trials in [work.join("trials"), first.join("trials")] {
        let out = trials.parent().expect("a folder");
        let output = validate(&["--trials", &trials.to_string_lossy()], out);
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains("name another folder"), "{}", stderr(&output));
        assert!(trials.join("trials.toml").exists());
    }
    let output = validate(&["--generated", "4"], &work);
    assert_eq!(output.status.code(), Some(1), "a folder with trials and no report is not a report's");
    std::fs::write(first.join("thesis.tex"), "irreplaceable").expect("written");
    assert_eq!(validate(&["--generated", "4"], &first).status.code(), Some(1));
    assert!(first.join("thesis.tex").exists());
}

#[test]
fn help_shows_examples() {
    let output = wade(&["validate", "--help"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && text.contains("Examples"), "{text}");
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    for (text, expected) in [
        ("[planar]\ndepth_tolerance_m = 0.0", "planar.depth_tolerance_m"),
        ("[thresholds]\nsections = 1", "thresholds.sections"),
        ("[thresholds]\ndrag_r2 = 1.5", "thresholds.drag_r2"),
        ("[groups]\nspeed_mps = nan", "groups.speed_mps"),
        ("[planar]\nsample = 3", "sample"),
        ("[mocap]\nrate_hz = 1e12", "mocap.rate_hz = 1000000000000 must be between 1 and 10000 Hz"),
        ("[mocap]\nrate_hz = nan", "mocap.rate_hz"),
        (
            "[mocap]\nwindow = 1000000000001",
            "mocap.window = 1000000000001 must be odd and between 3 and 1001",
        ),
        ("[mocap]\nwindow = 8", "mocap.window"),
        ("[mocap]\norder = 9", "mocap.order"),
        ("[mocap]\nwindow = 51\norder = 11", "mocap.order"),
    ] {
        let found = toml::from_str::<Config>(text).map_err(|error| error.to_string());
        let message = match found {
            Ok(config) => config.check().expect_err("refused").to_string(),
            Err(message) => message,
        };
        assert!(message.contains(expected), "{message}");
    }
}
