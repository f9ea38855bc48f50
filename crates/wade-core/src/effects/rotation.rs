//! Local velocity of a turning hull, for a model that knows the velocity of the origin only.
//!
//! `f = D(v + omega x r) - D(v)` on each wet panel with the quadratic drag `D_i(u) = -1/2 rho C A_i |u| u_i`, `r` over four
//! points of the panel. `C` is that of a bluff body, 0.4 to 2.1 (as `drag_coefficient_error`). The shape is 0 for
//! strips, which know the load across the hull alone, and 1 for the whole load; its second number is 0 for this law and 1
//! for the cross-flow principle, `|u_y| u_y` across the hull and nothing else (Fossen, Handbook of Marine Craft
//! Hydrodynamics, section 6.4).

use super::input::{Input, Part};
use super::library::Shape;
use crate::frame::Vec3;
use crate::wrench::Wrench;

pub(super) fn basis(shape: &Shape, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let velocity = input.condition.velocity;
    for (index, panel) in input.body.panels.iter().enumerate() {
        let part = &input.immersion.panels[index];
        let wet = part.fraction;
        if wet == 0.0 {
            continue;
        }
        let drag = |u: &Vec3| {
            let speed = if shape[1] > 0.5 { u.abs() } else { Vec3::repeat(u.norm()) };
            -panel.windward(u).component_mul(u).component_mul(&speed)
        };
        let scale = 0.25 * wet * input.half_density();
        for point in panel.points(part) {
            // a strip has one velocity across the hull; its two sides share it
            let across = panel.facing_plus.y + panel.facing_minus.y > 0.0 && shape[0] <= 0.5;
            let at = if across { Vec3::new(point.x, 0.0, point.z) } else { point };
            let local = input.local_velocity(&at);
            let force: Vec3 = (drag(&local) - drag(&velocity)) * scale;
            let along = if shape[0] > 0.5 { force.x } else { 0.0 };
            let up = if shape[1] > 0.5 { 0.0 } else { force.z };
            emit(0, Part::Panel(index), input.at(Vec3::new(along, force.y, up), &point));
        }
    }
}
