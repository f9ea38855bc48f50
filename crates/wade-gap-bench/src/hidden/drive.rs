//! Faults of a wrench that is inferred from motion, `m a` less the force of the drive.
//!
//! A driven body obeys `m a = D + F + R` with the drive's force D, the water's F and the rolling resistance R. What is
//! inferred is `m' a - D'` with the mass and the drive force that were stated. On a slope the weight along it belongs to
//! `a`.

use super::{Effect, Hidden, Setting};
use crate::{State, Track, Wrench6};
use wade_core::frame::{GRAVITY, up_from_roll_pitch};

/// Speed over which rolling resistance changes sign [m/s].
const STICK: f64 = 0.02;

/// The inferred wrench less the water's.
pub(super) fn change(hidden: &Hidden, setting: &Setting, track: &Track, wrench: &[Wrench6]) -> Vec<Wrench6> {
    let mass = setting.simulator.hull.mass;
    let change = track.states.iter().zip(wrench).map(|(state, water)| {
        let a = state.acceleration;
        match hidden.effect {
            Effect::RollingResistance => rolling_resistance(hidden.size, mass * GRAVITY - water[2], state),
            // D' = D / (1 + e)
            Effect::DriveGain => {
                let drive = mass * a.x - water[0];
                Wrench6::x() * (drive * hidden.size / (1.0 + hidden.size))
            }
            _ => {
                let weight = up_from_roll_pitch(state.attitude[0], state.attitude[1]).scale(GRAVITY);
                Wrench6::new(a.x + weight.x, a.y + weight.y, 0.0, 0.0, 0.0, 0.0) * hidden.size
            }
        }
    });
    change.collect()
}

/// A share of the load on the wheels [N] against the way in which they roll.
pub(crate) fn rolling_resistance(coefficient: f64, load: f64, state: &State) -> Wrench6 {
    Wrench6::x() * (-coefficient * load.max(0.0) * (state.velocity.x / STICK).tanh())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::super::tests_support::*;
    use super::*;
    use wade_core::frame::Vec3;

    #[test]
    fn faults_are_those_of_inverse_dynamics() {
        let state = State {
            velocity: Vec3::new(1.0, 0.0, 0.0),
            acceleration: Vec3::new(0.5, 0.0, 0.0),
            ..State::default()
        };
        let water = Wrench6::new(-40.0, 0.0, 500.0, 0.0, 0.0, 0.0);
        let on = |effect, size| on_box_with(hidden(effect, size), vec![state], &[water])[0];
        // the box has 150 kg
        let rolling = -0.02 * (150.0 * 9.81 - 500.0);
        assert!((on(Effect::RollingResistance, 0.02)[0] - rolling).abs() < 1e-9);
        // D = 150 0.5 + 40 = 115 N is reported as 100 N: the difference is taken for water
        assert!((on(Effect::DriveGain, 0.15)[0] - 15.0).abs() < 1e-9);
        assert!((on(Effect::MassError, 10.0)[0] - 5.0).abs() < 1e-12);
    }
}
