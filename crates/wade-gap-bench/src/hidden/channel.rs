//! One-dimensional flow past a body in a channel: continuity and energy.

use super::{Hidden, Setting};
use crate::track::DENSITY;
use crate::{State, Track, Wrench6};
use wade_core::frame::GRAVITY;

/// Share of the drop that is more behind than in front, over half the length.
const TRIM: f64 = 0.3;

/// What the flow does beside the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Squeezed {
    /// Velocity past the body over the speed, at least 1.
    pub faster: f64,
    /// Drop of the surface [m].
    pub drop: f64,
}

/// `V A = W A_b` and `V^2 / 2g = W^2 / 2g - z` with `A = width h` and `A_b = A - section - width z`: the subcritical root,
/// or, where the flow is choked, the critical one, whose drop falls to 0 as the flow gets faster than waves all along.
pub(super) fn squeezed(speed: f64, depth: f64, width: f64, section: f64) -> Squeezed {
    if speed <= 0.0 || depth <= 0.0 || section >= 0.95 * width * depth {
        return Squeezed { faster: 1.0, drop: 0.0 };
    }
    let area = width * depth;
    // the section of the body falls with the surface: its wall is vertical
    let beside = |z: f64| speed * area / (area - section - z * (width - section / depth));
    let excess = |z: f64| (beside(z).powi(2) - speed * speed) / (2.0 * GRAVITY) - z;
    // the excess falls from a positive value at 0 to the root and rises again: walk to its lowest place
    let limit = 0.9 * (area - section) / (width - section / depth);
    let (mut low, mut high) = (0.0, limit);
    for _ in 0..60 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if excess(a) < excess(b) { high = b } else { low = a }
    }
    let lowest = 0.5 * (low + high);
    let drop = if excess(lowest) > 0.0 {
        lowest
    } else {
        let (mut low, mut high) = (0.0, lowest);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if excess(middle) > 0.0 { low = middle } else { high = middle }
        }
        low
    };
    Squeezed { faster: beside(drop) / speed, drop }
}

fn around(setting: &Setting, width: f64, state: &State) -> Squeezed {
    let hull = setting.simulator.hull;
    let section = hull.volume(state.depth) / hull.length;
    squeezed(state.velocity.x.abs(), state.depth, width, section)
}

/// The drag along x at the velocity past the body instead of the speed.
pub(super) fn blockage(hidden: &Hidden, setting: &Setting, width: f64, state: &State) -> Wrench6 {
    let more = around(setting, width, state).faster.powi(2) - 1.0;
    let drag = setting.simulator.drag_share(state);
    Wrench6::new(drag[0], 0.0, 0.0, 0.0, drag[4], 0.0) * (hidden.size * more)
}

/// The buoyancy that the body loses where the surface drops, more so behind.
pub(super) fn squat(hidden: &Hidden, setting: &Setting, track: &Track) -> Vec<Wrench6> {
    let hull = setting.simulator.hull;
    let force = |state: &State| {
        let drop = hidden.size * around(setting, track.channel_width, state).drop;
        let ahead = if state.velocity.x < 0.0 { -1.0 } else { 1.0 };
        let level = |x: f64, _: f64| -drop * (1.0 - TRIM * ahead * 2.0 * x / hull.length);
        hull.buoyancy(state, DENSITY, level) - hull.buoyancy(state, DENSITY, |_, _| 0.0)
    };
    track.states.iter().map(force).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn slow_flow_past_a_small_body_is_the_linear_solution() {
        // to first order in the blockage m: W = V (1 + m / (1 - Fr^2)), z = (V^2 / g) m / (1 - Fr^2)
        let (speed, depth, width) = (0.5, 0.25, 4.0);
        let m = 1e-3;
        let found = squeezed(speed, depth, width, m * width * depth);
        let froude2 = speed * speed / (GRAVITY * depth);
        assert!(((found.faster - 1.0) / (m / (1.0 - froude2)) - 1.0).abs() < 5e-3, "{found:?}");
        assert!((found.drop / (speed * speed / GRAVITY * m / (1.0 - froude2)) - 1.0).abs() < 5e-3);
    }

    #[test]
    fn mass_and_energy_are_kept_and_choked_flow_is_critical() {
        let (speed, depth, width, section) = (0.4, 0.25, 3.0, 0.15);
        let Squeezed { faster, drop } = squeezed(speed, depth, width, section);
        let beside = width * depth - section - drop * (width - section / depth);
        assert!((faster * beside - width * depth).abs() < 1e-9);
        assert!(((faster * faster - 1.0) * speed * speed / (2.0 * GRAVITY) - drop).abs() < 1e-9);
        // choked: dE/dz = 0, W^2 = g A_b / width_b
        let choked = squeezed(0.9, depth, width, section);
        let open = width - section / depth;
        let left = width * depth - section - choked.drop * open;
        let critical = (GRAVITY * left / open).sqrt();
        assert!((choked.faster * 0.9 / critical - 1.0).abs() < 1e-3, "{choked:?}");
        assert_eq!(squeezed(0.0, depth, width, section).drop, 0.0);
    }
}
