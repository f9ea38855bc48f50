//! Three dense layers with ReLU, 27-256-256-3 in the paper, as plain loops: the reference that the kernel is tested against, and
//! the form in which weights are stored and trained.

use crate::features::GLOBAL;

/// Width of both hidden layers of the paper's network, and the most that there may be.
pub const MAX_WIDTH: usize = 256;
/// Widths of the hidden layers that there is a kernel for.
pub const WIDTHS: [usize; 4] = [32, 64, 128, MAX_WIDTH];
/// Components of a force.
pub const OUTPUTS: usize = 3;

/// Means and standard deviations with which inputs and targets are standardised.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaling {
    /// Mean of each global feature over the training split.
    pub global_mean: [f32; GLOBAL],
    /// Standard deviation of each global feature.
    pub global_std: [f32; GLOBAL],
    /// Mean of each component of force over density [m4/s2].
    pub target_mean: [f32; OUTPUTS],
    /// Standard deviation of each component of force over density [m4/s2].
    pub target_std: [f32; OUTPUTS],
}

impl Scaling {
    /// Standardised global features. The cast to single precision happens here and nowhere else.
    pub fn standardize(&self, global: &[f64; GLOBAL]) -> [f32; GLOBAL] {
        std::array::from_fn(|i| (global[i] as f32 - self.global_mean[i]) / self.global_std[i])
    }

    /// Force over density from a standardised output [m4/s2].
    pub fn target(&self, output: [f32; OUTPUTS]) -> [f64; OUTPUTS] {
        std::array::from_fn(|c| f64::from(output[c] * self.target_std[c] + self.target_mean[c]))
    }
}

/// Weights and biases, each matrix row-major `[outputs, inputs]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Numbers in a row of inputs.
    pub inputs: usize,
    /// Units of each of the two hidden layers, one of [`WIDTHS`].
    pub width: usize,
    /// Numbers out.
    pub outputs: usize,
    /// `[width, inputs]`
    pub w1: Vec<f32>,
    /// `[width]`
    pub b1: Vec<f32>,
    /// `[width, width]`
    pub w2: Vec<f32>,
    /// `[width]`
    pub b2: Vec<f32>,
    /// `[outputs, width]`
    pub w3: Vec<f32>,
    /// `[outputs]`
    pub b3: Vec<f32>,
}

impl Network {
    /// Name, shape and values of each tensor, in the order in which they are stored.
    pub fn tensors(&self) -> [(&'static str, Vec<usize>, &Vec<f32>); 6] {
        [
            ("w1", vec![self.width, self.inputs], &self.w1),
            ("b1", vec![self.width], &self.b1),
            ("w2", vec![self.width, self.width], &self.w2),
            ("b2", vec![self.width], &self.b2),
            ("w3", vec![self.outputs, self.width], &self.w3),
            ("b3", vec![self.outputs], &self.b3),
        ]
    }

    /// What it answers to one row of inputs.
    pub fn forward(&self, row: &[f32]) -> Vec<f32> {
        let h1 = relu(dense(&self.w1, &self.b1, row));
        let h2 = relu(dense(&self.w2, &self.b2, &h1));
        dense(&self.w3, &self.b3, &h2)
    }
}

fn dense(weights: &[f32], bias: &[f32], input: &[f32]) -> Vec<f32> {
    weights
        .chunks_exact(input.len())
        .zip(bias)
        .map(|(row, bias)| row.iter().zip(input).fold(*bias, |sum, (w, x)| sum + w * x))
        .collect()
}

fn relu(mut values: Vec<f32>) -> Vec<f32> {
    values.iter_mut().for_each(|v| *v = v.max(0.0));
    values
}
