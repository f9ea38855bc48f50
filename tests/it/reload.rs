//! Promise: a bundle is replaced while it is served, without an error, and a bad one leaves the one before it.

use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::common::{PATIENCE, Served, copy_of_vehicles};
use hdrhistogram::Histogram;
use tempfile::TempDir;
use wade_client::{ClientError, Method};
use wade_core::bundle;
use wade_wire::State;
use wade_wire::proto;
use wade_wire::shm::Wait;

fn state() -> State {
    State { depth: 0.15, velocity: [0.5, 0.0, 0.0], ..State::default() }
}

/// Writes the next version of a bundle over the one in place.
fn write_next_version(folder: &std::path::Path) -> u32 {
    let mut next = bundle::read(folder).expect("a sound bundle");
    next.version += 1;
    bundle::write(folder, &next).expect("written");
    next.version
}

#[test]
fn a_new_version_is_served_after_a_reload_over_every_transport() {
    let folder = copy_of_vehicles();
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    let mut clients = served.clients("husky");
    let before = clients[0].1.evaluate(&state()).expect("answered").version;
    let version = write_next_version(&folder.path().join("husky"));
    assert_eq!(version, before + 1);
    for (name, client) in &mut clients {
        assert_eq!(
            client.evaluate(&state()).expect("answered").version,
            before,
            "{name}: not before it is asked for"
        );
    }
    let reloaded = served.running.reloader().reload("husky").expect("served");
    assert!(reloaded.iter().all(|reload| reload.refusal.is_none()), "{reloaded:?}");
    for (name, client) in &mut clients {
        assert_eq!(client.evaluate(&state()).expect("answered").version, version, "{name}");
    }
}

#[test]
fn a_bad_bundle_is_refused_over_grpc_and_the_old_version_stays() {
    let folder = copy_of_vehicles();
    let served = Served::with(|config| {
        config.vehicles = folder.path().to_owned();
        config.grpc.admin_over_tcp = true;
    });
    let before = served.tcp("husky", Method::Unary).evaluate(&state()).expect("answered");
    std::fs::write(folder.path().join("husky/hull.stl"), b"not a hull").expect("written");
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let response = runtime.block_on(async {
        let endpoint = tonic::transport::Endpoint::from_shared(served.url()).expect("a URL");
        let channel = endpoint.connect().await.expect("connected");
        let mut admin = proto::admin_client::AdminClient::new(channel);
        let unknown = proto::ReloadRequest { vehicle: "../husky".into(), ..Default::default() };
        assert_eq!(admin.reload(unknown).await.expect_err("no such vehicle").code(), tonic::Code::NotFound);
        admin.reload(proto::ReloadRequest::default()).await.expect("answered").into_inner()
    });
    let of = |name: &str| response.vehicles.iter().find(|reloaded| reloaded.vehicle == name).expect("listed");
    assert!(of("husky").refusal.contains("hull.stl"), "{}", of("husky").refusal);
    assert!(of("warthog").refusal.is_empty());
    let after = served.tcp("husky", Method::Unary).evaluate(&state()).expect("still served");
    assert_eq!(after.bundle_version, before.bundle_version);
    assert_eq!(after.wrench, before.wrench);
}

#[test]
fn the_command_line_has_a_server_read_its_bundles_again_and_says_what_it_refused() {
    let folder = copy_of_vehicles();
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    let socket = format!("unix:{}", served.config.grpc.unix_socket.display());
    let reload = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
        let output = command.args(["vehicle", "reload", "--server", &socket]).args(arguments).output();
        let output = output.expect("the program runs");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let version = write_next_version(&folder.path().join("husky"));
    let (code, said) = reload(&[]);
    assert!(code == Some(0) && said.contains(&format!("now serves husky, version {version}")), "{said}");
    assert!(said.contains("now serves warthog"), "{said}");
    std::fs::write(folder.path().join("husky/hull.stl"), b"not a hull").expect("written");
    let (code, said) = reload(&["husky"]);
    assert!(code == Some(1) && said.contains(&format!("goes on with version {version} of husky")), "{said}");
    assert!(said.contains("hull.stl"), "{said}");
    let (code, said) = reload(&["rover"]);
    assert!(code == Some(1) && said.contains("rover"), "{said}");
}

#[test]
fn a_change_of_another_folder_leaves_a_server_alone() {
    let (ours, theirs) = (copy_of_vehicles(), copy_of_vehicles());
    let link = theirs.path().join("link");
    std::os::unix::fs::symlink(ours.path(), &link).expect("a link");
    let served = Served::with(|config| config.vehicles = ours.path().to_owned());
    let mut client = served.tcp("husky", Method::Unary);
    let mut version = || client.evaluate(&state()).expect("answered").bundle_version;
    let before = version();
    let socket = format!("unix:{}", served.config.grpc.unix_socket.display());
    let rollback = |folder: &std::path::Path| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
        command.args(["vehicle", "rollback", "husky", "--server", &socket, "--vehicles"]).arg(folder);
        let output = command.output().expect("the program runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        said
    };
    // versions that the server has not been asked to read, kept as the commands that write bundles keep them
    let succeed = |folder: &TempDir| {
        let husky = folder.path().join("husky");
        let bundle = bundle::read(&husky).expect("a sound bundle");
        bundle::succeed(&husky, bundle).expect("written")
    };
    succeed(&ours);
    let next = succeed(&ours);
    succeed(&theirs);
    let said = rollback(theirs.path());
    assert!(said.contains("serves husky from another folder"), "{said}");
    assert_eq!(version(), before, "what others change is not read");
    let said = rollback(&link);
    assert!(said.contains(&format!("now serves husky, version {}", next - 1)), "{said}");
    assert_eq!(version(), next - 1);
}

#[test]
fn a_vehicle_that_is_added_is_served_over_every_transport() {
    let folder = copy_of_vehicles();
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    let mut shm = served.shm("rover", Wait::Block);
    assert!(matches!(shm.evaluate(&state()), Err(ClientError::UnknownVehicle { .. })));
    crate::common::rover(folder.path());
    served.running.reloader().reload("").expect("reloaded");
    served.tcp("rover", Method::Unary).evaluate(&state()).expect("served over gRPC");
    let start = Instant::now();
    while let Err(error) = shm.evaluate(&state()) {
        assert!(start.elapsed() < PATIENCE, "never served over shared memory: {error}");
    }
}

/// Reloads in this test, one a second.
const RELOADS: u32 = 4;

#[test]
fn reloads_every_second_under_load_cause_no_error_and_no_mixture() {
    let folder = copy_of_vehicles();
    let served = Served::with(|config| config.vehicles = folder.path().to_owned());
    let stop = Arc::new(AtomicBool::new(false));
    let loads: Vec<_> = served
        .clients("husky")
        .into_iter()
        .filter(|(name, _)| ["tcp unary", "unix stream", "shm blocking"].contains(name))
        .map(|(name, _)| name)
        .collect();
    std::thread::scope(|scope| {
        let served = &served;
        let workers: Vec<_> = loads
            .iter()
            .map(|&name| {
                let stop = Arc::clone(&stop);
                scope.spawn(move || {
                    // a shared-memory client stays with its thread, so each thread makes its own
                    let clients = served.clients("husky");
                    let (_, mut client) = clients.into_iter().find(|(n, _)| *n == name).expect("known");
                    let mut versions = vec![0];
                    let mut latency = [(); 2].map(|()| Histogram::<u64>::new(3).expect("valid"));
                    let begin = Instant::now();
                    let forces = client.evaluate(&state()).expect("answered").force;
                    while !stop.load(Ordering::Relaxed) {
                        let start = Instant::now();
                        let reply = client.evaluate(&state()).expect("no error while bundles are swapped");
                        // the first second comes before the first reload: the control
                        let reloading = usize::from(begin.elapsed() > Duration::from_secs(1));
                        latency[reloading].saturating_record(start.elapsed().as_nanos() as u64);
                        assert_eq!(reply.force, forces, "every version has these weights");
                        if versions.last() != Some(&reply.version) {
                            versions.push(reply.version);
                        }
                        std::thread::sleep(Duration::from_millis(1));
                    }
                    (versions, latency)
                })
            })
            .collect();
        for _ in 0..RELOADS {
            std::thread::sleep(Duration::from_secs(1));
            write_next_version(&folder.path().join("husky"));
            let reloaded = served.running.reloader().reload("husky").expect("served");
            assert!(reloaded[0].refusal.is_none());
        }
        std::thread::sleep(Duration::from_millis(200));
        stop.store(true, Ordering::Relaxed);
        for (worker, name) in workers.into_iter().zip(&loads) {
            let (versions, latency) = worker.join().expect("no panic");
            assert!(versions.is_sorted(), "{name}: never back to an older version: {versions:?}");
            assert_eq!(versions.len() as u32, RELOADS + 2, "{name}: every version was seen: {versions:?}");
            // shown, not asserted: a time depends on the machine
            for (what, latency) in ["without reloads", "with"].into_iter().zip(&latency) {
                let us = |quantile| latency.value_at_quantile(quantile) / 1000;
                println!("{name}, {what}: p50 {} us, p99 {} us of {}", us(0.5), us(0.99), latency.len());
            }
        }
    });
}
