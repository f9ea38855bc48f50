//! Keeping a thread on some cores.

use nix::errno::Errno;
use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::unistd::Pid;

/// The system refused to tell or to change the cores of this thread.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CoreError {
    /// The cores could not be read.
    #[error("cannot read which cores this thread may use: {0}")]
    Read(Errno),
    /// The cores could not be set.
    #[error("cannot keep this thread on the cores {cores:?}: {source}")]
    Set {
        /// Numbers of the cores.
        cores: Vec<usize>,
        /// Why.
        source: Errno,
    },
}

/// Numbers of the cores that this thread may use, ascending.
pub fn allowed() -> Result<Vec<usize>, CoreError> {
    let set = sched_getaffinity(Pid::from_raw(0)).map_err(CoreError::Read)?;
    Ok((0..CpuSet::count()).filter(|&core| set.is_set(core).unwrap_or(false)).collect())
}

/// Keeps this thread, and the threads it starts from now on, on these cores; none named: where it is.
pub fn pin_to(cores: &[usize]) -> Result<(), CoreError> {
    if cores.is_empty() {
        return Ok(());
    }
    let failed = |source| CoreError::Set { cores: cores.to_vec(), source };
    let mut set = CpuSet::new();
    for &core in cores {
        set.set(core).map_err(failed)?;
    }
    sched_setaffinity(Pid::from_raw(0), &set).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pinned_thread_has_its_cores_and_no_others() {
        let cores = allowed().expect("readable");
        let last = *cores.last().expect("at least the core we run on");
        let pinned = std::thread::spawn(move || pin_to(&[last]).and_then(|()| allowed())).join();
        assert_eq!(pinned.expect("no panic"), Ok(vec![last]));
        assert!(matches!(pin_to(&[1 << 20]), Err(CoreError::Set { .. })));
    }
}
