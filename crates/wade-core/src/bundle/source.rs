//! Where the files of a bundle are, and reading them: regular files alone, inside the bundle, of bounded size.

use std::fs::{self, OpenOptions};
use std::io::Read;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use nix::fcntl::OFlag;

use super::carried::Carried;
use super::{BundleError, EFFECTS_FILE, Fault, SPEC_FILE, SUMS_FILE, VEHICLE_FILE};
use crate::at::At;

/// Largest mesh or tensor file [bytes]: a hull of five million faces.
const MAX_BINARY_BYTES: u64 = 256 << 20;
/// Largest text file [bytes]; effects that rest on a thousand trials are a tenth of it.
const MAX_TEXT_BYTES: u64 = 1 << 20;

/// Where the files of a bundle are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// Inside the program.
    Carried(&'static Carried),
    /// In a folder, which has the vehicle's name.
    Folder(PathBuf),
}

impl Source {
    /// The folder, or what stands for it in errors.
    pub fn path(&self) -> PathBuf {
        match self {
            Self::Carried(carried) => Path::new("carried by the binary").join(carried.name),
            Self::Folder(folder) => folder.clone(),
        }
    }

    /// For people and logs: "carried by the binary", or the folder.
    pub fn origin(&self) -> String {
        match self {
            Self::Carried(_) => "carried by the binary".to_owned(),
            Self::Folder(folder) => folder.display().to_string(),
        }
    }

    pub(super) fn has(&self, name: &str) -> bool {
        match self {
            Self::Carried(carried) => carried.file(name).is_some(),
            // a link that leads nowhere is there, and an error
            Self::Folder(folder) => folder.join(name).symlink_metadata().is_ok(),
        }
    }

    pub(super) fn file(&self, name: &str) -> Result<Vec<u8>, BundleError> {
        match self {
            Self::Carried(carried) => {
                let missing = || std::io::Error::from(std::io::ErrorKind::NotFound);
                let bytes = carried.file(name).ok_or_else(|| Fault::Io(missing()));
                bytes.map(<[u8]>::to_vec).map_err(At::path(&self.path().join(name)))
            }
            Self::Folder(folder) => read_bounded(folder, name),
        }
    }
}

/// Reads a file of a bundle. What is no regular file is refused before it is opened: a pipe would block, a device never end.
pub(super) fn read_bounded(directory: &Path, name: &str) -> Result<Vec<u8>, BundleError> {
    let path = directory.join(name);
    let read = || {
        if path.is_symlink() {
            let (to, home) = (path.canonicalize()?, directory.canonicalize()?);
            if !to.starts_with(home) {
                return Err(Fault::LeadsOut { to });
            }
        }
        if !fs::metadata(&path)?.is_file() {
            return Err(Fault::NotAFile);
        }
        // it may have become a pipe since
        let file = OpenOptions::new().read(true).custom_flags(OFlag::O_NONBLOCK.bits()).open(&path)?;
        let (metadata, most) = (file.metadata()?, max_bytes(name));
        if !metadata.is_file() {
            return Err(Fault::NotAFile);
        }
        if metadata.len() > most {
            return Err(Fault::TooLarge { bytes: metadata.len(), most });
        }
        let mut bytes = Vec::with_capacity(metadata.len() as usize);
        file.take(most + 1).read_to_end(&mut bytes)?;
        match bytes.len() as u64 {
            length if length > most => Err(Fault::TooLarge { bytes: length, most }),
            _ => Ok(bytes),
        }
    };
    read().map_err(At::path(&path))
}

fn max_bytes(name: &str) -> u64 {
    if [VEHICLE_FILE, EFFECTS_FILE, SPEC_FILE, SUMS_FILE].contains(&name) {
        MAX_TEXT_BYTES
    } else {
        MAX_BINARY_BYTES
    }
}
