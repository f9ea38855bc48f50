//! The vehicles that a command or a server works with: those of one folder, and behind them those that the program carries.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use nix::unistd::{AccessFlags, access};

use super::carried::Carried;
use super::history::{self, Kept};
use super::place::aside_of;
use super::source::Source;
use super::{Bundle, BundleError, Fault, SUMS_FILE, lock, names_in, vehicle_file};
use crate::at::At;
use crate::digest::sha256;
use crate::effects::EffectsFile;
use crate::model::Model;
use crate::model::kernel::Isa;
use crate::served::ServedVehicle;

/// Why the vehicles are not to be had.
#[derive(Debug, thiserror::Error)]
pub enum LibraryError {
    /// A folder that was named is not there.
    #[error(
        "{}: there is no such folder of vehicles: name another (--vehicles, WADE_VEHICLES, or `vehicles` in the settings), or none, which serves those that wade carries",
        .folder.display()
    )]
    Missing {
        /// The folder.
        folder: PathBuf,
    },
    /// Something that is no folder, or one that cannot be read.
    #[error(
        "{}: cannot be read as a folder of vehicles ({source}): mend it, move it away, or name another with --vehicles",
        .folder.display()
    )]
    Unreadable {
        /// The folder.
        folder: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// A write that was cut off.
    #[error(
        "{}: a write was cut off before it took its place; the bundle before it is whole in {}: move it back",
        .bundle.display(), .aside.display()
    )]
    CutOff {
        /// Where the bundle should be.
        bundle: PathBuf,
        /// Where it is.
        aside: PathBuf,
    },
    /// A vehicle that nobody has.
    #[error("there is no vehicle `{name}`; there are {known} ({place})")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
        /// Where was looked.
        place: String,
    },
    /// A bundle.
    #[error(transparent)]
    Bundle(#[from] BundleError),
    /// No folder for a change.
    #[error(
        "a change needs a folder that can be written to, and there is none: {tried}; name one with --vehicles"
    )]
    NowhereToWrite {
        /// What was tried, and why not.
        tried: String,
    },
    /// A folder that would come before the one in use.
    #[error(
        "{} cannot be written to, and {} would hide its {hidden}: copy them there first, or name a folder with --vehicles",
        .folder.display(), .other.display()
    )]
    Hides {
        /// The folder in use.
        folder: PathBuf,
        /// The one that could be written to.
        other: PathBuf,
        /// Vehicles that would be found no more.
        hidden: String,
    },
}

/// The vehicles of one folder, and behind them those that the program carries.
#[derive(Debug, Clone)]
pub struct Library {
    /// The folder in use.
    folder: Option<PathBuf>,
    /// Where a folder may be, in the order in which they are looked for.
    places: Vec<PathBuf>,
}

/// Where vehicles are looked for when no folder is named: the first that exists is used.
fn usual_places() -> Vec<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|value: &OsString| !value.is_empty());
    let home = || set("HOME").map(|home| Path::new(&home).join(".local/share"));
    let data = set("XDG_DATA_HOME").map(PathBuf::from).filter(|path| path.is_absolute()).or_else(home);
    let beside = std::env::current_exe().ok().and_then(|program| Some(program.parent()?.to_owned()));
    let beside = beside.map(|folder| [folder.join("vehicles"), folder.join("../share/wade/vehicles")]);
    data.map(|data| data.join("wade/vehicles")).into_iter().chain(beside.into_iter().flatten()).collect()
}

/// The folder of a bundle without links in its path, whether or not there is a bundle.
pub fn canonical(bundle: &Path) -> PathBuf {
    let folder = || Some(bundle.parent()?.canonicalize().ok()?.join(bundle.file_name()?));
    bundle.canonicalize().ok().or_else(folder).unwrap_or_else(|| bundle.to_owned())
}

/// What a server serves, which knows where it is from.
fn served(source: &Source, isa: Isa) -> Result<ServedVehicle, LibraryError> {
    let (model, effects) = source.parts(isa)?;
    Ok(ServedVehicle::new(model, effects).with_origin(source.origin()))
}

impl Library {
    /// The folder that was named, or the first that exists of the usual places. A folder that is there and cannot be read is
    /// an error, and so is one that was named and is not there.
    pub fn open(named: Option<&Path>) -> Result<Self, LibraryError> {
        let library = Self::open_to_write(named)?;
        match (named, &library.folder) {
            (Some(folder), None) => Err(LibraryError::Missing { folder: folder.to_owned() }),
            _ => Ok(library),
        }
    }

    /// The same for a command that writes bundles: it makes the folder that was named.
    pub fn open_to_write(named: Option<&Path>) -> Result<Self, LibraryError> {
        let places = named.map_or_else(usual_places, |named| vec![named.to_owned()]);
        for place in &places {
            match fs::read_dir(place) {
                Ok(_) => return Ok(Self { folder: Some(place.clone()), places }),
                // what leads nowhere is there all the same
                Err(error) if error.kind() == io::ErrorKind::NotFound && !place.is_symlink() => {}
                Err(source) => return Err(LibraryError::Unreadable { folder: place.clone(), source }),
            }
        }
        Ok(Self { folder: None, places })
    }

    /// For people and logs: the folder in use, or that there is none.
    pub fn origin(&self) -> String {
        let carried = || "carried by the binary".to_owned();
        self.folder.as_ref().map_or_else(carried, |folder| folder.display().to_string())
    }

    /// Names of all vehicles, sorted.
    pub fn names(&self) -> Result<Vec<String>, LibraryError> {
        let mut names: Vec<String> = Carried::all().iter().map(|carried| carried.name.to_owned()).collect();
        if let Some(folder) = &self.folder {
            let unreadable = |source| LibraryError::Unreadable { folder: folder.clone(), source };
            names.extend(names_in(folder).map_err(unreadable)?);
        }
        names.sort();
        names.dedup();
        Ok(names)
    }

    /// Where a vehicle is. Whatever stands under its name in the folder is meant, sound or not.
    pub fn source(&self, name: &str) -> Result<Source, LibraryError> {
        let is_name = vehicle_file::check_name(name, Path::new(name)).is_ok();
        if let Some(folder) = self.folder.as_ref().filter(|_| is_name) {
            let bundle = folder.join(name);
            if bundle.symlink_metadata().is_ok() {
                return Ok(Source::Folder(bundle));
            }
            let aside = aside_of(&bundle);
            // a writer may be at it this moment
            let _lock = aside.exists().then(|| lock::shared(&bundle));
            if aside.exists() && !bundle.exists() {
                return Err(LibraryError::CutOff { bundle, aside });
            }
            if bundle.exists() {
                return Ok(Source::Folder(bundle));
            }
        }
        Carried::find(name).map(Source::Carried).ok_or_else(|| LibraryError::Unknown {
            name: name.to_owned(),
            known: self.names().unwrap_or_default().join(", "),
            place: self.origin(),
        })
    }

    /// Where the bundle of a vehicle is in the folder in use, or would be.
    pub fn place(&self, name: &str) -> Option<PathBuf> {
        let folder = self.folder.as_ref()?;
        vehicle_file::check_name(name, Path::new(name)).is_ok().then(|| folder.join(name))
    }

    /// True where there is a vehicle of this name, sound or not.
    pub fn has(&self, name: &str) -> bool {
        !matches!(self.source(name), Err(LibraryError::Unknown { .. }))
    }

    /// Reads everything of a vehicle.
    pub fn read(&self, name: &str) -> Result<Bundle, LibraryError> {
        Ok(self.source(name)?.bundle()?)
    }

    /// The same but for its weights, see [`super::read_without_weights`].
    pub fn read_without_weights(&self, name: &str) -> Result<Bundle, LibraryError> {
        Ok(self.source(name)?.bundle_without_weights()?)
    }

    /// The model without the effects that were added to it.
    pub fn model(&self, name: &str, isa: Isa) -> Result<Model, LibraryError> {
        Ok(self.source(name)?.parts(isa)?.0)
    }

    /// What a server serves, which knows where it is from.
    pub fn served(&self, name: &str, isa: Isa) -> Result<ServedVehicle, LibraryError> {
        served(&self.source(name)?, isa)
    }

    /// The same of one of its [versions](Library::versions).
    pub fn served_version(&self, name: &str, version: u32, isa: Isa) -> Result<ServedVehicle, LibraryError> {
        let (current, others) = self.versions(name)?;
        let place = current.source.path();
        let found = std::iter::once(current).chain(others).find(|kept| kept.version == version);
        let none = || BundleError { path: place, fault: Fault::NotKept { asked: Some(version) } };
        served(&found.ok_or_else(none)?.source, isa)
    }

    /// The hash of a bundle's own list of hashes.
    pub fn digest(&self, name: &str) -> Result<String, LibraryError> {
        Ok(sha256(&self.source(name)?.file(SUMS_FILE)?))
    }

    /// The folders where changes of these vehicles go, one a name: in the folder in use, or else in the first of the places
    /// that can be written to, which is made.
    pub fn targets(&self, names: &[&str]) -> Result<Vec<PathBuf>, LibraryError> {
        let folder = self.folder_to_write(names)?;
        Ok(names.iter().map(|name| folder.join(name)).collect())
    }

    fn folder_to_write(&self, names: &[&str]) -> Result<PathBuf, LibraryError> {
        let mut tried = Vec::new();
        let writable = |folder: &Path| access(folder, AccessFlags::W_OK | AccessFlags::X_OK);
        // one that is made before the folder in use would hide it
        if let Some(folder) = self.folder.as_ref().filter(|folder| writable(folder).is_ok()) {
            return Ok(folder.clone());
        }
        for place in &self.places {
            let in_use = self.folder.as_ref() == Some(place);
            let made = if in_use { Ok(()) } else { fs::create_dir_all(place) };
            match made.and_then(|()| Ok(writable(place)?)) {
                Ok(()) => {
                    self.check_hidden(place, names)?;
                    return Ok(place.clone());
                }
                Err(error) => tried.push(format!("{} ({error})", place.display())),
            }
        }
        Err(LibraryError::NowhereToWrite { tried: tried.join(", ") })
    }

    /// A folder that is made before the one in use is used from then on.
    fn check_hidden(&self, other: &Path, names: &[&str]) -> Result<(), LibraryError> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let mut hidden = names_in(folder).unwrap_or_default();
        hidden.retain(|name| !names.contains(&name.as_str()));
        if hidden.is_empty() {
            return Ok(());
        }
        let _ = fs::remove_dir(other);
        let (folder, hidden) = (folder.clone(), hidden.join(", "));
        Err(LibraryError::Hides { folder, other: other.to_owned(), hidden })
    }

    /// Puts bundles in the place of those of their names, as [`history::succeed_together`] does. Gives where they are now
    /// and their versions.
    pub fn succeed_together(&self, bundles: Vec<Bundle>) -> Result<Vec<(PathBuf, u32)>, LibraryError> {
        let names: Vec<&str> = bundles.iter().map(|bundle| bundle.vehicle.name.as_str()).collect();
        let targets = self.targets(&names)?;
        let versions = history::succeed_together(targets.iter().cloned().zip(bundles).collect())?;
        Ok(targets.into_iter().zip(versions).collect())
    }

    /// Puts effects in the place of those of a vehicle, as its next version. Gives where it is now and its version.
    pub fn apply(&self, name: &str, effects: EffectsFile) -> Result<(PathBuf, u32), LibraryError> {
        let source = self.source(name)?;
        let with_effects = history::with_effects(source.bundle()?, effects);
        let bundle = with_effects.map_err(At::path(&source.path()))?;
        let mut placed = self.succeed_together(vec![bundle])?;
        Ok(placed.remove(0))
    }

    /// The version of a vehicle that is in place, and all others there are, rising.
    pub fn versions(&self, name: &str) -> Result<(Kept, Vec<Kept>), LibraryError> {
        let source = self.source(name)?;
        let current = Kept::read(source.clone())?;
        let mut others = match &self.folder {
            Some(folder) => history::kept(&folder.join(name))?,
            None => Vec::new(),
        };
        // one that was put back has left its copy among those that were kept
        others.retain(|kept| kept.version != current.version);
        if let (Some(carried), Source::Folder(_)) = (Carried::find(name), &source) {
            let carried = Kept::read(Source::Carried(carried))?;
            if carried.version != current.version && others.iter().all(|kept| kept.version != carried.version)
            {
                others.push(carried);
            }
        }
        others.sort_by_key(|kept| kept.version);
        Ok((current, others))
    }

    /// The version that [`Library::roll_back`] would put in place of the current one: both.
    pub fn roll_back_plan(&self, name: &str, to: Option<u32>) -> Result<(Kept, Kept), LibraryError> {
        let (current, others) = self.versions(name)?;
        let fits = |kept: &&Kept| match to {
            Some(to) => kept.version == to,
            None => kept.version < current.version && !kept.taken_back,
        };
        let found = others.iter().rfind(fits).cloned();
        let none = || BundleError { path: current.source.path(), fault: Fault::NotKept { asked: to } };
        Ok((current.clone(), found.ok_or_else(none)?))
    }

    /// Puts a version in place again, by default the one before that was not taken back: a kept one, or that which the
    /// program carries by taking the bundle before it away. Gives the version that is served now.
    pub fn roll_back(&self, name: &str, to: Option<u32>) -> Result<u32, LibraryError> {
        let (current, target) = self.roll_back_plan(name, to)?;
        match (&target.source, &self.folder) {
            (Source::Carried(_), Some(folder)) => history::withdraw(&folder.join(name), target.version)?,
            (Source::Folder(_), Some(folder)) => {
                history::roll_back(&folder.join(name), Some(target.version))?;
            }
            // nothing is kept without a folder
            (_, None) => {
                let fault = Fault::NotKept { asked: to };
                return Err(BundleError { path: current.source.path(), fault }.into());
            }
        }
        Ok(target.version)
    }
}
