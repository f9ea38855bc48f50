//! Waves that the hull has made before and that still push it.
//!
//! Cummins (1962) has the radiation force as a convolution of past motion. Over the acceleration it is
//! `F = -int K(s) a(t - s) ds` with a `K` that dies out, since steady motion makes no such force. Two kernels of one complex
//! pole, advanced in time by `z' = -(1/T - iW) z + a`, exactly but for the mean of `a` over a step that acts at its middle:
//! `F = -k rho V sqrt(g / L) Re z`, `K ~ exp(-t/T) cos(W t)`, which answers at once, and
//! `F = -k rho V (g / L) Im z / W`, `K ~ exp(-t/T) sin(W t) / W`, the lowest order that also vanishes at infinite frequency
//! (Perez and Fossen, Modeling, Identification and Control 30, 2009: zeros of the retardation function).

use super::input::{Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, amount, form};
use super::spec::{Coefficient, EffectSpec, Parameter, Quantity, Rate};
use crate::frame::{GRAVITY, Vec3};
use crate::wrench::Wrench;

/// How the memory answers an acceleration. The numbers are those of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kernel {
    /// 0: at once, `exp(-t/T) cos(W t)`.
    #[default]
    Cosine,
    /// 1: later, `exp(-t/T) sin(W t) / W`, for a `W` greater than 0.
    Sine,
}

/// A memory of one complex pole.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WaveMemory {
    /// Time in which it fades, `T` [s].
    pub time_constant_s: f64,
    /// Frequency with which it swings, `W` [rad/s].
    pub frequency_radps: f64,
    /// How it answers.
    pub kernel: Kernel,
}

impl Law for WaveMemory {
    const SPEC: EffectSpec = EffectSpec {
        name: "wave_memory",
        summary: "memory of the waves that the hull made",
        equation: "f_i = -k_i rho V sqrt(g / L) Re z_i, or -k_i rho V (g / (L W)) Im z_i, z' = -(1/T - i W) z + dv/dt in body axes",
        corrects: "waves",
        total: "takes power in each period",
        coefficients: &[
            Coefficient::new("surge", "1", -10.0, 10.0),
            Coefficient::new("sway", "1", -10.0, 10.0),
            Coefficient::new("heave", "1", -10.0, 10.0),
        ],
        parameters: &[
            Parameter { name: "time_constant", unit: "s" },
            Parameter { name: "frequency", unit: "rad/s" },
        ],
        inputs: &[Quantity::Velocity, Quantity::AngularVelocity, Quantity::Acceleration, Quantity::Session],
        rates: &[Rate::Acceleration],
        has_memory: true,
        not_excited: "no trial changes its speed",
        experiment: "speed up within a second, then hold the speed for 10 s; repeat after 2 s and after 60 s of rest",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        let (time_constant_s, frequency_radps) = (amount(numbers, 0)?, amount(numbers, 1)?);
        Ok(Self {
            time_constant_s,
            frequency_radps,
            kernel: form(numbers, 2, &[Kernel::Cosine, Kernel::Sine])?,
        })
    }

    fn to_numbers(&self) -> Numbers {
        [self.time_constant_s, self.frequency_radps, f64::from(self.kernel as u8)]
    }

    fn advance(&self, memory: &mut Memory, input: &Input, dt: f64) {
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
        let decay = (-dt / self.time_constant_s.max(1e-6)).exp();
        let (sine, cosine) = (self.frequency_radps * dt).sin_cos();
        let (real, imaginary) = (memory.real, memory.imaginary);
        let (half_sine, half_cosine) = (0.5 * self.frequency_radps * dt).sin_cos();
        let half = (-0.5 * dt / self.time_constant_s.max(1e-6)).exp() * dt;
        memory.real = (real * cosine - imaginary * sine) * decay + motion * (half * half_cosine);
        memory.imaginary = (real * sine + imaginary * cosine) * decay + motion * (half * half_sine);
    }

    fn basis(&self, memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let rate = GRAVITY / input.body.length;
        let remembered = match self.kernel {
            Kernel::Sine => memory.imaginary * (rate / self.frequency_radps.max(1e-6)),
            Kernel::Cosine => memory.real * rate.sqrt(),
        };
        let mass = input.condition.density * input.immersion.volume;
        for axis in 0..3 {
            let force = Vec3::ith(axis, -mass * remembered[axis]);
            emit(axis, Part::Hull, input.at(force, &input.immersion.center_of_buoyancy));
        }
    }
}
