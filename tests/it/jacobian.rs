//! Promise: derivatives are answered where they are asked for, with the same bits on every transport, and refused with the reason
//! where there are none.

use std::sync::Arc;

use crate::common::paper::put_into;
use crate::common::{Numbers, Served, VEHICLES, comparable, copy_of_vehicles, copy_with_every_effect};
use wade_client::{Client, InProcess, Method, Reply};
use wade_core::bundle;
use wade_core::model::kernel::Isa;
use wade_wire::State;
use wade_wire::shm::Wait;

fn library(folder: &std::path::Path, vehicle: &str) -> InProcess {
    let served = bundle::load_served(&folder.join(vehicle), Isa::available()[0]).expect("sound");
    InProcess::new(Arc::new(served))
}

fn shipped() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("vehicles")
}

fn states(count: usize) -> Vec<State> {
    let mut numbers = Numbers::new(31);
    // a stream is a session of its own
    let state = |_| State { jacobian: true, dry_contact: false, time_step: 0.0, ..numbers.state() };
    (0..count).map(state).collect()
}

/// Every transport answers what the library does. A stream is a session, in which effects remember.
fn check(served: &Served, folder: &std::path::Path, streams: bool) {
    for vehicle in VEHICLES {
        let mut library = library(folder, vehicle);
        let states = states(40);
        let expected: Vec<Reply> =
            states.iter().map(|state| comparable(library.evaluate(state).expect("valid"))).collect();
        assert!(
            expected
                .iter()
                .all(|reply| reply.jacobian.is_some_and(|numbers| numbers.iter().all(|x| x.is_finite())))
        );
        let mut clients = served.clients(vehicle);
        clients.retain(|(name, _)| streams || !name.contains("stream"));
        assert!(clients.len() >= 4);
        for (name, mut client) in clients {
            for (state, expected) in states.iter().zip(&expected) {
                let reply = comparable(client.evaluate(state).expect("answered"));
                assert_eq!(reply, *expected, "{vehicle} over {name}: {state:?}");
                let without = client.evaluate(&State { jacobian: false, ..*state }).expect("answered");
                assert_eq!(without.jacobian, None, "{name}");
                assert_eq!(without.force, reply.force, "{name}");
            }
            let replies = client.evaluate_batch(&states).expect("answered");
            let replies: Vec<Reply> = replies.into_iter().map(comparable).collect();
            assert_eq!(replies, expected, "{vehicle} over {name} in a batch");
        }
    }
}

#[test]
fn every_transport_answers_the_same_derivatives() {
    check(&Served::start(), &shipped(), true);
}

#[test]
fn those_of_a_vehicle_with_effects_too() {
    let folder = copy_with_every_effect();
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    check(&served, folder.path(), false);
}

#[test]
fn a_run_with_derivatives_and_without_is_one() {
    let served = Served::start();
    let states: Vec<State> = states(20)
        .into_iter()
        .enumerate()
        .map(|(i, state)| State { time_step: 0.01, jacobian: i % 3 == 1, ..state })
        .collect();
    let mut library = library(&shipped(), "husky").in_session();
    let expected: Vec<Reply> =
        states.iter().map(|state| comparable(library.evaluate(state).expect("valid"))).collect();
    let shm = served.shm("husky", Wait::Block).in_session(5);
    let clients = [Client::Shm(Box::new(shm)), Client::Grpc(Box::new(served.tcp("husky", Method::Stream)))];
    for mut client in clients {
        for (state, expected) in states.iter().zip(&expected) {
            assert_eq!(comparable(client.evaluate(state).expect("answered")), *expected, "{client:?}");
        }
    }
}

#[test]
fn where_there_are_no_derivatives_the_answer_says_why() {
    // the paper's network stands on no base
    let folder = copy_of_vehicles();
    put_into(&folder.path().join("husky"));
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    let state = State { jacobian: true, ..State::still(0.2) };
    for (name, mut client) in served.clients("husky") {
        let reason = client.evaluate(&state).expect_err("refused").to_string();
        assert!(reason.contains("jacobian"), "{name}: {reason}");
        assert!(name.contains("shm") || reason.contains("physical base"), "{name}: {reason}");
        client.evaluate(&State { jacobian: false, ..state }).expect("answered");
    }
}
