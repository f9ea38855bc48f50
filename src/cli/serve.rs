//! `wade serve`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use tokio::runtime::Runtime;
use tokio::signal::unix::{Signal, SignalKind, signal};
use wade::config::Config;
use wade::cores;
use wade::server::{self, Running};
use wade::service::admin::{AUDIT, Reload};
use wade_core::physics::Physics;
use wade_wire::shm::Wait;

use super::log;
use super::state::Terms;

/// Serve vehicles over gRPC, a Unix socket and shared memory
///
/// Without arguments: the shipped vehicles, gRPC on 127.0.0.1:50051 and /tmp/wade.sock, metrics on 127.0.0.1:9464,
/// shared memory for this user. Flags win over the file, the file over the defaults.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  wade serve
  wade serve --config deploy/wade.toml --shm spin --cpus 1")]
pub struct Serve {
    /// Settings, as in deploy/wade.toml
    #[arg(long, value_name = "FILE", env = "WADE_CONFIG")]
    config: Option<PathBuf>,
    /// Folder of the vehicle bundles [default: the first that exists of $XDG_DATA_HOME/wade/vehicles (~/.local/share),
    /// vehicles beside the program and ../share/wade/vehicles; vehicles that it lacks are those that wade carries]
    #[arg(long, value_name = "DIR", env = "WADE_VEHICLES", value_parser = super::path_or_nothing)]
    vehicles: Option<PathBuf>,
    /// Address of gRPC; empty for none
    #[arg(long, value_name = "ADDR")]
    listen: Option<String>,
    /// Unix socket of gRPC; empty for none
    #[arg(long, value_name = "PATH", value_parser = super::path_or_nothing)]
    unix_socket: Option<PathBuf>,
    /// Address of metrics and probes; empty for none
    #[arg(long, value_name = "ADDR")]
    http: Option<String>,
    /// Serve TCP without TLS, on whatever address, where everybody on the network may read and ask
    #[arg(long)]
    insecure: bool,
    /// First part of the names in shared memory; servers beside each other need one each
    #[arg(long, value_name = "NAME")]
    namespace: Option<String>,
    /// Shared memory: how the server waits for requests
    #[arg(long, value_enum)]
    shm: Option<Shm>,
    /// How much of the physical base answers a query that does not state it
    #[arg(long, value_enum, env = "WADE_PHYSICS")]
    physics: Option<Terms>,
    /// CPUs that the server may use, such as 0 or 0,1
    #[arg(long, value_delimiter = ',')]
    cpus: Option<Vec<usize>>,
    /// End with the process that started this one
    #[arg(long, hide = true)]
    with_parent: bool,
    /// Filter of the logs, such as debug or wade::request=debug
    #[arg(long, env = "WADE_LOG")]
    log: Option<String>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Shm {
    /// Sleep until a client wakes it
    Block,
    /// Poll without pause, on a core of its own
    Spin,
    /// No shared memory
    Off,
}

impl Serve {
    /// Serves until SIGTERM, SIGINT or SIGQUIT.
    pub fn run(self) -> Result<ExitCode> {
        if self.with_parent {
            nix::sys::prctl::set_pdeathsig(nix::sys::signal::Signal::SIGTERM)?;
        }
        let (begun, file) = (Instant::now(), self.config.clone());
        let config = self.config()?;
        config.validate()?;
        log::start(&config.log)?;
        log::starting(&config, file.as_deref());
        raise_descriptors();
        cores::pin_to(&config.cpus).context("cpus")?;
        // before anything is served, so that no signal meets a server that does not expect it
        let mut signals = Signals::new()?;
        let running = server::start(&config)?;
        log::ready(&config, &running, begun.elapsed());
        notify(&[sd_notify::NotifyState::Ready]);
        signals.wait(&running);
        let failed = running.has_failed();
        notify(&[sd_notify::NotifyState::Stopping]);
        running.shutdown();
        Ok(ExitCode::from(u8::from(failed)))
    }

    fn config(self) -> Result<Config> {
        let mut config = self.config.as_deref().map_or_else(|| Ok(Config::default()), Config::read)?;
        set(&mut config.vehicles, self.vehicles);
        set(&mut config.grpc.listen, self.listen);
        set(&mut config.grpc.unix_socket, self.unix_socket);
        set(&mut config.http.listen, self.http);
        config.grpc.insecure |= self.insecure;
        config.http.insecure |= self.insecure;
        set(&mut config.physics, self.physics.map(Physics::from));
        set(&mut config.cpus, self.cpus);
        set(&mut config.log.filter, self.log);
        set(&mut config.shm.namespace, self.namespace);
        match self.shm {
            Some(Shm::Off) => config.shm.enabled = false,
            Some(Shm::Block) => (config.shm.enabled, config.shm.wait) = (true, Wait::Block),
            Some(Shm::Spin) => (config.shm.enabled, config.shm.wait) = (true, Wait::Spin),
            None => {}
        }
        Ok(config)
    }
}

/// Serves shared memory for the server that started this process.
pub fn serve_shm() -> Result<ExitCode> {
    let worker = server::Worker::read().context("this command is for `wade serve`")?;
    let mut log = worker.config().log.clone();
    // the server has said already what it loaded
    log.filter += ",wade::service::admin=warn";
    log::start(&log)?;
    worker.run()
}

/// Raises the limit of open descriptors to what this user may have: each client of shared memory and each connection
/// takes some.
fn raise_descriptors() {
    use nix::sys::resource::{Resource, getrlimit, setrlimit};
    let raised = getrlimit(Resource::RLIMIT_NOFILE).and_then(|(soft, hard)| {
        setrlimit(Resource::RLIMIT_NOFILE, hard.min(MAX_DESCRIPTORS).max(soft), hard)
    });
    if let Err(error) = raised {
        tracing::warn!(%error, "the limit of open file descriptors stays as it is");
    }
}

/// More descriptors than any server here needs; where the system allows a billion, nobody wants to walk through them.
const MAX_DESCRIPTORS: u64 = 1 << 20;

fn set<T>(place: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *place = value;
    }
}

/// Tells systemd, where it is systemd that started us.
fn notify(states: &[sd_notify::NotifyState]) {
    if let Err(error) = sd_notify::notify(states) {
        tracing::warn!(%error, "cannot notify systemd");
    }
}

/// How often the server is looked at for a thread that has ended.
const LOOK: std::time::Duration = std::time::Duration::from_secs(1);

/// Every signal that would end the process if nobody expected it.
struct Signals {
    runtime: Runtime,
    end: [(Signal, &'static str); 3],
    reload: Signal,
    status: [Signal; 2],
}

impl Signals {
    fn new() -> Result<Self> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let _entered = runtime.enter();
        let end = [
            (signal(SignalKind::terminate())?, "SIGTERM"),
            (signal(SignalKind::interrupt())?, "SIGINT"),
            (signal(SignalKind::quit())?, "SIGQUIT"),
        ];
        let reload = signal(SignalKind::hangup())?;
        let status = [signal(SignalKind::user_defined1())?, signal(SignalKind::user_defined2())?];
        drop(_entered);
        Ok(Self { runtime, end, reload, status })
    }

    /// Returns at SIGTERM, SIGINT or SIGQUIT, or when the server has failed and is best restarted. SIGHUP reloads every
    /// bundle, SIGUSR1 and SIGUSR2 log the state of the server.
    fn wait(&mut self, running: &Running) {
        let Self { runtime, end: [terminate, interrupt, quit], reload, status: [first, second] } = self;
        runtime.block_on(async {
            loop {
                let end = tokio::select! {
                    _ = terminate.0.recv() => terminate.1,
                    _ = interrupt.0.recv() => interrupt.1,
                    _ = quit.0.recv() => quit.1,
                    _ = reload.recv() => {
                        start_reload(running);
                        continue;
                    }
                    _ = first.recv() => { log_status(running); continue }
                    _ = second.recv() => { log_status(running); continue }
                    () = tokio::time::sleep(LOOK) => {
                        if !running.has_failed() { continue }
                        tracing::error!("ending, to be restarted");
                        return;
                    }
                };
                tracing::info!("{end}: draining");
                return;
            }
        });
    }
}

/// Reads every bundle again on a thread of its own: a signal that ends the server does not wait for it.
fn start_reload(running: &Running) {
    let (reloader, access) = (Arc::clone(running.reloader()), Arc::clone(running.access()));
    let reloading = std::thread::Builder::new().name("wade-reload".into()).spawn(move || {
        tracing::info!(target: AUDIT, by = "SIGHUP", job = "reload every vehicle", "administration");
        access.reload();
        match reloader.reload("") {
            Ok(reloads) => {
                for Reload { vehicle, served_version, refusal, .. } in reloads {
                    let refusal = refusal.map(|refusal| refusal.to_string());
                    tracing::info!(vehicle, version = served_version, refusal, "serves");
                }
            }
            Err(error) => tracing::warn!(%error, "nothing was reloaded"),
        }
    });
    if let Err(error) = reloading {
        tracing::warn!(%error, "SIGHUP: cannot start a thread; nothing was reloaded");
    }
}

fn log_status(running: &Running) {
    let report = running.health().report();
    let vehicles = running.reloader().names().join(" ");
    let (ready, grpc, http, shared_memory) = (report.ready, report.grpc, report.http, report.shared_memory);
    tracing::info!(ready, grpc, http, shared_memory, vehicles, "status");
}
