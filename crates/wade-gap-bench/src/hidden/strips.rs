//! Loads by strips along the length: each moves with its own velocity `v + r x` and is loaded at the middle of its wet
//! height.

use super::{Hidden, Setting};
use crate::hull::{Strip, wrench};
use crate::simulator::DRAG;
use crate::track::DENSITY;
use crate::{State, Track, Wrench6};
use wade_core::frame::Vec3;

/// Added mass along x over displaced mass, where that along y is strip theory's: chosen, a blunt body's.
pub(super) const SURGE_SHARE: f64 = 0.25;

/// Momentum of the water that moves with a strip over its velocity, along y and z [kg/m]: half a plate's disc of the
/// draft and of the beam, `rho pi T^2 / 2` and `rho pi b^2 / 8`.
pub(super) fn section_mass(strip: &Strip) -> [f64; 2] {
    let pi = std::f64::consts::PI;
    [0.5 * DENSITY * pi * strip.draft.powi(2), DENSITY * pi * strip.beam.powi(2) / 8.0]
}

/// `-(dp/dt + omega x p)` and `-(dq/dt + omega x q + v x p)` with the momenta p and q of the water that moves with the
/// body, whose mass is that of the present draft: Kirchhoff's equations, the rates by differences of momenta.
pub(super) fn added_mass(hidden: &Hidden, setting: &Setting, track: &Track) -> Vec<Wrench6> {
    let hull = setting.simulator.hull;
    let states = &track.states;
    let force = |i: usize| {
        let state = &states[i];
        let strips = hull.strips(state, 0.0);
        let (first, last) = (i.saturating_sub(1), (i + 1).min(states.len() - 1));
        let span = (last - first) as f64 * track.step;
        let (p, q) = momenta(&strips, state);
        let [(p0, q0), (p1, q1)] = [first, last].map(|j| momenta(&strips, &states[j]));
        let (omega, v) = (state.angular_velocity, state.velocity);
        let force = -((p1 - p0) / span + omega.cross(&p));
        let moment = -((q1 - q0) / span + omega.cross(&q) + v.cross(&p));
        hidden.size * Wrench6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
    };
    (0..states.len()).map(force).collect()
}

/// Linear and angular momentum of the water that moves with the body, about its center of mass.
pub(super) fn momenta(strips: &[Strip], state: &State) -> (Vec3, Vec3) {
    let (v, omega) = (state.velocity, state.angular_velocity);
    let mut sum = (Vec3::zeros(), Vec3::zeros());
    for strip in strips {
        let [side, down] = section_mass(strip);
        // dry strips of a tilted body move no water
        let along = SURGE_SHARE * DENSITY * strip.beam * strip.draft;
        let place = Vec3::new(strip.x, 0.0, strip.z);
        let mass = Vec3::new(along, side, down) * strip.dx;
        let p = mass.component_mul(&(v + omega.cross(&place)));
        sum.0 += p;
        sum.1 += place.cross(&p);
    }
    sum
}

/// `-b A (v + r x)` on each strip, A being half the wet area of the sides that look along y, and as much along x.
pub(super) fn linear_damping(hidden: &Hidden, setting: &Setting, state: &State) -> Wrench6 {
    let hull = setting.simulator.hull;
    let (v, r) = (state.velocity, state.angular_velocity.z);
    let mut sum = Wrench6::zeros();
    for strip in hull.strips(state, 0.0) {
        let of_sides =
            |axis: usize| hidden.size * 0.5 * hull.facing(strip.draft, axis) * strip.dx / hull.length;
        let side = -of_sides(1) * (v.y + r * strip.x);
        let along = -of_sides(0) * v.x;
        sum += wrench(Vec3::new(along, side, 0.0), Vec3::new(strip.x, 0.0, strip.z));
    }
    sum
}

/// A share of what the prediction makes of the motion, of its forces in the plane.
pub(super) fn drag(hidden: &Hidden, setting: &Setting, state: &State) -> Wrench6 {
    let share = setting.simulator.drag_share(state) * hidden.size;
    Wrench6::new(share[0], share[1], 0.0, share[3], share[4], share[5])
}

/// Cross-flow drag with the local velocity of each strip, less that with the velocity of the center.
pub(super) fn rotation(hidden: &Hidden, setting: &Setting, track: &Track) -> Vec<Wrench6> {
    let hull = setting.simulator.hull;
    let force = |state: &State| {
        let (v, r) = (state.velocity.y, state.angular_velocity.z);
        let mut sum = Wrench6::zeros();
        for strip in hull.strips(state, 0.0) {
            let area = strip.draft * strip.beam / hull.width * strip.dx;
            let local = v + r * strip.x;
            let side = -0.5 * DENSITY * DRAG[1] * hidden.size * area * (local * local.abs() - v * v.abs());
            sum += wrench(Vec3::new(0.0, side, 0.0), Vec3::new(strip.x, 0.0, strip.z));
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
    fn a_box_that_sways_carries_half_a_disc_of_water() {
        let accelerating = (0..5).map(|i| State {
            velocity: Vec3::new(0.0, 0.02 * f64::from(i), 0.0),
            depth: 0.2,
            ..State::default()
        });
        let wrench = on_box(hidden(Effect::AddedMass, 1.0), accelerating);
        // 2 m/s2 at 0.01 s a sample
        let expected = -0.5 * 1000.0 * std::f64::consts::PI * 0.04 * 1.2 * 2.0;
        assert!((wrench[2][1] - expected).abs() < 1e-6 && wrench[2][0].abs() < 1e-9);
    }

    #[test]
    fn a_body_in_oblique_steady_motion_feels_munk_s_moment() {
        let oblique =
            (0..3).map(|_| State { velocity: Vec3::new(1.0, 0.5, 0.0), depth: 0.2, ..State::default() });
        let wrench = on_box(hidden(Effect::AddedMass, 1.0), oblique);
        let (side, along) =
            (0.5 * 1000.0 * std::f64::consts::PI * 0.04 * 1.2, 0.25 * 1000.0 * 1.2 * 0.8 * 0.2);
        // (M_x - M_y) u v
        assert!((wrench[1][5] - (along - side) * 0.5).abs() < 1e-9);
        assert!(wrench[1].fixed_rows::<3>(0).norm() < 1e-9);
    }

    #[test]
    fn a_box_that_spins_is_damped_as_the_integral_says() {
        let spinning =
            |_| State { angular_velocity: Vec3::new(0.0, 0.0, 0.8), depth: 0.2, ..State::default() };
        // -0.5 rho Cd T r abs(r) 2 int_0^{L/2} x^3 dx, of which 15 midpoints miss little
        let quadratic = on_box(hidden(Effect::Rotation, 1.0), (0..2).map(spinning))[0][5];
        let exact = -0.5 * 1000.0 * 1.5 * 0.2 * 0.64 * 0.5 * 0.6f64.powi(4);
        assert!((quadratic / exact - 1.0).abs() < 0.02, "{quadratic} {exact}");
        // -b T r L^3 / 12
        let linear = on_box(hidden(Effect::LinearDamping, 200.0), (0..2).map(spinning))[0][5];
        let exact = -200.0 * 0.2 * 0.8 * 1.2f64.powi(3) / 12.0;
        assert!((linear / exact - 1.0).abs() < 0.01, "{linear} {exact}");
    }
}
