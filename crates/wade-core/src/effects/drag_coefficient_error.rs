//! Another coefficient of the quadratic drag.
//!
//! `f_i = -1/2 rho C_i A_i |v| v_i` on each wet panel, `A_i` the area that meets the flow. `C` is the difference to the
//! drag that the model has already, so it may be negative. Bluff bodies lie between 0.3 and 2.1 (Qi, Eames, Johnson, JFM
//! 2014; FEMA P-646 takes 2.0). Valid while the flow is subcritical; the local velocity of a turning hull is `rotation`.
//! The shape is 0 for this, 1 for `|v_i| v_i`, where each axis has its own speed (the cross-flow principle), and 2 for the
//! model's own drag `D` in proportion, `F_i = C_i / K_i D_i` with its coefficients `K`: the part of its force across
//! gravity, whatever law it follows.

use super::input::{Input, Part};
use super::library::{Effect, Shape};
use crate::frame::Vec3;
use crate::wrench::Wrench;

pub(super) fn basis(shape: &Shape, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    if Effect::DragCoefficientError.is_in_proportion(shape) {
        return of_the_model(input, emit);
    }
    let velocity = input.condition.velocity;
    let whole = velocity.norm();
    let speed = |axis: usize| if shape[0] > 0.5 { velocity[axis].abs() } else { whole };
    for (index, panel) in input.body.panels.iter().enumerate() {
        let part = &input.immersion.panels[index];
        let wet = part.fraction;
        if wet == 0.0 {
            continue;
        }
        let area = panel.windward(&velocity) * wet;
        for axis in 0..3 {
            let force = Vec3::ith(axis, -input.half_density() * speed(axis) * area[axis] * velocity[axis]);
            emit(axis, Part::Panel(index), input.at(force, &part.point));
        }
    }
}

fn of_the_model(input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let drag = input.predicted_drag();
    let center = input.immersion.center_of_buoyancy;
    for axis in (0..2).filter(|&axis| input.base_drag[axis] > 1e-3) {
        let share = Vec3::ith(axis, drag[axis] / input.base_drag[axis]);
        emit(axis, Part::Hull, input.at(share, &center));
    }
}
