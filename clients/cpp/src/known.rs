//! What a client knows without asking.

use crate::connection::Connection;
use crate::last::Last;

/// Told by the transport, read by the callers.
pub struct Known {
    /// Whether it is connected.
    pub connection: Connection,
    /// The last answer.
    pub last: Last,
}

impl Known {
    /// Nothing yet.
    pub fn new() -> Self {
        Self { connection: Connection::new(), last: Last::new() }
    }
}
