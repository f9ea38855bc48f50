//! `wade soak`.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use tempfile::TempDir;
use wade::client::{Client, ClientError, GrpcClient, InProcess, Method, ShmClient};
use wade::cores;
use wade::domain::{Domain, Range};
use wade::service::shm::Wait;
use wade::service::wire::State;
use wade::service::{grpc, shm};
use wade::soak::{self, Config, Input, Rate, SendError, Slo};

use super::progress::soak_bar;
use super::{Vehicles, emit, usage_error};

/// Load a server at a steady rate for a stated time and report its latency
///
/// The load is open: requests are due on a schedule fixed beforehand, and the response time counts from when a request
/// was due, whatever held it up. Exit status 1: an objective was missed, a request was lost or refused, or the
/// generator itself was late.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  wade soak --vehicle husky --transport shm-spin --rate 1000 --duration 300s --slo p99=500us --out soak/
  wade soak --vehicle warthog --transport grpc --rate max --duration 30s --batch 256 --input varying --out soak/")]
pub struct Soak {
    /// Name of the vehicle
    #[arg(long)]
    vehicle: String,
    /// How to ask
    #[arg(long, value_enum)]
    transport: Transport,
    /// Requests a second, or max for one after the other
    #[arg(long, value_name = "HZ|max", default_value = "1000")]
    rate: Rate,
    /// Length of the measured part, such as 300s or 5m
    #[arg(long, value_parser = soak::parse_duration, default_value = "300s")]
    duration: Duration,
    /// Load before it, recorded apart
    #[arg(long, value_parser = soak::parse_duration, default_value = "5s")]
    warm_up: Duration,
    /// States in a request
    #[arg(long, default_value = "1")]
    batch: NonZeroUsize,
    /// constant, varying, or a trace: a CSV with the columns of a trial
    #[arg(long, default_value = "constant", value_name = "constant|varying|FILE")]
    input: String,
    /// Objective for the response time, such as p99=1ms; may be repeated
    #[arg(long)]
    slo: Vec<Slo>,
    /// Folder for soak.json, soak.hlog and soak.html
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print the JSON too
    #[arg(long)]
    json: bool,
    /// Ask this server, http://HOST:PORT, the path of a socket, or the namespace of a shared memory, and start none
    #[arg(long)]
    addr: Option<String>,
    /// Which CPUs server and client run on
    #[arg(long, value_enum, default_value_t = Pin::Split)]
    pin: Pin,
    #[command(flatten)]
    vehicles: Vehicles,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Transport {
    /// No server: a call
    Inproc,
    /// Shared memory, both ends polling
    ShmSpin,
    /// Shared memory, both ends sleeping
    ShmBlock,
    /// gRPC over TCP, one call each
    Grpc,
    /// gRPC over TCP, one stream
    GrpcStream,
    /// gRPC over a Unix socket, one call each
    Uds,
    /// gRPC over a Unix socket, one stream
    UdsStream,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Pin {
    /// One CPU each, where there are two
    Split,
    /// Both on one
    Same,
    /// Where the system puts them
    Off,
}

/// Longest wait for an answer; a request that takes longer is lost.
const TIMEOUT: Duration = Duration::from_secs(1);

/// Longest wait for a server to start.
const START: Duration = Duration::from_secs(30);

impl Soak {
    /// Runs the load and writes the report.
    pub fn run(self) -> Result<ExitCode> {
        if self.addr.is_some() && self.transport == Transport::Inproc {
            usage_error("--transport inproc has no server, so no --addr");
        }
        // minutes of measurement are not to be lost to a folder that cannot be written
        soak::report::prepare(&self.out)?;
        let (server_cpu, client_cpu) = self.cpus()?;
        let server = match (&self.addr, self.transport) {
            (Some(_), _) | (None, Transport::Inproc) => None,
            (None, _) => Some(Server::start(&self, server_cpu)?),
        };
        let at = match (&self.addr, &server) {
            (Some(addr), _) => addr.clone(),
            (None, Some(server)) => server.address.clone(),
            (None, None) => String::new(),
        };
        if let Some(cpu) = client_cpu {
            cores::pin_to(&[cpu])?;
        }
        let mut client = self.connect(&at, server)?;
        let input = self.input(&self.domain(&at)?)?;
        let config = Config {
            vehicle: self.vehicle.clone(),
            transport: self
                .transport
                .to_possible_value()
                .map(|v| v.get_name().to_owned())
                .unwrap_or_default(),
            rate: self.rate,
            duration: self.duration,
            warm_up: self.warm_up,
            batch: self.batch,
            slo: self.slo.clone(),
            control_core: client_cpu,
            commit: env!("WADE_COMMIT").into(),
        };
        let mut send = |states: &[State]| {
            client.client.compute(states).map_err(|error| match error {
                ClientError::Timeout(_) => SendError::Lost,
                other => SendError::Refused(other.to_string()),
            })
        };
        let report = soak::run(&config, &input, &mut send, &soak_bar());
        soak::report::write(&self.out, &report)?;
        if self.json {
            emit(&format!("{}\n", serde_json::to_string_pretty(&report)?))?;
        } else {
            let r = &report.response_time_us;
            emit(&format!(
                "{:.0} Hz, response p50 {:.1} us, p95 {:.1}, p99 {:.1}, p99.9 {:.1}, max {:.1}; {} refused, {} lost\n{}\n",
                report.rate_hz,
                r.p50,
                r.p95,
                r.p99,
                r.p99_9,
                r.max,
                report.errors,
                report.lost,
                self.out.join("soak.html").display()
            ))?;
        }
        report.failures.iter().for_each(|failure| eprintln!("error: {failure}"));
        Ok(ExitCode::from(u8::from(!report.passed)))
    }

    /// CPU of the server and of the client.
    fn cpus(&self) -> Result<(Option<usize>, Option<usize>)> {
        let cores = cores::allowed()?;
        Ok(match (self.pin, cores.as_slice()) {
            (Pin::Split, [first, second, ..]) => (Some(*first), Some(*second)),
            (Pin::Same, [first, ..]) => (Some(*first), Some(*first)),
            (Pin::Split | Pin::Same | Pin::Off, _) => (None, None),
        })
    }

    fn client(&self, at: &str) -> Result<Client, ClientError> {
        let vehicle = self.vehicle.as_str();
        let tcp = |method| GrpcClient::tcp(at, vehicle, method, TIMEOUT).map(|c| Client::Grpc(Box::new(c)));
        let unix =
            |method| GrpcClient::unix(at.into(), vehicle, method, TIMEOUT).map(|c| Client::Grpc(Box::new(c)));
        let shm = |wait| Ok(Client::Shm(Box::new(ShmClient::new(vehicle, wait, TIMEOUT).in_namespace(at))));
        match self.transport {
            Transport::Inproc => {
                let served = self.vehicles.served(vehicle).map_err(|error| ClientError::NoServer {
                    at: "this process".into(),
                    reason: error.to_string(),
                })?;
                Ok(Client::InProcess(Box::new(InProcess::new(Arc::new(served)))))
            }
            Transport::Grpc => tcp(Method::Unary),
            Transport::GrpcStream => tcp(Method::Stream),
            Transport::Uds => unix(Method::Unary),
            Transport::UdsStream => unix(Method::Stream),
            Transport::ShmSpin => shm(Wait::Spin),
            Transport::ShmBlock => shm(Wait::Block),
        }
    }

    /// Waits until the server answers; the server lives as long as what is returned.
    fn connect(&self, at: &str, mut server: Option<Server>) -> Result<Connected> {
        let start = Instant::now();
        loop {
            let answered = self.client(at).and_then(|mut client| {
                client.evaluate(&State::default())?;
                Ok(client)
            });
            match answered {
                Ok(client) => return Ok(Connected { client, _server: server }),
                Err(error @ ClientError::Refused { .. }) => return Err(error.into()),
                Err(error) if server.is_none() || start.elapsed() > START => return Err(error.into()),
                Err(_) => std::thread::sleep(Duration::from_millis(20)),
            }
            if let Some(server) = &mut server
                && let Some(status) = server.child.try_wait()?
            {
                bail!("the server ended while starting: {status}");
            }
        }
    }

    /// The training domain: of the server that is asked over gRPC, else of our own bundle.
    fn domain(&self, at: &str) -> Result<Domain> {
        let remote = match self.transport {
            Transport::Grpc | Transport::GrpcStream => {
                Some(GrpcClient::tcp(at, &self.vehicle, Method::Unary, TIMEOUT)?)
            }
            Transport::Uds | Transport::UdsStream => {
                Some(GrpcClient::unix(at.into(), &self.vehicle, Method::Unary, TIMEOUT)?)
            }
            _ => None,
        };
        match remote {
            Some(mut client) => Ok(client.domain()?),
            None => Ok(*self.vehicles.model(&self.vehicle)?.domain()),
        }
    }

    fn input(&self, domain: &Domain) -> Result<Input> {
        let range = |range: Range| [range.min as f32, range.max as f32];
        let ranges = soak::Domain {
            speed: range(domain.speed_mps),
            angle: range(domain.angle_rad),
            depth: range(domain.depth_m),
            density: range(domain.density_kgpm3),
        };
        Ok(match self.input.as_str() {
            "constant" => Input::constant(&ranges),
            "varying" => Input::varying(&ranges),
            path => {
                let file = std::fs::File::open(path).with_context(|| format!("--input {path}"))?;
                let input = Input::from_csv(file).with_context(|| format!("--input {path}"))?;
                input
                    .unknown_columns()
                    .iter()
                    .for_each(|column| eprintln!("{path}: column {column} is not used"));
                input
            }
        })
    }
}

/// A client that has had an answer, and the server that it started.
struct Connected {
    client: Client,
    _server: Option<Server>,
}

/// A server of the soak's own, ended with it.
struct Server {
    child: Child,
    address: String,
    _folder: TempDir,
}

impl Server {
    fn start(soak: &Soak, cpu: Option<usize>) -> Result<Self> {
        let folder = TempDir::new()?;
        let socket = folder.path().join("wade.sock");
        let namespace = format!("soak-{}", std::process::id());
        let mut config = wade::config::Config { vehicles: soak.vehicles.directory(), ..Default::default() };
        config.cpus.extend(cpu);
        config.http.listen = String::new();
        config.log.filter = "warn,iceoryx2_bb_loggers=error".into();
        config.grpc = grpc::Config { listen: String::new(), unix_socket: PathBuf::new(), ..config.grpc };
        config.grpc.max_batch = config.grpc.max_batch.max(soak.batch.get());
        config.shm = shm::Config { enabled: false, namespace: namespace.clone(), ..config.shm };
        let address = match soak.transport {
            Transport::Inproc => bail!("no server is needed in process"),
            Transport::Grpc | Transport::GrpcStream => {
                config.grpc.listen = free_port()?;
                format!("http://{}", config.grpc.listen)
            }
            Transport::Uds | Transport::UdsStream => {
                config.grpc.unix_socket = socket.clone();
                socket.display().to_string()
            }
            Transport::ShmSpin | Transport::ShmBlock => {
                config.shm.enabled = true;
                config.shm.wait = if soak.transport == Transport::ShmSpin { Wait::Spin } else { Wait::Block };
                namespace
            }
        };
        let file = folder.path().join("wade.toml");
        std::fs::write(&file, toml::to_string(&config)?)?;
        let mut command = Command::new(std::env::current_exe()?);
        command
            .arg("serve")
            .arg("--with-parent")
            .arg("--config")
            .arg(&file)
            .stdin(Stdio::null())
            .stdout(Stdio::null());
        // what the caller's environment says is for the caller's server
        command.env_remove("WADE_VEHICLES").env_remove("WADE_LOG");
        let child = command.spawn().context("starting the server")?;
        Ok(Self { child, address, _folder: folder })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        use nix::sys::signal::{Signal, kill};
        use nix::unistd::Pid;
        // a server that has ended by itself has said why
        let _ = kill(Pid::from_raw(self.child.id().cast_signed()), Signal::SIGTERM);
        let _ = self.child.wait();
    }
}

/// An address on loopback that nobody had a moment ago.
fn free_port() -> Result<String> {
    let listener = std::net::TcpListener::bind("127.0.0.1:0")?;
    Ok(listener.local_addr()?.to_string())
}
