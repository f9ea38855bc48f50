//! E18, driving over the bed instead of standing on it in a current.
//!
//! A model learnt from parked hulls has the slow water near the bed under the hull; a hull that drives through still water
//! has not. `F = 1/2 rho A |v_g| (-C_D v_g + C_L |v_g| up)` with the velocity over ground `v_g`. The paper's CFD is of
//! parked hulls. The shape says which area carries it: 0 the wet front, 1 the wet underside, which does not grow with the
//! depth. Coefficients come from paired CFD cases; there is no published band.

use super::input::{Input, Part};
use super::library::Shape;
use crate::wrench::Wrench;

pub(super) fn basis(shape: &Shape, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let state = input.condition;
    let up = state.up.into_inner();
    let ground = state.ground_velocity;
    let ground = ground - up * ground.dot(&up);
    let speed = ground.norm();
    for (index, panel) in input.body.panels.iter().enumerate() {
        let part = &input.immersion.panels[index];
        let facing = if shape[0] > 0.5 { panel.facing_minus.z } else { panel.windward(&ground).x };
        let load = input.half_density() * facing * part.fraction * speed;
        emit(0, Part::Panel(index), input.at(ground * -load, &part.point));
        emit(1, Part::Panel(index), input.at(up * (load * speed), &part.point));
    }
}
