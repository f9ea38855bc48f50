//! Promise: metrics and probes answer over HTTP.

mod common;

use std::io::{Read, Write};
use std::net::TcpStream;

use common::Served;
use wade::client::Method;
use wade::service::wire::State;

fn get(served: &Served, path: &str) -> String {
    let address = served.running.http_address().expect("HTTP is on");
    let mut stream = TcpStream::connect(address).expect("connected");
    write!(stream, "GET {path} HTTP/1.1\r\nHost: wade\r\nConnection: close\r\n\r\n").expect("sent");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("received");
    answer
}

#[test]
fn a_served_query_shows_in_the_metrics() {
    let served = Served::start();
    let mut client = served.tcp("husky", Method::Unary);
    client.evaluate(&State { depth: 0.1, ..State::default() }).expect("answered");
    client.evaluate(&State { depth: -0.1, ..State::default() }).expect_err("refused");
    let text = get(&served, "/metrics");
    for expected in [
        r#"wade_request_duration_seconds_count{transport="grpc_unary",vehicle="husky"} 1"#,
        r#"wade_out_of_domain_total{transport="grpc_unary",vehicle="husky"} 1"#,
        r#"wade_refusals_total{transport="grpc_unary",reason="invalid_argument"} 1"#,
        r#"wade_bundle_version{vehicle="warthog"}"#,
        "# EOF",
    ] {
        assert!(text.contains(expected), "{expected} is not in\n{text}");
    }
}

#[test]
fn probes_say_live_and_ready() {
    let served = Served::start();
    assert!(get(&served, "/livez").starts_with("HTTP/1.1 200"));
    assert!(get(&served, "/readyz").starts_with("HTTP/1.1 200"));
    assert!(get(&served, "/nothing").starts_with("HTTP/1.1 404"));
}
