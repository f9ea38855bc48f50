//! Promise: effects answer the same bits on every transport; what they remember belongs to one run; they come with a reload
//! and go with a rollback, under load, without an error.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::common::{
    Numbers, Served, VEHICLES, comparable, copy_of_vehicles, copy_with_every_effect, effect, effects_file,
    every_effect, served_with,
};
use wade_client::{Client, InProcess, Method, Reply};
use wade_core::bundle;
use wade_core::effects::{ActiveEffect, Effect, EffectRegion, LeftOut, RegionLimit, RegionQuantity};
use wade_core::model::kernel::Isa;
use wade_wire::State;
use wade_wire::shm::Wait;

fn states(count: usize) -> Vec<State> {
    let mut numbers = Numbers::new(7);
    (0..count).map(|_| numbers.state()).collect()
}

/// A run in time with a changing depth.
fn run(phase: f32) -> Vec<State> {
    let at = |i: u16| {
        let t = f32::from(i) * 0.05 + phase;
        State {
            velocity: [0.6 + 0.3 * t.sin(), 0.05, 0.0],
            acceleration: [0.3 * t.cos(), 0.0, 0.0],
            depth: 0.12 + 0.04 * t.cos(),
            time_step: 0.05,
            ..State::default()
        }
    };
    (0..40).map(at).collect()
}

fn from(folder: &std::path::Path, vehicle: &str) -> InProcess {
    let served = bundle::load_served(&folder.join(vehicle), Isa::available()[0]).expect("sound");
    InProcess::new(Arc::new(served))
}

#[test]
fn every_transport_answers_the_same_bits_with_every_effect() {
    let folder = copy_with_every_effect();
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    for vehicle in VEHICLES {
        let mut library = from(folder.path(), vehicle);
        // a stream is a session, in which effects remember; the others are compared as single states
        let clients = served.clients(vehicle).into_iter().filter(|(name, _)| !name.contains("stream"));
        let mut clients: Vec<(&str, Client)> = clients.collect();
        for state in states(50) {
            for state in [state, State { implicit_added_mass: true, wheel_speeds: None, ..state }] {
                let expected = comparable(library.evaluate(&state).expect("valid"));
                assert!(expected.effects.len() == 15 && expected.added_mass.is_some());
                for (name, client) in &mut clients {
                    let reply = comparable(client.evaluate(&state).expect("answered"));
                    assert_eq!(reply, expected, "{vehicle} over {name}: {state:?}");
                }
            }
        }
    }
}

#[test]
fn a_batch_with_every_effect_answers_the_bits_of_its_states_alone() {
    let folder = copy_with_every_effect();
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    let mut library = from(folder.path(), "husky");
    let states: Vec<State> =
        states(70).into_iter().map(|state| State { dry_contact: false, ..state }).collect();
    let expected: Vec<Reply> =
        states.iter().map(|state| comparable(library.evaluate(state).expect("valid"))).collect();
    for (name, mut client) in served.clients("husky") {
        let replies = client.evaluate_batch(&states).expect("answered");
        let replies: Vec<Reply> = replies.into_iter().map(comparable).collect();
        assert_eq!(replies, expected, "over {name}");
    }
}

#[test]
fn a_session_is_the_same_over_every_transport_that_has_one_and_each_has_its_own() {
    let folder = copy_with_every_effect();
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    let stream = || Client::Grpc(Box::new(served.tcp("husky", Method::Stream)));
    let unix = || Client::Grpc(Box::new(served.unix("husky", Method::Stream)));
    let shm = |session: u64| Client::Shm(Box::new(served.shm("husky", Wait::Block).in_session(session)));
    // pairs of runs that are asked turn by turn: what one remembers must not reach the other
    for (name, mut clients) in [
        ("tcp stream", [stream(), stream()]),
        ("unix stream", [unix(), unix()]),
        ("shm, the same number of two clients", [shm(5), shm(5)]),
        ("shm, two numbers", [shm(1), shm(2)]),
    ] {
        let mut alone = [(); 2].map(|()| from(folder.path(), "husky").in_session());
        let mut differ = false;
        for (first, second) in run(0.0).into_iter().zip(run(1.5)) {
            let mut replies = Vec::new();
            for ((client, alone), state) in clients.iter_mut().zip(&mut alone).zip([first, second]) {
                let reply = comparable(client.evaluate(&state).expect("answered"));
                assert_eq!(reply, comparable(alone.evaluate(&state).expect("valid")), "{name}");
                assert!(reply.effects.iter().all(|load| load.left_out != Some(LeftOut::NoSession)));
                replies.push(reply);
            }
            let memory = |reply: &Reply| {
                reply.effects.iter().find(|load| load.effect == Effect::WaveMemory).expect("there").force
            };
            differ |= memory(&replies[0]) != memory(&replies[1]);
        }
        assert!(differ, "{name}: the two runs remember different things");
    }
}

#[test]
fn a_region_is_stated_and_its_effect_has_the_same_bits_over_every_transport() {
    let folder = copy_of_vehicles();
    let limits = vec![
        RegionLimit { quantity: RegionQuantity::Depth, above: Some([0.1, 0.2]), at_most: None },
        RegionLimit { quantity: RegionQuantity::Speed, above: None, at_most: Some([1.0, 2.0]) },
    ];
    let effect =
        ActiveEffect { region: EffectRegion { limits }, ..effect(Effect::DragCoefficientError, 0.3) };
    bundle::apply(&folder.path().join("husky"), effects_file("husky", vec![effect])).expect("applied");
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    let described = served.tcp("husky", Method::Unary).vehicle().expect("known");
    let region: Vec<_> = described.effects[0]
        .region
        .iter()
        .map(|limit| (limit.quantity.as_str(), limit.unit.as_str(), &limit.above[..], &limit.at_most[..]))
        .collect();
    assert_eq!(region, [("depth", "m", &[0.1, 0.2][..], &[][..]), ("speed", "m/s", &[], &[1.0, 2.0])]);
    let mut alone = from(folder.path(), "husky");
    let clients = served.clients("husky").into_iter().filter(|(name, _)| !name.contains("stream"));
    let mut clients: Vec<(&str, Client)> = clients.collect();
    let mut forces = Vec::new();
    for state in run(0.0) {
        let expected = comparable(alone.evaluate(&state).expect("valid"));
        for (name, client) in &mut clients {
            assert_eq!(comparable(client.evaluate(&state).expect("answered")), expected, "{name}");
        }
        forces.push(expected.effects[0].force[0].abs());
    }
    assert!(forces.iter().any(|force| *force > 0.0), "{forces:?}");
}

#[test]
fn a_batch_over_shared_memory_steps_many_runs_at_once() {
    let folder = copy_with_every_effect();
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    let mut client = served.shm("husky", Wait::Block).in_session(9);
    let mut alone = from(folder.path(), "husky").in_session();
    let states = run(0.0);
    // the states of one session within a batch follow each other
    let replies = client.evaluate_batch(&states).expect("answered");
    for (answer, state) in replies.iter().zip(&states) {
        assert_eq!(comparable(Reply::from(answer)), comparable(alone.evaluate(state).expect("valid")));
    }
}

#[test]
fn a_server_says_what_was_added_to_a_vehicle() {
    let folder = copy_with_every_effect();
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    let vehicle = served.tcp("husky", Method::Unary).vehicle().expect("known");
    assert_eq!(vehicle.effects.len(), 15);
    let added_mass = &vehicle.effects[0];
    assert_eq!((added_mass.name.as_str(), added_mass.effect), ("added_mass", 1));
    assert!(added_mass.equation.contains("M_A") && !added_mass.provisional);
    let surge = added_mass.parameters.iter().find(|parameter| parameter.name == "surge").expect("there");
    assert_eq!((surge.value, surge.unit.as_str()), (0.15, "1"));
    assert!((surge.std - 0.015).abs() < 1e-12);
    assert_eq!(vehicle.effects_validity.len(), 5);
    assert_eq!((vehicle.effects_validity[1].quantity, vehicle.effects_validity[1].maximum), (2, 10.0));
}

#[test]
fn effects_come_with_a_reload_and_go_with_a_rollback_under_load() {
    let folder = copy_of_vehicles();
    let husky = folder.path().join("husky");
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    let state = State { heading: Some(0.0), ..run(0.0)[3] };
    let bare = served.tcp("husky", Method::Unary).evaluate(&state).expect("answered");
    let reload = || {
        let reloaded = served.running.reloader().reload("husky").expect("served");
        assert!(reloaded[0].refusal.is_none(), "{reloaded:?}");
        reloaded[0].served_version
    };
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let names = ["tcp unary", "unix stream", "shm blocking"];
        let workers = names.map(|name| {
            let (served, stop, state) = (&served, &stop, &state);
            scope.spawn(move || {
                let clients = served.clients("husky");
                let (_, mut client) = clients.into_iter().find(|(n, _)| *n == name).expect("known");
                let mut seen = Vec::new();
                while !stop.load(Ordering::Relaxed) {
                    let reply = client.evaluate(state).expect("no error while bundles are swapped");
                    // never the effects of one version with the number of another
                    let has_effects = !reply.effects.is_empty();
                    if seen.last() != Some(&(reply.version, has_effects)) {
                        seen.push((reply.version, has_effects));
                    }
                    std::thread::sleep(std::time::Duration::from_millis(1));
                }
                seen
            })
        });
        let pause = || std::thread::sleep(std::time::Duration::from_millis(300));
        pause();
        let applied = bundle::apply(&husky, every_effect("husky")).expect("applied");
        assert_eq!((applied, reload()), (bare.bundle_version + 1, applied));
        pause();
        let with = served.tcp("husky", Method::Unary).evaluate(&state).expect("answered");
        assert_ne!(with.wrench, bare.wrench);
        let back = bundle::roll_back(&husky, None).expect("kept");
        assert_eq!((back, reload()), (bare.bundle_version, back));
        let after = served.tcp("husky", Method::Unary).evaluate(&state).expect("answered");
        assert_eq!(after.wrench, bare.wrench, "the same bits as before");
        pause();
        stop.store(true, Ordering::Relaxed);
        for worker in workers {
            let version = bare.bundle_version;
            assert_eq!(
                worker.join().expect("no panic"),
                [(version, false), (version + 1, true), (version, false)]
            );
        }
    });
}

#[test]
fn a_vehicle_with_effects_answers_as_the_library_does() {
    // the bundle on disk and the file in memory are the same effects
    let folder = copy_with_every_effect();
    let mut from_disk = from(folder.path(), "warthog");
    let mut in_memory = InProcess::new(Arc::new(served_with("warthog", every_effect("warthog"))));
    for state in states(20) {
        let disk = comparable(from_disk.evaluate(&state).expect("valid"));
        let memory = comparable(in_memory.evaluate(&state).expect("valid"));
        assert_eq!(disk.effects, memory.effects);
        assert_eq!(disk.force, memory.force);
    }
}

#[test]
fn a_session_over_shared_memory_says_when_it_begins() {
    use wade_wire::shm::layout::SESSION_BEGINS;
    let served = Served::start();
    let mut client = served.shm("husky", Wait::Block).in_session(3);
    let state = run(0.0)[0];
    let begins = |answer: wade_wire::shm::layout::Answer| answer.flags & SESSION_BEGINS != 0;
    client.evaluate(&State { depth: f32::NAN, ..state }).expect_err("refused");
    assert!(begins(client.evaluate(&state).expect("answered")), "a query that was refused begins nothing");
    assert!(!begins(client.evaluate(&state).expect("answered")));
    let mut other = served.shm("husky", Wait::Block).in_session(3);
    assert!(begins(other.evaluate(&state).expect("answered")), "another client's run is another run");
    let mut single = served.shm("husky", Wait::Block);
    assert!(!begins(single.evaluate(&state).expect("answered")), "a single state is no run");
}

#[test]
fn a_table_in_time_is_a_session() {
    use std::fmt::Write;
    let folder = copy_with_every_effect();
    let (states, out) = (folder.path().join("in.csv"), folder.path().join("out.csv"));
    let step = 0.0625;
    let mut text = String::from("t,vx,vy,vz,ax,depth,yaw\n");
    for (i, state) in (0_u16..).zip(run(0.0)) {
        let ([vx, vy, vz], ax) = (state.velocity, state.acceleration[0]);
        writeln!(text, "{},{vx},{vy},{vz},{ax},{},0.5", f32::from(i) * step, state.depth).expect("a string");
    }
    std::fs::write(&states, text).expect("written");
    let predict = |states: &std::path::Path| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_wade"));
        command.args(["predict", "--vehicle", "husky", "--states"]).arg(states).arg("--out").arg(&out);
        command.env("WADE_VEHICLES", folder.path()).output().expect("the program runs")
    };
    assert!(predict(&states).status.success());
    let mut alone = from(folder.path(), "husky").in_session();
    let mut reader = csv::Reader::from_path(&out).expect("a table");
    let headers = reader.headers().expect("headers").clone();
    let fz = headers.iter().position(|header| header == "fz").expect("a column");
    for ((i, record), state) in reader.records().enumerate().zip(run(0.0)) {
        let time_step = if i == 0 { 0.0 } else { step };
        let state = State { time_step, heading: Some(0.5), ..state };
        let expected = alone.evaluate(&state).expect("valid").force[2];
        let found: f32 = record.expect("a row")[fz].parse().expect("a number");
        assert!((found - expected).abs() <= 1e-5 * expected.abs(), "row {i}: {found} {expected}");
    }
    std::fs::write(&states, "t,vx,vy,vz,depth\n1,0.5,0,0,0.1\n0.5,0.5,0,0,0.1\n").expect("written");
    let output = predict(&states);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.code() == Some(1) && said.contains("row 3") && said.contains("order of time"),
        "{said}"
    );
}
