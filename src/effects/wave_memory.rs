//! E12, waves that the hull has made before and that still push it.
//!
//! Cummins (1962) has the radiation force as a convolution of past motion, `F = -int K(t - s) m(s) ds`. Here `K` is
//! `exp(-t / T) cos(W t)`, the real part of one complex pole, advanced exactly in time: `z' = -(1/T - iW) z + m`. The motion
//! `m` is the acceleration (a force that dies out in steady motion, `F = -k rho V sqrt(g / L) Re z`) or the velocity
//! (`F = -k rho V g / L Re z`). Shape: T [s], W [rad/s], and 0 for acceleration or 1 for velocity. Fossen, Handbook of
//! Marine Craft Hydrodynamics, section 5.4, replaces the convolution by a state space in the same way.

use super::input::{Input, Memory, Part};
use super::library::Shape;
use crate::frame::{GRAVITY, Vec3};
use crate::wrench::Wrench;

fn is_velocity(shape: &Shape) -> bool {
    shape[2] > 0.5
}

pub(super) fn advance(shape: &Shape, memory: &mut Memory, input: &Input, dt: f64) {
    let state = input.condition;
    let motion = if is_velocity(shape) {
        state.velocity
    } else {
        state.acceleration - state.angular_velocity.cross(&state.ground_velocity)
    };
    let decay = (-dt / shape[0].max(1e-6)).exp();
    let (sine, cosine) = (shape[1] * dt).sin_cos();
    let (real, imaginary) = (memory.real, memory.imaginary);
    // the motion of a step acts at its middle
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
    let rate = if is_velocity(shape) { rate } else { rate.sqrt() };
    let mass = input.condition.density * input.immersion.volume;
    for axis in 0..3 {
        let force = Vec3::ith(axis, -mass * rate * memory.real[axis]);
        emit(axis, Part::Hull, input.at(force, &input.immersion.center_of_buoyancy));
    }
}
