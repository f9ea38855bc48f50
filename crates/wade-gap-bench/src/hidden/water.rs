//! Level, density and motion of the water, water inside, and the entry into it.

use super::{Hidden, Setting};
use crate::hull::{Hull, Strip};
use crate::track::DENSITY;
use crate::{State, Track, Wrench6};
use wade_core::frame::{GRAVITY, Vec3};

/// Layers of a sheared current.
const LAYERS: usize = 5;
/// Exponent of its profile: the seventh-root law of a turbulent open channel.
const SHEAR: f64 = 1.0 / 7.0;
/// Contraction of an orifice with a sharp edge.
const CONTRACTION: f64 = 0.61;
/// Rise of the bottom from its middle to its sides, for the wetting at entry [rad].
const DEADRISE: f64 = 0.35;

/// A current that is fixed in the world and grows from the bed up with the seventh root of the height, of a mean of
/// `size` towards `shape[0]` [rad from world x]: the mean of what is predicted in five layers, less that in still water.
pub(super) fn current(hidden: &Hidden, setting: &Setting, state: &State) -> Wrench6 {
    let simulator = &setting.simulator;
    if state.depth <= 0.0 {
        return Wrench6::zeros();
    }
    // world from body is a turn by yaw about z but for small roll and pitch
    let angle = hidden.shape[0] - state.attitude[2];
    let towards = Vec3::new(angle.cos(), angle.sin(), 0.0);
    let moved: Wrench6 = (0..LAYERS)
        .map(|layer| {
            let water = towards * (hidden.size * layer_speed(layer));
            simulator.predict_moving(state, &(state.velocity - water))
        })
        .sum();
    moved / LAYERS as f64 - simulator.predict(state)
}

/// Mean of `(1 + n) s^n` over a layer, so that the mean over the depth is 1.
fn layer_speed(layer: usize) -> f64 {
    let at = |i: usize| (i as f64 / LAYERS as f64).powf(1.0 + SHEAR);
    LAYERS as f64 * (at(layer + 1) - at(layer))
}

/// The water is higher than the column `depth` says.
pub(super) fn level(hidden: &Hidden, setting: &Setting, track: &Track) -> Vec<Wrench6> {
    let simulator = &setting.simulator;
    let force = |state: &State| {
        // the surface is where it is on dry ground too, but there is none over it
        let raised = State { depth: state.depth + hidden.size, ..*state };
        simulator.predict(&raised) - simulator.predict(state)
    };
    track.states.iter().map(force).collect()
}

/// The water is denser than stated; every predicted load is proportional to it.
pub(super) fn density(hidden: &Hidden, setting: &Setting, track: &Track) -> Vec<Wrench6> {
    track.states.iter().map(|state| setting.simulator.predict(state) * hidden.size).collect()
}

/// Two volumes, in front and behind, that together fill a share `size` of the body at every height (of which the front one has
/// `shape[1]`), fill through orifices and take their buoyancy away. A trial that begins in water begins with the body
/// just set down, its volumes empty. `shape[0]` is the time to fill to 0.2 m outside [s].
pub(super) fn flooding(hidden: &Hidden, setting: &Setting, track: &Track) -> Vec<Wrench6> {
    let hull = setting.simulator.hull;
    let area = |share: f64| hidden.size * share * hull.length * hull.width;
    let volumes =
        [(0.25 * hull.length, area(hidden.shape[1])), (-0.25 * hull.length, area(1.0 - hidden.shape[1]))];
    // Torricelli: T = 2 sqrt(h) A / (c a sqrt(2 g))
    let orifice = 2.0 * 0.2f64.sqrt() / (CONTRACTION * (2.0 * GRAVITY).sqrt() * hidden.shape[0]);
    let mut inside = [0.0; 2];
    let mut force = |state: &State| {
        let up = wade_core::frame::up_from_roll_pitch(state.attitude[0], state.attitude[1]).into_inner();
        let mut sum = Wrench6::zeros();
        for (level, (x, area)) in inside.iter_mut().zip(volumes) {
            let outside = (state.depth + x * state.attitude[1].tan()).clamp(0.0, hull.height);
            sum += lost(hull, &up, *level, area, x);
            *level = filled(*level, outside, orifice, track.step);
        }
        sum
    };
    track.states.iter().map(&mut force).collect()
}

/// Load of the water in a volume that stands to a level at `x`, about the center of mass.
fn lost(hull: &Hull, up: &Vec3, level: f64, area: f64, x: f64) -> Wrench6 {
    let force = up * (-DENSITY * GRAVITY * area * hull.filled(level));
    crate::hull::wrench(force, Vec3::new(x, 0.0, hull.z0 + 0.5 * level) - hull.center_of_mass)
}

/// Level inside after a step: `dh/dt = c a/A sqrt(2 g abs(H - h)) sign(H - h)`, whose exact solution for a steady level
/// outside is linear in the root of the head.
pub(super) fn filled(inside: f64, outside: f64, orifice: f64, step: f64) -> f64 {
    let head: f64 = outside - inside;
    let fall = 0.5 * CONTRACTION * orifice * (2.0 * GRAVITY).sqrt() * step;
    let root = (head.abs().sqrt() - fall).max(0.0);
    outside - root * root * head.signum()
}

/// `w dm/dt` of the section that gets wet, on entry only: the half beam in the water grows as Wagner's
/// `(pi / 2) z / tan(deadrise)` up to the full one, the mass is half a disc's, `rho pi c^2 / 2`.
pub(super) fn slamming(hidden: &Hidden, setting: &Setting, track: &Track) -> Vec<Wrench6> {
    let hull = setting.simulator.hull;
    let states = &track.states;
    let strips: Vec<_> = states.iter().map(|state| hull.strips(state, 0.0)).collect();
    let force = |i: usize| {
        let (first, last) = (i.saturating_sub(1), (i + 1).min(states.len() - 1));
        let span = (last - first) as f64 * track.step;
        let mut sum = Wrench6::zeros();
        for ((before, after), strip) in strips[first].iter().zip(&strips[last]).zip(&strips[i]) {
            let entry = (after.draft - before.draft) / span;
            if entry > 0.0 {
                let growth = (wetted_mass(after, hull.width) - wetted_mass(before, hull.width)) / span;
                let up = hidden.size * growth * entry * strip.dx;
                sum += Wrench6::new(0.0, 0.0, up, 0.0, -strip.x * up, 0.0);
            }
        }
        sum
    };
    (0..states.len()).map(force).collect()
}

/// Mass of the water that a wet section moves [kg/m].
fn wetted_mass(strip: &Strip, width: f64) -> f64 {
    let half = (std::f64::consts::FRAC_PI_2 * strip.draft / DEADRISE.tan()).min(0.5 * width);
    0.5 * DENSITY * std::f64::consts::PI * half * half
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::super::{Effect, Hidden, tests_support::*};
    use super::*;

    #[test]
    fn a_volume_fills_in_torricelli_s_time() {
        // area ratio 0.01: T = 2 sqrt(0.3) / (0.61 0.01 sqrt(2 g))
        let time = 2.0 * 0.3f64.sqrt() / (0.61 * 0.01 * (2.0 * 9.81f64).sqrt());
        let (mut level, mut t, step) = (0.0, 0.0, 0.01);
        while level < 0.3 - 1e-12 {
            level = filled(level, 0.3, 0.01, step);
            t += step;
        }
        assert!((t - time).abs() < 2.0 * step, "{t} {time}");
        // half the time leaves a quarter of the head
        let half = (0..(0.5 * time / step) as usize).fold(0.0, |h, _| filled(h, 0.3, 0.01, step));
        assert!((half - 0.225).abs() < 1e-3, "{half}");
        assert!(filled(0.1, 0.0, 0.01, 1.0) < 0.1, "it drains");
    }

    #[test]
    fn flooding_ends_at_the_lost_buoyancy() {
        let flooding = Hidden { effect: Effect::HullFlooding, size: 0.1, shape: [2.0, 0.5, 0.0] };
        let resting = (0..500).map(|_| State { depth: 0.2, ..State::default() });
        let wrench = on_box(flooding, resting);
        assert_eq!(wrench[0][2], 0.0);
        let expected = -9810.0 * 0.1 * 1.2 * 0.8 * 0.2;
        assert!((wrench[499][2] / expected - 1.0).abs() < 1e-9 && wrench[499][4].abs() < 1e-9);
        // full after the stated 2 s and not much before
        assert!((wrench[205][2] / expected - 1.0).abs() < 1e-9 && wrench[150][2] / expected < 0.95);
    }

    #[test]
    fn a_current_is_the_velocity_through_the_water_and_turns_with_the_world() {
        let speeds: f64 = (0..LAYERS).map(layer_speed).sum();
        assert!((speeds / LAYERS as f64 - 1.0).abs() < 1e-12);
        let current = Hidden { effect: Effect::Current, size: 0.5, shape: [0.0; 3] };
        let parked = |yaw: f64| State { attitude: [0.0, 0.0, yaw], depth: 0.2, ..State::default() };
        let [ahead, turned] =
            [0.0, std::f64::consts::FRAC_PI_2].map(|yaw| on_box(current, (0..2).map(|_| parked(yaw)))[0]);
        // the mean square of the profile is (1 + n)^2 / (1 + 2 n) = 1.0159 of a uniform one, less what layers leave out
        let uniform = 0.5 * 1000.0 * 1.2 * 0.8 * 0.2 * 0.25;
        assert!(ahead[0] / uniform > 1.0 && ahead[0] / uniform < 1.0159, "{}", ahead[0] / uniform);
        // headed to world y, the water comes from the left
        assert!(turned[0].abs() < 1e-9 && turned[1] < 0.0);
    }

    #[test]
    fn a_drop_through_the_surface_is_von_karman_s_momentum() {
        // level, 1 m/s: the impulse over the wetting is w (m_full - 0), whatever happens between
        let states = (0..400).map(|i| State {
            depth: -0.02 + 0.001 * f64::from(i),
            velocity: Vec3::new(0.0, 0.0, -0.1),
            ..State::default()
        });
        let wrench =
            on_box(Hidden { effect: Effect::WaterEntrySlamming, size: 1.0, shape: [0.0; 3] }, states);
        let impulse: f64 = wrench.iter().map(|w| w[2] * 0.01).sum();
        let mass = 0.5 * 1000.0 * std::f64::consts::PI * 0.16 * 1.2;
        assert!((impulse / (mass * 0.1) - 1.0).abs() < 0.02, "{impulse}");
        let rising = (0..100).map(|i| State { depth: 0.1 - 0.001 * f64::from(i), ..State::default() });
        let out = on_box(Hidden { effect: Effect::WaterEntrySlamming, size: 1.0, shape: [0.0; 3] }, rising);
        assert!(out.iter().all(|w| w.norm() == 0.0), "nothing on the way out");
    }
}
