//! `wade soak`.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand, ValueEnum};
use wade::cores;
use wade::soak::{self, Ask, Clients, Config, Input, Pace, Rate, Report, SendError, Slo};
use wade_client::{Address, Client, ClientError, Credentials, GrpcClient, InProcess, Method, ShmClient};
use wade_core::domain::{Domain, Range};
use wade_wire::State;
use wade_wire::shm::Wait;

use super::interrupt::{INTERRUPTED, at_interrupts};
use super::progress::soak_bar;
use super::soak_server::{Server, Wanted};
use super::trust::Trust;
use super::{Vehicles, emit, usage_error};

/// Load a server at a steady rate for a stated time and report its latency
///
/// The load is open: requests are due on a schedule fixed beforehand, and the response time counts from when a request
/// was due, whatever held it up. Several rates are run one after the other and show the highest that the server holds.
/// Ctrl-C ends a run early and writes the report of the part until then. Exit status 1: an objective was missed, a
/// request was lost or refused, or the generator itself was late; 130: interrupted.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = "Examples:
  wade soak --vehicle husky --transport shm-spin --slo p99=500us --out soak/
  wade soak --vehicle warthog --transport grpc --rate max --duration 30s \\
    --batch 256 --input varying --out soak/
  wade soak --vehicle husky --vehicle warthog --addr 10.0.0.7:50051 \\
    --clients 8 --rate 1000,2000,4000 --duration 30s --out steps/
  wade soak compare before/ after/

Objectives (--slo), each of which may be repeated:
  p99=1ms  p99.99=20ms  max=1s     response time at any percentile
  rate=995                         least answered requests a second
  errors=0  errors=0.1%            most requests refused, lost or never sent;
                                   without it any of these fails the run")]
pub struct Soak {
    #[command(subcommand)]
    command: Option<Command>,
    /// Name of the vehicle; repeat it for several, which the clients take in turn
    // the required ones are optional only beside a subcommand, which has its own
    #[arg(long, required = true, value_name = "NAME")]
    vehicle: Vec<String>,
    /// How to ask [default with --addr: grpc, uds or shm-block]
    #[arg(long, value_enum, required_unless_present = "addr")]
    transport: Option<Transport>,
    /// Requests a second of all clients together, or max for one after the other; several with commas between are run
    /// one after the other
    #[arg(long, value_name = "HZ|max", default_value = "1000", value_delimiter = ',')]
    rate: Vec<Rate>,
    /// Clients that ask at the same time, each with a connection and a thread of its own
    #[arg(long, default_value = "1")]
    clients: NonZeroUsize,
    /// Length of the measured part at each rate, such as 300s or 5m
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
    /// Objective, such as p99=1ms; may be repeated
    #[arg(long)]
    slo: Vec<Slo>,
    /// Folder for soak.json, soak.hlog and soak.html; with several rates one of each rate, and steps.json and steps.html
    #[arg(long, value_name = "DIR", required = true)]
    out: Option<PathBuf>,
    /// Replace the report of another run in that folder
    #[arg(long)]
    force: bool,
    /// Print the JSON too
    #[arg(long)]
    json: bool,
    /// Ask this server, and start none: host:port, https://host:port, unix:PATH or shm:NAMESPACE
    #[arg(long)]
    addr: Option<Address>,
    #[command(flatten)]
    trust: Trust,
    /// Which CPUs server and client run on
    #[arg(long, value_enum, default_value_t = Pin::Split)]
    pin: Pin,
    /// How a client waits until its next request is due
    #[arg(long, value_enum, default_value_t = Waiting::Spin)]
    pace: Waiting,
    #[command(flatten)]
    vehicles: Vehicles,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Compare the reports of two runs
    #[command(after_help = "Example: wade soak compare before/ after/")]
    Compare {
        /// Folder of the first report
        before: PathBuf,
        /// Folder of the second report
        after: PathBuf,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
}

/// How a soak asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Transport {
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
enum Waiting {
    /// It reads the clock without pause, on a core that it has to itself
    Spin,
    /// It sleeps, some 0.05 ms too long, and leaves the core to others
    Sleep,
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

impl Transport {
    /// The usual one of an address.
    fn of(address: &Address) -> Self {
        match address {
            Address::Tcp(_) | Address::Tls(_) => Self::Grpc,
            Address::Unix(_) => Self::Uds,
            Address::Shm(_) => Self::ShmBlock,
        }
    }

    fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    /// The form of the addresses that it asks; none where it asks no server.
    fn form(self) -> Option<&'static str> {
        match self {
            Self::Inproc => None,
            Self::ShmSpin | Self::ShmBlock => Some("shm:NAMESPACE"),
            Self::Grpc | Self::GrpcStream => Some("host:port or https://host:port"),
            Self::Uds | Self::UdsStream => Some("unix:PATH"),
        }
    }

    fn suits(self, address: &Address) -> bool {
        matches!(
            (self, address),
            (Self::ShmSpin | Self::ShmBlock, Address::Shm(_))
                | (Self::Grpc | Self::GrpcStream, Address::Tcp(_) | Address::Tls(_))
                | (Self::Uds | Self::UdsStream, Address::Unix(_))
        )
    }
}

impl Soak {
    /// Runs the load and writes the report.
    pub fn run(self) -> Result<ExitCode> {
        if let Some(Command::Compare { before, after, json }) = &self.command {
            return compare(before, after, *json);
        }
        let (transport, out) = (self.transport(), self.out.as_deref().unwrap_or(Path::new(".")));
        // minutes of measurement are not to be lost to a folder that cannot be written
        let several = self.rate.len() > 1;
        if several {
            soak::steps::prepare(out, self.force)?;
        }
        let folders: Vec<PathBuf> = self
            .rate
            .iter()
            .map(|rate| if several { out.join(rate.folder()) } else { out.to_owned() })
            .collect();
        folders.iter().try_for_each(|folder| soak::report::prepare(folder, self.force))?;
        let (server_cpu, client_cpus) = self.cpus()?;
        let mut server = match (&self.addr, transport) {
            (Some(_), _) | (None, Transport::Inproc) => None,
            (None, _) => Some(Server::start(&Wanted {
                transport,
                vehicles: &self.vehicles,
                cpu: server_cpu,
                batch: self.batch.get(),
                clients: self.clients.get(),
            })?),
        };
        let address = self.addr.clone().or_else(|| server.as_ref().map(|server| server.address().clone()));
        let credentials = self.trust.credentials()?;
        let (address, credentials) = (address.as_ref(), &credentials);
        let target = Target { transport, address, credentials, vehicles: &self.vehicles };
        self.wait_for_answers(&target, server.as_mut())?;
        if !client_cpus.is_empty() {
            cores::pin_to(&client_cpus)?;
        }
        let inputs = self.vehicle.iter().map(|vehicle| self.input(&target.domain(vehicle)?));
        let inputs = inputs.collect::<Result<Vec<Input>>>()?;
        let (stop, mut reports) = (stop_at_interrupt()?, Vec::new());
        for (rate, folder) in self.rate.iter().zip(&folders) {
            let control_core = match client_cpus[..] {
                [cpu] => Some(cpu),
                _ => None,
            };
            let config = self.config(transport, *rate, control_core);
            let connect = |index: usize| target.ask(&self.vehicle[index % self.vehicle.len()]);
            let clients = Clients { inputs: &inputs, connect: &connect };
            let report = soak::run_clients(&config, &clients, &soak_bar(), &stop)?;
            soak::report::write(folder, &report)?;
            if !self.json {
                emit(&line(&report, folder))?;
            }
            report.failures.iter().for_each(|failure| eprintln!("error: {failure}"));
            reports.push(report);
            if stop.load(Ordering::Relaxed) {
                break;
            }
        }
        self.conclude(&reports, out)
    }

    /// The answer to all rates together.
    fn conclude(&self, reports: &[Report], out: &Path) -> Result<ExitCode> {
        let interrupted = reports.iter().any(|report| report.interrupted);
        let passed = match (self.rate.len(), reports) {
            (1, [report]) => {
                if self.json {
                    emit(&format!("{}\n", serde_json::to_string_pretty(report)?))?;
                }
                report.passed
            }
            _ => {
                let steps = soak::steps::Steps::new(reports);
                soak::steps::write(out, &steps)?;
                let page = out.join("steps.html");
                let text = format!("{}\n{}\n", steps.sentence(), page.display());
                emit(&if self.json { format!("{}\n", serde_json::to_string_pretty(&steps)?) } else { text })?;
                // steps go beyond what the server holds on purpose: that none holds is the failure
                steps.knee_hz.is_some()
            }
        };
        Ok(ExitCode::from(if interrupted { INTERRUPTED } else { u8::from(!passed) }))
    }

    /// How to ask; what contradicts the address is refused.
    fn transport(&self) -> Transport {
        match (self.transport, &self.addr) {
            (None, None) => usage_error("give --transport, or --addr"),
            (None, Some(address)) => Transport::of(address),
            (Some(transport), None) => transport,
            (Some(transport), Some(address)) if transport.suits(address) => transport,
            (Some(transport), Some(address)) => usage_error(&match transport.form() {
                Some(form) => {
                    format!("--transport {} asks {form}, and --addr is {address}", transport.name())
                }
                None => "--transport inproc asks no server, so it takes no --addr".into(),
            }),
        }
    }

    fn config(&self, transport: Transport, rate: Rate, control_core: Option<usize>) -> Config {
        Config {
            vehicle: self.vehicle.join(","),
            transport: transport.name(),
            rate,
            clients: self.clients,
            duration: self.duration,
            warm_up: self.warm_up,
            batch: self.batch,
            pace: match self.pace {
                Waiting::Spin => Pace::Spin,
                Waiting::Sleep => Pace::Sleep,
            },
            slo: self.slo.clone(),
            control_core,
            commit: env!("WADE_COMMIT").into(),
        }
    }

    /// CPU of the server, and those of the clients; none where they are free to move.
    fn cpus(&self) -> Result<(Option<usize>, Vec<usize>)> {
        let cores = cores::allowed()?;
        Ok(match (self.pin, cores.as_slice()) {
            (Pin::Split, [first, second, ..]) if self.clients.get() == 1 => (Some(*first), vec![*second]),
            (Pin::Split, [first, others @ ..]) if !others.is_empty() => (Some(*first), others.to_vec()),
            (Pin::Same, [first, ..]) => (Some(*first), vec![*first]),
            (Pin::Split | Pin::Same | Pin::Off, _) => (None, Vec::new()),
        })
    }

    /// Waits until the server answers for each vehicle.
    fn wait_for_answers(&self, target: &Target<'_>, mut server: Option<&mut Server>) -> Result<()> {
        let start = Instant::now();
        for vehicle in &self.vehicle {
            loop {
                match target.client(vehicle).and_then(|mut client| client.evaluate(&State::still(0.0))) {
                    Ok(_) => break,
                    Err(error @ ClientError::Refused { .. }) => return Err(error.into()),
                    Err(error) if server.is_none() || start.elapsed() > START => return Err(error.into()),
                    Err(_) => std::thread::sleep(Duration::from_millis(20)),
                }
                if let Some(status) = server.as_mut().map(|server| server.ended()).transpose()?.flatten() {
                    bail!("the server ended while starting: {status}");
                }
            }
        }
        Ok(())
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

/// Who is asked, and how.
struct Target<'a> {
    transport: Transport,
    /// None where no server is asked.
    address: Option<&'a Address>,
    credentials: &'a Credentials,
    vehicles: &'a Vehicles,
}

impl Target<'_> {
    fn client(&self, vehicle: &str) -> Result<Client, ClientError> {
        let url = || self.address.and_then(Address::url).unwrap_or_default();
        let grpc = |method| {
            GrpcClient::connect(&url(), vehicle, method, TIMEOUT, self.credentials)
                .map(|client| Client::Grpc(Box::new(client)))
        };
        let shm = |wait| {
            let client = ShmClient::new(vehicle, wait, TIMEOUT);
            Ok(Client::Shm(Box::new(match self.address {
                Some(Address::Shm(namespace)) => client.in_namespace(namespace),
                _ => client,
            })))
        };
        match self.transport {
            Transport::Inproc => {
                let served = self.vehicles.served(vehicle).map_err(|error| ClientError::NoServer {
                    at: "this process".into(),
                    reason: error.to_string(),
                })?;
                Ok(Client::InProcess(Box::new(InProcess::new(Arc::new(served)))))
            }
            Transport::Grpc | Transport::Uds => grpc(Method::Unary),
            Transport::GrpcStream | Transport::UdsStream => grpc(Method::Stream),
            Transport::ShmSpin => shm(Wait::Spin),
            Transport::ShmBlock => shm(Wait::Block),
        }
    }

    /// A client that has had an answer.
    fn ask(&self, vehicle: &str) -> Result<Ask<'static>, ClientError> {
        let mut client = self.client(vehicle)?;
        client.evaluate(&State::still(0.0))?;
        Ok(Box::new(move |states| {
            client.compute(states).map_err(|error| match error {
                ClientError::Timeout(_) => SendError::Lost,
                other => SendError::Refused(other.to_string()),
            })
        }))
    }

    /// The training domain: of the server that is asked over gRPC, else of our own bundle.
    fn domain(&self, vehicle: &str) -> Result<Domain> {
        match self.address.and_then(Address::url) {
            Some(url) => {
                Ok(GrpcClient::connect(&url, vehicle, Method::Unary, TIMEOUT, self.credentials)?.domain()?)
            }
            None => Ok(*self.vehicles.model(vehicle)?.domain()),
        }
    }
}

/// A flag that Ctrl-C or SIGTERM sets; a second one ends the program at once.
fn stop_at_interrupt() -> Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = Arc::clone(&stop);
    at_interrupts(move || {
        if stopped.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(INTERRUPTED));
        }
        eprintln!("interrupted: writing the report of what was measured; again ends at once");
    })?;
    Ok(stop)
}

fn line(report: &Report, folder: &Path) -> String {
    let r = &report.response_time_us;
    format!(
        "{:.0} Hz, response p50 {:.1} us, p95 {:.1}, p99 {:.1}, p99.9 {:.1}, max {:.1}; {} refused, {} lost\n{}\n",
        report.rate_hz,
        r.p50,
        r.p95,
        r.p99,
        r.p99_9,
        r.max,
        report.errors,
        report.lost,
        folder.join("soak.html").display()
    )
}

fn compare(before: &Path, after: &Path, json: bool) -> Result<ExitCode> {
    let comparison = soak::compare::Comparison::read(before, after)?;
    emit(&if json {
        format!("{}\n", serde_json::to_string_pretty(&comparison)?)
    } else {
        comparison.text()
    })?;
    Ok(ExitCode::SUCCESS)
}
