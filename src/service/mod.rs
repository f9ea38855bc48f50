//! The server's transports: gRPC, HTTP and shared memory, administration, and the accounts of what clients hold.

pub mod access;
pub mod accounts;
pub mod admin;
pub mod answer;
mod batch;
pub mod bulk;
pub mod call;
pub mod grpc;
pub mod health;
pub mod http;
pub mod intake;
pub mod occupant;
pub mod shm;
pub(crate) mod shm_owner;
pub(crate) mod shm_probe;
pub(crate) mod shm_remains;
mod shm_turns;
pub mod stability;
pub mod taps;
pub mod traces;

use tokio::sync::watch;

/// Resolves when `stop` turns true.
pub(crate) async fn stopped(mut stop: watch::Receiver<bool>) {
    // an error means that the sender is gone, and with it the server
    let _ = stop.wait_for(|&stop| stop).await;
}
