//! Keeping a thread on one core.

use nix::{
    errno::Errno,
    sched::{CpuSet, sched_getaffinity, sched_setaffinity},
    unistd::Pid,
};

/// The system refused to tell or to change the cores of this thread.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PinError {
    /// The cores could not be read.
    #[error("cannot read which cores this thread may use: {0}")]
    Read(Errno),
    /// The core could not be set.
    #[error("cannot keep this thread on core {core}: {source}")]
    Set {
        /// Number of the core.
        core: usize,
        /// Why.
        source: Errno,
    },
}

/// Numbers of the cores that this thread may use, ascending.
pub fn allowed_cores() -> Result<Vec<usize>, PinError> {
    let set = sched_getaffinity(Pid::from_raw(0)).map_err(PinError::Read)?;
    Ok((0..CpuSet::count()).filter(|&core| set.is_set(core).unwrap_or(false)).collect())
}

/// Keeps this thread, and the threads it starts from now on, on one core.
pub fn pin_to_core(core: usize) -> Result<(), PinError> {
    let failed = |source| PinError::Set { core, source };
    let mut set = CpuSet::new();
    set.set(core).map_err(failed)?;
    sched_setaffinity(Pid::from_raw(0), &set).map_err(failed)
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    #[test]
    fn a_pinned_thread_has_one_core() {
        let cores = allowed_cores().expect("readable");
        let last = *cores.last().expect("at least the core we run on");
        let pinned = thread::spawn(move || pin_to_core(last).and_then(|()| allowed_cores())).join();
        assert_eq!(pinned.expect("no panic"), Ok(vec![last]));
        assert!(matches!(pin_to_core(1 << 20), Err(PinError::Set { .. })));
    }
}
