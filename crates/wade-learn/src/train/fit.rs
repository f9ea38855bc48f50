//! The epochs: batches in random order, gradient steps, a look at the validation loss. Knows no feature and no loss.

use std::thread;

use serde::{Deserialize, Serialize};

use super::adam::{Adam, Plateau};
use super::config::Keep;
use super::layers::Layers;
use super::loss::Counts;
use super::task::Task;
use super::variant::Rows;
use super::{Config, TrainError};
use crate::random::Random;

/// A batch is worked on in this many parts, whatever the number of threads, and their gradients are summed in order:
/// the bits do not depend on the machine's cores.
const PARTS: usize = 2;

/// What an epoch came to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    /// Number, from 1.
    pub number: u32,
    /// Mean loss over the training samples, each taken when its batch was.
    pub training_loss: f64,
    /// Mean loss over the validation samples after the epoch; older records call it that of the held-out ones.
    #[serde(alias = "held_out_loss")]
    pub validation_loss: f64,
    /// Learning rate of the epoch.
    pub learning_rate: f64,
}

/// A training under way: all that a resumed run needs besides its task and settings.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// The weights now.
    pub layers: Layers<f32>,
    /// The optimizer.
    pub adam: Adam,
    /// The learning rate.
    pub plateau: Plateau,
    /// Every epoch so far.
    pub history: Vec<Epoch>,
    /// Parameters and number of the epoch with the least loss that sets the pace, where these are kept.
    pub best: Option<(Vec<f32>, u32)>,
}

/// Epochs of a task.
#[derive(Debug)]
pub struct Fit<'a> {
    task: &'a Task,
    config: &'a Config,
    /// What changes with every epoch.
    pub state: State,
    gradients: [Vec<f32>; PARTS],
}

impl<'a> Fit<'a> {
    /// Draws the first weights.
    pub fn new(task: &'a Task, config: &'a Config) -> Self {
        let mut layers = Layers::random(task.sizes, &mut stream(config.seed, 0));
        task.constant.iter().for_each(|&input| layers.silence(input));
        let state = State {
            adam: Adam::new(layers.parameters.len()),
            layers,
            plateau: Plateau::new(config.learning_rate, config.patience),
            history: Vec::new(),
            best: None,
        };
        Self::resume(task, config, state)
    }

    /// Goes on from where a run was.
    pub fn resume(task: &'a Task, config: &'a Config, state: State) -> Self {
        let gradients = std::array::from_fn(|_| vec![0.0; state.layers.parameters.len()]);
        Self { task, config, state, gradients }
    }

    /// True after the last epoch, or when the learning rate has become too small to matter.
    pub fn is_over(&self) -> bool {
        self.state.history.len() >= self.config.epochs as usize
            || self.state.plateau.rate < self.config.least_learning_rate
    }

    /// One pass over the training samples.
    pub fn epoch(&mut self) -> Result<Epoch, TrainError> {
        let number = self.state.history.len() as u32 + 1;
        let learning_rate = self.state.plateau.rate;
        let order = Some(stream(self.config.seed, number));
        let mut sum = 0.0;
        for batch in batches(&self.task.training, self.config.batch, order) {
            sum += self.step(&batch)? * batch.len() as f64;
        }
        let training_loss = sum / self.task.training.len() as f64;
        let validation_loss = self.validation_loss()?;
        if !(training_loss.is_finite() && validation_loss.is_finite()) {
            return Err(TrainError::Diverged { epoch: number });
        }
        let pace = self.task.objective.pace(training_loss, validation_loss);
        let best = pace < self.state.plateau.best;
        if best && self.config.keep == Keep::Best {
            self.state.best = Some((self.state.layers.parameters.clone(), number));
        }
        self.state.plateau.observe(pace);
        let epoch = Epoch { number, training_loss, validation_loss, learning_rate };
        self.state.history.push(epoch);
        Ok(epoch)
    }

    /// Loss of a batch, after which the weights have moved.
    fn step(&mut self, batch: &[&Rows]) -> Result<f64, TrainError> {
        let counts = counts(batch);
        let (task, layers) = (self.task, &self.state.layers);
        let (first, second) = batch.split_at(batch.len().div_ceil(PARTS));
        let [of_first, of_second] = &mut self.gradients;
        let losses = if second.is_empty() {
            of_second.fill(0.0);
            [part(task, layers, first, &counts, of_first)?, 0.0]
        } else {
            let (a, b) = both(
                self.config.threads,
                || part(task, layers, first, &counts, of_first),
                || part(task, layers, second, &counts, of_second),
            );
            [a?, b?]
        };
        of_first.iter_mut().zip(of_second.iter()).for_each(|(a, b)| *a += b);
        let State { layers, adam, plateau, .. } = &mut self.state;
        adam.step(plateau.rate, self.config.weight_decay, &mut layers.parameters, &self.gradients[0]);
        Ok(losses.iter().sum())
    }

    fn validation_loss(&self) -> Result<f64, TrainError> {
        let batches = batches(&self.task.validation, self.config.held_out_batch, None);
        let of = |batches: &[Vec<&Rows>]| -> Result<Vec<f64>, TrainError> {
            let loss = |rows: &Vec<&Rows>| {
                let batch = self.task.batch(rows)?;
                let output = self.state.layers.forward(&batch.inputs).output;
                Ok(self.task.objective.loss(&batch, &batch.counts(), &output).0 * rows.len() as f64)
            };
            batches.iter().map(loss).collect()
        };
        let (first, second) = batches.split_at(batches.len().div_ceil(PARTS));
        let (first, second) = both(self.config.threads, || of(first), || of(second));
        let sum: f64 = first?.iter().chain(&second?).sum();
        Ok(sum / self.task.validation.len() as f64)
    }

    /// The layers that are kept, and the epoch after which they were so.
    pub fn kept(&self) -> (Layers<f32>, u32) {
        match &self.state.best {
            Some((parameters, epoch)) => {
                (Layers { parameters: parameters.clone(), ..self.state.layers.clone() }, *epoch)
            }
            None => (self.state.layers.clone(), self.state.history.len() as u32),
        }
    }
}

/// The stream of random numbers of an epoch; 0 is the start. Derived from the seed, so that a resumed run needs no more.
fn stream(seed: u64, epoch: u32) -> Random {
    let mut random = Random::new(seed);
    (0..epoch).for_each(|_| {
        random.fork();
    });
    random.fork()
}

/// Both results, on two threads where they may be used.
fn both<A: Send, B: Send>(
    threads: usize,
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    if threads < 2 {
        return (a(), b());
    }
    thread::scope(|scope| {
        let other = scope.spawn(b);
        let a = a();
        match other.join() {
            Ok(b) => (a, b),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

/// Share of some samples in the loss of their batch, and in its gradient.
fn part(
    task: &Task,
    layers: &Layers<f32>,
    samples: &[&Rows],
    counts: &Counts,
    gradient: &mut [f32],
) -> Result<f64, TrainError> {
    let batch = task.batch(samples)?;
    let activations = layers.forward(&batch.inputs);
    let (loss, by_output) = task.objective.loss(&batch, counts, &activations.output);
    layers.backward(&batch.inputs, &activations, &by_output, gradient);
    Ok(loss)
}

fn counts(batch: &[&Rows]) -> Counts {
    let dry = |rows: &&Rows| rows.dry.iter().filter(|dry| **dry).count();
    Counts {
        samples: batch.len(),
        columns: batch.iter().map(|rows| rows.dry.len()).sum(),
        dry: batch.iter().map(dry).sum(),
    }
}

/// Samples in batches of one vehicle each; in random order, or in that of the data.
fn batches(samples: &[Rows], size: usize, random: Option<Random>) -> Vec<Vec<&Rows>> {
    let mut order: Vec<&Rows> = samples.iter().collect();
    let mut random = random;
    if let Some(random) = &mut random {
        random.shuffle(&mut order);
    }
    let vehicles = samples.iter().map(|rows| rows.vehicle + 1).max().unwrap_or(0);
    let mut batches = Vec::new();
    for vehicle in 0..vehicles {
        let of_vehicle: Vec<&Rows> = order.iter().copied().filter(|rows| rows.vehicle == vehicle).collect();
        batches.extend(of_vehicle.chunks(size).map(<[_]>::to_vec));
    }
    if let Some(random) = &mut random {
        random.shuffle(&mut batches);
    }
    batches
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(vehicle: usize) -> Rows {
        Rows { vehicle, inputs: Vec::new(), targets: Vec::new(), dry: Vec::new() }
    }

    #[test]
    fn a_batch_holds_one_vehicle_and_every_sample_is_in_one() {
        let samples: Vec<Rows> = (0..50).map(|i| rows(usize::from(i % 3 == 0))).collect();
        for random in [None, Some(Random::new(4))] {
            let batches = batches(&samples, 16, random);
            assert!(batches.iter().all(|batch| batch.iter().all(|rows| rows.vehicle == batch[0].vehicle)));
            assert_eq!(batches.iter().map(Vec::len).sum::<usize>(), 50);
        }
    }

    #[test]
    fn every_epoch_has_an_order_of_its_own() {
        let order = |epoch| stream(7, epoch).permutation(20);
        assert_eq!(order(3), order(3));
        assert!(order(3) != order(4) && order(0) != order(1));
    }
}
