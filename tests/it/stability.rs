//! Promise: how a vehicle stands is answered with the same bits by the library, the command, gRPC and HTTP, for a hundred thousand
//! states in one call, and a request that is wrong is refused by the name of its field.

use std::process::Command;
use std::time::Duration;

use crate::common::http::{get, post};
use crate::common::{Served, VEHICLES, served_vehicle};
use serde_json::{Value, json};
use wade_client::{ClientError, GrpcClient, Method};
use wade_wire::{Evaluator, MAX_STATES, proto};

fn request(vehicle: &str, depths: usize, speeds: usize) -> proto::GetStabilityRequest {
    let to = |last: f32, count: usize| (0..count).map(|i| last * (i as f32 / (count - 1) as f32)).collect();
    proto::GetStabilityRequest {
        vehicle: vehicle.into(),
        depth_m: to(0.6, depths),
        speed_mps: to(2.5, speeds),
        heading_rad: 1.2,
        normal_forces: true,
        ..proto::GetStabilityRequest::default()
    }
}

fn library(request: &proto::GetStabilityRequest) -> proto::GetStabilityResponse {
    let vehicle = served_vehicle(&request.vehicle);
    let response = wade_wire::stability(request, &vehicle, &mut Evaluator::default()).expect("sound");
    proto::GetStabilityResponse { compute_ns: 0, ..response }
}

fn patient(served: &Served, vehicle: &str) -> GrpcClient {
    GrpcClient::tcp(&served.url(), vehicle, Method::Unary, Duration::from_secs(120)).expect("connected")
}

fn asked(client: &mut GrpcClient, request: &proto::GetStabilityRequest) -> proto::GetStabilityResponse {
    let response = client.stability(request.clone()).expect("answered");
    assert!(response.compute_ns > 0);
    proto::GetStabilityResponse { compute_ns: 0, ..response }
}

#[test]
fn every_way_to_ask_has_the_same_answer() {
    let served = Served::start();
    let address = served.running.http_address().expect("HTTP is on");
    for vehicle in VEHICLES {
        let request = request(vehicle, 7, 5);
        let expected = library(&request);
        assert_eq!(expected.in_domain.len(), 35);
        assert_eq!(expected.normal_force_n.len(), 35 * 4);
        assert_eq!(asked(&mut patient(&served, vehicle), &request), expected);
        assert_eq!(asked(&mut served.unix(vehicle, Method::Unary), &request), expected);
        let body = json!({
            "vehicle": vehicle, "depth_m": request.depth_m, "speed_mps": request.speed_mps, "heading_rad": 1.2_f32,
            "normal_forces": true,
        });
        let http = post(address, "/v1/stability", &body.to_string()).json();
        let command = Command::new(env!("CARGO_BIN_EXE_wade"))
            .args([
                "stability",
                "--vehicle",
                vehicle,
                "--depth",
                "0:0.6:7",
                "--speed",
                "0:2.5:5",
                "--heading",
                "1.2",
            ])
            .arg("--json")
            .output()
            .expect("the program runs");
        let command: Value = serde_json::from_slice(&command.stdout).expect("JSON");
        let (probability, margin) = (expected.probability.expect("there"), expected.margin.expect("there"));
        for document in [http, command] {
            let numbers = |path: &str| -> Vec<f32> {
                let rows = document.pointer(path).and_then(Value::as_array).expect("rows");
                assert_eq!(rows.len(), 7, "{path}");
                let number = |value: &Value| value.as_f64().map_or(f32::INFINITY, |value| value as f32);
                rows.iter().flat_map(|row| row.as_array().expect("a row").iter().map(number)).collect()
            };
            assert_eq!(numbers("/floats"), probability.floats);
            assert_eq!(numbers("/slides"), probability.slides);
            assert_eq!(numbers("/topples"), probability.topples);
            assert_eq!(numbers("/steers"), probability.steers);
            assert_eq!(numbers("/margins/floats"), margin.floats);
            assert_eq!(numbers("/margins/slides"), margin.slides);
            assert_eq!(numbers("/margins/topples"), margin.topples);
            assert_eq!(numbers("/margins/steers"), margin.steers);
            assert_eq!(numbers("/friction_needed"), expected.friction_needed);
            let foot = document["normal_forces"][2]["surface"].as_str();
            assert_eq!(foot, Some(expected.feet[2].surface.as_str()));
        }
    }
}

#[test]
fn a_hundred_thousand_states_are_one_call() {
    let served = Served::start();
    let request = proto::GetStabilityRequest { normal_forces: false, ..request("husky", 400, 250) };
    let response = asked(&mut patient(&served, "husky"), &request);
    let slides = response.probability.expect("there").slides;
    assert_eq!(slides.len(), MAX_STATES);
    assert!(slides.iter().all(|slides| (0.0..=1.0).contains(slides)));
    // dry at rest, and deep in a fast current
    assert!(slides[0] == 0.0 && slides[MAX_STATES - 1] > 0.999, "{} {}", slides[0], slides[MAX_STATES - 1]);
}

#[test]
fn a_single_state_has_numbers_and_exit_status_says_whether_the_risk_is_held() {
    let run = |more: &[&str]| {
        let base = ["stability", "--vehicle", "warthog", "--depth", "0.35", "--speed", "1.5"];
        Command::new(env!("CARGO_BIN_EXE_wade")).args(base).args(more).output().expect("the program runs")
    };
    let output = run(&["--friction", "0.6", "--json"]);
    let document: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    for name in ["floats", "slides", "topples", "steers"] {
        assert!(document[name].is_number() && document["margins"][name].is_number(), "{document}");
    }
    assert_eq!(document["friction"]["min"], document["friction"]["max"]);
    assert_eq!(run(&["--heading", "1.571", "--risk", "0.1"]).status.code(), Some(1));
    assert_eq!(run(&["--risk", "1"]).status.code(), Some(0));
}

#[test]
fn what_is_wrong_is_refused_by_name() {
    let served = Served::start();
    let mut client = patient(&served, "husky");
    let sound = request("husky", 2, 2);
    let refused =
        |client: &mut GrpcClient, request: proto::GetStabilityRequest| match client.stability(request) {
            Err(ClientError::Refused { message, .. }) => message,
            other => panic!("{other:?}"),
        };
    let slope = |roll_rad: f32| Some(proto::RollPitch { roll_rad, pitch_rad: 0.0 });
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let cases = [
        (proto::GetStabilityRequest { depth_m: vec![], ..sound.clone() }, "depth_m must have"),
        (proto::GetStabilityRequest { speed_mps: vec![], ..sound.clone() }, "speed_mps must have"),
        (
            proto::GetStabilityRequest {
                depth_m: vec![0.1; 400],
                speed_mps: vec![1.0; 251],
                ..sound.clone()
            },
            "100400",
        ),
        (proto::GetStabilityRequest { depth_m: vec![0.1, nan], ..sound.clone() }, "depth_m[1]"),
        (proto::GetStabilityRequest { speed_mps: vec![0.1, inf], ..sound.clone() }, "speed_mps[1]"),
        (proto::GetStabilityRequest { speed_mps: vec![-0.1], ..sound.clone() }, "speed_mps[0]"),
        (proto::GetStabilityRequest { heading_rad: nan, ..sound.clone() }, "heading_rad"),
        (proto::GetStabilityRequest { friction_min: Some(0.0), ..sound.clone() }, "friction_min"),
        (
            proto::GetStabilityRequest { friction_min: Some(0.5), friction_max: Some(0.4), ..sound.clone() },
            "friction_max",
        ),
        (proto::GetStabilityRequest { density_kgpm3: Some(-1.0), ..sound.clone() }, "density_kgpm3"),
        (proto::GetStabilityRequest { roll_pitch: slope(1.6), ..sound.clone() }, "roll_pitch"),
        (proto::GetStabilityRequest { roll_pitch: slope(nan), ..sound.clone() }, "roll_pitch.roll_rad"),
        (proto::GetStabilityRequest { ground_contact: 7, ..sound.clone() }, "ground_contact"),
        (proto::GetStabilityRequest { bed: Some(1.5), ..sound.clone() }, "bed"),
        (proto::GetStabilityRequest { vehicle: "hovercraft".into(), ..sound.clone() }, "hovercraft"),
    ];
    for (request, name) in cases {
        let message = refused(&mut client, request);
        assert!(message.contains(name), "{name}: {message}");
    }
    assert_eq!(asked(&mut client, &sound), library(&sound), "and the next request is answered");
    let address = served.running.http_address().expect("HTTP is on");
    let answer = get(address, "/v1/stability?vehicle=husky&depth_m=0.1&depth_m=0.2&speed_mps=-1").json();
    assert_eq!(answer["error"]["field_violations"][0]["field"], "speed_mps[0]");
}
