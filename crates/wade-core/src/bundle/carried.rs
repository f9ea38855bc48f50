//! The shipped vehicles, carried by the program itself: an installation needs no other file.

use super::{
    HULL_FILE, NETWORK_FILE, PATCHES_FILE, RADIATION_FILE, SPEC_FILE, SUBMERGENCE_FILE, SUMS_FILE,
    VEHICLE_FILE,
};

/// A bundle inside the program. Its files are verified against its checksums whenever it is read, as those on disk are.
#[derive(Debug, PartialEq, Eq)]
pub struct Carried {
    /// Name of the vehicle.
    pub name: &'static str,
    files: [(&'static str, &'static [u8]); 8],
}

macro_rules! carried {
    ($name:literal) => {
        Carried {
            name: $name,
            files: [
                (VEHICLE_FILE, include_bytes!(concat!("../../../../vehicles/", $name, "/vehicle.toml"))),
                (HULL_FILE, include_bytes!(concat!("../../../../vehicles/", $name, "/hull.stl"))),
                (
                    PATCHES_FILE,
                    include_bytes!(concat!("../../../../vehicles/", $name, "/patches.safetensors")),
                ),
                (
                    SUBMERGENCE_FILE,
                    include_bytes!(concat!("../../../../vehicles/", $name, "/submergence.safetensors")),
                ),
                (
                    NETWORK_FILE,
                    include_bytes!(concat!("../../../../vehicles/", $name, "/network.safetensors")),
                ),
                (
                    RADIATION_FILE,
                    include_bytes!(concat!("../../../../vehicles/", $name, "/radiation.safetensors")),
                ),
                (SPEC_FILE, include_bytes!(concat!("../../../../vehicles/", $name, "/spec.toml"))),
                (SUMS_FILE, include_bytes!(concat!("../../../../vehicles/", $name, "/SHA256SUMS"))),
            ],
        }
    };
}

static ALL: [Carried; 2] = [carried!("husky"), carried!("warthog")];

impl Carried {
    /// Every carried vehicle, by name.
    pub fn all() -> &'static [Self] {
        &ALL
    }

    /// The carried vehicle of this name.
    pub fn find(name: &str) -> Option<&'static Self> {
        ALL.iter().find(|carried| carried.name == name)
    }

    pub(super) fn file(&self, name: &str) -> Option<&'static [u8]> {
        self.files.iter().find(|(file, _)| *file == name).map(|(_, bytes)| *bytes)
    }
}
