//! Why shared memory could not be opened.

/// The shared memory could not be set up.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("shared memory: cannot create {what}: {reason}")]
pub struct ShmError {
    /// Node, service or port.
    pub what: String,
    /// The reason that iceoryx2 gives.
    pub reason: String,
}

/// Why a service could not be opened.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// Nobody has created it.
    #[error("it does not exist")]
    Absent,
    /// What lies in it has another size or name.
    #[error("it has other types")]
    OtherTypes,
    /// The system refused.
    #[error(transparent)]
    Failed(ShmError),
}

impl ShmError {
    /// An error about `what`, once its reason is known.
    pub fn new(what: impl Into<String>) -> impl FnOnce(&dyn std::fmt::Display) -> Self {
        let what = what.into();
        move |reason| Self { what, reason: reason.to_string() }
    }
}
