//! What shared memory takes of the machine, asked for before it is opened: a page without memory behind it ends a process by
//! SIGBUS, and a descriptor that is not there shows as an error that says something else.

use std::path::Path;

use nix::sys::resource::{Resource, getrlimit};
use nix::sys::statvfs::statvfs;

use super::shm_owner::SHARED_MEMORY;

/// Room that the services take whatever is served [bytes], and that each vehicle takes once clients write batches.
const ROOM: u64 = 1 << 20;
const ROOM_OF_VEHICLE: u64 = 1 << 20;

/// Descriptors of a process that serves nothing yet, and of each vehicle with the clients of one simulator.
const DESCRIPTORS: u64 = 48;
const DESCRIPTORS_OF_VEHICLE: u64 = 32;

/// Why there is no point in opening shared memory.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum RoomError {
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
    /// The system did not say.
    #[error("{what}: {reason}")]
    Unknown { what: String, reason: String },
}

/// Checks that there are memory and descriptors for this many vehicles.
pub(crate) fn check(vehicles: usize) -> Result<(), RoomError> {
    let vehicles = vehicles as u64;
    let unknown = |what: &str, error: nix::Error| {
        let reason = error.desc().to_owned();
        RoomError::Unknown { what: what.to_owned(), reason }
    };
    let system = statvfs(Path::new(SHARED_MEMORY)).map_err(|error| unknown(SHARED_MEMORY, error))?;
    let available = u64::from(system.blocks_available()) * u64::from(system.fragment_size());
    let needed = ROOM + vehicles * ROOM_OF_VEHICLE;
    if available < needed {
        let (available, needed) = (available >> 10, needed >> 10);
        return Err(RoomError::Memory { available, needed, vehicles });
    }
    let (limit, _) =
        getrlimit(Resource::RLIMIT_NOFILE).map_err(|error| unknown("the limit of descriptors", error))?;
    let needed = DESCRIPTORS + vehicles * DESCRIPTORS_OF_VEHICLE;
    if limit < needed {
        return Err(RoomError::Descriptors { limit, needed, vehicles });
    }
    Ok(())
}
