//! Acceleration from velocity.

use super::Trial;
use crate::signal::{SavitzkyGolay, UniformGrid, interpolate, median_step, pieces};
use wade_core::frame::Vec3;

/// Window of the filter [samples] and order of its polynomial: the paper's, for motion capture.
const WINDOW: usize = 9;
const ORDER: usize = 2;

/// Acceleration in an inertial frame, in the axes of the body: `dv/dt + omega x v` [m/s2].
pub fn acceleration(times: &[f64], velocity: &[Vec3], angular_velocity: &[Vec3]) -> Vec<Vec3> {
    let rates = derivative(times, velocity).into_iter();
    rates.zip(turning(velocity, angular_velocity)).map(|(rate, turn)| rate + turn).collect()
}

/// What turning adds to the rates of the components of a velocity: `omega x v` [m/s2].
pub fn turning<'a>(velocity: &'a [Vec3], angular_velocity: &'a [Vec3]) -> impl Iterator<Item = Vec3> + 'a {
    angular_velocity.iter().zip(velocity).map(|(omega, v)| omega.cross(v))
}

/// A recorded motion, sample by sample in the axes of the body.
pub struct Recorded<'a> {
    /// Time [s].
    pub t: &'a [f64],
    /// Velocity [m/s].
    pub velocity: &'a [Vec3],
    /// Angular velocity [rad/s].
    pub angular_velocity: &'a [Vec3],
    /// Acceleration as it was recorded [m/s2].
    pub acceleration: &'a [Vec3],
}

impl<'a> Recorded<'a> {
    fn of(trial: &'a Trial) -> Self {
        let Trial { t, velocity, angular_velocity, acceleration, .. } = trial;
        Self { t, velocity, angular_velocity, acceleration }
    }
}

/// True where recorded accelerations are the rates of the velocity's components, to which `omega x v` is to be added.
/// Both conventions are in use, and a recording tells which is its own: `r = a - dv/dt` is 0 in one and
/// `omega x v` in the other. What hardly turns tells neither, and stays as it is.
pub fn are_rates<'a>(recordings: impl Iterator<Item = Recorded<'a>>) -> bool {
    /// How many times larger than what is left of `r` the turning must be, as the root of the sums of squares: noise that is
    /// correlated over some ten samples reaches 3.
    const CLEAR: f64 = 10.0;
    let (mut as_rates, mut as_inertial, mut turned, mut count) = (0.0, 0.0, 0.0, 0.0);
    for Recorded { t, velocity, angular_velocity, acceleration } in recordings {
        let rates = derivative(t, velocity);
        let turns = turning(velocity, angular_velocity);
        for ((recorded, rate), turn) in acceleration.iter().zip(rates).zip(turns) {
            as_rates += (recorded - rate).norm_squared();
            as_inertial += (recorded - rate - turn).norm_squared();
            turned += turn.norm_squared();
            count += 1.0;
        }
    }
    let noise = f64::min(as_rates, as_inertial) / f64::max(3.0 * count, 1.0);
    as_rates < as_inertial && turned > CLEAR * CLEAR * noise
}

/// Adds `omega x v` to recorded accelerations that are the rates of the velocity's components, and true where that was so.
pub(super) fn settle_convention(trials: &mut [Trial]) -> bool {
    let are_rates = are_rates(trials.iter().filter(|trial| trial.acceleration_is_measured).map(Recorded::of));
    for trial in trials.iter_mut().filter(|trial| are_rates && trial.acceleration_is_measured) {
        let turns = turning(&trial.velocity, &trial.angular_velocity);
        trial.acceleration.iter_mut().zip(turns).for_each(|(recorded, turn)| *recorded += turn);
    }
    are_rates
}

/// Time derivative of each component, by a Savitzky-Golay filter (9 samples, order 2) on a uniform grid at the median
/// rate. Pieces between holes in time are differentiated apart; a shorter piece has a shorter window, and a lone sample,
/// of which nothing is known, has 0.
pub fn derivative(times: &[f64], values: &[Vec3]) -> Vec<Vec3> {
    let step = median_step(times).unwrap_or(1.0);
    let of_piece = |piece: std::ops::Range<usize>| {
        let (times, values) = (&times[piece.clone()], &values[piece]);
        let axes = [0, 1, 2].map(|axis| {
            let component: Vec<f64> = values.iter().map(|value| value[axis]).collect();
            differentiated(times, &component, step)
        });
        (0..times.len()).map(|i| Vec3::new(axes[0][i], axes[1][i], axes[2][i])).collect::<Vec<_>>()
    };
    pieces(times).into_iter().flat_map(of_piece).collect()
}

fn differentiated(times: &[f64], values: &[f64], step: f64) -> Vec<f64> {
    let span = times[times.len() - 1] - times[0];
    let grid = UniformGrid { start: times[0], step, count: (span / step).round() as usize + 1 };
    let instants = grid.times();
    let samples = interpolate(times, values, &instants);
    let odd = (samples.len() - 1) / 2 * 2 + 1;
    let derivative = SavitzkyGolay::new(WINDOW.min(odd), ORDER.min(odd - 1))
        .and_then(|filter| filter.derivative(&samples, 1, step))
        .unwrap_or_else(|_| secant(&samples, step));
    interpolate(&instants, &derivative, times)
}

/// One or two samples: the slope between them.
fn secant(samples: &[f64], step: f64) -> Vec<f64> {
    let slope = (samples[samples.len() - 1] - samples[0]) / step;
    vec![slope; samples.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_with_a_hole_is_differentiated_on_both_sides() {
        let times: Vec<f64> = (0..60).map(|i| 0.01 * f64::from(i) + if i < 40 { 0.0 } else { 2.0 }).collect();
        let value = |t: f64| if t < 1.0 { Vec3::new(t * t, -t, 3.0) } else { Vec3::new(5.0, 2.0 * t, 0.0) };
        let rate = |t: f64| if t < 1.0 { Vec3::new(2.0 * t, -1.0, 0.0) } else { Vec3::new(0.0, 2.0, 0.0) };
        let values: Vec<Vec3> = times.iter().map(|&t| value(t)).collect();
        for (found, &t) in derivative(&times, &values).iter().zip(&times) {
            assert!((found - rate(t)).norm() < 1e-9, "{t}: {found}");
        }
    }

    #[test]
    fn short_pieces_do_with_what_they_have() {
        let line = |n: u32| -> Vec<Vec3> { (0..n).map(|i| Vec3::x() * f64::from(i)).collect() };
        for n in 2..9 {
            let times: Vec<f64> = (0..n).map(|i| 0.5 * f64::from(i)).collect();
            let found = derivative(&times, &line(n));
            assert!(found.iter().all(|rate| (rate.x - 2.0).abs() < 1e-9), "{n}: {found:?}");
        }
        assert_eq!(derivative(&[1.0], &line(1)), [Vec3::zeros()]);
    }
}
