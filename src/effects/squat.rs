//! E9, the hull is drawn down by its own speed.
//!
//! `Fz = -c 1/2 rho v^2 A_wp g(Fr_h)`: the water beside and under a moving hull flows faster and stands lower by about
//! `v^2 / 2g` (Bernoulli, `g = 1`), or Tuck's `g = 1 / sqrt(|1 - Fr_h^2|)`, cut at 2. A second coefficient trims. Both are laws
//! of ships at Fr_h below 0.7: low confidence for us. The shape is 0 for Bernoulli and 1 for Tuck.

use super::input::{Input, Part};
use super::library::Shape;
use crate::frame::{GRAVITY, Vec3};
use crate::wrench::Wrench;

pub(super) fn basis(shape: &Shape, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let (state, immersion) = (input.condition, input.immersion);
    let speed = state.velocity.norm();
    let froude = speed * speed / (GRAVITY * immersion.depth.max(1e-3));
    let factor = if shape[0] > 0.5 { (1.0 / (1.0 - froude).abs().max(1e-9).sqrt()).min(2.0) } else { 1.0 };
    let load = input.half_density() * speed * speed * immersion.waterplane_area * factor;
    let down = state.up.into_inner() * -load;
    emit(0, Part::Hull, input.at(down, &immersion.waterplane_center));
    let trim = Vec3::y() * (load * input.body.length * state.velocity.x.signum());
    emit(1, Part::Hull, Wrench { force: Vec3::zeros(), moment: trim });
}
