//! What the anchored network is asked for, and the loss: Huber on errors without a dimension, of the force on each
//! surface, of the net force, and of the place where each force acts.
//!
//! With the dynamic force `F_s` that the answer means and the one that was found, `e_s` their difference over the scale
//! `S = W (u + f)^p` of the state, where `W` is the vehicle's weight and `u = q A / W` the dynamic pressure on the wet
//! area over it; with the moment `m_s` of the found force at the answered place about the wet centroid, less the found
//! moment, over `S L`:
//! `mean over states of [sum_s h(e_s) + w_net h(sum_s e_s) + w_moment sum_s h(m_s)]`, `h` summed over components,
//! `h(e) = e^2 / 2` up to `delta` and `delta (|e| - delta / 2)` beyond (Huber 1964).

use nalgebra::{DMatrix, Vector3, convert};
use serde::{Deserialize, Serialize};

use super::super::layers::Real;
use super::super::loss::{Batch, Counts};
use super::known::{Known, Prepared, about};
use crate::anchor::{OUTPUTS, SurfaceReading};
use crate::frame::Vec3;
use crate::wrench::Wrench;

/// Weights of the terms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AnchoredLoss {
    /// Weight of the net force.
    pub net_weight: f64,
    /// Weight of the place where forces act.
    pub moment_weight: f64,
    /// Error up to which the loss is a square [-].
    pub delta: f64,
    /// Exponent of the scale: 0 judges errors in newtons, 1 in shares of the load.
    pub exponent: f64,
    /// Load over weight that counts as none [-].
    pub floor: f64,
}

impl Default for AnchoredLoss {
    fn default() -> Self {
        Self { net_weight: 10.0, moment_weight: 0.1, delta: 0.1, exponent: 0.5, floor: 0.01 }
    }
}

impl AnchoredLoss {
    /// Scale of a state's errors [N].
    pub fn scale(&self, state: &Known, prepared: &Prepared) -> f64 {
        let load: f64 = state.reading.surfaces.iter().map(|surface| surface.unit).sum();
        let weight = prepared.weight();
        weight * (load / weight + self.floor).powf(self.exponent)
    }
}

/// Numbers of a surface that the loss needs: see [`targets`].
pub const TARGETS: usize = 19;

/// All that the loss needs of a surface besides the answer, lengths from the wet centroid [m], forces over the scale.
///
/// drag x y z, unit, lateral 1 2, room to the low end of the wet box x y z, to the high end x y z, found force x y z, found
/// moment about the wet centroid x y z [m], 1 over the length of the vehicle [1/m] or 0 where the moment is not known.
pub fn targets(
    surface: &SurfaceReading,
    (force, moment): &(Vec3, Option<Vec3>),
    (scale, length): (f64, f64),
) -> [f32; TARGETS] {
    let wet = surface.wet_fraction > 0.0;
    let [low, high] = surface.wet_box;
    let (to_low, to_high) =
        if wet { (surface.center - low, high - surface.center) } else { Default::default() };
    let found =
        moment.filter(|_| wet).map(|moment| about(&Wrench { force: *force, moment }, &surface.center));
    let turn = found.unwrap_or_default() / scale;
    let (drag, force) = (surface.drag / scale, force / scale);
    let per_length = if found.is_some() { 1.0 / length } else { 0.0 };
    let [l0, l1] = surface.lateral;
    let row: [f64; TARGETS] = [
        drag.x,
        drag.y,
        drag.z,
        surface.unit / scale,
        l0,
        l1,
        to_low.x,
        to_low.y,
        to_low.z,
        to_high.x,
        to_high.y,
        to_high.z,
        force.x,
        force.y,
        force.z,
        turn.x,
        turn.y,
        turn.z,
        per_length,
    ];
    row.map(|x| x as f32)
}

/// The loss of a network's `output`, and its gradient by it; of a part of a batch, its share in that of the whole, which
/// has `counts`.
pub fn loss<T: Real>(
    config: &AnchoredLoss,
    batch: &Batch<T>,
    counts: &Counts,
    output: &DMatrix<T>,
) -> (f64, DMatrix<T>) {
    let mut gradient = DMatrix::zeros(output.nrows(), output.ncols());
    let mut sum = T::zero();
    let delta: T = convert(config.delta);
    let [net_weight, moment_weight] = [config.net_weight, config.moment_weight].map(convert::<f64, T>);
    let share: T = convert(1.0 / counts.samples as f64);
    for first in (0..output.ncols()).step_by(batch.surfaces) {
        let mut net = Vector3::zeros();
        for column in first..first + batch.surfaces {
            net += Answer::new(batch, output, column).force_error();
        }
        sum += net_weight * net.map(|e| huber(e, delta)).sum();
        let by_net = net.map(|e| slope(e, delta)) * net_weight;
        for column in first..first + batch.surfaces {
            let answer = Answer::new(batch, output, column);
            let (error, turn) = (answer.force_error(), answer.moment_error());
            sum += error.map(|e| huber(e, delta)).sum() + moment_weight * turn.map(|e| huber(e, delta)).sum();
            let by_force = error.map(|e| slope(e, delta)) + by_net;
            let by_turn = turn.map(|e| slope(e, delta)) * moment_weight;
            let values = answer.gradient(&(by_force * share), &(by_turn * share));
            gradient.column_mut(column).rows_mut(0, OUTPUTS).copy_from_slice(&values);
        }
    }
    ((sum * share).to_subset().unwrap_or(f64::NAN), gradient)
}

fn huber<T: Real>(e: T, delta: T) -> T {
    let half: T = convert(0.5);
    if e.abs() <= delta { half * e * e } else { delta * (e.abs() - half * delta) }
}

fn slope<T: Real>(e: T, delta: T) -> T {
    e.clamp(-delta, delta)
}

/// A surface's answer beside what was found; the same reading of the answer as `SurfaceReading::force` and
/// `SurfaceReading::center_of_pressure`.
struct Answer<'a, T> {
    target: &'a [T],
    output: &'a [T],
}

impl<'a, T: Real> Answer<'a, T> {
    fn new(batch: &'a Batch<T>, output: &'a DMatrix<T>, column: usize) -> Self {
        let of = |matrix: &'a DMatrix<T>| {
            let rows = matrix.nrows();
            &matrix.as_slice()[column * rows..(column + 1) * rows]
        };
        Self { target: of(&batch.targets), output: of(output) }
    }

    fn vector(&self, first: usize) -> Vector3<T> {
        Vector3::from_column_slice(&self.target[first..first + 3])
    }

    fn force_error(&self) -> Vector3<T> {
        let (unit, l0, l1) = (self.target[3], self.target[4], self.target[5]);
        let o = self.output;
        self.vector(0) + Vector3::new(o[0], o[1] * l0 + o[3] * l1, o[2]) * unit - self.vector(12)
    }

    /// Hyperbolic tangents of the answered place, and the room that they are a share of.
    fn place(&self) -> ([T; 3], [T; 3]) {
        let tangent = [self.output[4], self.output[5], self.output[6]].map(|x| x.tanh());
        let share = [tangent[0], tangent[1] * self.target[4], tangent[2]];
        let room = [0, 1, 2].map(|i| self.target[if share[i] > T::zero() { 9 } else { 6 } + i]);
        (tangent, room)
    }

    fn moment_error(&self) -> Vector3<T> {
        let (tangent, room) = self.place();
        let arm =
            Vector3::new(tangent[0] * room[0], tangent[1] * self.target[4] * room[1], tangent[2] * room[2]);
        (arm.cross(&self.vector(12)) - self.vector(15)) * self.target[18]
    }

    fn gradient(&self, by_force: &Vector3<T>, by_turn: &Vector3<T>) -> [T; OUTPUTS] {
        let (unit, l0, l1) = (self.target[3], self.target[4], self.target[5]);
        let (tangent, room) = self.place();
        let by_arm = self.vector(12).cross(by_turn) * self.target[18];
        let lateral = [T::one(), l0, T::one()];
        let place =
            [0, 1, 2].map(|i| by_arm[i] * room[i] * lateral[i] * (T::one() - tangent[i] * tangent[i]));
        [
            by_force.x * unit,
            by_force.y * unit * l0,
            by_force.z * unit,
            by_force.y * unit * l1,
            place[0],
            place[1],
            place[2],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn huber_is_a_square_and_then_a_line_with_no_kink() {
        for (e, expected) in [(0.05_f64, 0.001_25_f64), (0.3, 0.025), (-0.3, 0.025), (0.1, 0.005)] {
            assert!((huber(e, 0.1) - expected).abs() < 1e-12, "{e}");
        }
        assert_eq!([slope(0.05, 0.1), slope(0.3, 0.1), slope(-0.3, 0.1)], [0.05, 0.1, -0.1]);
    }
}
