//! gRPC: the listeners, the limits, and handlers that only convert.

mod authority;
mod calls;
mod frames;
mod handlers;
mod heavy;
mod inference;
mod link;
mod moving;
mod serving;
mod stream;
mod turns;
mod watching;

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tokio::io::DuplexStream;
use tokio::runtime::Handle;
use tokio::sync::{Semaphore, mpsc, watch};
use tonic::codec::CompressionEncoding;
use tonic::codegen::http;
use tonic::service::Routes;
use tonic::{Code, Status};
use tonic_health::pb::health_server::HealthServer;
use tonic_health::server::HealthReporter;

use self::turns::Turnstile;
use self::watching::WatchedHealth;
use super::access::Acceptor;
use super::accounts::{Accounts, Connection, Peer};
use super::admin::Jobs;
use super::bulk::Bulk;
use super::call::Shared;
use super::health::{Health, Part, State};
use super::intake::{self, Listener, Made};
use super::{occupant, stopped};
use crate::metrics::Resource;
use wade_wire::Refusal;
use wade_wire::proto;
use wade_wire::proto::admin_server::AdminServer;
use wade_wire::proto::hydrodynamics_server::HydrodynamicsServer;
use wade_wire::proto::inference::grpc_inference_service_server::GrpcInferenceServiceServer;

/// Settings of the gRPC server.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// TCP address; an empty string turns TCP off.
    pub listen: String,
    /// Whether TCP is served without TLS, on whatever address and although there is a certificate.
    pub insecure: bool,
    /// Path of the Unix socket; an empty string turns it off.
    pub unix_socket: PathBuf,
    /// Threads, each with a runtime of its own that computes where it reads, and as many for long work.
    pub threads: usize,
    /// Largest request [bytes].
    pub max_message_bytes: usize,
    /// Most states in a batch.
    pub max_batch: usize,
    /// Most connections at a time.
    pub max_connections: usize,
    /// Most requests at a time, from their first byte until the last byte of their answers has left; and most batches.
    pub max_requests: usize,
    /// Most streams open at a time.
    pub max_streams: usize,
    /// Most bytes held of requests that are not complete and of answers that are not sent.
    pub max_held_bytes: usize,
    /// Most HTTP/2 streams on one connection.
    pub max_streams_per_connection: u32,
    /// Share of these limits that one peer may have, 0 to 1.
    pub peer_share: f64,
    /// Frames without a request (PING, SETTINGS, WINDOW_UPDATE, empty DATA) that a connection may send, beside those that its
    /// requests and answers explain [1/s].
    pub control_frames_per_s: f64,
    /// Longest time until a new connection has sent what HTTP/2 begins with [s].
    pub handshake_s: f64,
    /// Longest time until the first call of a connection [s].
    pub first_request_s: f64,
    /// Longest time for a request to arrive [s].
    pub request_s: f64,
    /// Longest time for a client to take any of an answer [s].
    pub answer_s: f64,
    /// Longest pause between two requests of a stream [s].
    pub stream_idle_s: f64,
    /// Longest time that a connection without a call is kept [s].
    pub idle_s: f64,
    /// A connection that does not answer a ping sent after this much silence is closed [s].
    pub keepalive_s: u64,
    /// Whether an administrator's calls are answered over TCP too, where nobody has to show who they are.
    pub admin_over_tcp: bool,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            listen: "127.0.0.1:50051".into(),
            insecure: false,
            unix_socket: "/tmp/wade.sock".into(),
            threads: 1,
            max_message_bytes: 4 << 20,
            max_batch: 4096,
            max_connections: 256,
            max_requests: 64,
            max_streams: 64,
            max_held_bytes: 64 << 20,
            max_streams_per_connection: 256,
            peer_share: 0.75,
            control_frames_per_s: 200.0,
            handshake_s: 5.0,
            first_request_s: 30.0,
            request_s: 10.0,
            answer_s: 10.0,
            stream_idle_s: 600.0,
            idle_s: 600.0,
            keepalive_s: 30,
            admin_over_tcp: false,
        }
    }
}

/// Why the gRPC server could not start or go on.
#[derive(Debug, thiserror::Error)]
pub enum GrpcError {
    /// The address is none.
    #[error("grpc.listen: \"{listen}\" is not an address such as 127.0.0.1:50051")]
    Address {
        /// What was configured.
        listen: String,
    },
    /// The port or the socket could not be had.
    #[error("cannot listen on {at}: {reason}")]
    Bind {
        /// Address or path.
        at: String,
        /// Who is in the way and the way out, or the system's reason.
        reason: String,
    },
    /// Somebody answers on the Unix socket.
    #[error(
        "cannot listen on {}: {occupant} listens there; stop it, or choose another path with --unix-socket \
         (grpc.unix_socket)", .path.display()
    )]
    InUse {
        /// The path.
        path: PathBuf,
        /// Who listens.
        occupant: String,
    },
    /// A reflection descriptor is broken.
    #[error("gRPC reflection: {0}")]
    Reflection(#[from] tonic_reflection::server::Error),
}

/// Bound sockets, not yet served. The Unix socket's file goes when this is dropped.
#[derive(Debug)]
pub struct Listeners {
    tcp: Option<TcpListener>,
    unix: Option<(UnixListener, PathBuf)>,
    memory: Option<Arc<Made>>,
}

impl Listeners {
    /// Binds what the configuration names.
    pub fn bind(config: &Config) -> Result<Self, GrpcError> {
        let tcp = (!config.listen.is_empty()).then(|| bind_tcp(&config.listen)).transpose()?;
        let path = &config.unix_socket;
        let unix = (!path.as_os_str().is_empty()).then(|| bind_unix(path)).transpose()?;
        Ok(Self { tcp, unix: unix.map(|listener| (listener, path.clone())), memory: None })
    }

    /// Only those that are made in memory, as a simulation does.
    pub fn in_memory(made: mpsc::Receiver<io::Result<(DuplexStream, Peer)>>) -> Self {
        Self { tcp: None, unix: None, memory: Some(Arc::new(Made::new(made))) }
    }

    /// The TCP address in use, with the port that the system chose where 0 was asked for.
    pub fn tcp_address(&self) -> Option<SocketAddr> {
        self.tcp.as_ref().and_then(|listener| listener.local_addr().ok())
    }

    /// The path of the Unix socket.
    pub fn unix_path(&self) -> Option<&Path> {
        self.unix.as_ref().map(|(_, path)| path.as_path())
    }
}

impl Drop for Listeners {
    fn drop(&mut self) {
        if let Some((_, path)) = &self.unix {
            // a file that is gone already is as good as removed
            let _ = std::fs::remove_file(path);
        }
    }
}

fn bind_tcp(listen: &str) -> Result<TcpListener, GrpcError> {
    let address: SocketAddr = listen.parse().map_err(|_| GrpcError::Address { listen: listen.to_owned() })?;
    intake::listen_on_tcp(address).map_err(|source| {
        let way_out = "--listen (grpc.listen)";
        let reason = occupant::in_the_way(&source, occupant::of_tcp(address), way_out);
        GrpcError::Bind { at: address.to_string(), reason }
    })
}

/// Takes over the file that a killed server left behind, but not the socket of one that lives.
fn bind_unix(path: &Path) -> Result<UnixListener, GrpcError> {
    if std::os::unix::net::UnixStream::connect(path).is_ok() {
        let occupant = occupant::of_unix(path).map_or_else(|| "another program".into(), |o| o.to_string());
        return Err(GrpcError::InUse { path: path.to_owned(), occupant });
    }
    let bind = || {
        // a socket that nobody listens on is a killed server's; anything else is not ours to remove
        if std::fs::symlink_metadata(path).is_ok_and(|found| found.file_type().is_socket()) {
            std::fs::remove_file(path)?;
        }
        let listener = UnixListener::bind(path)?;
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600))?;
        listener.set_nonblocking(true)?;
        Ok(listener)
    };
    let refused = |source: std::io::Error| source.to_string();
    bind().map_err(refused).map_err(|reason| GrpcError::Bind { at: path.display().to_string(), reason })
}

/// What a health check may ask about: the server as a whole, and its services.
const HEALTH_NAMES: [&str; 3] = ["", "wade.v1.Hydrodynamics", "inference.GRPCInferenceService"];

/// What a health check may ask about of shared memory.
const HEALTH_OF_SHARED_MEMORY: &str = "wade.SharedMemory";

/// Who does what must not stand before a query.
#[derive(Debug)]
pub struct Aside {
    /// Calls that take milliseconds.
    pub bulk: Arc<Bulk>,
    /// The administrator's jobs.
    pub administration: Handle,
}

/// A server that is bound and whose limits are set: health says NOT_SERVING until [`Server::set_health`].
#[derive(Debug)]
pub struct Server {
    config: Config,
    shared: Shared,
    accounts: Arc<Accounts>,
    jobs: Arc<Jobs>,
    gate: Arc<Semaphore>,
    turnstile: Turnstile,
    health: HealthReporter,
    acceptor: Acceptor,
    bulk: Arc<Bulk>,
}

impl Server {
    /// A server that is not ready yet.
    pub async fn new(
        config: Config,
        shared: Shared,
        accounts: Arc<Accounts>,
        acceptor: Acceptor,
        aside: Aside,
    ) -> Self {
        let Aside { bulk, administration } = aside;
        let jobs = Jobs::start(Arc::clone(&shared.reloader), &administration);
        let gate = Arc::new(Semaphore::new(config.threads));
        let (turnstile, health) = (Turnstile::new(), HealthReporter::new());
        let server = Self { config, shared, accounts, jobs, gate, turnstile, health, acceptor, bulk };
        // the crate registers the empty name as SERVING, and nothing is served yet
        for service in HEALTH_NAMES {
            server.health.set_service_status(service, tonic_health::ServingStatus::NotServing).await;
        }
        server
    }

    /// Says SERVING of what answers, and of the server as a whole where it is ready.
    pub async fn set_health(&self, health: &Health) {
        let status = |up| {
            if up { tonic_health::ServingStatus::Serving } else { tonic_health::ServingStatus::NotServing }
        };
        for service in HEALTH_NAMES {
            self.health.set_service_status(service, status(health.is_ready())).await;
        }
        let shared_memory = health.is_serving() && health.state(Part::Shm) == State::Ok;
        self.health.set_service_status(HEALTH_OF_SHARED_MEMORY, status(shared_memory)).await;
    }

    fn routes(
        &self,
        names: handlers::Names,
        stop: &watch::Receiver<bool>,
    ) -> Result<(Routes, heavy::HeavyCalls), GrpcError> {
        let limit = self.config.max_message_bytes;
        let handlers = handlers::Handlers {
            shared: self.shared.clone(),
            names,
            max_batch: self.config.max_batch,
            stop: stop.clone(),
        };
        let admin = AdminServer::new(handlers::AdminHandlers { jobs: Arc::clone(&self.jobs) });
        let inference =
            inference::InferenceHandlers { handlers: handlers.clone(), jobs: Arc::clone(&self.jobs) };
        let bulk = Arc::clone(&self.bulk);
        let heavy = heavy::HeavyCalls { handlers: inference.clone(), bulk, limit };
        let health = HealthServer::new(WatchedHealth::new(&self.health, stop));
        let reflection = || {
            tonic_reflection::server::Builder::configure()
                .register_encoded_file_descriptor_set(proto::DESCRIPTORS)
                .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
        };
        // answers are not compressed: that takes longer than the query
        macro_rules! limited {
            ($service:expr) => {
                $service.max_decoding_message_size(limit).accept_compressed(CompressionEncoding::Gzip)
            };
        }
        let routes = Routes::new(limited!(HydrodynamicsServer::new(handlers)))
            .add_service(limited!(GrpcInferenceServiceServer::new(inference)))
            .add_service(limited!(admin))
            .add_service(limited!(health))
            .add_service(limited!(reflection().build_v1()?))
            .add_service(limited!(reflection().build_v1alpha()?));
        Ok((routes.prepare(), heavy))
    }

    /// Serves the listeners on the current runtime until `stop` turns true and what is in flight is answered.
    pub async fn run(&self, listeners: &Listeners, stop: watch::Receiver<bool>) -> Result<(), GrpcError> {
        // the channel ends when every connection has dropped its sender
        let (open, mut ended) = mpsc::channel(1);
        let at =
            |at: String| move |source: std::io::Error| GrpcError::Bind { at, reason: source.to_string() };
        let tcp = async {
            let Some(listener) = &listeners.tcp else { return Ok(()) };
            let listener = listener.try_clone().and_then(tokio::net::TcpListener::from_std);
            let listener = Listener::Tcp(listener.map_err(at(self.config.listen.clone()))?);
            self.listen(listener, handlers::TCP, &stop, &open).await
        };
        let unix = async {
            let Some((listener, path)) = &listeners.unix else { return Ok(()) };
            let listener = listener.try_clone().and_then(tokio::net::UnixListener::from_std);
            let listener = Listener::Unix(listener.map_err(at(path.display().to_string()))?);
            self.listen(listener, handlers::UNIX, &stop, &open).await
        };
        let memory = async {
            let Some(made) = &listeners.memory else { return Ok(()) };
            self.listen(Listener::Memory(Arc::clone(made)), handlers::TCP, &stop, &open).await
        };
        tokio::try_join!(tcp, unix, memory)?;
        stopped(stop).await;
        drop(open);
        let _: Option<()> = ended.recv().await;
        Ok(())
    }

    /// Closes every connection.
    pub async fn close_all(&self) {
        self.accounts.close_all().await;
    }

    /// Accepts on one listener until `stop` turns true.
    async fn listen(
        &self,
        listener: Listener,
        names: handlers::Names,
        stop: &watch::Receiver<bool>,
        open: &mpsc::Sender<()>,
    ) -> Result<(), GrpcError> {
        let (routes, heavy) = self.routes(names, stop)?;
        let rules = Arc::new(calls::Rules {
            acceptor: self.acceptor.clone(),
            heavy,
            request: Duration::from_secs_f64(self.config.request_s),
            stream_idle: Duration::from_secs_f64(self.config.stream_idle_s),
            gate: Arc::clone(&self.gate),
            metrics: Arc::clone(&self.shared.metrics),
            traces: self.shared.traces.clone(),
            stop: stop.clone(),
            names,
        });
        let reading = moving::Reading(Handle::current());
        let http = serving::builder(&self.config, reading.clone());
        let (deadlines, frames) = (serving::Deadlines::of(&self.config), self.config.control_frames_per_s);
        let accounts = Arc::clone(&self.accounts);
        let serve = |socket, connection: Arc<Connection>, place| {
            let (routes, rules, turns) = (routes.clone(), Arc::clone(&rules), self.turnstile.turns());
            let (http, stop, open) = (http.clone(), stop.clone(), open.clone());
            let of = Arc::clone(&connection);
            let serving = async move {
                if let Some((socket, who)) =
                    rules.acceptor.let_in(socket, &connection, deadlines.handshake, stop.clone()).await
                {
                    let link = link::Link::new(socket, Arc::clone(&connection), frames);
                    let calls = calls::Calls { routes, connection, rules, who };
                    serving::serve(http, serving::Accepted { link, calls, turns }, deadlines, stop).await;
                }
                drop((place, open));
            };
            moving::spawn(serving, of, reading.clone(), Arc::clone(&self.bulk));
        };
        tokio::select! {
            biased;
            () = intake::accept_all(listener, accounts, Resource::connections, serve) => {}
            () = stopped(stop.clone()) => {}
        }
        Ok(())
    }
}

type Body = tonic::body::Body;

/// tonic says OUT_OF_RANGE of a message over the size limit, other implementations RESOURCE_EXHAUSTED, which is also
/// what the API guides reserve for limits. No handler of ours says OUT_OF_RANGE.
fn name_the_size_limit(mut response: http::Response<Body>) -> http::Response<Body> {
    let status = Status::from_header_map(response.headers());
    if let Some(status) = status.filter(|status| status.code() == Code::OutOfRange) {
        let headers = size_limit(&status).into_http::<Body>().into_parts().0.headers;
        *response.headers_mut() = headers;
    }
    response
}

/// The status of a message over the size limit.
pub(super) fn size_limit(status: &Status) -> Status {
    Refusal::MessageTooLong { reason: status.message().to_owned() }.into()
}
