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
use super::statistics::quiet_white_variance;

/// Share of the product of a column and the gap that must hang together.
const LASTS: f64 = 0.5;
/// Share of it that must be more than noise can have in common. What noise can is a bound already, reached only where the two
/// noises are one; the rest is for how well they are known.
const BEYOND: f64 = 1.0 / 3.0;

/// True where what a sum of columns and a residual have in common outlasts the noise of a bin.
pub(super) fn outlasts_noise(design: &Design, sum: &DVector<f64>, residual: &DVector<f64>) -> bool {
    let reach = design.reach;
    let at = |times: usize| common(design, sum, residual, &reach.map(|bins| times * bins));
    let (near, far) = (at(1), at(2));
    // a parabola back to no lag
    near + (near - far) / 3.0 > LASTS * at(0)
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
        quiet_white_variance(&values) * values.len() as f64
    };
    // of each trial by itself: what is noisy in one has nothing in common with another
    let bound = |trial: &Range<usize>| -> f64 {
        let of = |component| (noise(sum, trial, component) * noise(source, trial, component)).sqrt();
        (0..design.rows.width).map(of).sum()
    };
    let most: f64 = design.rows.of_trial.iter().map(bound).sum();
    (1.0 - BEYOND) * common(design, sum, residual, &[0; 6]) > most
}

/// Sum of the products of two rows of a component that are so many bins apart, either way; the bins by component.
fn common(design: &Design, a: &DVector<f64>, b: &DVector<f64>, lags: &[usize; 6]) -> f64 {
    let rows = &design.rows;
    let of = |trial: &Range<usize>| -> f64 {
        let second = |row: usize| row + lags[rows.rows[row].component] * rows.width;
        let pairs = trial.clone().map(|row| (row, second(row))).filter(|(_, second)| *second < trial.end);
        pairs.map(|(first, second)| 0.5 * (a[first] * b[second] + a[second] * b[first])).sum()
    };
    rows.of_trial.iter().map(of).sum()
}
