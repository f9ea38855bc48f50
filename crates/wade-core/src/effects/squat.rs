//! The hull sinks with its own speed.
//!
//! `Fz = -c rho g A_wp s` with the depression `s` of the water beside and under the hull, where it flows faster. A second
//! coefficient trims. Four laws:
//!
//! - open water, `s = v^2 / 2g` (Bernoulli), or `s = v^2 / 2g / sqrt(|1 - Fr_h^2|)` (Tuck), cut at twice the former;
//! - open water, Bernoulli up to a Froude number `F`, and `s / d = F^2 / 2` above it: near `Fr_h = 1` the waves that the hull
//!   makes leave it no faster than it moves, and no law of steady flow holds. All of the load is that of water that stands
//!   lower by `c s`, `-c s dW/dd` of `water_level_offset`: what is no longer wet has no drag either;
//! - a channel of known width: Bernoulli and continuity in one dimension, `channel_flow`.
//!
//! All are laws of ships at Fr_h below 0.7: low confidence for us.

use super::channel_flow::{LEAST_DEPTH, depression, froude_squared};
use super::input::{Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, amount, form, unused};
use super::spec::{Coefficient, EffectSpec, Parameter, Quantity};
use super::water_level_offset::WaterLevelOffset;
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
    /// Open water, Bernoulli up to a Froude number and as there above it, for the drag as well.
    Held {
        /// Froude number at which the depression ends to grow [-]; greater than 0.
        faded_at: f64,
    },
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
        equation: "Fz = -c rho g A_wp s, s = v^2 / 2g (or / sqrt(|1 - Fr_h^2|), at most twice), or W = -c s dW/dd of water_level_offset with s / d as at faded_at above that Fr_h, in a channel s / d = Fr_h^2 / 2 (((1 - m)(1 - s / d))^-2 - 1) up to Schijf's limit and from there to 0 at faded_at, m = V / (L w d) but at most b / w, and a trim",
        corrects: "pressure of still water and drag: their level at speed",
        total: "down",
        coefficients: &[
            Coefficient::published("sinkage", 0.0, 4.0, [0.1, 1.5]),
            Coefficient::new("trim", "1", -2.0, 2.0),
        ],
        parameters: &[Parameter { name: "faded_at", unit: "1" }],
        inputs: &[Quantity::Velocity, Quantity::ModelWrench],
        acts_on_own_drag: true,
        needs_its_first: true,
        experiment: "hold at least four steady speeds at two depths and measure the vertical force",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        let faded_at = amount(numbers, 0)?;
        unused(numbers, 2)?;
        match form(numbers, 1, &[0, 1, 2])? {
            0 if faded_at > 0.0 => Ok(Self::Channel { faded_at }),
            2 if faded_at > 0.0 => Ok(Self::Held { faded_at }),
            1 if faded_at > 0.0 => Err(ShapeFault { index: 1, expected: "0 or 2".to_owned() }),
            0 => Ok(Self::Bernoulli),
            1 => Ok(Self::Tuck),
            _ => Err(ShapeFault { index: 0, expected: "greater than 0".to_owned() }),
        }
    }

    fn to_numbers(&self) -> Numbers {
        match *self {
            Self::Bernoulli => [0.0; 3],
            Self::Tuck => [0.0, 1.0, 0.0],
            Self::Held { faded_at } => [faded_at, 2.0, 0.0],
            Self::Channel { faded_at } => [faded_at, 0.0, 0.0],
        }
    }

    fn basis(&self, memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let (state, immersion) = (input.condition, input.immersion);
        let froude2 = froude_squared(input);
        let head = 0.5 * froude2;
        let relative = match *self {
            Self::Channel { faded_at } => depression(input, faded_at).unwrap_or(0.0),
            Self::Tuck => head * (1.0 / (1.0 - froude2).abs().max(1e-9).sqrt()).min(2.0),
            Self::Held { faded_at } => head.min(0.5 * faded_at * faded_at),
            Self::Bernoulli => head,
        };
        let depression = relative * immersion.depth.max(LEAST_DEPTH);
        let load = state.density * GRAVITY * depression * immersion.waterplane_area;
        if matches!(self, Self::Held { .. }) {
            let mut lower = |_, part, per_meter: Wrench| emit(0, part, per_meter * -depression);
            WaterLevelOffset::default().basis(memory, input, &mut lower);
        } else {
            let down = state.up.into_inner() * -load;
            emit(0, Part::Hull, input.at(down, &immersion.waterplane_center));
        }
        let trim = Vec3::y() * (load * input.body.length * state.velocity.x.signum());
        emit(1, Part::Hull, Wrench { force: Vec3::zeros(), moment: trim });
    }

    fn needs_channel_width(&self) -> bool {
        matches!(self, Self::Channel { .. })
    }
}
