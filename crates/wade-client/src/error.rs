//! Why a call got no forces.

use std::time::Duration;

use tonic::Code;
use wade_wire::InvalidState;

/// Why a call got no forces.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ClientError {
    /// No answer came in time. The next call connects again.
    #[error("no answer within {} ms", .0.as_millis())]
    Timeout(Duration),
    /// Nobody serves there.
    #[error("no server at {at}: {reason}")]
    NoServer {
        /// Address or service.
        at: String,
        /// What happened.
        reason: String,
    },
    /// The server serves no such vehicle.
    #[error("vehicle \"{vehicle}\" is not served; there are: {}", .served.join(", "))]
    UnknownVehicle {
        /// The vehicle.
        vehicle: String,
        /// What is served instead.
        served: Vec<String>,
    },
    /// The server's shared memory has another layout.
    #[error(
        "shared memory of layout {expected} expected, found {found}; client and server must be of one version"
    )]
    Layout {
        /// The client's.
        expected: String,
        /// The server's.
        found: String,
    },
    /// What the client believes or shows cannot be used.
    #[error("{what}: {reason}")]
    Credentials {
        /// Which of it.
        what: String,
        /// What is wrong.
        reason: String,
    },
    /// The server refused the request.
    #[error("{code:?}: {message}")]
    Refused {
        /// What kind of refusal.
        code: Code,
        /// What the server said.
        message: String,
    },
    /// The state is wrong.
    #[error(transparent)]
    Invalid(#[from] InvalidState),
    /// A batch of states that differ in what the message carries once.
    #[error(
        "the states of a batch must agree in ground contact, in implicit added mass, and in what is given of heading, depth rate and wheel speeds"
    )]
    MixedBatch,
    /// A batch longer than the transport carries.
    #[error("a batch of {len}, the limit of this transport is {limit}")]
    BatchTooLong {
        /// States in the batch.
        len: usize,
        /// The limit.
        limit: usize,
    },
}
