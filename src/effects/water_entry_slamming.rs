//! E7, the blow of entering the water: momentum of the water that starts to move with the hull.
//!
//! `F = -C rho (dV/dt)+ u`: the water beside newly wet volume takes on the velocity of the hull, on entry only; von
//! Karman's `w^2 dM_A/dz` with the added mass in proportion to the displaced volume. Along the vertical and across it
//! apart. Wagner's splash raises it by pi/2 (M); above about 30 degrees of deadrise theory fails (Constantinescu 2008).

use super::input::{Input, Part};
use crate::wrench::Wrench;

pub(super) fn basis(input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let (state, immersion) = (input.condition, input.immersion);
    let up = state.up.into_inner();
    let entering = state.density * immersion.waterplane_area * input.wetting_rate.max(0.0);
    // the rate of the level is the entry speed, whatever carries the hull down
    emit(
        0,
        Part::Hull,
        input.at(up * (entering * input.wetting_rate.max(0.0)), &immersion.waterplane_center),
    );
    let across = state.velocity - up * state.velocity.dot(&up);
    emit(1, Part::Hull, input.at(across * -entering, &immersion.waterplane_center));
}
