//! Metrics and probes over HTTP.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use axum::Router;
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use axum::routing::get;
use serde::{Deserialize, Serialize};
use tokio::sync::watch;

use crate::metrics::Metrics;

/// Settings of the HTTP server.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// TCP address; an empty string turns HTTP off.
    pub listen: String,
}

impl Default for Config {
    fn default() -> Self {
        Self { listen: "127.0.0.1:9464".into() }
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
    #[error("cannot listen on {listen} for HTTP: {source}")]
    Bind {
        /// The address.
        listen: String,
        /// The system's reason.
        source: std::io::Error,
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
    bind().map(Some).map_err(|source| HttpError::Bind { listen, source })
}

/// Serves `/metrics`, `/livez` and `/readyz` until `stop` turns true.
pub async fn run(
    listener: TcpListener,
    metrics: Arc<Metrics>,
    ready: Arc<AtomicBool>,
    mut stop: watch::Receiver<bool>,
) -> std::io::Result<()> {
    let scrape = move || {
        let content_type = "application/openmetrics-text; version=1.0.0; charset=utf-8";
        std::future::ready(([(header::CONTENT_TYPE, content_type)], metrics.render()).into_response())
    };
    let readyz = move || {
        std::future::ready(if ready.load(Ordering::Relaxed) {
            (StatusCode::OK, "ready\n")
        } else {
            (StatusCode::SERVICE_UNAVAILABLE, "not ready\n")
        })
    };
    let router = Router::new()
        .route("/metrics", get(scrape))
        .route("/livez", get(|| std::future::ready("live\n")))
        .route("/readyz", get(readyz));
    let stopped = async move {
        // an error means that the sender is gone, and with it the server
        let _ = stop.wait_for(|&stop| stop).await;
    };
    let listener = tokio::net::TcpListener::from_std(listener)?;
    axum::serve(listener, router).with_graceful_shutdown(stopped).await
}
