//! Effects that no library has.

use super::{Effect, Hidden, Setting};
use crate::track::DENSITY;
use crate::{State, Track, Wrench6};

/// Strouhal number of a blunt body.
const STROUHAL: f64 = 0.2;
/// Below this speed a body rests [m/s].
const RESTS: f64 = 0.02;
/// Time in which mud lets go [s].
const LETS_GO: f64 = 0.3;

pub(super) fn change(hidden: &Hidden, setting: &Setting, track: &Track, wrench: &[Wrench6]) -> Vec<Wrench6> {
    let hull = setting.simulator.hull;
    let states = track.states.iter();
    match hidden.effect {
        Effect::VortexShedding => {
            let mut phase = track.session_time;
            let mut side = |state: &State| {
                let speed = state.velocity.norm();
                phase += std::f64::consts::TAU * STROUHAL * speed / hull.width * track.step;
                let area = hull.length * state.depth.clamp(0.0, hull.height);
                let force = 0.5 * DENSITY * hidden.size * area * speed * speed * phase.sin();
                Wrench6::new(0.0, force, 0.0, 0.0, 0.0, 0.2 * hull.length * force)
            };
            states.map(&mut side).collect()
        }
        Effect::Tether => {
            let spring = |state: &State| {
                let (sine, cosine) = state.attitude[2].sin_cos();
                let (x, y) = (state.place[0] - hidden.shape[0], state.place[1]);
                let pull = [cosine * x + sine * y, cosine * y - sine * x].map(|away| -hidden.size * away);
                Wrench6::new(pull[0], pull[1], 0.0, 0.0, 0.0, 0.0)
            };
            states.map(spring).collect()
        }
        Effect::ThermalGain => {
            let gain = |(state, wrench): (&State, &Wrench6)| {
                let warmed = (track.session_time + state.t) / setting.session;
                wrench * (hidden.size * warmed * warmed)
            };
            states.zip(wrench).map(gain).collect()
        }
        Effect::MudSuction => {
            let (mut rested, mut held) = (0.0, 0.0);
            let mut pull = |state: &State| {
                if state.velocity.norm() < RESTS && state.depth > 0.0 {
                    rested += track.step;
                    held = hidden.size * f64::sqrt(rested);
                } else {
                    rested = 0.0;
                    held *= (-track.step / LETS_GO).exp();
                }
                Wrench6::new(0.0, 0.0, -held, 0.0, 0.0, 0.0)
            };
            states.map(&mut pull).collect()
        }
        _ => {
            let [period, phase, towards] = hidden.shape;
            let swing = |state: &State| {
                let time = track.session_time + state.t;
                let size = hidden.size * (std::f64::consts::TAU * time / period + phase).sin();
                let wet = (state.depth / 0.2).clamp(0.0, 2.0);
                let angle = towards - state.attitude[2];
                Wrench6::new(angle.cos(), angle.sin(), 0.0, 0.0, 0.0, 0.0) * (size * wet)
            };
            states.map(swing).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::super::tests_support::*;
    use super::*;
    use wade_core::frame::Vec3;

    #[test]
    fn vortices_are_shed_at_strouhal_s_frequency() {
        let states: Vec<State> = (0..2000)
            .map(|_| State { velocity: Vec3::new(2.0, 0.0, 0.0), depth: 0.2, ..State::default() })
            .collect();
        let side: Vec<f64> =
            on_box(hidden(Effect::VortexShedding, 0.3), states.into_iter()).iter().map(|w| w[1]).collect();
        // 0.2 2 / 0.8 = 0.5 Hz: 20 s hold 10 periods, 20 changes of sign
        let turns = side.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count();
        assert!((19..=20).contains(&turns), "{turns}");
        let largest = side.iter().copied().fold(0.0, f64::max);
        assert!((largest / (0.5 * 1000.0 * 0.3 * 1.2 * 0.2 * 4.0) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn mud_holds_as_the_root_of_the_time_at_rest_and_lets_go() {
        let at = |i: i32| State {
            velocity: Vec3::new(if i < 400 { 0.0 } else { 1.0 }, 0.0, 0.0),
            depth: 0.2,
            ..State::default()
        };
        let pull = on_box(hidden(Effect::MudSuction, 10.0), (0..600).map(at));
        assert!((pull[399][2] + 20.0).abs() < 1e-9 && (pull[99][2] + 10.0).abs() < 1e-9);
        assert!(pull[599][2].abs() < 0.1);
    }

    #[test]
    fn a_tether_pulls_back_in_the_world() {
        let turned = State {
            place: [2.0, 0.0],
            attitude: [0.0, 0.0, std::f64::consts::FRAC_PI_2],
            ..State::default()
        };
        let pull = on_box(hidden(Effect::Tether, 5.0), std::iter::once(turned))[0];
        // headed to world y, world x lies to the right
        assert!(pull[0].abs() < 1e-9 && (pull[1] - 10.0).abs() < 1e-9, "{pull}");
    }
}
