//! The state of a vehicle in water: what a query asks about, a CFD case prescribes, a trial measures.

use nalgebra::{UnitVector3, Vector3};

use crate::frame::{Vec3, WaterPlane};
use crate::real::Real;

/// Density of fresh water [kg/m3].
pub const FRESH_WATER: f64 = 1000.0;

/// Component of up along body z below which a state has no depth, only a water level [-].
pub const LEAST_UPRIGHT: f64 = 0.1;

/// Speed through the water below which the bed's share goes to a half [m/s].
const SLOW: f64 = 0.02;

/// The share of the motion through the water that is motion over the bed that a word stands for.
pub fn bed_from_word(word: &str) -> Option<f64> {
    match word {
        "parked" => Some(0.0),
        "driving" => Some(1.0),
        _ => None,
    }
}

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
pub struct Condition<T: Real = f64> {
    /// Velocity through the water [m/s].
    pub velocity: Vector3<T>,
    /// Velocity over ground [m/s]; differs from `velocity` by the current.
    pub ground_velocity: Vector3<T>,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vector3<T>,
    /// Acceleration of the body origin [m/s2].
    pub acceleration: Vector3<T>,
    /// Angular acceleration [rad/s2].
    pub angular_acceleration: Vector3<T>,
    /// Undisturbed water surface above the ground-contact plane at the body origin [m]; negative where it is below. Where
    /// `water_level` is given it decides, and [`Condition::resolved`] puts the depth that belongs to it here.
    pub depth: T,
    /// Signed height of the still-water plane above the body origin along up [m]: `(z0 + depth) up_z`.
    pub water_level: Option<T>,
    /// Distance of the bed below the ground-contact plane [m]; the base assumes one where it is not given.
    pub bed_clearance: Option<T>,
    /// Share of the motion through the water that is motion over the bed, 0 parked to 1 driving; by default that of the
    /// velocities.
    pub stated_bed: Option<T>,
    /// Fluid density [kg/m3].
    pub density: T,
    /// World up in the body frame.
    pub up: UnitVector3<T>,
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
            water_level: None,
            bed_clearance: None,
            stated_bed: None,
            density: FRESH_WATER,
            up: Vec3::z_axis(),
            ground_contact: GroundContact::Wetted,
        }
    }
}

impl<T: Real> Condition<T> {
    /// The water surface in the body frame of a vehicle whose ground-contact plane is at `z0`.
    pub fn water_plane(&self, z0: f64) -> WaterPlane<T> {
        match self.water_level {
            Some(offset) => WaterPlane { normal: self.up, offset },
            None => WaterPlane::new(z0, self.depth, self.up),
        }
    }

    /// The same state with the depth that belongs to its water level. Near its side a vehicle has no depth: there it is that of
    /// the steepest attitude that has one.
    pub fn resolved(&self, z0: f64) -> Self {
        match self.water_level {
            Some(level) => Self { depth: level / self.up.z.max(LEAST_UPRIGHT.into()) - z0, ..*self },
            None => *self,
        }
    }

    /// The state with the part of its motion that weights know, level and without turning, over a bed so far below the
    /// ground-contact plane [m].
    pub fn levelled(&self, bed_clearance: T) -> Self {
        let up = self.up.into_inner();
        let flat = |v: &Vector3<T>| v - up * up.dot(v);
        Self {
            velocity: flat(&self.velocity),
            ground_velocity: flat(&self.ground_velocity),
            angular_velocity: Vector3::zeros(),
            bed_clearance: Some(bed_clearance),
            ..*self
        }
    }

    /// Share of the motion through the water that is motion over the bed: 1 driving through still water, 0 parked in a current.
    /// `b = v_ground . v / v^2` between 0 and 1, and a half at rest, smoothly over the slowest `SLOW`.
    pub fn bed(&self) -> T {
        self.stated_bed.unwrap_or_else(|| {
            let rest = SLOW * SLOW;
            let along = self.ground_velocity.dot(&self.velocity);
            ((along + 0.5 * rest) / (self.velocity.dot(&self.velocity) + rest)).clamp(0.0, 1.0)
        })
    }
}
