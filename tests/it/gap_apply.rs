//! Promise: `wade gap --apply` adds what it named to the bundle and nothing else, a served answer changes by it, and one
//! command takes it back; where there is nothing to trust, the bundle stays as it was.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;
use wade_core::condition::Condition;
use wade_core::frame::Vec3;
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_learn::random::Random;

/// Planted: water that moves with the hull ahead, over the water displaced.
const SURGE: f64 = 0.6;
/// Standard deviation of a measured force [N].
const NOISE: f64 = 8.0;

struct Place {
    folder: TempDir,
    vehicles: TempDir,
}

impl Place {
    fn new() -> Self {
        Self { folder: TempDir::new().expect("a folder"), vehicles: crate::common::copy_of_vehicles() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn wade(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
        command.args(arguments).env("WADE_VEHICLES", self.vehicles.path());
        command.output().expect("the program runs")
    }

    fn gap(&self, trials: &str, more: &[&str]) -> Output {
        let (trials, out) = (self.path(trials), self.path("gap"));
        let (trials, out) = (trials.to_string_lossy(), out.to_string_lossy());
        let nobody = format!("unix:{}", self.path("nobody.sock").display());
        let mut arguments = vec!["gap", "--vehicle", "warthog", "--trials", &trials, "--out", &out];
        arguments.extend(["--apply", "--server", &nobody]);
        arguments.extend(more);
        self.wade(&arguments)
    }

    fn query(&self) -> Value {
        let output = self.wade(&[
            "query",
            "--vehicle",
            "warthog",
            "--speed",
            "1",
            "--depth",
            "0.25",
            "--acceleration",
            "0.5,0,0",
            "--json",
        ]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).expect("JSON")
    }

    fn bundle(&self) -> Vec<(String, Vec<u8>)> {
        let entries = std::fs::read_dir(self.vehicles.path().join("warthog")).expect("readable");
        let mut files: Vec<_> = entries
            .map(|entry| {
                let entry = entry.expect("readable");
                let bytes = std::fs::read(entry.path()).expect("readable");
                (entry.file_name().to_string_lossy().into_owned(), bytes)
            })
            .collect();
        files.sort();
        files
    }
}

fn gaussian(random: &mut Random) -> f64 {
    (-2.0 * (1.0 - random.unit()).ln()).sqrt() * (std::f64::consts::TAU * random.unit()).cos()
}

/// Trials of the Warthog that speed up and slow down straight ahead in three depths: the model's force, the planted
/// effect by a formula of its own, and noise.
fn write_trials(folder: &Path, surge: f64) {
    write_trials_of(folder, surge, |_| true, None);
}

/// The same, of which only some change their speed; with a control, the same flow without the effect, both so many newtons off
/// along x from what the model says.
fn write_trials_of(folder: &Path, surge: f64, changes_speed: impl Fn(u32) -> bool, control: Option<f64>) {
    std::fs::create_dir_all(folder).expect("made");
    let sim_is = if control.is_some() { "[measured]\nsim_is = \"control\"\n" } else { "" };
    let manifest = format!(
        "vehicle = \"warthog\"\ngenerated = \"for a test\"\n{sim_is}[sensor_noise]\nfx = 8.0\nfz = 8.0\n"
    );
    std::fs::write(folder.join("trials.toml"), manifest).expect("written");
    let model = crate::common::model("warthog");
    let vehicle = model.vehicle();
    for trial in 0..10_u32 {
        let mut random = Random::new(u64::from(trial) + 1);
        let depth = [0.15, 0.22, 0.3][trial as usize % 3];
        let (top, rate) = (0.8 + 0.15 * f64::from(trial), 0.9 + 0.1 * f64::from(trial % 4));
        let swing = f64::from(u8::from(changes_speed(trial)));
        let plane = Condition::level(Vec3::zeros(), depth).water_plane(vehicle.z0);
        let volume = hydrostatics(&vehicle.hull.mesh, &plane, 1000.0, &Vec3::zeros()).displaced_volume;
        let mut text = String::from("t,vx,vy,vz,wx,wy,wz,depth,ax,ay,az,fx,fz");
        text.push_str(if control.is_some() { ",sim_fx,sim_fz\n" } else { "\n" });
        let mut recording = crate::common::Recording::of(&model);
        for sample in 0..400 {
            let t = 0.02 * f64::from(sample);
            let v = 0.5 * top * (1.0 - swing * (rate * t).cos());
            let a = 0.5 * top * swing * rate * (rate * t).sin();
            let state = Condition {
                acceleration: Vec3::new(a, 0.0, 0.0),
                ..Condition::level(Vec3::new(v, 0.0, 0.0), depth)
            };
            let force = recording.wrench(&state, None, if sample == 0 { 0.0 } else { 0.02 }).force;
            let (sim_fx, sim_fz) = (force.x + control.unwrap_or(0.0), force.z);
            let fx = sim_fx - surge * 1000.0 * volume * a + NOISE * gaussian(&mut random);
            let fz = sim_fz + NOISE * gaussian(&mut random);
            write!(text, "{t},{v},0,0,0,0,0,{depth},{a},0,0,{fx},{fz}").expect("a string");
            let simulated = control.map_or_else(String::new, |_| format!(",{sim_fx},{sim_fz}"));
            writeln!(text, "{simulated}").expect("a string");
        }
        std::fs::write(folder.join(format!("run{trial:02}.csv")), text).expect("written");
    }
}

#[test]
fn what_is_named_is_added_and_taken_back() {
    let place = Place::new();
    write_trials(&place.path("trials"), SURGE);
    let (before, bundle) = (place.query(), place.bundle());
    assert_eq!(before["effects"], Value::Array(Vec::new()));
    let output = place.gap("trials", &[]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stdout));
    assert!(said.contains("rollback") && said.contains("no server runs at"), "{said}");

    let after = place.query();
    let version = |answer: &Value| answer["version"].as_u64().expect("a number");
    assert_eq!(version(&after), version(&before) + 1);
    assert_eq!(after["effects"].as_array().map(Vec::len), Some(1), "{after:#}");
    let load = &after["effects"][0];
    assert_eq!((load["name"].as_str(), &load["left_out"]), (Some("added_mass"), &Value::Null));
    let model = crate::common::model("warthog");
    let plane = Condition::level(Vec3::zeros(), 0.25).water_plane(model.vehicle().z0);
    let volume = hydrostatics(&model.vehicle().hull.mesh, &plane, 1000.0, &Vec3::zeros()).displaced_volume;
    let (force, expected) = (load["force"][0].as_f64().expect("a number"), -SURGE * 1000.0 * volume * 0.5);
    assert!((force / expected - 1.0).abs() < 0.1, "{force}, planted {expected}");
    let fx = |answer: &Value| answer["wrench"]["force"][0].as_f64().expect("a number");
    assert!((fx(&after) - fx(&before) - force).abs() < 1e-3);
    let mass = |answer: &Value| answer["added_mass"][0][0].as_f64().expect("a number");
    assert!(((mass(&after) - mass(&before)) * 0.5 + force).abs() < 1e-3);

    // the same trials give the same effects, in the place of those before
    assert!(place.gap("trials", &[]).status.success());
    let again = place.query();
    assert_eq!((version(&again), &again["effects"]), (version(&before) + 2, &after["effects"]));
    let shown = place.wade(&["vehicle", "show", "warthog", "--json"]);
    let shown: Value = serde_json::from_slice(&shown.stdout).expect("JSON");
    assert_eq!(shown["effects"][0]["name"], "added_mass");
    assert_eq!(shown["kept"].as_array().map(Vec::len), Some(2), "{shown:#}");

    let nobody = format!("unix:{}", place.path("nobody.sock").display());
    for back in [version(&before) + 1, version(&before)] {
        let output = place.wade(&["vehicle", "rollback", "warthog", "--server", &nobody]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(version(&place.query()), back);
    }
    assert_eq!(place.bundle(), bundle, "bit for bit");
    assert_eq!(place.query()["wrench"], before["wrench"]);
    let output = place.wade(&["vehicle", "rollback", "warthog", "--server", &nobody]);
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn what_one_condition_shows_is_added_where_that_is_asked_for() {
    let place = Place::new();
    write_trials_of(&place.path("trials"), SURGE, |trial| [3, 7].contains(&trial), None);
    let bundle = place.bundle();
    let refused = place.gap("trials", &[]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(said.contains("added_mass was observed in one condition only"), "{said}{:?}", refused.stdout);
    assert!(said.contains("--provisional"), "{said}");
    assert_eq!(place.bundle(), bundle);
    assert!(!place.path("gap/effects.toml").exists());
    let output = place.gap("trials", &["--provisional"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("(provisional: one condition only)"));
    assert_eq!(place.query()["effects"][0]["name"], "added_mass");
    let file = std::fs::read_to_string(place.path("gap/effects.toml")).expect("written");
    assert!(file.contains("provisional = true"), "{file}");
}

#[test]
fn what_differs_from_a_control_is_added_and_what_another_simulator_lacks_is_not() {
    let place = Place::new();
    write_trials_of(&place.path("trials"), SURGE, |_| true, Some(150.0));
    let bundle = place.bundle();
    let manifest = place.path("trials").join("trials.toml");
    let text = std::fs::read_to_string(&manifest).expect("written");
    std::fs::write(&manifest, text.replace("sim_is = \"control\"", "")).expect("written");
    let output = place.gap("trials", &[]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("another simulator's"), "{said}");
    assert_eq!(place.bundle(), bundle);

    std::fs::write(&manifest, &text).expect("written");
    let output = place.gap("trials", &[]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("are a control"), "{said}");
    let answer = place.query();
    assert_eq!(answer["effects"][0]["name"], "added_mass", "{answer:#}");

    // a control that is not there
    write_trials(&place.path("alone"), SURGE);
    std::fs::write(place.path("alone").join("trials.toml"), &text).expect("written");
    let bundle = place.bundle();
    let output = place.gap("alone", &[]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && said.contains("measured.sim_is"), "{said}");
    assert_eq!(place.bundle(), bundle);
}

#[test]
fn where_nothing_is_missing_nothing_is_added() {
    let place = Place::new();
    write_trials(&place.path("trials"), 0.0);
    let bundle = place.bundle();
    let output = place.gap("trials", &[]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("nothing applied: nothing is missing"), "{said}");
    assert_eq!(place.bundle(), bundle);
    assert!(!place.path("gap/effects.toml").exists());
}

#[test]
fn bad_trials_leave_the_bundle_as_it_was() {
    let place = Place::new();
    write_trials(&place.path("trials"), SURGE);
    let bundle = place.bundle();
    let path = place.path("trials/run03.csv");
    let text = std::fs::read_to_string(&path).expect("readable");
    let lines: Vec<&str> = text.lines().collect();
    let line = lines[40].rsplit_once(',').expect("columns").0.to_owned() + ",nan";
    std::fs::write(&path, text.replacen(lines[40], &line, 1)).expect("written");
    let output = place.gap("trials", &[]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("run03.csv") && said.contains("fz") && said.contains("41"), "{said}");
    assert_eq!(place.bundle(), bundle);
    assert!(!place.path("gap").exists());
}

/// Changes a column of some trials, a value by its row from 0.
fn edit(folder: &Path, trials: std::ops::Range<usize>, column: &str, of: impl Fn(usize, f64) -> f64) {
    for trial in trials {
        let path = folder.join(format!("run{trial:02}.csv"));
        let text = std::fs::read_to_string(&path).expect("readable");
        let mut lines = text.lines();
        let header = lines.next().expect("a header");
        let place = header.split(',').position(|name| name == column).expect("the column");
        let mut edited = format!("{header}\n");
        for (row, line) in lines.enumerate() {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            cells[place] = of(row, cells[place].parse().expect("a number")).to_string();
            writeln!(edited, "{}", cells.join(",")).expect("a string");
        }
        std::fs::write(&path, edited).expect("written");
    }
}

#[test]
fn trials_that_cannot_be_what_they_are_said_to_be_leave_the_bundle_as_it_was() {
    let place = Place::new();
    let bundle = place.bundle();
    let refused = |edit: &dyn Fn(&Path), expected: &str| {
        let folder = place.path("trials");
        let _ = std::fs::remove_dir_all(&folder);
        write_trials(&folder, SURGE);
        edit(&folder);
        let output = place.gap("trials", &[]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(expected), "{said}");
        assert_eq!(place.bundle(), bundle);
        assert!(!place.path("gap").exists());
    };
    refused(&|folder| edit(folder, 0..10, "fx", |_, fx| fx / 1000.0), "is it in kN? It must be in N");
    refused(&|folder| edit(folder, 0..10, "fx", |_, fx| fx / 4.448), "is it in lbf? It must be in N");
    refused(&|folder| edit(folder, 0..10, "fx", |_, _| -20.0), "column fx: -20 in every row of every trial");
    let deep = |folder: &Path| edit(folder, 5..6, "depth", |_, depth| 20.0 * depth);
    refused(&deep, "run05.csv, row 2, column depth: 6 m of water over the ground");
    let copy = |folder: &Path| {
        std::fs::copy(folder.join("run02.csv"), folder.join("run99.csv")).expect("copied");
    };
    refused(&copy, "run99.csv holds the same samples as run02.csv");
    let of_another = |folder: &Path| {
        let path = folder.join("run04.csv");
        let text = std::fs::read_to_string(&path).expect("readable");
        let vehicle = |row: usize| if row == 0 { "vehicle" } else { "husky" };
        let lines = text.lines().enumerate().map(|(row, line)| format!("{line},{}\n", vehicle(row)));
        std::fs::write(&path, lines.collect::<String>()).expect("written");
    };
    refused(&of_another, "run04.csv: row 2, column vehicle: \"husky\" is not the vehicle of trials.toml");
    let empty = |folder: &Path| std::fs::write(folder.join("run10.csv"), "").expect("written");
    refused(&empty, "run10.csv: the file is empty");
    let twin = |folder: &Path| {
        let path = folder.join("trials.toml");
        let text = std::fs::read_to_string(&path).expect("readable");
        let text = text + "[measured]\ndry_twins = { run03 = \"run04\" }\n";
        std::fs::write(&path, text).expect("written");
    };
    refused(&twin, "run03.csv has a dry twin and a measured wrench");
}

#[test]
fn one_sample_of_a_sensor_that_failed_changes_nothing() {
    let place = Place::new();
    write_trials(&place.path("trials"), SURGE);
    edit(&place.path("trials"), 3..4, "fx", |row, fx| if row == 100 { 50_000.0 } else { fx });
    let folder = place.path("trials");
    let (folder, out) = (folder.to_string_lossy(), place.path("gap"));
    let nobody = format!("unix:{}", place.path("nobody.sock").display());
    let step = ["gap", "apply", "--vehicle", "warthog", "--trials", &folder, "--server", &nobody, "--out"];
    let output = place.wade(&[&step[..], &[&out.to_string_lossy()]].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    assert!(said.contains("run03: row 102, column fx: 50000 stands alone"), "{said}");
    let query = place.query();
    assert_eq!(query["effects"][0]["name"], "added_mass", "{query:#}");
    // without --apply nothing is written into a bundle, and what goes with it has no meaning
    let report = ["gap", "--vehicle", "warthog", "--trials", &folder, "--provisional", "--out"];
    let output = place.wade(&[&report[..], &[&out.to_string_lossy()]].concat());
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn effects_of_other_trials_are_not_lost_unasked() {
    let place = Place::new();
    write_trials(&place.path("trials"), SURGE);
    let squat = crate::common::effects_file(
        "warthog",
        vec![crate::common::effect(wade_core::effects::Effect::Squat, 0.4)],
    );
    let directory = place.vehicles.path().join("warthog");
    wade_core::bundle::apply(&directory, squat).expect("applied");
    let bundle = place.bundle();
    let output = place.gap("trials", &[]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("squat") && said.contains("run00") && said.contains("--replace"), "{said}");
    assert_eq!(place.bundle(), bundle);
    assert!(place.gap("trials", &["--replace"]).status.success());
    assert_eq!(place.query()["effects"][0]["name"], "added_mass");
}
