//! Promise: derivatives are answered where they are asked for, with the same bits on every transport that has room for them, and
//! refused with the reason where there are none.

use std::sync::Arc;

use crate::common::{Numbers, Served, VEHICLES, comparable, copy_with_every_effect};
use wade_client::{Client, ClientError, InProcess, Reply};
use wade_core::bundle;
use wade_core::model::kernel::Isa;
use wade_wire::State;

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

/// Clients that have room for derivatives.
fn clients(served: &Served, vehicle: &str) -> Vec<(&'static str, Client)> {
    served.clients(vehicle).into_iter().filter(|(name, _)| !name.contains("shm")).collect()
}

#[test]
fn every_transport_answers_the_same_derivatives() {
    let served = Served::start();
    for vehicle in VEHICLES {
        let mut library = library(&shipped(), vehicle);
        let states = states(40);
        let expected: Vec<Reply> =
            states.iter().map(|state| comparable(library.evaluate(state).expect("valid"))).collect();
        assert!(
            expected
                .iter()
                .all(|reply| reply.jacobian.is_some_and(|numbers| numbers.iter().all(|x| x.is_finite())))
        );
        let clients = clients(&served, vehicle);
        assert!(clients.len() > 3);
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

fn reason(result: Result<Reply, ClientError>) -> String {
    result.expect_err("refused").to_string()
}

#[test]
fn where_there_are_no_derivatives_the_answer_says_why() {
    let folder = copy_with_every_effect();
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    let state = State { jacobian: true, ..State::still(0.2) };
    for (name, mut client) in clients(&served, "husky") {
        let reason = reason(client.evaluate(&state));
        assert!(reason.contains("jacobian") && reason.contains("carries effects"), "{name}: {reason}");
        client.evaluate(&State { jacobian: false, ..state }).expect("answered");
    }
    let served = Served::start();
    for (name, mut client) in served.clients("husky").into_iter().filter(|(name, _)| name.contains("shm")) {
        let reason = reason(client.evaluate(&state));
        assert!(reason.contains("jacobian"), "{name}: {reason}");
        client.evaluate(&State { jacobian: false, ..state }).expect("answered");
    }
}
