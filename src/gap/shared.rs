//! Noise of the motion that stands in the gap as well as in a column.
//!
//! A prediction is made for the motion that was recorded, so the recording's noise stands in the gap, and in every column
//! that is made of the same motion. The two then agree sample by sample though nothing is missing (errors in variables;
//! Fuller, Measurement Error Models, section 1.1). What an effect explains hangs together in time for longer than such
//! noise: a coefficient is asked for again from products of rows so far apart that their noise has nothing in common, with
//! the column's own past and future as instruments (Reiersol, Econometrica 1941), and must be most of what it was.

use nalgebra::DVector;

use super::design::Design;

/// Share of the coefficient that must be left without the noise.
const LASTS: f64 = 0.5;
/// Share of a column's square that must hang together beyond its noise; blows of entry keep a fifth.
const SIGNAL: f64 = 0.1;
/// Distances in bins over which products are taken, from the first beyond the noise on.
const WINDOW: usize = 8;

/// True where what a sum of columns says of a target, which has the rows of the design, outlasts the noise of a bin.
pub(super) fn outlasts_noise(design: &Design, sum: &DVector<f64>, target: &DVector<f64>) -> bool {
    let first = reach(design.noise.smoothing);
    let at = |lag: usize| common(design, sum, sum, lag);
    let (near, far) = (at(first), at(2 * first));
    // a parabola back to no lag, as for a rate
    if near + (near - far) / 3.0 < SIGNAL * at(0) {
        return false;
    }
    let products = (first..first + WINDOW).map(|lag| (at(lag), common(design, sum, target, lag)));
    let (own, both) = products.fold((0.0, 0.0), |(own, both), (a, b)| (own + a * a, both + a * b));
    both > LASTS * own
}

/// Bins beyond which noise has forgotten itself: that of a bin reaches the next one, since rates are differences, and each
/// pass of smoothing adds one to the variance of its autocovariance.
fn reach(smoothing: usize) -> usize {
    1 + ((1.5 * (smoothing as f64).sqrt()).ceil() as usize).max(1)
}

/// Sum of the products of two rows of a component that are so many bins apart, either way.
fn common(design: &Design, a: &DVector<f64>, b: &DVector<f64>, lag: usize) -> f64 {
    let rows = &design.rows;
    let of = |trial: &std::ops::Range<usize>| -> f64 {
        let apart = (lag * rows.width).min(trial.len());
        let pairs = (trial.start..trial.end - apart).map(|row| (row, row + apart));
        pairs.map(|(first, second)| 0.5 * (a[first] * b[second] + a[second] * b[first])).sum()
    };
    rows.of_trial.iter().map(of).sum()
}
