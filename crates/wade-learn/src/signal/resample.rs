//! From stamps as they came to a uniform grid.

use nalgebra::UnitQuaternion;

/// Evenly spaced instants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UniformGrid {
    /// First instant [s].
    pub start: f64,
    /// Between two instants [s].
    pub step: f64,
    /// Number of instants.
    pub count: usize,
}

/// What a rate and a span may lose to rounding, in steps.
const ROUNDING: f64 = 1e-9;

impl UniformGrid {
    /// The instants at `rate` [Hz] from `first` on that do not lie after `last` [s].
    pub fn within(first: f64, last: f64, rate: f64) -> Self {
        let steps = ((last - first) * rate + ROUNDING).floor().max(0.0);
        Self { start: first, step: 1.0 / rate, count: steps as usize + 1 }
    }

    /// The instants [s].
    pub fn times(&self) -> Vec<f64> {
        (0..self.count).map(|index| self.start + index as f64 * self.step).collect()
    }
}

/// The stamps around an instant and how far it lies between them, 0 to 1; the first or last pair beyond the ends.
fn around(times: &[f64], at: f64) -> (usize, usize, f64) {
    let after = times.partition_point(|&t| t <= at).clamp(1, times.len().max(2) - 1).min(times.len() - 1);
    let before = after.saturating_sub(1);
    let span = times[after] - times[before];
    let share = if span > 0.0 { ((at - times[before]) / span).clamp(0.0, 1.0) } else { 0.0 };
    (before, after, share)
}

/// Linear interpolation at each instant; the first or last value beyond the ends.
///
/// `times` must not be empty and must be as long as `values`.
pub fn interpolate(times: &[f64], values: &[f64], at: &[f64]) -> Vec<f64> {
    let value = |&at: &f64| {
        let (before, after, share) = around(times, at);
        values[before] + share * (values[after] - values[before])
    };
    at.iter().map(value).collect()
}

/// Rotations at each instant, turning at a constant rate along the shorter way between two stamps (Shoemake, SIGGRAPH
/// 1985); unit length by construction.
///
/// `times` must not be empty and must be as long as `rotations`.
pub fn slerp(times: &[f64], rotations: &[UnitQuaternion<f64>], at: &[f64]) -> Vec<UnitQuaternion<f64>> {
    let rotation = |&at: &f64| {
        let (before, after, share) = around(times, at);
        let (from, to) = (&rotations[before], &rotations[after]);
        // opposite rotations, half a turn apart, have no shorter way
        from.try_slerp(to, share, 1e-12).unwrap_or(*from)
    };
    at.iter().map(rotation).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn a_grid_ends_within_the_recording() {
        assert_eq!(UniformGrid::within(2.0, 3.0, 111.0).count, 112);
        assert_eq!(UniformGrid::within(0.0, 0.999, 10.0).count, 10);
        let grid = UniformGrid::within(5.0, 5.0, 10.0);
        assert_eq!(grid.times(), [5.0]);
    }

    #[test]
    fn a_straight_line_survives_uneven_stamps() {
        let times = [0.0, 0.1, 0.35, 0.36, 1.0];
        let values = times.map(|t| 3.0 - 2.0 * t);
        let at = UniformGrid::within(0.0, 1.0, 7.0).times();
        for (value, t) in interpolate(&times, &values, &at).into_iter().zip(&at) {
            assert!((value - (3.0 - 2.0 * t)).abs() < 1e-12);
        }
        assert_eq!(interpolate(&times, &values, &[-1.0, 9.0]), [3.0, 1.0]);
        assert_eq!(interpolate(&[4.0], &[7.0], &[3.0, 5.0]), [7.0, 7.0]);
    }

    #[test]
    fn a_steady_turn_survives_uneven_stamps_and_sign_flips() {
        let axis = nalgebra::Unit::new_normalize(Vector3::new(1.0, -2.0, 0.5));
        let rotation = |t: f64| UnitQuaternion::from_axis_angle(&axis, 2.0 * t);
        let times = [0.0, 0.2, 0.5, 0.6, 1.1];
        let mut rotations: Vec<_> = times.iter().map(|&t| rotation(t)).collect();
        // q and -q are the same rotation
        rotations[2] = UnitQuaternion::new_unchecked(-rotations[2].into_inner());
        let at = UniformGrid::within(0.0, 1.1, 30.0).times();
        for (found, &t) in slerp(&times, &rotations, &at).iter().zip(&at) {
            assert!(found.angle_to(&rotation(t)) < 1e-7 && (found.norm() - 1.0).abs() < 1e-12);
        }
        let opposite = [UnitQuaternion::identity(), UnitQuaternion::from_axis_angle(&axis, PI)];
        assert!(slerp(&[0.0, 1.0], &opposite, &[0.5])[0].norm() > 0.99);
    }
}
