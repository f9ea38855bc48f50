//! Whether a client is connected, and why not: told by its own thread, read by the callers.

use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

use tonic::Code;
use wade_client::ClientError;

use crate::abi::WadeStatus;
use crate::bounded::lock;

/// Pause between two attempts to connect.
pub const RETRY: Duration = Duration::from_millis(100);
/// The same where a file or the server's settings have to change first.
pub const RETRY_REFUSED: Duration = Duration::from_secs(1);

/// The state of a connection, and the wish to end it.
pub struct Connection {
    status: AtomicI32,
    reason: Mutex<String>,
    changed: Condvar,
    stopped: AtomicBool,
}

impl Connection {
    /// Not connected yet.
    pub fn new() -> Self {
        Self {
            status: AtomicI32::new(WadeStatus::NoServer as i32),
            reason: Mutex::new("the client has not connected yet".into()),
            changed: Condvar::new(),
            stopped: AtomicBool::new(false),
        }
    }

    /// Connected.
    pub fn opened(&self) {
        self.tell(WadeStatus::Ok, String::new());
    }

    /// Not connected, for this reason.
    pub fn failed(&self, error: &ClientError) {
        let status = match status_of(error) {
            // what is not there in time is not there
            WadeStatus::Timeout => WadeStatus::NoServer,
            status => status,
        };
        self.tell(status, error.to_string());
    }

    /// Not connected, for this reason.
    pub fn tell(&self, status: WadeStatus, reason: String) {
        let mut place = lock(&self.reason);
        *place = reason;
        self.status.store(status as i32, Ordering::Release);
        drop(place);
        self.changed.notify_all();
    }

    /// Not connected any more: what a caller finds out, who may not wait for the reason's place.
    pub fn lost(&self) {
        self.status.store(WadeStatus::NoServer as i32, Ordering::Release);
    }

    /// `Ok` where it is connected.
    pub fn status(&self) -> WadeStatus {
        WadeStatus::from_code(self.status.load(Ordering::Acquire)).unwrap_or(WadeStatus::Internal)
    }

    /// Waits until it is connected, or the time is over.
    pub fn wait(&self, timeout: Duration) -> WadeStatus {
        let reason = lock(&self.reason);
        let waiting = self.changed.wait_timeout_while(reason, timeout, |_| self.status() != WadeStatus::Ok);
        drop(waiting.unwrap_or_else(PoisonError::into_inner));
        self.status()
    }

    /// Why it is not connected; empty where it is.
    pub fn reason(&self) -> String {
        let reason = lock(&self.reason).clone();
        match self.status() {
            WadeStatus::Ok => String::new(),
            _ if reason.is_empty() => "the server is gone".into(),
            _ => reason,
        }
    }

    /// Asks the client's thread to end.
    pub fn stop(&self) {
        self.stopped.store(true, Ordering::Release);
    }

    /// True where the client's thread is to end.
    pub fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Acquire)
    }
}

/// The status of an error.
pub fn status_of(error: &ClientError) -> WadeStatus {
    match error {
        ClientError::Timeout(_) => WadeStatus::Timeout,
        ClientError::NoServer { .. } => WadeStatus::NoServer,
        ClientError::UnknownVehicle { .. } => WadeStatus::UnknownVehicle,
        ClientError::Layout { .. } => WadeStatus::LayoutMismatch,
        ClientError::Invalid(_) => WadeStatus::InvalidState,
        ClientError::MixedBatch | ClientError::BatchTooLong { .. } => WadeStatus::InvalidArgument,
        ClientError::Credentials { .. } => WadeStatus::Credentials,
        ClientError::Refused { code, .. } => match code {
            Code::NotFound => WadeStatus::UnknownVehicle,
            // a server without this service is of another version
            Code::Unimplemented => WadeStatus::LayoutMismatch,
            Code::ResourceExhausted => WadeStatus::ResourceExhausted,
            _ => WadeStatus::Refused,
        },
    }
}
