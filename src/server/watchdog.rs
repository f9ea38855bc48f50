//! The server asks itself over gRPC and HTTP, as a client does, and says what answers: in /readyz, in gRPC's health and to
//! the service manager. Shared memory has a client of its own beside its server, in the process that serves it.

use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use hyper_util::rt::TokioIo;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::watch;
use tonic::codegen::http::Uri;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Status};

use crate::service::access::Acceptor;
use crate::service::health::{Health, Part, State};
use crate::service::{grpc, stopped};
use wade_wire::proto::inference::ServerLiveRequest;
use wade_wire::proto::inference::grpc_inference_service_client::GrpcInferenceServiceClient;

/// How often the server is asked, and how long an answer may take.
const ASK: Duration = Duration::from_secs(1);
const PATIENCE: Duration = Duration::from_secs(3);

/// Questions without an answer, one after the other, after which a transport is called unavailable.
const UNANSWERED: u32 = 2;

/// What is asked.
pub(super) struct Watchdog {
    pub health: Arc<Health>,
    pub grpc: Arc<grpc::Server>,
    pub tcp: Option<SocketAddr>,
    pub unix: Option<PathBuf>,
    pub http: Option<SocketAddr>,
    pub grpc_acceptor: Acceptor,
    pub http_acceptor: Acceptor,
}

impl Watchdog {
    /// Asks until `stop` turns true.
    pub(super) async fn run(self, stop: watch::Receiver<bool>) {
        tokio::select! {
            () = self.ask_for_ever() => {}
            () = stopped(stop) => {}
        }
    }

    async fn ask_for_ever(&self) {
        let tcp = self.tcp.map(|address| format!("http://{}", reachable(address)));
        let unix = self.unix.as_ref().map(|path| format!("unix:{}", path.display()));
        let mut grpc: Vec<Asked<Channel>> = [tcp, unix].into_iter().flatten().map(Asked::new).collect();
        let mut http = self.http.map(|address| Asked::<()>::new(reachable(address).to_string()));
        let mut changes = self.health.changes();
        let mut ticks = tokio::time::interval(ASK);
        ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                _ = ticks.tick() => {
                    for asked in &mut grpc {
                        let answer = ask_grpc(asked, &self.grpc_acceptor).await;
                        asked.note(answer);
                    }
                    if let Some(asked) = &mut http {
                        let answer = ask_http(&asked.at, &self.http_acceptor).await;
                        asked.note(answer);
                    }
                    self.say(Part::Grpc, &grpc);
                    self.say(Part::Http, http.as_slice());
                    self.feed();
                }
                _ = changes.changed() => {}
            }
            self.grpc.set_health(&self.health).await;
        }
    }

    /// Reports a transport that has addresses: the first that does not answer decides.
    fn say<C>(&self, part: Part, asked: &[Asked<C>]) {
        if asked.is_empty() {
            return;
        }
        let down = asked.iter().find(|asked| asked.unanswered >= UNANSWERED);
        self.health.set(part, down.map_or(State::Ok, |asked| State::Unavailable(asked.reason.clone())));
    }

    /// Keeps the service manager from restarting the server, where what a restart would mend answers. Shared memory has a
    /// process of its own that is restarted from here.
    fn feed(&self) {
        if sd_notify::watchdog_enabled().is_none() {
            return;
        }
        let answers = |part| matches!(self.health.state(part), State::Ok | State::Off);
        if answers(Part::Grpc)
            && answers(Part::Http)
            && let Err(error) = sd_notify::notify(&[sd_notify::NotifyState::Watchdog])
        {
            tracing::warn!(%error, "systemd was not notified");
        }
    }
}

/// An address and what came of asking it.
struct Asked<C> {
    at: String,
    connection: Option<C>,
    unanswered: u32,
    reason: String,
}

impl<C> Asked<C> {
    fn new(at: String) -> Self {
        Self { at, connection: None, unanswered: 0, reason: String::new() }
    }

    fn note(&mut self, answer: Result<(), String>) {
        match answer {
            Ok(()) => self.unanswered = 0,
            Err(reason) => {
                self.connection = None;
                self.unanswered += 1;
                self.reason = format!("{} does not answer: {reason}", self.at);
            }
        }
    }
}

/// An address at which a server that listens on it can be reached from here.
fn reachable(mut address: SocketAddr) -> SocketAddr {
    if address.ip().is_unspecified() {
        let loopback =
            if address.is_ipv4() { Ipv4Addr::LOCALHOST.into() } else { Ipv6Addr::LOCALHOST.into() };
        address.set_ip(loopback);
    }
    address
}

async fn within<T>(work: impl Future<Output = Result<T, String>>) -> Result<T, String> {
    let late = || Err(format!("no answer within {} s", PATIENCE.as_secs()));
    tokio::time::timeout(PATIENCE, work).await.unwrap_or_else(|_| late())
}

async fn ask_grpc(asked: &mut Asked<Channel>, acceptor: &Acceptor) -> Result<(), String> {
    let channel = match asked.connection.take() {
        Some(channel) => channel,
        None => within(connect(&asked.at, acceptor)).await?,
    };
    // one that takes no role
    let mut client = GrpcInferenceServiceClient::new(channel.clone());
    let answer = within(async { Ok(client.server_live(ServerLiveRequest {}).await) }).await?;
    match answer {
        Err(status) if !is_answer(&status) => Err(status.to_string()),
        // a refusal, for one where too much is in flight, is an answer of a server that lives
        _ => {
            asked.connection = Some(channel);
            Ok(())
        }
    }
}

async fn connect(at: &str, acceptor: &Acceptor) -> Result<Channel, String> {
    let endpoint = Endpoint::from_shared(at.to_owned()).map_err(|error| error.to_string())?;
    let connected = match at.strip_prefix("http://").filter(|_| acceptor.is_encrypted()) {
        None => endpoint.connect().await,
        Some(address) => {
            // gRPC sees the bytes inside: the acceptor makes the connection
            let (acceptor, address) = (acceptor.clone(), address.to_owned());
            let connector = tower::service_fn(move |_: Uri| {
                let (acceptor, address) = (acceptor.clone(), address.clone());
                async move {
                    let socket = acceptor.connect(TcpStream::connect(address).await?).await?;
                    Ok::<_, std::io::Error>(TokioIo::new(socket))
                }
            });
            endpoint.connect_with_connector(connector).await
        }
    };
    connected.map_err(|error| error.to_string())
}

fn is_answer(status: &Status) -> bool {
    !matches!(status.code(), Code::Unavailable | Code::Unknown | Code::Internal | Code::Cancelled)
}

async fn ask_http(at: &str, acceptor: &Acceptor) -> Result<(), String> {
    let exchange = async {
        let mut stream = acceptor.connect(TcpStream::connect(at).await?).await?;
        stream.write_all(b"GET /livez HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").await?;
        let mut line = [0; 12];
        stream.read_exact(&mut line).await?;
        Ok(line)
    };
    let line = within(async { exchange.await.map_err(|error: std::io::Error| error.to_string()) }).await?;
    if line.ends_with(b" 200") { Ok(()) } else { Err(String::from_utf8_lossy(&line).into_owned()) }
}
