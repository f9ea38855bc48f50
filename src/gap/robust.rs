//! Standard errors that hold where the noise of a trial hangs together.
//!
//! Where enough trials excite a column: the sandwich over trials (Liang and Zeger, Biometrika 1986); rows of one trial may
//! depend on each other in any way, and Student's degrees of freedom are the effective number of trials. A column that few
//! trials excite has hardly any scatter between trials to be judged by. There the noise is judged by the autocovariance of
//! the residual of all trials together, up to two seconds (Newey and West, Econometrica 1987, with pooled covariances), or
//! by the sandwich over blocks where that is larger.

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
    /// Degrees of freedom that the standard error itself has.
    pub freedom: f64,
    /// Effective number of trials that excite the column.
    pub trials: f64,
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
    let noise = Noise::of(design, residual);
    let of = |index: usize| {
        // the weight of each row in the estimate
        let mut weights = DVector::zeros(residual.len());
        for (other, &column) in columns.iter().enumerate() {
            weights.axpy(inverse[(index, other)], &design.x.column(column), 1.0);
        }
        noise.error(design, &weights, &design.x.column(columns[index]).into_owned(), residual)
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
    let mut sum = DVector::zeros(residual.len());
    own.iter().zip(beta).for_each(|(&column, &beta)| sum.axpy(beta, &design.x.column(column), 1.0));
    if !base.is_empty() {
        let cross = DVector::from_iterator(base.len(), base.iter().map(|&c| design.x.column(c).dot(&sum)));
        let weights = design.inverse(base)? * cross;
        base.iter().enumerate().for_each(|(i, &c)| sum.axpy(-weights[i], &design.x.column(c), 1.0));
    }
    let weights = &sum / sum.norm_squared().max(f64::MIN_POSITIVE);
    Some(Noise::of(design, residual).error(design, &weights, &sum, residual))
}

/// Variance of a weighted sum of rows under the autocovariance of a residual.
pub(super) fn noise_of(design: &Design, residual: &DVector<f64>, weights: &DVector<f64>) -> f64 {
    Noise::of(design, residual).pooled(design, weights)
}

/// Autocovariance of a residual by component and lag, over all trials.
struct Noise {
    covariance: Vec<[f64; LAGS]>,
    /// Rows between a bin and the next.
    width: usize,
}

impl Noise {
    fn of(design: &Design, residual: &DVector<f64>) -> Self {
        let rows = &design.rows.rows;
        let width =
            rows.iter().take_while(|row| row.bin == rows[0].bin && row.trial == rows[0].trial).count();
        let mut sums = vec![[0.0; LAGS]; width];
        let mut counts = vec![[0.0; LAGS]; width];
        for (start, end) in trials(design) {
            for row in start..end {
                for lag in 0..LAGS.min((end - row).div_ceil(width)) {
                    let place = (row - start) % width;
                    sums[place][lag] += residual[row] * residual[row + lag * width];
                    counts[place][lag] += 1.0;
                }
            }
        }
        // Bartlett's weights keep the sum positive
        let taper = |lag: usize| 1.0 - lag as f64 / LAGS as f64;
        let covariance = sums
            .iter()
            .zip(&counts)
            .map(|(s, n)| std::array::from_fn(|lag| taper(lag) * s[lag] / f64::max(n[lag], 1.0)))
            .collect();
        Self { covariance, width }
    }

    fn error(
        &self,
        design: &Design,
        weights: &DVector<f64>,
        column: &DVector<f64>,
        residual: &DVector<f64>,
    ) -> Error {
        let rows = &design.rows;
        let count = rows.block_trial.iter().max().map_or(0, |last| last + 1);
        let (mut by_trial, mut by_block) = (vec![0.0; count], vec![0.0; rows.blocks]);
        let mut energy = vec![0.0; count];
        for (row, place) in rows.rows.iter().enumerate() {
            let part = weights[row] * residual[row];
            by_trial[place.trial] += part;
            by_block[place.block] += part;
            energy[place.trial] += column[row] * column[row];
        }
        let trials = effective(&energy);
        if trials >= ENOUGH_TRIALS {
            return Error { std: sandwich(&by_trial).sqrt(), freedom: trials - 1.0, trials };
        }
        let variance = self.pooled(design, weights).max(sandwich(&by_block));
        Error { std: variance.sqrt(), freedom: rows.blocks as f64 - 1.0, trials }
    }

    /// Variance of a weighted sum of noise with the pooled autocovariance.
    fn pooled(&self, design: &Design, weights: &DVector<f64>) -> f64 {
        let mut variance = 0.0;
        for (start, end) in trials(design) {
            for row in start..end {
                if weights[row] == 0.0 {
                    continue;
                }
                let covariance = &self.covariance[(row - start) % self.width];
                for lag in 0..LAGS.min((end - row).div_ceil(self.width)) {
                    let both = if lag == 0 { 1.0 } else { 2.0 };
                    variance += both * covariance[lag] * weights[row] * weights[row + lag * self.width];
                }
            }
        }
        variance.max(0.0)
    }
}

/// First row of each trial and that after its last.
fn trials(design: &Design) -> Vec<(usize, usize)> {
    let rows = &design.rows.rows;
    let starts: Vec<usize> =
        (0..rows.len()).filter(|&row| row == 0 || rows[row].trial != rows[row - 1].trial).collect();
    let ends = starts.iter().skip(1).copied().chain([rows.len()]);
    starts.iter().copied().zip(ends).collect()
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
