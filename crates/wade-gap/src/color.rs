//! The color of the noise of a wrench that was inferred from motion.
//!
//! Noise of a recorded place that is white stands in an acceleration as its second difference, so that almost none of it is slow:
//! over a second the impulse `m dv` says a hundred times more of a force than a sample of `m a` does. The spectrum of the noise in
//! means of bins is taken as `S(w) = s0 + s1 d + s2 d^2`, `d = 2 - 2 cos w`: white noise of a force, differences of a velocity, and
//! second differences of a place. It is fitted to the median over the runs of their periodograms, which is `ln 2` times the mean
//! (Whittle, J. Roy. Stat. Soc. B 15, 1953), above the frequencies of maneuvers. Rows are multiplied by the inverse of the
//! Cholesky factor of its covariance (generalised least squares; Aitken 1935), which is of two lags.

use super::series::Series;
use super::smoothing::samples_of_bin;
use super::statistics::{median, quiet_white_variance};

/// What changes faster is noise [Hz].
const FAST: f64 = 0.5;
/// Parts of the spectrum.
const BANDS: usize = 20;
/// Fewest parts that hold noise alone.
const LEAST_BANDS: usize = 4;
/// Fewest bins of a run that has a spectrum.
const LEAST_BINS: usize = 16;
/// Power over that of noise up to which a part of the spectrum is noise: it then says as little as noise does.
const ABOVE: f64 = 2.0;

/// Noise of the bins of a component.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Color {
    /// Variances: white, of differences, of second differences.
    parts: [f64; 3],
    /// Length of the means over which the gap stands above the noise [s]; none where it nowhere does.
    pub above_s: Option<f64>,
}

impl Color {
    /// Of the gap of some trials in one component.
    pub fn of(all: &[Series], trials: &[usize], component: usize) -> Option<Self> {
        let bin = all[*trials.first()?].bin_step();
        let points = spectrum(all, trials, component);
        let fast: Vec<[f64; 2]> = points.iter().copied().filter(|[f, _]| *f >= FAST * bin).collect();
        if fast.len() < LEAST_BANDS || fast.iter().any(|[_, power]| *power <= 0.0) {
            return None;
        }
        let parts = fitted(&fast);
        let is_noise =
            |&[frequency, power]: &[f64; 2]| power < ABOVE * power_of(parts, difference(frequency));
        let first = points.iter().position(is_noise).unwrap_or(points.len());
        // up to the middle between the last that stands above and the first that does not
        let above_s = (first > 0).then(|| {
            let end =
                points.get(first).map_or(0.5, |[frequency, _]| 0.5 * (frequency + points[first - 1][0]));
            0.5 * bin / end
        });
        let known = known(all, trials, component);
        Some(Self { parts: [parts[0].max(known), parts[1], parts[2]], above_s })
    }

    /// Makes the noise in a run of bins white and of unit variance; `more` is the standard deviation of white noise that each bin
    /// has besides, if it has any.
    pub fn whiten(&self, values: &mut [f64], more: &[f64]) {
        let [s0, s1, s2] = self.parts;
        let covariance = [s0 + 2.0 * s1 + 6.0 * s2, -s1 - 4.0 * s2, s2];
        // rows of the factor: two before the diagonal, and it
        let mut before = [[0.0; 3]; 2];
        let mut whitened = [0.0; 2];
        for (i, value) in values.iter_mut().enumerate() {
            let [far, near] = before;
            let a = if i >= 2 { covariance[2] / far[2] } else { 0.0 };
            let b = if i >= 1 { (covariance[1] - a * near[1]) / near[2] } else { 0.0 };
            let own = covariance[0] + more.get(i).map_or(0.0, |more| more * more);
            let c = (own - a * a - b * b).max(1e-12 * own).sqrt();
            *value = (*value - a * whitened[0] - b * whitened[1]) / c;
            whitened = [whitened[1], *value];
            before = [near, [a, b, c]];
        }
    }
}

/// The spectrum of the gap of some trials in one component.
fn spectrum(all: &[Series], trials: &[usize], component: usize) -> Vec<[f64; 2]> {
    let values = |&trial: &usize| all[trial].binned(|sample| all[trial].gap[sample][component]);
    let gaps: Vec<Vec<f64>> = trials.iter().map(values).collect();
    let runs = trials
        .iter()
        .zip(&gaps)
        .flat_map(|(&trial, gap)| all[trial].runs.iter().map(|run| &gap[run.clone()]));
    powers(runs)
}

/// Frequencies in cycles a bin, and the power of each part of the spectrum: the median of all runs.
fn powers<'a>(runs: impl Iterator<Item = &'a [f64]>) -> Vec<[f64; 2]> {
    let mut bands = vec![Vec::new(); BANDS];
    for (frequency, power) in runs.filter(|run| run.len() >= LEAST_BINS).flat_map(periodogram) {
        bands[((2.0 * frequency * BANDS as f64) as usize).min(BANDS - 1)].push((frequency, power));
    }
    let of = |band: &Vec<(f64, f64)>| {
        let frequency = band.iter().map(|(frequency, _)| frequency).sum::<f64>() / band.len() as f64;
        let power = median(&mut band.iter().map(|(_, power)| *power).collect::<Vec<_>>());
        [frequency, power / std::f64::consts::LN_2]
    };
    bands.iter().filter(|band| !band.is_empty()).map(of).collect()
}

fn power_of([s0, s1, s2]: [f64; 3], d: f64) -> f64 {
    s0 + s1 * d + s2 * d * d
}

/// `2 - 2 cos w` of a frequency in cycles a bin.
fn difference(frequency: f64) -> f64 {
    2.0 - 2.0 * (std::f64::consts::TAU * frequency).cos()
}

/// Least divergence of Itakura and Saito, which is Whittle's likelihood, by multiplication (Fevotte, Bertin, Durrieu, Neural
/// Computation 21, 2009).
fn fitted(points: &[[f64; 2]]) -> [f64; 3] {
    const TIMES: usize = 400;
    let basis = |d: f64| [1.0, d, d * d];
    let mean = points.iter().map(|[_, power]| power).sum::<f64>() / points.len() as f64;
    let mut s = [mean; 3].map(|mean| mean / 3.0);
    for _ in 0..TIMES {
        let (mut up, mut down) = ([0.0; 3], [0.0; 3]);
        for &[frequency, power] in points {
            let d = difference(frequency);
            let (basis, spectrum) = (basis(d), power_of(s, d));
            for k in 0..3 {
                up[k] += basis[k] * power / (spectrum * spectrum);
                down[k] += basis[k] / spectrum;
            }
        }
        (0..3).for_each(|k| s[k] *= up[k] / down[k]);
    }
    s
}

/// Frequencies in cycles a bin and powers of a run, tapered (Hann), so that what is slow does not leak.
fn periodogram(values: &[f64]) -> Vec<(f64, f64)> {
    let count = values.len();
    let taper = |i: usize| (std::f64::consts::PI * (i as f64 + 0.5) / count as f64).sin().powi(2);
    let mean = values.iter().sum::<f64>() / count as f64;
    let energy: f64 = (0..count).map(|i| taper(i).powi(2)).sum();
    let of = |k: usize| {
        let frequency = k as f64 / count as f64;
        let mut sum = [0.0; 2];
        for (i, value) in values.iter().enumerate() {
            let (sine, cosine) = (std::f64::consts::TAU * frequency * i as f64).sin_cos();
            let tapered = taper(i) * (value - mean);
            sum = [sum[0] + tapered * cosine, sum[1] + tapered * sine];
        }
        (frequency, (sum[0] * sum[0] + sum[1] * sum[1]) / energy)
    };
    (1..=count / 2).map(of).collect()
}

/// Variance of a bin of what stands in the gap and is white: the noise of the prediction for the recorded motion, of which a filter
/// makes neighbors agree, and that of the known forces.
fn known(all: &[Series], trials: &[usize], component: usize) -> f64 {
    let mut sums = [0.0; 2];
    for &trial in trials {
        let series = &all[trial];
        let of = |source: &[[f64; 6]]| source.iter().map(|values| values[component]).collect::<Vec<f64>>();
        let predicted = quiet_white_variance(&of(&series.predicted));
        let other = quiet_white_variance(&of(&series.other)) / samples_of_bin(series) as f64;
        let bins = series.bins.len() as f64;
        sums = [sums[0] + (predicted + other) * bins, sums[1] + bins];
    }
    sums[0] / f64::max(sums[1], 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::quiet_white_variance;
    use wade_learn::random::Random;

    /// Noise with parts of some variance, in runs of so many bins.
    fn noise([s0, s1, s2]: [f64; 3], runs: usize, bins: usize) -> Vec<Vec<f64>> {
        let mut random = Random::new(7);
        let mut white = |variance: f64| -> Vec<f64> {
            (0..bins + 2).map(|_| (12.0 * variance).sqrt() * (random.unit() - 0.5)).collect()
        };
        let mut run = || {
            let [a, b, c] = [white(s0), white(s1), white(s2)];
            (0..bins).map(|i| a[i] + b[i + 1] - b[i] + c[i + 2] - 2.0 * c[i + 1] + c[i]).collect()
        };
        (0..runs).map(|_| run()).collect()
    }

    fn points(runs: &[Vec<f64>]) -> Vec<[f64; 2]> {
        powers(runs.iter().map(Vec::as_slice))
    }

    #[test]
    fn the_parts_of_a_noise_are_found_whatever_is_slow_in_a_few_runs() {
        for truth in [[4.0, 0.0, 0.0], [0.5, 30.0, 0.0], [2.0, 0.0, 40.0]] {
            let mut runs = noise(truth, 40, 200);
            for run in &mut runs[..5] {
                run.iter_mut().enumerate().for_each(|(i, value)| *value += 200.0 * (0.05 * i as f64).sin());
            }
            let fast: Vec<[f64; 2]> = points(&runs).into_iter().filter(|[f, _]| *f >= 0.05).collect();
            let found = fitted(&fast);
            for frequency in [0.03, 0.1, 0.2, 0.4] {
                let of = |parts| power_of(parts, difference(frequency));
                assert!((of(found) / of(truth) - 1.0).abs() < 0.3, "{truth:?}: {found:?} at {frequency}");
            }
        }
    }

    #[test]
    fn whitened_noise_is_white_and_of_unit_variance() {
        let parts = [0.3, 5.0, 8.0];
        let color = Color { parts, above_s: None };
        let mut runs = noise(parts, 60, 150);
        // every other bin has white noise of its own
        let more: Vec<f64> = (0..150).map(|bin| f64::from(bin % 2) * 4.0).collect();
        let mut random = Random::new(8);
        runs.iter_mut().for_each(|run| {
            let of_bin = |more: &f64| more * 12.0_f64.sqrt() * (random.unit() - 0.5);
            run.iter_mut().zip(more.iter().map(of_bin)).for_each(|(value, own)| *value += own);
            color.whiten(run, &more);
        });
        let power = |lag: usize| {
            let pairs = runs.iter().flat_map(|run| run.iter().zip(&run[lag..]));
            pairs.map(|(a, b)| a * b).sum::<f64>() / 9000.0
        };
        assert!((power(0) - 1.0).abs() < 0.05, "{}", power(0));
        assert!((1..6).all(|lag| power(lag).abs() < 0.05), "{:?}", [1, 2, 3, 4, 5].map(power));
        // a third difference of white noise has 20 times its variance
        let rough: f64 = runs.iter().map(|run| quiet_white_variance(run)).sum::<f64>() / 60.0;
        assert!((rough - 1.0).abs() < 0.1, "{rough}");
    }
}
