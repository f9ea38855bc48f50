//! The one server of a namespace. Its lock ends with its process, at whatever instruction that is killed, so that whoever
//! holds it may replace every service of the namespace that a dead server left unfinished.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use nix::errno::Errno;
use nix::fcntl::{Flock, FlockArg, OFlag};

use wade_wire::shm::SHARED_MEMORY;

/// Why the namespace is not this process's.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OwnerError {
    /// A living server has it.
    #[error(
        "another server{}, serves the namespace \"{namespace}\"; stop it or choose another with --namespace",
        .server.map(|pid| format!(", process {pid}")).unwrap_or_default()
    )]
    InUse { namespace: String, server: Option<u32> },
    /// The lock is another user's file.
    #[error("{} belongs to the user with the number {owner}; choose another namespace with --namespace", .path.display())]
    Foreign { path: PathBuf, owner: u32 },
    /// The system refused.
    #[error("cannot lock {}: {source}", .path.display())]
    System { path: PathBuf, source: std::io::Error },
}

/// The right to every service of a namespace. Dropping it gives it back.
#[derive(Debug)]
pub(crate) struct Owner {
    lock: Flock<File>,
    path: PathBuf,
    former: Vec<u32>,
}

impl Owner {
    /// Takes a namespace for the server with this process number.
    pub(crate) fn new(namespace: &str, server: u32) -> Result<Self, OwnerError> {
        let user = nix::unistd::geteuid().as_raw();
        let path = Path::new(SHARED_MEMORY).join(format!("wade_{user}_{namespace}.lock"));
        loop {
            let system = |source| OwnerError::System { path: path.clone(), source };
            let file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .mode(0o600)
                .custom_flags((OFlag::O_NOFOLLOW | OFlag::O_CLOEXEC).bits())
                .open(&path)
                .map_err(system)?;
            let owner = file.metadata().map_err(system)?.uid();
            if owner != user {
                return Err(OwnerError::Foreign { path, owner });
            }
            let lock = match Flock::lock(file, FlockArg::LockExclusiveNonblock) {
                Ok(lock) => lock,
                Err((mut file, Errno::EWOULDBLOCK)) => {
                    let server = numbers(&mut file).first().copied();
                    return Err(OwnerError::InUse { namespace: namespace.to_owned(), server });
                }
                Err((_, error)) => return Err(system(error.into())),
            };
            let mut owner = Self { lock, path: path.clone(), former: Vec::new() };
            // an owner before this one may have removed the file between the opening and the locking
            if owner.is_in_place() {
                owner.former = numbers(&mut owner.lock).into_iter().skip(1).collect();
                owner.note(server);
                return Ok(owner);
            }
        }
    }

    /// The processes that owned the namespace before and did not give it back.
    pub(crate) fn former(&self) -> &[u32] {
        &self.former
    }

    /// Forgets them, once what they left is removed: until then the next owner hears of them too.
    pub(crate) fn forget_former(&mut self, server: u32) {
        self.former.clear();
        self.note(server);
    }

    /// Whether the lock is the one that another process would find.
    pub(crate) fn is_in_place(&self) -> bool {
        let identity = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
        let held = self.lock.metadata().map(identity).ok();
        held.is_some() && held == std::fs::symlink_metadata(&self.path).map(identity).ok()
    }

    /// Writes the numbers of the server, of this process and of those before it, for the message of another server and for the
    /// next owner.
    fn note(&mut self, server: u32) {
        let numbers: Vec<String> =
            [server, std::process::id()].iter().chain(&self.former).map(u32::to_string).collect();
        let written = self.lock.set_len(0).and_then(|()| {
            self.lock.rewind()?;
            self.lock.write_all(numbers.join(" ").as_bytes())
        });
        if let Err(error) = written {
            tracing::debug!(%error, "the lock of the namespace names no process");
        }
    }
}

impl Drop for Owner {
    fn drop(&mut self) {
        if self.is_in_place() {
            // one that cannot be removed is taken over by the next server
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Longest text of a lock that is read [bytes]: a server that is killed again and again before it has removed anything adds a
/// number each time.
const LONGEST: u64 = 4096;

/// The numbers of the processes in a lock, as far as they can be read.
fn numbers(file: &mut File) -> Vec<u32> {
    let mut text = String::new();
    if file.rewind().and_then(|()| file.take(LONGEST).read_to_string(&mut text)).is_err() {
        return Vec::new();
    }
    text.split_whitespace().map_while(|number| number.parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_namespace_has_one_owner_at_a_time_and_the_next_knows_the_one_that_died() {
        let namespace = format!("owner-{}", std::process::id());
        let first = Owner::new(&namespace, 7).unwrap();
        assert!(first.is_in_place() && first.former().is_empty());
        let second = Owner::new(&namespace, 8).unwrap_err();
        assert!(second.to_string().starts_with("another server, process 7, serves"), "{second}");
        // a lock that was deleted under its owner is no lock any more
        std::fs::remove_file(&first.path).unwrap();
        assert!(!first.is_in_place());
        let third = Owner::new(&namespace, 9).unwrap();
        drop(first);
        assert!(third.is_in_place(), "what is not in place is not removed");
        // a process that is killed leaves its file without the lock
        let path = third.path.clone();
        drop(third);
        assert!(!path.exists());
        std::fs::write(&path, "9 12345 678").unwrap();
        let mut fourth = Owner::new(&namespace, 10).unwrap();
        assert_eq!(fourth.former(), [12345, 678]);
        let text = || std::fs::read_to_string(&path).unwrap();
        assert_eq!(text(), format!("10 {} 12345 678", std::process::id()), "kept until they are forgotten");
        fourth.forget_former(10);
        assert_eq!(text(), format!("10 {}", std::process::id()));
        drop(fourth);
        std::fs::write(&path, "\u{7f}no numbers").unwrap();
        assert!(Owner::new(&namespace, 10).unwrap().former().is_empty());
    }
}
