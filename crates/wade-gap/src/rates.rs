//! Rates of a motion that was differentiated: how much of them is signal, and smoothing where it is little.

use std::ops::Range;

use super::statistics::white_variance;
use wade_core::condition::Condition;
use wade_core::frame::Vec3;
use wade_learn::signal::SavitzkyGolay;

/// Longer than the filters that differentiate a motion reach, shorter than a maneuver [s].
const COHERENT: f64 = 0.35;
/// Reach of two filters of nine samples, one on places and one on velocities, at the rate of a camera [s]; and that of one
/// with the sample's own at slower rates.
const REACH_S: f64 = 0.155;
const REACH: usize = 11;
/// Samples to either side of the filter by which a trial without accelerations is differentiated.
const HALF_FILTER: usize = 4;
/// Variance of its slope at an end over that in the middle: `1 + 64 * 60 / 308` of nine samples and a parabola.
const END_NOISE: f64 = 13.5;
/// Shares of white noise in the accelerations above which they are smoothed over so many seconds.
const SMOOTHING: [(f64, f64); 2] = [(0.01, 0.25), (0.15, 0.45)];

/// Share of signal from which samples are those of a motion; along an axis that is hardly accelerated there is less.
const LEAST_SIGNAL: f64 = 0.25;

/// How a rate hangs together in time.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Coherence {
    /// Sum of the squares.
    pub power: f64,
    /// Sum of the products [`COHERENT`] apart.
    pub covariance: f64,
    /// Mean square of the signal alone.
    pub signal: f64,
    /// Number of samples.
    count: f64,
}

impl Coherence {
    /// True where there is enough signal to speak of a motion.
    pub fn is_a_motion(&self) -> bool {
        self.signal * self.count > LEAST_SIGNAL * self.power
    }

    /// Of a motion without noise.
    pub fn exact(values: impl ExactSizeIterator<Item = f64>) -> Self {
        let count = values.len() as f64;
        let power = values.map(|value| value * value).sum::<f64>();
        Self { power, covariance: power, signal: power / count.max(1.0), count }
    }

    /// Of the samples of a trial, in pieces without a hole.
    pub fn of(t: &[f64], pieces: &[Range<usize>], value: impl Fn(usize) -> f64) -> Self {
        let values: Vec<f64> = (0..t.len()).map(value).collect();
        let step = mean_step(t);
        let (power, count) = products(pieces, &values, 0);
        let mean = power / f64::max(count, 1.0);
        let signal = Autocovariance::new(step, pieces, &values, 0).at(0).clamp(0.0, mean);
        Self { power, covariance: products(pieces, &values, lag(COHERENT, step)).0, signal, count }
    }
}

/// Autocovariance of the signal in a rate, by lag in samples: as recorded where the noise of one sample does not reach the
/// other, and the even polynomial through one, one and a half and two such reaches before. One of the second degree loses a
/// sixth of a change of speed that takes half a second, this one of the fourth a sixteenth.
#[derive(Debug, Clone)]
pub(super) struct Autocovariance(Vec<f64>);

impl Autocovariance {
    /// Of values so many seconds apart, in pieces without a hole, up to a lag.
    pub fn new(step: f64, pieces: &[Range<usize>], values: &[f64], longest: usize) -> Self {
        let reach = reach(step);
        let mean = |lag: usize| {
            let (sum, count) = products(pieces, values, lag);
            sum / f64::max(count, 1.0)
        };
        let beyond = [reach, reach + reach.div_ceil(2), 2 * reach].map(|lag| (lag as f64, mean(lag)));
        let at = |lag: usize| if lag < reach { even_polynomial(lag as f64, &beyond) } else { mean(lag) };
        Self((0..=longest).map(at).collect())
    }

    /// So many samples apart.
    pub fn at(&self, lag: usize) -> f64 {
        self.0[lag]
    }
}

/// Samples beyond which the noise of one does not reach the other.
fn reach(step: f64) -> usize {
    lag(REACH_S, step).max(REACH)
}

fn lag(seconds: f64, step: f64) -> usize {
    (seconds / step.max(1e-6)).ceil() as usize
}

/// Sum and number of the products of values so many samples apart.
fn products(pieces: &[Range<usize>], values: &[f64], lag: usize) -> (f64, f64) {
    let pairs = pieces.iter().flat_map(|piece| {
        let values = &values[piece.clone()];
        values.iter().zip(values.iter().skip(lag)).map(|(a, b)| a * b)
    });
    pairs.fold((0.0, 0.0), |(sum, count), product| (sum + product, count + 1.0))
}

/// The even polynomial of the lowest degree through some points (Lagrange, in the squares).
fn even_polynomial(at: f64, points: &[(f64, f64)]) -> f64 {
    let term = |(i, (x, value)): (usize, &(f64, f64))| {
        let others = points.iter().enumerate().filter(|(j, _)| *j != i);
        value
            * others
                .map(|(_, (other, _))| (at * at - other * other) / (x * x - other * other))
                .product::<f64>()
    };
    points.iter().enumerate().map(term).sum()
}

/// Rates of the velocity and the angular velocity in body axes. Not the acceleration itself: the noise of a turn stands in
/// `omega x v` as well, which laws of inertia take off again.
pub(super) fn rates(condition: &Condition) -> [f64; 6] {
    let (a, b) = (condition.acceleration - turning(condition), condition.angular_acceleration);
    [a.x, a.y, a.z, b.x, b.y, b.z]
}

/// What turning axes have of the acceleration.
fn turning(condition: &Condition) -> Vec3 {
    condition.angular_velocity.cross(&condition.ground_velocity)
}

/// Smooths rates that are noisy by local parabolas, which keep peaks. Of rates that a filter `derived` the ends do not count and are
/// what comes next to them: there its window is on one side.
pub(super) fn smooth_rates(t: &[f64], pieces: &[Range<usize>], conditions: &mut [Condition], derived: bool) {
    for rate in 0..6 {
        let mut values: Vec<f64> = conditions.iter().map(|c| rates(c)[rate]).collect();
        let share = white_variance(&values) / mean_square(&values).max(f64::MIN_POSITIVE);
        let length = SMOOTHING.into_iter().rev().find(|(least, _)| share > *least).map(|(_, length)| length);
        let is_noisy_at_ends = derived && END_NOISE * share > SMOOTHING[0].0;
        if length.is_some() || is_noisy_at_ends {
            for piece in pieces {
                let end = if is_noisy_at_ends { HALF_FILTER.min((piece.len() - 1) / 2) } else { 0 };
                let inner = piece.start + end..piece.end - end;
                let by = if derived { smooth_with_quiet_ends } else { smooth };
                length.into_iter().for_each(|length| by(t, &mut values, inner.clone(), length));
                let [first, last] = [values[inner.start], values[inner.end - 1]];
                values[piece.start..inner.start].fill(first);
                values[inner.end..piece.end].fill(last);
            }
            conditions.iter_mut().zip(values).for_each(|(condition, value)| set_rate(condition, rate, value));
        }
    }
}

pub(super) fn mean_step(t: &[f64]) -> f64 {
    (t[t.len() - 1] - t[0]) / (t.len().max(2) - 1) as f64
}

/// Odd number of samples that take so many seconds.
pub(super) fn window(length: f64, step: f64) -> usize {
    (length / step.max(1e-6)) as usize | 1
}

/// Sets a rate of [`rates`].
pub(super) fn set_rate(condition: &mut Condition, rate: usize, value: f64) {
    match rate {
        0..3 => condition.acceleration[rate] = value + turning(condition)[rate],
        _ => condition.angular_acceleration[rate - 3] = value,
    }
}

pub(super) fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64
}

/// Smooths a piece by local parabolas over so many seconds.
pub(super) fn smooth(t: &[f64], values: &mut [f64], piece: Range<usize>, length: f64) {
    if let Some((_, smoothed)) = smoothed(t, values, piece.clone(), length, 2) {
        values[piece].copy_from_slice(&smoothed);
    }
}

/// The same with a line where the window would reach beyond an end: there a parabola has twice the noise that it has in the middle,
/// and a line as much as there.
fn smooth_with_quiet_ends(t: &[f64], values: &mut [f64], piece: Range<usize>, length: f64) {
    let line = smoothed(t, values, piece.clone(), length, 1);
    smooth(t, values, piece.clone(), length);
    if let Some((half, line)) = line {
        let (values, last) = (&mut values[piece], line.len() - half);
        values[..half].copy_from_slice(&line[..half]);
        values[last..].copy_from_slice(&line[last..]);
    }
}

/// Half the window, and a piece smoothed by polynomials; none where it is too short.
fn smoothed(
    t: &[f64],
    values: &[f64],
    piece: Range<usize>,
    length: f64,
    order: usize,
) -> Option<(usize, Vec<f64>)> {
    let odd = (piece.len() - 1) / 2 * 2 + 1;
    let window = window(length, mean_step(&t[piece.clone()])).min(odd);
    let filter = SavitzkyGolay::new(window, order).ok()?;
    Some((window / 2, filter.smooth(&values[piece]).ok()?))
}

/// Rate of the depth [m/s], smoothed over at most a third of a second: noise must not look like entry, nor smoothing take
/// its peak off.
pub(super) fn wetting_rate(t: &[f64], pieces: &[Range<usize>], depth: &[f64]) -> Vec<f64> {
    let mut rate = Vec::with_capacity(t.len());
    for piece in pieces {
        let (times, depth) = (&t[piece.clone()], &depth[piece.clone()]);
        let count = times.len();
        let step = mean_step(times);
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
    use wade_learn::signal::pieces;

    #[test]
    fn the_ends_of_a_derivative_are_as_quiet_as_its_middle_and_keep_a_steady_rate() {
        let mut random = wade_learn::random::Random::new(4);
        let step = 0.027;
        let t: Vec<f64> = (0..60).map(|i| f64::from(i) * step).collect();
        let pieces = pieces(&t);
        let (mut ends, mut middle, mut mean) = (0.0, 0.0, 0.0);
        for _ in 0..200 {
            // a velocity with noise, which speeds up by 0.1 m/s2
            let velocity: Vec<f64> = t.iter().map(|t| 0.1 * t + 0.01 * (random.unit() - 0.5)).collect();
            let rate = SavitzkyGolay::new(9, 2).and_then(|f| f.derivative(&velocity, 1, step));
            let of =
                |x: &f64| Condition { acceleration: Vec3::x() * *x, ..Condition::level(Vec3::zeros(), 0.2) };
            let mut conditions: Vec<Condition> = rate.expect("long enough").iter().map(of).collect();
            smooth_rates(&t, &pieces, &mut conditions, true);
            let rates: Vec<f64> = conditions.iter().map(|condition| condition.acceleration.x).collect();
            ends += (rates[0] - 0.1).powi(2) + (rates[59] - 0.1).powi(2);
            middle += (rates[29] - 0.1).powi(2) + (rates[30] - 0.1).powi(2);
            mean += (rates[0] + rates[59]) / 400.0;
        }
        assert!(ends < 4.0 * middle, "{}", (ends / middle).sqrt());
        assert!((mean - 0.1).abs() < 0.01, "{mean}");
    }

    #[test]
    fn noise_that_a_filter_made_smooth_is_told_from_a_maneuver() {
        let mut random = wade_learn::random::Random::new(3);
        let white: Vec<f64> = (0..4000).map(|_| 12_f64.sqrt() * (random.unit() - 0.5)).collect();
        let t: Vec<f64> = (0..white.len()).map(|i| i as f64 * 0.009).collect();
        let filtered =
            SavitzkyGolay::new(9, 2).and_then(|f| f.derivative(&white, 1, 0.009)).expect("long enough");
        let noise = filtered.iter().map(|v| v * v).sum::<f64>() / filtered.len() as f64;
        let wave = |i: usize| 2.0 * noise.sqrt() * (3.0 * t[i]).sin();
        let pieces = pieces(&t);
        let both = Coherence::of(&t, &pieces, |i| filtered[i] + wave(i));
        // the wave's mean square is twice that of the noise
        assert!((both.signal / (2.0 * noise) - 1.0).abs() < 0.05, "{both:?} {noise}");
        // changes of speed that take 0.6 s, as smooth as a driver's, every two seconds
        let change = |i: usize| {
            let u = (t[i] % 2.0 / 0.6).min(1.0);
            30.0 * (u * (1.0 - u)).powi(2)
        };
        let power = (0..t.len()).map(|i| change(i).powi(2)).sum::<f64>() / t.len() as f64;
        let pushes = Coherence::of(&t, &pieces, change);
        assert!((pushes.signal / power - 1.0).abs() < 0.1, "{pushes:?} {power}");
        let alone = Coherence::of(&t, &pieces, |i| filtered[i]);
        assert!(alone.covariance / alone.power < 0.05 && alone.signal < 0.05 * noise, "{alone:?} {noise}");
    }
}
