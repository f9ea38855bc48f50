//! Drag in proportion to speed: waves and viscosity at low speed, where the quadratic law has none.
//!
//! `f_i = -c_i rho sqrt(g L) A_i u_i` on each wet panel with its local velocity `u = v + omega x r`; `A_i` is the wet area
//! that looks along axis i, both ways. `sqrt(g L)` is the speed of the waves as long as the hull, so `c` has no dimension.
//! Fossen, Handbook of Marine Craft Hydrodynamics, section 6.4, has the linear term of a hull that makes waves at a few
//! per cent of this scale to a few tenths. Meant for Froude numbers below about 0.3.

use super::input::{Input, Part};
use crate::frame::{GRAVITY, Vec3};
use crate::wrench::Wrench;

pub(super) fn basis(input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let scale = input.condition.density * (GRAVITY * input.body.length).sqrt();
    for (index, panel) in input.body.panels.iter().enumerate() {
        let part = &input.immersion.panels[index];
        let wet = part.fraction;
        if wet == 0.0 {
            continue;
        }
        let area = (panel.facing_plus + panel.facing_minus) * (0.25 * wet * scale);
        for point in panel.points(part) {
            let u = input.local_velocity(&point);
            for axis in 0..3 {
                let force = Vec3::ith(axis, -area[axis] * u[axis]);
                emit(axis, Part::Panel(index), input.at(force, &point));
            }
        }
    }
}
