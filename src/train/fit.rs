//! The epochs: batches in random order, gradient steps, a look at the held-out loss.

use nalgebra::DMatrix;

use super::adam::{Adam, Plateau};
use super::layers::Layers;
use super::loss::{Batch, TargetScale, loss};
use super::samples::{Dataset, Sample};
use super::{Config, TrainError};
use crate::features::{GLOBAL, INPUTS};
use crate::model::network::{Network, OUTPUTS, Scaling, WIDTH};
use crate::random::Random;

/// Samples a batch when only the loss is wanted; the paper's figure.
const HELD_OUT_BATCH: usize = 64;

/// What an epoch came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Epoch {
    /// Number, from 1.
    pub number: u32,
    /// Mean loss over the training samples, each taken when its batch was.
    pub training_loss: f64,
    /// Mean loss over the held-out samples after the epoch.
    pub held_out_loss: f64,
    /// Learning rate of the epoch.
    pub learning_rate: f64,
}

/// A training under way: all that a resumed run would need.
pub struct Fit<'a> {
    data: &'a Dataset,
    config: &'a Config,
    scaling: Scaling,
    layers: Layers<f32>,
    gradient: Vec<f32>,
    adam: Adam,
    plateau: Plateau,
    random: Random,
    epochs: u32,
}

impl<'a> Fit<'a> {
    /// Standardises by the training side and draws the first weights.
    pub fn new(data: &'a Dataset, config: &'a Config, random: &mut Random) -> Result<Self, TrainError> {
        let mut layers = Layers::random(WIDTH, &mut random.fork());
        for (index, _) in data.constant_globals().iter().enumerate().filter(|(_, constant)| **constant) {
            layers.silence(INPUTS - GLOBAL + index);
        }
        Ok(Self {
            data,
            config,
            scaling: data.scaling()?,
            gradient: vec![0.0; layers.parameters.len()],
            adam: Adam::new(layers.parameters.len()),
            layers,
            plateau: Plateau::new(config.learning_rate, config.patience),
            random: random.fork(),
            epochs: 0,
        })
    }

    /// True after the last epoch, or when the learning rate has become too small to matter.
    pub fn is_over(&self) -> bool {
        self.epochs >= self.config.epochs || self.plateau.rate < self.config.least_learning_rate
    }

    /// One pass over the training samples.
    pub fn epoch(&mut self) -> Result<Epoch, TrainError> {
        self.epochs += 1;
        let learning_rate = self.plateau.rate;
        let batches = batches(&self.data.training, self.config.batch, Some(&mut self.random));
        let training_loss = mean_over(&batches, |samples| self.step(samples));
        let held_out_loss = self.held_out_loss();
        if !(training_loss.is_finite() && held_out_loss.is_finite()) {
            return Err(TrainError::Diverged { epoch: self.epochs });
        }
        self.plateau.observe(held_out_loss);
        Ok(Epoch { number: self.epochs, training_loss, held_out_loss, learning_rate })
    }

    /// Loss of a batch, after which the weights have moved.
    fn step(&mut self, samples: &[&Sample]) -> f64 {
        let batch = self.batch(samples);
        let activations = self.layers.forward(&batch.inputs);
        let (terms, by_output) =
            loss(&self.config.loss, &TargetScale::of(&self.scaling), &batch, &activations.output);
        self.layers.backward(&batch.inputs, &activations, &by_output, &mut self.gradient);
        self.adam.step(self.plateau.rate, &mut self.layers.parameters, &self.gradient);
        terms.total(&self.config.loss)
    }

    fn held_out_loss(&self) -> f64 {
        mean_over(&batches(&self.data.held_out, HELD_OUT_BATCH, None), |samples| {
            let batch = self.batch(samples);
            let output = self.layers.forward(&batch.inputs).output;
            loss(&self.config.loss, &TargetScale::of(&self.scaling), &batch, &output)
                .0
                .total(&self.config.loss)
        })
    }

    /// Columns of some samples of one vehicle.
    fn batch(&self, samples: &[&Sample]) -> Batch<f32> {
        let surfaces = samples.first().map_or(1, |sample| sample.surfaces.len());
        let columns = samples.iter().map(|sample| sample.surfaces.len()).sum();
        let (mut inputs, mut targets) =
            (Vec::with_capacity(INPUTS * columns), Vec::with_capacity(OUTPUTS * columns));
        for sample in samples {
            let global = self.scaling.standardize(&sample.global);
            for (row, target) in sample.surfaces.iter().zip(&sample.targets) {
                inputs.extend(row.iter().chain(&global));
                targets.extend(standardized(target, &self.scaling));
            }
        }
        let fractions = samples.iter().flat_map(|sample| &sample.fractions);
        Batch {
            surfaces,
            inputs: DMatrix::from_vec(INPUTS, columns, inputs),
            targets: DMatrix::from_vec(OUTPUTS, columns, targets),
            dry: fractions.map(|fraction| *fraction < self.config.loss.dry_fraction).collect(),
        }
    }

    /// Net force over density as it will be served [m4/s2]: nothing from a surface without a wet sample.
    pub fn net_force_over_density(&self, sample: &Sample) -> [f64; OUTPUTS] {
        let output = self.layers.forward(&self.batch(&[sample]).inputs).output;
        let wet = output.column_iter().zip(&sample.fractions).filter(|(_, fraction)| **fraction > 0.0);
        wet.fold([0.0; OUTPUTS], |sum, (column, _)| {
            let force = self.scaling.target([column[0], column[1], column[2]]);
            std::array::from_fn(|c| sum[c] + force[c])
        })
    }

    /// The standardisation.
    pub fn scaling(&self) -> &Scaling {
        &self.scaling
    }

    /// The network as it is now.
    pub fn network(&self) -> Network {
        self.layers.network()
    }
}

fn standardized(target: &[f64; OUTPUTS], scaling: &Scaling) -> [f32; OUTPUTS] {
    std::array::from_fn(|c| (target[c] as f32 - scaling.target_mean[c]) / scaling.target_std[c])
}

/// Samples in batches of one vehicle each; in random order, or in that of the data.
fn batches<'a>(samples: &'a [Sample], size: usize, random: Option<&mut Random>) -> Vec<Vec<&'a Sample>> {
    let mut order: Vec<&Sample> = samples.iter().collect();
    let vehicles = samples.iter().map(|sample| sample.vehicle + 1).max().unwrap_or(0);
    let chunks = |order: &[&'a Sample]| -> Vec<Vec<&'a Sample>> {
        let of = |vehicle| order.iter().copied().filter(|s| s.vehicle == vehicle).collect::<Vec<_>>();
        (0..vehicles).flat_map(|v| of(v).chunks(size).map(<[_]>::to_vec).collect::<Vec<_>>()).collect()
    };
    let Some(random) = random else { return chunks(&order) };
    random.shuffle(&mut order);
    let mut batches = chunks(&order);
    random.shuffle(&mut batches);
    batches
}

/// Mean of a batch's loss, each batch weighing as many as its samples.
fn mean_over(batches: &[Vec<&Sample>], mut loss: impl FnMut(&[&Sample]) -> f64) -> f64 {
    let count: usize = batches.iter().map(Vec::len).sum();
    batches.iter().map(|batch| loss(batch) * batch.len() as f64).sum::<f64>() / count as f64
}
