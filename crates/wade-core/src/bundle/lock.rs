//! One writer of a bundle at a time, and no reader in the middle of a write.
//!
//! The lock is a file beside the bundle, `.<name>.lock`, which stays: a lock whose file is removed protects nobody. The
//! system gives it back when its process ends, however that ends.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::{BundleError, Fault};
use crate::at::At;

/// Pause between two attempts.
const PAUSE: Duration = Duration::from_millis(5);
/// Most attempts, about ten seconds: a writer takes some milliseconds. A reader then reads all the same, and the checksums
/// find a bundle that is half written.
const ATTEMPTS: u32 = 2000;

/// Held until it is dropped.
#[derive(Debug)]
pub struct Lock {
    _file: File,
}

fn path_of(directory: &Path) -> PathBuf {
    let name = directory.file_name().unwrap_or_default().to_string_lossy();
    directory.with_file_name(format!(".{name}.lock"))
}

/// Waits for other writers and readers of a bundle, and keeps them out.
pub fn exclusive(directory: &Path) -> Result<Lock, BundleError> {
    let path = path_of(directory);
    let lock = || {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path)?;
        if !wait(|| file.try_lock())? {
            let by = fs::read_to_string(&path).unwrap_or_default();
            return Err(Fault::Locked { by: by.trim().to_owned() });
        }
        // for whoever waits in vain
        file.set_len(0)?;
        writeln!(file, "process {}", std::process::id())?;
        Ok(Lock { _file: file })
    };
    lock().map_err(At::path(&path))
}

/// Waits for a writer of a bundle, and keeps writers out. `None` where there never was one, or where it takes too long.
pub fn shared(directory: &Path) -> Option<Lock> {
    let file = File::open(path_of(directory)).ok()?;
    let locked = wait(|| file.try_lock_shared()).unwrap_or(false);
    locked.then_some(Lock { _file: file })
}

fn wait(lock: impl Fn() -> Result<(), TryLockError>) -> io::Result<bool> {
    for _ in 0..ATTEMPTS {
        match lock() {
            Ok(()) => return Ok(true),
            Err(TryLockError::Error(error)) => return Err(error),
            Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
        }
    }
    Ok(false)
}
