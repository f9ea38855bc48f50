//! Rates of a motion that was differentiated, and how much of them is signal.

use super::statistics::white_variance;
use crate::frame::Vec3;
use crate::signal::{SavitzkyGolay, pieces};

/// Longer than the filters that differentiate a motion reach, shorter than a maneuver [s].
const COHERENT: f64 = 0.35;
/// Reach of two filters of nine samples, one on places and one on velocities, at the rate of a camera [s].
const REACH_S: f64 = 0.155;

/// How a rate hangs together in time.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Coherence {
    /// Sum of the squares.
    pub power: f64,
    /// Sum of the products [`COHERENT`] apart.
    pub covariance: f64,
}

impl Coherence {
    /// Of the samples of a trial.
    pub fn of(t: &[f64], value: impl Fn(usize) -> f64) -> Self {
        let values: Vec<f64> = (0..t.len()).map(value).collect();
        let step = (t[t.len() - 1] - t[0]) / (t.len().max(2) - 1) as f64;
        let lag = (COHERENT / step.max(1e-6)).ceil() as usize;
        Self { power: products(t, &values, 0).0, covariance: products(t, &values, lag).0 }
    }
}

/// Mean square of what forgets itself within the reach of the filters that made the motion: noise, of the sensor and of the
/// motion in the prediction. The autocovariance beyond that reach `r` goes back to 0 by a parabola,
/// `c(0) = c(r) + (c(r) - c(2 r)) / 3`, since the noise of one sample does not reach the other.
pub(super) fn short_lived(t: &[f64], values: &[f64]) -> f64 {
    let step = (t[t.len() - 1] - t[0]) / (t.len().max(2) - 1) as f64;
    let reach = ((REACH_S / step.max(1e-6)).ceil() as usize).max(1);
    let mean = |lag: usize| {
        let (sum, count) = products(t, values, lag);
        sum / count.max(1.0)
    };
    let (near, far, power) = (mean(reach), mean(2 * reach), mean(0));
    power - (near + (near - far) / 3.0).clamp(0.0, power)
}

/// Sum of the products of values so many samples apart, and how many there are.
fn products(t: &[f64], values: &[f64], lag: usize) -> (f64, f64) {
    let pairs = pieces(t).into_iter().flat_map(|piece| {
        let values = &values[piece];
        values.iter().zip(values.iter().skip(lag)).map(|(a, b)| a * b)
    });
    pairs.fold((0.0, 0.0), |(sum, count), product| (sum + product, count + 1.0))
}

/// Acceleration of each sample from the velocities on either side of it, in an inertial frame and body axes. Its mean over a
/// bin is the change of the velocity over the bin, whatever happens in between: the integral form of a law in the
/// acceleration. A filter would take off the peaks of a column, but not those of the gap.
pub(super) fn acceleration(t: &[f64], velocity: &[Vec3], angular_velocity: &[Vec3]) -> Vec<Vec3> {
    let turning = angular_velocity.iter().zip(velocity);
    rates(t, velocity).into_iter().zip(turning).map(|(rate, (omega, v))| rate + omega.cross(v)).collect()
}

/// Rate of each sample from its neighbors.
pub(super) fn rates(t: &[f64], values: &[Vec3]) -> Vec<Vec3> {
    let mut rates = Vec::with_capacity(t.len());
    for piece in pieces(t) {
        let last = piece.end - 1;
        rates.extend(piece.clone().map(|i| {
            let (before, after) = (i.max(piece.start + 1) - 1, (i + 1).min(last));
            (values[after] - values[before]) / (t[after] - t[before]).max(1e-9)
        }));
    }
    rates
}

/// Rate of the depth [m/s], smoothed over at most a third of a second: noise must not look like entry, nor smoothing take
/// its peak off.
pub(super) fn wetting_rate(t: &[f64], depth: &[f64]) -> Vec<f64> {
    let mut rate = Vec::with_capacity(t.len());
    for piece in pieces(t) {
        let (times, depth) = (&t[piece.clone()], &depth[piece]);
        let count = times.len();
        let step = (times[count - 1] - times[0]) / (count.max(2) - 1) as f64;
        let window = rate_window(depth, step).min((count.max(1) - 1) / 2 * 2 + 1);
        // jitter of the stamps moves the rate by less than noise does
        let derivative = SavitzkyGolay::new(window, 2.min(window.saturating_sub(1)))
            .and_then(|filter| filter.derivative(depth, 1, step))
            .unwrap_or_else(|_| vec![0.0; count]);
        rate.extend(derivative);
    }
    rate
}

/// Samples of the window whose noise is a fiftieth of the fastest rate.
fn rate_window(depth: &[f64], step: f64) -> usize {
    let longest = ((0.33 / step.max(1e-6)) as usize).clamp(5, 101);
    let change =
        depth.windows(longest.min(depth.len())).map(|w| (w[w.len() - 1] - w[0]).abs()).fold(0.0, f64::max);
    let fastest = change / (step * longest as f64);
    // the slope of a window of w samples has the variance 12 / w^3 of that of a sample
    let noise = white_variance(depth).sqrt() / step.max(1e-6);
    let needed = (12.0 * (noise / (0.02 * fastest).max(1e-9)).powi(2)).cbrt();
    (needed.min(1e3) as usize).clamp(5, longest) | 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_that_a_filter_made_smooth_is_told_from_a_maneuver() {
        let mut random = crate::random::Random::new(3);
        let white: Vec<f64> = (0..4000).map(|_| 12_f64.sqrt() * (random.unit() - 0.5)).collect();
        let t: Vec<f64> = (0..white.len()).map(|i| i as f64 * 0.009).collect();
        let filtered =
            SavitzkyGolay::new(9, 2).and_then(|f| f.derivative(&white, 1, 0.009)).expect("long enough");
        let noise = filtered.iter().map(|v| v * v).sum::<f64>() / filtered.len() as f64;
        let both: Vec<f64> =
            filtered.iter().zip(&t).map(|(n, t)| n + 2.0 * noise.sqrt() * (3.0 * t).sin()).collect();
        assert!((short_lived(&t, &both) / noise - 1.0).abs() < 0.1, "{} {noise}", short_lived(&t, &both));
        let alone = Coherence::of(&t, |i| filtered[i]);
        assert!(alone.covariance / alone.power < 0.05, "{alone:?}");
    }

    #[test]
    fn a_bin_has_the_change_of_the_velocity_over_it() {
        // a push of half a second, v = (1 - cos(2 pi t)) / 2, at 37 Hz: the mean over 0.1 to 0.4 s is that of the push itself
        let t: Vec<f64> = (0..38).map(|i| f64::from(i) / 37.0).collect();
        let speed = |t: f64| 0.5 - 0.5 * (std::f64::consts::TAU * t).cos();
        let velocity: Vec<Vec3> = t.iter().map(|&t| Vec3::new(speed(t), 0.0, 0.0)).collect();
        let turning = vec![Vec3::z(); t.len()];
        let found = acceleration(&t, &velocity, &turning);
        let mean = found[4..15].iter().map(|a| a.x).sum::<f64>() / 11.0;
        let exact = (speed(14.5 / 37.0) - speed(3.5 / 37.0)) / (11.0 / 37.0);
        assert!((mean / exact - 1.0).abs() < 0.01, "{mean} {exact}");
        assert!((found[10].y - speed(t[10])).abs() < 1e-12, "omega x v");
    }
}
