//! The logs of `wade serve`.

use std::io::IsTerminal;
use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::prelude::*;
use wade::config::{Config, Log};
use wade::server::Running;
use wade::service::health::{Part, State};
use wade_core::bundle::Library;
use wade_wire::shm::Wait;

use super::log_limit::Limit;

/// Logs to standard error, with colors only on a terminal and only where NO_COLOR is unset or empty (no-color.org).
pub fn start(log: &Log) -> Result<()> {
    let filter =
        EnvFilter::try_new(&log.filter).with_context(|| format!("log.filter = \"{}\"", log.filter))?;
    let no_color = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    let colors = std::io::stderr().is_terminal() && !no_color;
    let limit = Limit::default();
    let logs = tracing_subscriber::registry().with(filter).with(limit.clone());
    let lines = tracing_subscriber::fmt::layer().with_writer(std::io::stderr);
    if log.json {
        logs.with(lines.json()).init()
    } else {
        // the module would make lines long, and only who writes a filter needs it: JSON has it
        logs.with(lines.with_ansi(colors).with_target(false)).init()
    }
    limit.report().context("the thread of the logs")
}

/// Says which program starts, and with which settings.
pub fn starting(config: &Config, file: Option<&Path>) {
    tracing::info!(version = env!("CARGO_PKG_VERSION"), commit = env!("WADE_COMMIT"), "wade starts");
    match file {
        Some(file) => tracing::info!(file = %absolute(file), "settings"),
        None => tracing::info!("settings: the defaults, no --config"),
    }
    // what cannot be opened is an error in a moment
    if let Ok(library) = Library::open(config.named_vehicles()) {
        tracing::info!(from = library.origin(), physics = config.physics.name(), "vehicles");
    }
}

/// Says where the server can be reached, and after how long.
pub fn ready(config: &Config, running: &Running, elapsed: Duration) {
    let [grpc, http] = running.is_encrypted();
    let scheme = |encrypted| if encrypted { "https" } else { "http" };
    if let Some(address) = running.grpc_address() {
        let form = if grpc { format!("https://{address}") } else { address.to_string() };
        tracing::info!(address = form, "gRPC");
        warn_if_open("gRPC", address, grpc);
        if config.grpc.admin_over_tcp && !address.ip().to_canonical().is_loopback() {
            tracing::warn!(
                "gRPC at {address}: whoever reaches it may load and unload vehicles (grpc.admin_over_tcp)"
            );
        }
    }
    if let Some(path) = running.unix_path() {
        tracing::info!(address = %format!("unix:{}", path.display()), "gRPC");
    }
    match running.health().state(Part::Shm) {
        State::Off => tracing::info!("shared memory: off"),
        state => tracing::info!(
            address = %format!("shm:{}", config.shm.namespace),
            wait = if config.shm.wait == Wait::Spin { "spin" } else { "block" },
            "shared memory: {state}"
        ),
    }
    if let Some(address) = running.http_address() {
        tracing::info!("page at {}://{address}/", scheme(http));
        warn_if_open("HTTP", address, http);
    }
    tracing::info!("serving, ready in {} ms", elapsed.as_millis());
}

/// Says that other machines reach an address without encryption.
fn warn_if_open(what: &str, address: SocketAddr, encrypted: bool) {
    if !encrypted && !address.ip().to_canonical().is_loopback() {
        tracing::warn!("{what} at {address} is not encrypted: whoever is on that network may read and ask");
    }
}

/// A path as whoever reads the log elsewhere needs it.
fn absolute(path: &Path) -> impl std::fmt::Display {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string()
}
