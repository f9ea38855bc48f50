//! Connections to the HTTP port: so many at a time, and none for long without a request, so that whoever opens them by the
//! thousand or never says what it wants takes a bounded share of the server.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

/// Connections at a time; further ones wait for a place.
const MOST: usize = 128;
/// Until the head of the next request is there, a connection without one is closed.
const PATIENCE: Duration = Duration::from_secs(5);
/// Pause where the system has no descriptor for a connection.
const EXHAUSTED: Duration = Duration::from_millis(200);

/// Answers until `stop` turns true, and then what has been asked until then.
pub async fn serve(listener: TcpListener, router: Router, mut stop: watch::Receiver<bool>) {
    let places = Arc::new(Semaphore::new(MOST));
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(PATIENCE);
    let open = GracefulShutdown::new();
    loop {
        let (stream, place) = tokio::select! {
            // an error means that the sender is gone, and with it the server
            _ = stop.wait_for(|&stop| stop) => break,
            accepted = accept(&listener, &places) => accepted,
        };
        let service = TowerToHyperService::new(router.clone());
        let connection = open.watch(http.serve_connection(TokioIo::new(stream), service));
        tokio::spawn(async move {
            // a client that breaks its own connection off is its own affair
            let _ = connection.await;
            drop(place);
        });
    }
    drop(listener);
    open.shutdown().await;
}

/// The next connection, once there is a place for it.
async fn accept(
    listener: &TcpListener,
    places: &Arc<Semaphore>,
) -> (TcpStream, Option<OwnedSemaphorePermit>) {
    // it is never closed
    let place = Arc::clone(places).acquire_owned().await.ok();
    loop {
        match listener.accept().await {
            Ok((stream, _)) => return (stream, place),
            Err(error) => {
                tracing::warn!(%error, "no connection could be taken on the HTTP port");
                tokio::time::sleep(EXHAUSTED).await;
            }
        }
    }
}
