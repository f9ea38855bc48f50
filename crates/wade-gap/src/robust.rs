//! Standard errors that hold where the noise of a trial hangs together.
//!
//! Where enough trials excite a column: the sandwich over trials (Liang and Zeger, Biometrika 1986); rows of one trial may
//! depend on each other in any way, and Student's degrees of freedom are the effective number of trials. A column that few
//! trials excite has hardly any scatter between trials to be judged by. There the noise is judged by the autocovariance of
//! the residual of all trials together, up to two seconds (Newey and West, Econometrica 1987, with pooled covariances), or
//! by the sandwich over blocks where that is larger.

use std::cell::OnceCell;

use nalgebra::DVector;

use super::design::Design;
use super::statistics::{normal_from_student, normal_tails};

/// Trials that must excite a column, in effect, before the scatter between them is trusted.
const ENOUGH_TRIALS: f64 = 8.0;
/// Bins over which noise may hang together.
const LAGS: usize = 20;

/// What is known of a scaled coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Error {
    /// Standard error.
    pub std: f64,
    /// Degrees of freedom that the standard error has where nothing is there.
    pub freedom: f64,
    /// Effective number of trials that excite the column.
    pub trials: f64,
    /// The same of blocks.
    pub blocks: f64,
}

impl Error {
    /// Normal deviate that is as rare as the estimate.
    pub fn deviate(&self, estimate: f64) -> f64 {
        if self.std <= 0.0 {
            return 0.0;
        }
        normal_from_student((estimate / self.std).abs(), self.freedom)
    }

    /// Probability of such an estimate where nothing is there.
    pub fn probability(&self, estimate: f64) -> f64 {
        normal_tails(self.deviate(estimate))
    }
}

/// Standard errors of a fit.
pub(super) fn errors(design: &Design, columns: &[usize], residual: &DVector<f64>) -> Option<Vec<Error>> {
    let inverse = design.inverse(columns)?;
    let noise = Noise::of(residual);
    let of = |index: usize| {
        // the weight of each row in the estimate
        let mut weights = DVector::zeros(residual.len());
        for (other, &column) in columns.iter().enumerate() {
            weights.axpy(inverse[(index, other)], &design.x.column(column), 1.0);
        }
        noise.error(design, &weights, design.x.column(columns[index]).as_slice())
    };
    Some((0..columns.len()).map(of).collect())
}

/// The error of the sum that a group of columns adds, as one column of coefficient 1 beside a base: what a group says as a
/// whole, where its columns point much the same way and none is certain by itself.
pub(super) fn group(
    design: &Design,
    base: &[usize],
    own: &[usize],
    beta: &[f64],
    residual: &DVector<f64>,
) -> Option<Error> {
    Some(of_column(design, &contribution(design, base, own, beta)?, residual))
}

/// The error of the coefficient of a single column that is no part of the design.
fn of_column(design: &Design, column: &DVector<f64>, residual: &DVector<f64>) -> Error {
    let weights = column / column.norm_squared().max(f64::MIN_POSITIVE);
    Noise::of(residual).error(design, &weights, column.as_slice())
}

/// What columns add to the rows that a base cannot say.
pub(super) fn contribution(
    design: &Design,
    base: &[usize],
    own: &[usize],
    beta: &[f64],
) -> Option<DVector<f64>> {
    let mut sum = total(design, own, beta);
    let weights = shadow(design, base, own, beta)?;
    base.iter().zip(&weights).for_each(|(&c, &weight)| sum.axpy(-weight, &design.x.column(c), 1.0));
    Some(sum)
}

/// The coefficients of a base that say of a sum of columns what they can.
pub(super) fn shadow(design: &Design, base: &[usize], own: &[usize], beta: &[f64]) -> Option<Vec<f64>> {
    if base.is_empty() {
        return Some(Vec::new());
    }
    let sum = total(design, own, beta);
    let cross = DVector::from_iterator(base.len(), base.iter().map(|&c| design.x.column(c).dot(&sum)));
    Some((design.inverse(base)? * cross).as_slice().to_vec())
}

/// A sum of columns.
fn total(design: &Design, own: &[usize], beta: &[f64]) -> DVector<f64> {
    let mut sum = DVector::zeros(design.y.len());
    own.iter().zip(beta).for_each(|(&column, &beta)| sum.axpy(beta, &design.x.column(column), 1.0));
    sum
}

/// Variance of a weighted sum of rows under the autocovariance of a residual.
pub(super) fn noise_of(design: &Design, residual: &DVector<f64>, weights: &DVector<f64>) -> f64 {
    Noise::of(residual).pooled(design, weights)
}

/// A residual, with its autocovariance by component and lag over all trials once that is asked for.
struct Noise<'a> {
    residual: &'a DVector<f64>,
    covariance: OnceCell<Vec<[f64; LAGS]>>,
}

impl<'a> Noise<'a> {
    fn of(residual: &'a DVector<f64>) -> Self {
        Self { residual, covariance: OnceCell::new() }
    }

    fn covariance(&self, design: &Design) -> Vec<[f64; LAGS]> {
        let width = design.rows.width;
        let mut sums = vec![[0.0; LAGS]; width];
        let mut counts = vec![[0.0; LAGS]; width];
        for rows in &design.rows.of_trial {
            for component in 0..width {
                let values = strided(&self.residual.as_slice()[rows.clone()], component, width);
                for lag in 0..LAGS.min(values.len()) {
                    sums[component][lag] += product(&values, lag);
                    counts[component][lag] += (values.len() - lag) as f64;
                }
            }
        }
        // Bartlett's weights keep the sum positive
        let taper = |lag: usize| 1.0 - lag as f64 / LAGS as f64;
        let of = |(s, n): (&[f64; LAGS], &[f64; LAGS])| {
            std::array::from_fn(|lag| taper(lag) * s[lag] / f64::max(n[lag], 1.0))
        };
        sums.iter().zip(&counts).map(of).collect()
    }

    fn error(&self, design: &Design, weights: &DVector<f64>, column: &[f64]) -> Error {
        let rows = &design.rows;
        let energy: Vec<f64> =
            rows.of_trial.iter().map(|r| column[r.clone()].iter().map(|v| v * v).sum()).collect();
        let (mut by_block, mut of_block) = (vec![0.0; rows.blocks], vec![0.0; rows.blocks]);
        let part = |row: usize| weights[row] * self.residual[row];
        for (row, place) in rows.rows.iter().enumerate() {
            by_block[place.block] += part(row);
            of_block[place.block] += column[row] * column[row];
        }
        let (trials, blocks) = (effective(&energy), effective(&of_block));
        // never less than that of rows in which the model is as wrong as it says
        let least = design.noise.stated() * weights.norm_squared();
        if trials >= ENOUGH_TRIALS {
            let by_trial: Vec<f64> = rows.of_trial.iter().map(|r| r.clone().map(part).sum()).collect();
            let variance = sandwich(&by_trial).max(least);
            return Error { std: variance.sqrt(), freedom: trials - 1.0, trials, blocks };
        }
        // where nothing is there the noise is that of all blocks together, which the scatter of a few can only exceed
        let variance = self.pooled(design, weights).max(sandwich(&by_block)).max(least);
        Error { std: variance.sqrt(), freedom: rows.blocks as f64 - 1.0, trials, blocks }
    }

    /// Variance of a weighted sum of noise with the pooled autocovariance.
    fn pooled(&self, design: &Design, weights: &DVector<f64>) -> f64 {
        let covariance = self.covariance.get_or_init(|| self.covariance(design));
        let width = design.rows.width;
        let mut variance = 0.0;
        for rows in &design.rows.of_trial {
            for (component, covariance) in covariance.iter().enumerate() {
                let values = strided(&weights.as_slice()[rows.clone()], component, width);
                if values.iter().all(|v| *v == 0.0) {
                    continue;
                }
                for (lag, covariance) in covariance.iter().enumerate().take(values.len()) {
                    let both = if lag == 0 { 1.0 } else { 2.0 };
                    variance += both * covariance * product(&values, lag);
                }
            }
        }
        variance.max(0.0)
    }
}

/// The rows of one component.
pub(super) fn strided(rows: &[f64], component: usize, width: usize) -> Vec<f64> {
    rows.iter().skip(component).step_by(width).copied().collect()
}

/// Sum of the products of values so many places apart.
fn product(values: &[f64], lag: usize) -> f64 {
    values[..values.len() - lag].iter().zip(&values[lag..]).map(|(a, b)| a * b).sum()
}

fn sandwich(parts: &[f64]) -> f64 {
    let used = parts.iter().filter(|part| **part != 0.0).count().max(2) as f64;
    parts.iter().map(|part| part * part).sum::<f64>() * used / (used - 1.0)
}

/// `(sum e)^2 / sum e^2`: as many clusters of equal energy would scatter as much.
fn effective(energies: &[f64]) -> f64 {
    let (sum, squares) = energies.iter().fold((0.0, 0.0), |(s, q), e| (s + e, q + e * e));
    if squares > 0.0 { sum * sum / squares } else { 0.0 }
}
