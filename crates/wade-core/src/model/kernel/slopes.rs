//! Derivatives of the network's answers in a few directions.
//!
//! They pass through the units that ReLU let pass alone, of which a trained network has few: in the domain of the shipped weights 34
//! of the 256 of the first layer and 7 of the second, in the mean. So these are picked out, and the rest is never touched.

use super::{Buffers, Kernel, LANES, Line, MAX_CHANGING, MAX_DYNAMIC, MAX_OUTPUTS, MAX_WIDTH};

/// Directions in which derivatives are computed together.
pub const DIRECTIONS: usize = 6;

/// A number's derivative in each direction.
type Slope = [f32; DIRECTIONS];

/// Derivatives of the features of one surface that change with the state.
pub type FeatureSlopes = [Slope; MAX_DYNAMIC];

/// Working memory of [`Kernel::slopes`].
#[derive(Debug, Clone)]
pub struct SlopeBuffers {
    first: Live,
    second: Live,
    /// Of the live inputs of one unit.
    weights: [f32; MAX_WIDTH],
    outputs: Vec<[Slope; MAX_OUTPUTS]>,
}

/// Units of a layer that are not zero, with the derivatives of their inputs.
#[derive(Debug, Clone)]
struct Live {
    units: [u8; MAX_WIDTH],
    slopes: [Slope; MAX_WIDTH],
    count: usize,
}

impl Live {
    const NONE: Self = Self { units: [0; MAX_WIDTH], slopes: [[0.0; DIRECTIONS]; MAX_WIDTH], count: 0 };

    fn find(&mut self, row: &[Line]) {
        let mut count = 0;
        let eights = row.iter().flat_map(|line| line.0.as_chunks::<8>().0);
        for (first, values) in (0..=u8::MAX).step_by(8).zip(eights) {
            let mut live = (0..8).fold(0_u8, |bits, k| bits | (u8::from(values[k] > 0.0) << k));
            while live != 0 {
                self.units[count] = first + live.trailing_zeros() as u8;
                count += 1;
                live &= live - 1;
            }
        }
        self.count = count;
    }
}

impl SlopeBuffers {
    /// Working memory for vehicles of up to `surfaces` surfaces.
    pub fn new(surfaces: usize) -> Self {
        let outputs = vec![[[0.0; DIRECTIONS]; MAX_OUTPUTS]; surfaces];
        Self { first: Live::NONE, second: Live::NONE, weights: [0.0; MAX_WIDTH], outputs }
    }
}

/// A number of a row by its place.
#[inline(always)]
fn at(lines: &[Line], place: usize) -> f32 {
    lines[place / LANES].0[place % LANES]
}

/// Sum of weighted slopes, in two sums that do not wait for each other.
#[inline(always)]
fn weighed(weights: &[f32], slopes: &[Slope]) -> Slope {
    let (mut even, mut odd) = ([0.0; DIRECTIONS], [0.0; DIRECTIONS]);
    let ((weights, last), (slopes, last_slope)) = (weights.as_chunks::<2>(), slopes.as_chunks::<2>());
    for ([a, b], [x, y]) in weights.iter().zip(slopes) {
        for k in 0..DIRECTIONS {
            even[k] += a * x[k];
            odd[k] += b * y[k];
        }
    }
    for (a, x) in last.iter().zip(last_slope) {
        for k in 0..DIRECTIONS {
            even[k] += a * x[k];
        }
    }
    std::array::from_fn(|k| even[k] + odd[k])
}

impl Kernel {
    /// Derivatives of what [`Kernel::forward`] answered just before, which `values` holds, for surfaces whose features have these
    /// derivatives.
    ///
    /// `global` is the derivative of the standardised features of the state.
    pub fn slopes<'b>(
        &self,
        (global, surfaces): (&[Slope], &[FeatureSlopes]),
        values: &Buffers,
        buffers: &'b mut SlopeBuffers,
    ) -> &'b [[Slope; MAX_OUTPUTS]] {
        let SlopeBuffers { first, second, weights, outputs } = buffers;
        let mut changing = [[0.0; DIRECTIONS]; MAX_CHANGING];
        changing[MAX_DYNAMIC..][..global.len()].copy_from_slice(global);
        for (index, features) in surfaces.iter().enumerate() {
            changing[..MAX_DYNAMIC].copy_from_slice(features);
            let row = index * self.lines..(index + 1) * self.lines;
            first.find(&values.h1[row.clone()]);
            for (unit, sum) in first.units[..first.count].iter().zip(&mut first.slopes) {
                *sum = weighed(&self.w1_units[usize::from(*unit)], &changing);
            }
            second.find(&values.h2[row]);
            for (unit, sum) in second.units[..second.count].iter().zip(&mut second.slopes) {
                self.second_layer(usize::from(*unit), &first.units[..first.count], weights);
                *sum = weighed(&weights[..first.count], &first.slopes[..first.count]);
            }
            for (of_output, sum) in self.w3.chunks_exact(self.lines).zip(&mut outputs[index]) {
                let live = weights.iter_mut().zip(&second.units[..second.count]);
                live.for_each(|(weight, unit)| *weight = at(of_output, usize::from(*unit)));
                *sum = weighed(&weights[..second.count], &second.slopes[..second.count]);
            }
        }
        &outputs[..surfaces.len()]
    }

    /// Weights of some inputs of layer 2 in one of its units, where [`super::pack`] has put them.
    fn second_layer(&self, unit: usize, inputs: &[u8], weights: &mut [f32; MAX_WIDTH]) {
        let columns = self.isa.tile_width();
        let tile = &self.w2[unit / columns * columns * self.lines..][..columns * self.lines];
        for (weight, input) in weights.iter_mut().zip(inputs) {
            *weight = at(tile, usize::from(*input) * columns + unit % columns);
        }
    }
}
