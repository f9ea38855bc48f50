//! HTTP/1: whatever a peer sends before it stops sending is answered or refused, and the connection ends.

use std::io::Write;
use std::net::{Shutdown, TcpStream};

use crate::server;

/// As they come off the wire.
pub fn run(bytes: &[u8]) {
    // what stays open until its reader goes
    if bytes.windows(b"/v1/streams".len()).any(|window| window == b"/v1/streams") {
        return;
    }
    let mut stream = TcpStream::connect(server::http()).expect("a connection");
    stream.set_read_timeout(Some(server::PATIENCE)).expect("a socket");
    // a port would wait for a minute after each
    rustix::net::sockopt::set_socket_linger(&stream, Some(std::time::Duration::ZERO)).expect("a socket");
    // it may refuse before it has read all
    let _ = stream.write_all(bytes);
    let _ = stream.shutdown(Shutdown::Write);
    let answer = server::read_to_end(&mut stream);
    assert!(answer.is_empty() || answer.starts_with(b"HTTP/1."), "{:?}", String::from_utf8_lossy(&answer));
}

/// A request of each kind.
pub fn seeds() -> Vec<Vec<u8>> {
    let get = |path: &str| format!("GET {path} HTTP/1.1\r\nhost: localhost\r\n\r\n").into_bytes();
    let post = |path: &str, body: &str| {
        let head = "content-type: application/json\r\nconnection: close";
        format!(
            "POST {path} HTTP/1.1\r\nhost: localhost\r\n{head}\r\ncontent-length: {}\r\n\r\n{body}",
            body.len()
        )
        .into_bytes()
    };
    let state = r#"{"vehicle":"husky","state":{"depth_m":0.2,"velocity_mps":{"x":0.8},"roll_pitch":{"roll_rad":0.1}}}"#;
    let batch = r#"{"vehicle":"husky","depth_m":[0.1,0.2],"velocity_mps":[0.8,0,0,0.5,0,0]}"#;
    vec![
        get("/"),
        get("/metrics"),
        get("/livez"),
        get("/readyz"),
        get("/v1/vehicles/husky"),
        get("/v1/vehicles/husky/hull"),
        get("/v1/vehicles/husky/versions"),
        get("/v1/query?vehicle=husky&depth_m=0.2&velocity_mps=0.8,0,0"),
        get("/v1/stability?vehicle=husky&depth_m=0.2&speed_mps=1"),
        post("/v1/query", state),
        post("/v1/batch", batch),
        post("/v1/stability", r#"{"vehicle":"husky","states":[{"depth_m":0.3,"speed_mps":1.5}]}"#),
        [get("/livez"), get("/readyz")].concat(),
    ]
}
