//! The walls of a channel: the flow past the hull is faster than the hull.
//!
//! The drag of the model at the velocity of the faster flow, less that at the hull's: `W = k (D(c v) - D(v))`. Two laws of `c`,
//! which say what `W` is where the model cannot be asked as well. By windward areas, `W = k D ((1 - m)^-2 - 1)` with the section
//! that the wet front takes as the blockage `m`: by continuity the flow beside the hull is `1 / (1 - m)` times as fast. Qi, Eames,
//! Johnson (JFM 2014) have
//! `(1 + Cd0 b / 2w)^2` instead, which agrees to a few per cent for b/w of 0.1 to 0.4, where both are meant to hold. And with
//! the model's own drag `D`, whatever law it follows, and the surface that falls where the flow is fast,
//! `channel_flow`. `k` is about 1.

use super::body::Panel;
use super::channel_flow::{self, MOST};
use super::input::{Elsewhere, Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, amount, unused};
use super::spec::{Coefficient, EffectSpec, Parameter, Quantity};
use crate::condition::Condition;
use crate::frame::Vec3;
use crate::wrench::Wrench;

/// The law of the faster flow.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum ChannelBlockage {
    /// By the windward areas.
    #[default]
    WindwardAreas,
    /// By the model's own drag and a surface that falls.
    FallingSurface {
        /// Froude number above which the surface stays where it is [-]; greater than 0.
        faded_at: f64,
    },
}

impl ChannelBlockage {
    /// How much more dynamic pressure the flow beside the hull has, as a share; none without walls or water.
    fn excess(&self, input: &Input) -> Option<f64> {
        if let Self::FallingSurface { faded_at } = *self {
            return channel_flow::excess(input, faded_at);
        }
        let (width, immersion) = (channel_flow::width(input)?, input.immersion);
        let wet = input.body.panels.iter().zip(&immersion.panels);
        let windward = |panel: &Panel| panel.windward(&input.condition.velocity).x;
        let front: f64 = wet.map(|(panel, wet)| windward(panel) * wet.fraction).sum();
        let blockage = (front / (width * immersion.depth)).min(MOST);
        Some((1.0 - blockage).powi(-2) - 1.0)
    }
}

impl Law for ChannelBlockage {
    const SPEC: EffectSpec = EffectSpec {
        name: "channel_blockage",
        summary: "side walls accelerate the flow",
        equation: "W = k (D(c v) - D(v)), c = 1 / (1 - m), m = A_wet,front / (w d), or c = 1 / ((1 - m)(1 - s / d)) with m and s of squat in a channel",
        corrects: "none: the base is in open water",
        total: "adds to the drag",
        coefficients: &[Coefficient::published("strength", 0.0, 5.0, [0.5, 1.5])],
        parameters: &[Parameter { name: "faded_at", unit: "1" }],
        inputs: &[Quantity::Velocity, Quantity::ChannelWidth],
        acts_on_own_drag: true,
        experiment: "repeat steady runs in a channel of another width, or in open water (channel_widths in trials.toml)",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 1)?;
        Ok(match amount(numbers, 0)? {
            0.0 => Self::WindwardAreas,
            faded_at => Self::FallingSurface { faded_at },
        })
    }

    fn to_numbers(&self) -> Numbers {
        match *self {
            Self::WindwardAreas => [0.0; 3],
            Self::FallingSurface { faded_at } => [faded_at, 0.0, 0.0],
        }
    }

    fn elsewhere(&self, input: &Input) -> Option<Elsewhere> {
        let faster = (1.0 + self.excess(input)?).sqrt();
        let condition = Condition { velocity: input.condition.velocity * faster, ..*input.condition };
        Some(Elsewhere::of(condition))
    }

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        if let Some(Wrench { force, moment }) = input.elsewhere {
            // the change of the drag alone: how the hull is drawn down is squat
            return emit(0, Part::Hull, Wrench { force: Vec3::new(force.x, force.y, 0.0), moment });
        }
        let Some(more) = self.excess(input) else { return };
        let (velocity, immersion) = (input.condition.velocity, input.immersion);
        if self.is_in_proportion() {
            return emit(0, Part::Hull, input.predicted_drag() * more);
        }
        let pressure = input.half_density() * velocity.norm() * more;
        for (index, panel) in input.body.panels.iter().enumerate() {
            let part = &immersion.panels[index];
            let area = panel.windward(&velocity).component_mul(&input.base_drag) * part.fraction;
            let force: Vec3 = area.component_mul(&velocity) * -pressure;
            emit(0, Part::Panel(index), input.at(force, &part.point));
        }
    }

    fn is_in_proportion(&self) -> bool {
        matches!(self, Self::FallingSurface { .. })
    }
}
