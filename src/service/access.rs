//! Who may do what over TCP: a peer is known by its certificate or by a token, and has the roles that the operator gave to that
//! name. Programs of the server's own user, on the Unix socket and in shared memory, have every role.

mod names;
mod tls;
mod tokens;

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use arc_swap::ArcSwap;
use base64::Engine as _;
use serde::{Deserialize, Serialize};
use tokio::net::TcpStream;
use tokio::runtime::Handle;
use tokio::sync::watch;
use tonic::codegen::http::{HeaderMap, header};

pub use tls::{Config as TlsConfig, Protocol};
pub use tokens::{Token, TokenFileError};

use super::accounts::{Closed, Connection};
use super::bulk::Owned;
use super::intake::Socket;
use super::{grpc, stopped};
use crate::metrics::Metrics;
use tls::Keys;
use tokens::Tokens;
use wade_wire::Refusal;

/// How often the files are looked at for a change.
const LOOK: Duration = Duration::from_secs(2);
/// Largest file of certificates, a key or tokens [bytes].
const LARGEST_FILE: u64 = 1 << 20;
/// Most bytes of answers that are encrypted before the system takes them: one record.
const ENCRYPTED_AHEAD: usize = 16 << 10;
/// The name in [`Config::certificates`] that stands for every certificate of the authority.
const ANY_CERTIFICATE: &str = "*";

/// What a caller may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Ask for forces, stability, vehicles and hulls.
    Query,
    /// Read metrics, latencies, the streams of others and the descriptions of the services.
    Observe,
    /// Load, reload, unload and roll back vehicles.
    Administer,
}

impl Role {
    /// Its name in settings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Query => "query",
            Self::Observe => "observe",
            Self::Administer => "administer",
        }
    }
}

impl FromStr for Role {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let roles = [Self::Query, Self::Observe, Self::Administer];
        let role = roles.into_iter().find(|role| role.name() == name);
        role.ok_or_else(|| "a role is query, observe or administer".to_owned())
    }
}

/// Settings of the roles.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// File of tokens, as `wade token` writes it; an empty path: none.
    pub tokens: PathBuf,
    /// Roles by a name in a client's certificate; `*` stands for every certificate of the authority.
    pub certificates: BTreeMap<String, Vec<Role>>,
}

/// A file of certificates, a key or tokens that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{key}: {}: {reason}", .path.display())]
pub struct FileError {
    /// The setting that names it.
    pub key: &'static str,
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub reason: String,
}

/// Reads a file that a setting names.
fn read(key: &'static str, path: &Path) -> Result<Vec<u8>, FileError> {
    let error = |reason: String| FileError { key, path: path.to_owned(), reason };
    let metadata = std::fs::metadata(path).map_err(|source| error(source.to_string()))?;
    if !metadata.is_file() || metadata.len() > LARGEST_FILE {
        return Err(error(format!("must be a file of at most {LARGEST_FILE} bytes")));
    }
    std::fs::read(path).map_err(|source| error(source.to_string()))
}

/// Who is at the other end of a connection.
#[derive(Debug, Clone)]
pub enum Who {
    /// The user that runs the server, on the Unix socket.
    Owner,
    /// Somebody on the network, with the names in the certificate that was shown; none where none was.
    Network(Arc<[String]>),
}

/// Who makes a call, for the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Caller {
    /// The user that runs the server.
    Owner,
    /// Anybody who reaches the port.
    Anybody,
    /// The holder of a token, by its name.
    Token(String),
    /// The holder of a certificate, by the names in it.
    Certificate(String),
}

impl fmt::Display for Caller {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Owner => f.write_str("the user of the server"),
            Self::Anybody => f.write_str("anybody"),
            Self::Token(name) => write!(f, "token \"{name}\""),
            Self::Certificate(names) => write!(f, "certificate \"{names}\""),
        }
    }
}

/// The settings in force, and the files that they name as they were last read.
#[derive(Debug)]
pub struct Access {
    /// The files as they were before they were first read.
    first_read: [Option<Stamp>; 4],
    tls_config: TlsConfig,
    config: Config,
    keys: Option<ArcSwap<Keys>>,
    tokens: ArcSwap<Tokens>,
    /// Whether anybody on the network may administer, where nobody has to show who they are.
    anybody_administers: bool,
    /// The way out for an administrator who asks where none is answered.
    way_to_administer: String,
    metrics: Arc<Metrics>,
}

impl Access {
    /// Reads every file.
    pub fn new(
        tls: &TlsConfig,
        config: &Config,
        grpc: &grpc::Config,
        metrics: Arc<Metrics>,
    ) -> Result<Self, FileError> {
        let first_read = stamps(tls, config);
        let keys = tls.is_on().then(|| Keys::read(tls)).transpose()?;
        let tokens = ArcSwap::from_pointee(Tokens::read(&config.tokens)?);
        if let Some(keys) = &keys {
            note(keys, &tls.certificate, &metrics);
        }
        let keys = keys.map(ArcSwap::from_pointee);
        let path = &grpc.unix_socket;
        let socket = if path.as_os_str().is_empty() {
            "set grpc.unix_socket".to_owned()
        } else {
            format!("ask unix:{}", path.display())
        };
        Ok(Self {
            first_read,
            tls_config: tls.clone(),
            config: config.clone(),
            keys,
            tokens,
            anybody_administers: grpc.admin_over_tcp,
            way_to_administer: format!(
                "{socket}, give the role administer to a token (access.tokens), or set grpc.admin_over_tcp = true where \
                 everybody may ask"
            ),
            metrics,
        })
    }

    /// Whether a caller has to show who it is.
    fn is_guarded(&self) -> bool {
        self.tls_config.believes_clients() || !self.config.tokens.as_os_str().is_empty()
    }

    /// Whether anything is read of files.
    pub fn has_files(&self) -> bool {
        self.keys.is_some() || self.is_guarded()
    }

    /// Reads the files again; what cannot be used leaves what was read before in force.
    pub fn reload(&self) {
        let keys = self.keys.as_ref().map(|in_force| (in_force, Keys::read(&self.tls_config)));
        match keys {
            Some((in_force, Ok(keys))) => {
                note(&keys, &self.tls_config.certificate, &self.metrics);
                in_force.store(Arc::new(keys));
                tracing::info!("certificates read again");
            }
            Some((_, Err(error))) => tracing::warn!(%error, "the certificates before stay in force"),
            None => {}
        }
        match Tokens::read(&self.config.tokens) {
            Ok(tokens) => self.tokens.store(Arc::new(tokens)),
            Err(error) => tracing::warn!(%error, "the tokens before stay in force"),
        }
    }

    /// Reads the files again whenever one of them has changed, until `stop` turns true.
    pub async fn follow_files(&self, stop: watch::Receiver<bool>) {
        let files = || stamps(&self.tls_config, &self.config);
        let mut before = self.first_read;
        let mut ticks = tokio::time::interval(LOOK);
        let following = async {
            loop {
                ticks.tick().await;
                let now = files();
                if now != before {
                    before = now;
                    self.reload();
                }
            }
        };
        tokio::select! {
            () = following => {}
            () = stopped(stop) => {}
        }
    }

    /// The caller, where it has the role.
    pub fn check(&self, who: &Who, headers: &HeaderMap, role: Role) -> Result<Caller, Refusal> {
        let Who::Network(names) = who else { return Ok(Caller::Owner) };
        if !self.is_guarded() {
            return if role != Role::Administer || self.anybody_administers {
                Ok(Caller::Anybody)
            } else {
                Err(Refusal::NoAdministration { reason: self.way_to_administer.clone() })
            };
        }
        let unknown = |reason: &str| Refusal::Unauthenticated { role: role.name(), reason: reason.into() };
        let (caller, roles) = if let Some(header) = headers.get(header::AUTHORIZATION) {
            let shown = header.to_str().ok().and_then(token_in);
            let shown =
                shown.ok_or_else(|| unknown("authorization is neither Bearer nor Basic with a token"))?;
            let tokens = self.tokens.load();
            let token = tokens.find(&shown).ok_or_else(|| unknown("the token is not known"))?;
            (Caller::Token(token.name.clone()), token.roles.clone())
        } else if names.is_empty() {
            return Err(unknown("show a token or a client certificate"));
        } else {
            let of = |name: &str| self.config.certificates.get(name).into_iter().flatten().copied();
            let roles = names.iter().flat_map(|name| of(name)).chain(of(ANY_CERTIFICATE)).collect();
            (Caller::Certificate(names.join(", ")), roles)
        };
        if roles.contains(&role) {
            Ok(caller)
        } else {
            Err(Refusal::MissingRole { caller: caller.to_string(), role: role.name() })
        }
    }
}

/// Says in the metrics until when the certificate holds.
fn note(keys: &Keys, certificate: &Path, metrics: &Metrics) {
    let ends = keys.not_after.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    metrics.set_certificate_end(certificate, ends);
    if keys.not_after < SystemTime::now() {
        tracing::warn!("tls.certificate has expired: clients will refuse it");
    }
}

/// What changes when a file is replaced, or who may read it: its device, number, and time of change.
type Stamp = (u64, u64, i64, i64);

fn stamp(path: &Path) -> Option<Stamp> {
    use std::os::unix::fs::MetadataExt;
    let file = std::fs::metadata(path).ok()?;
    Some((file.dev(), file.ino(), file.ctime(), file.ctime_nsec()))
}

fn stamps(tls: &TlsConfig, config: &Config) -> [Option<Stamp>; 4] {
    [&tls.certificate, &tls.key, &tls.client_ca, &config.tokens].map(|path| stamp(path))
}

/// The token in an authorization header: of the scheme Bearer, or the password of Basic, which is what a browser asks for.
fn token_in(header: &str) -> Option<String> {
    let (scheme, value) = header.split_once(' ')?;
    let value = value.trim();
    if scheme.eq_ignore_ascii_case("bearer") {
        return Some(value.to_owned());
    }
    if !scheme.eq_ignore_ascii_case("basic") {
        return None;
    }
    let decoded = base64::engine::general_purpose::STANDARD.decode(value).ok()?;
    Some(String::from_utf8(decoded).ok()?.split_once(':')?.1.to_owned())
}

/// How one listener lets peers in.
#[derive(Debug, Clone)]
pub struct Acceptor {
    access: Arc<Access>,
    protocol: Protocol,
    /// Where handshakes are computed, away from the threads that answer; none where the listener speaks without TLS.
    handshakes: Option<Handle>,
}

impl Acceptor {
    /// That of a listener: encrypted where there are keys and it is not said to be insecure.
    pub fn new(access: &Arc<Access>, protocol: Protocol, insecure: bool, handshakes: &Handle) -> Self {
        let encrypted = access.keys.is_some() && !insecure;
        Self { access: Arc::clone(access), protocol, handshakes: encrypted.then(|| handshakes.clone()) }
    }

    /// Who may do what.
    pub fn access(&self) -> &Access {
        &self.access
    }

    /// Whether it speaks TLS.
    pub fn is_encrypted(&self) -> bool {
        self.handshakes.is_some()
    }

    /// Shakes hands with a peer where the listener speaks TLS. Whoever waits for it bounds the wait.
    pub async fn welcome(&self, socket: Socket) -> std::io::Result<(Socket, Who)> {
        let nobody = || Who::Network(Arc::from([]));
        match (socket, &self.handshakes, &self.access.keys) {
            (Socket::Tcp(stream), Some(handshakes), Some(keys)) => {
                let accepting = keys.load().accept(self.protocol, stream);
                // dropped with the wait, the handshake ends too
                let mut task = Owned(handshakes.spawn(accepting));
                let mut stream = (&mut task.0).await.map_err(std::io::Error::other)??;
                stream.get_mut().1.set_buffer_limit(Some(ENCRYPTED_AHEAD));
                let leaf = stream.get_ref().1.peer_certificates().and_then(<[_]>::first);
                let names = leaf.map(|leaf| names::names_in(leaf)).unwrap_or_default();
                Ok((Socket::Tls(Box::new(stream.into())), Who::Network(names.into())))
            }
            (socket @ Socket::Unix(_), ..) => Ok((socket, Who::Owner)),
            (socket, ..) => Ok((socket, nobody())),
        }
    }

    /// The same within this time, unless the connection is to be closed or the server ends; none where it is over.
    pub async fn let_in(
        &self,
        socket: Socket,
        connection: &Connection,
        within: Duration,
        stop: watch::Receiver<bool>,
    ) -> Option<(Socket, Who)> {
        let welcome = tokio::time::timeout(within, self.welcome(socket));
        let welcomed = tokio::select! {
            // without TLS it is there at once, whether or not the server ends
            biased;
            welcomed = welcome => welcomed,
            _ = connection.closing() => return None,
            () = stopped(stop) => return None,
        };
        match welcomed {
            Ok(Ok(welcomed)) => Some(welcomed),
            Ok(Err(error)) => {
                tracing::info!(peer = %connection.peer(), %error, "a TLS handshake failed");
                connection.close(Closed::no_tls);
                None
            }
            Err(_) => {
                connection.close(Closed::no_handshake);
                None
            }
        }
    }

    /// The client's end of a connection to this listener, which believes the certificate in force alone.
    pub async fn connect(&self, stream: TcpStream) -> std::io::Result<Socket> {
        match (&self.handshakes, &self.access.keys) {
            (Some(_), Some(keys)) => {
                let connecting = keys.load().connect(self.protocol, stream);
                Ok(Socket::Tls(Box::new(connecting.await?.into())))
            }
            _ => Ok(Socket::Tcp(stream)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_read_of_bearer_and_of_the_password_of_basic() {
        assert_eq!(token_in("Bearer abc").as_deref(), Some("abc"));
        assert_eq!(token_in("bearer  abc ").as_deref(), Some("abc"));
        // user:abc
        assert_eq!(token_in("Basic dXNlcjphYmM=").as_deref(), Some("abc"));
        for bad in ["", "abc", "Digest abc", "Basic !", "Basic dXNlcg=="] {
            assert_eq!(token_in(bad), None, "{bad}");
        }
    }
}
