//! The box of states in which effects were seen, and what happens outside it.
//!
//! A force that grows with the square of a speed must not be carried to speeds that nobody tried: above the box, a state is
//! moved to its edge before an effect sees it, and the answer says so. Below the box nothing is moved, since every effect
//! fades out there by its own formula; density is not moved either, since every load is linear in it.

use serde::{Deserialize, Serialize};

use crate::condition::{Condition, LEAST_UPRIGHT};

crate::named_enum! {
    /// A quantity of the box. The discriminants are the wire's.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[repr(u32)]
    pub enum BoxQuantity {
        /// Water depth [m].
        Depth = 1 => "depth_m",
        /// Speed through the water [m/s].
        Speed = 2 => "speed_mps",
        /// Acceleration [m/s2].
        Acceleration = 3 => "acceleration_mps2",
        /// Angular speed [rad/s].
        AngularSpeed = 4 => "angular_speed_radps",
        /// Density [kg/m3].
        Density = 5 => "density_kgpm3",
    }
}

impl BoxQuantity {
    /// Its value in a state.
    pub fn of(self, condition: &Condition) -> f64 {
        match self {
            Self::Depth => condition.depth,
            Self::Speed => condition.velocity.norm(),
            Self::Acceleration => condition.acceleration.norm(),
            Self::AngularSpeed => condition.angular_velocity.norm(),
            Self::Density => condition.density,
        }
    }
}

/// Ranges of the state: least and largest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Validity {
    /// Water depth [m].
    pub depth_m: [f64; 2],
    /// Speed through the water [m/s].
    pub speed_mps: [f64; 2],
    /// Acceleration [m/s2].
    pub acceleration_mps2: [f64; 2],
    /// Angular speed [rad/s].
    pub angular_speed_radps: [f64; 2],
    /// Density [kg/m3].
    pub density_kgpm3: [f64; 2],
}

/// How far a state lies outside the box by [`BoxQuantity`]: negative below, positive above, 0 within.
pub type OutsideBox = [f64; BoxQuantity::ALL.len()];

impl Validity {
    /// The range of a quantity.
    pub fn range(&self, quantity: BoxQuantity) -> [f64; 2] {
        match quantity {
            BoxQuantity::Depth => self.depth_m,
            BoxQuantity::Speed => self.speed_mps,
            BoxQuantity::Acceleration => self.acceleration_mps2,
            BoxQuantity::AngularSpeed => self.angular_speed_radps,
            BoxQuantity::Density => self.density_kgpm3,
        }
    }

    /// The first range that is none.
    pub(super) fn bad_range(&self) -> Option<&'static str> {
        let sound = |[low, high]: [f64; 2]| low.is_finite() && high.is_finite() && low <= high;
        BoxQuantity::ALL.into_iter().find(|&quantity| !sound(self.range(quantity))).map(BoxQuantity::name)
    }

    /// How far a state lies outside. A bound carries a tolerance of 1e-6 of itself, for what went through single precision.
    pub fn outside(&self, condition: &Condition) -> OutsideBox {
        BoxQuantity::ALL.map(|quantity| {
            let [low, high] = self.range(quantity);
            let slack = 1e-6 * low.abs().max(high.abs());
            let value = quantity.of(condition);
            if value < low - slack {
                value - low
            } else if value > high + slack {
                value - high
            } else {
                0.0
            }
        })
    }

    /// The state at the edge of the box, where it lies above it.
    pub(super) fn clamped(&self, condition: &Condition) -> Condition {
        let share = |quantity: BoxQuantity| {
            let (value, [_, high]) = (quantity.of(condition), self.range(quantity));
            if value > high { high.max(0.0) / value } else { 1.0 }
        };
        let speed = share(BoxQuantity::Speed);
        let depth = condition.depth.min(self.depth_m[1]);
        // the water level that belongs to the depth, as in `Condition::resolved`
        let lowered = (condition.depth - depth) * condition.up.z.max(LEAST_UPRIGHT);
        Condition {
            velocity: condition.velocity * speed,
            ground_velocity: condition.ground_velocity * speed,
            angular_velocity: condition.angular_velocity * share(BoxQuantity::AngularSpeed),
            acceleration: condition.acceleration * share(BoxQuantity::Acceleration),
            depth,
            water_level: condition.water_level.map(|level| level - lowered),
            ..*condition
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vec3;

    fn validity() -> Validity {
        Validity {
            depth_m: [0.1, 0.2],
            speed_mps: [0.2, 1.0],
            acceleration_mps2: [0.0, 0.5],
            angular_speed_radps: [0.0, 0.3],
            density_kgpm3: [1000.0, 1000.0],
        }
    }

    #[test]
    fn above_the_box_a_state_is_moved_to_its_edge_and_below_it_stays() {
        let fast = Condition {
            acceleration: Vec3::new(0.0, 0.0, -2.0),
            ..Condition::level(Vec3::new(3.0, 4.0, 0.0), 0.3)
        };
        let moved = validity().clamped(&fast);
        assert!((moved.velocity - Vec3::new(0.6, 0.8, 0.0)).norm() < 1e-12);
        assert_eq!((moved.acceleration, moved.depth), (Vec3::new(0.0, 0.0, -0.5), 0.2));
        assert_eq!(validity().outside(&fast)[..3], [0.3 - 0.2, 4.0, 1.5]);
        let slow = Condition::level(Vec3::new(0.1, 0.0, 0.0), 0.05);
        assert_eq!(validity().clamped(&slow), slow);
        // by level as by depth, and a level within the box stays to the last bit
        let (z0, up) = (-0.1, crate::frame::up_from_roll_pitch(0.2, -0.3));
        let by_level = |level: f64| Condition { water_level: Some(level), up, ..fast }.resolved(z0);
        let moved = validity().clamped(&by_level(0.2));
        assert!((moved.water_plane(z0).offset - (z0 + 0.2) * up.z).abs() < 1e-12 && moved.depth == 0.2);
        assert_eq!(validity().clamped(&by_level(0.01)).water_level, Some(0.01));
        assert_eq!(validity().outside(&slow)[..2], [0.05 - 0.1, 0.1 - 0.2]);
    }
}
