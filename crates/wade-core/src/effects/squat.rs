//! The hull sinks with its own speed.
//!
//! `Fz = -c rho g A_wp s` with the depression `s` of the water beside and under the hull, where it flows faster. A second
//! coefficient trims. Three laws:
//!
//! - open water, `s = v^2 / 2g` (Bernoulli), or `s = v^2 / 2g / sqrt(|1 - Fr_h^2|)` (Tuck), cut at twice the former;
//! - a channel of known width: Bernoulli and continuity in one dimension, `channel_flow`.
//!
//! All are laws of ships at Fr_h below 0.7: low confidence for us.

use super::channel_flow::{LEAST_DEPTH, depression, froude_squared};
use super::input::{Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, amount, form, unused};
use super::spec::{Coefficient, EffectSpec, Parameter, Quantity};
use crate::frame::{GRAVITY, Vec3};
use crate::wrench::Wrench;

/// The law of the depression.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Squat {
    /// Open water, Bernoulli.
    #[default]
    Bernoulli,
    /// Open water, Tuck.
    Tuck,
    /// A channel of known width.
    Channel {
        /// Froude number at which the depression is gone [-]; greater than 0.
        faded_at: f64,
    },
}

impl Law for Squat {
    const SPEC: EffectSpec = EffectSpec {
        name: "squat",
        summary: "the hull sinks with its own speed",
        equation: "Fz = -c rho g A_wp s, s = v^2 / 2g (or / sqrt(|1 - Fr_h^2|), at most twice), in a channel s / d = Fr_h^2 / 2 (((1 - m)(1 - s / d))^-2 - 1) up to Schijf's limit and from there to 0 at faded_at, m = V / (L w d) but at most b / w, and a trim",
        corrects: "none: the base has no lift from speed",
        total: "down",
        coefficients: &[
            Coefficient::published("sinkage", 0.0, 4.0, [0.1, 1.5]),
            Coefficient::new("trim", "1", -2.0, 2.0),
        ],
        parameters: &[Parameter { name: "faded_at", unit: "1" }],
        inputs: &[Quantity::Velocity],
        needs_its_first: true,
        experiment: "hold at least four steady speeds at two depths and measure the vertical force",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        let faded_at = amount(numbers, 0)?;
        if faded_at > 0.0 {
            unused(numbers, 1)?;
            return Ok(Self::Channel { faded_at });
        }
        unused(numbers, 2)?;
        form(numbers, 1, &[Self::Bernoulli, Self::Tuck])
    }

    fn to_numbers(&self) -> Numbers {
        match *self {
            Self::Bernoulli => [0.0; 3],
            Self::Tuck => [0.0, 1.0, 0.0],
            Self::Channel { faded_at } => [faded_at, 0.0, 0.0],
        }
    }

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let (state, immersion) = (input.condition, input.immersion);
        let froude2 = froude_squared(input);
        let head = 0.5 * froude2;
        let relative = match *self {
            Self::Channel { faded_at } => depression(input, faded_at).unwrap_or(0.0),
            Self::Tuck => head * (1.0 / (1.0 - froude2).abs().max(1e-9).sqrt()).min(2.0),
            Self::Bernoulli => head,
        };
        let depression = relative * immersion.depth.max(LEAST_DEPTH);
        let load = state.density * GRAVITY * depression * immersion.waterplane_area;
        let down = state.up.into_inner() * -load;
        emit(0, Part::Hull, input.at(down, &immersion.waterplane_center));
        let trim = Vec3::y() * (load * input.body.length * state.velocity.x.signum());
        emit(1, Part::Hull, Wrench { force: Vec3::zeros(), moment: trim });
    }

    fn needs_channel_width(&self) -> bool {
        matches!(self, Self::Channel { .. })
    }
}
