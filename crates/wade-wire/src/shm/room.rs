//! What shared memory takes of the machine, asked for before it is opened: a page without memory behind it ends a process by
//! SIGBUS, and a descriptor that is not there shows as an error that says something else.

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use iceoryx2::config::Config;
use nix::sys::resource::{Resource, getrlimit};
use nix::sys::statvfs::statvfs;
use nix::unistd::{AccessFlags, access};

use super::SHARED_MEMORY;

/// Room that the services take whatever is served [bytes], and that each vehicle takes once it has answered a batch: one of
/// 256 states has 1.3 MB.
const ROOM: u64 = 1 << 20;
const ROOM_OF_VEHICLE: u64 = 2 << 20;

/// Room that the ports of one client take with the first batch of 256 states [bytes]: 1.4 MB were measured.
const ROOM_OF_CLIENT: u64 = 2 << 20;
/// Descriptors that they take: 35 were measured, with the port for derivatives.
const DESCRIPTORS_OF_CLIENT: u64 = 40;

/// Descriptors of a process that serves nothing yet, and of each vehicle with the clients of one simulator.
const DESCRIPTORS: u64 = 48;
const DESCRIPTORS_OF_VEHICLE: u64 = 32;

/// Why there is no point in opening shared memory.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum RoomError {
    /// The file system is full.
    #[error(
        "{SHARED_MEMORY} has {available} kB free, and {vehicles} vehicles need {needed} kB: free some, enlarge it \
         (docker --shm-size, mount -o remount,size=) or serve fewer vehicles"
    )]
    Memory { available: u64, needed: u64, vehicles: u64 },
    /// The limit of the process is too low.
    #[error(
        "the limit of open file descriptors is {limit}, and {vehicles} vehicles need {needed}: raise it (ulimit -n, \
         LimitNOFILE=)"
    )]
    Descriptors { limit: u64, needed: u64, vehicles: u64 },
    /// The file system is full for a client.
    #[error(
        "{SHARED_MEMORY} has {available} kB free, and a client needs {} kB: free some or enlarge it (docker --shm-size, \
         mount -o remount,size=)", ROOM_OF_CLIENT >> 10
    )]
    ClientMemory { available: u64 },
    /// The limit of the client's process is too low.
    #[error(
        "{open} of {limit} file descriptors are open, and a client needs {DESCRIPTORS_OF_CLIENT}: raise the limit \
         (ulimit -n, LimitNOFILE=)"
    )]
    ClientDescriptors { open: u64, limit: u64 },
    /// Another user made the folder of iceoryx2 first.
    #[error(
        "{} belongs to the user with the number {owner}, who used iceoryx2 first: run all that uses it as one user, or delete \
         it where none does",
        .folder.display()
    )]
    Foreign { folder: PathBuf, owner: u32 },
    /// The system did not say.
    #[error("{what}: {reason}")]
    Unknown { what: String, reason: String },
}

/// Checks that there are a folder, memory and descriptors for this many vehicles.
pub fn check(vehicles: usize) -> Result<(), RoomError> {
    let folder = PathBuf::from(Config::global_config().global.root_path().to_string());
    if let Ok(metadata) = std::fs::metadata(&folder)
        && access(&folder, AccessFlags::W_OK | AccessFlags::X_OK).is_err()
    {
        return Err(RoomError::Foreign { folder, owner: metadata.uid() });
    }
    let vehicles = vehicles as u64;
    let available = available()?;
    let needed = ROOM + vehicles * ROOM_OF_VEHICLE;
    if available < needed {
        let (available, needed) = (available >> 10, needed >> 10);
        return Err(RoomError::Memory { available, needed, vehicles });
    }
    let limit = limit()?;
    let needed = DESCRIPTORS + vehicles * DESCRIPTORS_OF_VEHICLE;
    if limit < needed {
        return Err(RoomError::Descriptors { limit, needed, vehicles });
    }
    Ok(())
}

/// Checks that there are memory and descriptors for one more client, in the client's process.
pub fn check_client() -> Result<(), RoomError> {
    let available = available()?;
    if available < ROOM_OF_CLIENT {
        return Err(RoomError::ClientMemory { available: available >> 10 });
    }
    let limit = limit()?;
    // where the table cannot be read, opening says what is missing
    let open = std::fs::read_dir("/proc/self/fd").map_or(0, |table| table.count() as u64);
    if limit < open + DESCRIPTORS_OF_CLIENT {
        return Err(RoomError::ClientDescriptors { open, limit });
    }
    Ok(())
}

/// Free room for segments [bytes].
fn available() -> Result<u64, RoomError> {
    let system = statvfs(Path::new(SHARED_MEMORY)).map_err(|error| unknown(SHARED_MEMORY, error))?;
    Ok(system.blocks_available() * system.fragment_size())
}

/// Limit of open descriptors of this process.
fn limit() -> Result<u64, RoomError> {
    let limits = getrlimit(Resource::RLIMIT_NOFILE);
    limits.map(|(limit, _)| limit).map_err(|error| unknown("the limit of descriptors", error))
}

fn unknown(what: &str, error: nix::Error) -> RoomError {
    RoomError::Unknown { what: what.to_owned(), reason: error.desc().to_owned() }
}
