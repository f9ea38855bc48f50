//! The source paper's loss (section "Loss Function and Optimization") and its gradient by the outputs.

use nalgebra::{DMatrix, convert};
use serde::{Deserialize, Serialize};

use super::layers::Real;
use wade_core::model::network::{OUTPUTS, Scaling};

/// Weights of the terms; the defaults are the paper's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LossConfig {
    /// Share of the relative error in the hybrid term [-].
    pub alpha: f64,
    /// Least magnitude of a standardised target that a relative error is taken of [-].
    pub epsilon: f64,
    /// Weight of the net force.
    pub net_weight: f64,
    /// Weight of the forces on dry surfaces.
    pub dry_weight: f64,
    /// A surface of which less than this share is under water counts as dry [-].
    pub dry_fraction: f32,
}

impl Default for LossConfig {
    fn default() -> Self {
        Self { alpha: 0.5, epsilon: 0.01, net_weight: 0.1, dry_weight: 0.5, dry_fraction: 0.01 }
    }
}

/// Some samples of one vehicle, a column a surface: `surfaces` columns a sample, one sample after another.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch<T> {
    /// Surfaces of the vehicle, K.
    pub surfaces: usize,
    /// Input rows of the network, `[inputs, samples * K]`.
    pub inputs: DMatrix<T>,
    /// Standardised force over density, `[OUTPUTS, samples * K]`.
    pub targets: DMatrix<T>,
    /// True for the columns that count as dry.
    pub dry: Vec<bool>,
}

/// What the means of the loss are taken over: a batch that is worked on in parts has the counts of the whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// Samples.
    pub samples: usize,
    /// Surfaces of all samples.
    pub columns: usize,
    /// Those of them that count as dry.
    pub dry: usize,
}

impl<T> Batch<T> {
    /// Its counts, where it is the whole.
    pub fn counts(&self) -> Counts {
        let (columns, dry) = (self.dry.len(), self.dry.iter().filter(|dry| **dry).count());
        Counts { samples: columns / self.surfaces, columns, dry }
    }
}

/// Standard deviation and mean of force over density [m4/s2].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetScale<T> {
    /// Standard deviation.
    pub std: [T; OUTPUTS],
    /// Mean.
    pub mean: [T; OUTPUTS],
}

impl TargetScale<f32> {
    /// The scale that a network's targets were standardised with.
    pub fn of(scaling: &Scaling) -> Self {
        Self { std: scaling.target_std, mean: scaling.target_mean }
    }
}

/// The terms of the loss before they are weighted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Terms {
    /// `sum e^2 / 3BK` with `e` the error of a standardised component.
    pub squared: f64,
    /// `sum (e / max(|target|, epsilon))^2 / 3BK`.
    pub relative: f64,
    /// `sum over samples |sum over surfaces of the error of F/rho|^2 / 3B` [(m4/s2)^2].
    pub net: f64,
    /// `sum over dry surfaces |F/rho|^2 / 3D`, D of them [(m4/s2)^2]. The paper states no formula for this one.
    pub dry: f64,
}

impl Terms {
    /// `(1 - alpha) squared + alpha relative + net_weight net + dry_weight dry`.
    pub fn total(&self, config: &LossConfig) -> f64 {
        let hybrid = (1.0 - config.alpha) * self.squared + config.alpha * self.relative;
        hybrid + config.net_weight * self.net + config.dry_weight * self.dry
    }
}

/// The terms for a network's `output`, and the gradient of their total by it; of a part of a batch, its share in those of
/// the whole, which has `counts`.
///
/// A surface without a wet sample is served as exact zero whatever the network says, so in service the dry penalty
/// shapes only surfaces that are wet by less than `dry_fraction`. It is kept because it is part of the published loss.
pub fn loss<T: Real>(
    config: &LossConfig,
    scale: &TargetScale<T>,
    batch: &Batch<T>,
    counts: &Counts,
    output: &DMatrix<T>,
) -> (Terms, DMatrix<T>) {
    let mut gradient = DMatrix::zeros(OUTPUTS, output.ncols());
    let error = output - &batch.targets;
    let (squared, relative) = hybrid(config, batch, counts, &error, &mut gradient);
    let net = net(config, scale, (batch.surfaces, counts), &error, &mut gradient);
    let dry = dry(config, scale, (&batch.dry, counts), output, &mut gradient);
    (Terms { squared, relative, net, dry }, gradient)
}

fn hybrid<T: Real>(
    config: &LossConfig,
    batch: &Batch<T>,
    counts: &Counts,
    error: &DMatrix<T>,
    gradient: &mut DMatrix<T>,
) -> (f64, f64) {
    let count = (OUTPUTS * counts.columns) as f64;
    let epsilon: T = convert(config.epsilon);
    let [plain, by_target] =
        [1.0 - config.alpha, config.alpha].map(|share| convert::<f64, T>(2.0 * share / count));
    let (mut squared, mut relative) = (T::zero(), T::zero());
    for ((g, e), target) in gradient.iter_mut().zip(error.iter()).zip(batch.targets.iter()) {
        let weight = target.abs().max(epsilon).powi(-2);
        squared += *e * *e;
        relative += *e * *e * weight;
        *g += *e * (plain + by_target * weight);
    }
    (double(squared) / count, double(relative) / count)
}

fn net<T: Real>(
    config: &LossConfig,
    scale: &TargetScale<T>,
    (k, counts): (usize, &Counts),
    error: &DMatrix<T>,
    gradient: &mut DMatrix<T>,
) -> f64 {
    let count = (OUTPUTS * counts.samples) as f64;
    let factor: T = convert(2.0 * config.net_weight / count);
    let mut sum = T::zero();
    for first in (0..error.ncols()).step_by(k) {
        for c in 0..OUTPUTS {
            let difference = error.row(c).columns(first, k).sum() * scale.std[c];
            sum += difference * difference;
            gradient.row_mut(c).columns_mut(first, k).add_scalar_mut(factor * difference * scale.std[c]);
        }
    }
    double(sum) / count
}

fn dry<T: Real>(
    config: &LossConfig,
    scale: &TargetScale<T>,
    (is_dry, counts): (&[bool], &Counts),
    output: &DMatrix<T>,
    gradient: &mut DMatrix<T>,
) -> f64 {
    let count = (OUTPUTS * counts.dry).max(1) as f64;
    let factor: T = convert(2.0 * config.dry_weight / count);
    let mut sum = T::zero();
    for (column, _) in is_dry.iter().enumerate().filter(|(_, dry)| **dry) {
        for c in 0..OUTPUTS {
            let force = output[(c, column)] * scale.std[c] + scale.mean[c];
            sum += force * force;
            gradient[(c, column)] += factor * force * scale.std[c];
        }
    }
    double(sum) / count
}

fn double<T: Real>(value: T) -> f64 {
    value.to_subset().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One sample of two surfaces, the second dry: errors 1, 0, 2 and 0, -0.5, 0.
    fn worked() -> (Batch<f64>, TargetScale<f64>, DMatrix<f64>) {
        let batch = Batch {
            surfaces: 2,
            inputs: DMatrix::zeros(0, 2),
            targets: DMatrix::from_column_slice(3, 2, &[0.5, 1.0, -2.0, 0.0, 0.5, -1.0]),
            dry: vec![false, true],
        };
        let output = DMatrix::from_column_slice(3, 2, &[1.5, 1.0, 0.0, 0.0, 0.0, -1.0]);
        (batch, TargetScale { std: [2.0, 4.0, 1.0], mean: [1.0, -1.0, 0.5] }, output)
    }

    #[test]
    fn terms_are_those_worked_by_hand() {
        let (batch, scale, output) = worked();
        let (terms, _) = loss(&LossConfig::default(), &scale, &batch, &batch.counts(), &output);
        assert!((terms.squared - (1.0 + 4.0 + 0.25) / 6.0).abs() < 1e-12);
        assert!((terms.relative - (4.0 + 1.0 + 1.0) / 6.0).abs() < 1e-12);
        assert!((terms.net - (2.0_f64.powi(2) + 2.0_f64.powi(2) + 2.0_f64.powi(2)) / 3.0).abs() < 1e-12);
        // dry: 0 * 2 + 1, 0 * 4 - 1, -1 * 1 + 0.5
        assert!((terms.dry - (1.0 + 1.0 + 0.25) / 3.0).abs() < 1e-12);
        let total = 0.5 * 0.875 + 0.5 * 1.0 + 0.1 * 4.0 + 0.5 * 0.75;
        assert!((terms.total(&LossConfig::default()) - total).abs() < 1e-12);
    }

    #[test]
    fn the_relative_error_is_floored() {
        let (mut batch, scale, output) = worked();
        batch.targets.fill(0.0);
        let (terms, _) = loss(&LossConfig::default(), &scale, &batch, &batch.counts(), &output);
        assert!((terms.relative - 1e4 * terms.squared).abs() < 1e-6);
    }

    #[test]
    fn the_shares_of_the_parts_add_up_to_the_whole() {
        let (one, scale, output) = worked();
        let twice =
            |m: &DMatrix<f64>| DMatrix::from_fn(3, 4, |r, c| m[(r, c % 2)] * if c < 2 { 1.0 } else { 0.3 });
        let dry = vec![false, true, true, true];
        let whole =
            Batch { targets: twice(&one.targets), dry: dry.clone(), inputs: DMatrix::zeros(0, 4), ..one };
        let output = twice(&output);
        let config = LossConfig::default();
        let (terms, gradient) = loss(&config, &scale, &whole, &whole.counts(), &output);
        let mut total = 0.0;
        for first in [0, 2] {
            let part = Batch {
                targets: whole.targets.columns(first, 2).into_owned(),
                dry: dry[first..first + 2].to_vec(),
                inputs: DMatrix::zeros(0, 2),
                ..whole
            };
            let output = output.columns(first, 2).into_owned();
            let (share, by_output) = loss(&config, &scale, &part, &whole.counts(), &output);
            total += share.total(&config);
            assert_eq!(by_output, gradient.columns(first, 2));
        }
        assert!((total - terms.total(&config)).abs() < 1e-12);
    }

    #[test]
    fn no_dry_surface_is_no_penalty() {
        let (mut batch, scale, output) = worked();
        batch.dry = vec![false, false];
        assert_eq!(loss(&LossConfig::default(), &scale, &batch, &batch.counts(), &output).0.dry, 0.0);
    }
}
