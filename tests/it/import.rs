//! Promise: `wade vehicle import` writes a whole bundle or nothing, and says in JSON what it made.

#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;
use wade_core::bundle;

const CAR: &str = r#"<robot name="car">
 <link name="base"><visual><origin xyz="0 0 0.07"/><geometry><box size="0.36 0.2 0.08"/></geometry></visual>
  <inertial><mass value="3"/><inertia ixx="0.02" iyy="0.03" izz="0.04"/></inertial></link>
 WHEELS</robot>"#;

const WHEEL: &str = r#"<link name="NAME"><visual><origin rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.05" length="0.06"/></geometry></visual>
  <inertial><mass value="0.2"/><inertia ixx="1e-4" iyy="1e-4" izz="2e-4"/></inertial></link>
 <joint name="j_NAME" type="continuous"><parent link="base"/><child link="NAME"/><origin xyz="X Y 0.05"/><axis xyz="0 1 0"/></joint>"#;

fn car() -> String {
    let wheel =
        |(name, x, y): (&str, &str, &str)| WHEEL.replace("NAME", name).replace('X', x).replace('Y', y);
    let wheels =
        [("a", "0.12", "0.12"), ("b", "0.12", "-0.12"), ("c", "-0.12", "0.12"), ("d", "-0.12", "-0.12")];
    CAR.replace("WHEELS", &wheels.map(wheel).concat())
}

/// Imports a car with four wheels; the folder of the vehicles.
pub fn imported_car(folder: &Path) -> std::path::PathBuf {
    let output = import(folder, &car(), &[]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("#vehicle=car&depth=0.0") && said.contains("&color=surface"), "{said}");
    folder.join("vehicles")
}

fn import(folder: &Path, text: &str, further: &[&str]) -> Output {
    let file = folder.join("car.urdf");
    std::fs::write(&file, text).unwrap();
    let out = folder.join("vehicles/car");
    let fixed = ["vehicle", "import", file.to_str().unwrap(), "--out", out.to_str().unwrap()];
    Command::new(env!("CARGO_BIN_EXE_wade")).args([&fixed[..], further].concat()).output().unwrap()
}

#[test]
fn a_robot_becomes_a_bundle_with_the_names_of_the_json() {
    let folder = TempDir::new().unwrap();
    let output = import(folder.path(), &car(), &["--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["name"], "car");
    let surfaces: Vec<&str> = json["surfaces"]
        .as_array()
        .unwrap()
        .iter()
        .map(|surface| surface["name"].as_str().unwrap())
        .collect();
    let expected = "front rear left right bottom wheel_fl wheel_fr wheel_rl wheel_rr";
    assert_eq!(surfaces, expected.split(' ').collect::<Vec<_>>());
    let number = |name: &str| json[name].as_f64().unwrap();
    for (name, value) in [("length", 0.36), ("width", 0.3), ("height", 0.11), ("mass", 3.8)] {
        assert!((number(name) - value).abs() < 1e-6, "{name} {}", number(name));
    }
    // box and wheels less half of what they share
    assert!((0.0065..0.0077).contains(&number("displaced_volume")), "{}", number("displaced_volume"));
    assert!((0.03..0.11).contains(&number("float_depth")), "{}", number("float_depth"));
    assert_eq!(json["warnings"].as_array().unwrap().len(), 0, "{}", json["warnings"]);
    let bundle = bundle::read(&folder.path().join("vehicles/car")).unwrap();
    assert!(
        bundle.vehicle.symmetric_left_right && bundle.vehicle.symmetric_front_rear,
        "a box with equal wheels"
    );
    assert_eq!(json["version"], bundle.version);
    // the Warthog's patch by radius and width of the wheel
    let patch = 0.155 / 0.305 * 0.05 * 0.06;
    let contacts = &bundle.vehicle.contacts;
    assert!(contacts.len() == 4 && contacts.iter().all(|contact| (contact.area / patch - 1.0).abs() < 1e-9));
}

#[test]
fn a_name_may_be_another_than_the_folder_and_the_mass_another_than_the_sum() {
    let folder = TempDir::new().unwrap();
    let output = import(folder.path(), &car(), &["--name", "rover", "--mass", "5"]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("floats in fresh water") && said.contains("displaced volume"), "{said}");
    assert!(!said.contains("-0.0"), "{said}");
    let bundle = bundle::read(&folder.path().join("vehicles/car/rover")).unwrap();
    assert_eq!((bundle.vehicle.name.as_str(), bundle.vehicle.mass), ("rover", 5.0));
}

#[test]
fn an_import_that_fails_leaves_nothing_and_keeps_what_was_there() {
    let folder = TempDir::new().unwrap();
    let open = car().replace(r#"<box size="0.36 0.2 0.08"/>"#, r#"<mesh filename="no.stl"/>"#);
    let output = import(folder.path(), &open, &[]);
    assert_eq!(output.status.code(), Some(1));
    assert!(!folder.path().join("vehicles").exists(), "nothing half-written");
    assert!(import(folder.path(), &car(), &[]).status.success());
    let place = folder.path().join("vehicles/car");
    let before = bundle::read(&place).unwrap().version;
    assert_eq!(import(folder.path(), &open, &[]).status.code(), Some(1));
    assert_eq!(bundle::read(&place).unwrap().version, before);
}

/// Everything in a folder and below it.
fn listed(folder: &Path) -> Vec<std::path::PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let entries = entries.map(|entry| entry.unwrap().path());
    let mut all: Vec<_> = entries.flat_map(|path| [listed(&path), vec![path]].concat()).collect();
    all.sort();
    all
}

#[test]
fn a_write_that_fails_leaves_nothing_new_in_the_folder() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("car.urdf");
    std::fs::write(&file, car()).unwrap();
    // as a full disk: no file may grow beyond 2 KB, which the hull does
    let on_a_full_disk = |out: &str| {
        let limited = "trap '' XFSZ; ulimit -f 4; exec \"$@\"";
        let arguments = ["vehicle", "import", file.to_str().unwrap(), "--name", "car", "--out", out];
        let shell = ["-c", limited, "sh", env!("CARGO_BIN_EXE_wade")];
        Command::new("sh").args(shell).args(arguments).current_dir(folder.path()).output().unwrap()
    };
    for out in ["vehicles/car", "deep/er/car", "car"] {
        let output = on_a_full_disk(out);
        assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.contains("File too large"), "{said}");
        assert_eq!(listed(folder.path()), [file.as_path()], "neither folder, lock nor staging");
    }
    assert!(import(folder.path(), &car(), &[]).status.success());
    let (place, before) = (folder.path().join("vehicles/car"), listed(folder.path()));
    let version = bundle::read(&place).unwrap().version;
    assert_eq!(on_a_full_disk("vehicles/car").status.code(), Some(1));
    assert_eq!((listed(folder.path()), bundle::read(&place).unwrap().version), (before, version));
    // a file where a folder should be
    let below = file.join("car");
    assert_eq!(on_a_full_disk(below.to_str().unwrap()).status.code(), Some(1));
}

#[test]
fn an_import_that_is_interrupted_leaves_a_whole_bundle_or_nothing() {
    use nix::sys::signal::{Signal, kill};
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("car.urdf");
    std::fs::write(&file, car()).unwrap();
    for (round, signal) in (0..60).zip([Signal::SIGINT, Signal::SIGTERM].into_iter().cycle()) {
        let out = folder.path().join(format!("vehicles{round}/car"));
        let arguments = ["vehicle", "import", file.to_str().unwrap(), "--out", out.to_str().unwrap()];
        let mut child = Command::new(env!("CARGO_BIN_EXE_wade"))
            .args(arguments)
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(2 * round));
        let _ = kill(nix::unistd::Pid::from_raw(child.id() as i32), signal);
        child.wait().unwrap();
        let vehicles = out.parent().unwrap();
        if vehicles.exists() {
            bundle::read(&out).unwrap();
            assert_eq!(
                std::fs::read_dir(vehicles).unwrap().count(),
                2,
                "the bundle and its lock: {:?}",
                listed(vehicles)
            );
        }
    }
}
