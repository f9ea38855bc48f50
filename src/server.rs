//! The server as a whole: started, ready, drained.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use tokio::runtime::Runtime;
use tokio::sync::watch;

use crate::config::Config;
use crate::engine::Engine;
use crate::metrics::Metrics;
use crate::model::kernel::Isa;
use crate::service::admin::{LoadError, Reloader};
use crate::service::grpc::{self, GrpcError, Listeners};
use crate::service::health::{Health, Part, State};
use crate::service::http::{self, HttpError};
use crate::service::shm::ShmServer;
use crate::service::shm_remains;

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
    /// A thread or a runtime.
    #[error("cannot start a thread: {0}")]
    Thread(#[from] std::io::Error),
}

/// Longest wait at the start for shared memory, which is served as soon as it can be.
const SHM_PATIENCE: Duration = Duration::from_millis(500);

/// Pause before shared memory is opened again: the first, and the longest after it was doubled at each failure.
const FIRST_SHM_PAUSE: Duration = Duration::from_millis(250);
const LAST_SHM_PAUSE: Duration = Duration::from_secs(30);

/// How often a pause looks whether the server is to stop.
const LOOK: Duration = Duration::from_millis(50);

/// A server that runs on threads of its own. Dropping it stops it.
#[derive(Debug)]
pub struct Running {
    reloader: Arc<Reloader>,
    metrics: Arc<Metrics>,
    grpc: Arc<grpc::Server>,
    listeners: Arc<Listeners>,
    http_address: Option<SocketAddr>,
    health: Arc<Health>,
    stop: watch::Sender<bool>,
    /// Probes are answered until everything else has ended.
    stop_http: watch::Sender<bool>,
    stop_shm: Arc<AtomicBool>,
    runtime: Runtime,
    threads: Vec<JoinHandle<()>>,
    housekeeping: Option<JoinHandle<()>>,
    drain: Duration,
    /// A thread ended that should not have.
    failed: Arc<AtomicBool>,
}

/// Binds everything, reads the bundles while health says NOT_SERVING, then says SERVING.
pub fn start(config: &Config) -> Result<Running, StartError> {
    let metrics = Arc::new(Metrics::new());
    let engine = Arc::new(Engine::default());
    let isa = Isa::available()[0];
    let reloader =
        Arc::new(Reloader::new(config.vehicles_directory(), isa, Arc::clone(&engine), Arc::clone(&metrics)));
    let listeners = Arc::new(Listeners::bind(&config.grpc)?);
    let http_listener = http::bind(&config.http)?;
    let shared = grpc::Shared {
        engine: Arc::clone(&engine),
        metrics: Arc::clone(&metrics),
        reloader: Arc::clone(&reloader),
        window_s: config.latency_window_s,
    };
    let health = Arc::new(Health::new(&config.ready, Arc::clone(&metrics)));
    let runtime = runtime()?;
    let (stop, stopped) = watch::channel(false);
    let (stop_http, http_stopped) = watch::channel(false);
    let mut running = Running {
        grpc: Arc::new(runtime.block_on(grpc::Server::new(config.grpc.clone(), shared.clone()))),
        http_address: http_listener.as_ref().and_then(|listener| listener.local_addr().ok()),
        health: Arc::clone(&health),
        stop_shm: Arc::new(AtomicBool::new(false)),
        drain: Duration::from_secs_f64(config.drain_s),
        threads: Vec::new(),
        housekeeping: None,
        reloader,
        metrics,
        listeners,
        stop,
        stop_http,
        runtime,
        failed: Arc::new(AtomicBool::new(false)),
    };
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
        hosts: config.http.hosts.clone(),
        grpc: shared,
        requests: Arc::clone(running.grpc.requests()),
        health: Arc::clone(&health),
    };
    running.spawn_housekeeping(http_listener, shared, window, http_stopped)?;
    running.reloader.load_all()?;
    if config.shm.enabled {
        running.spawn_shm(config, engine)?;
    }
    running.runtime.block_on(running.grpc.set_serving());
    running.health.set_serving(true);
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
        self.runtime.block_on(self.grpc.set_not_serving());
        self.runtime.block_on(self.grpc.end_health_watches());
        self.stop_shm.store(true, Ordering::Relaxed);
        self.stop.send_replace(true);
        for thread in self.threads.drain(..) {
            if thread.join().is_err() {
                tracing::error!("a server thread panicked");
            }
        }
        self.stop_http.send_replace(true);
        if self.housekeeping.take().is_some_and(|thread| thread.join().is_err()) {
            tracing::error!("the HTTP thread panicked");
        }
        tracing::info!(elapsed = ?start.elapsed(), "drained");
    }

    fn spawn_grpc(&mut self, stop: watch::Receiver<bool>) -> Result<(), StartError> {
        let (server, listeners, drain) = (Arc::clone(&self.grpc), Arc::clone(&self.listeners), self.drain);
        let runtime = runtime()?;
        let thread = self.spawn("wade-grpc", move || {
            let outcome = runtime.block_on(async {
                let serving = std::pin::pin!(server.run(&listeners, stop.clone()));
                bounded(serving, stop.clone(), drain).await
            });
            match outcome {
                Some(Err(error)) => tracing::error!(%error, "gRPC ended"),
                Some(Ok(())) => {}
                None => tracing::warn!(?drain, "connections were still open at the drain's bound: closed"),
            }
            runtime.shutdown_background();
        })?;
        self.threads.push(thread);
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
        let runtime = runtime()?;
        let thread = self.spawn("wade-http", move || {
            let rotating = async {
                let mut ticks = tokio::time::interval(window);
                ticks.tick().await;
                loop {
                    ticks.tick().await;
                    metrics.rotate();
                }
            };
            let serving = async {
                let Some(listener) = listener else { return };
                if let Err(error) = http::run(listener, shared, stop.clone()).await {
                    tracing::error!(%error, "HTTP ended");
                }
            };
            runtime.block_on(async {
                let work = std::pin::pin!(async { tokio::join!(rotating, serving) });
                tokio::select! {
                    _ = work => {}
                    () = grpc::stopped(stop.clone()) => {}
                }
            });
            runtime.shutdown_background();
        })?;
        self.housekeeping = Some(thread);
        Ok(())
    }

    /// Opens shared memory on a thread of its own and waits a moment for it; where it cannot be opened, everything else is
    /// served and the thread tries again.
    fn spawn_shm(&mut self, config: &Config, engine: Arc<Engine>) -> Result<(), StartError> {
        let (settings, metrics) = (config.shm.clone(), Arc::clone(&self.metrics));
        let (stop, health) = (Arc::clone(&self.stop_shm), Arc::clone(&self.health));
        health.set(Part::Shm, State::Starting);
        let thread = self.spawn("wade-shm", move || {
            let mut pause = FIRST_SHM_PAUSE;
            while !stop.load(Ordering::Relaxed) {
                match ShmServer::new(settings.clone(), Arc::clone(&engine), Arc::clone(&metrics)) {
                    Ok(server) => {
                        health.set(Part::Shm, State::Ok);
                        server.run(&stop);
                    }
                    Err(error) => {
                        health.set(Part::Shm, State::Unavailable(error.to_string()));
                        let end = Instant::now() + pause;
                        while Instant::now() < end && !stop.load(Ordering::Relaxed) {
                            std::thread::sleep(LOOK);
                        }
                        pause = (2 * pause).min(LAST_SHM_PAUSE);
                    }
                }
            }
        })?;
        self.threads.push(thread);
        let end = Instant::now() + SHM_PATIENCE;
        while self.health.state(Part::Shm) == State::Starting && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(1));
        }
        // nothing depends on it, and it may take minutes: it is not waited for at the end either
        let stop = Arc::clone(&self.stop_shm);
        let clearing = std::thread::Builder::new().name("wade-shm-remains".into());
        clearing.spawn(move || shm_remains::clear(&stop))?;
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

/// Runs to the end, or until the bound has passed since the stop.
async fn bounded<F: Future + Unpin>(
    mut work: F,
    stop: watch::Receiver<bool>,
    bound: Duration,
) -> Option<F::Output> {
    tokio::select! {
        output = &mut work => return Some(output),
        () = grpc::stopped(stop) => {}
    }
    tokio::time::timeout(bound, work).await.ok()
}
