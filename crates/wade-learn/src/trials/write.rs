//! A folder of trials from columns.

use std::fs;
use std::path::Path;

use super::TrialError;
use super::manifest::{MANIFEST_FILE, Manifest};
use super::table::csv_text;
use super::trial::{DEPTH, REQUIRED, WATER_LEVEL};
use wade_core::at::At;

/// Name of a trial and its columns, of equal length, by name.
pub type Columns = (String, Vec<(&'static str, Vec<f64>)>);

/// Writes a folder, which is made; columns that a trial must have and that are not given are 0, and
/// so is the depth where there is no water level.
pub fn write(folder: &Path, manifest: &Manifest, trials: &[Columns]) -> Result<(), TrialError> {
    let put = |path: &Path, text: String| fs::write(path, text).map_err(|error| At::path(path)(error.into()));
    fs::create_dir_all(folder).map_err(|error| At::path(folder)(error.into()))?;
    put(&folder.join(MANIFEST_FILE), manifest.to_toml())?;
    for (name, columns) in trials {
        let still = vec![0.0; columns.first().map_or(0, |(_, values)| values.len())];
        let mut all: Vec<(&str, &[f64])> =
            columns.iter().map(|(name, values)| (*name, values.as_slice())).collect();
        let has = |wanted: &str| columns.iter().any(|(name, _)| *name == wanted);
        let depth = Some(DEPTH).filter(|_| !has(WATER_LEVEL));
        let absent = REQUIRED.into_iter().chain(depth).filter(|required| !has(required));
        all.extend(absent.map(|name| (name, still.as_slice())));
        put(&folder.join(format!("{name}.csv")), csv_text(&all))?;
    }
    Ok(())
}
