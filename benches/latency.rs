//! Round trips over every transport, one after the other, both ends on one core and on a core each, beside controls from
//! the same run: a raw Unix-socket echo, and a gRPC call that computes nothing. Nothing here fails on a time.
//!
//! `cargo bench --bench latency [-- --out benches/results]` prints a table, and writes it as CSV with machine and commit.

mod common;

use std::hint::black_box;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use common::{Row, Subject, Table};
use tempfile::TempDir;
use tonic::transport::Endpoint;
use wade::config::Config;
use wade::cores;
use wade::server::{self, Running};
use wade_client::{Client, GrpcClient, Method, ShmClient};
use wade_wire::State;
use wade_wire::proto;
use wade_wire::proto::hydrodynamics_client::HydrodynamicsClient;
use wade_wire::shm::Wait;

const TIMEOUT: Duration = Duration::from_secs(5);

/// Every surface of a Husky is wet.
fn state() -> State {
    State { velocity: [0.6, 0.2, 0.0], depth: 0.35, ..State::default() }
}

/// A server on the cores that this thread is kept on.
struct Served {
    running: Running,
    config: Config,
    _folder: TempDir,
}

impl Served {
    fn start(wait: Wait) -> Self {
        let folder = TempDir::new().expect("a folder");
        let mut config = Config {
            vehicles: PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("vehicles"),
            ..Config::default()
        };
        config.grpc.listen = "127.0.0.1:0".into();
        config.grpc.unix_socket = folder.path().join("wade.sock");
        config.http.listen = "127.0.0.1:0".into();
        config.shm.wait = wait;
        config.shm.program = env!("CARGO_BIN_EXE_wade").into();
        config.shm.namespace = format!("bench-{}-{wait:?}", std::process::id());
        Self { running: server::start(&config).expect("the server starts"), config, _folder: folder }
    }

    fn url(&self) -> String {
        format!("http://{}", self.running.grpc_address().expect("TCP is on"))
    }

    fn grpc(&self, method: Method, unix: bool) -> Client {
        let client = if unix {
            GrpcClient::unix(self.config.grpc.unix_socket.clone(), "husky", method, TIMEOUT)
        } else {
            GrpcClient::tcp(&self.url(), "husky", method, TIMEOUT)
        };
        Client::Grpc(Box::new(client.expect("the server is there")))
    }

    fn shm(&self, wait: Wait) -> Client {
        Client::Shm(Box::new(ShmClient::new("husky", wait, TIMEOUT).in_namespace(&self.config.shm.namespace)))
    }

    /// A unary call that computes nothing.
    fn list_vehicles(&self) -> impl FnMut() + use<> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        let endpoint = Endpoint::from_shared(self.url()).expect("a URL");
        let channel = runtime.block_on(endpoint.connect()).expect("the server is there");
        let mut client = HydrodynamicsClient::new(channel);
        move || {
            let answer = runtime.block_on(client.list_vehicles(proto::ListVehiclesRequest {}));
            black_box(answer.expect("answered"));
        }
    }
}

/// A thread on this thread's cores that sends back what it gets.
fn echo() -> impl FnMut() {
    let (mut near, mut far) = UnixStream::pair().expect("a pair of sockets");
    std::thread::spawn(move || {
        let mut bytes = [0; 96];
        // it ends with the other half
        while far.read_exact(&mut bytes).is_ok() && far.write_all(&bytes).is_ok() {}
    });
    let mut bytes = [0; 96];
    move || {
        near.write_all(&bytes).expect("sent");
        near.read_exact(&mut bytes).expect("echoed");
    }
}

/// Queries a second of a page whose user drags a slider: one a frame.
const FRAMES_PER_SECOND: u32 = 60;

/// Works while a page asks over HTTP, each query on a connection of its own, which costs the server more than a browser does.
fn beside_a_page(address: SocketAddr, work: impl FnOnce()) {
    let body = r#"{"vehicle": "husky", "state": {"depth_m": 0.35}}"#;
    let request = format!(
        "POST /v1/query HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    );
    let closed = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !closed.load(Ordering::Relaxed) {
                let mut stream = TcpStream::connect(address).expect("connected");
                stream.write_all(request.as_bytes()).expect("sent");
                let mut answer = String::new();
                stream.read_to_string(&mut answer).expect("answered");
                assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
                std::thread::sleep(Duration::from_secs(1) / FRAMES_PER_SECOND);
            }
        });
        work();
        closed.store(true, Ordering::Relaxed);
    });
}

fn evaluate(mut client: Client) -> Box<dyn FnMut()> {
    let state = state();
    Box::new(move || {
        black_box(client.compute(&[state]).expect("answered"));
    })
}

fn measure(table: &mut Table, placement: &str, server_core: usize, client_core: usize) {
    cores::pin_to(&[server_core]).expect("a core");
    let blocking = Served::start(Wait::Block);
    let (raw, raw_beside) = (echo(), echo());
    cores::pin_to(&[client_core]).expect("a core");
    let row = |name: &str| Row::new(format!("{name}, {placement}"), 0);
    let mut subjects: Vec<Subject> = vec![
        (row("control: Unix-socket echo"), Box::new(raw)),
        (row("control: gRPC call without computation"), Box::new(blocking.list_vehicles())),
        (row("gRPC unary, TCP"), evaluate(blocking.grpc(Method::Unary, false))),
        (row("gRPC unary, Unix socket"), evaluate(blocking.grpc(Method::Unary, true))),
        (row("gRPC stream, TCP"), evaluate(blocking.grpc(Method::Stream, false))),
        (row("gRPC stream, Unix socket"), evaluate(blocking.grpc(Method::Stream, true))),
        (row("shared memory, blocking"), evaluate(blocking.shm(Wait::Block))),
    ];
    common::measure(&mut subjects);
    table.add(subjects);
    let mut subjects: Vec<Subject> = vec![
        (row("control: Unix-socket echo, beside a page"), Box::new(raw_beside)),
        (row("gRPC stream, TCP, beside a page"), evaluate(blocking.grpc(Method::Stream, false))),
        (row("shared memory, blocking, beside a page"), evaluate(blocking.shm(Wait::Block))),
    ];
    let http = blocking.running.http_address().expect("HTTP is on");
    beside_a_page(http, || common::measure(&mut subjects));
    table.add(subjects);
    drop(blocking);
    if server_core != client_core {
        cores::pin_to(&[server_core]).expect("a core");
        let spinning = Served::start(Wait::Spin);
        cores::pin_to(&[client_core]).expect("a core");
        let mut subjects = vec![(row("shared memory, polling"), evaluate(spinning.shm(Wait::Spin)))];
        common::measure(&mut subjects);
        table.add(subjects);
    }
}

fn main() {
    let cores = cores::allowed().expect("readable");
    let mut table = Table::new("latency");
    measure(&mut table, "one core", cores[0], cores[0]);
    match cores.as_slice() {
        [first, second, ..] => measure(&mut table, "a core each", *first, *second),
        _ => println!("one core alone: nothing is measured across two"),
    }
    table.print();
    table.write_where_asked();
}
