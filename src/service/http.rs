//! HTTP: a page to look at, queries as JSON, metrics and probes. It has two threads of its own, one for probes and one for
//! all else, so that whatever is asked here takes no time of the threads that answer gRPC and shared memory.

mod connections;
mod guard;
mod hull;
mod json;
mod page;
mod query;
mod rejection;
mod streams;
mod versions;

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;

use axum::Router;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::IntoResponse;
use axum::routing::get;
use serde::{Deserialize, Serialize};
use tokio::runtime::Handle;
use tokio::sync::watch;

use super::access::Acceptor;
use super::accounts::Accounts;
use super::health::Health;
use super::intake::{Listener, listen_on_tcp};
use super::{call, occupant};
use connections::Routes;
use rejection::Rejection;

/// Settings of the HTTP server.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// TCP address; an empty string turns HTTP off.
    pub listen: String,
    /// Whether it is served without TLS, on whatever address and although there is a certificate.
    pub insecure: bool,
    /// Names of this machine under which the page and queries are served, beside localhost and plain addresses.
    pub hosts: Vec<String>,
    /// Most connections at a time.
    pub max_connections: usize,
    /// Longest time for the head of a request to arrive, and for its body [s].
    pub request_s: f64,
    /// Longest time for a client to take any of an answer [s].
    pub answer_s: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            listen: "127.0.0.1:9464".into(),
            insecure: false,
            hosts: Vec::new(),
            max_connections: 256,
            request_s: 5.0,
            answer_s: 10.0,
        }
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
    listen_on_tcp(address).map(Some).map_err(|source| {
        let way_out = "--http (http.listen)";
        let reason = occupant::in_the_way(&source, occupant::of_tcp(address), way_out);
        HttpError::Bind { listen, reason }
    })
}

/// What the handlers share.
#[derive(Debug)]
pub struct Shared {
    /// The settings.
    pub config: Config,
    /// What gRPC's handlers share: the models, the metrics.
    pub grpc: call::Shared,
    /// The account of everything that is held.
    pub accounts: Arc<Accounts>,
    /// Which transports answer.
    pub health: Arc<Health>,
    /// Who may do what.
    pub acceptor: Acceptor,
}

/// Serves until `stop` turns true: probes on this thread, everything else on that of `work`, so that no query and no hull
/// stands before a probe.
pub async fn run(
    listener: TcpListener,
    shared: Shared,
    work: Handle,
    stop: watch::Receiver<bool>,
) -> std::io::Result<()> {
    let listener = Listener::Tcp(tokio::net::TcpListener::from_std(listener)?);
    let shared = Arc::new(shared);
    let probes = probes().with_state(Arc::clone(&shared));
    let routes = Routes { probes, browsed: browsed(Arc::clone(&shared)), work };
    connections::serve(listener, routes, &shared, stop).await;
    Ok(())
}

fn probes() -> Router<Arc<Shared>> {
    Router::new()
        .route("/metrics", get(metrics))
        .route("/livez", get(|| std::future::ready("live\n")))
        .route("/readyz", get(readyz))
}

fn browsed(shared: Arc<Shared>) -> Router {
    let guard = axum::middleware::from_fn_with_state(Arc::clone(&shared), guard::check);
    let queries = query::routes().merge(streams::routes()).merge(versions::routes());
    let routes = page::routes().merge(queries).merge(hull::routes()).layer(guard);
    routes.fallback(|| std::future::ready(Rejection::NoSuchPath)).with_state(shared)
}

/// Prometheus asks for OpenMetrics and takes it; what asks for nothing, such as curl or an older agent, gets the text format
/// that everything reads.
async fn metrics(State(shared): State<Arc<Shared>>, headers: HeaderMap) -> impl IntoResponse {
    let accepts = headers.get_all(header::ACCEPT).iter().filter_map(|value| value.to_str().ok());
    let open = accepts.flat_map(|value| value.split(',')).any(is_open_metrics);
    let metrics = &shared.grpc.metrics;
    let (content_type, text) = if open {
        ("application/openmetrics-text; version=1.0.0; charset=utf-8", metrics.render())
    } else {
        ("text/plain; version=0.0.4; charset=utf-8", metrics.render_plain())
    };
    ([(header::CONTENT_TYPE, content_type)], text)
}

/// Whether one of the types that a client accepts is OpenMetrics, and not by a weight of zero.
fn is_open_metrics(accepted: &str) -> bool {
    let mut parts = accepted.split(';').map(str::trim);
    let named = parts.next().is_some_and(|name| name.eq_ignore_ascii_case("application/openmetrics-text"));
    let refused = |weight: &str| weight.parse() == Ok(0.0_f32);
    named && !parts.any(|part| part.strip_prefix("q=").is_some_and(refused))
}

async fn readyz(State(shared): State<Arc<Shared>>) -> impl IntoResponse {
    let report = shared.health.report();
    let status = if report.ready { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    // strings and a truth value alone: serialising cannot fail
    let body = serde_json::to_string(&report).unwrap_or_default() + "\n";
    (status, [(header::CONTENT_TYPE, "application/json")], body)
}
