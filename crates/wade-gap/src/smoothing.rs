//! Smoothing of what goes into the regression: the same over the gap and every column, so that none is favored.
//!
//! A rate that was differentiated is mostly noise from sample to sample. Two running means take that off before bins are
//! made, which a filter of bins could not: what bins have let through as slow stays. Each component is smoothed by what its
//! own rate needs, as little as will do, since the bursts of a maneuver are as short as the filters are long.

use super::rates::mean_step;
use super::series::Series;

/// Lengths of a running mean to choose from [s].
pub(super) const LENGTHS: [f64; 6] = [0.0, 0.1, 0.14, 0.2, 0.28, 0.4];

/// Two running means and a bin; the length of each mean by component [s].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Smoothing(pub [f64; 6]);

impl Smoothing {
    /// Means of bins of a component's values, smoothed.
    pub fn bins(&self, series: &Series, component: usize, value: impl Fn(usize) -> f64) -> Vec<f64> {
        bins(series, self.0[component], value)
    }

    /// Bins beyond which noise that was white, and smoothed, has forgotten itself, by component.
    pub fn reach(&self, bin: f64) -> [usize; 6] {
        // two running means have a sixth of the square of their length for a variance, and their autocovariance twice that
        self.0.map(|length| 1 + (0.87 * length / bin).ceil() as usize)
    }
}

/// Samples of a bin.
pub(super) fn samples_of_bin(series: &Series) -> usize {
    (series.bin_step() / mean_step(&series.t).max(1e-6)).round().max(1.0) as usize
}

/// Means of bins of some values that were smoothed by two running means within each stretch without a hole.
pub(super) fn bins(series: &Series, length: f64, value: impl Fn(usize) -> f64) -> Vec<f64> {
    if length == 0.0 {
        return series.binned(value);
    }
    let values = smoothed(series, length, value);
    series.binned(|sample| values[sample])
}

/// Values that were smoothed by two running means of a length [s] within each stretch without a hole.
pub(super) fn smoothed(series: &Series, length: f64, value: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut values: Vec<f64> = (0..series.t.len()).map(value).collect();
    let half = half(length, mean_step(&series.t));
    for piece in series.pieces() {
        running_mean(&mut values[piece.clone()], half);
        running_mean(&mut values[piece], half);
    }
    values
}

/// Samples to either side of a running mean of some seconds.
pub(super) fn half(length: f64, step: f64) -> usize {
    (0.5 * length / step.max(1e-6)).round() as usize
}

/// Means over so many samples to either side, as far as there are any.
pub(super) fn running_mean(values: &mut [f64], half: usize) {
    if half == 0 {
        return;
    }
    let mut sums = Vec::with_capacity(values.len() + 1);
    let mut sum = 0.0;
    sums.push(sum);
    for value in values.iter() {
        sum += value;
        sums.push(sum);
    }
    let count = values.len();
    for (i, value) in values.iter_mut().enumerate() {
        let (first, end) = (i.saturating_sub(half), (i + half + 1).min(count));
        *value = (sums[end] - sums[first]) / (end - first) as f64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_running_mean_keeps_a_line_and_the_sum_of_what_is_far_from_the_ends() {
        let mut line: Vec<f64> = (0..40).map(f64::from).collect();
        running_mean(&mut line, 5);
        assert!(line[5..35].iter().enumerate().all(|(i, value)| (value - (i + 5) as f64).abs() < 1e-12));
        // at the ends the mean of what there is
        assert!((line[0] - 2.5).abs() < 1e-12 && (line[39] - 36.5).abs() < 1e-12);
        let mut pulse = vec![0.0; 40];
        pulse[20] = 1.0;
        running_mean(&mut pulse, 5);
        running_mean(&mut pulse, 5);
        assert!((pulse.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn noise_has_forgotten_itself_beyond_the_reach() {
        // autocorrelation of bins of 0.1 s at 110 Hz
        for length in LENGTHS {
            let half = half(length, 1.0 / 110.0);
            let reach = Smoothing([length; 6]).reach(0.1)[0];
            let mut response = vec![0.0; 400];
            response[200..211].fill(1.0);
            running_mean(&mut response, half);
            running_mean(&mut response, half);
            let at = |lag: usize| response.iter().zip(&response[lag..]).map(|(a, b)| a * b).sum::<f64>();
            assert!(at(11 * reach) < 0.25 * at(0), "{length} s, {reach} bins: {}", at(11 * reach) / at(0));
        }
    }
}
