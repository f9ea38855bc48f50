//! `wade doctor`: what wade needs of a machine, and the way out of what is missing.

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use nix::sys::statvfs::statvfs;
use serde::Serialize;
use wade::config::Config;
use wade::cores;
use wade::service::occupant::{self, Occupant};
use wade_client::{Address, Client, ClientError, Credentials, GrpcClient, Method, ShmClient};
use wade_core::model::kernel::Isa;
use wade_learn::cfd::openfoam::OpenFoam;
use wade_wire::State;
use wade_wire::shm::Wait;

use super::{PROGRAM, Vehicles, emit};

/// Check what wade needs of this machine, and say the way out of what is missing
///
/// Looks at the vehicles, addresses, shared memory, limits and CPU that `wade serve` would use, asks a running server over
/// each transport, and looks for OpenFOAM and the Python client. It changes nothing. Exit status 1: something fails.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  wade doctor
  wade doctor --config /etc/wade/wade.toml --json")]
pub struct Doctor {
    /// Settings of the server, as in deploy/wade.toml
    #[arg(long, value_name = "FILE", env = "WADE_CONFIG")]
    config: Option<PathBuf>,
    #[command(flatten)]
    vehicles: Vehicles,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// How a check came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Status {
    Ok,
    /// It works, or nobody needs it yet.
    Warn,
    Fail,
}

#[derive(Debug, Serialize)]
struct Check {
    name: &'static str,
    status: Status,
    found: String,
    /// What to do; empty where all is well.
    way_out: String,
}

impl Check {
    fn ok(name: &'static str, found: impl Into<String>) -> Self {
        Self { name, status: Status::Ok, found: found.into(), way_out: String::new() }
    }

    fn warn(name: &'static str, found: impl Into<String>, way_out: impl Into<String>) -> Self {
        Self { name, status: Status::Warn, found: found.into(), way_out: way_out.into() }
    }

    fn fail(name: &'static str, found: impl Into<String>, way_out: impl Into<String>) -> Self {
        Self { name, status: Status::Fail, found: found.into(), way_out: way_out.into() }
    }
}

/// Free shared memory below which clients run out of room [bytes]: that of a container by default.
const LEAST_SHM: u64 = 64 << 20;
/// File descriptors below which connections are refused: a gRPC connection takes one, a client over shared memory a dozen.
const LEAST_DESCRIPTORS: u64 = 1024;
/// Sleeps of 1 ms whose lateness tells how calm the machine is.
const SLEEPS: usize = 300;
/// Lateness of the worst of a hundred sleeps from which a machine is no place for latencies below a millisecond.
const CALM: Duration = Duration::from_millis(1);
/// Longest wait for a server that may not be there.
const TIMEOUT: Duration = Duration::from_millis(500);

impl Doctor {
    /// Prints a line a check.
    pub fn run(self) -> Result<ExitCode> {
        let (settings, config) = self.settings();
        let names = self.vehicles.library().and_then(|library| Ok(library.names()?)).unwrap_or_default();
        let mut checks = vec![Check::ok("program", PROGRAM), settings, self.vehicles()];
        checks.extend([
            port("gRPC address", &config.grpc.listen, "--listen (grpc.listen)"),
            port("HTTP address", &config.http.listen, "--http (http.listen)"),
            socket(&config.grpc.unix_socket),
            room(),
            iceoryx_folder(),
            descriptors(),
            cpu(),
            governor(),
            calm(),
        ]);
        checks.extend(servers(&config, names.first().map(String::as_str)));
        checks.extend([openfoam(), python()]);
        let failed = checks.iter().any(|check| check.status == Status::Fail);
        let text = match self.json {
            true => format!("{:#}\n", serde_json::json!({ "ok": !failed, "checks": checks })),
            false => checks.iter().map(line).collect(),
        };
        emit(&text)?;
        Ok(ExitCode::from(u8::from(failed)))
    }

    fn settings(&self) -> (Check, Config) {
        let Some(path) = &self.config else {
            return (Check::ok("settings", "the defaults; no --config"), Config::default());
        };
        let read = Config::read(path).and_then(|config| config.validate().map(|()| config));
        match read {
            Ok(config) => (Check::ok("settings", path.display().to_string()), config),
            Err(error) => {
                let way_out =
                    "correct the file; deploy/wade.toml shows every key; the checks below use the defaults";
                (Check::fail("settings", error.to_string(), way_out), Config::default())
            }
        }
    }

    fn vehicles(&self) -> Check {
        let fail = |error: &anyhow::Error| {
            let way_out =
                "wade vehicle check DIR says more; put a sound version back with wade vehicle rollback";
            Check::fail("vehicles", format!("{error:#}"), way_out)
        };
        let library = match self.vehicles.library() {
            Ok(library) => library,
            Err(error) => return fail(&error),
        };
        let mut found = Vec::new();
        for name in library.names().unwrap_or_default() {
            match library.served(&name, Isa::available()[0]) {
                Ok(served) => found.push(format!("{name} ({})", served.origin())),
                Err(error) => return fail(&error.into()),
            }
        }
        Check::ok("vehicles", found.join(", "))
    }
}

fn line(check: &Check) -> String {
    let status = match check.status {
        Status::Ok => "ok  ",
        Status::Warn => "warn",
        Status::Fail => "FAIL",
    };
    let mut text = format!("{status}  {:<16} {}\n", check.name, check.found);
    if !check.way_out.is_empty() {
        text += &format!("      {:<16} -> {}\n", "", check.way_out);
    }
    text
}

/// What an occupied address means.
fn occupied(name: &'static str, at: &str, occupant: &Occupant, way_out: &str) -> Check {
    match occupant.name.as_str() {
        "wade" => Check::ok(name, format!("{at}: served by {occupant}")),
        _ => Check::fail(
            name,
            format!("{at}: taken by {occupant}"),
            format!("stop it, or choose another with {way_out}"),
        ),
    }
}

fn port(name: &'static str, listen: &str, way_out: &str) -> Check {
    if listen.is_empty() {
        return Check::ok(name, "off");
    }
    let Ok(address) = listen.parse() else {
        return Check::fail(
            name,
            format!("\"{listen}\" is no address"),
            format!("write one such as 127.0.0.1:50051: {way_out}"),
        );
    };
    match occupant::of_tcp(address) {
        Some(occupant) => occupied(name, listen, &occupant, way_out),
        None => match std::net::TcpListener::bind(address) {
            Ok(_) => Check::ok(name, format!("{listen} is free")),
            Err(error) => {
                Check::fail(name, format!("{listen}: {error}"), format!("choose another with {way_out}"))
            }
        },
    }
}

fn socket(path: &Path) -> Check {
    let (name, way_out) = ("Unix socket", "--unix-socket (grpc.unix_socket)");
    if path.as_os_str().is_empty() {
        return Check::ok(name, "off");
    }
    let at = path.display().to_string();
    if let Some(occupant) = occupant::of_unix(path) {
        return occupied(name, &at, &occupant, way_out);
    }
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match tempfile::tempfile_in(parent) {
        Ok(_) => Check::ok(name, format!("{at} is free")),
        Err(error) => Check::fail(
            name,
            format!("{}: {error}", parent.display()),
            format!("choose a folder that you may write to with {way_out}"),
        ),
    }
}

fn room() -> Check {
    let name = "shared memory";
    match statvfs("/dev/shm") {
        Ok(found) => {
            let free = found.blocks_available() * found.fragment_size();
            let text = format!("{} MB free in /dev/shm", free >> 20);
            match free >= LEAST_SHM {
                true => Check::ok(name, text),
                false => Check::warn(
                    name,
                    text,
                    "remove what is left there, enlarge it (docker run --shm-size 256m), or lower shm.max_clients",
                ),
            }
        }
        Err(error) => {
            Check::warn(name, format!("/dev/shm: {error}"), "mount a tmpfs there, or serve with --shm off")
        }
    }
}

/// Where iceoryx2 keeps what its processes find each other by.
const ICEORYX: &str = "/tmp/iceoryx2";

fn iceoryx_folder() -> Check {
    let name = "iceoryx2 folder";
    let me = nix::unistd::geteuid().as_raw();
    match std::fs::metadata(ICEORYX) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            Check::ok(name, format!("{ICEORYX} is not there yet; the first server makes it"))
        }
        Err(error) => Check::fail(name, format!("{ICEORYX}: {error}"), "remove it, or serve with --shm off"),
        Ok(found) if found.uid() == me || me == 0 => {
            Check::ok(name, format!("{ICEORYX} belongs to user {}", found.uid()))
        }
        Ok(found) => Check::fail(
            name,
            format!("{ICEORYX} belongs to user {}, you are user {me}", found.uid()),
            "have that user remove it while no server of theirs runs, or serve with --shm off",
        ),
    }
}

fn descriptors() -> Check {
    let name = "descriptors";
    let limits = std::fs::read_to_string("/proc/self/limits").unwrap_or_default();
    let limit =
        limits.lines().find_map(|line| line.strip_prefix("Max open files")?.split_whitespace().next());
    match limit.and_then(|limit| limit.parse::<u64>().ok()) {
        Some(limit) if limit < LEAST_DESCRIPTORS => Check::warn(
            name,
            format!("at most {limit} open files"),
            format!("raise it: ulimit -n {LEAST_DESCRIPTORS}, or LimitNOFILE= in the systemd unit"),
        ),
        Some(limit) => Check::ok(name, format!("at most {limit} open files")),
        None => Check::ok(name, "no limit"),
    }
}

fn cpu() -> Check {
    let name = "CPU";
    let isa = Isa::available()[0].name();
    let cores = cores::allowed().map_or(1, |cores| cores.len());
    let text = format!("{isa}, {cores} cores");
    match cores {
        0 | 1 => Check::warn(name, text, "give it a second core: a client that polls takes one of its own"),
        _ => Check::ok(name, text),
    }
}

fn governor() -> Check {
    let name = "CPU governor";
    match std::fs::read_to_string("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor") {
        Ok(governor) if governor.trim() == "performance" => Check::ok(name, "performance"),
        Ok(governor) => Check::warn(
            name,
            governor.trim(),
            "latencies are steadier at a fixed frequency: cpupower frequency-set -g performance",
        ),
        Err(_) => Check::ok(name, "not visible here, as in most virtual machines"),
    }
}

fn calm() -> Check {
    let name = "hiccups";
    let mut late: Vec<Duration> = (0..SLEEPS)
        .map(|_| {
            let (begun, sleep) = (Instant::now(), Duration::from_millis(1));
            std::thread::sleep(sleep);
            begun.elapsed().saturating_sub(sleep)
        })
        .collect();
    late.sort();
    let p99 = late[SLEEPS * 99 / 100];
    let text = format!("1 of 100 sleeps ends {:.2} ms late", p99.as_secs_f64() * 1e3);
    match p99 < CALM {
        true => Check::ok(name, text),
        false => Check::warn(
            name,
            text,
            "other programs or the host take the CPU: no server answers faster than that; wade soak measures it beside",
        ),
    }
}

/// Whether a server answers over each transport. Where none runs at all, that is no fault.
fn servers(config: &Config, vehicle: Option<&str>) -> Vec<Check> {
    let Some(vehicle) = vehicle else { return Vec::new() };
    let mut addresses = Vec::new();
    if !config.grpc.listen.is_empty() {
        let form = if config.tls.is_on() && !config.grpc.insecure { Address::Tls } else { Address::Tcp };
        addresses.push(("server, gRPC", form(config.grpc.listen.clone())));
    }
    if !config.grpc.unix_socket.as_os_str().is_empty() {
        addresses.push(("server, socket", Address::Unix(config.grpc.unix_socket.clone())));
    }
    if config.shm.enabled {
        addresses.push(("server, shm", Address::Shm(config.shm.namespace.clone())));
    }
    let asked: Vec<_> =
        addresses.into_iter().map(|(name, address)| (name, ask(&address, vehicle), address)).collect();
    let some = asked.iter().any(|(_, answer, _)| answer.is_ok());
    let check = |(name, answer, address): (&'static str, Result<u32, ClientError>, Address)| match answer {
        Ok(version) => Check::ok(name, format!("{address} answers: {vehicle}, version {version}")),
        Err(_) if !some => Check::ok(name, format!("no server at {address}; wade serve starts one")),
        Err(error) => Check::warn(
            name,
            format!("{address}: {error}"),
            "the server answers elsewhere: its log says why not here",
        ),
    };
    asked.into_iter().map(check).collect()
}

/// The version of the bundle that answers.
fn ask(address: &Address, vehicle: &str) -> Result<u32, ClientError> {
    let mut client = match address {
        Address::Shm(namespace) => {
            Client::Shm(Box::new(ShmClient::new(vehicle, Wait::Block, TIMEOUT).in_namespace(namespace)))
        }
        Address::Tcp(_) | Address::Tls(_) | Address::Unix(_) => {
            let (url, shown) = (address.url().unwrap_or_default(), Credentials::from_environment()?);
            Client::Grpc(Box::new(GrpcClient::connect(&url, vehicle, Method::Unary, TIMEOUT, &shown)?))
        }
    };
    Ok(client.evaluate(&State::still(0.0))?.version)
}

fn openfoam() -> Check {
    let name = "OpenFOAM";
    match OpenFoam::find() {
        Ok(solver) => Check::ok(name, solver.label()),
        Err(error) => Check::warn(
            name,
            error.to_string(),
            "only wade campaign run needs it: apt-get install openfoam, or source its etc/bashrc",
        ),
    }
}

/// Version of the Python client, where Python has it.
const PYTHON: &str = "import importlib.metadata as m; print(m.version('wade'))";

fn python() -> Check {
    let name = "Python client";
    let way_out = "only Python programs need it: pip install clients/python";
    let output = Command::new("python3").args(["-c", PYTHON]).output();
    match output {
        Ok(output) if output.status.success() => {
            let version = String::from_utf8_lossy(&output.stdout).trim().to_owned();
            match version == env!("CARGO_PKG_VERSION") {
                true => Check::ok(name, version),
                false => Check::warn(
                    name,
                    format!("{version}, and this program is {}", env!("CARGO_PKG_VERSION")),
                    "install the client of the same version",
                ),
            }
        }
        Ok(_) => Check::warn(name, "python3 has no package wade", way_out),
        Err(_) => Check::warn(name, "there is no python3", way_out),
    }
}
