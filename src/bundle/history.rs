//! Versions of a bundle: what new weights or effects replace is kept beside it in `<name>.versions/<version>/<name>`.
//!
//! A version that leaves its place is moved there, so that each can be put back, one after the other. What was put back keeps
//! its number; the next version that is made gets a number that none had before.

use std::fs;
use std::path::{Path, PathBuf};

use super::{
    Bundle, BundleError, FILES, Fault, NETWORK_FILE, SUMS_FILE, VEHICLE_FILE, VehicleFile, at, exchange,
    place, read, read_bounded, stage, staging_of, tensors,
};
use crate::effects::EffectsFile;
use crate::files::sha256;

/// A version that was kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    /// Its number.
    pub version: u32,
    /// Name of the form of its weights, and where they were learnt from.
    pub weights: Option<(&'static str, String)>,
    /// Names of the effects that it has switched on.
    pub effects: Vec<&'static str>,
}

fn versions_of(directory: &Path) -> PathBuf {
    let name = directory.file_name().unwrap_or_default().to_string_lossy();
    directory.with_file_name(format!("{name}.versions"))
}

fn place_of(directory: &Path, version: u32) -> PathBuf {
    versions_of(directory).join(version.to_string()).join(directory.file_name().unwrap_or_default())
}

/// Numbers of the versions that were kept, rising.
fn numbers(directory: &Path) -> Result<Vec<u32>, BundleError> {
    let versions = versions_of(directory);
    let entries = match fs::read_dir(&versions) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(|error| at(&versions)(error.into()))?,
    };
    let number = |entry: std::io::Result<fs::DirEntry>| entry.ok()?.file_name().to_str()?.parse().ok();
    let mut numbers: Vec<u32> = entries.filter_map(number).collect();
    numbers.sort_unstable();
    Ok(numbers)
}

/// The versions that were kept of the bundle in a folder, rising.
pub fn kept(directory: &Path) -> Result<Vec<Kept>, BundleError> {
    let one = |version: u32| {
        let Bundle { effects, trained, .. } = read(&place_of(directory, version))?;
        let names = |file: EffectsFile| file.effects.iter().map(|effect| effect.name.name()).collect();
        let weights = trained.map(|(weights, _)| (weights.form.name(), weights.provenance));
        Ok(Kept { version, weights, effects: effects.map(names).unwrap_or_default() })
    };
    numbers(directory)?.into_iter().map(one).collect()
}

/// Puts effects in the place of those of a bundle, as its next version, and keeps the version before. Gives the new version.
pub fn apply(directory: &Path, mut effects: EffectsFile) -> Result<u32, BundleError> {
    let bundle = read(directory)?;
    let Some((weights, _)) = &bundle.trained else { return Err(at(directory)(Fault::NoWeights)) };
    effects.evidence.weights_sha256 = sha256(&tensors::write_weights(weights));
    succeed(directory, Bundle { effects: Some(effects), ..bundle })
}

/// Puts a bundle in its place, as the next version of the one that is there, if any, and keeps the latter if it could be
/// served. Gives the new version.
///
/// The bundle changes in one step of the file system at the end; an error before it leaves everything as it was.
pub fn succeed(directory: &Path, bundle: Bundle) -> Result<u32, BundleError> {
    // one bundle, one version
    Ok(succeed_together(vec![(directory.to_owned(), bundle)])?[0])
}

/// As [`succeed`], of bundles that belong together: an error with one of them leaves all as they were. Gives the new versions.
pub fn succeed_together(bundles: Vec<(PathBuf, Bundle)>) -> Result<Vec<u32>, BundleError> {
    let mut staged: Vec<Next> = Vec::new();
    for (directory, bundle) in bundles {
        let next = Next::stage(&directory, bundle);
        staged.push(next.inspect_err(|_| staged.iter().for_each(Next::drop_staged))?);
    }
    for (index, next) in staged.iter().enumerate() {
        next.put().inspect_err(|_| {
            staged[..index].iter().rev().for_each(Next::take_back);
            staged[index..].iter().for_each(Next::drop_staged);
        })?;
    }
    staged.iter().for_each(Next::drop_staged);
    Ok(staged.iter().map(|next| next.version).collect())
}

/// A version that stands beside its place.
struct Next {
    directory: PathBuf,
    staged: PathBuf,
    version: u32,
    /// Version of the one in place, where that is kept.
    keeps: Option<u32>,
}

impl Next {
    fn stage(directory: &Path, bundle: Bundle) -> Result<Self, BundleError> {
        let before = if directory.exists() { version_in(directory)? } else { 0 };
        let last = numbers(directory)?.last().copied().unwrap_or(0).max(before);
        let version =
            last.checked_add(1).ok_or(Fault::NoVersion { last }).map_err(at(&versions_of(directory)))?;
        let staged = stage(directory, &Bundle { version, ..bundle })?;
        let keeps = directory.join(NETWORK_FILE).exists().then_some(before);
        Ok(Self { directory: directory.to_owned(), staged, version, keeps })
    }

    /// Takes the place; what was there and is not kept stands where this was staged.
    fn put(&self) -> Result<(), BundleError> {
        match self.keeps {
            Some(before) => put(&self.staged, &self.directory, before),
            None => place(&self.staged, &self.directory).map_err(|error| at(&self.directory)(error.into())),
        }
    }

    /// Undoes [`Next::put`], as far as the file system lets.
    fn take_back(&self) {
        let before =
            self.keeps.map_or_else(|| self.staged.clone(), |before| place_of(&self.directory, before));
        if !before.exists() {
            // there was none
            let _ = fs::remove_dir_all(&self.directory);
        } else if exchange(&before, &self.directory).is_ok() {
            let _ = fs::remove_dir_all(before);
        }
    }

    /// Also what was in place and is not kept: it could not be served.
    fn drop_staged(&self) {
        let _ = fs::remove_dir_all(&self.staged);
    }
}

/// Puts a kept version in its place again, by default the one before the version that is there, and keeps the latter.
/// Gives the version that is in place now.
pub fn roll_back(directory: &Path, to: Option<u32>) -> Result<u32, BundleError> {
    let current = version_in(directory)?;
    let kept = numbers(directory)?;
    let found = match to {
        Some(to) => kept.into_iter().find(|&version| version == to && version != current),
        None => kept.into_iter().rfind(|&version| version < current),
    };
    let version = found.ok_or(Fault::NotKept { asked: to }).map_err(at(directory))?;
    let place = place_of(directory, version);
    // what is damaged must not come into service
    let bundle = read(&place)?;
    if bundle.version != version {
        return Err(at(&place)(Fault::KeptVersion { found: bundle.version }));
    }
    let staged = staging_of(directory, &bundle.vehicle.name);
    copy(&place, &staged).map_err(|error| at(&staged)(error.into()))?;
    put(&staged, directory, current)?;
    Ok(version)
}

/// Byte for byte: what goes back is what was there.
fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    let _ = fs::remove_dir_all(to);
    fs::create_dir_all(to)?;
    for name in FILES.into_iter().filter(|name| from.join(name).exists()) {
        fs::copy(from.join(name), to.join(name))?;
    }
    Ok(())
}

fn version_in(directory: &Path) -> Result<u32, BundleError> {
    let path = directory.join(VEHICLE_FILE);
    Ok(VehicleFile::parse(&read_bounded(&path)?, directory).map_err(at(&path))?.version)
}

/// Exchanges a staged bundle with the one in place, and moves the latter, of version `before`, to the others. An error
/// leaves everything as it was.
fn put(staged: &Path, directory: &Path, before: u32) -> Result<(), BundleError> {
    let kept = place_of(directory, before);
    let move_all = || {
        if kept.exists() {
            // a version that was put back has left its copy there
            let sums = |folder: &Path| fs::read(folder.join(SUMS_FILE)).ok();
            if sums(&kept) != sums(directory) {
                return Err(Fault::KeptOther { version: before });
            }
            fs::remove_dir_all(&kept)?;
        }
        fs::create_dir_all(kept.parent().unwrap_or(&kept))?;
        exchange(staged, directory)?;
        fs::rename(staged, &kept).inspect_err(|_| {
            // back, so that what was in place is there again
            let _ = exchange(staged, directory);
        })?;
        Ok(())
    };
    move_all().map_err(|fault| {
        let _ = fs::remove_dir_all(staged);
        at(&kept)(fault)
    })
}
