//! Gathers each module's settings; read and checked once, before any port is bound.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use wade_core::physics::Physics;

use crate::service::accounts::Limits;
use crate::service::{access, grpc, health, http, shm, traces};

/// Settings of `wade serve`: the file deploy/wade.toml shows every key with its default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Folder of the vehicle bundles; empty: the first that exists of the usual ones. See [`wade_core::bundle::Library`].
    pub vehicles: PathBuf,
    /// CPUs that the server may use; empty: all.
    pub cpus: Vec<usize>,
    /// How much of the physical base answers a query that does not state it.
    pub physics: Physics,
    /// Longest time between SIGTERM and the end [s].
    pub drain_s: f64,
    /// Length of the window of `GetLatency` [s].
    pub latency_window_s: f64,
    /// Encryption of TCP.
    pub tls: access::TlsConfig,
    /// Who may do what over TCP.
    pub access: access::Config,
    /// gRPC.
    pub grpc: grpc::Config,
    /// Shared memory.
    pub shm: shm::Config,
    /// The page, queries as JSON, metrics and probes.
    pub http: http::Config,
    /// When the server calls itself ready.
    pub ready: health::Config,
    /// Traces for OpenTelemetry.
    pub traces: traces::Config,
    /// Logs.
    pub log: Log,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            vehicles: PathBuf::new(),
            cpus: Vec::new(),
            physics: Physics::Full,
            drain_s: 5.0,
            latency_window_s: 10.0,
            tls: access::TlsConfig::default(),
            access: access::Config::default(),
            grpc: grpc::Config::default(),
            shm: shm::Config::default(),
            http: http::Config::default(),
            ready: health::Config::default(),
            traces: traces::Config::default(),
            log: Log::default(),
        }
    }
}

/// Settings of the logs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Log {
    /// Filter in the syntax of `tracing_subscriber::EnvFilter`; `wade::request=debug` logs every request.
    pub filter: String,
    /// One JSON object a line instead of text.
    pub json: bool,
}

impl Default for Log {
    fn default() -> Self {
        Self { filter: "info,iceoryx2_bb_loggers=error".into(), json: false }
    }
}

/// Why a configuration was refused.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: {source}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Not TOML, or a key that does not exist or has the wrong type.
    #[error("{}: {source}", .path.display())]
    Toml {
        /// The file.
        path: PathBuf,
        /// Where and what.
        source: Box<toml::de::Error>,
    },
    /// A value out of its range.
    #[error("{key} = {value}: must be {expected}")]
    Range {
        /// The key.
        key: &'static str,
        /// The value.
        value: String,
        /// What is allowed.
        expected: &'static str,
    },
    /// An address that other machines reach, without encryption.
    #[error(
        "{key}.listen = \"{listen}\": other machines reach it and nothing is encrypted: set tls.certificate and tls.key, or \
         {key}.insecure = true (--insecure) where everybody on that network may read and ask"
    )]
    Exposed {
        /// The table.
        key: &'static str,
        /// The address.
        listen: String,
    },
    /// A setting that another one needs, or that goes against it.
    #[error("{key}: {reason}")]
    Conflict {
        /// The key.
        key: &'static str,
        /// What is wrong.
        reason: &'static str,
    },
}

impl Config {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ConfigError::Read { path: path.to_owned(), source })?;
        toml::from_str(&text)
            .map_err(|source| ConfigError::Toml { path: path.to_owned(), source: Box::new(source) })
    }

    /// Checks every value that could not work.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let range = |ok: bool, key, value: &dyn ToString, expected| {
            if ok { Ok(()) } else { Err(ConfigError::Range { key, value: value.to_string(), expected }) }
        };
        let (grpc, day) = (&self.grpc, 86_400.0);
        range((0.0..=day).contains(&self.drain_s), "drain_s", &self.drain_s, "0 to 86400")?;
        let window = self.latency_window_s;
        range((0.1..=day).contains(&window), "latency_window_s", &window, "0.1 to 86400")?;
        let ratio = self.traces.sample_ratio;
        range((0.0..=1.0).contains(&ratio), "traces.sample_ratio", &ratio, "0 to 1")?;
        range((1..=256).contains(&grpc.threads), "grpc.threads", &grpc.threads, "1 to 256")?;
        range(
            grpc.max_message_bytes >= 1024,
            "grpc.max_message_bytes",
            &grpc.max_message_bytes,
            "1024 or more",
        )?;
        range(grpc.max_batch >= 1, "grpc.max_batch", &grpc.max_batch, "1 or more")?;
        range(grpc.max_requests >= 1, "grpc.max_requests", &grpc.max_requests, "1 or more")?;
        range(grpc.max_streams >= 1, "grpc.max_streams", &grpc.max_streams, "1 or more")?;
        let streams = grpc.max_streams_per_connection;
        range(streams >= 1, "grpc.max_streams_per_connection", &streams, "1 or more")?;
        range(grpc.keepalive_s >= 1, "grpc.keepalive_s", &grpc.keepalive_s, "1 or more")?;
        let http = &self.http;
        for (key, value) in [
            ("grpc.max_connections", grpc.max_connections),
            ("grpc.max_held_bytes", grpc.max_held_bytes),
            ("http.max_connections", http.max_connections),
        ] {
            range(value >= 1, key, &value, "1 or more")?;
        }
        for (key, value) in [
            ("grpc.handshake_s", grpc.handshake_s),
            ("grpc.first_request_s", grpc.first_request_s),
            ("grpc.request_s", grpc.request_s),
            ("grpc.answer_s", grpc.answer_s),
            ("grpc.stream_idle_s", grpc.stream_idle_s),
            ("grpc.idle_s", grpc.idle_s),
            ("http.request_s", http.request_s),
            ("http.answer_s", http.answer_s),
        ] {
            range((0.1..=day).contains(&value), key, &value, "0.1 to 86400")?;
        }
        let share = grpc.peer_share;
        range(share > 0.0 && share <= 1.0, "grpc.peer_share", &share, "above 0, at most 1")?;
        let frames = grpc.control_frames_per_s;
        range((1.0..=1e6).contains(&frames), "grpc.control_frames_per_s", &frames, "1 to 1000000")?;
        let clients = self.shm.max_clients;
        range((1..=wade_wire::shm::MAX_CLIENTS).contains(&clients), "shm.max_clients", &clients, "1 to 64")?;
        let namespace = &self.shm.namespace;
        let plain = |b: u8| b.is_ascii_alphanumeric() || b == b'-' || b == b'_';
        let named = (1..=64).contains(&namespace.len()) && namespace.bytes().all(plain);
        range(named, "shm.namespace", namespace, "1 to 64 letters, digits, - or _")?;
        let can_be_ready = self.shm.enabled || !self.ready.require.contains(&health::Part::Shm);
        range(can_be_ready, "shm.enabled", &false, "true where ready.require names \"shm\"")?;
        let silent = grpc.listen.is_empty() && grpc.unix_socket.as_os_str().is_empty() && !self.shm.enabled;
        range(!silent, "shm.enabled", &false, "true where grpc.listen and grpc.unix_socket are both empty")?;
        self.validate_access()
    }

    /// Checks that nothing is open to other machines unless it was said to be.
    fn validate_access(&self) -> Result<(), ConfigError> {
        let (tls, access, is_set) = (&self.tls, &self.access, |path: &PathBuf| !path.as_os_str().is_empty());
        let conflict = |is_wrong: bool, key, reason| {
            if is_wrong { Err(ConfigError::Conflict { key, reason }) } else { Ok(()) }
        };
        conflict(tls.is_on() && !is_set(&tls.key), "tls.key", "tls.certificate is set, and has no key")?;
        conflict(
            !tls.is_on() && is_set(&tls.key),
            "tls.certificate",
            "tls.key is set, and has no certificate",
        )?;
        conflict(
            !tls.is_on() && tls.believes_clients(),
            "tls.certificate",
            "tls.client_ca is set, and clients show certificates over TLS alone",
        )?;
        conflict(
            !access.certificates.is_empty() && !tls.believes_clients(),
            "tls.client_ca",
            "access.certificates names certificates, and no authority is believed",
        )?;
        conflict(
            tls.believes_clients() && access.certificates.is_empty() && !is_set(&access.tokens),
            "access.certificates",
            "tls.client_ca is set, and no certificate is given a role: such as { \"*\" = [\"query\"] }",
        )?;
        conflict(
            self.grpc.admin_over_tcp && (tls.believes_clients() || is_set(&access.tokens)),
            "grpc.admin_over_tcp",
            "lets everybody administer although callers show who they are: give the role administer instead",
        )?;
        for (key, listen, insecure) in
            [("grpc", &self.grpc.listen, self.grpc.insecure), ("http", &self.http.listen, self.http.insecure)]
        {
            // what is no address is refused where it is bound
            let address = listen.parse::<std::net::SocketAddr>().ok();
            let is_open = address.is_some_and(|address| !address.ip().to_canonical().is_loopback());
            if is_open && !insecure && !tls.is_on() {
                return Err(ConfigError::Exposed { key, listen: listen.clone() });
            }
        }
        Ok(())
    }

    /// The most that connections may make the server hold.
    pub fn limits(&self) -> Limits {
        Limits {
            connections: self.grpc.max_connections,
            http_connections: self.http.max_connections,
            requests: self.grpc.max_requests,
            streams: self.grpc.max_streams,
            bytes: self.grpc.max_held_bytes,
            peer_share: self.grpc.peer_share,
        }
    }

    /// The folder of bundles, where one is named.
    pub fn named_vehicles(&self) -> Option<&Path> {
        Some(self.vehicles.as_path()).filter(|folder| !folder.as_os_str().is_empty())
    }
}
