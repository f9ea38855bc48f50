//! Waves that the hull has made before and that still push it.
//!
//! Cummins (1962) has the radiation force as a convolution of past motion. Over the acceleration it is
//! `F = -int K(s) a(t - s) ds` with a `K` that dies out, since steady motion makes no such force. Two kernels of one complex
//! pole, advanced in time by `z' = -(1/T - iW) z + a`, exactly but for the mean of `a` over a step that acts at its middle:
//! `F = -k rho V sqrt(g / L) Re z`, `K ~ exp(-t/T) cos(W t)`, which answers at once, and
//! `F = -k rho V (g / L) Im z / W`, `K ~ exp(-t/T) sin(W t) / W`, the lowest order that also vanishes at infinite frequency
//! (Perez and Fossen, Modeling, Identification and Control 30, 2009: zeros of the retardation function). Shape: T [s],
//! W [rad/s], and 0 for the first or 1 for the second, whose W is not 0.

use super::input::{Input, Memory, Part};
use super::library::Shape;
use crate::frame::{GRAVITY, Vec3};
use crate::wrench::Wrench;

pub(super) fn advance(shape: &Shape, memory: &mut Memory, input: &Input, dt: f64) {
    let state = input.condition;
    // the rate in body axes of the velocity through the water, in a steady current
    let now = state.acceleration - state.angular_velocity.cross(&state.velocity);
    if dt <= 0.0 {
        // the first state of a run; one that is asked for again moves nothing
        memory.motion.get_or_insert(now);
        return;
    }
    // of the step, whose ends are states: what begins within it has acted for half of it
    let motion = 0.5 * (memory.motion.replace(now).unwrap_or(now) + now);
    let decay = (-dt / shape[0].max(1e-6)).exp();
    let (sine, cosine) = (shape[1] * dt).sin_cos();
    let (real, imaginary) = (memory.real, memory.imaginary);
    let (half_sine, half_cosine) = (0.5 * shape[1] * dt).sin_cos();
    let half = (-0.5 * dt / shape[0].max(1e-6)).exp() * dt;
    memory.real = (real * cosine - imaginary * sine) * decay + motion * (half * half_cosine);
    memory.imaginary = (real * sine + imaginary * cosine) * decay + motion * (half * half_sine);
}

pub(super) fn basis(
    shape: &Shape,
    memory: &Memory,
    input: &Input,
    emit: &mut impl FnMut(usize, Part, Wrench),
) {
    let rate = GRAVITY / input.body.length;
    let remembered = match shape[2] > 0.5 {
        true => memory.imaginary * (rate / shape[1].max(1e-6)),
        false => memory.real * rate.sqrt(),
    };
    let mass = input.condition.density * input.immersion.volume;
    for axis in 0..3 {
        let force = Vec3::ith(axis, -mass * remembered[axis]);
        emit(axis, Part::Hull, input.at(force, &input.immersion.center_of_buoyancy));
    }
}
