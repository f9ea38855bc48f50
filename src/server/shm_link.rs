//! What the server and the process that serves shared memory for it say to each other: one JSON object a line, over the
//! standard input and output of that process.

use serde::{Deserialize, Serialize};

use crate::config::Config;

/// The first line: what to serve.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Start {
    /// The server's settings.
    pub config: Config,
    /// The vehicles that the server serves.
    pub vehicles: Vec<String>,
    /// The server's process.
    pub server: u32,
    /// The process before this one ended by a crash: nothing that it left is trusted.
    pub crashed: bool,
    /// Processes before this one that ended by a crash.
    pub former: Vec<u32>,
}

/// Every line after it.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Order {
    /// Given back in [`Report::Done`].
    pub number: u64,
    /// The vehicle.
    pub vehicle: String,
    /// Whether its bundle is read again; else it is served no more.
    pub serve: bool,
}

/// What the process says.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Report {
    /// The services are open.
    Opened,
    /// The services cannot be had, with the reason; the process ends.
    Unavailable(String),
    /// The server has answered the question of its own client.
    Answered,
    /// An order was carried out, with the version that is served now.
    Done { number: u64, version: Option<u32> },
    /// Requests since the last report.
    Counted(Counted),
    /// Requests that were refused since the last report, single or in batches.
    Refused { batch: bool, requests: u64 },
}

/// Requests of one vehicle, single or in batches.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Counted {
    /// The vehicle.
    pub vehicle: String,
    /// Whether they were batches.
    pub batch: bool,
    /// Times from arrival to answer [ns], and how many there were of each.
    pub times: Vec<(u64, u64)>,
    /// States outside the training domain.
    pub outside: u64,
}
