//! Promise: `wade gap` reads a folder of trials, writes a report whole, applies physics alone, and touches nothing where the
//! input is bad.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;
use wade_core::condition::Condition;
use wade_core::frame::Vec3;
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_learn::random::Random;

/// Runs the program on copies of the shipped bundles: what is applied is written into them.
fn wade_on(vehicles: &TempDir, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    command.args(arguments).env("WADE_VEHICLES", vehicles.path()).output().expect("the program runs")
}

fn gaussian(random: &mut Random) -> f64 {
    (-2.0 * (1.0 - random.unit()).ln()).sqrt() * (std::f64::consts::TAU * random.unit()).cos()
}

/// Runs of a Warthog whose measured wrench is the bundle's own and an added mass of 0.8 of the displaced water along x.
fn trials(folder: &Path, count: usize) {
    let model = crate::common::model("warthog");
    let mut random = Random::new(5);
    let manifest =
        "vehicle = \"warthog\"\ngenerated = \"planted, for tests\"\n[measured]\nmethod = \"load_cell\"\n";
    std::fs::write(folder.join("trials.toml"), manifest).expect("written");
    for index in 0..count {
        let depth = [0.1016, 0.2032, 0.254][index % 3];
        let top = 0.8 + 2.0 * random.unit();
        let step = |t: f64, at: f64| 0.5 * (1.0 + ((t - at) / 0.5).tanh());
        let speed = |t: f64| top * (step(t, 1.5) - 0.8 * step(t, 5.5));
        // the mesh's own displaced water, by Archimedes
        let plane = Condition::level(Vec3::zeros(), depth).water_plane(model.vehicle().z0);
        let mesh = &model.vehicle().hull.mesh;
        let displaced = hydrostatics(mesh, &plane, 1000.0, &Vec3::zeros()).displaced_volume;
        let mut recording = crate::common::Recording::of(&model);
        let mut text = "t,vx,vy,vz,wx,wy,wz,depth,ax,ay,az,fx,fz\n".to_owned();
        for i in 0..700 {
            let t = f64::from(i) * 0.01;
            let (v, a) = (speed(t), (speed(t + 1e-4) - speed(t - 1e-4)) / 2e-4);
            let condition = Condition {
                acceleration: Vec3::new(a, 0.0, 0.0),
                ..Condition::level(Vec3::new(v, 0.0, 0.0), depth)
            };
            let wrench = recording.wrench(&condition, None, if i == 0 { 0.0 } else { 0.01 });
            let fx = wrench.force.x - 0.8 * 1000.0 * displaced * a + 8.0 * gaussian(&mut random);
            let fz = wrench.force.z + 12.0 * gaussian(&mut random);
            let (v, a) = (v + 0.005 * gaussian(&mut random), a + 0.1 * gaussian(&mut random));
            text += &format!("{t},{v},0,0,0,0,0,{depth},{a},0,0,{fx},{fz}\n");
        }
        std::fs::write(folder.join(format!("run{index:02}.csv")), text).expect("written");
    }
}

fn folder(count: usize) -> TempDir {
    let folder = TempDir::new().expect("a folder");
    trials(folder.path(), count);
    folder
}

#[test]
fn a_hidden_added_mass_is_named_and_written() {
    let (data, out) = (folder(14), TempDir::new().expect("a folder"));
    let (data, out) = (data.path().to_str().expect("a name"), out.path().join("gap"));
    let place = out.to_str().expect("a name");
    let vehicles = crate::common::copy_of_vehicles();
    let wade = |arguments: &[&str]| wade_on(&vehicles, arguments);
    let output = wade(&[
        "gap",
        "--vehicle",
        "warthog",
        "--trials",
        data,
        "--out",
        place,
        "--apply",
        "--server",
        "unix:/nowhere",
        "--json",
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(report["verdict"], "named", "{}", report["summary"]);
    let effect = &report["effects"][0];
    assert_eq!((&effect["name"], &effect["kind"]), (&"added_mass".into(), &"physics".into()));
    let surge = effect["parameters"]["surge"]["value"].as_f64().expect("a number");
    assert!((surge - 0.8).abs() < 0.06, "{surge}");
    assert_eq!(report["sources"]["model"].as_str().map(str::len), Some(64));
    let held_out = &report["gap"]["held_out"]["fx"];
    assert!(held_out["closure"].as_f64().is_some_and(|closure| closure > 0.85), "{held_out}");
    let on_disk = std::fs::read_to_string(out.join("report.json")).expect("written");
    assert_eq!(serde_json::from_str::<Value>(&on_disk).expect("JSON"), report);
    let page = std::fs::read_to_string(out.join("index.html")).expect("written");
    // the page is for people: plain names
    assert!(page.contains("added mass") && page.contains("<svg") && !page.contains("http-equiv"));
    let effects: toml::Value = std::fs::read_to_string(out.join("effects.toml"))
        .expect("written")
        .parse()
        .map(toml::Value::Table)
        .expect("TOML");
    assert_eq!(effects["effect"][0]["name"].as_str(), Some("added_mass"));
    assert_eq!(effects["evidence"]["trials_sha256"].as_str().map(str::len), Some(64));
    if let Ok(copy) = std::env::var("WADE_KEEP_PAGE") {
        std::fs::copy(out.join("index.html"), copy).expect("copied");
    }
    // the steps say the same
    let step = |step: &str| {
        let output = wade(&["gap", step, "--vehicle", "warthog", "--trials", data, "--json"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice::<Value>(&output.stdout).expect("JSON")
    };
    assert_eq!(step("name")["effects"][0], "added_mass");
    // beside a base without inertia, the trials show its share too
    let output = wade(&[
        "gap",
        "fit",
        "--vehicle",
        "warthog",
        "--trials",
        data,
        "--json",
        "--physics",
        "quasi_steady",
    ]);
    let fitted: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let whole = fitted["effects"][0]["parameters"]["surge"]["value"].as_f64().expect("a number");
    assert!(fitted["effects"][0]["name"] == "added_mass" && whole > surge + 0.05, "{fitted}");
    // as trials.toml may state as well
    let stated = TempDir::new().expect("a folder");
    for entry in std::fs::read_dir(data).expect("trials") {
        let from = entry.expect("readable").path();
        std::fs::copy(&from, stated.path().join(from.file_name().expect("a name"))).expect("copied");
    }
    let manifest = stated.path().join("trials.toml");
    let text = std::fs::read_to_string(&manifest).expect("readable");
    std::fs::write(&manifest, format!("physics = \"quasi_steady\"\n{text}")).expect("written");
    let folder = stated.path().to_string_lossy();
    let output = wade(&["gap", "fit", "--vehicle", "warthog", "--trials", &folder, "--json"]);
    assert_eq!(serde_json::from_slice::<Value>(&output.stdout).expect("JSON"), fitted);
    let applied = out.join("applied").to_string_lossy().into_owned();
    let output = wade(&["gap", "--vehicle", "warthog", "--trials", &folder, "--out", &applied, "--apply"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && said.contains("physics of trials.toml"), "{said}");
    assert_eq!(step("locate")["regions"], report["regions"]);
    assert_eq!(step("fit")["effects"][0]["parameters"], effect["parameters"]);
}

#[test]
fn bad_input_is_refused_with_file_row_and_column_and_nothing_is_written() {
    let (data, out) = (folder(5), TempDir::new().expect("a folder"));
    let place = out.path().join("gap");
    let vehicles = crate::common::copy_of_vehicles();
    let run = |vehicle: &str| {
        let output = wade_on(
            &vehicles,
            &[
                "gap",
                "--vehicle",
                vehicle,
                "--trials",
                data.path().to_str().expect("a name"),
                "--out",
                place.to_str().expect("a name"),
                "--apply",
            ],
        );
        assert_eq!(output.status.code(), Some(1));
        assert!(!place.exists());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    assert!(run("husky").contains("give --vehicle warthog"));
    let path = data.path().join("run03.csv");
    let good = std::fs::read_to_string(&path).expect("readable");
    let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
    lines[4] = lines[4].replacen(",0,0,", ",NaN,0,", 1);
    std::fs::write(&path, lines.join("\n")).expect("written");
    let message = run("warthog");
    assert!(message.contains("run03.csv") && message.contains("row 5, column vy"), "{message}");
    let g = good.lines().map(|line| line.rsplit_once(',').expect("columns").0).collect::<Vec<_>>().join("\n");
    std::fs::write(&path, g).expect("written");
    let message = run("warthog");
    assert!(message.contains("column fz") && message.contains("same components"), "{message}");
}

#[test]
fn repeats_that_leave_nothing_to_keep_back_are_refused() {
    let (data, out) = (folder(5), TempDir::new().expect("a folder"));
    let place = out.path().join("gap");
    let manifest = data.path().join("trials.toml");
    let text = std::fs::read_to_string(&manifest).expect("readable");
    let repeats = r#"repeats = [["run00", "run01", "run02", "run03", "run04"]]"#;
    std::fs::write(&manifest, format!("{text}{repeats}\n")).expect("written");
    let (trials, place_name) = (data.path().to_str().expect("a name"), place.to_str().expect("a name"));
    let arguments = ["gap", "--vehicle", "warthog", "--trials", trials, "--out", place_name];
    let output = wade_on(&crate::common::copy_of_vehicles(), &arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("cannot be held out") && message.contains("raise held_out"), "{message}");
    assert!(!place.exists());
}

#[test]
fn a_benchmark_without_end_is_refused() {
    let out = TempDir::new().expect("a folder");
    let place = out.path().join("bench");
    let name = place.to_str().expect("a name");
    for cases in ["18446744073709551615", "10001"] {
        let output =
            wade_on(&crate::common::copy_of_vehicles(), &["gap", "bench", "--cases", cases, "--out", name]);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains("--cases") && message.contains("10000"), "{message}");
        assert!(!place.exists());
    }
}

#[test]
fn the_benchmark_runs_on_a_bundle_and_on_none_that_is_not_there() {
    let (out, vehicles) = (TempDir::new().expect("a folder"), crate::common::copy_of_vehicles());
    let bench = |vehicle: &str, folder: &Path| {
        let folder = folder.to_str().expect("a name");
        let small = ["--size", "slice", "--cases", "1", "--families", "null", "--no-baselines"];
        let on = ["gap", "bench", "--vehicle", vehicle, "--invariance", "0", "--out", folder];
        wade_on(&vehicles, &[&on[..], &small].concat())
    };
    let folder = out.path().join("husky");
    let output = bench("husky", &folder);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let results = std::fs::read(folder.join("results.json")).expect("written");
    let results: Value = serde_json::from_slice(&results).expect("JSON");
    assert_eq!(results["vehicle"], "husky");
    let case = &results["tools"]["wade gap"]["cases"]["judged"][0];
    assert_eq!((&case["error"], &case["named"]), (&Value::Null, &serde_json::json!([])), "{case}");
    let folder = out.path().join("other");
    let output = bench("no-such-vehicle", &folder);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && message.contains("no-such-vehicle"), "{message}");
    assert!(!folder.exists());
}
