//! The drag that a prediction has already, as a few numbers: some effects scale with it.

use nalgebra::{DMatrix, DVector};

use super::series::Series;
use wade_core::effects::drag_coefficient_error::{DragCoefficientError, DragLaw};
use wade_core::effects::{Body, Memory, Shape};
use wade_core::frame::{GRAVITY, Vec3};

/// Cosine of the tilt up to which a hull counts as level: on a ramp its ends are wetted otherwise than its middle, and what
/// a prediction makes of that is its own.
const LEVEL: f64 = 0.998;
/// Bins that are enough to leave the others out.
const ENOUGH: usize = 100;

/// Drag of the prediction as coefficients on windward areas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BaseDrag {
    /// From all samples: what laws of areas are near, on a ramp as well.
    all: Vec3,
    /// From level driving, where there is enough of it: what a hull is said to have.
    level: Vec3,
}

impl BaseDrag {
    pub fn new(all: &[Series], body: &Body) -> Self {
        let samples = all.iter().flat_map(|s| s.bins.iter().map(move |bin| (s, bin.start + bin.len() / 2)));
        let samples: Vec<(&Series, usize)> = samples.collect();
        let is_level = |(series, sample): &&(&Series, usize)| series.conditions[*sample].up.z > LEVEL;
        let level: Vec<(&Series, usize)> = samples.iter().filter(is_level).copied().collect();
        let whole = fitted(&samples, body);
        Self { all: whole, level: if level.len() >= ENOUGH { fitted(&level, body) } else { whole } }
    }

    /// That for the law of an effect: those that take the prediction's drag itself get what a hull is said to have.
    pub fn of(&self, shape: &Shape) -> Vec3 {
        if shape.is_in_proportion() { self.level } else { self.all }
    }
}

/// Least squares over forces beside buoyancy and lift, by the law that leaves less, with the whole speed or the speed along
/// each axis. The wrong one has no drag across a hull that drives ahead and only seems to move sideways.
fn fitted(samples: &[(&Series, usize)], body: &Body) -> Vec3 {
    let fits = [DragLaw::Quadratic, DragLaw::CrossFlow].map(|law| of_law(samples, body, law));
    let best = fits.into_iter().flatten().min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or_else(Vec3::zeros, |(drag, _)| drag)
}

/// Coefficients, and the change of the sum of squares.
fn of_law(samples: &[(&Series, usize)], body: &Body, law: DragLaw) -> Option<(Vec3, f64)> {
    const COLUMNS: usize = 5;
    let mut xx = DMatrix::<f64>::zeros(COLUMNS, COLUMNS);
    let mut xy = DVector::<f64>::zeros(COLUMNS);
    for &(series, sample) in samples {
        let input = series.input(sample, body, Vec3::zeros());
        let mut rows = [[0.0; COLUMNS]; 3];
        let drag = Shape::DragCoefficientError(DragCoefficientError { law });
        drag.basis(&Memory::default(), &input, |coefficient, _, load| {
            (0..3).for_each(|axis| rows[axis][coefficient] += load.force[axis]);
        });
        let state = input.condition;
        let up = state.up.into_inner();
        let weight = state.density * GRAVITY * input.immersion.volume;
        let lift = 0.5 * state.density * state.velocity.norm_squared() * input.immersion.waterplane_area;
        for axis in 0..3 {
            rows[axis][3] = up[axis] * weight;
            rows[axis][4] = up[axis] * lift;
            let y = series.predicted[sample][axis];
            if y == 0.0 {
                continue;
            }
            for i in 0..COLUMNS {
                xy[i] += rows[axis][i] * y;
                (0..COLUMNS).for_each(|j| xx[(i, j)] += rows[axis][i] * rows[axis][j]);
            }
        }
    }
    let scale: Vec<f64> = (0..COLUMNS).map(|i| xx[(i, i)].sqrt().max(1e-9)).collect();
    let scaled = DMatrix::from_fn(COLUMNS, COLUMNS, |i, j| {
        xx[(i, j)] / (scale[i] * scale[j]) + if i == j { 1e-6 } else { 0.0 }
    });
    let right = DVector::from_fn(COLUMNS, |i, _| xy[i] / scale[i]);
    let solved = scaled.cholesky()?.solve(&right);
    // a drag that is not excited is taken as none
    let drag = Vec3::from_fn(|i, _| (solved[i] / scale[i]).clamp(0.0, 5.0));
    Some((drag, -solved.dot(&right)))
}
