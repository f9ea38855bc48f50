//! Small numbers about numbers.

use wade_learn::signal;

/// Median; 0 for none.
pub(super) fn median(values: &mut [f64]) -> f64 {
    signal::median(values).unwrap_or(0.0)
}

/// Quantile by the nearest rank; 0 for none.
pub(super) fn quantile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share).round() as usize]
}

/// Variance of white noise on an otherwise smooth signal, from third differences, which a parabola has none of:
/// `var(x0 - 3 x1 + 3 x2 - x3) = 20 var(noise)`.
pub(super) fn white_variance(values: &[f64]) -> f64 {
    if values.len() < 4 {
        return 0.0;
    }
    let squares = values.windows(4).map(|w| (w[0] - 3.0 * w[1] + 3.0 * w[2] - w[3]).powi(2));
    squares.sum::<f64>() / (20.0 * (values.len() - 3) as f64)
}

/// The same from the median of the squares, which bursts of the signal do not reach as long as they are seldom.
pub(super) fn quiet_white_variance(values: &[f64]) -> f64 {
    /// Median of the square of a normal variable.
    const MEDIAN: f64 = 0.454_936;
    if values.len() < 4 {
        return 0.0;
    }
    let squares = values.windows(4).map(|w| (w[0] - 3.0 * w[1] + 3.0 * w[2] - w[3]).powi(2));
    median(&mut squares.collect::<Vec<_>>()) / (20.0 * MEDIAN)
}

/// Normal deviate that 19 of 20 are below, and that 90 % lie within on both sides.
pub(super) const Z90: f64 = 1.645;

/// Least share of the standard deviation of colored noise that [`noise_variance`] sees: that of a mean of five samples, whose
/// spectrum is steep, in the limit of many samples.
pub(super) const SEEN_OF_COLORED_NOISE: f64 = 0.82;

/// The same of the slowest noise that sensors have, an Ornstein-Uhlenbeck process with a correlation time of half a second, where
/// the octaves end at 0.08 s.
pub(super) const SEEN_OF_SLOW_NOISE: f64 = 0.25;

/// Variance of noise on an otherwise smooth signal, be it colored down to `2^scales` samples: motion that is filtered before
/// something is predicted from it leaves noise in which neighbors agree, and [`white_variance`] hardly sees that.
///
/// The white variance `w_j` of means over `2^j` samples is what noise has a band above and below; each halving of the rate
/// parts off one octave, `sum over j < J of w_j / 2 + w_J`, and the last stands for all below it. Third differences speak of
/// the upper edge of an octave, so that noise with a steep spectrum comes out too small still, by a sixth after a mean of five.
pub(super) fn noise_variance(values: &[f64], scales: u32) -> f64 {
    /// Means that are enough for a variance.
    const ENOUGH: usize = 16;
    let mut means = values.to_vec();
    let mut above = 0.0;
    for _ in 0..scales {
        if means.len() < 2 * ENOUGH {
            break;
        }
        above += 0.5 * white_variance(&means);
        means = means.chunks_exact(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    }
    above + white_variance(&means)
}

/// Probability that a normal variable is further from 0 than `z`, both sides (Abramowitz and Stegun 7.1.26, and its
/// asymptotic form beyond 5, where the former has lost its digits).
pub(super) fn normal_tails(z: f64) -> f64 {
    let x = z.abs() / std::f64::consts::SQRT_2;
    if x > 3.5 {
        return (-x * x).exp() / (x * std::f64::consts::PI.sqrt()) * (1.0 - 0.5 / (x * x));
    }
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let polynomial = t
        * (0.254_829_592
            + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    (polynomial * (-x * x).exp()).max(0.0)
}

/// Deviate that is exceeded, both sides, with a probability.
pub(super) fn deviate_of(probability: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    while high - low > 1e-6 {
        let middle = 0.5 * (low + high);
        if normal_tails(middle) > probability { low = middle } else { high = middle }
    }
    low
}

/// Normal deviate as rare as Student's `t` with `freedom` degrees (Wallace 1959, as in Johnson and Kotz).
pub(super) fn normal_from_student(t: f64, freedom: f64) -> f64 {
    let n = freedom.max(1.0);
    let root = (n * (1.0 + t * t / n).ln()).sqrt();
    (8.0 * n + 1.0) / (8.0 * n + 3.0) * root
}

/// Student's `t` with `freedom` degrees that is as rare as a normal deviate: the inverse of [`normal_from_student`].
pub(super) fn student_from_normal(z: f64, freedom: f64) -> f64 {
    let n = freedom.max(1.0);
    let root = z * (8.0 * n + 3.0) / (8.0 * n + 1.0);
    (n * (root * root / n).exp_m1()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_agree_with_the_tables() {
        for (z, p) in [(1.959_964, 0.05), (2.575_829, 0.01), (4.891_638, 1e-6), (6.109_41, 1e-9)] {
            assert!((normal_tails(z) / p - 1.0).abs() < 0.02, "{z}");
        }
        // Student's two-sided 1 % point for 10 degrees is 3.169, for 50 degrees 2.678
        for (t, freedom) in [(3.169, 10.0), (2.678, 50.0)] {
            assert!((normal_tails(normal_from_student(t, freedom)) / 0.01 - 1.0).abs() < 0.05);
        }
        // and the two-sided 10 % points for 5, 10 and 50 degrees
        for (t, freedom) in [(2.015, 5.0), (1.812, 10.0), (1.676, 50.0)] {
            assert!((student_from_normal(1.645, freedom) / t - 1.0).abs() < 0.01, "{freedom}");
        }
    }

    #[test]
    fn white_noise_is_told_from_a_parabola() {
        let mut random = wade_learn::random::Random::new(1);
        let values: Vec<f64> = (0..4000)
            .map(|i| (random.unit() - 0.5) * 12_f64.sqrt() * 2.0 + 1e-3 * f64::from(i * i) / 100.0)
            .collect();
        assert!((white_variance(&values).sqrt() - 2.0).abs() < 0.1);
        assert!((noise_variance(&values, 3).sqrt() - 2.0).abs() < 0.1);
    }

    #[test]
    fn seldom_bursts_are_no_noise() {
        let mut random = wade_learn::random::Random::new(4);
        let burst = |i: usize| if i % 50 < 2 { 20.0 } else { 0.0 };
        let values: Vec<f64> = (0..4000).map(|i| burst(i) + 12_f64.sqrt() * (random.unit() - 0.5)).collect();
        assert!(
            (quiet_white_variance(&values).sqrt() - 1.0).abs() < 0.2,
            "{}",
            quiet_white_variance(&values)
        );
        assert!(white_variance(&values).sqrt() > 2.0);
    }

    #[test]
    fn of_noise_that_is_correlated_for_half_a_second_a_quarter_is_seen() {
        for (rate, scales) in [(37.0, 1), (100.0, 3), (400.0, 5)] {
            let mut random = wade_learn::random::Random::new(3);
            let kept = f64::exp(-2.0 / rate);
            let mut state = 0.0;
            let values: Vec<f64> = (0..200_000)
                .map(|_| {
                    let white = (random.unit() - 0.5) * 12_f64.sqrt();
                    state = kept * state + (1.0 - kept * kept).sqrt() * white;
                    state
                })
                .collect();
            let seen = noise_variance(&values, scales).sqrt();
            assert!(
                (SEEN_OF_SLOW_NOISE - 0.05..SEEN_OF_SLOW_NOISE + 0.05).contains(&seen),
                "{rate} Hz: {seen}"
            );
        }
    }

    #[test]
    fn noise_that_a_filter_has_colored_keeps_its_size() {
        // the mean of five, as a filter of motion leaves it, on a slow wave
        let mut random = wade_learn::random::Random::new(2);
        let white: Vec<f64> = (0..20_000).map(|_| (random.unit() - 0.5) * 12_f64.sqrt()).collect();
        let wave = |i: usize| 3.0 * (i as f64 / 400.0).sin();
        let values: Vec<f64> =
            white.windows(5).enumerate().map(|(i, w)| w.iter().sum::<f64>() / 5.0 + wave(i)).collect();
        let exact = 1.0 / 5_f64.sqrt();
        assert!(white_variance(&values).sqrt() < 0.6 * exact);
        // in the limit of many samples 0.848: w_0 to w_3 of a mean of five by their autocovariances
        let colored = noise_variance(&values, 3).sqrt() / exact;
        assert!((SEEN_OF_COLORED_NOISE..0.88).contains(&colored), "{colored}");
    }
}
