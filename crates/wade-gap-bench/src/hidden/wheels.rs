//! Wheels that turn and a bed that moves.

use super::{Hidden, Setting};
use crate::hull::wrench;
use crate::track::DENSITY;
use crate::{State, Track, Wrench6};
use wade_core::frame::Vec3;

/// Lugs of a wheel.
const LUGS: f64 = 12.0;
/// Height of a lug [m].
const LUG: f64 = 0.02;
/// Places around a wheel.
const ELEMENTS: usize = 36;
/// Lift over drag of the flow that the moving bed drags along.
const LIFT: f64 = 0.3;

/// Blade elements: a lug at the angle `a` from the bottom moves with `u cos a - omega R` along its normal, which points
/// forward at the bottom; its drag is `-0.5 rho C A w abs(w)`, summed over the wet part of each wheel.
pub(super) fn paddles(hidden: &Hidden, setting: &Setting, track: &Track) -> Vec<Wrench6> {
    let hull = setting.simulator.hull;
    let [radius, width] = hull.wheel;
    let (x, y) = (0.5 * hull.length - radius, 0.5 * (hull.width - width));
    let hubs = [(x, y), (x, -y), (-x, y), (-x, -y)];
    let area = LUGS / ELEMENTS as f64 * LUG * width;
    let force = |state: &State| {
        let mut sum = Wrench6::zeros();
        for ((x, y), speed) in hubs.into_iter().zip(state.wheels) {
            for element in 0..ELEMENTS {
                let angle = std::f64::consts::TAU * element as f64 / ELEMENTS as f64;
                let height = radius * (1.0 - angle.cos());
                if state.depth + x * state.attitude[1].tan() <= height {
                    continue;
                }
                let normal = Vec3::new(angle.cos(), 0.0, angle.sin());
                let w = state.velocity.dot(&normal) - speed * radius;
                let force = normal * (-0.5 * DENSITY * hidden.size * area * w * w.abs());
                let place = Vec3::new(x - radius * angle.sin(), y, hull.z0 + height);
                sum += wrench(force, place - hull.center_of_mass);
            }
        }
        sum
    };
    track.states.iter().map(force).collect()
}

/// Water dragged along under the body by the bed that moves past it: the boundary layer thins as the fifth root of the
/// way from the front, its drag is felt by the strips in between and it pulls the body down.
pub(super) fn moving_bed(hidden: &Hidden, setting: &Setting, track: &Track) -> Vec<Wrench6> {
    let hull = setting.simulator.hull;
    let force = |state: &State| {
        let u = state.velocity.x;
        let strips = hull.strips(state, 0.0);
        let mut sum = Wrench6::zeros();
        for strip in strips.iter().filter(|strip| strip.draft > 0.0) {
            let from_front = if u < 0.0 { 0.5 + strip.x / hull.length } else { 0.5 - strip.x / hull.length };
            // the integral of 0.8 s^-0.2 over the length is 1
            let share = 0.8 * from_front.max(1e-3).powf(-0.2) * strip.dx / hull.length;
            let push = 0.5 * DENSITY * hidden.size * share * hull.width * strip.draft;
            let force = Vec3::new(push * u * u.abs(), 0.0, -LIFT * push * u * u);
            sum += wrench(force, Vec3::new(strip.x, 0.0, hull.z0 - hull.center_of_mass.z));
        }
        sum
    };
    track.states.iter().map(force).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::super::{Effect, tests_support::*};
    use super::*;

    #[test]
    fn a_wheel_that_spins_on_the_spot_pushes_forward_and_one_that_is_dry_does_not() {
        let spinning = |depth: f64| State { depth, wheels: [10.0; 4], ..State::default() };
        let wet = on_box(hidden(Effect::WheelPaddleThrust, 1.0), (0..2).map(|_| spinning(0.101)))[0];
        // the wet half angle is acos(1 - d / R), 60 deg: thrust 4 n/2pi 0.5 rho C h w (omega R)^2 2 sin(60 deg)
        let exact = 4.0 * 12.0 / std::f64::consts::TAU
            * 0.5
            * 1000.0
            * 0.02
            * 0.12
            * 4.0
            * 2.0
            * (60f64.to_radians()).sin();
        assert!((wet[0] / exact - 1.0).abs() < 0.1, "{} {exact}", wet[0]);
        assert!(wet[2].abs() < 1e-9 && wet[1] == 0.0);
        let dry = on_box(hidden(Effect::WheelPaddleThrust, 1.0), (0..2).map(|_| spinning(-0.1)))[0];
        assert_eq!(dry, Wrench6::zeros());
    }

    #[test]
    fn a_moving_bed_pushes_with_the_square_of_the_speed() {
        let driving = |u: f64| State { velocity: Vec3::new(u, 0.0, 0.0), depth: 0.2, ..State::default() };
        let at = |u: f64| on_box(hidden(Effect::BedMotion, 0.2), (0..2).map(|_| driving(u)))[0];
        let exact = 0.5 * 1000.0 * 0.2 * 0.8 * 0.2;
        assert!((at(1.0)[0] / exact - 1.0).abs() < 0.05, "{}", at(1.0)[0]);
        assert!((at(2.0)[0] / at(1.0)[0] - 4.0).abs() < 1e-9 && at(-1.0)[0] < 0.0 && at(-1.0)[2] < 0.0);
    }
}
