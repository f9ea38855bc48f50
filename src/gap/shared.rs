//! Noise of the motion that stands in the gap as well as in a column.
//!
//! A prediction is made for the motion that was recorded, so the recording's noise stands in the gap, and in every column
//! that is made of the same motion. The two then agree sample by sample though nothing is missing (errors in variables;
//! Fuller, Measurement Error Models, section 1.1). What an effect explains hangs together in time for longer than such
//! noise, or is more than the product of the two noises can be (Cauchy and Schwarz).

use std::ops::Range;

use nalgebra::DVector;

use super::design::Design;
use super::robust::strided;
use super::statistics::white_variance;

/// Share of the product of a column and the gap that must hang together.
const LASTS: f64 = 0.5;

/// True where what a sum of columns and a residual have in common outlasts the noise of a bin.
pub(super) fn outlasts_noise(design: &Design, sum: &DVector<f64>, residual: &DVector<f64>) -> bool {
    let reach = reach(design.noise.smoothing);
    let at = |lag: usize| common(design, sum, residual, lag);
    let (near, far) = (at(reach), at(2 * reach));
    // a parabola back to no lag
    near + (near - far) / 3.0 > LASTS * at(0)
}

/// Bins beyond which noise that was white, and smoothed, has forgotten itself: each pass adds one to the variance of its
/// autocovariance.
fn reach(smoothing: usize) -> usize {
    1 + (1.5 * (smoothing as f64).sqrt()).ceil() as usize
}

/// True where a sum of columns and a residual have more in common than its noise and that of `source` can have, through
/// which the motion's noise comes into the gap; rows that were not smoothed.
pub(super) fn exceeds_noise(
    design: &Design,
    sum: &DVector<f64>,
    residual: &DVector<f64>,
    source: &DVector<f64>,
) -> bool {
    let noise = |rows: &DVector<f64>, trial: &Range<usize>, component: usize| {
        let values = strided(&rows.as_slice()[trial.clone()], component, design.rows.width);
        white_variance(&values) * values.len() as f64
    };
    // of each trial by itself: what is noisy in one has nothing in common with another
    let bound = |trial: &Range<usize>| -> f64 {
        let of = |component| (noise(sum, trial, component) * noise(source, trial, component)).sqrt();
        (0..design.rows.width).map(of).sum()
    };
    let most: f64 = design.rows.of_trial.iter().map(bound).sum();
    (1.0 - LASTS) * common(design, sum, residual, 0) > most
}

/// Sum of the products of two rows of a component that are so many bins apart, either way.
fn common(design: &Design, a: &DVector<f64>, b: &DVector<f64>, lag: usize) -> f64 {
    let rows = &design.rows;
    let of = |trial: &Range<usize>| -> f64 {
        let apart = (lag * rows.width).min(trial.len());
        let pairs = (trial.start..trial.end - apart).map(|row| (row, row + apart));
        pairs.map(|(first, second)| 0.5 * (a[first] * b[second] + a[second] * b[first])).sum()
    };
    rows.of_trial.iter().map(of).sum()
}
