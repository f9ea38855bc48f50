//! What the tests of the server and the command need.
#![allow(dead_code, reason = "every test binary uses a part")]

#[path = "bundles.rs"]
mod bundles;
pub mod http;
pub mod process;
mod states;

use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use tempfile::TempDir;
use wade::config::Config;
use wade::server::{self, Running};
use wade::service::health::{Part, State as Up};
use wade_client::{Client, GrpcClient, Method, Reply, ShmClient};
use wade_learn::dataset::Dataset;
use wade_learn::train::{self, Analytic};
use wade_wire::shm::Wait;
use wade_wire::shm::layout::PROVENANCE_LEN;

#[allow(unused_imports, reason = "every test binary uses a part")]
pub use bundles::*;

/// Long enough for a busy machine: no test is about this time.
pub const PATIENCE: Duration = Duration::from_secs(20);

/// Loads by formula for so many cases of each shipped vehicle.
pub fn analytic(cases: usize) -> Dataset {
    let vehicle = |name: &str| (name.to_owned(), model(name).vehicle().clone());
    let settings = Analytic { cases, ..Analytic::default() };
    train::analytic::dataset(&VEHICLES.map(vehicle).into(), &settings, 1).expect("a data set")
}

/// A name that no other server of this test run has.
pub fn namespace() -> String {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    format!("test-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed))
}

/// Settings on ports that the system chooses and a socket in `folder`.
pub fn config(folder: &Path) -> Config {
    let mut config = Config { vehicles: vehicles(), ..Config::default() };
    config.grpc.listen = "127.0.0.1:0".into();
    config.grpc.unix_socket = folder.join("wade.sock");
    config.http.listen = "127.0.0.1:0".into();
    config.shm.namespace = namespace();
    config.shm.program = env!("CARGO_BIN_EXE_wade").into();
    config
}

/// A server of its own for one test.
pub struct Served {
    pub running: Running,
    pub config: Config,
    _folder: TempDir,
}

impl Served {
    pub fn start() -> Self {
        Self::with(|_| {})
    }

    pub fn with(change: impl FnOnce(&mut Config)) -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        let mut config = config(folder.path());
        change(&mut config);
        config.validate().expect("a valid configuration");
        let running = server::start(&config).expect("the server starts");
        let start = Instant::now();
        while running.health().state(Part::Shm) == Up::Starting && start.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(5));
        }
        Self { running, config, _folder: folder }
    }

    pub fn url(&self) -> String {
        format!("http://{}", self.running.grpc_address().expect("TCP is on"))
    }

    pub fn tcp(&self, vehicle: &str, method: Method) -> GrpcClient {
        GrpcClient::tcp(&self.url(), vehicle, method, PATIENCE).expect("the server is there")
    }

    pub fn unix(&self, vehicle: &str, method: Method) -> GrpcClient {
        GrpcClient::unix(self.config.grpc.unix_socket.clone(), vehicle, method, PATIENCE)
            .expect("the server is there")
    }

    pub fn shm(&self, vehicle: &str, wait: Wait) -> ShmClient {
        ShmClient::new(vehicle, wait, PATIENCE).in_namespace(&self.config.shm.namespace)
    }

    /// Every way to ask this server.
    pub fn clients(&self, vehicle: &str) -> Vec<(&'static str, Client)> {
        vec![
            ("tcp unary", Client::Grpc(Box::new(self.tcp(vehicle, Method::Unary)))),
            ("tcp stream", Client::Grpc(Box::new(self.tcp(vehicle, Method::Stream)))),
            ("unix unary", Client::Grpc(Box::new(self.unix(vehicle, Method::Unary)))),
            ("unix stream", Client::Grpc(Box::new(self.unix(vehicle, Method::Stream)))),
            ("shm blocking", Client::Shm(Box::new(self.shm(vehicle, Wait::Block)))),
            ("shm polling", Client::Shm(Box::new(self.shm(vehicle, Wait::Spin)))),
        ]
    }
}

/// What every transport must answer alike: not how long it took, and of a long provenance what shared memory has room for.
pub fn comparable(mut reply: Reply) -> Reply {
    reply.provenance.truncate(PROVENANCE_LEN);
    Reply { compute_ns: 0, ..reply }
}
