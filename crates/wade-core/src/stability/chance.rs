//! Probabilities over what is not known of a wrench and of friction.

use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::LazyLock;

/// How many times each state is drawn. Over states with deviations of up to a fifth of the weight in every component the probabilities
/// are within 0.005 (root mean square) and 0.03 (the worst of 60) of those of a hundred thousand random draws, as a test shows.
const COUNT: usize = 256;

/// Deviations beyond which the probability is 0 or 1 in double precision.
const CERTAIN: f64 = 8.5;

/// One draw of what is not known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Draw {
    /// Standard normal.
    pub(super) normals: [f64; 5],
    /// Between 0 and 1, each as likely.
    pub(super) share: f64,
}

/// The same draws for every state, so that a map is smooth: a lattice of the generalized golden ratio in six dimensions, and its
/// mirror image, whose normals have a mean of exactly zero.
pub(super) static DRAWS: LazyLock<[Draw; COUNT]> = LazyLock::new(|| {
    // the root of x^7 = x + 1; its powers fill the space evenly (Roberts, 2018)
    let ratio = (0..64).fold(1.1_f64, |x, _| (1.0 + x).powf(1.0 / 7.0));
    std::array::from_fn(|i| {
        let lattice = |dimension: i32| ((i / 2 + 1) as f64 * ratio.powi(-dimension) + 0.5).fract();
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        let normals = [1, 2, 3, 4, 5].map(|dimension| sign * quantile(lattice(dimension)));
        let share = if i % 2 == 0 { lattice(6) } else { 1.0 - lattice(6) };
        Draw { normals, share }
    })
});

/// Probability that a normal quantity of this mean and deviation is below a limit.
pub(super) fn below(limit: f64, mean: f64, deviation: f64) -> f64 {
    let gap = limit - mean;
    if gap.abs() >= CERTAIN * deviation {
        return if gap > 0.0 { 1.0 } else { 0.0 };
    }
    0.5 * libm::erfc(-gap / deviation * FRAC_1_SQRT_2)
}

/// The standard normal quantity below which this probability lies, by bisection.
fn quantile(probability: f64) -> f64 {
    let mut range = [-CERTAIN, CERTAIN];
    for _ in 0..60 {
        let middle = 0.5 * (range[0] + range[1]);
        range[usize::from(below(middle, 0.0, 1.0) > probability)] = middle;
    }
    range[0]
}
