//! Impact on entering the water: momentum of the water that starts to move with the hull.
//!
//! `F = C w^2 dM/dd` upwards and `-C u w dM/dd` across, on entry only, with the rate `w` at which the water rises there and the
//! water `M(d)` that moves with the hull: `M = rho V`, the water displaced; or, with the depth `h` at which the bottom is
//! wet from side to side, `M = rho pi c^2 / 2` on each meter of the length (von Karman) with the half
//! beam `c = (B / 2) min(d / h, 1)` of a wedge, in strips: one that pitches or runs down a ramp gets wet from an end, each
//! strip at a depth and a rate of its own. Wagner's splash makes `h` smaller by pi/2; above about 30 degrees of deadrise
//! theory fails (Constantinescu 2008).

use std::f64::consts::PI;

use super::input::{Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, amount, unused};
use super::spec::{Coefficient, EffectSpec, Parameter, Quantity, Rate};
use crate::frame::Vec3;
use crate::wrench::Wrench;

/// Strips of the length.
const STRIPS: usize = 9;

/// The water `M(d)` that starts to move with the hull.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum WaterEntrySlamming {
    /// The water displaced.
    #[default]
    Displaced,
    /// That of a wedge.
    Wedge {
        /// Depth at which the bottom is wet from side to side [m]; greater than 0.
        wet_at_m: f64,
    },
}

impl Law for WaterEntrySlamming {
    const SPEC: EffectSpec = EffectSpec {
        name: "water_entry_slamming",
        summary: "impact on entering the water",
        equation: "F = C rho dV/dd w^2 upwards and -C_h rho dV/dd w u across, w the rate of the depth d, on entry only; V the water displaced, or pi l (b d / h)^2 / 8 until d = h, wet_at, on each strip of length l with its own d and w",
        corrects: "entry",
        total: "takes power on entry, nothing on exit",
        // von Karman's impact has no reserve: Wagner's is pi/2 of it
        coefficients: &[
            Coefficient::published("vertical", 0.0, 8.0, [0.3, 2.0]),
            Coefficient::published("horizontal", 0.0, 8.0, [0.3, 2.0]),
        ],
        parameters: &[Parameter { name: "wet_at", unit: "m" }],
        inputs: &[Quantity::Velocity, Quantity::AngularVelocity, Quantity::DepthRate],
        rates: &[Rate::Depth],
        needs_its_first: true,
        not_excited: "no trial enters the water",
        experiment: "enter the water at three speeds over one ramp, and leave it again at the same speeds",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 1)?;
        Ok(match amount(numbers, 0)? {
            0.0 => Self::Displaced,
            wet_at_m => Self::Wedge { wet_at_m },
        })
    }

    fn to_numbers(&self) -> Numbers {
        match *self {
            Self::Displaced => [0.0; 3],
            Self::Wedge { wet_at_m } => [wet_at_m, 0.0, 0.0],
        }
    }

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let (state, immersion, body) = (input.condition, input.immersion, input.body);
        let Self::Wedge { wet_at_m: wet_at } = *self else {
            return blow(input, &immersion.waterplane_center, immersion.waterplane_area, emit);
        };
        let up = state.up.into_inner();
        let length = body.length / STRIPS as f64;
        let half = 0.5 * body.width;
        for strip in 0..STRIPS {
            let along = (strip as f64 + 0.5) * length - 0.5 * body.length;
            let depth = state.depth - up.x * along;
            if depth > 0.0 && depth < wet_at {
                let surface = Vec3::new(along, 0.0, body.z0) + up * depth;
                blow(input, &surface, PI * half * half * length * depth / (wet_at * wet_at), emit);
            }
        }
    }
}

/// At a point of the water surface, from the growth of the moving volume with the depth there [m2].
fn blow(input: &Input, point: &Vec3, growth: f64, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let up = input.condition.up.into_inner();
    // the rate of the level is the entry speed, whatever carries the hull down
    let rate = input.wetting_rate - up.dot(&input.condition.angular_velocity.cross(point));
    let gain = input.condition.density * growth * rate.max(0.0);
    if gain > 0.0 {
        emit(0, Part::Hull, input.at(up * (gain * rate), point));
        let velocity = input.local_velocity(point);
        emit(1, Part::Hull, input.at((velocity - up * velocity.dot(&up)) * -gain, point));
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::condition::Condition;
    use crate::effects::{Body, Immersion};
    use crate::frame::up_from_roll_pitch;
    use crate::vehicle::shipped;

    /// Sum of a coefficient.
    fn load(wet_at: f64, state: &Condition, wetting_rate: f64, coefficient: usize) -> (Body, Wrench) {
        let body = Body::of_vehicle(&shipped::husky().unwrap().vehicle().unwrap());
        let mut immersion = Immersion::default();
        body.immerse(state, &mut immersion);
        let input = Input { wetting_rate, ..Input::of_motion(&body, state, &immersion) };
        let mut sum = Wrench::default();
        let law = WaterEntrySlamming::Wedge { wet_at_m: wet_at };
        law.basis(&Memory::default(), &input, &mut |index, _, wrench| {
            if index == coefficient {
                sum += wrench;
            }
        });
        (body, sum)
    }

    #[test]
    fn a_level_wedge_is_von_karman_s() {
        let state = Condition::level(Vec3::new(0.7, -0.2, 0.0), 0.05);
        let (body, up) = load(0.1, &state, 0.3, 0);
        // rho pi (B / 2)^2 L d / h^2 w^2 by hand
        let gain = state.density * PI * (0.5 * body.width).powi(2) * body.length * 0.05 / 0.01 * 0.3;
        assert!((up.force - Vec3::new(0.0, 0.0, gain * 0.3)).norm() < 1e-9 * gain, "{up:?}");
        let (_, across) = load(0.1, &state, 0.3, 1);
        assert!((across.force + state.velocity * gain).norm() < 1e-9 * gain, "{across:?}");
        for (depth, rate) in [(0.11, 0.3), (0.05, -0.3), (-0.01, 0.3)] {
            let state = Condition { depth, ..state };
            assert_eq!(load(0.1, &state, rate, 0).1, Wrench::default(), "{depth} {rate}");
        }
    }

    #[test]
    fn a_nose_that_dips_is_struck_alone_and_a_body_that_pitches_where_it_goes_down() {
        // positive pitch lowers the nose, and the water stands at the middle
        let tilted = Condition { up: up_from_roll_pitch(0.0, 0.1), ..Condition::level(Vec3::zeros(), 0.0) };
        let (body, nose) = load(0.2, &tilted, 0.3, 0);
        // of half the length, each meter at its own depth: a fourth of the level wedge with the nose's
        let deepest = 0.5 * body.length * 0.1_f64.sin();
        let expected =
            0.25 * tilted.density * PI * (0.5 * body.width).powi(2) * body.length * deepest / 0.04 * 0.09;
        let share = nose.force.norm() / expected;
        // nine strips, of which the middle one has its own middle at the surface
        assert!((share - 80.0 / 81.0).abs() < 1e-9, "{share}");
        assert!(nose.moment.y < 0.0, "the nose is lifted: {nose:?}");
        let pitching =
            Condition { angular_velocity: Vec3::new(0.0, 0.5, 0.0), ..Condition::level(Vec3::zeros(), 0.05) };
        let (_, turned) = load(0.2, &pitching, 0.0, 0);
        assert!(turned.force.z > 0.0 && turned.moment.y < 0.0, "{turned:?}");
    }
}
