//! The server as a whole: started, ready, drained.

mod shm_host;
mod shm_link;
mod shm_worker;
mod watchdog;

pub use shm_worker::Worker;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use tokio::runtime::Runtime;
use tokio::sync::watch;

use shm_host::{Host, Keeper};
use watchdog::Watchdog;

use crate::config::Config;
use crate::engine::Engine;
use crate::metrics::Metrics;
use crate::service::access::{Acceptor, Access, FileError, Protocol};
use crate::service::accounts::Accounts;
use crate::service::admin::{LoadError, Reloader};
use crate::service::bulk::{Bulk, give_way};
use crate::service::grpc::{self, GrpcError, Listeners};
use crate::service::health::{Health, Part, State};
use crate::service::http::{self, HttpError};
use crate::service::traces::{Traces, TracesError};
use crate::service::{call, stopped};
use wade_core::model::kernel::Isa;

/// Longest time for answers over HTTP that are under way when everything else has ended.
const HTTP_DRAIN: Duration = Duration::from_secs(1);

/// Longest time for connections to end that are closed at the drain's bound.
const GOODBYE: Duration = Duration::from_millis(500);

/// Why the server did not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// gRPC.
    #[error(transparent)]
    Grpc(#[from] GrpcError),
    /// HTTP.
    #[error(transparent)]
    Http(#[from] HttpError),
    /// The bundles.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A file of certificates, a key or tokens.
    #[error(transparent)]
    Access(#[from] FileError),
    /// Traces.
    #[error(transparent)]
    Traces(#[from] TracesError),
    /// A thread or a runtime.
    #[error("cannot start a thread: {0}")]
    Thread(#[from] std::io::Error),
}

/// Longest wait at the start for shared memory, so that a client that waits until the server is ready finds it too. Where it
/// takes longer, the server is ready without it.
const SHM_PATIENCE: Duration = Duration::from_millis(700);

/// A server that runs on threads of its own. Dropping it stops it.
#[derive(Debug)]
pub struct Running {
    reloader: Arc<Reloader>,
    metrics: Arc<Metrics>,
    grpc: Arc<grpc::Server>,
    listeners: Arc<Listeners>,
    access: Arc<Access>,
    http_acceptor: Acceptor,
    grpc_acceptor: Acceptor,
    http_address: Option<SocketAddr>,
    health: Arc<Health>,
    stop: watch::Sender<bool>,
    /// Probes are answered until everything else has ended.
    stop_http: watch::Sender<bool>,
    shm: Option<Host>,
    runtime: Runtime,
    threads: Vec<JoinHandle<()>>,
    housekeeping: Vec<JoinHandle<()>>,
    drain: Duration,
    /// A thread ended that should not have.
    failed: Arc<AtomicBool>,
    traces: Option<Arc<Traces>>,
}

/// Binds everything, reads the bundles while health says NOT_SERVING, then says SERVING.
pub fn start(config: &Config) -> Result<Running, StartError> {
    let metrics = Arc::new(Metrics::new());
    let engine = Arc::new(Engine::default());
    let isa = Isa::available()[0];
    let reloader = Arc::new(Reloader::new(
        config.named_vehicles().map(Path::to_owned),
        isa,
        config.physics,
        Arc::clone(&engine),
        Arc::clone(&metrics),
    ));
    let access = Arc::new(Access::new(&config.tls, &config.access, &config.grpc, Arc::clone(&metrics))?);
    let listeners = Arc::new(Listeners::bind(&config.grpc)?);
    let http_listener = http::bind(&config.http)?;
    let (runtime, handshakes, administration) = (runtime()?, runtime()?, runtime()?);
    let collecting = config.traces.is_on().then(self::runtime).transpose()?;
    let traces =
        collecting.as_ref().map(|runtime| Traces::start(&config.traces, runtime.handle())).transpose()?;
    let shared = call::Shared {
        engine: Arc::clone(&engine),
        metrics: Arc::clone(&metrics),
        reloader: Arc::clone(&reloader),
        window_s: config.latency_window_s,
        taps: Arc::default(),
        traces: traces.clone(),
    };
    let health = Arc::new(Health::new(&config.ready, Arc::clone(&metrics)));
    let accounts = Accounts::new(&config.limits(), Arc::clone(&metrics));
    // handshakes are computed there, where nobody waits for an answer
    let acceptor = |protocol, insecure| Acceptor::new(&access, protocol, insecure, handshakes.handle());
    let grpc_acceptor = acceptor(Protocol::Http2, config.grpc.insecure);
    let http_acceptor = acceptor(Protocol::Http1, config.http.insecure);
    let workers = (0..config.grpc.threads).map(|_| self::runtime()).collect::<std::io::Result<Vec<_>>>()?;
    let bulk = Arc::new(Bulk::new(workers.iter().map(|worker| worker.handle().clone()).collect()));
    let (stop, stopped) = watch::channel(false);
    let (stop_http, http_stopped) = watch::channel(false);
    let mut running = Running {
        grpc: Arc::new(runtime.block_on(grpc::Server::new(
            config.grpc.clone(),
            shared.clone(),
            Arc::clone(&accounts),
            grpc_acceptor.clone(),
            grpc::Aside { bulk, administration: administration.handle().clone() },
        ))),
        http_address: http_listener.as_ref().and_then(|listener| listener.local_addr().ok()),
        health: Arc::clone(&health),
        shm: None,
        drain: Duration::from_secs_f64(config.drain_s),
        threads: Vec::new(),
        housekeeping: Vec::new(),
        reloader,
        metrics,
        listeners,
        access,
        http_acceptor: http_acceptor.clone(),
        grpc_acceptor,
        stop,
        stop_http,
        runtime,
        failed: Arc::new(AtomicBool::new(false)),
        traces,
    };
    running.spawn_handshakes(handshakes, http_stopped.clone())?;
    for worker in workers {
        running.spawn_aside("wade-bulk", worker, http_stopped.clone())?;
    }
    // on two cores, whoever asks for reloads without end must not have the processor before a query
    running.spawn_aside("wade-admin", administration, http_stopped.clone())?;
    if let Some(collecting) = collecting {
        running.spawn_aside("wade-traces", collecting, http_stopped.clone())?;
    }
    for _ in 0..config.grpc.threads {
        running.spawn_grpc(stopped.clone())?;
    }
    if running.grpc_address().is_some() || running.unix_path().is_some() {
        health.set(Part::Grpc, State::Ok);
    }
    if running.http_address.is_some() {
        health.set(Part::Http, State::Ok);
    }
    let window = Duration::from_secs_f64(config.latency_window_s);
    let shared = http::Shared {
        config: config.http.clone(),
        grpc: shared,
        accounts,
        health: Arc::clone(&health),
        acceptor: http_acceptor,
    };
    running.spawn_housekeeping(http_listener, shared, window, http_stopped)?;
    running.reloader.load_all()?;
    if config.shm.enabled {
        running.spawn_shm(config, engine)?;
    }
    health.set_serving(true);
    running.runtime.block_on(running.grpc.set_health(&health));
    running.spawn_watchdog(stopped)?;
    Ok(running)
}

fn runtime() -> std::io::Result<Runtime> {
    tokio::runtime::Builder::new_current_thread().enable_all().build()
}

impl Running {
    /// The TCP address of gRPC.
    pub fn grpc_address(&self) -> Option<SocketAddr> {
        self.listeners.tcp_address()
    }

    /// The Unix socket of gRPC.
    pub fn unix_path(&self) -> Option<&Path> {
        self.listeners.unix_path()
    }

    /// The TCP address of HTTP.
    pub fn http_address(&self) -> Option<SocketAddr> {
        self.http_address
    }

    /// Reads bundles again when asked.
    pub fn reloader(&self) -> &Arc<Reloader> {
        &self.reloader
    }

    /// Which transports answer.
    pub fn health(&self) -> &Arc<Health> {
        &self.health
    }

    /// Who may do what over TCP, and the files that say so.
    pub fn access(&self) -> &Arc<Access> {
        &self.access
    }

    /// Whether gRPC over TCP is encrypted, and HTTP.
    pub fn is_encrypted(&self) -> [bool; 2] {
        [&self.grpc_acceptor, &self.http_acceptor].map(Acceptor::is_encrypted)
    }

    /// What is counted.
    pub fn metrics(&self) -> &Arc<Metrics> {
        &self.metrics
    }

    /// Says NOT_SERVING, answers what is in flight, and returns when all is closed or the drain's bound has passed.
    pub fn shutdown(mut self) {
        self.stop_all();
    }

    fn stop_all(&mut self) {
        let start = Instant::now();
        self.health.set_serving(false);
        self.runtime.block_on(self.grpc.set_health(&self.health));
        self.stop.send_replace(true);
        if let Some(shm) = &self.shm {
            shm.stop();
        }
        for thread in self.threads.drain(..) {
            if thread.join().is_err() {
                tracing::error!("a server thread panicked");
            }
        }
        if let Some(traces) = &self.traces {
            traces.end();
        }
        self.stop_http.send_replace(true);
        for thread in self.housekeeping.drain(..) {
            if thread.join().is_err() {
                tracing::error!("an HTTP thread panicked");
            }
        }
        tracing::info!(elapsed = ?start.elapsed(), "drained");
    }

    fn spawn_grpc(&mut self, stop: watch::Receiver<bool>) -> Result<(), StartError> {
        let (server, listeners, drain) = (Arc::clone(&self.grpc), Arc::clone(&self.listeners), self.drain);
        let runtime = runtime()?;
        let thread = self.spawn("wade-grpc", move || {
            runtime.block_on(serve_grpc(&server, &listeners, stop, drain));
            runtime.shutdown_background();
        })?;
        self.threads.push(thread);
        Ok(())
    }

    /// The handshakes of TLS, and a look now and then at the files that it needs.
    fn spawn_handshakes(&mut self, runtime: Runtime, stop: watch::Receiver<bool>) -> Result<(), StartError> {
        if !self.access.has_files() {
            runtime.shutdown_background();
            return Ok(());
        }
        let access = Arc::clone(&self.access);
        let thread = self.spawn("wade-tls", move || {
            give_way();
            runtime.block_on(access.follow_files(stop));
            runtime.shutdown_background();
        })?;
        self.housekeeping.push(thread);
        Ok(())
    }

    /// A thread of long work, which goes on until the calls that wait for it have their answers.
    fn spawn_aside(
        &mut self,
        name: &str,
        worker: Runtime,
        stop: watch::Receiver<bool>,
    ) -> Result<(), StartError> {
        let thread = self.spawn(name, move || {
            give_way();
            worker.block_on(stopped(stop));
            worker.shutdown_background();
        })?;
        self.housekeeping.push(thread);
        Ok(())
    }

    /// HTTP and the turning of the latency windows, away from the threads that answer queries.
    fn spawn_housekeeping(
        &mut self,
        listener: Option<std::net::TcpListener>,
        shared: http::Shared,
        window: Duration,
        stop: watch::Receiver<bool>,
    ) -> Result<(), StartError> {
        let metrics = Arc::clone(&self.metrics);
        let (work, probes) = (runtime()?, runtime()?);
        let handle = work.handle().clone();
        // queries are answered until the last connection has its answer
        let (ended, end) = watch::channel(false);
        let thread = self.spawn("wade-http", move || {
            give_way();
            let rotating = async {
                let mut ticks = tokio::time::interval(window);
                ticks.tick().await;
                loop {
                    ticks.tick().await;
                    metrics.rotate();
                }
            };
            work.block_on(async {
                tokio::select! {
                    () = rotating => {}
                    () = stopped(end) => {}
                }
            });
            work.shutdown_background();
        })?;
        self.housekeeping.push(thread);
        let thread = self.spawn("wade-probes", move || {
            probes.block_on(async {
                match listener {
                    Some(listener) => {
                        let serving = std::pin::pin!(http::run(listener, shared, handle, stop.clone()));
                        if let Some(Err(error)) = bounded(serving, stop, HTTP_DRAIN).await {
                            tracing::error!(%error, "HTTP ended");
                        }
                    }
                    None => stopped(stop).await,
                }
            });
            ended.send_replace(true);
            probes.shutdown_background();
        })?;
        self.housekeeping.push(thread);
        Ok(())
    }

    /// Keeps the process that serves shared memory, and waits a moment for it.
    fn spawn_shm(&mut self, config: &Config, engine: Arc<Engine>) -> Result<(), StartError> {
        let (metrics, health) = (Arc::clone(&self.metrics), Arc::clone(&self.health));
        let (keeper, host) = Keeper::new(config, engine, metrics, health);
        self.health.set(Part::Shm, State::Starting);
        let thread = self.spawn("wade-shm", move || keeper.run())?;
        self.threads.push(thread);
        let follower = host.clone();
        self.reloader.follow(move |vehicle| follower.change(vehicle));
        self.shm = Some(host);
        let end = Instant::now() + SHM_PATIENCE;
        while self.health.state(Part::Shm) == State::Starting && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    }

    fn spawn_watchdog(&mut self, stop: watch::Receiver<bool>) -> Result<(), StartError> {
        let watchdog = Watchdog {
            health: Arc::clone(&self.health),
            grpc: Arc::clone(&self.grpc),
            tcp: self.grpc_address(),
            unix: self.unix_path().map(Path::to_owned),
            http: self.http_address,
            grpc_acceptor: self.grpc_acceptor.clone(),
            http_acceptor: self.http_acceptor.clone(),
        };
        let runtime = runtime()?;
        let thread = self.spawn("wade-watchdog", move || {
            runtime.block_on(watchdog.run(stop));
            runtime.shutdown_background();
        })?;
        self.threads.push(thread);
        Ok(())
    }

    fn spawn(&self, name: &str, body: impl FnOnce() + Send + 'static) -> Result<JoinHandle<()>, StartError> {
        let guard = Guard {
            name: name.to_owned(),
            stop: self.stop.subscribe(),
            health: Arc::clone(&self.health),
            failed: Arc::clone(&self.failed),
        };
        let body = move || {
            let _guard = guard;
            body();
        };
        Ok(std::thread::Builder::new().name(name.into()).spawn(body)?)
    }

    /// True where a thread has ended that should not have: the server is best restarted.
    pub fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }
}

/// Notices when a thread ends, by a panic too, although nobody has asked for it.
struct Guard {
    name: String,
    stop: watch::Receiver<bool>,
    health: Arc<Health>,
    failed: Arc<AtomicBool>,
}

impl Drop for Guard {
    fn drop(&mut self) {
        if !*self.stop.borrow() {
            tracing::error!(thread = self.name, "ended unasked: no longer ready");
            self.health.set_serving(false);
            self.failed.store(true, Ordering::Relaxed);
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if !self.threads.is_empty() {
            self.stop_all();
        }
    }
}

/// Serves gRPC until `stop` turns true and what is in flight is answered, for at most `drain`; then closes what is left.
pub async fn serve_grpc(
    server: &grpc::Server,
    listeners: &Listeners,
    stop: watch::Receiver<bool>,
    drain: Duration,
) {
    let outcome = {
        let serving = std::pin::pin!(server.run(listeners, stop.clone()));
        bounded(serving, stop, drain).await
    };
    match outcome {
        Some(Err(error)) => tracing::error!(%error, "gRPC ended"),
        Some(Ok(())) => {}
        None => {
            tracing::warn!(?drain, "connections were still open at the drain's bound: closed");
            // some are served by a thread of long work, and wait by this one's clock
            if tokio::time::timeout(GOODBYE, server.close_all()).await.is_err() {
                tracing::warn!("some of them did not end");
            }
        }
    }
}

/// Runs to the end, or until the bound has passed since the stop.
async fn bounded<F: Future + Unpin>(
    mut work: F,
    stop: watch::Receiver<bool>,
    bound: Duration,
) -> Option<F::Output> {
    tokio::select! {
        biased;
        output = &mut work => return Some(output),
        () = stopped(stop) => {}
    }
    tokio::time::timeout(bound, work).await.ok()
}
