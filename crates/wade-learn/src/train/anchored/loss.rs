//! What the anchored network is asked for, and the loss: Huber on errors without a dimension, of the force on each
//! surface and its moment, and of the net force and moment.
//!
//! With the dynamic force `F_s` that the answer means and the one that was found, `e_s` their difference over the scale
//! `S = W (u + f)^p` of the state, where `W` is the vehicle's weight and `u = q A / W` the dynamic pressure on the wet
//! area over it; with `m_s` the difference of the moments about the wet centroid over `S L`, and `r_s` the way there from the
//! center of mass over `L`:
//! `mean over states of [sum_s h(e_s) + w_net h(sum_s e_s) + w_moment sum_s h(m_s) + w_net_moment h(sum_s (m_s + r_s x e_s))]`,
//! `h` summed over components, `h(e) = e^2 / 2` up to `delta` and `delta (|e| - delta / 2)` beyond (Huber 1964).

use nalgebra::{DMatrix, Vector3, convert};
use serde::{Deserialize, Serialize};

use super::super::layers::Real;
use super::super::loss::{Batch, Counts};
use super::known::{Known, Prepared, about};
use wade_core::anchor::{OUTPUTS, SurfaceReading};
use wade_core::frame::Vec3;
use wade_core::wrench::Wrench;

/// Weights of the terms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AnchoredLoss {
    /// Weight of the net force.
    pub net_weight: f64,
    /// Weight of the moment of each force about its wet centroid.
    pub moment_weight: f64,
    /// Weight of the net moment about the center of mass.
    pub net_moment_weight: f64,
    /// Error up to which the loss is a square [-].
    pub delta: f64,
    /// Exponent of the scale: 0 judges errors in newtons, 1 in shares of the load.
    pub exponent: f64,
    /// Load over weight that counts as none [-].
    pub floor: f64,
}

impl Default for AnchoredLoss {
    fn default() -> Self {
        Self {
            net_weight: 10.0,
            moment_weight: 1.0,
            net_moment_weight: 10.0,
            delta: 0.1,
            exponent: 0.5,
            floor: 0.01,
        }
    }
}

impl AnchoredLoss {
    /// Scale of a state's errors [N].
    pub fn scale(&self, state: &Known, prepared: &Prepared) -> f64 {
        let load: f64 = state.prior.reading.surfaces.iter().map(|surface| surface.unit).sum();
        let weight = prepared.weight();
        weight * (load / weight + self.floor).powf(self.exponent)
    }
}

/// Numbers of a surface that the loss needs: see [`targets`].
pub const TARGETS: usize = 17;

/// All that the loss needs of a surface besides the answer, forces over the scale.
///
/// drag x y z, unit, lateral 1 2, unit of a moment [m], way from the center of mass to the wet centroid x y z [m], found force
/// x y z, found moment about the wet centroid x y z [m], 1 over the length of the vehicle [1/m]. A force of which no moment is
/// known is taken to act at the wet centroid.
pub fn targets(
    surface: &SurfaceReading,
    (force, moment): &(Vec3, Option<Vec3>),
    prepared: &Prepared,
    scale: f64,
) -> [f32; TARGETS] {
    let found = moment.filter(|_| surface.wet_fraction > 0.0);
    let found = found.map(|moment| about(&Wrench { force: *force, moment }, &surface.center));
    let (drag, force, turn) = (surface.drag / scale, force / scale, found.unwrap_or_default() / scale);
    let way = surface.center - prepared.vehicle.center_of_mass;
    let [l0, l1] = surface.lateral;
    let unit = surface.unit / scale;
    let row: [f64; TARGETS] = [
        drag.x,
        drag.y,
        drag.z,
        unit,
        l0,
        l1,
        unit * surface.arm,
        way.x,
        way.y,
        way.z,
        force.x,
        force.y,
        force.z,
        turn.x,
        turn.y,
        turn.z,
        1.0 / prepared.vehicle.dimensions.length,
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
    let [net_weight, moment_weight, net_moment_weight] =
        [config.net_weight, config.moment_weight, config.net_moment_weight].map(convert::<f64, T>);
    let share: T = convert(1.0 / counts.samples as f64);
    for first in (0..output.ncols()).step_by(batch.surfaces) {
        let (mut net, mut net_moment) = (Vector3::zeros(), Vector3::zeros());
        for column in first..first + batch.surfaces {
            let answer = Answer::new(batch, output, column);
            let error = answer.force_error();
            net += error;
            net_moment += answer.moment_error() + answer.way().cross(&error);
        }
        sum += net_weight * net.map(|e| huber(e, delta)).sum();
        sum += net_moment_weight * net_moment.map(|e| huber(e, delta)).sum();
        let by_net = net.map(|e| slope(e, delta)) * net_weight;
        let by_net_moment = net_moment.map(|e| slope(e, delta)) * net_moment_weight;
        for column in first..first + batch.surfaces {
            let answer = Answer::new(batch, output, column);
            let (error, turn) = (answer.force_error(), answer.moment_error());
            sum += error.map(|e| huber(e, delta)).sum() + moment_weight * turn.map(|e| huber(e, delta)).sum();
            let by_force = error.map(|e| slope(e, delta)) + by_net + by_net_moment.cross(&answer.way());
            let by_turn = turn.map(|e| slope(e, delta)) * moment_weight + by_net_moment;
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
/// `SurfaceReading::moment`.
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
        self.vector(0) + Vector3::new(o[0], o[1] * l0 + o[3] * l1, o[2]) * unit - self.vector(10)
    }

    /// Over the length of the vehicle.
    fn moment_error(&self) -> Vector3<T> {
        let (unit, l0) = (self.target[6], self.target[4]);
        let o = self.output;
        (Vector3::new(o[4] * l0, o[5], o[6] * l0) * unit - self.vector(13)) * self.target[16]
    }

    /// From the center of mass to the wet centroid, over the length of the vehicle.
    fn way(&self) -> Vector3<T> {
        self.vector(7) * self.target[16]
    }

    fn gradient(&self, by_force: &Vector3<T>, by_turn: &Vector3<T>) -> [T; OUTPUTS] {
        let (unit, l0, l1) = (self.target[3], self.target[4], self.target[5]);
        let by_turn = by_turn * (self.target[6] * self.target[16]);
        [
            by_force.x * unit,
            by_force.y * unit * l0,
            by_force.z * unit,
            by_force.y * unit * l1,
            by_turn.x * l0,
            by_turn.y,
            by_turn.z * l0,
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
