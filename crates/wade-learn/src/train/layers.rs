//! The network as the trainer holds it: three dense layers with ReLU, forward and backward over a batch of columns.
//!
//! All parameters lie in one vector, so that the optimizer and the gradient check walk over one slice. A weight matrix
//! is stored as `[outputs, inputs]` by rows, as `Network` stores it, which is `[inputs, outputs]` by columns.
//!
//! Transposed factors are copied: the product that takes one as it lies does without blocking and is slower.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, RealField};

use crate::random::Random;
use wade_core::features::INPUTS;
use wade_core::model::network::{MAX_WIDTH, Network, OUTPUTS};

/// Inputs, width of both hidden layers, and outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    /// Numbers in a row.
    pub inputs: usize,
    /// Width of both hidden layers.
    pub width: usize,
    /// Numbers out.
    pub outputs: usize,
}

impl Sizes {
    /// The paper's network.
    pub const PAPER: Self = Self { inputs: INPUTS, width: MAX_WIDTH, outputs: OUTPUTS };

    /// Rows and columns of the six tensors in storage (a bias has one column).
    fn shapes(self) -> [(usize, usize); 6] {
        let Self { inputs, width, outputs } = self;
        [(inputs, width), (width, 1), (width, width), (width, 1), (width, outputs), (outputs, 1)]
    }

    /// Where each tensor lies in the vector of parameters.
    pub fn ranges(self) -> [Range<usize>; 6] {
        let mut end = 0;
        self.shapes().map(|(rows, columns)| {
            end += rows * columns;
            end - rows * columns..end
        })
    }

    /// Number of parameters.
    pub fn parameters(self) -> usize {
        self.ranges()[5].end
    }
}

/// f32 to train, f64 to check the gradient.
pub trait Real: RealField + Copy {}
impl<T: RealField + Copy> Real for T {}

/// Weights and biases.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers<T> {
    /// Their sizes.
    pub sizes: Sizes,
    /// w1, b1, w2, b2, w3, b3, one after another.
    pub parameters: Vec<T>,
}

/// What a forward pass leaves for the backward pass; a column a row of input.
#[derive(Debug, Clone, PartialEq)]
pub struct Activations<T> {
    hidden1: DMatrix<T>,
    /// After the second hidden layer, `[width, columns]`.
    pub hidden2: DMatrix<T>,
    /// `[outputs, columns]`
    pub output: DMatrix<T>,
}

impl<T: Real> Layers<T> {
    /// Uniform in `+-1 / sqrt(inputs)`, weights and biases, as PyTorch starts its linear layers.
    pub fn random(sizes: Sizes, random: &mut Random) -> Self {
        let Sizes { inputs, width, .. } = sizes;
        let fan_in = [inputs, inputs, width, width, width, width];
        let mut parameters = Vec::with_capacity(sizes.parameters());
        for (range, inputs) in sizes.ranges().into_iter().zip(fan_in) {
            let bound = (inputs as f64).sqrt().recip();
            parameters
                .extend(range.map(|_| nalgebra::convert::<f64, T>(bound * (2.0 * random.unit() - 1.0))));
        }
        Self { sizes, parameters }
    }

    /// Takes away all say of an input. For one that never varies in training: its weights would keep their random
    /// start, and speak up when the input varies in service.
    pub fn silence(&mut self, input: usize) {
        for weights in self.parameters[self.sizes.ranges()[0].clone()].chunks_exact_mut(self.sizes.inputs) {
            weights[input] = T::zero();
        }
    }

    fn matrix(&self, tensor: usize) -> DMatrixView<'_, T> {
        let (rows, columns) = self.sizes.shapes()[tensor];
        DMatrixView::from_slice(&self.parameters[self.sizes.ranges()[tensor].clone()], rows, columns)
    }

    /// The bias of a layer in each of `columns` columns, to which the product is then added.
    fn bias(&self, tensor: usize, columns: usize) -> DMatrix<T> {
        let values = &self.parameters[self.sizes.ranges()[tensor].clone()];
        DMatrix::from_iterator(values.len(), columns, (0..columns).flat_map(|_| values.iter().copied()))
    }

    /// Outputs for `[inputs, columns]`.
    pub fn forward(&self, inputs: &DMatrix<T>) -> Activations<T> {
        let one = T::one();
        let mut hidden1 = self.bias(1, inputs.ncols());
        hidden1.gemm(one, &self.matrix(0).transpose(), inputs, one);
        relu(&mut hidden1);
        let mut hidden2 = self.bias(3, inputs.ncols());
        hidden2.gemm(one, &self.matrix(2).transpose(), &hidden1, one);
        relu(&mut hidden2);
        let mut output = self.bias(5, inputs.ncols());
        // three rows: dot products along columns beat the blocked product
        output.gemm_tr(one, &self.matrix(4), &hidden2, one);
        Activations { hidden1, hidden2, output }
    }

    /// The gradient of a loss by every parameter, from its gradient by the outputs.
    ///
    /// With `D3` the latter: `dW3 = D3 H2^T`, `D2 = W3^T D3` where `H2 > 0`, `dW2 = D2 H1^T`, `D1 = W2^T D2` where
    /// `H1 > 0`, `dW1 = D1 X^T`; a bias takes the sum over the columns. All of `gradient` is overwritten.
    pub fn backward(
        &self,
        inputs: &DMatrix<T>,
        at: &Activations<T>,
        by_output: &DMatrix<T>,
        gradient: &mut [T],
    ) {
        self.layer_gradient(4, &at.hidden2, by_output, gradient);
        let by_hidden2 = masked(self.matrix(4) * by_output, &at.hidden2);
        self.layer_gradient(2, &at.hidden1, &by_hidden2, gradient);
        let by_hidden1 = masked(self.matrix(2) * &by_hidden2, &at.hidden1);
        self.layer_gradient(0, inputs, &by_hidden1, gradient);
    }

    /// Weights `tensor` and the bias after them, from what went into the layer and the gradient by what came out.
    fn layer_gradient(&self, tensor: usize, inputs: &DMatrix<T>, by_output: &DMatrix<T>, gradient: &mut [T]) {
        let (rows, columns) = self.sizes.shapes()[tensor];
        let ranges = self.sizes.ranges();
        let mut weights = DMatrixViewMut::from_slice(&mut gradient[ranges[tensor].clone()], rows, columns);
        weights.gemm(T::one(), inputs, &by_output.transpose(), T::zero());
        gradient[ranges[tensor + 1].clone()].copy_from_slice(by_output.column_sum().as_slice());
    }
}

impl Layers<f32> {
    /// The network as it is served, where there is a kernel for its width.
    pub fn network(&self) -> Network {
        let Sizes { inputs, width, outputs } = self.sizes;
        let [w1, b1, w2, b2, w3, b3] = self.sizes.ranges().map(|range| self.parameters[range].to_vec());
        Network { inputs, width, outputs, w1, b1, w2, b2, w3, b3 }
    }

    /// Replaces the weights and the bias of one output.
    pub fn set_output(&mut self, output: usize, weights: &[f64], bias: f64) {
        let [.., last, biases] = self.sizes.ranges();
        let row = &mut self.parameters[last][output * self.sizes.width..];
        row.iter_mut().zip(weights).for_each(|(to, from)| *to = *from as f32);
        self.parameters[biases.start + output] = bias as f32;
    }
}

fn relu<T: Real>(values: &mut DMatrix<T>) {
    values.apply(|v| *v = if *v > T::zero() { *v } else { T::zero() });
}

/// The gradient before the ReLU, from the gradient after it and what came out of it.
fn masked<T: Real>(mut gradient: DMatrix<T>, activation: &DMatrix<T>) -> DMatrix<T> {
    gradient.zip_apply(activation, |g, a| *g = if a > T::zero() { *g } else { T::zero() });
    gradient
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forward_agrees_with_the_served_network() {
        let mut random = Random::new(5);
        let layers = Layers::<f32>::random(Sizes::PAPER, &mut random);
        let inputs = DMatrix::from_fn(INPUTS, 9, |_, _| random.unit() as f32 - 0.5);
        let output = layers.forward(&inputs).output;
        for (column, input) in output.column_iter().zip(inputs.column_iter()) {
            let expected = layers.network().forward(input.as_slice());
            assert!(column.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5));
        }
    }

    #[test]
    fn a_silenced_input_has_no_say() {
        let mut layers = Layers::<f32>::random(Sizes { width: 8, ..Sizes::PAPER }, &mut Random::new(5));
        layers.silence(20);
        let quiet = DMatrix::from_element(INPUTS, 1, 0.3);
        let mut loud = quiet.clone();
        loud[20] = 100.0;
        assert_eq!(layers.forward(&quiet).output, layers.forward(&loud).output);
    }
}
