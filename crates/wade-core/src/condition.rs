//! The state of a vehicle in water: what a query asks about, a CFD case prescribes, a trial measures.

use nalgebra::UnitVector3;

use crate::frame::{Vec3, WaterPlane};

/// Density of fresh water [kg/m3].
pub const FRESH_WATER: f64 = 1000.0;

/// Whether water reaches under the contact patches of the tires.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum GroundContact {
    /// Full Archimedes: water reaches under a treaded tire on rough ground.
    #[default]
    Wetted,
    /// No water pressure under the contact patches, as for a tire pressed on a smooth bed.
    Dry,
}

/// One state. All vectors in the body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// Velocity through the water [m/s].
    pub velocity: Vec3,
    /// Velocity over ground [m/s]; differs from `velocity` by the current.
    pub ground_velocity: Vec3,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vec3,
    /// Acceleration of the body origin [m/s2].
    pub acceleration: Vec3,
    /// Angular acceleration [rad/s2].
    pub angular_acceleration: Vec3,
    /// Undisturbed water surface above the ground-contact plane at the body origin [m].
    pub depth: f64,
    /// Fluid density [kg/m3].
    pub density: f64,
    /// World up in the body frame.
    pub up: UnitVector3<f64>,
    /// Whether water reaches under the tires.
    pub ground_contact: GroundContact,
}

impl Condition {
    /// A level vehicle that moves with `velocity` through still fresh water of `depth`.
    pub fn level(velocity: Vec3, depth: f64) -> Self {
        Self {
            velocity,
            ground_velocity: velocity,
            angular_velocity: Vec3::zeros(),
            acceleration: Vec3::zeros(),
            angular_acceleration: Vec3::zeros(),
            depth,
            density: FRESH_WATER,
            up: Vec3::z_axis(),
            ground_contact: GroundContact::Wetted,
        }
    }

    /// The water surface in the body frame of a vehicle whose ground-contact plane is at `z0`.
    pub fn water_plane(&self, z0: f64) -> WaterPlane {
        WaterPlane::new(z0, self.depth, self.up)
    }
}
