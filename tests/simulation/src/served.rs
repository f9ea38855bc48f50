//! A server on the current runtime, whose connections are made in memory.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use tokio::io::DuplexStream;
use tokio::runtime::Handle;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinHandle;
use wade::config::Config;
use wade::engine::Engine;
use wade::metrics::Metrics;
use wade::server::serve_grpc;
use wade::service::access::{Acceptor, Access, Protocol};
use wade::service::accounts::{Accounts, Peer};
use wade::service::admin::Reloader;
use wade::service::bulk::Bulk;
use wade::service::call;
use wade::service::grpc::{Aside, Listeners, Server};
use wade::service::health::{Health, Part, State};
use wade_core::model::kernel::Isa;

use crate::bundle::Folder;

thread_local! {
    static FOLDER: Folder = Folder::new();
}

/// Where the vehicle of a simulation lies.
pub fn folder() -> PathBuf {
    FOLDER.with(Folder::path)
}

/// Puts a version of the vehicle on disk.
pub fn put(version: u32) {
    FOLDER.with(|folder| folder.put(version));
}

/// Who may connect: a stream and its peer, or an error of the system.
pub type Making = mpsc::Sender<io::Result<(DuplexStream, Peer)>>;

/// A server that runs.
pub struct Served {
    server: Arc<Server>,
    health: Health,
    stop: watch::Sender<bool>,
    /// What is counted.
    pub metrics: Arc<Metrics>,
    /// What is held.
    pub accounts: Arc<Accounts>,
    /// Connects.
    pub making: Making,
    serving: JoinHandle<()>,
}

impl Served {
    /// Begins to serve.
    pub async fn start(config: &Config) -> Self {
        let metrics = Arc::new(Metrics::new());
        let engine = Arc::new(Engine::default());
        let reloader = Arc::new(Reloader::new(
            Some(config.vehicles.clone()),
            Isa::available()[0],
            config.physics,
            Arc::clone(&engine),
            Arc::clone(&metrics),
        ));
        reloader.load_all().expect("a sound bundle");
        let access = Access::new(&config.tls, &config.access, &config.grpc, Arc::clone(&metrics));
        let access = Arc::new(access.expect("no files"));
        let acceptor = Acceptor::new(&access, Protocol::Http2, true, &Handle::current());
        let accounts = Accounts::new(&config.limits(), Arc::clone(&metrics));
        let shared = call::Shared {
            engine,
            metrics: Arc::clone(&metrics),
            reloader,
            window_s: config.latency_window_s,
            taps: Arc::default(),
            traces: None,
        };
        let health = Health::new(&config.ready, Arc::clone(&metrics));
        let here = Handle::current();
        let aside = Aside { bulk: Arc::new(Bulk::new(vec![here.clone()])), administration: here };
        let server = Server::new(config.grpc.clone(), shared, Arc::clone(&accounts), acceptor, aside).await;
        let server = Arc::new(server);
        health.set(Part::Grpc, State::Ok);
        health.set_serving(true);
        server.set_health(&health).await;
        let (stop, stopped) = watch::channel(false);
        let (making, made) = mpsc::channel(4);
        let (drain, listeners) = (Duration::from_secs_f64(config.drain_s), Listeners::in_memory(made));
        let serving = tokio::spawn({
            let server = Arc::clone(&server);
            async move { serve_grpc(&server, &listeners, stopped, drain).await }
        });
        Self { server, health, stop, metrics, accounts, making, serving }
    }

    /// Stops as the program does: nothing is ready any more, watches end, and what is in flight is answered.
    pub async fn stop(&mut self) {
        self.health.set_serving(false);
        self.server.set_health(&self.health).await;
        self.stop.send_replace(true);
        let _ = (&mut self.serving).await;
    }

    /// How many bundles were read while it ran, as an operator learns it.
    pub fn reloads(&self) -> u64 {
        let text = self.metrics.render_plain();
        let counts = text.lines().filter(|line| line.starts_with("wade_reloads_total"));
        counts.filter_map(|line| line.rsplit(' ').next()?.parse::<u64>().ok()).sum()
    }
}
