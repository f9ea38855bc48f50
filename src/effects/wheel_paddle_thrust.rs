//! E13, turning wheels throw water backwards.
//!
//! `F = 1/2 rho C A |omega r| (omega r - v_x)` forwards on each wet wheel with `A` its wet disc, `pi r^2` times the wet
//! share: momentum of the water that lugs carry along, in proportion to the slip. C is of the order of 1 (M).

use super::input::{Input, Part};
use crate::frame::Vec3;
use crate::wrench::Wrench;

pub(super) fn basis(input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let radius = input.body.wheel_radius;
    let disc = std::f64::consts::PI * radius * radius;
    for (index, panel) in input.body.panels.iter().enumerate() {
        let Some(speed) = panel.wheel.and_then(|wheel| input.wheel_speeds[wheel]) else { continue };
        let part = &input.immersion.panels[index];
        let rim = speed * radius;
        let slip = rim - input.local_velocity(&panel.centroid).x;
        let force = input.half_density() * disc * part.fraction * rim.abs() * slip;
        emit(0, Part::Panel(index), input.at(Vec3::x() * force, &part.point));
    }
}
