//! A fault with the place that it is in.

use std::path::{Path, PathBuf};

/// What is wrong, and with which file or folder. The message names both.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {fault}", .path.display())]
pub struct At<F> {
    /// The file or folder.
    pub path: PathBuf,
    /// What is wrong.
    pub fault: F,
}

impl<F> At<F> {
    /// Puts a fault, once it is known, at a place.
    pub fn path(path: &Path) -> impl FnOnce(F) -> Self {
        let path = path.to_owned();
        move |fault| Self { path, fault }
    }
}
