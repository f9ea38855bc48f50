//! Local velocity of a turning hull, for a model that knows the velocity of the origin only.
//!
//! `f = D(v + omega x r) - D(v)` on each wet panel with the quadratic drag `D_i(u) = -1/2 rho C A_i |u| u_i`, `r` over four
//! points of the panel. One coefficient `C`: that of a bluff body, 0.4 to 2.1 (as `drag_coefficient_error`).

use super::input::{Input, Part};
use crate::frame::Vec3;
use crate::wrench::Wrench;

pub(super) fn basis(input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let velocity = input.condition.velocity;
    for (index, panel) in input.body.panels.iter().enumerate() {
        let part = &input.immersion.panels[index];
        let wet = part.fraction;
        if wet == 0.0 {
            continue;
        }
        let drag = |u: &Vec3| panel.windward(u).component_mul(u) * -u.norm();
        let scale = 0.25 * wet * input.half_density();
        for point in panel.points(part) {
            let local = input.local_velocity(&point);
            let force = (drag(&local) - drag(&velocity)) * scale;
            emit(0, Part::Panel(index), input.at(force, &point));
        }
    }
}
