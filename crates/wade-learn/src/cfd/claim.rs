//! A case is computed by one process at a time, though runs may share a folder of work, and by none that outlived its run.

use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind};
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

/// How often a lock is tried, and the time between.
const TRIES: u32 = 20;
const PAUSE: Duration = Duration::from_millis(10);

/// A case that no other process computes, as long as this lives.
///
/// There are two locks. `ours` goes with this process. `solver` goes with the solver too, which has it as its standard
/// input: one whose run was killed computes on, and would write into the folder of the case that is begun anew.
#[derive(Debug)]
pub struct Claim {
    _ours: File,
    solver: File,
}

impl Claim {
    /// Claims the case that is computed in `folder`, with lock files `<name>.run` and `<name>.solver` in `locks`; None
    /// where a living run has it. A solver that an earlier run left behind is ended.
    pub fn take(locks: &Path, name: &str, folder: &Path) -> io::Result<Option<Self>> {
        std::fs::create_dir_all(locks)?;
        let open = |end: &str| {
            let path = locks.join(format!("{name}.{end}"));
            File::options().create(true).truncate(false).read(true).write(true).open(path)
        };
        let (ours, solver) = (open("run")?, open("solver")?);
        if !is_free(&ours)? {
            return Ok(None);
        }
        if !is_free(&solver)? {
            end_process(&io::read_to_string(&solver)?, folder)?;
            solver.lock()?;
        }
        Ok(Some(Self { _ours: ours, solver }))
    }

    /// The standard input of a program of the solver.
    pub fn stdin(&self) -> io::Result<Stdio> {
        Ok(self.solver.try_clone()?.into())
    }

    /// Writes down which process it is, for the run after this one.
    pub fn note(&self, child: &Child) -> io::Result<()> {
        self.solver.set_len(0)?;
        self.solver.write_all_at(child.id().to_string().as_bytes(), 0)
    }
}

/// Takes a lock; false where another process has had it for a while: one that is only being started has copies of the files of
/// the thread beside it until its own program runs.
fn is_free(file: &File) -> io::Result<bool> {
    for _ in 0..TRIES {
        match file.try_lock() {
            Ok(()) => return Ok(true),
            Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
            // some file systems of clusters have no locks: there a case is guarded by nothing
            Err(TryLockError::Error(error)) if error.kind() == ErrorKind::Unsupported => return Ok(true),
            Err(TryLockError::Error(error)) => return Err(error),
        }
    }
    Ok(false)
}

/// Ends the process of this number if it is at work in `folder`, and not another one that was given the number since.
fn end_process(number: &str, folder: &Path) -> io::Result<()> {
    let folder: PathBuf = std::path::absolute(folder)?;
    let number = number.trim();
    let is_there = |number: &i32| {
        let at = std::fs::read_link(format!("/proc/{number}/cwd")).unwrap_or_default();
        at == folder || folder.canonicalize().is_ok_and(|folder| at == folder)
    };
    match number.parse().ok().filter(is_there) {
        Some(number) => Ok(kill(Pid::from_raw(number), Signal::SIGKILL)?),
        None => Err(io::Error::other(format!(
            "a solver of an earlier run is still at work here, process {number} of this machine or another: end it"
        ))),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::process::Command;

    use super::*;

    fn solver(claim: &Claim, folder: &Path) -> Child {
        let mut command = Command::new("sleep");
        let child = command.arg("600").current_dir(folder).stdin(claim.stdin().unwrap()).spawn().unwrap();
        claim.note(&child).unwrap();
        child
    }

    #[test]
    fn a_case_is_claimed_once_and_a_solver_that_was_left_behind_is_ended() {
        let folder = tempfile::tempdir().unwrap();
        let locks = folder.path().join("locks");
        let take = || Claim::take(&locks, "case", folder.path());
        let first = take().unwrap().unwrap();
        assert!(take().unwrap().is_none(), "a living run has it");
        assert!(Claim::take(&locks, "other", folder.path()).unwrap().is_some());

        let mut left = solver(&first, folder.path());
        drop(first);
        let second = take().unwrap().unwrap();
        assert!(!left.wait().unwrap().success(), "ended by the second claim");
        drop(second);
        assert!(take().unwrap().is_some());
    }

    #[test]
    fn a_process_that_is_at_work_elsewhere_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (locks, elsewhere) = (folder.path().join("locks"), tempfile::tempdir().unwrap());
        let first = Claim::take(&locks, "case", folder.path()).unwrap().unwrap();
        let mut left = solver(&first, elsewhere.path());
        drop(first);
        let error = Claim::take(&locks, "case", folder.path()).unwrap_err().to_string();
        assert!(error.contains(&format!("process {}", left.id())), "{error}");
        assert!(left.try_wait().unwrap().is_none(), "still there");
        left.kill().unwrap();
        left.wait().unwrap();
    }
}
