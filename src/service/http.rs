//! HTTP: a page to look at, queries as JSON, metrics and probes. It has one thread of its own, so that whatever is asked
//! here takes no time of the threads that answer gRPC and shared memory.

mod connections;
mod guard;
mod hull;
mod json;
mod page;
mod query;
mod rejection;

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;

use axum::Router;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use axum::routing::get;
use serde::{Deserialize, Serialize};
use tokio::sync::watch;

use super::health::Health;
use super::{grpc, occupant};
use crate::engine::Admission;
use rejection::Rejection;

/// Settings of the HTTP server.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// TCP address; an empty string turns HTTP off.
    pub listen: String,
    /// Names of this machine under which the page and queries are served, beside localhost and plain addresses.
    pub hosts: Vec<String>,
}

impl Default for Config {
    fn default() -> Self {
        Self { listen: "127.0.0.1:9464".into(), hosts: Vec::new() }
    }
}

/// Why HTTP could not start.
#[derive(Debug, thiserror::Error)]
pub enum HttpError {
    /// The address is none.
    #[error("http.listen: \"{listen}\" is not an address such as 127.0.0.1:9464")]
    Address {
        /// What was configured.
        listen: String,
    },
    /// The port could not be had.
    #[error("cannot listen on {listen} for HTTP: {reason}")]
    Bind {
        /// The address.
        listen: String,
        /// Who is in the way and the way out, or the system's reason.
        reason: String,
    },
}

/// Binds the port; none where HTTP is off.
pub fn bind(config: &Config) -> Result<Option<TcpListener>, HttpError> {
    if config.listen.is_empty() {
        return Ok(None);
    }
    let listen = config.listen.clone();
    let address: SocketAddr =
        config.listen.parse().map_err(|_| HttpError::Address { listen: listen.clone() })?;
    let bind = || {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        Ok(listener)
    };
    bind().map(Some).map_err(|source| {
        let way_out = "--http (http.listen)";
        let reason = occupant::in_the_way(&source, occupant::of_tcp(address), way_out);
        HttpError::Bind { listen, reason }
    })
}

/// What the handlers share.
#[derive(Debug)]
pub struct Shared {
    /// Names by which the page may be called.
    pub hosts: Vec<String>,
    /// What gRPC's handlers share: the models, the metrics.
    pub grpc: grpc::Shared,
    /// The places that gRPC's requests take.
    pub requests: Arc<Admission>,
    /// Which transports answer.
    pub health: Arc<Health>,
}

/// Serves until `stop` turns true.
pub async fn run(listener: TcpListener, shared: Shared, stop: watch::Receiver<bool>) -> std::io::Result<()> {
    let listener = tokio::net::TcpListener::from_std(listener)?;
    connections::serve(listener, router(Arc::new(shared)), stop).await;
    Ok(())
}

fn router(shared: Arc<Shared>) -> Router {
    let guarded = |routes: Router<Arc<Shared>>| {
        routes.layer(axum::middleware::from_fn_with_state(Arc::clone(&shared), guard::check))
    };
    let browsed = guarded(page::routes().merge(query::routes()).merge(hull::routes()));
    Router::new()
        .route("/metrics", get(metrics))
        .route("/livez", get(|| std::future::ready("live\n")))
        .route("/readyz", get(readyz))
        .merge(browsed)
        .fallback(|| std::future::ready(Rejection::NoSuchPath))
        .with_state(shared)
}

async fn metrics(State(shared): State<Arc<Shared>>) -> impl IntoResponse {
    let content_type = "application/openmetrics-text; version=1.0.0; charset=utf-8";
    ([(header::CONTENT_TYPE, content_type)], shared.grpc.metrics.render())
}

async fn readyz(State(shared): State<Arc<Shared>>) -> impl IntoResponse {
    let report = shared.health.report();
    let status = if report.ready { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    // strings and a truth value alone: serialising cannot fail
    let body = serde_json::to_string(&report).unwrap_or_default() + "\n";
    (status, [(header::CONTENT_TYPE, "application/json")], body)
}
