//! Water that moves over ground with `u`, fixed in the world.
//!
//! `f = F(v - w) - F(v)` with what the model answers at either velocity through the water, `w = R^T u`. That is not linear in
//! `u`: a law `D(v - w) - D(v)` is, on each wet panel, with the drag of the model itself, `D(v) = -K |v| v`, `K` from
//! what the model answers in the state (`Input::own_drag`), written as
//! `K |v - w0| w + K v ((2 v - w0) . w) / (|v - w0| + |v|)`. It is exact at `w = w0`, the estimate `u0`, and what the model answers
//! otherwise there is added along the estimate. Fitting sets it to the current again and again. Without a model to ask the law stands
//! alone. With [`DragSpeed::PerAxis`] the drag is `D_i(v) = -K_i |v_i| v_i` (the cross-flow principle; Fossen, Handbook of Marine Craft
//! Hydrodynamics, section 6.4).

use super::input::{DragSpeed, Elsewhere, Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, finite, form};
use super::spec::{Coefficient, EffectSpec, Quantity};
use crate::condition::Condition;
use crate::frame::Vec3;
use crate::wrench::Wrench;

/// A current with the estimate about which its load is linear.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Current {
    /// Estimate of the current to the east [m/s].
    pub east_mps: f64,
    /// Estimate of the current to the north [m/s].
    pub north_mps: f64,
    /// Speed of the drag.
    pub speed: DragSpeed,
}

impl Law for Current {
    const SPEC: EffectSpec = EffectSpec {
        name: "current",
        summary: "water that moves over ground",
        equation: "W = F(v - R^T u) - F(v) with the model's answer F",
        corrects: "none: the velocity through the water, unless a state has a current",
        total: "either",
        coefficients: &[
            Coefficient::new("east", "m/s", -3.0, 3.0).up_to(1.0),
            Coefficient::new("north", "m/s", -3.0, 3.0).up_to(1.0),
        ],
        inputs: &[Quantity::Velocity, Quantity::ModelWrench, Quantity::NoStatedCurrent, Quantity::Heading],
        acts_on_own_drag: true,
        experiment: "drive the same line in both directions, and stand still with the wheels locked",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        let (east_mps, north_mps) = (finite(numbers, 0)?, finite(numbers, 1)?);
        Ok(Self { east_mps, north_mps, speed: form(numbers, 2, &DragSpeed::ALL)? })
    }

    fn to_numbers(&self) -> Numbers {
        [self.east_mps, self.north_mps, f64::from(self.speed as u8)]
    }

    fn elsewhere(&self, input: &Input) -> Option<Elsewhere> {
        let water = input.body_from_world(self.east_mps, self.north_mps);
        let condition = Condition { velocity: input.condition.velocity - water, ..*input.condition };
        (water.norm() > 0.0).then_some(Elsewhere::of(condition))
    }

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let velocity = input.condition.velocity;
        let estimate = input.body_from_world(self.east_mps, self.north_mps);
        let through = velocity - estimate;
        let (fast, slow) = (through.norm(), velocity.norm());
        let drag = input.own_drag(self.speed);
        let estimates = [self.east_mps, self.north_mps];
        let mut law = Wrench::default();
        for (number, (east, north)) in [(1.0, 0.0), (0.0, 1.0)].into_iter().enumerate() {
            let w = input.body_from_world(east, north);
            let change = if self.speed == DragSpeed::PerAxis {
                Vec3::from_fn(|i, _| w[i] * secant(velocity[i], through[i]))
            } else {
                let along = (velocity * 2.0 - estimate).dot(&w) / (fast + slow).max(1e-9);
                w * fast + velocity * along
            };
            for (index, panel) in input.body.panels.iter().enumerate() {
                let part = &input.immersion.panels[index];
                let wet = part.fraction;
                if wet == 0.0 {
                    continue;
                }
                let facing = panel.windward(&through);
                let area = facing.component_mul(&drag) * (input.half_density() * wet);
                let force: Vec3 = area.component_mul(&change);
                let load = input.at(force, &part.point);
                emit(number, Part::Panel(index), load);
                law += load * estimates[number];
            }
        }
        if let Some(change) = input.elsewhere {
            // along the estimate, so that at it the loads of both numbers sum to the change
            let left = change + law * -1.0;
            let square: f64 = estimates.iter().map(|w| w * w).sum();
            (0..2).for_each(|number| emit(number, Part::Hull, left * (estimates[number] / square)));
        }
    }
}

/// Slope of `x |x|` between two values.
fn secant(a: f64, b: f64) -> f64 {
    b.abs() + a * (a + b) / (a.abs() + b.abs()).max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_secant_is_the_difference_over_the_step() {
        for (a, b) in [(1.5, 1.2), (0.3, -0.4), (-2.0, 0.0), (-1.0, -1.3)] {
            let exact: f64 = (a * f64::abs(a) - b * f64::abs(b)) / (a - b);
            assert!((secant(a, b) - exact).abs() < 1e-12, "{a} {b}");
        }
    }
}
