//! One thing that must hold.

use serde::Serialize;

/// One thing that must hold.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// Stable name.
    pub name: &'static str,
    /// Whether it holds; none where these trials cannot tell.
    pub holds: Option<bool>,
    /// A sentence with the figures.
    pub finding: String,
}

impl Check {
    pub(super) fn new(name: &'static str, holds: Option<bool>, finding: String) -> Self {
        Self { name, holds, finding }
    }
}
