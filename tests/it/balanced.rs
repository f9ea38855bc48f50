//! Promise: behind a proxy, a server that dies costs no call but those in flight, and one that ends costs none.

use std::net::TcpListener;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tempfile::TempDir;
use wade_client::{GrpcClient, Method};

use crate::common::process::{Process, state};
use crate::common::{PATIENCE, namespace, vehicles};

/// Callers, each with a connection of its own and one call at a time.
const CALLERS: usize = 8;

/// Ports that nobody listens on just now.
fn ports<const N: usize>() -> [u16; N] {
    let listeners = [(); N].map(|()| TcpListener::bind("127.0.0.1:0").unwrap());
    listeners.map(|listener| listener.local_addr().unwrap().port())
}

fn server(folder: &TempDir, grpc: u16, http: u16) -> Process {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    command.args(["serve", "--shm", "off", "--unix-socket", "", "--log", "error", "--with-parent"]);
    command.args(["--listen", &format!("127.0.0.1:{grpc}"), "--http", &format!("127.0.0.1:{http}")]);
    command.args(["--namespace", &namespace(), "--vehicles"]).arg(vehicles());
    let server = Process::of(command.current_dir(folder.path()).env_remove("WADE_CONFIG"));
    await_answer(&format!("http://127.0.0.1:{grpc}"));
    server
}

fn await_answer(url: &str) {
    let start = Instant::now();
    let asked = || GrpcClient::tcp(url, "husky", Method::Unary, PATIENCE)?.vehicle();
    while let Err(error) = asked() {
        assert!(start.elapsed() < PATIENCE, "{error}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// How a call went.
struct Call {
    begun: Instant,
    ended: Instant,
    fault: Option<String>,
}

/// Asks one thing after the other until told to stop.
fn ask(url: &str, stop: &AtomicBool) -> Vec<Call> {
    let mut calls = Vec::new();
    let mut client = GrpcClient::tcp(url, "husky", Method::Unary, PATIENCE).unwrap();
    let mut first = None;
    while !stop.load(Ordering::Relaxed) {
        let begun = Instant::now();
        let answer = client.evaluate(&state());
        let ended = Instant::now();
        let fault = match answer {
            Ok(answer) => {
                let now = answer.wrench;
                assert_eq!(*first.get_or_insert(now), now, "the servers differ");
                None
            }
            Err(error) => Some(error.to_string()),
        };
        calls.push(Call { begun, ended, fault });
        std::thread::sleep(Duration::from_millis(1));
    }
    calls
}

#[test]
fn a_server_that_dies_costs_the_calls_in_flight_and_one_that_ends_none() {
    if Command::new("haproxy").arg("-v").output().is_err() {
        println!("skipped: haproxy is not installed");
        return;
    }
    let folder = TempDir::new().unwrap();
    let [front, first, second, first_http, second_http] = ports();
    let settings = include_str!("../../deploy/haproxy.cfg")
        .replace(":50050", &format!(":{front}"))
        .replace(":50051", &format!(":{first}"))
        .replace(":50052", &format!(":{second}"))
        .replace("9464", &first_http.to_string())
        .replace("9465", &second_http.to_string());
    let file = folder.path().join("haproxy.cfg");
    std::fs::write(&file, settings).unwrap();
    let dies = server(&folder, first, first_http);
    let ends = server(&folder, second, second_http);
    let _proxy = Process::of(Command::new("haproxy").arg("-f").arg(&file).stderr(Stdio::null()));
    let url = format!("http://127.0.0.1:{front}");
    await_answer(&url);
    let client = |method| GrpcClient::tcp(&url, "husky", method, PATIENCE).unwrap();
    let unary = client(Method::Unary).evaluate(&state()).unwrap();
    assert_eq!(client(Method::Stream).evaluate(&state()).unwrap().wrench, unary.wrench);

    let stop = AtomicBool::new(false);
    let pause = || std::thread::sleep(Duration::from_secs(1));
    let (killed, dead, back, calls) = std::thread::scope(|scope| {
        let callers = [(); CALLERS].map(|()| scope.spawn(|| ask(&url, &stop)));
        pause();
        let killed = Instant::now();
        dies.kill();
        let dead = Instant::now();
        pause();
        let again = server(&folder, first, first_http);
        pause();
        let back = Instant::now();
        ends.terminate();
        pause();
        stop.store(true, Ordering::Relaxed);
        let calls: Vec<Call> = callers.into_iter().flat_map(|caller| caller.join().unwrap()).collect();
        drop(again);
        (killed, dead, back, calls)
    });
    let failed: Vec<&Call> = calls.iter().filter(|call| call.fault.is_some()).collect();
    let after = calls.iter().filter(|call| call.begun > back).count();
    println!("{} calls, {} failed, {after} after the second ended", calls.len(), failed.len());
    for call in &failed {
        let fault = call.fault.as_deref().unwrap_or_default();
        assert!(call.begun <= dead && killed <= call.ended, "not in flight at the end: {fault}");
    }
    assert!(failed.len() <= CALLERS);
    assert!(after > CALLERS, "nobody was answered after the second server ended");
}
