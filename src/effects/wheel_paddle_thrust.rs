//! E13, turning wheels throw water backwards.
//!
//! `F = 1/2 rho C A |omega r| (omega r - v_x)` forwards on each wet wheel: momentum of the water that lugs carry along, in
//! proportion to the slip (momentum theory of the paddle wheel). C is of the order of 1 (M). The shape says which area
//! carries it: 0 the wet part of the disc, 1 the lugs at the foot of the wheel alone, which are all in the water once an
//! eighth of the wheel is (the floats of a paddle wheel). The thrust acts at the hub and with a torque `r F` times a
//! second coefficient, since the lugs push below the hub and lift water in front of and behind it.

use super::input::{Input, Part};
use super::library::Shape;
use crate::frame::Vec3;
use crate::wrench::Wrench;

pub(super) fn basis(shape: &Shape, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let radius = input.body.wheel_radius;
    let disc = std::f64::consts::PI * radius * radius;
    for (index, panel) in input.body.panels.iter().enumerate() {
        let Some(speed) = panel.wheel.and_then(|wheel| input.wheel_speeds[wheel]) else { continue };
        let wet = input.immersion.panels[index].fraction;
        let share = if shape[0] > 0.5 { (8.0 * wet).min(1.0) } else { wet };
        let rim = speed * radius;
        let slip = rim - input.local_velocity(&panel.centroid).x;
        let force = input.half_density() * disc * share * rim.abs() * slip;
        emit(0, Part::Panel(index), input.at(Vec3::x() * force, &panel.centroid));
        let torque = Vec3::y() * (-radius * force);
        emit(1, Part::Panel(index), Wrench { force: Vec3::zeros(), moment: torque });
    }
}
