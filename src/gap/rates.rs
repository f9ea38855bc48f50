//! Rates of a motion that was differentiated: how much of them is signal, and smoothing where it is little.

use std::ops::Range;

use super::design::smooth as passes;
use super::statistics::white_variance;
use crate::condition::Condition;
use crate::frame::Vec3;
use crate::signal::{SavitzkyGolay, pieces};

/// Longer than the filters that differentiate a motion reach, shorter than a maneuver [s].
const COHERENT: f64 = 0.35;
/// Reach of two filters of nine samples, one on places and one on velocities, at the rate of a camera [s]; and that of one
/// with the sample's own at slower rates.
const REACH_S: f64 = 0.155;
const REACH: usize = 11;
/// Longest lag at which the autocovariance is needed [s]: as many bins as passes of smoothing reach over.
const LONGEST_S: f64 = 1.6;
/// Shares of white noise in the accelerations above which they are smoothed over so many seconds.
const SMOOTHING: [(f64, f64); 2] = [(0.01, 0.25), (0.15, 0.45)];

/// Share of signal from which samples are those of a motion; along an axis that is hardly accelerated there is less.
const LEAST_SIGNAL: f64 = 0.25;

/// How a rate hangs together in time.
#[derive(Debug, Clone, Default)]
pub(super) struct Coherence {
    /// Sum of the squares.
    pub power: f64,
    /// Sum of the products [`COHERENT`] apart.
    pub covariance: f64,
    /// Mean square of the signal alone: the autocovariance at one, one and a half and two reaches of the filters, beyond
    /// which the noise of one sample does not reach the other, back to 0 by the even polynomial of the fourth degree through
    /// them. One of the second degree loses a sixth of a change of speed that takes half a second, this one a sixteenth.
    pub signal: f64,
    /// Number of samples.
    count: f64,
    /// Autocovariance of the signal alone, by lag in samples: as recorded where the noise of one sample does not reach the
    /// other, and that polynomial before.
    covariances: Vec<f64>,
}

impl Coherence {
    /// True where there is enough signal to speak of a motion.
    pub fn is_a_motion(&self) -> bool {
        self.signal * self.count > LEAST_SIGNAL * self.power
    }

    /// Of the samples of a trial.
    pub fn of(t: &[f64], value: impl Fn(usize) -> f64) -> Self {
        let values: Vec<f64> = (0..t.len()).map(value).collect();
        let step = mean_step(t);
        let lag = |seconds: f64| (seconds / step.max(1e-6)).ceil() as usize;
        let reach = lag(REACH_S).max(REACH);
        let at = |lag: usize| {
            let pairs = pieces(t).into_iter().flat_map(|piece| {
                let values = &values[piece];
                values.iter().zip(values.iter().skip(lag)).map(|(a, b)| a * b)
            });
            pairs.fold((0.0, 0.0), |(sum, count), product| (sum + product, count + 1.0))
        };
        let mean = |lag: usize| {
            let (sum, count) = at(lag);
            sum / f64::max(count, 1.0)
        };
        let (power, count) = at(0);
        let beyond = [reach, reach + reach.div_ceil(2), 2 * reach].map(|lag| (lag as f64, mean(lag)));
        let all = power / f64::max(count, 1.0);
        let signal = even_polynomial(0.0, &beyond).max(all - quiet(t, &values)).clamp(0.0, all);
        let [a, b, c] = beyond;
        let near = |lag: usize| even_polynomial(lag as f64, &[(0.0, signal), a, b, c]);
        let longest = lag(LONGEST_S).min(values.len());
        let covariances = (0..longest).map(|lag| if lag < reach { near(lag) } else { mean(lag) }).collect();
        Self { power, covariance: at(lag(COHERENT)).0, signal, count, covariances }
    }
}

/// Most noise that there can be, from where the motion is quiet: the mean square of the quietest third of all half seconds,
/// and as much again and a half, since of half seconds of noise alone the quietest are quieter than the mean.
fn quiet(t: &[f64], values: &[f64]) -> f64 {
    const LENGTH: f64 = 0.5;
    const TIMES: f64 = 2.5;
    let mut squares = Vec::new();
    for piece in pieces(t) {
        let mut start = piece.start;
        while let Some(end) = (start + 1..piece.end).find(|&i| t[i] - t[start] >= LENGTH) {
            squares.push(mean_square(&values[start..end]));
            start = end;
        }
    }
    if squares.len() < 3 {
        return f64::INFINITY;
    }
    squares.sort_by(f64::total_cmp);
    let third = &squares[..squares.len() / 3];
    TIMES * third.iter().sum::<f64>() / third.len() as f64
}

/// The even polynomial of the lowest degree through some points (Lagrange, in the squares).
fn even_polynomial(at: f64, points: &[(f64, f64)]) -> f64 {
    let term = |(i, (x, value)): (usize, &(f64, f64))| {
        let others = points.iter().enumerate().filter(|(j, _)| *j != i);
        value * others.map(|(_, (other, _))| (at * at - other * other) / (x * x - other * other)).product::<f64>()
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

/// Smooths rates that are noisy by local parabolas, which keep peaks; the window of each rate that was [s].
pub(super) fn smooth_rates(t: &[f64], conditions: &mut [Condition]) -> [Option<f64>; 6] {
    let pieces = pieces(t);
    std::array::from_fn(|rate| {
        let mut values: Vec<f64> = conditions.iter().map(|c| rates(c)[rate]).collect();
        let share = white_variance(&values) / mean_square(&values).max(f64::MIN_POSITIVE);
        let (_, length) = SMOOTHING.into_iter().rev().find(|(least, _)| share > *least)?;
        pieces.iter().for_each(|piece| smooth(t, &mut values, piece.clone(), length));
        conditions.iter_mut().zip(values).for_each(|(condition, value)| set(condition, rate, value));
        Some(length)
    })
}

/// How rates go into the regression: by parabolas over so many seconds, means of bins, and passes over these.
pub(super) struct Filtered<'a> {
    pub t: &'a [f64],
    /// Window of each rate that was smoothed [s].
    pub smoothed: [Option<f64>; 6],
    pub bins: &'a [Range<usize>],
    pub runs: &'a [Range<usize>],
    /// Passes of `[1 2 1] / 4` over the bins.
    pub passes: usize,
}

/// The same states with what is expected of the true rates: each scaled by `E[true x recorded] / E[recorded^2]` of what goes
/// into the regression, which is the share of signal in it, and more where smoothing took peaks off. A law in proportion to
/// such a rate comes out neither pulled down by the noise nor weighed by trials that hold noise alone (regression
/// calibration; Carroll, Ruppert, Stefanski, Crainiceanu, Measurement Error in Nonlinear Models, chapter 4). What
/// remembers has averaged the noise already and takes the rates as they are.
pub(super) fn calibrated(
    conditions: &[Condition],
    coherence: &[Coherence],
    filtered: &Filtered,
) -> Vec<Condition> {
    /// Most that smoothing can have taken off.
    const MOST: f64 = 1.5;
    let mut calibrated = conditions.to_vec();
    for (rate, coherence) in coherence.iter().enumerate().take(6) {
        let values: Vec<f64> = conditions.iter().map(|c| rates(c)[rate]).collect();
        let recorded = filtered.mean_square(&values).max(f64::MIN_POSITIVE);
        let factor = (filtered.common(coherence, filtered.smoothed[rate]) / recorded).clamp(0.0, MOST);
        calibrated.iter_mut().zip(values).for_each(|(condition, value)| set(condition, rate, value * factor));
    }
    calibrated
}

impl Filtered<'_> {
    /// Of values that were smoothed already, after all else.
    fn mean_square(&self, values: &[f64]) -> f64 {
        let mean = |bin: &Range<usize>| bin.clone().map(|i| values[i]).sum::<f64>() / bin.len() as f64;
        let mut bins: Vec<f64> = self.bins.iter().map(mean).collect();
        self.runs.iter().for_each(|run| passes(&mut bins[run.clone()], self.passes));
        mean_square(&bins)
    }

    /// Mean product of what the signal and what the record become: of all that is done, smoothing is done to the record alone.
    fn common(&self, coherence: &Coherence, smoothed: Option<f64>) -> f64 {
        let samples = self.t.len() as f64 / self.bins.len().max(1) as f64;
        let (samples, step) = (samples.round().max(1.0) as usize, mean_step(self.t));
        let reach = samples * (2 * self.passes + 1);
        let window = smoothed.map_or(1, |length| window(length, step));
        let signal = |lag: usize| coherence.covariances.get(lag).copied().unwrap_or(0.0);
        let both_ways = reach + window / 2;
        let mut covariances: Vec<f64> =
            (0..=2 * both_ways).map(|i| signal(i.abs_diff(both_ways))).collect();
        if let Ok(filter) = SavitzkyGolay::new(window, 2)
            && let Ok(smoothed) = filter.smooth(&covariances)
        {
            covariances = smoothed;
        }
        // of the means of two bins, so many bins apart
        let of_bins = |apart: usize| -> f64 {
            let pair = |(i, j): (usize, usize)| covariances[both_ways + apart * samples + i - j];
            let pairs = (0..samples).flat_map(|i| (0..samples).map(move |j| (i, j)));
            pairs.map(pair).sum::<f64>() / (samples * samples) as f64
        };
        // passes over both are twice the passes over one; a pass is a binomial distribution over bins
        let mut weights = vec![0.0; 4 * self.passes + 1];
        weights[2 * self.passes] = 1.0;
        for _ in 0..2 * self.passes {
            let before = weights.clone();
            let at = |i: Option<usize>| i.and_then(|i| before.get(i)).copied().unwrap_or(0.0);
            weights.iter_mut().enumerate().for_each(|(i, weight)| {
                *weight = 0.25 * (at(i.checked_sub(1)) + 2.0 * before[i] + at(Some(i + 1)));
            });
        }
        let weighed = weights.iter().enumerate();
        weighed.map(|(i, weight)| weight * of_bins(i.abs_diff(2 * self.passes))).sum()
    }
}

fn mean_step(t: &[f64]) -> f64 {
    (t[t.len() - 1] - t[0]) / (t.len().max(2) - 1) as f64
}

/// Odd number of samples that take so many seconds.
fn window(length: f64, step: f64) -> usize {
    (length / step.max(1e-6)) as usize | 1
}

fn set(condition: &mut Condition, rate: usize, value: f64) {
    match rate {
        0..3 => condition.acceleration[rate] = value + turning(condition)[rate],
        _ => condition.angular_acceleration[rate - 3] = value,
    }
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64
}

fn smooth(t: &[f64], values: &mut [f64], piece: std::ops::Range<usize>, length: f64) {
    let odd = (piece.len() - 1) / 2 * 2 + 1;
    let window = window(length, mean_step(&t[piece.clone()])).min(odd);
    let smoothed = SavitzkyGolay::new(window, 2).and_then(|f| f.smooth(&values[piece.clone()]));
    if let Ok(smoothed) = smoothed {
        values[piece].copy_from_slice(&smoothed);
    }
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
        let wave = |i: usize| 2.0 * noise.sqrt() * (3.0 * t[i]).sin();
        let both = Coherence::of(&t, |i| filtered[i] + wave(i));
        // the wave's mean square is twice that of the noise
        assert!((both.signal / (2.0 * noise) - 1.0).abs() < 0.05, "{both:?} {noise}");
        // changes of speed that take 0.6 s, as smooth as a driver's, every two seconds
        let change = |i: usize| {
            let u = (t[i] % 2.0 / 0.6).min(1.0);
            30.0 * (u * (1.0 - u)).powi(2)
        };
        let power = (0..t.len()).map(|i| change(i).powi(2)).sum::<f64>() / t.len() as f64;
        let pushes = Coherence::of(&t, change);
        assert!((pushes.signal / power - 1.0).abs() < 0.1, "{pushes:?} {power}");
        let alone = Coherence::of(&t, |i| filtered[i]);
        assert!(alone.covariance / alone.power < 0.05 && alone.signal < 0.05 * noise, "{alone:?} {noise}");
    }
}
