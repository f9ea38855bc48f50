//! The drag that a prediction has already, as a few numbers: some effects scale with it.

use nalgebra::{DMatrix, DVector};

use super::candidates::Setting;
use super::series::Series;
use crate::effects::{self, Effect, Memory, Shape};
use crate::frame::{GRAVITY, Vec3};

/// Drag of the prediction as coefficients on windward areas: least squares over forces beside buoyancy and lift, by the law
/// that leaves less, with the whole speed or the speed along each axis. The wrong one has no drag across a hull that
/// drives ahead and only seems to move sideways.
pub(super) fn base_drag(all: &[Series], setting: &Setting) -> Vec3 {
    let fits = [0.0, 1.0].map(|law| of_law(all, setting, &[law, 0.0, 0.0]));
    let best = fits.into_iter().flatten().min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or_else(Vec3::zeros, |(drag, _)| drag)
}

/// Coefficients, and the change of the sum of squares.
fn of_law(all: &[Series], setting: &Setting, law: &Shape) -> Option<(Vec3, f64)> {
    const COLUMNS: usize = 5;
    let mut xx = DMatrix::<f64>::zeros(COLUMNS, COLUMNS);
    let mut xy = DVector::<f64>::zeros(COLUMNS);
    for series in all {
        for bin in &series.bins {
            let sample = bin.start + bin.len() / 2;
            let input = series.input(sample, setting.body, Vec3::zeros(), None);
            let mut rows = [[0.0; COLUMNS]; 3];
            effects::basis(
                Effect::DragCoefficientError,
                law,
                &Memory::default(),
                &input,
                |coefficient, _, load| (0..3).for_each(|axis| rows[axis][coefficient] += load.force[axis]),
            );
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
