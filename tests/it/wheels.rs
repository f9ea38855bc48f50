//! Promise: a vehicle with other wheels than four takes a speed for each of them, the same bits on every transport, and a number
//! of speeds that does not fit it is refused with the field, both numbers and the names of the wheels.

#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

use serde_json::Value;
use tempfile::TempDir;
use wade_client::{Client, InProcess};
use wade_core::bundle;
use wade_core::model::kernel::Isa;
use wade_core::vehicle::PerWheel;
use wade_wire::State;

use crate::common::{Served, comparable, vehicles};

const NAMES: &str = "wheel_left_1, wheel_right_1, wheel_left_2, wheel_right_2, wheel_left_3, wheel_right_3";

fn wade(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_wade")).args(args).output().unwrap()
}

/// A folder with a vehicle `six` of six wheels.
fn folder() -> TempDir {
    let wheel = |index: usize| {
        let (x, y) = ([0.2, 0.0, -0.2][index / 2], [0.12, -0.12][index % 2]);
        format!(
            r#"<link name="w{index}"><visual><origin rpy="1.5707963267948966 0 0"/>
            <geometry><cylinder radius="0.07" length="0.06"/></geometry></visual>
            <inertial><mass value="0.2"/><inertia ixx="1e-4" iyy="1e-4" izz="2e-4"/></inertial></link>
            <joint name="j{index}" type="continuous"><parent link="base"/><child link="w{index}"/>
            <origin xyz="{x} {y} 0.07"/><axis xyz="0 1 0"/></joint>"#
        )
    };
    let base = r#"<link name="base"><visual><origin xyz="0 0 0.12"/><geometry><box size="0.5 0.16 0.1"/></geometry></visual>
        <inertial><mass value="5"/><inertia ixx="0.02" iyy="0.03" izz="0.04"/></inertial></link>"#;
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("six.urdf");
    let wheels: String = (0..6).map(wheel).collect();
    std::fs::write(&file, format!(r#"<robot name="six">{base}{wheels}</robot>"#)).unwrap();
    let out = folder.path().join("vehicles/six");
    let output = wade(&["vehicle", "import", file.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    folder
}

fn library(folder: &Path) -> InProcess {
    let served = bundle::load_served(&folder.join("vehicles/six"), Isa::available()[0]).unwrap();
    InProcess::new(Arc::new(served))
}

fn turning(speeds: &[f32]) -> State {
    State { velocity: [0.2, 0.1, 0.0], wheel_speeds: PerWheel::new(speeds), ..State::still(0.1) }
}

#[test]
fn six_wheels_take_six_speeds_on_every_transport() {
    let folder = folder();
    let served = Served::with(|config| config.vehicles = folder.path().join("vehicles"));
    let mut library = library(folder.path());
    let clients = served.clients("six").into_iter().filter(|(name, _)| !name.contains("stream"));
    let mut clients: Vec<(&str, Client)> = clients.collect();
    let mut before = None;
    for last in [30.0, -30.0] {
        let states =
            [turning(&[10.0, 12.0, 14.0, -16.0, 18.0, last]), turning(&[0.0, 1.0, 2.0, 3.0, 4.0, last])];
        let expected = states.map(|state| comparable(library.evaluate(&state).unwrap()));
        for (name, client) in &mut clients {
            let alone = states.map(|state| comparable(client.evaluate(&state).unwrap()));
            assert_eq!(alone, expected, "{name}");
            let batch: Vec<_> = client.evaluate_batch(&states).unwrap().into_iter().map(comparable).collect();
            assert_eq!(batch, expected, "batch over {name}");
        }
        assert!(expected.iter().all(|reply| reply.base.unwrap().shaft_power > 0.0), "over every transport");
        // the last speed is that of the last wheel
        let push = expected[0].surfaces.last().unwrap().force[0];
        assert!(before.is_none_or(|before: f32| before > push), "{before:?} {push}");
        before = Some(push);
    }
    for given in [1, 2, 4, 8] {
        let state = turning(&vec![3.0; given]);
        let values = if given == 1 { "1 value".to_owned() } else { format!("{given} values") };
        let says = format!("wheel_speed_radps has {values}, and the vehicle has 6 wheels");
        assert_eq!(library.evaluate(&state).unwrap_err().to_string(), format!("{says} ({NAMES})"));
        for (name, client) in &mut clients {
            for states in [vec![state], vec![state; 3]] {
                let error = client.evaluate_batch(&states).unwrap_err().to_string();
                assert!(error.contains(&says), "{name}: {error}");
                // shared memory has no names
                assert!(error.contains(NAMES) != name.contains("shm"), "{name}: {error}");
            }
            assert!(client.evaluate(&turning(&[1.0; 6])).is_ok(), "{name}");
        }
    }
}

#[test]
fn the_shipped_vehicles_name_their_four_wheels() {
    let served = bundle::load_served(&vehicles().join("husky"), Isa::available()[0]).unwrap();
    let error = InProcess::new(Arc::new(served)).evaluate(&turning(&[1.0; 6])).unwrap_err().to_string();
    let expected = "wheel_speed_radps has 6 values, and the vehicle has 4 wheels (wheel_fl, wheel_fr, wheel_rl, wheel_rr)";
    assert_eq!(error, expected);
}

#[test]
fn the_command_takes_a_speed_for_each_wheel_and_tables_have_their_names() {
    let folder = folder();
    let bundles = folder.path().join("vehicles");
    let fixed = ["query", "--vehicles", bundles.to_str().unwrap(), "--vehicle", "six", "--depth", "0.1"];
    let query = |speeds: &str| wade(&[&fixed[..], &["--json", "--wheel-speeds", speeds]].concat());
    let output = query("1,2,3,4,5,6");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    let refused = query("1,2,3,4");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && said.contains("6 wheels") && said.contains(NAMES), "{said}");
    assert_eq!(query("1,2,3,4,5,6,7,8,9").status.code(), Some(2));

    let (states, out) = (folder.path().join("states.csv"), folder.path().join("out.csv"));
    let header = format!("vx,vy,vz,depth,wheel_fl,{}", NAMES.replace(", ", ","));
    std::fs::write(&states, format!("{header}\n0,0,0,0.1,9,1,2,3,4,5,6\n0,0,0,0.1,9,1,2,3,4,5,\n")).unwrap();
    let output = wade(&[
        "predict",
        "--vehicles",
        bundles.to_str().unwrap(),
        "--vehicle",
        "six",
        "--states",
        states.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("column wheel_fl is kept and not used"), "{said}");
    let mut reader = csv::Reader::from_path(&out).unwrap();
    let place = reader.headers().unwrap().iter().position(|name| name == "fx").unwrap();
    let forces: Vec<f64> = reader.records().map(|row| row.unwrap()[place].parse().unwrap()).collect();
    let asked = answer["wrench"]["force"][0].as_f64().unwrap();
    assert!((forces[0] - asked).abs() < 1e-4 * asked.abs(), "{forces:?} {asked}");
    assert!(forces[1].abs() < 1e-9, "a row without the speed of one wheel has none: {forces:?}");
}
