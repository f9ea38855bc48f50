//! One writer of a bundle at a time, and no reader in the middle of a write.
//!
//! The lock is a file beside the bundle, `.<name>.lock`, which stays once a bundle is written: readers look for it. A write that
//! fails takes away the file that it made, and who waited for that file makes the next one. The system gives the lock back
//! when its process ends, however that ends.

use std::fs::{self, File, Metadata, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::os::unix::fs::MetadataExt;
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
    file: File,
    path: PathBuf,
    /// True where the file was not there before.
    is_new: bool,
    /// Folders that were made for it, the innermost first.
    folders: Vec<PathBuf>,
}

impl Lock {
    /// Gives the lock back and takes away what was made for it.
    fn abandon(self) {
        if self.is_new {
            // still locked: who waits for it sees that the file is no longer there
            let _ = fs::remove_file(&self.path);
        }
        // fails of a folder that others have filled since
        self.folders.iter().take_while(|folder| fs::remove_dir(folder).is_ok()).for_each(drop);
    }

    /// False of a file that its former holder took away, or that was made again.
    fn is_in_place(&self) -> io::Result<bool> {
        let identity = |metadata: Metadata| (metadata.dev(), metadata.ino());
        let own = identity(self.file.metadata()?);
        Ok(fs::metadata(&self.path).is_ok_and(|metadata| identity(metadata) == own))
    }
}

fn path_of(directory: &Path) -> PathBuf {
    let name = directory.file_name().unwrap_or_default().to_string_lossy();
    directory.with_file_name(format!(".{name}.lock"))
}

/// Does work on bundles that no other writer or reader looks at. Work that fails leaves no lock where there was none.
pub fn exclusively<T>(
    directories: &[&Path],
    work: impl FnOnce() -> Result<T, BundleError>,
) -> Result<T, BundleError> {
    let mut locks = Vec::new();
    let locked =
        directories.iter().try_for_each(|directory| exclusive(directory).map(|lock| locks.push(lock)));
    let done = locked.and_then(|()| work());
    if done.is_err() {
        // the first one made the folder of the others
        locks.into_iter().rev().for_each(Lock::abandon);
    }
    done
}

/// Waits for other writers and readers of a bundle, and keeps them out.
fn exclusive(directory: &Path) -> Result<Lock, BundleError> {
    let path = path_of(directory);
    let lock = || loop {
        let mut lock = open(&path)?;
        if !wait(|| lock.file.try_lock())? {
            let by = fs::read_to_string(&path).unwrap_or_default();
            return Err(Fault::Locked { by: by.trim().to_owned() });
        }
        if lock.is_in_place()? {
            // for whoever waits in vain; a full disk holds not even this
            let signed = lock.file.set_len(0);
            return match signed.and_then(|()| writeln!(lock.file, "process {}", std::process::id())) {
                Ok(()) => Ok(lock),
                Err(error) => {
                    lock.abandon();
                    Err(error.into())
                }
            };
        }
    };
    lock().map_err(At::path(&path))
}

fn open(path: &Path) -> io::Result<Lock> {
    let folders = missing_folders(path);
    let made = path.parent().map_or(Ok(()), fs::create_dir_all);
    let opened = made.and_then(|()| match File::create_new(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
            Ok((file, false))
        }
        created => Ok((created?, true)),
    });
    match opened {
        Ok((file, is_new)) => Ok(Lock { file, path: path.to_owned(), is_new, folders }),
        Err(error) => {
            folders.iter().for_each(|folder| drop(fs::remove_dir(folder)));
            Err(error)
        }
    }
}

/// The folders above a file that are not there, the innermost first.
fn missing_folders(path: &Path) -> Vec<PathBuf> {
    let above = path.ancestors().skip(1).filter(|folder| !folder.as_os_str().is_empty());
    above.take_while(|folder| !folder.exists()).map(Path::to_owned).collect()
}

/// Waits for a writer of a bundle, and keeps writers out until the file is dropped. `None` where there never was one, or where
/// it takes too long.
pub fn shared(directory: &Path) -> Option<File> {
    let file = File::open(path_of(directory)).ok()?;
    let locked = wait(|| file.try_lock_shared()).unwrap_or(false);
    locked.then_some(file)
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
