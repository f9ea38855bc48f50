//! E2, another coefficient of the quadratic drag.
//!
//! `f_i = -1/2 rho C_i A_i |v| v_i` on each wet panel, `A_i` the area that meets the flow. `C` is the difference to the
//! drag that the model has already, so it may be negative. Bluff bodies lie between 0.3 and 2.1 (Qi, Eames, Johnson, JFM
//! 2014; FEMA P-646 takes 2.0). Valid while the flow is subcritical; the local velocity of a turning hull is `rotation`.

use super::input::{Input, Part};
use crate::frame::Vec3;
use crate::wrench::Wrench;

pub(super) fn basis(input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let velocity = input.condition.velocity;
    let pressure = input.half_density() * velocity.norm();
    for (index, panel) in input.body.panels.iter().enumerate() {
        let part = &input.immersion.panels[index];
        let wet = part.fraction;
        if wet == 0.0 {
            continue;
        }
        let area = panel.windward(&velocity) * wet;
        for axis in 0..3 {
            let force = Vec3::ith(axis, -pressure * area[axis] * velocity[axis]);
            emit(axis, Part::Panel(index), input.at(force, &part.point));
        }
    }
}
