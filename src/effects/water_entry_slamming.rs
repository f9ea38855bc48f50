//! E7, the blow of entering the water: momentum of the water that starts to move with the hull.
//!
//! `F = C w^2 dM/dd` upwards and `-C u w dM/dd` across, on entry only, with the rate `w` of the level and the water `M(d)`
//! that moves with the hull. The shape is 0 for `M = rho V`, the water displaced; else it is the depth `h` at which the
//! bottom is wet from side to side, and `M = rho pi c^2 L / 2` (von Karman) with the half beam `c = (B / 2) min(d / h, 1)`
//! of a wedge. Wagner's splash makes `h` smaller by pi/2 (M); above about 30 degrees of deadrise theory fails
//! (Constantinescu 2008).

use super::input::{Input, Part};
use super::library::Shape;
use crate::wrench::Wrench;

pub(super) fn basis(shape: &Shape, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let (state, immersion) = (input.condition, input.immersion);
    let up = state.up.into_inner();
    let growth = state.density * growth(shape[0], input) * input.wetting_rate.max(0.0);
    // the rate of the level is the entry speed, whatever carries the hull down
    let blow = up * (growth * input.wetting_rate.max(0.0));
    emit(0, Part::Hull, input.at(blow, &immersion.waterplane_center));
    let across = state.velocity - up * state.velocity.dot(&up);
    emit(1, Part::Hull, input.at(across * -growth, &immersion.waterplane_center));
}

/// Growth of the moving volume with the depth [m2].
fn growth(wet_at: f64, input: &Input) -> f64 {
    let immersion = input.immersion;
    if wet_at <= 0.0 {
        return immersion.waterplane_area;
    }
    if immersion.depth <= 0.0 || immersion.depth >= wet_at {
        return 0.0;
    }
    let half = 0.5 * input.body.width;
    std::f64::consts::PI * half * half * input.body.length * immersion.depth / (wet_at * wet_at)
}
