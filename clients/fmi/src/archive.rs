//! A unit as a file.

use std::io::{Seek, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use wade_client::Address;
use wade_core::bundle::{self, Bundle, BundleError};
use wade_core::model::Model;
use zip::ZipWriter;
use zip::result::ZipError;
use zip::write::SimpleFileOptions;

use crate::description::{self, IDENTIFIER};
use crate::settings::{self, Settings};

/// File name of the library that a simulator loads.
pub const LIBRARY: &str = "libwade_fmu.so";

/// Folder of the binaries of this platform, as the standard names it.
#[cfg(target_arch = "aarch64")]
const PLATFORM: &str = "aarch64-linux";
#[cfg(not(target_arch = "aarch64"))]
const PLATFORM: &str = "x86_64-linux";

/// What a unit is of.
#[derive(Debug)]
pub struct Fmu<'a> {
    /// The vehicle's bundle.
    pub bundle: &'a Bundle,
    /// Its model.
    pub model: &'a Model,
    /// Digest of the bundle.
    pub digest: &'a str,
    /// The server that answers; none where the unit carries the bundle.
    pub address: Option<&'a Address>,
    /// Whether there are outputs for the load of each surface.
    pub surface_loads: bool,
}

/// Why there is no unit.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum FmuError {
    #[error("{path}: {error}")]
    Io { path: PathBuf, error: std::io::Error },
    #[error(transparent)]
    Bundle(#[from] BundleError),
    #[error("the archive: {0}")]
    Zip(#[from] ZipError),
}

/// Writes a unit with the library that lies at a path.
pub fn write(fmu: &Fmu<'_>, library: &Path, out: impl Write + Seek) -> Result<(), FmuError> {
    let Fmu { bundle, model, digest, address, surface_loads } = *fmu;
    let settings = Settings::new(model, address, surface_loads);
    let text = toml::to_string(&settings).unwrap_or_default();
    let token = Sha256::digest(format!("{IDENTIFIER} {digest}\n{text}"));
    let token: String = token.iter().map(|byte| format!("{byte:02x}")).collect();
    let mut archive = ZipWriter::new(out);
    let mut put = |name: &str, bytes: &[u8]| -> Result<(), FmuError> {
        archive.start_file(name, SimpleFileOptions::default())?;
        archive.write_all(bytes).map_err(ZipError::from)?;
        Ok(())
    };
    put("modelDescription.xml", description::xml(&settings, model, &token).as_bytes())?;
    put("documentation/index.html", description::page(&settings, model).as_bytes())?;
    put("extra/org.wade/credibility.json", description::credibility(model, digest).as_bytes())?;
    put(&format!("resources/{}", settings::FILE), text.as_bytes())?;
    if address.is_none() {
        let staged = tempfile::tempdir().map_err(at(Path::new("a temporary folder")))?;
        let folder = staged.path().join(&settings.vehicle);
        bundle::write(&folder, bundle)?;
        let mut files: Vec<PathBuf> =
            std::fs::read_dir(&folder).map_err(at(&folder))?.flatten().map(|entry| entry.path()).collect();
        files.sort();
        for file in files {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            let place = format!("resources/{}/{}/{name}", settings::BUNDLES, settings.vehicle);
            put(&place, &std::fs::read(&file).map_err(at(&file))?)?;
        }
    }
    let bytes = std::fs::read(library).map_err(at(library))?;
    put(&format!("binaries/{PLATFORM}/{IDENTIFIER}.so"), &bytes)?;
    archive.finish()?;
    Ok(())
}

fn at(path: &Path) -> impl FnOnce(std::io::Error) -> FmuError {
    let path = path.to_owned();
    move |error| FmuError::Io { path, error }
}
