//! `wade serve`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use tracing_subscriber::EnvFilter;
use wade::config::{Config, Log};
use wade::cores;
use wade::server;
use wade::service::shm::Wait;

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
    /// Folder of the vehicle bundles
    #[arg(long, value_name = "DIR", env = "WADE_VEHICLES")]
    vehicles: Option<PathBuf>,
    /// Address of gRPC; empty for none
    #[arg(long, value_name = "ADDR")]
    listen: Option<String>,
    /// Unix socket of gRPC; empty for none
    #[arg(long, value_name = "PATH", value_parser = path_or_nothing)]
    unix_socket: Option<PathBuf>,
    /// Address of metrics and probes; empty for none
    #[arg(long, value_name = "ADDR")]
    http: Option<String>,
    /// Shared memory: how the server waits for requests
    #[arg(long, value_enum)]
    shm: Option<Shm>,
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
    /// Serves until SIGTERM or SIGINT.
    pub fn run(self) -> Result<ExitCode> {
        if self.with_parent {
            nix::sys::prctl::set_pdeathsig(nix::sys::signal::Signal::SIGTERM)?;
        }
        let config = self.config()?;
        config.validate()?;
        start_log(&config.log)?;
        cores::pin_to(&config.cpus).context("cpus")?;
        let running = server::start(&config)?;
        tracing::info!(
            grpc = running.grpc_address().map(tracing::field::display),
            unix_socket = running.unix_path().map(|path| tracing::field::display(path.display())),
            http = running.http_address().map(tracing::field::display),
            shm = config.shm.enabled,
            "serving"
        );
        notify(&[sd_notify::NotifyState::Ready]);
        wait_for_signal(&running)?;
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
        set(&mut config.cpus, self.cpus);
        set(&mut config.log.filter, self.log);
        match self.shm {
            Some(Shm::Off) => config.shm.enabled = false,
            Some(Shm::Block) => (config.shm.enabled, config.shm.wait) = (true, Wait::Block),
            Some(Shm::Spin) => (config.shm.enabled, config.shm.wait) = (true, Wait::Spin),
            None => {}
        }
        Ok(config)
    }
}

/// The parser of paths refuses the empty string, which here means none.
fn path_or_nothing(text: &str) -> Result<PathBuf, std::convert::Infallible> {
    Ok(PathBuf::from(text))
}

fn set<T>(place: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *place = value;
    }
}

fn start_log(log: &Log) -> Result<()> {
    let filter =
        EnvFilter::try_new(&log.filter).with_context(|| format!("log.filter = \"{}\"", log.filter))?;
    let lines = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    if log.json {
        lines.json().init()
    } else {
        lines.init()
    }
    Ok(())
}

/// Tells systemd, where it is systemd that started us.
fn notify(states: &[sd_notify::NotifyState]) {
    if let Err(error) = sd_notify::notify(states) {
        tracing::warn!(%error, "systemd was not told");
    }
}

/// How often the server is looked at for a thread that has ended.
const LOOK: std::time::Duration = std::time::Duration::from_secs(1);

/// Returns at SIGTERM or SIGINT, or when the server has failed and is best restarted.
fn wait_for_signal(running: &server::Running) -> Result<()> {
    use tokio::signal::unix::{SignalKind, signal};
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let (mut terminate, mut interrupt) =
            (signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?);
        let failed = async {
            while !running.has_failed() {
                tokio::time::sleep(LOOK).await;
            }
        };
        tokio::select! {
            _ = terminate.recv() => tracing::info!("SIGTERM"),
            _ = interrupt.recv() => tracing::info!("SIGINT"),
            () = failed => tracing::error!("ending, to be restarted"),
        }
        Ok(())
    })
}
