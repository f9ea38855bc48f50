//! The part of the state space in which an effect acts, where that is not all of it.
//!
//! A border is known no better than the trials tell it: each is an interval, over which the load fades by a cubic with a
//! continuous slope (smoothstep), so that a vehicle that crosses it feels no step.

use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::frame::GRAVITY;
use crate::real::smoothstep;

/// Depth below which the Froude number of a depth is that of this depth [m].
const LEAST_DEPTH: f64 = 0.01;

crate::named_enum! {
    /// A quantity of the state that may limit an effect.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum RegionQuantity {
        /// Water depth [m].
        Depth => "depth",
        /// Speed through the water over the root of gravity times depth [-].
        FroudeDepth => "froude_depth",
        /// Speed through the water [m/s].
        Speed => "speed",
        /// Angle by which the nose is lowered [rad].
        Pitch => "pitch",
    }
}

impl RegionQuantity {
    /// Its value in a state.
    pub fn of(self, condition: &Condition) -> f64 {
        match self {
            Self::Depth => condition.depth,
            Self::FroudeDepth => {
                condition.velocity.norm() / (GRAVITY * condition.depth.max(LEAST_DEPTH)).sqrt()
            }
            Self::Speed => condition.velocity.norm(),
            // a unit vector may be longer than 1 by its rounding
            Self::Pitch => (-condition.up.x).clamp(-1.0, 1.0).asin(),
        }
    }

    /// Its unit.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Depth => "m",
            Self::FroudeDepth => "1",
            Self::Speed => "m/s",
            Self::Pitch => "rad",
        }
    }
}

/// One border of a region or two, each the interval that it lies in with a probability of 90 %.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionLimit {
    /// What is limited.
    pub quantity: RegionQuantity,
    /// The effect does not act up to the first, and fully from the second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub above: Option<[f64; 2]>,
    /// The effect acts fully up to the first, and not at all from the second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_most: Option<[f64; 2]>,
}

impl RegionLimit {
    /// The share of the effect that acts at a value of the quantity, 0 to 1.
    fn share(&self, value: f64) -> f64 {
        let beyond = |[from, to]: [f64; 2]| smoothstep((value - from) / (to - from));
        let above = self.above.map_or(1.0, beyond);
        let below = self.at_most.map_or(1.0, |border| 1.0 - beyond(border));
        above * below
    }

    /// Whether there is a border, each is two finite numbers of which the first is less, and two do not cross.
    pub fn is_sound(&self) -> bool {
        let sound = |[from, to]: [f64; 2]| from.is_finite() && to.is_finite() && from < to;
        let apart = match (self.above, self.at_most) {
            (None, None) => false,
            (Some([_, above]), Some([at_most, _])) => above <= at_most,
            _ => true,
        };
        apart && [self.above, self.at_most].into_iter().flatten().all(sound)
    }
}

/// The region of an effect: within all of its limits. Without one it is everywhere.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct EffectRegion {
    /// At most one a quantity.
    pub limits: Vec<RegionLimit>,
}

impl EffectRegion {
    /// True where there is no limit.
    pub fn is_everywhere(&self) -> bool {
        self.limits.is_empty()
    }

    /// The share of the effect that acts in a state, 0 to 1.
    pub fn share(&self, condition: &Condition) -> f64 {
        self.limits.iter().map(|limit| limit.share(limit.quantity.of(condition))).product()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Vec3, up_from_roll_pitch};

    fn state(depth: f64, speed: f64) -> Condition {
        Condition::level(Vec3::new(speed, 0.0, 0.0), depth)
    }

    #[test]
    fn an_effect_fades_across_a_border_without_a_step() {
        let limit = RegionLimit { quantity: RegionQuantity::Depth, above: Some([0.15, 0.17]), at_most: None };
        let region = EffectRegion { limits: vec![limit] };
        let share = |depth: f64| region.share(&state(depth, 1.0));
        assert_eq!((share(0.1), share(0.15), share(0.17), share(0.4)), (0.0, 0.0, 1.0, 1.0));
        assert!((share(0.16) - 0.5).abs() < 1e-12);
        // the slope of a smoothstep is 0 at both ends
        assert!(share(0.1501) < 1e-3 && share(0.1699) > 1.0 - 1e-3);
        assert_eq!(EffectRegion::default().share(&state(0.1, 1.0)), 1.0);
    }

    #[test]
    fn each_quantity_is_the_one_of_the_textbook() {
        let of = |quantity: RegionQuantity, condition: &Condition| quantity.of(condition);
        // Fr = 2 / sqrt(9.80665 * 0.2)
        assert!((of(RegionQuantity::FroudeDepth, &state(0.2, 2.0)) - 1.4281).abs() < 1e-3);
        let nose_down = Condition { up: up_from_roll_pitch(0.1, 0.3), ..state(0.2, 2.0) };
        assert!((of(RegionQuantity::Pitch, &nose_down) - 0.3).abs() < 1e-12);
        let over = nalgebra::UnitVector3::new_unchecked(Vec3::new(-1.0 - f64::EPSILON, 0.0, 0.0));
        let upright = Condition { up: over, ..state(0.2, 2.0) };
        assert!((of(RegionQuantity::Pitch, &upright) - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        for quantity in RegionQuantity::ALL {
            assert_eq!(RegionQuantity::from_name(quantity.name()), Some(quantity));
        }
    }

    #[test]
    fn borders_that_cross_or_have_no_width_are_unsound() {
        let limit = |above, at_most| RegionLimit { quantity: RegionQuantity::Speed, above, at_most };
        assert!(limit(Some([1.0, 1.1]), Some([2.0, 2.1])).is_sound());
        assert!(!limit(None, None).is_sound());
        assert!(!limit(Some([1.0, 1.0]), None).is_sound());
        assert!(!limit(Some([1.0, 1.5]), Some([1.4, 2.0])).is_sound());
        assert!(!limit(None, Some([1.0, f64::NAN])).is_sound());
    }
}
