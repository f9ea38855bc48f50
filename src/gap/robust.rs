//! Standard errors that hold where the noise of a trial hangs together.
//!
//! The sandwich over clusters (Liang and Zeger, Biometrika 1986): rows of one cluster may depend on each other in any way.
//! Clusters are trials where enough of them excite a column, else blocks, since a column that one trial alone excites has
//! no scatter between trials. Student's degrees of freedom are the effective number of clusters, so that a column carried
//! by few is trusted little.

use nalgebra::DVector;

use super::design::Design;
use super::statistics::{normal_from_student, normal_tails};

/// Trials that must excite a column, in effect, before they are the clusters.
const ENOUGH_TRIALS: f64 = 8.0;

/// What is known of a scaled coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Error {
    /// Standard error.
    pub std: f64,
    /// Effective number of clusters.
    pub clusters: f64,
    /// Effective number of trials that excite the column.
    pub trials: f64,
}

impl Error {
    /// Normal deviate that is as rare as the estimate.
    pub fn deviate(&self, estimate: f64) -> f64 {
        if self.std <= 0.0 {
            return 0.0;
        }
        normal_from_student((estimate / self.std).abs(), self.clusters - 1.0)
    }

    /// Probability of such an estimate where nothing is there.
    pub fn probability(&self, estimate: f64) -> f64 {
        normal_tails(self.deviate(estimate))
    }
}

/// Standard errors of a fit.
pub(super) fn errors(design: &Design, columns: &[usize], residual: &DVector<f64>) -> Option<Vec<Error>> {
    let inverse = design.inverse(columns)?;
    let count = columns.len();
    let rows = &design.rows;
    let mut block_scores = vec![0.0; rows.blocks * count];
    let mut block_energy = vec![0.0; rows.blocks * count];
    for (index, &column) in columns.iter().enumerate() {
        let values = design.x.column(column);
        for (row, place) in rows.rows.iter().enumerate() {
            let value = values[row];
            block_scores[place.block * count + index] += value * residual[row];
            block_energy[place.block * count + index] += value * value;
        }
    }
    let by_trial = |values: &[f64]| {
        let trials = rows.block_trial.iter().max().map_or(0, |last| last + 1);
        let mut sums = vec![0.0; trials * count];
        for (block, &trial) in rows.block_trial.iter().enumerate() {
            (0..count).for_each(|i| sums[trial * count + i] += values[block * count + i]);
        }
        sums
    };
    let (trial_scores, trial_energy) = (by_trial(&block_scores), by_trial(&block_energy));
    let variance = |scores: &[f64], index: usize| {
        let clusters = scores.chunks(count).filter(|s| s.iter().any(|v| *v != 0.0)).count().max(2) as f64;
        let influence =
            |s: &[f64]| (0..count).map(|other| inverse[(index, other)] * s[other]).sum::<f64>().powi(2);
        scores.chunks(count).map(influence).sum::<f64>() * clusters / (clusters - 1.0)
    };
    let of = |index: usize| {
        let trials = effective(trial_energy.iter().skip(index).step_by(count));
        let blocks = effective(block_energy.iter().skip(index).step_by(count));
        if trials >= ENOUGH_TRIALS {
            Error { std: variance(&trial_scores, index).sqrt(), clusters: trials, trials }
        } else {
            Error { std: variance(&block_scores, index).sqrt(), clusters: blocks, trials }
        }
    };
    Some((0..count).map(of).collect())
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
    let rows = &design.rows;
    let (mut scores, mut energy) = (vec![0.0; rows.blocks], vec![0.0; rows.blocks]);
    for (row, place) in rows.rows.iter().enumerate() {
        scores[place.block] += sum[row] * residual[row];
        energy[place.block] += sum[row] * sum[row];
    }
    let trials = rows.block_trial.iter().max().map_or(0, |last| last + 1);
    let by_trial = |values: &[f64]| {
        let mut sums = vec![0.0; trials];
        values.iter().zip(&rows.block_trial).for_each(|(value, &trial)| sums[trial] += value);
        sums
    };
    let trial_energy = by_trial(&energy);
    let (in_trials, in_blocks) = (effective(trial_energy.iter()), effective(energy.iter()));
    let (scores, clusters) =
        if in_trials >= ENOUGH_TRIALS { (by_trial(&scores), in_trials) } else { (scores, in_blocks) };
    let whole: f64 = energy.iter().sum();
    let used = scores.iter().filter(|s| **s != 0.0).count().max(2) as f64;
    let variance = scores.iter().map(|s| s * s).sum::<f64>() * used / (used - 1.0);
    Some(Error { std: variance.sqrt() / whole.max(f64::MIN_POSITIVE), clusters, trials: in_trials })
}

/// `(sum e)^2 / sum e^2`: as many clusters of equal energy would scatter as much.
fn effective<'a>(energies: impl Iterator<Item = &'a f64>) -> f64 {
    let (sum, squares) = energies.fold((0.0, 0.0), |(s, q), e| (s + e, q + e * e));
    if squares > 0.0 { sum * sum / squares } else { 0.0 }
}
