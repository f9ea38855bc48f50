//! E16, the water stands higher than was said.
//!
//! `W = dF/dd` per meter: `rho g A_wp` upwards at the center of the waterplane (Archimedes), and the model's drag in
//! proportion to the depth. Exact to first order in the offset; meant for offsets below a fifth of the depth.

use super::input::{Input, Part};
use crate::frame::GRAVITY;
use crate::wrench::Wrench;

/// Depth below which a drag over the depth says nothing [m].
const SHALLOWEST: f64 = 0.01;

pub(super) fn basis(input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let (state, immersion) = (input.condition, input.immersion);
    let stiffness = state.density * GRAVITY * immersion.waterplane_area * state.up.z;
    emit(0, Part::Hull, input.at(state.up.into_inner() * stiffness, &immersion.waterplane_center));
    // a hull that is wholly under does not meet more of the flow
    if immersion.waterplane_area > 0.0 && immersion.depth > SHALLOWEST {
        let (force, up) = (input.predicted.force, state.up.into_inner());
        let drag = force - up * force.dot(&up);
        emit(0, Part::Hull, input.at(drag / immersion.depth, &immersion.center_of_buoyancy));
    }
}
