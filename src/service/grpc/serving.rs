//! One connection from its handshake to its end: its deadlines, and a drain.

use std::error::Error;
use std::future::{Future, poll_fn};
use std::sync::Arc;
use std::task::ready;
use std::time::Duration;

use hyper::server::conn::http2;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::sync::watch;
use tokio::time::Instant;

use super::Config;
use super::calls::Calls;
use super::link::Link;
use super::moving::Reading;
use super::turns::Turns;
use crate::service::accounts::{Closed, Connection};
use crate::service::stopped;

/// How often a connection's deadlines are looked at.
const LOOK: Duration = Duration::from_secs(1);
/// Longest time for a peer that is asked to go, and for one to close its end after the server has closed its own.
pub const GOODBYE: Duration = Duration::from_secs(2);
/// What one stream may send ahead of the server's reading [bytes]. What is sent ahead lies in memory.
const STREAM_WINDOW: u32 = 128 << 10;
/// The same of all streams of a connection [bytes].
pub const CONNECTION_WINDOW: u32 = 256 << 10;
/// Most bytes of answers that one stream has in the library's buffer.
const SEND_BUFFER: usize = 64 << 10;
/// Longest headers of a request [bytes].
const MAX_HEADERS: u32 = 16 << 10;
/// Streams that a peer may have reset before they were looked at. More fit into no turn, so that it is the budget for frames
/// that counts, which slows a flood down, where an end of the connection would have it come again at once.
const MAX_PENDING_RESETS: usize = 1024;
/// Streams that the server may have reset for a peer's faults before the connection ends.
const MAX_FAULTS: usize = 64;

/// The deadlines of a connection.
#[derive(Debug, Clone, Copy)]
pub struct Deadlines {
    /// For what HTTP/2 begins with, and before it for TLS.
    pub handshake: Duration,
    first_request: Duration,
    idle: Duration,
    answer: Duration,
}

impl Deadlines {
    /// As configured.
    pub fn of(config: &Config) -> Self {
        Self {
            handshake: Duration::from_secs_f64(config.handshake_s),
            first_request: Duration::from_secs_f64(config.first_request_s),
            idle: Duration::from_secs_f64(config.idle_s),
            answer: Duration::from_secs_f64(config.answer_s),
        }
    }

    /// The deadline that a connection has missed.
    fn missed(&self, connection: &Connection) -> Option<Closed> {
        if !connection.has_shaken_hands() {
            return (connection.age() > self.handshake).then_some(Closed::no_handshake);
        }
        if !connection.has_called() {
            return (connection.age() > self.first_request).then_some(Closed::no_request);
        }
        if connection.stalled_for() > self.answer {
            return Some(Closed::answer_not_read);
        }
        (!connection.has_calls() && connection.waits_for() > self.idle).then_some(Closed::idle)
    }
}

/// The settings of HTTP/2.
pub fn builder(config: &Config, reading: Reading) -> http2::Builder<Reading> {
    let mut builder = http2::Builder::new(reading);
    builder
        .timer(TokioTimer::new())
        // gRPC has no use for it, and its length changes with the second
        .auto_date_header(false)
        .initial_stream_window_size(STREAM_WINDOW)
        .initial_connection_window_size(CONNECTION_WINDOW)
        .max_concurrent_streams(config.max_streams_per_connection)
        .max_send_buf_size(SEND_BUFFER)
        .max_header_list_size(MAX_HEADERS)
        .max_pending_accept_reset_streams(MAX_PENDING_RESETS)
        .max_local_error_reset_streams(MAX_FAULTS)
        .keep_alive_interval(Duration::from_secs(config.keepalive_s));
    builder
}

/// Whether it is the library that ended the connection: for its peer's fault.
fn broke_protocol(error: &hyper::Error) -> bool {
    let cause = error.source().and_then(|cause| cause.downcast_ref::<h2::Error>());
    cause.is_some_and(h2::Error::is_library)
}

/// A connection that was accepted.
pub struct Accepted {
    /// Its bytes.
    pub link: Link,
    /// Its calls.
    pub calls: Calls,
    /// Its turns among the others.
    pub turns: Turns,
}

/// Serves one connection until it ends, is to be closed, or the server drains and its calls are answered.
pub async fn serve(
    http: http2::Builder<Reading>,
    accepted: Accepted,
    deadlines: Deadlines,
    stop: watch::Receiver<bool>,
) {
    let Accepted { link, calls, mut turns } = accepted;
    let connection = Arc::clone(&calls.connection);
    let mut served = std::pin::pin!(http.serve_connection(TokioIo::new(link), calls));
    let mut stop = std::pin::pin!(stopped(stop));
    let mut look = tokio::time::interval_at(Instant::now() + LOOK, LOOK);
    let (mut draining, mut goodbye) = (false, None);
    loop {
        let served_turn = poll_fn(|cx| {
            let _turn = ready!(turns.poll_turn(&connection, cx));
            let polled = served.as_mut().poll(cx);
            turns.end_turn(&connection, cx);
            polled
        });
        tokio::select! {
            // what is ready first goes first, so that a simulation does the same each time
            biased;
            ended = served_turn => {
                // a client that breaks its own connection off is its own affair
                if ended.is_err_and(|error| broke_protocol(&error)) {
                    connection.close(Closed::broke_protocol);
                }
                return;
            }
            _ = connection.closing() => return,
            () = &mut stop, if !draining => {
                draining = true;
                served.as_mut().graceful_shutdown();
            }
            _ = look.tick() => match deadlines.missed(&connection) {
                // one that has nothing to lose is asked to go, so that its next call finds a new connection
                Some(Closed::idle | Closed::no_request) if goodbye.is_none() => {
                    goodbye = Some(Instant::now());
                    served.as_mut().graceful_shutdown();
                }
                Some(reason) if goodbye.is_none_or(|since| since.elapsed() > GOODBYE) => {
                    connection.close(reason);
                }
                _ => {}
            },
        }
    }
}
