//! Waves that a body radiates and meets again.

use super::{Hidden, Setting};
use crate::hull::wrench;
use crate::{Track, Wrench6};
use wade_core::frame::Vec3;

/// Draft at which the kernel is as stated; it is proportional to the volume under water [m].
pub(crate) const DRAFT: f64 = 0.2;
/// Sway and heave over surge.
pub(crate) const RATIO: [f64; 3] = [1.0, 1.5, 1.2];

/// Retardation function `exp(-a t) (cos b t - a / b sin b t)`, whose integral is 0: steady motion radiates nothing.
pub(super) fn kernel(t: f64, a: f64, b: f64) -> f64 {
    (-a * t).exp() * ((b * t).cos() - a / b * (b * t).sin())
}

/// Cummins' integral of the velocity by trapezoids,
/// `-K0 int_0^inf k(s) v(t - s) ds`, with a = `shape[0]` and b = `shape[1]` [1/s]; before the record the body is taken to
/// have moved as at its beginning.
pub(super) fn convolution(hidden: &Hidden, setting: &Setting, track: &Track) -> Vec<Wrench6> {
    let [a, b, _] = hidden.shape;
    let velocity: Vec<Vec3> = track.states.iter().map(|state| state.velocity).collect();
    let remembered = remembered(&velocity, track.step, a, b);
    let loads = remembered.iter().zip(&track.states).map(|(v, state)| {
        let hull = setting.simulator.hull;
        let draft = state.depth.clamp(0.0, hull.height);
        let kernel = hidden.size * hull.filled(draft) / hull.filled(DRAFT);
        let force = -v.component_mul(&Vec3::from(RATIO)) * kernel;
        wrench(force, Vec3::z() * (hull.z0 + 0.5 * draft) - hull.center_of_mass)
    });
    loads.collect()
}

fn remembered(velocity: &[Vec3], step: f64, a: f64, b: f64) -> Vec<Vec3> {
    let kernel: Vec<f64> = (0..velocity.len()).map(|i| kernel(i as f64 * step, a, b)).collect();
    let at = |i: usize| {
        let sum: Vec3 = (0..=i).map(|j| velocity[i - j] * kernel[j]).sum();
        let ends = (velocity[i] * kernel[0] + velocity[0] * kernel[i]) * 0.5;
        // int_t^inf k = -exp(-a t) sin(b t) / b
        let t = i as f64 * step;
        let before = -(-a * t).exp() * (b * t).sin() / b;
        (sum - ends) * step + velocity[0] * before
    };
    (0..velocity.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_body_that_starts_at_once_meets_the_integral_of_the_kernel() {
        // v = 0 and then 1: int_0^t k = exp(-a t) sin(b t) / b
        let (a, b, step) = (0.8, 3.0, 0.005);
        let velocity: Vec<Vec3> = (0..800).map(|i| if i == 0 { Vec3::zeros() } else { Vec3::x() }).collect();
        let found = remembered(&velocity, step, a, b);
        for i in [50, 200, 500, 799] {
            // the trapezoid sees the jump as half a step of ramp
            let t = (i as f64 - 0.5) * step;
            let exact = (-a * t).exp() * (b * t).sin() / b;
            assert!((found[i].x - exact).abs() < 1e-3, "{i}: {} {exact}", found[i].x);
        }
    }

    #[test]
    fn a_kernel_without_swing_answers_a_ramp_as_its_integral_says() {
        // b to 0: k = exp(-a t) (1 - a t); v = t: int_0^t k(s) (t - s) ds = (1 - exp(-a t) (1 + a t)) / a^2
        let (a, b, step) = (1.1, 1e-4, 0.005);
        let velocity: Vec<Vec3> = (0..600).map(|i| Vec3::x() * (i as f64 * step)).collect();
        let found = remembered(&velocity, step, a, b);
        for i in [100, 300, 599] {
            let t = i as f64 * step;
            let exact = (1.0 - (-a * t).exp() * (1.0 + a * t)) / (a * a);
            assert!((found[i].x - exact).abs() < 1e-4, "{t}: {} {exact}", found[i].x);
        }
    }

    #[test]
    fn steady_motion_radiates_nothing() {
        let found = remembered(&vec![Vec3::x(); 400], 0.01, 0.9, 2.5);
        assert!(found.iter().all(|v| v.norm() < 1e-4), "{:?}", found[200]);
    }
}
