//! Versions of a bundle: what new weights or effects replace is kept beside it in `<name>.versions/<version>/<name>`.
//!
//! A version that leaves its place is moved there, so that each can be put back. What was put back keeps its number; the next
//! version that is made gets a number that none had before. A version that was taken back is marked (`taken-back` beside it):
//! going back without a number passes over it.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use super::place::{self, copy_folder, move_folder, sync_folder, write_synced};
use super::source::{Source, read_bounded};
use super::{
    Bundle, BundleError, Fault, NETWORK_FILE, SUMS_FILE, VEHICLE_FILE, VehicleFile, base_of, checksums, lock,
    read, stage, staging_of, tensors,
};
use crate::at::At;
use crate::digest::sha256;
use crate::effects::EffectsFile;

/// Marks a version that was taken back.
const TAKEN_BACK: &str = "taken-back";

/// A version that was kept, or is in its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    /// Its number.
    pub version: u32,
    /// Name of the form of its weights, and where they were learnt from.
    pub weights: Option<(&'static str, String)>,
    /// SHA-256 of the file of its weights.
    pub network_sha256: Option<String>,
    /// Names of the effects that it has switched on.
    pub effects: Vec<&'static str>,
    /// Where it is.
    pub source: Source,
    /// When it was written, in seconds since 1970; unknown of what the program carries.
    pub written_unix_s: Option<i64>,
    /// True where it was taken back.
    pub taken_back: bool,
}

impl Kept {
    /// Reads a version, with every check.
    pub(super) fn read(source: Source) -> Result<Self, BundleError> {
        let Bundle { version, effects, trained, .. } = source.bundle()?;
        let names = |file: EffectsFile| file.effects.iter().map(|effect| effect.effect().name()).collect();
        let sums =
            checksums::parse(&source.file(SUMS_FILE)?).map_err(At::path(&source.path().join(SUMS_FILE)))?;
        let written_unix_s = match &source {
            Source::Carried(_) => None,
            Source::Folder(folder) => fs::metadata(folder.join(SUMS_FILE)).ok().map(|file| file.mtime()),
        };
        Ok(Self {
            version,
            weights: trained.map(|(weights, _)| (weights.form.name(), weights.provenance)),
            network_sha256: sums.get(NETWORK_FILE).cloned(),
            effects: effects.map(names).unwrap_or_default(),
            source,
            written_unix_s,
            taken_back: false,
        })
    }
}

fn versions_of(directory: &Path) -> PathBuf {
    let name = directory.file_name().unwrap_or_default().to_string_lossy();
    directory.with_file_name(format!("{name}.versions"))
}

pub(super) fn place_of(directory: &Path, version: u32) -> PathBuf {
    versions_of(directory).join(version.to_string()).join(directory.file_name().unwrap_or_default())
}

fn mark_of(directory: &Path, version: u32) -> PathBuf {
    versions_of(directory).join(version.to_string()).join(TAKEN_BACK)
}

/// Numbers of the versions that were kept, rising.
pub(super) fn numbers(directory: &Path) -> Result<Vec<u32>, BundleError> {
    let versions = versions_of(directory);
    let entries = match fs::read_dir(&versions) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(|error| At::path(&versions)(error.into()))?,
    };
    let number = |entry: std::io::Result<fs::DirEntry>| entry.ok()?.file_name().to_str()?.parse().ok();
    let mut numbers: Vec<u32> = entries.filter_map(number).collect();
    numbers.sort_unstable();
    Ok(numbers)
}

/// The versions that were kept of the bundle in a folder, rising.
pub fn kept(directory: &Path) -> Result<Vec<Kept>, BundleError> {
    let one = |version: u32| {
        let kept = Kept::read(Source::Folder(place_of(directory, version)))?;
        Ok(Kept { version, taken_back: mark_of(directory, version).exists(), ..kept })
    };
    numbers(directory)?.into_iter().map(one).collect()
}

/// Puts effects in the place of those of a bundle, as its next version, and keeps the version before. Gives the new version.
pub fn apply(directory: &Path, effects: EffectsFile) -> Result<u32, BundleError> {
    let bundle = with_effects(read(directory)?, effects).map_err(At::path(directory))?;
    succeed(directory, bundle)
}

/// The bundle with these effects, fitted to its weights and its base.
pub(super) fn with_effects(bundle: Bundle, mut effects: EffectsFile) -> Result<Bundle, Fault> {
    let weights = bundle.trained.as_ref().map(|(weights, _)| weights);
    if weights.is_none() && bundle.radiation.is_none() {
        return Err(Fault::NoWeights);
    }
    let evidence = &mut effects.evidence;
    evidence.weights_sha256 =
        weights.map(|weights| sha256(&tensors::write_weights(weights))).unwrap_or_default();
    evidence.base = base_of(weights, bundle.radiation.is_some()).map(str::to_owned);
    Ok(Bundle { effects: Some(effects), ..bundle })
}

/// Puts a bundle in its place, as the next version of the one that is there, if any, and keeps the latter if it could be
/// served. Gives the new version.
///
/// The bundle changes in one step of the file system at the end; an error before it leaves everything as it was.
pub fn succeed(directory: &Path, bundle: Bundle) -> Result<u32, BundleError> {
    // one bundle, one version
    Ok(succeed_together(vec![(directory.to_owned(), Bundle { version: 0, ..bundle })])?[0])
}

/// As [`succeed`], of bundles that belong together: an error with one of them leaves all as they were. Where there is none in
/// place a bundle gets the number after its own `version`. Gives the new versions.
pub fn succeed_together(bundles: Vec<(PathBuf, Bundle)>) -> Result<Vec<u32>, BundleError> {
    // in one order, so that two writers do not wait for each other
    let mut folders: Vec<PathBuf> = bundles.iter().map(|(directory, _)| directory.clone()).collect();
    folders.sort();
    folders.dedup();
    let folders: Vec<&Path> = folders.iter().map(PathBuf::as_path).collect();
    lock::exclusively(&folders, || succeed_locked(bundles))
}

fn succeed_locked(bundles: Vec<(PathBuf, Bundle)>) -> Result<Vec<u32>, BundleError> {
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
        let before = if directory.exists() { version_in(directory)? } else { bundle.version };
        let last = numbers(directory)?.last().copied().unwrap_or(0).max(before);
        let version = last
            .checked_add(1)
            .ok_or(Fault::NoVersion { last })
            .map_err(At::path(&versions_of(directory)))?;
        let staged = stage(directory, &Bundle { version, ..bundle })?;
        let keeps = directory.join(NETWORK_FILE).exists().then_some(before);
        Ok(Self { directory: directory.to_owned(), staged, version, keeps })
    }

    /// Takes the place; what was there and is not kept stands where this was staged.
    fn put(&self) -> Result<(), BundleError> {
        match self.keeps {
            Some(before) => put(&self.staged, &self.directory, before),
            None => place::place(&self.staged, &self.directory)
                .map_err(|error| At::path(&self.directory)(error.into())),
        }
    }

    /// Undoes [`Next::put`], as far as the file system lets.
    fn take_back(&self) {
        let before =
            self.keeps.map_or_else(|| self.staged.clone(), |before| place_of(&self.directory, before));
        if !before.exists() {
            // there was none
            let _ = fs::remove_dir_all(&self.directory);
        } else if place::exchange(&before, &self.directory).is_ok() {
            let _ = fs::remove_dir_all(before);
        }
    }

    /// Also what was in place and is not kept: it could not be served.
    fn drop_staged(&self) {
        let _ = fs::remove_dir_all(&self.staged);
    }
}

/// Puts a kept version in its place again, and keeps the one that is there: by default the newest before it that was not
/// taken back. Gives the version that is in place now.
pub fn roll_back(directory: &Path, to: Option<u32>) -> Result<u32, BundleError> {
    lock::exclusively(&[directory], || roll_back_locked(directory, to))
}

fn roll_back_locked(directory: &Path, to: Option<u32>) -> Result<u32, BundleError> {
    let current = if directory.exists() { Some(version_in(directory)?) } else { None };
    let version =
        choice(directory, current, to)?.ok_or(Fault::NotKept { asked: to }).map_err(At::path(directory))?;
    let kept = place_of(directory, version);
    // what is damaged must not come into service
    let bundle = read(&kept)?;
    if bundle.version != version {
        return Err(At::path(&kept)(Fault::KeptVersion { found: bundle.version }));
    }
    let staged = staging_of(directory, &bundle.vehicle.name);
    let copied = copy_folder(&kept, &staged).map_err(|error| At::path(&staged)(error.into()));
    let placed = copied.and_then(|()| match current {
        Some(current) => put(&staged, directory, current),
        None => place::place(&staged, directory).map_err(|error| At::path(directory)(error.into())),
    });
    placed.inspect_err(|_| drop(fs::remove_dir_all(&staged)))?;
    mark(directory, version)?;
    Ok(version)
}

/// The version that [`roll_back`] would put in place.
pub(super) fn choice(
    directory: &Path,
    current: Option<u32>,
    to: Option<u32>,
) -> Result<Option<u32>, BundleError> {
    let mut kept = numbers(directory)?.into_iter();
    Ok(match to {
        Some(to) => kept.find(|&version| version == to && Some(version) != current),
        None => {
            let before = |version: u32| current.is_some_and(|current| version < current);
            kept.rfind(|&version| before(version) && !mark_of(directory, version).exists())
        }
    })
}

/// Takes the bundle out of its folder, to the versions, so that what stands behind it, version `behind`, is served again.
pub(super) fn withdraw(directory: &Path, behind: u32) -> Result<(), BundleError> {
    lock::exclusively(&[directory], || withdraw_locked(directory, behind))
}

fn withdraw_locked(directory: &Path, behind: u32) -> Result<(), BundleError> {
    let kept = place_of(directory, version_in(directory)?);
    let withdraw = || {
        let _ = fs::remove_dir_all(&kept);
        fs::create_dir_all(kept.parent().unwrap_or(&kept))?;
        move_folder(directory, &kept)?;
        sync_folder(directory.parent().unwrap_or(Path::new("")))
    };
    withdraw().map_err(|error| At::path(&kept)(error.into()))?;
    mark(directory, behind)
}

/// Marks what came after the version that is in place now: it was taken back. That one itself was not.
fn mark(directory: &Path, version: u32) -> Result<(), BundleError> {
    for number in numbers(directory)? {
        let mark = mark_of(directory, number);
        let marked = match number {
            number if number > version => write_synced(&mark, b""),
            number if number == version && mark.exists() => fs::remove_file(&mark),
            _ => Ok(()),
        };
        marked.map_err(|error| At::path(&mark)(error.into()))?;
    }
    Ok(())
}

pub(super) fn version_in(directory: &Path) -> Result<u32, BundleError> {
    let path = directory.join(VEHICLE_FILE);
    Ok(VehicleFile::parse(&read_bounded(directory, VEHICLE_FILE)?, directory)
        .map_err(At::path(&path))?
        .version)
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
        place::exchange(staged, directory)?;
        move_folder(staged, &kept).inspect_err(|_| {
            // back, so that what was in place is there again
            let _ = place::exchange(staged, directory);
        })?;
        Ok(())
    };
    move_all().map_err(|fault| {
        let _ = fs::remove_dir_all(staged);
        // fails of folders that hold something
        kept.ancestors().skip(1).take(2).take_while(|folder| fs::remove_dir(folder).is_ok()).for_each(drop);
        At::path(&kept)(fault)
    })
}
