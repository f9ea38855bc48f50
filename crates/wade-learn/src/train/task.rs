//! Everything that the epochs need: what is learnt from and looked at as rows, sizes of the layers, and what is minimised.

use nalgebra::DMatrix;
use sha2::{Digest, Sha256};

use super::layers::Sizes;
use super::loss::{Batch, TargetScale};
use super::samples::Sample;
use super::variant::{Objective, Rows, Variant};
use super::{Config, TrainError};
use wade_core::digest::hexadecimal;
use wade_core::features::GLOBAL;
use wade_core::model::network::Scaling;

/// A training that has not begun.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Sizes of the layers.
    pub sizes: Sizes,
    /// What the weights learn from.
    pub training: Vec<Rows>,
    /// What the loss is looked at besides: what sets the pace of the paper's network, and nothing of the anchored one.
    pub validation: Vec<Rows>,
    /// What is minimised.
    pub objective: Objective,
    /// Inputs that never vary in training, of which nothing can be learnt.
    pub constant: Vec<usize>,
}

impl Task {
    /// Rows to learn from and to be looked at, standardised by the former alone.
    pub fn new(
        variant: Variant,
        training: &[Sample],
        validation: &[Sample],
        config: &Config,
    ) -> Result<(Self, Scaling), TrainError> {
        if training.is_empty() || validation.is_empty() {
            let side = if training.is_empty() { "training" } else { "validation" };
            return Err(TrainError::EmptySide { side });
        }
        let view = |side: &[Sample]| side.iter().map(|sample| variant.view(sample)).collect::<Vec<_>>();
        let (training, validation) = (view(training), view(validation));
        let scaling = scaling(&training);
        let rows = |side: &[Sample]| {
            side.iter().map(|view| variant.rows(view, &scaling, config.loss.dry_fraction)).collect()
        };
        let constant = |i: &usize| training.windows(2).all(|pair| pair[0].global[*i] == pair[1].global[*i]);
        let task = Self {
            sizes: variant.sizes(),
            training: rows(&training),
            validation: rows(&validation),
            objective: Objective::Paper {
                config: config.loss,
                scale: TargetScale { std: scaling.target_std, mean: scaling.target_mean },
            },
            constant: (0..GLOBAL).filter(constant).filter_map(|i| variant.input_of_global(i)).collect(),
        };
        Ok((task, scaling))
    }

    /// Columns of some samples of one vehicle.
    pub fn batch(&self, samples: &[&Rows]) -> Result<Batch<f32>, TrainError> {
        let Some(first) = samples.first() else { return Err(TrainError::EmptyBatch) };
        if let Some(other) = samples.iter().find(|rows| rows.vehicle != first.vehicle) {
            return Err(TrainError::MixedBatch { vehicles: [first.vehicle, other.vehicle] });
        }
        let surfaces = first.dry.len();
        let columns = samples.len() * surfaces;
        let matrix = |rows, of: fn(&Rows) -> &[f32]| {
            DMatrix::from_iterator(rows, columns, samples.iter().flat_map(|s| of(s).iter().copied()))
        };
        Ok(Batch {
            surfaces,
            inputs: matrix(self.sizes.inputs, |rows| &rows.inputs),
            targets: matrix(self.objective.targets(), |rows| &rows.targets),
            dry: samples.iter().flat_map(|rows| rows.dry.iter().copied()).collect(),
        })
    }

    /// SHA-256 of all that the bits of the weights depend on but the number of epochs.
    pub fn digest(&self, config: &Config) -> String {
        let mut hash = Sha256::new();
        for rows in self.training.iter().chain(&self.validation) {
            hash.update(rows.vehicle.to_le_bytes());
            rows.inputs.iter().chain(&rows.targets).for_each(|x| hash.update(x.to_le_bytes()));
        }
        hash.update(self.training.len().to_le_bytes());
        let config = Config { epochs: 1, threads: 1, ..config.clone() };
        hash.update(format!("{:?} {config:?} {:?}", self.sizes, self.objective));
        hexadecimal(&hash.finalize())
    }
}

/// Means and standard deviations over the training side.
fn scaling(training: &[Sample]) -> Scaling {
    let global = moments(training.iter().map(|sample| sample.global));
    let target = moments(training.iter().flat_map(|sample| sample.targets.iter().copied()));
    Scaling {
        global_mean: global.0.map(|x| x as f32),
        global_std: global.1.map(|x| x as f32),
        target_mean: target.0.map(|x| x as f32),
        target_std: target.1.map(|x| x as f32),
    }
}

/// Mean and standard deviation of each component; 1 for the deviation of a constant, which then becomes zero.
pub(super) fn moments<const N: usize>(rows: impl Iterator<Item = [f64; N]> + Clone) -> ([f64; N], [f64; N]) {
    let count = rows.clone().count() as f64;
    let mean: [f64; N] = std::array::from_fn(|i| rows.clone().map(|row| row[i]).sum::<f64>() / count);
    let deviation = std::array::from_fn(|i| {
        let variance = rows.clone().map(|row| (row[i] - mean[i]).powi(2)).sum::<f64>() / count;
        // what rounding leaves of a constant is no deviation
        if variance.sqrt() > 1e-9 * mean[i].abs() { variance.sqrt() } else { 1.0 }
    });
    (mean, deviation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_population_and_guard_constants() {
        let rows = [[1.0, 0.1, 0.0], [3.0, 0.1, 0.0]];
        assert_eq!(moments(rows.into_iter()), ([2.0, 0.1, 0.0], [1.0, 1.0, 1.0]));
    }
}
