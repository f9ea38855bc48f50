//! The server that a soak starts for itself.

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};

use anyhow::{Context, Result, bail};
use tempfile::TempDir;
use wade::service::{grpc, shm};
use wade_client::Address;
use wade_wire::shm::Wait;

use super::Vehicles;
use super::soak::Transport;

/// A server of the soak's own, ended with it.
pub struct Server {
    child: Child,
    address: Address,
    _folder: TempDir,
}

/// What a soak wants of its server.
pub struct Wanted<'a> {
    /// How it is asked.
    pub transport: Transport,
    /// The bundles.
    pub vehicles: &'a Vehicles,
    /// The CPU on which it runs, where that is fixed.
    pub cpu: Option<usize>,
    /// States in a request.
    pub batch: usize,
    /// Clients that ask at the same time.
    pub clients: usize,
}

impl Server {
    /// Starts it; it answers a moment later.
    pub fn start(wanted: &Wanted<'_>) -> Result<Self> {
        let folder = TempDir::new()?;
        let socket = folder.path().join("wade.sock");
        let namespace = format!("soak-{}", std::process::id());
        let mut config = wade::config::Config {
            vehicles: wanted.vehicles.named().map(Path::to_owned).unwrap_or_default(),
            ..Default::default()
        };
        config.cpus.extend(wanted.cpu);
        config.http.listen = String::new();
        config.log.filter = "warn,iceoryx2_bb_loggers=error".into();
        config.grpc = grpc::Config { listen: String::new(), unix_socket: PathBuf::new(), ..config.grpc };
        config.grpc.max_batch = config.grpc.max_batch.max(wanted.batch);
        config.grpc.max_requests = config.grpc.max_requests.max(wanted.clients);
        config.grpc.max_streams = config.grpc.max_streams.max(wanted.clients);
        config.shm = shm::Config { enabled: false, namespace: namespace.clone(), ..config.shm };
        config.shm.max_clients = config.shm.max_clients.max(wanted.clients);
        let address = match wanted.transport {
            Transport::Inproc => bail!("no server is needed in process"),
            Transport::Grpc | Transport::GrpcStream => {
                config.grpc.listen = free_port()?;
                Address::Tcp(config.grpc.listen.clone())
            }
            Transport::Uds | Transport::UdsStream => {
                config.grpc.unix_socket = socket.clone();
                Address::Unix(socket)
            }
            Transport::ShmSpin | Transport::ShmBlock => {
                config.shm.enabled = true;
                config.shm.wait =
                    if wanted.transport == Transport::ShmSpin { Wait::Spin } else { Wait::Block };
                Address::Shm(namespace)
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
        // Ctrl-C is for the soak, which ends its server once it has written its report
        command.process_group(0);
        // what the caller's environment says is for the caller's server
        command.env_remove("WADE_VEHICLES").env_remove("WADE_LOG").env_remove("WADE_PHYSICS");
        let child = command.spawn().context("starting the server")?;
        Ok(Self { child, address, _folder: folder })
    }

    /// Where it answers.
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// How it ended, where it has.
    pub fn ended(&mut self) -> Result<Option<ExitStatus>> {
        Ok(self.child.try_wait()?)
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
