//! Connections to the HTTP port: so many at a time, and none for long without a request. Where all places are taken, the
//! connection that has let the server wait for longest makes room, so that a probe never waits behind slow bodies.

use std::convert::Infallible;
use std::future::Future;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::{Request, Response, StatusCode};
use axum::response::IntoResponse;
use hyper::body::{Body as HttpBody, Incoming};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::runtime::Handle;
use tokio::sync::watch;
use tower::ServiceExt;

use super::Shared;
use super::rejection::Rejection;
use crate::metrics::{Metrics, Resource, Transport};
use crate::service::access::{Acceptor, Role, Who};
use crate::service::accounts::{Closed, Computing, Connection, Sent};
use crate::service::intake::{self, Listener, Socket};
use crate::service::stopped;
use crate::service::traces::{self, Traces};

/// How often a connection's deadline is looked at.
const LOOK: Duration = Duration::from_secs(1);

/// Who answers what.
#[derive(Debug, Clone)]
pub struct Routes {
    /// Answered at once, on the thread that reads.
    pub probes: Router,
    /// Everything else.
    pub browsed: Router,
    /// The runtime that answers it.
    pub work: Handle,
}

/// Answers until `stop` turns true, and then what has been asked until then.
pub async fn serve(listener: Listener, routes: Routes, shared: &Shared, stop: watch::Receiver<bool>) {
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(Duration::from_secs_f64(shared.config.request_s));
    let open = GracefulShutdown::new();
    let answer = Duration::from_secs_f64(shared.config.answer_s);
    let handshake = Duration::from_secs_f64(shared.config.request_s);
    let serve = |socket, connection: Arc<Connection>, place| {
        let (routes, acceptor) = (routes.clone(), shared.acceptor.clone());
        let (http, watcher) = (http.clone(), open.watcher());
        let (metrics, traces, stop) =
            (Arc::clone(&shared.grpc.metrics), shared.grpc.traces.clone(), stop.clone());
        tokio::spawn(async move {
            let welcomed = acceptor.let_in(socket, &connection, handshake, stop).await;
            let Some((socket, who)) = welcomed else { return };
            let service =
                Requests { routes, connection: Arc::clone(&connection), acceptor, who, metrics, traces };
            let noted = Noted { socket, connection: Arc::clone(&connection) };
            let served = watcher.watch(http.serve_connection(TokioIo::new(noted), service));
            tokio::select! {
                // a client that breaks its own connection off is its own affair
                _ = served => {}
                _ = connection.closing() => {}
                () = stalled(&connection, answer) => connection.close(Closed::answer_not_read),
            }
            drop(place);
        });
    };
    tokio::select! {
        () = intake::accept_all(listener, Arc::clone(&shared.accounts), Resource::http_connections, serve) => {}
        () = stopped(stop.clone()) => {}
    }
    open.shutdown().await;
}

/// Resolves when an answer has waited for too long.
async fn stalled(connection: &Connection, longest: Duration) {
    while connection.stalled_for() <= longest {
        tokio::time::sleep(LOOK).await;
    }
}

/// The requests of one connection.
struct Requests {
    routes: Routes,
    connection: Arc<Connection>,
    acceptor: Acceptor,
    who: Who,
    metrics: Arc<Metrics>,
    traces: Option<Arc<Traces>>,
}

/// The role that a path takes; probes take none.
fn role(path: &str) -> Option<Role> {
    match path {
        "/livez" | "/readyz" => None,
        "/metrics" | "/v1/latency" => Some(Role::Observe),
        path if path.starts_with("/v1/streams") => Some(Role::Observe),
        _ => Some(Role::Query),
    }
}

impl hyper::service::Service<Request<Incoming>> for Requests {
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Response<Body>, Infallible>> + Send>>;

    fn call(&self, request: Request<Incoming>) -> Self::Future {
        let Routes { probes, browsed, work } = self.routes.clone();
        let connection = Arc::clone(&self.connection);
        connection.moved();
        // who scrapes and who probes does so for ever
        let traces = self.traces.as_ref().filter(|_| !is_probe(request.uri().path()));
        let span = traces.map(|traces| {
            let (method, path) = (request.method().as_str(), request.uri().path());
            traces.request(method, path, request.headers(), connection.peer())
        });
        let ended = move |response: &Response<Body>| {
            if let Some(mut span) = span {
                traces::answered(&mut span, response.status().as_u16());
            }
        };
        let checked = role(request.uri().path()).map_or(Ok(()), |role| {
            self.acceptor.access().check(&self.who, request.headers(), role).map(drop)
        });
        if let Err(refusal) = checked {
            self.metrics.refuse(Transport::http, refusal.reason());
            let response = Rejection::from(refusal).into_response();
            ended(&response);
            return Box::pin(
                async move { Ok(response.map(|body| Body::new(Sent::new(body, connection, None)))) },
            );
        }
        Box::pin(async move {
            // a request with a body is the client's to complete: who reads it says when it is there
            let _computing = request.body().is_end_stream().then(|| Computing::begin(&connection));
            let mut request = request.map(Body::new);
            request.extensions_mut().insert(Arc::clone(&connection));
            let response = if is_probe(request.uri().path()) {
                probes.oneshot(request).await?
            } else {
                let answered = work.spawn(browsed.oneshot(request)).await;
                answered.unwrap_or_else(|_| Ok(StatusCode::INTERNAL_SERVER_ERROR.into_response()))?
            };
            ended(&response);
            Ok(response.map(|body| Body::new(Sent::new(body, connection, None))))
        })
    }
}

/// Whether it is a program that asks, every few seconds.
fn is_probe(path: &str) -> bool {
    matches!(path, "/livez" | "/readyz" | "/metrics")
}

/// A socket that notes what leaves.
struct Noted {
    socket: Socket,
    connection: Arc<Connection>,
}

impl AsyncRead for Noted {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.socket).poll_read(cx, buf)
    }
}

impl AsyncWrite for Noted {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let written = ready!(Pin::new(&mut self.socket).poll_write(cx, bytes))?;
        self.connection.sent();
        Poll::Ready(Ok(written))
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.socket).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.socket).poll_shutdown(cx)
    }
}
