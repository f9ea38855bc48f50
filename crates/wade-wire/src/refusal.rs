//! Why a request was not answered, and the map from that to gRPC status.

use tonic::Code;
use tonic_types::{ErrorDetails, StatusExt};

use super::stability::StabilityFault;
use super::state::InvalidState;
use super::tensor_fault::TensorFault;

/// No vehicle of this name is served.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no vehicle named \"{name}\" is served; served: {served}")]
pub struct UnknownVehicle {
    /// The name asked for.
    pub name: String,
    /// The names served.
    pub served: String,
}

/// Too much is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{limit} are already in flight, {}", if *.of_peer { "the share of one client (grpc.peer_share)" } else { "the limit" })]
pub struct Overloaded {
    /// The limit.
    pub limit: usize,
    /// Whether it is that of one peer.
    pub of_peer: bool,
}

/// Why a request was not answered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// No such vehicle.
    #[error(transparent)]
    UnknownVehicle(UnknownVehicle),
    /// The bundles are still being read, or every vehicle was unloaded.
    #[error("no vehicle is served: they are still being loaded, or none is left")]
    NotReady,
    /// Another version of the vehicle is served.
    #[error("{vehicle} is not served in version \"{version}\"; served: {served}")]
    UnknownVersion {
        /// The vehicle.
        vehicle: String,
        /// The version asked for.
        version: String,
        /// The version served.
        served: u32,
    },
    /// A repository of models by name.
    #[error("there is no repository \"{name}\": the one there is has no name")]
    UnknownRepository {
        /// The name.
        name: String,
    },
    /// A tensor of an inference request is wrong.
    #[error(transparent)]
    Tensor(#[from] TensorFault),
    /// A request for how a vehicle stands is wrong.
    #[error(transparent)]
    Stability(#[from] StabilityFault),
    /// A field of the state is wrong; in a batch, of the state with this index.
    #[error("{invalid}{}", .index.map(|i| format!(" (state {i} of the batch)")).unwrap_or_default())]
    Invalid {
        /// What is wrong.
        invalid: InvalidState,
        /// Which state of a batch.
        index: Option<usize>,
    },
    /// The request names no state.
    #[error("state is missing")]
    MissingState,
    /// A batch without a state.
    #[error("the batch is empty: depth_m must have one value a state")]
    EmptyBatch,
    /// A batch over the limit.
    #[error("the batch has {len} states, the limit is {limit}")]
    BatchTooLong {
        /// States in the batch.
        len: usize,
        /// The limit.
        limit: usize,
    },
    /// An array of a batch with another length than depth_m implies.
    #[error("{name} has {len} values, expected {expected} ({width} a state) or none")]
    UnequalLength {
        /// Name of the array.
        name: &'static str,
        /// Its length.
        len: usize,
        /// The length it should have.
        expected: usize,
        /// Values a state.
        width: usize,
    },
    /// Too many requests or streams.
    #[error("{what}: {overloaded}")]
    Overloaded {
        /// What there is too much of.
        what: &'static str,
        /// The limit.
        overloaded: Overloaded,
    },
    /// An administrator's call where none is answered.
    #[error("an administrator's call is answered on the Unix socket alone: {reason}")]
    NoAdministration {
        /// The way out.
        reason: String,
    },
    /// The caller has not shown who it is.
    #[error("this call needs the role {role}: {reason}")]
    Unauthenticated {
        /// The role.
        role: &'static str,
        /// What is missing or wrong.
        reason: String,
    },
    /// The caller may not do this.
    #[error("{caller} does not have the role {role}")]
    MissingRole {
        /// Who asks.
        caller: String,
        /// The role.
        role: &'static str,
    },
    /// Other jobs of an administrator are not done yet.
    #[error("another administrator's job runs and one more waits: ask again when they are done")]
    TooManyJobs,
    /// A message over the size limit.
    #[error("{reason}; send smaller batches, or raise grpc.max_message_bytes")]
    MessageTooLong {
        /// Its size and the limit.
        reason: String,
    },
    /// The caller's deadline passed before the answer was complete.
    #[error("the deadline passed {}", .answered.map_or_else(|| "before the computation".into(), |n| format!("after {n} states")))]
    DeadlineExceeded {
        /// States of a batch that had been computed.
        answered: Option<usize>,
    },
}

impl From<UnknownVehicle> for Refusal {
    fn from(unknown: UnknownVehicle) -> Self {
        if unknown.served.is_empty() { Self::NotReady } else { Self::UnknownVehicle(unknown) }
    }
}

impl From<InvalidState> for Refusal {
    fn from(invalid: InvalidState) -> Self {
        Self::Invalid { invalid, index: None }
    }
}

/// When a client that was refused for load may try again.
const RETRY_AFTER: std::time::Duration = std::time::Duration::from_millis(10);

impl Refusal {
    /// The gRPC code.
    pub fn code(&self) -> Code {
        match self {
            Self::UnknownVehicle(_) | Self::UnknownVersion { .. } | Self::UnknownRepository { .. } => {
                Code::NotFound
            }
            Self::NotReady => Code::Unavailable,
            Self::Overloaded { .. } | Self::TooManyJobs | Self::MessageTooLong { .. } => {
                Code::ResourceExhausted
            }
            Self::NoAdministration { .. } | Self::MissingRole { .. } => Code::PermissionDenied,
            Self::Unauthenticated { .. } => Code::Unauthenticated,
            Self::DeadlineExceeded { .. } => Code::DeadlineExceeded,
            Self::Invalid { .. }
            | Self::Tensor(_)
            | Self::Stability(_)
            | Self::MissingState
            | Self::EmptyBatch
            | Self::BatchTooLong { .. }
            | Self::UnequalLength { .. } => Code::InvalidArgument,
        }
    }

    /// The gRPC code in words, for the metrics.
    pub fn reason(&self) -> &'static str {
        match self.code() {
            Code::NotFound => "not_found",
            Code::Unavailable => "unavailable",
            Code::ResourceExhausted => "resource_exhausted",
            Code::DeadlineExceeded => "deadline_exceeded",
            Code::PermissionDenied => "permission_denied",
            Code::Unauthenticated => "unauthenticated",
            _ => "invalid_argument",
        }
    }

    /// What a program can read of it: the field, or when to try again.
    pub fn details(&self) -> ErrorDetails {
        let message = self.to_string();
        match self {
            Self::UnknownVehicle(unknown) => {
                ErrorDetails::with_resource_info("wade.v1.Vehicle", unknown.name.as_str(), "", message)
            }
            Self::UnknownVersion { vehicle, .. } => {
                ErrorDetails::with_resource_info("wade.v1.Vehicle", vehicle.as_str(), "", message)
            }
            Self::UnknownRepository { name } => {
                ErrorDetails::with_resource_info("repository", name.as_str(), "", message)
            }
            Self::Tensor(fault) => ErrorDetails::with_bad_request_violation(fault.field(), message),
            Self::Stability(fault) => ErrorDetails::with_bad_request_violation(fault.field(), message),
            Self::Overloaded { .. } | Self::TooManyJobs | Self::NotReady => {
                ErrorDetails::with_retry_info(Some(RETRY_AFTER))
            }
            // the same message would be refused again, so there is no time to retry after
            Self::DeadlineExceeded { .. }
            | Self::MessageTooLong { .. }
            | Self::NoAdministration { .. }
            | Self::Unauthenticated { .. }
            | Self::MissingRole { .. } => ErrorDetails::new(),
            Self::Invalid { invalid, index } => {
                let name = invalid.field.name();
                let field = index.map_or_else(|| format!("state.{name}"), |i| format!("{name}[{i}]"));
                ErrorDetails::with_bad_request_violation(field, message)
            }
            Self::MissingState => ErrorDetails::with_bad_request_violation("state", message),
            Self::EmptyBatch | Self::BatchTooLong { .. } => {
                ErrorDetails::with_bad_request_violation("depth_m", message)
            }
            Self::UnequalLength { name, .. } => ErrorDetails::with_bad_request_violation(*name, message),
        }
    }
}

impl From<Refusal> for tonic::Status {
    fn from(refusal: Refusal) -> Self {
        Self::with_error_details(refusal.code(), refusal.to_string(), refusal.details())
    }
}
