//! Reading bundles from disk: at the start, and again when an administrator asks.

mod jobs;

pub use jobs::{Job, Jobs};

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::engine::Engine;
use crate::metrics::Metrics;
use wade_core::bundle::{self, BundleError, Fault, Kept, Library, LibraryError};
use wade_core::model::kernel::Isa;
use wade_core::physics::Physics;
use wade_core::served::ServedVehicle;
use wade_wire::UnknownVehicle;

/// Where the log says who administered what: each line of it is written.
pub const AUDIT: &str = "wade::audit";

/// No bundle to serve.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The vehicles are not to be had, or one of them is not sound.
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// No vehicle can be served.
    #[error("no vehicle has weights ({origin}): train one first, or name another folder with --vehicles")]
    Empty {
        /// Where they are from.
        origin: String,
    },
}

/// What became of one vehicle when its bundle was read again.
#[derive(Debug)]
pub struct Reload {
    /// The vehicle.
    pub vehicle: String,
    /// The version served from now on; 0 where a new vehicle was refused.
    pub served_version: u32,
    /// Why the bundle on disk is not the one served.
    pub refusal: Option<LibraryError>,
    /// True where it was left alone, because it is read from another folder.
    pub elsewhere: bool,
}

/// Knows where the bundles are.
pub struct Reloader {
    /// The folder that was named.
    named: Option<PathBuf>,
    isa: Isa,
    /// How much of the physical base answers where a query does not state it.
    physics: Physics,
    engine: Arc<Engine>,
    metrics: Arc<Metrics>,
    /// Two reloads at once could put the older bundle last.
    one_at_a_time: Mutex<()>,
    /// Hears of each vehicle that was loaded or unloaded.
    follower: OnceLock<Follower>,
}

/// What [`Reloader::follow`] takes.
type Follower = Box<dyn Fn(&str) + Send + Sync>;

impl std::fmt::Debug for Reloader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Reloader").field("named", &self.named).finish_non_exhaustive()
    }
}

impl Reloader {
    /// Reads bundles into this engine: of the folder that is named, or of the first that exists of the usual ones.
    pub fn new(
        named: Option<PathBuf>,
        isa: Isa,
        physics: Physics,
        engine: Arc<Engine>,
        metrics: Arc<Metrics>,
    ) -> Self {
        let (one_at_a_time, follower) = (Mutex::new(()), OnceLock::new());
        Self { named, isa, physics, engine, metrics, one_at_a_time, follower }
    }

    fn read(&self, library: &Library, vehicle: &str) -> Result<ServedVehicle, LibraryError> {
        Ok(library.served(vehicle, self.isa)?.with_physics(self.physics))
    }

    /// The versions of a vehicle on disk: the one in place, and the others.
    pub fn versions(&self, vehicle: &str) -> Result<(Kept, Vec<Kept>), LibraryError> {
        Library::open(self.named.as_deref())?.versions(vehicle)
    }

    /// One of them, to be looked at beside the one that is served.
    pub fn version(&self, vehicle: &str, version: u32) -> Result<ServedVehicle, LibraryError> {
        let library = Library::open(self.named.as_deref())?;
        Ok(library.served_version(vehicle, version, self.isa)?.with_physics(self.physics))
    }

    /// Reads every bundle of the folder; one that is not sound stops the start, one without weights is left out.
    pub fn load_all(&self) -> Result<(), LoadError> {
        let library = Library::open(self.named.as_deref())?;
        let mut vehicles = Vec::new();
        for name in library.names()? {
            match self.read(&library, &name) {
                Ok(vehicle) => vehicles.push(vehicle),
                Err(LibraryError::Bundle(BundleError { fault: Fault::NoWeights, .. })) => {
                    tracing::warn!(
                        vehicle = name,
                        "not served: it has neither weights nor radiation.safetensors"
                    );
                }
                Err(error) => return Err(error.into()),
            }
        }
        if vehicles.is_empty() {
            return Err(LoadError::Empty { origin: library.origin() });
        }
        for vehicle in vehicles {
            announce(&vehicle, &self.metrics);
            self.engine.swap(vehicle);
        }
        Ok(())
    }

    /// Reads one vehicle's bundle again, or all where the name is empty, and swaps in what is sound. What is not
    /// leaves the version before it in service.
    pub fn reload(&self, vehicle: &str) -> Result<Vec<Reload>, UnknownVehicle> {
        let _guard = self.one_at_a_time.lock().unwrap_or_else(PoisonError::into_inner);
        // a folder that cannot be listed refuses each vehicle below, by name
        let mut names = self.names();
        if !vehicle.is_empty() {
            names.retain(|name| name == vehicle);
            if names.is_empty() {
                self.engine.vehicle(vehicle)?;
            }
        }
        Ok(names.into_iter().map(|name| self.reload_one(name)).collect())
    }

    /// Reads one vehicle's bundle again where this is the folder that it is read from, and leaves it alone otherwise.
    pub fn reload_from(&self, vehicle: &str, bundle: &Path) -> Result<Vec<Reload>, UnknownVehicle> {
        let ours = Library::open(self.named.as_deref()).ok().and_then(|library| library.place(vehicle));
        // both may be reached through links
        if ours.is_some_and(|ours| bundle::canonical(&ours) == bundle::canonical(bundle)) {
            return self.reload(vehicle);
        }
        let served_version = self.engine.vehicle(vehicle).map_or(0, |served| served.model().version());
        Ok(vec![Reload { vehicle: vehicle.to_owned(), served_version, refusal: None, elsewhere: true }])
    }

    /// Serves a vehicle no more, until it is loaded again.
    pub fn unload(&self, vehicle: &str) -> Result<(), UnknownVehicle> {
        let _guard = self.one_at_a_time.lock().unwrap_or_else(PoisonError::into_inner);
        self.engine.remove(vehicle)?;
        self.metrics.forget_bundle_version(vehicle);
        tracing::info!(vehicle, "bundle unloaded");
        self.pass_on(vehicle);
        Ok(())
    }

    /// Calls this with the name of each vehicle that is loaded or unloaded from now on, before the reload returns. There is one
    /// follower; a second call changes nothing.
    pub fn follow(&self, follower: impl Fn(&str) + Send + Sync + 'static) {
        let _ = self.follower.set(Box::new(follower));
    }

    fn pass_on(&self, vehicle: &str) {
        if let Some(follower) = self.follower.get() {
            follower(vehicle);
        }
    }

    /// The vehicles that are served and those in the folder.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = self.engine.vehicles().keys().cloned().collect();
        names.extend(
            Library::open(self.named.as_deref()).and_then(|library| library.names()).unwrap_or_default(),
        );
        names.sort();
        names.dedup();
        names
    }

    fn reload_one(&self, vehicle: String) -> Reload {
        // a folder may have been made since
        let library = Library::open(self.named.as_deref());
        let loaded = library.and_then(|library| self.read(&library, &vehicle));
        self.metrics.count_reload(loaded.is_ok());
        match loaded {
            Ok(served) => {
                announce(&served, &self.metrics);
                let served_version = served.model().version();
                self.engine.swap(served);
                self.pass_on(&vehicle);
                Reload { vehicle, served_version, refusal: None, elsewhere: false }
            }
            Err(refusal) => {
                tracing::warn!(vehicle, %refusal, "bundle refused; the version before it stays");
                let served_version =
                    self.engine.vehicle(&vehicle).map_or(0, |served| served.model().version());
                Reload { vehicle, served_version, refusal: Some(refusal), elsewhere: false }
            }
        }
    }
}

fn announce(served: &ServedVehicle, metrics: &Metrics) {
    let model = served.model();
    let effects = served.effects().map_or(0, |file| file.effects.len());
    let vehicle = &model.vehicle().name;
    metrics.set_bundle_version(vehicle, model.version());
    let kernel = model.isa().map_or("none", Isa::name);
    let (version, origin) = (model.version(), served.origin());
    tracing::info!(vehicle, version, origin, effects, "bundle loaded");
    tracing::debug!(vehicle, version, kernel, provenance = model.provenance(), "weights");
}
