//! The hull sinks with its own speed.
//!
//! `Fz = -c rho g A_wp s` with the depression `s` of the water beside and under the hull, where it flows faster. A second
//! coefficient trims. Three laws:
//!
//! - open water, `s = v^2 / 2g` (Bernoulli), or `s = v^2 / 2g / sqrt(|1 - Fr_h^2|)` (Tuck), cut at twice the former;
//! - a channel of known width: Bernoulli and continuity in one dimension, [`super::channel_flow`].
//!
//! All are laws of ships at Fr_h below 0.7: low confidence for us. The shape is that Froude number, 0 for open water, and 1
//! for Tuck instead of Bernoulli.

use super::channel_flow::{LEAST_DEPTH, depression, froude_squared};
use super::input::{Input, Part};
use super::library::Shape;
use crate::frame::{GRAVITY, Vec3};
use crate::wrench::Wrench;

pub(super) fn basis(shape: &Shape, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let (state, immersion) = (input.condition, input.immersion);
    let froude2 = froude_squared(input);
    let head = 0.5 * froude2;
    let relative = if shape[0] > 0.0 {
        depression(input, shape[0]).unwrap_or(0.0)
    } else if shape[1] > 0.5 {
        head * (1.0 / (1.0 - froude2).abs().max(1e-9).sqrt()).min(2.0)
    } else {
        head
    };
    let depression = relative * immersion.depth.max(LEAST_DEPTH);
    let load = state.density * GRAVITY * depression * immersion.waterplane_area;
    let down = state.up.into_inner() * -load;
    emit(0, Part::Hull, input.at(down, &immersion.waterplane_center));
    let trim = Vec3::y() * (load * input.body.length * state.velocity.x.signum());
    emit(1, Part::Hull, Wrench { force: Vec3::zeros(), moment: trim });
}
