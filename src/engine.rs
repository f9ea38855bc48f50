//! The vehicles that are being served, and their atomic swap. No async, no IO, no clock.

use std::collections::BTreeMap;
use std::sync::Arc;

use arc_swap::ArcSwap;

use wade_core::served::ServedVehicle;
use wade_wire::UnknownVehicle;

/// Longest name that an error repeats; no bundle's name is longer.
const MAX_NAME: usize = 64;

/// The vehicles by name.
pub type Vehicles = BTreeMap<String, Arc<ServedVehicle>>;

/// Shared by every transport. Serves nothing until something is swapped in.
#[derive(Debug, Default)]
pub struct Engine {
    vehicles: ArcSwap<Vehicles>,
}

impl Engine {
    /// The version of a vehicle that is served now. A request keeps the version it got, whatever is swapped meanwhile.
    pub fn vehicle(&self, name: &str) -> Result<Arc<ServedVehicle>, UnknownVehicle> {
        let vehicles = self.vehicles.load();
        vehicles.get(name).cloned().ok_or_else(|| UnknownVehicle {
            // a name of any length would not fit into the error's headers
            name: name.chars().take(MAX_NAME).collect(),
            served: vehicles.keys().map(String::as_str).collect::<Vec<_>>().join(", "),
        })
    }

    /// Everything that is served now.
    pub fn vehicles(&self) -> Arc<Vehicles> {
        self.vehicles.load_full()
    }

    /// Serves a vehicle from now on in place of the version before it.
    pub fn swap(&self, vehicle: ServedVehicle) {
        let vehicle = Arc::new(vehicle);
        self.vehicles.rcu(|vehicles| {
            let mut vehicles = Vehicles::clone(vehicles);
            vehicles.insert(vehicle.model().vehicle().name.clone(), Arc::clone(&vehicle));
            vehicles
        });
    }

    /// Serves a vehicle no more.
    pub fn remove(&self, name: &str) -> Result<(), UnknownVehicle> {
        self.vehicle(name)?;
        self.vehicles.rcu(|vehicles| {
            let mut vehicles = Vehicles::clone(vehicles);
            vehicles.remove(name);
            vehicles
        });
        Ok(())
    }
}
