//! The vehicles that are being served: atomic swap and admission. No async, no IO, no clock.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use arc_swap::ArcSwap;

use crate::served::ServedVehicle;

/// Longest name that an error repeats; no bundle's name is longer.
const MAX_NAME: usize = 64;

/// The vehicles by name.
pub type Vehicles = BTreeMap<String, Arc<ServedVehicle>>;

/// Shared by every transport. Serves nothing until something is swapped in.
#[derive(Debug, Default)]
pub struct Engine {
    vehicles: ArcSwap<Vehicles>,
}

/// No vehicle of this name is served.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no vehicle named \"{name}\" is served; served: {served}")]
pub struct UnknownVehicle {
    /// The name asked for.
    pub name: String,
    /// The names served.
    pub served: String,
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

/// Counts what is in flight and refuses what is over the limit.
#[derive(Debug)]
pub struct Admission {
    in_flight: AtomicUsize,
    limit: usize,
}

/// Too much is in flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{limit} are already in flight, the limit")]
pub struct Overloaded {
    /// The limit.
    pub limit: usize,
}

impl Admission {
    /// Admits at most `limit` at a time.
    pub fn new(limit: usize) -> Arc<Self> {
        Arc::new(Self { in_flight: AtomicUsize::new(0), limit })
    }

    /// A place, given back when the permit is dropped.
    pub fn admit(self: &Arc<Self>) -> Result<Permit, Overloaded> {
        let before = self.in_flight.fetch_add(1, Ordering::Relaxed);
        let permit = Permit(Arc::clone(self));
        if before < self.limit { Ok(permit) } else { Err(Overloaded { limit: self.limit }) }
    }
}

/// A place among those in flight.
#[derive(Debug)]
pub struct Permit(Arc<Admission>);

impl Drop for Permit {
    fn drop(&mut self) {
        self.0.in_flight.fetch_sub(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_takes_no_place_and_a_dropped_permit_gives_its_place_back() {
        let admission = Admission::new(1);
        let first = admission.admit().expect("the first fits");
        assert_eq!(admission.admit().err(), Some(Overloaded { limit: 1 }));
        drop(first);
        assert!(admission.admit().is_ok());
    }
}
