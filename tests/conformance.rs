//! Promise: library, gRPC and shared memory answer the same bits, one at a time and in batches.

mod common;

use std::sync::Arc;

use common::{Numbers, Served, VEHICLES, comparable, served_vehicle};
use wade_client::{InProcess, Reply};
use wade_core::physics::Physics;
use wade_wire::State;

fn states(count: usize) -> Vec<State> {
    let mut numbers = Numbers::new(42);
    (0..count).map(|_| numbers.state()).collect()
}

#[test]
fn every_transport_answers_the_same_bits() {
    let served = Served::start();
    for vehicle in VEHICLES {
        let vehicle_served = Arc::new(served_vehicle(vehicle));
        let mut alone = InProcess::new(Arc::clone(&vehicle_served));
        let mut in_session = InProcess::new(vehicle_served).in_session();
        let mut clients = served.clients(vehicle);
        for state in states(100) {
            let alone = comparable(alone.evaluate(&state).expect("valid"));
            let in_session = comparable(in_session.evaluate(&state).expect("valid"));
            for (name, client) in &mut clients {
                let expected = if name.ends_with("stream") { &in_session } else { &alone };
                let reply = comparable(client.evaluate(&state).expect("answered"));
                assert_eq!(&reply, expected, "{vehicle} over {name}: {state:?}");
            }
        }
    }
}

#[test]
fn a_session_in_which_no_time_passes_answers_as_states_alone() {
    for vehicle in VEHICLES {
        let vehicle = Arc::new(served_vehicle(vehicle));
        let (mut alone, mut in_session) =
            (InProcess::new(Arc::clone(&vehicle)), InProcess::new(vehicle).in_session());
        for state in states(100) {
            let state = State { time_step: 0.0, ..state };
            let [alone, in_session] = [&mut alone, &mut in_session]
                .map(|client| comparable(client.evaluate(&state).expect("valid")));
            assert_eq!(alone, in_session, "{state:?}");
        }
    }
}

#[test]
fn a_batch_answers_the_bits_of_its_states_alone() {
    let served = Served::start();
    for vehicle in VEHICLES {
        let mut library = InProcess::new(Arc::new(served_vehicle(vehicle)));
        // a batch has one ground contact for all, so it is the same here for each
        let states: Vec<State> =
            states(150).into_iter().map(|state| State { dry_contact: false, ..state }).collect();
        let expected: Vec<Reply> =
            states.iter().map(|state| comparable(library.evaluate(state).expect("valid"))).collect();
        for (name, mut client) in served.clients(vehicle) {
            let replies = client.evaluate_batch(&states).expect("answered");
            let replies: Vec<Reply> = replies.into_iter().map(comparable).collect();
            assert_eq!(replies, expected, "{vehicle} over {name}");
        }
    }
}

#[test]
fn the_physics_of_the_server_answers_what_states_none_over_every_transport() {
    for setting in Physics::ALL {
        let served = Served::with(|config| config.physics = setting);
        // at the weights' own steady states nothing of the base is left to differ
        let moving = State { acceleration: [1.0, 0.0, 0.0], ..State::still(0.2) };
        let states = [moving, State { velocity: [0.5, 0.5, 0.1], gravity: [0.6, 0.0, -0.8], ..moving }];
        let mut library = InProcess::new(Arc::new(served_vehicle("husky")));
        let mut expected = |physics: Physics| -> Vec<Reply> {
            let stated = states.map(|state| State { physics: Some(physics), ..state });
            stated.iter().map(|state| comparable(library.evaluate(state).expect("valid"))).collect()
        };
        let [unstated, full] = [setting, Physics::Full].map(&mut expected);
        assert_eq!(unstated == full, setting == Physics::Full, "the states show the setting");
        for (name, mut client) in served.clients("husky") {
            for (physics, expected) in [(None, &unstated), (Some(Physics::Full), &full)] {
                let states = states.map(|state| State { physics, ..state });
                let single = |state: &State| comparable(client.evaluate(state).expect("answered"));
                let replies: Vec<Reply> = states.iter().map(single).collect();
                assert_eq!(&replies, expected, "{setting:?} over {name}, {physics:?}");
                let replies = client.evaluate_batch(&states).expect("answered");
                let replies: Vec<Reply> = replies.into_iter().map(comparable).collect();
                assert_eq!(&replies, expected, "{setting:?} over {name} in a batch, {physics:?}");
            }
        }
    }
}

#[test]
fn every_transport_names_the_same_bad_field_and_serves_the_next_request() {
    let served = Served::start();
    let good = State { depth: 0.1, ..State::default() };
    let bad = [
        (State { depth: f32::INFINITY, ..good }, "depth_m"),
        (State { depth: f32::NAN, ..good }, "depth_m"),
        (State { water_level: Some(0.1), ..good }, "water_level_m"),
        (State { gravity: [0.0, 0.0, 1.0], ..good }, "depth_m"),
        (State { bed_clearance: Some(-1.0), ..good }, "bed_clearance_m"),
        (State { bed: Some(2.0), ..good }, "bed"),
        (State { velocity: [f32::NAN, 0.0, 0.0], ..good }, "velocity_mps"),
        (State { density: 0.0, ..good }, "density_kgpm3"),
        (State { gravity: [0.0, 0.0, -2.0], ..good }, "gravity_direction"),
        (State { current: [f32::INFINITY, 0.0, 0.0], ..good }, "current_mps"),
    ];
    for (name, mut client) in served.clients("husky") {
        for (state, field) in bad {
            let error = client.evaluate(&state).expect_err("a bad state").to_string();
            assert!(error.contains(field), "{name}: {error}");
            let error = client.evaluate_batch(&[good, state]).expect_err("a bad batch").to_string();
            assert!(error.contains(field), "{name}: {error}");
            client.evaluate(&good).expect("the next request is served");
        }
        client.evaluate_batch(&[]).expect_err("an empty batch");
        client.evaluate_batch(&[good]).expect("the next batch is served");
    }
}
