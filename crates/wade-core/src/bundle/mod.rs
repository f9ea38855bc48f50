//! A vehicle bundle on disk: reading with every check, writing as one atomic step.
//!
//! | file | holds |
//! | --- | --- |
//! | `vehicle.toml` | name, version, reference lengths, mass, surfaces, contact patches, training domain, provenance |
//! | `hull.stl` | the watertight hull in the body frame, binary STL |
//! | `patches.safetensors` | `face_surface` u16 `[faces]` |
//! | `sdf.safetensors` | `distance` i16 `[nx, ny, nz]` in steps given, with origin and spacing, in the metadata; only with `wade vehicle build --sdf` |
//! | `submergence.safetensors` | `points`, `normals` f32 `[n, 3]` by rising z within a surface, `offsets` u32 `[K + 1]` |
//! | `radiation.safetensors` | added mass and waves over displaced volume, see `physics::radiation`: with it the bundle has the physical base; may be absent |
//! | `network.safetensors` | weights and statistics; absent until the vehicle is trained |
//! | `effects.toml` | the effects that are switched on, see `effects`; may be absent |
//! | `spec.toml` | the vehicle file that the bundle was built from, for the record; may be absent |
//! | `SHA256SUMS` | checksums of all of these, in the form of `sha256sum` |

mod carried;
mod checksums;
mod fault;
mod history;
mod library;
mod lock;
mod place;
mod source;
mod tensors;
mod vehicle_file;

pub use fault::Fault;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::at::At;
use crate::digest::sha256;
use crate::domain::Domain;
use crate::effects::{EffectsFile, EffectsFileError};
use crate::geometry::distance::SignedDistanceGrid;
use crate::geometry::stl::{read_stl, write_stl};
use crate::geometry::submergence::Samples;
use crate::geometry::surfaces::Hull;
use crate::model::kernel::Isa;
use crate::model::{Model, PHYSICS, Weights};
use crate::physics::{Base, Radiation};
use crate::served::ServedVehicle;
use crate::vehicle::Vehicle;
use vehicle_file::VehicleFile;

pub use carried::Carried;
pub use history::{Kept, apply, kept, roll_back, succeed, succeed_together};
pub use library::{Library, LibraryError, canonical};
pub use source::Source;
pub use tensors::TensorError;

/// The file that makes a folder a bundle.
pub const VEHICLE_FILE: &str = "vehicle.toml";
const HULL_FILE: &str = "hull.stl";
const PATCHES_FILE: &str = "patches.safetensors";
const SDF_FILE: &str = "sdf.safetensors";
const SUBMERGENCE_FILE: &str = "submergence.safetensors";
const RADIATION_FILE: &str = "radiation.safetensors";
const NETWORK_FILE: &str = "network.safetensors";
const EFFECTS_FILE: &str = "effects.toml";
const SPEC_FILE: &str = "spec.toml";
const SUMS_FILE: &str = "SHA256SUMS";
const FILES: [&str; 10] = [
    VEHICLE_FILE,
    HULL_FILE,
    PATCHES_FILE,
    SDF_FILE,
    SUBMERGENCE_FILE,
    RADIATION_FILE,
    NETWORK_FILE,
    EFFECTS_FILE,
    SPEC_FILE,
    SUMS_FILE,
];
/// Files that a bundle may do without.
const OPTIONAL: [&str; 5] = [SDF_FILE, RADIATION_FILE, NETWORK_FILE, EFFECTS_FILE, SPEC_FILE];

/// Format of the bundles that this program writes, and the newest that it reads.
pub const FORMAT: u32 = 1;

/// Everything in a bundle.
#[derive(Debug, Clone)]
pub struct Bundle {
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Version, raised with every change.
    pub version: u32,
    /// The weights and the domain in which they were learnt; none until the vehicle is trained.
    pub trained: Option<(Weights, Domain)>,
    /// Added mass and waves; none of a bundle from before there was a physical base.
    pub radiation: Option<Radiation>,
    /// Signed distance to the hull, where the bundle was built with it: nothing that is served needs it.
    pub distance: Option<SignedDistanceGrid>,
    /// The effects that are switched on; only with the weights that they were fitted to.
    pub effects: Option<EffectsFile>,
    /// The vehicle file that it was built from.
    pub spec: Option<String>,
}

/// Why a bundle was refused. The message names the file and what is wrong with it.
pub type BundleError = At<Fault>;

/// The files of a bundle in memory, their checksums verified.
struct Files {
    /// The folder, or what stands for it in errors.
    directory: PathBuf,
    files: BTreeMap<&'static str, Vec<u8>>,
}

impl Files {
    /// Reads and verifies every file; the vehicle file first, since a newer format may well have other files.
    fn read(source: &Source) -> Result<(Self, VehicleFile), BundleError> {
        let directory = source.path();
        let _lock = lock::shared(&directory);
        let path = directory.join(VEHICLE_FILE);
        let bytes = source.file(VEHICLE_FILE)?;
        let vehicle_file = VehicleFile::parse(&bytes, &directory).map_err(At::path(&path))?;
        let sums_path = directory.join(SUMS_FILE);
        let sums = checksums::parse(&source.file(SUMS_FILE)?).map_err(At::path(&sums_path))?;
        let mut files = BTreeMap::from([(VEHICLE_FILE, bytes)]);
        for name in FILES.into_iter().filter(|name| ![VEHICLE_FILE, SUMS_FILE].contains(name)) {
            if OPTIONAL.contains(&name) && !source.has(name) && !sums.contains_key(name) {
                continue;
            }
            files.insert(name, source.file(name)?);
        }
        for (name, bytes) in &files {
            checksums::verify(&sums, name, bytes).map_err(At::path(&directory.join(name)))?;
        }
        Ok((Self { directory, files }, vehicle_file))
    }

    /// Parses one file, with the path in the error.
    fn parse<T, E: Into<Fault>>(
        &self,
        name: &'static str,
        parse: impl FnOnce(&[u8]) -> Result<T, E>,
    ) -> Result<T, BundleError> {
        let bytes = self.files.get(name).map(Vec::as_slice).unwrap_or_default();
        parse(bytes).map_err(|error| At::path(&self.directory.join(name))(error.into()))
    }

    fn vehicle(&self, file: &VehicleFile) -> Result<Vehicle, BundleError> {
        let mesh = self.parse(HULL_FILE, read_stl)?;
        let face_surface = self.parse(PATCHES_FILE, tensors::read_patches)?;
        let samples = self.parse(SUBMERGENCE_FILE, |bytes| {
            let parts = tensors::read_samples(bytes)?;
            Ok::<_, Fault>(Samples::from_parts(&parts.points, &parts.normals, &parts.offsets)?)
        })?;
        self.parse(VEHICLE_FILE, |_| {
            let vehicle = file.vehicle(Hull { mesh, face_surface }, samples)?;
            vehicle.validate()?;
            Ok::<_, Fault>(vehicle)
        })
    }

    fn bundle(
        &self,
        vehicle_file: &VehicleFile,
        trained: Option<(Weights, Domain)>,
    ) -> Result<Bundle, BundleError> {
        let vehicle = self.vehicle(vehicle_file)?;
        Ok(Bundle {
            effects: self.effects(&vehicle.name, trained.as_ref().map(|(weights, _)| weights))?,
            vehicle,
            version: vehicle_file.version,
            trained,
            radiation: self.radiation()?,
            distance: self.distance()?,
            spec: self.files.get(SPEC_FILE).map(|bytes| String::from_utf8_lossy(bytes).into_owned()),
        })
    }

    fn radiation(&self) -> Result<Option<Radiation>, BundleError> {
        if !self.files.contains_key(RADIATION_FILE) {
            return Ok(None);
        }
        self.parse(RADIATION_FILE, tensors::read_radiation).map(Some)
    }

    fn distance(&self) -> Result<Option<SignedDistanceGrid>, BundleError> {
        if !self.files.contains_key(SDF_FILE) {
            return Ok(None);
        }
        self.parse(SDF_FILE, tensors::read_distance).map(Some)
    }

    fn trained(&self, file: &VehicleFile) -> Result<Option<(Weights, Domain)>, BundleError> {
        if !self.files.contains_key(NETWORK_FILE) {
            return self.parse(VEHICLE_FILE, |_| match file.training()? {
                None => Ok(None),
                Some(_) => Err(Fault::Untrained),
            });
        }
        let weights = self.parse(NETWORK_FILE, tensors::read_weights)?;
        self.parse(VEHICLE_FILE, |_| {
            let (provenance, domain) = file.training()?.ok_or(Fault::Untrained)?;
            if provenance != weights.provenance {
                return Err(Fault::Provenance { weights: weights.provenance, vehicle: provenance });
            }
            Ok(Some((weights, domain)))
        })
    }

    /// The effects, which belong to the weights and to the base under them.
    fn effects(&self, vehicle: &str, weights: Option<&Weights>) -> Result<Option<EffectsFile>, BundleError> {
        if !self.files.contains_key(EFFECTS_FILE) {
            return Ok(None);
        }
        self.parse(EFFECTS_FILE, |bytes| {
            let effects = EffectsFile::parse(bytes, vehicle)?;
            let sum = self.files.get(NETWORK_FILE).map(|bytes| sha256(bytes)).unwrap_or_default();
            if sum != effects.evidence.weights_sha256 {
                return Err(EffectsFileError::OtherWeights);
            }
            let expected = base_of(weights, self.files.contains_key(RADIATION_FILE)).map(str::to_owned);
            let found = effects.evidence.base.clone();
            if found == expected {
                Ok(Some(effects))
            } else {
                Err(EffectsFileError::OtherBase { found, expected })
            }
        })
    }
}

impl Bundle {
    /// The model that answers for it, without its effects.
    pub fn into_model(self, isa: Isa) -> Result<Model, Fault> {
        assembled(self.vehicle, self.version, (self.trained, self.radiation), isa)
    }
}

fn assembled(
    vehicle: Vehicle,
    version: u32,
    (trained, radiation): (Option<(Weights, Domain)>, Option<Radiation>),
    isa: Isa,
) -> Result<Model, Fault> {
    let base = radiation.map(|radiation| Base::new(&vehicle, radiation));
    match (trained, base) {
        (Some((weights, domain)), Some(base)) if weights.takes_base() => {
            Ok(Model::new(vehicle, version, domain, weights, isa).with_base(base))
        }
        (Some((weights, _)), _) if weights.needs_base() => Err(Fault::NoBase),
        (Some((weights, domain)), _) => Ok(Model::new(vehicle, version, domain, weights, isa)),
        (None, Some(base)) => Ok(Model::of_physics(vehicle, version, base)),
        (None, None) => Err(Fault::NoWeights),
    }
}

/// What effects name as the base under weights; `None` of what came before the physical base.
fn base_of(weights: Option<&Weights>, has_radiation: bool) -> Option<&'static str> {
    (has_radiation && weights.is_none_or(Weights::takes_base)).then_some(PHYSICS)
}

/// Names of the folders that hold a bundle, sorted.
pub fn names_in(directory: &Path) -> std::io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(directory)? {
        let entry = entry?;
        // what is being written, or was when its program was killed, has no vehicle's name
        if entry.path().join(VEHICLE_FILE).is_file()
            && let Ok(name) = entry.file_name().into_string()
            && vehicle_file::check_name(&name, &entry.path()).is_ok()
        {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

/// Reads the model without its effects; a signed distance grid is verified but not unpacked.
pub fn load(directory: &Path, isa: Isa) -> Result<Model, BundleError> {
    Ok(Source::Folder(directory.to_owned()).parts(isa)?.0)
}

/// Reads what serving needs: the model and the effects that were added to it.
pub fn load_served(directory: &Path, isa: Isa) -> Result<ServedVehicle, BundleError> {
    let (model, effects) = Source::Folder(directory.to_owned()).parts(isa)?;
    Ok(ServedVehicle::new(model, effects))
}

impl Source {
    fn parts(&self, isa: Isa) -> Result<(Model, Option<EffectsFile>), BundleError> {
        let (files, vehicle_file) = Files::read(self)?;
        let vehicle = files.vehicle(&vehicle_file)?;
        let trained = files.trained(&vehicle_file)?;
        let radiation = files.radiation()?;
        let effects = files.effects(&vehicle.name, trained.as_ref().map(|(weights, _)| weights))?;
        let version = vehicle_file.version;
        let model =
            assembled(vehicle, version, (trained, radiation), isa).map_err(At::path(&files.directory))?;
        Ok((model, effects))
    }

    fn bundle(&self) -> Result<Bundle, BundleError> {
        let (files, vehicle_file) = Files::read(self)?;
        files.bundle(&vehicle_file, files.trained(&vehicle_file)?)
    }

    fn bundle_without_weights(&self) -> Result<Bundle, BundleError> {
        let (files, vehicle_file) = Files::read(self)?;
        files.bundle(&vehicle_file, None)
    }
}

/// Reads everything.
pub fn read(directory: &Path) -> Result<Bundle, BundleError> {
    Source::Folder(directory.to_owned()).bundle()
}

/// Reads everything but the weights, for work that needs none or brings new ones: those in place may be of an older
/// release, which this one cannot read.
pub fn read_without_weights(directory: &Path) -> Result<Bundle, BundleError> {
    Source::Folder(directory.to_owned()).bundle_without_weights()
}

/// Refuses a place that a bundle of this name may not take: another name's folder, or one with other files in it.
pub fn check_place(directory: &Path, name: &str) -> Result<(), BundleError> {
    let placed = || {
        vehicle_file::check_name(name, directory)?;
        let entries = match fs::read_dir(directory) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
            entries => entries?,
        };
        for entry in entries {
            let file = entry?.file_name();
            if !FILES.iter().any(|known| file == *known) {
                return Err(Fault::ForeignFile { name: file.to_string_lossy().into_owned() });
            }
        }
        Ok(())
    };
    placed().map_err(At::path(directory))
}

/// Writes a bundle beside its place and then puts it there, so that a reader sees the one before or this one. The one
/// before is deleted.
pub fn write(directory: &Path, bundle: &Bundle) -> Result<(), BundleError> {
    lock::exclusively(&[directory], || {
        let staged = stage(directory, bundle)?;
        let placed = place::place(&staged, directory).map_err(|error| At::path(directory)(error.into()));
        // the one before, or what could not be placed
        let _ = fs::remove_dir_all(staged);
        placed
    })
}

/// Writes a bundle beside its place.
fn stage(directory: &Path, bundle: &Bundle) -> Result<PathBuf, BundleError> {
    check_place(directory, &bundle.vehicle.name)?;
    let mut files = BTreeMap::from([
        (VEHICLE_FILE, VehicleFile::new(bundle).to_toml().into_bytes()),
        (HULL_FILE, write_stl(&bundle.vehicle.hull.mesh)),
        (PATCHES_FILE, tensors::write_patches(&bundle.vehicle.hull.face_surface)),
        (SUBMERGENCE_FILE, tensors::write_samples(&bundle.vehicle.samples)),
    ]);
    if let Some(grid) = &bundle.distance {
        files.insert(SDF_FILE, tensors::write_distance(grid));
    }
    if let Some(radiation) = &bundle.radiation {
        files.insert(RADIATION_FILE, tensors::write_radiation(radiation));
    }
    if let Some((weights, _)) = &bundle.trained {
        files.insert(NETWORK_FILE, tensors::write_weights(weights));
    }
    if let Some(effects) = &bundle.effects {
        files.insert(EFFECTS_FILE, effects.to_toml().into_bytes());
        // nothing is written that would be refused when it is read
        let weights = bundle.trained.as_ref().map(|(weights, _)| weights);
        Files { directory: directory.to_owned(), files: files.clone() }
            .effects(&bundle.vehicle.name, weights)?;
    }
    if let Some(spec) = &bundle.spec {
        files.insert(SPEC_FILE, spec.clone().into_bytes());
    }
    files.insert(SUMS_FILE, checksums::render(&files).into_bytes());
    let staged = staging_of(directory, &bundle.vehicle.name);
    let stage = || {
        let _ = fs::remove_dir_all(&staged);
        fs::create_dir_all(&staged)?;
        files.iter().try_for_each(|(name, bytes)| place::write_synced(&staged.join(name), bytes))?;
        place::sync_folder(&staged)
    };
    stage().map_err(|error| {
        let _ = fs::remove_dir_all(&staged);
        At::path(&staged)(error.into())
    })?;
    Ok(staged)
}

/// A signed distance grid in the form that a bundle holds it in.
pub fn distance_bytes(grid: &SignedDistanceGrid) -> Vec<u8> {
    tensors::write_distance(grid)
}

/// Reads a grid back from [`distance_bytes`].
pub fn distance_of(bytes: &[u8]) -> Result<SignedDistanceGrid, TensorError> {
    tensors::read_distance(bytes)
}

fn staging_of(directory: &Path, name: &str) -> PathBuf {
    directory.with_file_name(format!(".{name}.new"))
}
