//! The training domain: the ranges within which the weights were learnt.

use serde::{Deserialize, Serialize};

use crate::condition::Condition;

/// Below this speed the flow has no direction, and the flow angle is not judged [m/s].
const DIRECTION_SPEED: f64 = 1e-6;

crate::named_enum! {
    /// A quantity of which the domain states a range. The discriminants are the wire's.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[repr(u8)]
    pub enum Quantity {
        /// Horizontal speed through the water [m/s].
        Speed = 1 => "speed_mps",
        /// Flow angle [rad]: pi/2 head-on or from behind, 0 from the side.
        Angle = 2 => "angle_rad",
        /// Fluid density [kg/m3].
        Density = 3 => "density_kgpm3",
        /// Water depth [m].
        Depth = 4 => "depth_m",
        /// Angle between body z and up [rad].
        Tilt = 5 => "tilt_rad",
        /// Speed along body z [m/s].
        VerticalSpeed = 6 => "vertical_speed_mps",
        /// Magnitude of the angular velocity [rad/s].
        AngularSpeed = 7 => "angular_speed_radps",
        /// Distance to the nearest state that was learnt from, in units of what is usual among these [-].
        Distance = 8 => "distance",
    }
}

impl Quantity {
    /// The name in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Angle => "flow angle",
            Self::Density => "density",
            Self::Depth => "depth",
            Self::Tilt => "tilt",
            Self::VerticalSpeed => "vertical speed",
            Self::AngularSpeed => "angular speed",
            Self::Distance => "distance to the training states",
        }
    }

    /// The unit of its values.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Speed | Self::VerticalSpeed => "m/s",
            Self::Angle | Self::Tilt => "rad",
            Self::Density => "kg/m3",
            Self::Depth => "m",
            Self::AngularSpeed => "rad/s",
            Self::Distance => "times their usual spacing",
        }
    }
}

/// An inclusive range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Smallest value seen in training.
    pub min: f64,
    /// Largest value seen in training.
    pub max: f64,
}

impl Range {
    /// How far a value lies outside: negative below, positive above, 0 within. The bounds carry a tolerance of 1e-6
    /// of themselves, so that a bound that went through single precision is still inside.
    fn excess(self, value: f64) -> f64 {
        let slack = 1e-6 * self.min.abs().max(self.max.abs());
        if value < self.min - slack {
            value - self.min
        } else if value > self.max + slack {
            value - self.max
        } else {
            0.0
        }
    }

    /// True where both ends are finite and in order.
    pub fn is_valid(self) -> bool {
        self.min.is_finite() && self.max.is_finite() && self.min <= self.max
    }
}

/// The training domain of a vehicle's weights.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    /// Horizontal speed [m/s].
    pub speed_mps: Range,
    /// Flow angle from the lateral axis [rad].
    pub angle_rad: Range,
    /// Density [kg/m3].
    pub density_kgpm3: Range,
    /// Depth [m].
    pub depth_m: Range,
    /// Tilt [rad].
    pub tilt_rad: Range,
    /// Vertical speed [m/s].
    pub vertical_speed_mps: Range,
    /// Angular speed [rad/s].
    pub angular_speed_radps: Range,
}

impl Domain {
    /// The states in which the physical base is tested: any attitude and depth, up to 6 m/s and 3 rad/s, water to mud.
    pub const EVERYWHERE: Self = {
        const fn range(min: f64, max: f64) -> Range {
            Range { min, max }
        }
        Self {
            speed_mps: range(0.0, 6.0),
            angle_rad: range(0.0, std::f64::consts::FRAC_PI_2),
            density_kgpm3: range(900.0, 2000.0),
            depth_m: range(-1e3, 1e3),
            tilt_rad: range(0.0, std::f64::consts::PI),
            vertical_speed_mps: range(-6.0, 6.0),
            angular_speed_radps: range(0.0, 3.0),
        }
    };

    /// The range of one quantity; `None` of the distance, which no range describes.
    pub fn range(&self, quantity: Quantity) -> Option<Range> {
        Some(match quantity {
            Quantity::Speed => self.speed_mps,
            Quantity::Angle => self.angle_rad,
            Quantity::Density => self.density_kgpm3,
            Quantity::Depth => self.depth_m,
            Quantity::Tilt => self.tilt_rad,
            Quantity::VerticalSpeed => self.vertical_speed_mps,
            Quantity::AngularSpeed => self.angular_speed_radps,
            Quantity::Distance => return None,
        })
    }

    /// How far each quantity of a state lies outside.
    pub fn outside(&self, condition: &Condition) -> Outside {
        let mut outside = Outside::default();
        for quantity in Quantity::ALL {
            if let (Some(range), Some(value)) = (self.range(quantity), value_of(quantity, condition)) {
                outside.excess[quantity as usize - 1] = range.excess(value);
            }
        }
        outside
    }
}

fn value_of(quantity: Quantity, condition: &Condition) -> Option<f64> {
    let v = &condition.velocity;
    let speed = v.x.hypot(v.y);
    Some(match quantity {
        Quantity::Speed => speed,
        Quantity::Angle if speed > DIRECTION_SPEED => v.x.abs().atan2(v.y.abs()),
        Quantity::Angle => return None,
        Quantity::Density => condition.density,
        Quantity::Depth => condition.depth,
        Quantity::Tilt => condition.up.x.hypot(condition.up.y).atan2(condition.up.z),
        Quantity::VerticalSpeed => v.z,
        Quantity::AngularSpeed => condition.angular_velocity.norm(),
        Quantity::Distance => return None,
    })
}

/// How far a state lies outside the training domain, quantity by quantity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Outside {
    /// Signed distance from the range in the order of [`Quantity::ALL`]; 0 within.
    pub excess: [f64; Quantity::ALL.len()],
}

impl Outside {
    /// True where no quantity is outside.
    pub fn is_inside(&self) -> bool {
        self.excess.iter().all(|&excess| excess == 0.0)
    }

    /// The quantities outside, each with its signed distance.
    pub fn iter(&self) -> impl Iterator<Item = (Quantity, f64)> + '_ {
        Quantity::ALL.into_iter().zip(self.excess).filter(|&(_, excess)| excess != 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vec3;

    fn domain() -> Domain {
        let range = |min, max| Range { min, max };
        Domain {
            speed_mps: range(0.2, 1.0),
            angle_rad: range(30_f64.to_radians(), 90_f64.to_radians()),
            density_kgpm3: range(1000.0, 1900.0),
            depth_m: range(0.06, 0.20),
            tilt_rad: range(0.0, 0.01),
            vertical_speed_mps: range(-0.05, 0.05),
            angular_speed_radps: range(0.0, 0.05),
        }
    }

    #[test]
    fn names_what_is_outside_and_by_how_much() {
        let condition = Condition { density: 900.0, ..Condition::level(Vec3::new(1.5, 0.0, 0.0), 0.1) };
        let outside: Vec<_> = domain().outside(&condition).iter().collect();
        assert_eq!(outside, vec![(Quantity::Speed, 0.5), (Quantity::Density, -100.0)]);
    }

    #[test]
    fn reverse_and_mirrored_headings_are_inside_and_a_side_flow_is_not() {
        for (vx, vy) in [(-0.5, 0.0), (0.5, 0.1), (0.5, -0.1)] {
            assert!(domain().outside(&Condition::level(Vec3::new(vx, vy, 0.0), 0.1)).is_inside());
        }
        assert!(!domain().outside(&Condition::level(Vec3::new(0.0, 0.5, 0.0), 0.1)).is_inside());
    }

    #[test]
    fn a_bound_in_single_precision_is_inside() {
        let condition = Condition::level(Vec3::new(f64::from(0.2_f32), 0.0, 0.0), f64::from(0.06_f32));
        assert!(domain().outside(&condition).is_inside());
    }
}
