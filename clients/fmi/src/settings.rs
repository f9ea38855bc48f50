//! What a unit knows of itself, as `resources/wade.toml` has it.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use wade_client::Address;
use wade_core::model::Model;

/// Name of the file in the resources.
pub const FILE: &str = "wade.toml";
/// Folder of the bundle in the resources.
pub const BUNDLES: &str = "vehicles";

/// What a unit knows of itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Name of the vehicle.
    pub vehicle: String,
    /// The server that answers; none where a bundle in the resources does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub address: Option<String>,
    /// Names of the surfaces, in the order of the answers.
    pub surfaces: Vec<String>,
    /// Number of wheels and tracks, each of which takes a speed.
    pub wheels: usize,
    /// Whether there are outputs for the load of each surface.
    pub surface_loads: bool,
}

impl Settings {
    /// Of a vehicle that answers by itself, or of one that a server at an address answers for.
    pub fn new(model: &Model, address: Option<&Address>, surface_loads: bool) -> Self {
        let surfaces = model.vehicle().surfaces.iter().map(|surface| surface.name.clone()).collect();
        Self {
            vehicle: model.vehicle().name.clone(),
            address: address.map(ToString::to_string),
            surfaces,
            wheels: model.wheels().len(),
            surface_loads,
        }
    }

    /// Reads them from the resources of a unit.
    pub fn read(resources: &Path) -> Result<Self, String> {
        let path = resources.join(FILE);
        let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        toml::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))
    }

    /// The bundle in the resources.
    pub fn bundle(&self, resources: &Path) -> PathBuf {
        resources.join(BUNDLES).join(&self.vehicle)
    }
}
