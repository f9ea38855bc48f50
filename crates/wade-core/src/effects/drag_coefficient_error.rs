//! Another coefficient of the quadratic drag.
//!
//! `f_i = -1/2 rho C_i A_i |v| v_i` on each wet panel, `A_i` the area that meets the flow. `C` is the difference to the
//! drag that the model has already, so it may be negative. Bluff bodies lie between 0.3 and 2.1 (Qi, Eames, Johnson, JFM
//! 2014; FEMA P-646 takes 2.0). Valid while the flow is subcritical; the local velocity of a turning hull is `rotation`.
//! [`DragLaw`] has other forms: `|v_i| v_i`, and the model's own drag `D` in proportion, `F_i = C_i / K_i D_i` with its
//! coefficients `K`, whatever law it follows: what the model answers less what it answers at rest. Where it cannot be asked,
//! `D` is the part of its force across gravity with its moment beyond that of still water.

use super::input::{Elsewhere, Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, form, unused};
use super::spec::{Coefficient, EffectSpec, Quantity};
use crate::condition::Condition;
use crate::frame::Vec3;
use crate::wrench::Wrench;

/// The drag to which the coefficients are added. The numbers are those of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DragLaw {
    /// 0: `|v| v_i`.
    #[default]
    Quadratic,
    /// 1: `|v_i| v_i`, where each axis has its own speed (the cross-flow principle).
    CrossFlow,
    /// 2: the model's own drag, in proportion.
    Proportional,
    /// 3: all that the model makes of the motion, in proportion: with the waves that the motion until now has left.
    WithWaves,
}

impl DragLaw {
    /// In the order of their numbers.
    pub const ALL: [Self; 4] = [Self::Quadratic, Self::CrossFlow, Self::Proportional, Self::WithWaves];
}

/// An error of the drag coefficients with the law that it follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DragCoefficientError {
    /// The drag to which the coefficients are added.
    pub law: DragLaw,
}

impl Law for DragCoefficientError {
    const SPEC: EffectSpec = EffectSpec {
        name: "drag_coefficient_error",
        summary: "quadratic drag with another coefficient",
        equation: "f_i = -1/2 rho C_i A_i |v| v_i",
        corrects: "drag of the elements, and what was learned of it",
        total: "takes power: at least zero with the base's",
        // the difference of two coefficients that each lie in 0 to 4
        coefficients: &[
            Coefficient::published("surge", -4.0, 4.0, [-1.0, 1.0]),
            Coefficient::published("sway", -4.0, 4.0, [-1.0, 1.0]),
            Coefficient::published("heave", -4.0, 4.0, [-1.0, 1.0]),
        ],
        reference: "added to the coefficient",
        acts_on_own_drag: true,
        inputs: &[Quantity::Velocity],
        experiment: "hold at least four steady speeds over the whole range at two depths",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 1)?;
        Ok(Self { law: form(numbers, 0, &DragLaw::ALL)? })
    }

    fn to_numbers(&self) -> Numbers {
        [f64::from(self.law as u8), 0.0, 0.0]
    }

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        if self.is_in_proportion() {
            return of_the_model(input, emit);
        }
        let velocity = input.condition.velocity;
        let whole = velocity.norm();
        let speed = |axis: usize| if self.law == DragLaw::CrossFlow { velocity[axis].abs() } else { whole };
        for (index, panel) in input.body.panels.iter().enumerate() {
            let part = &input.immersion.panels[index];
            let wet = part.fraction;
            if wet == 0.0 {
                continue;
            }
            let area = panel.windward(&velocity) * wet;
            for axis in 0..3 {
                let force =
                    Vec3::ith(axis, -input.half_density() * speed(axis) * area[axis] * velocity[axis]);
                emit(axis, Part::Panel(index), input.at(force, &part.point));
            }
        }
    }

    fn elsewhere(&self, input: &Input) -> Option<Elsewhere> {
        let (velocity, ground_velocity) = (Vec3::zeros(), Vec3::zeros());
        let condition = Condition { velocity, ground_velocity, ..*input.condition };
        let with_waves = self.law == DragLaw::WithWaves;
        self.is_in_proportion().then_some(Elsewhere { condition, wheels_at_rest: true, with_waves })
    }

    fn is_in_proportion(&self) -> bool {
        matches!(self.law, DragLaw::Proportional | DragLaw::WithWaves)
    }
}

fn of_the_model(input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let Wrench { force, moment } = match input.elsewhere {
        // what the motion makes of the load, along the body's axes as in the other forms
        Some(change) => change * -1.0,
        None => input.predicted_drag(),
    };
    for axis in (0..2).filter(|&axis| input.base_drag[axis] > 1e-3) {
        // a force along x turns about y, one along y about x and z
        let moment = if axis == 0 { Vec3::y() * moment.y } else { Vec3::new(moment.x, 0.0, moment.z) };
        let load = Wrench { force: Vec3::ith(axis, force[axis]), moment };
        emit(axis, Part::Hull, load * input.base_drag[axis].recip());
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::effects::{Body, Immersion};
    use crate::frame::GRAVITY;
    use crate::vehicle::shipped;

    #[test]
    fn a_model_that_cannot_be_asked_at_rest_has_the_drag_that_it_has_beyond_archimedes() {
        let body = Body::of_vehicle(&shipped::husky().unwrap().vehicle().unwrap());
        let condition = Condition::level(Vec3::new(0.9, -0.3, 0.0), 0.17);
        let mut immersion = Immersion::default();
        body.immerse(&condition, &mut immersion);
        let drag = Wrench { force: Vec3::new(-40.0, 25.0, 0.0), moment: Vec3::new(2.0, -7.0, 11.0) };
        let lift = Vec3::z() * (condition.density * GRAVITY * immersion.volume);
        let still = Wrench::from_force_at(lift, &immersion.center_of_buoyancy, &body.center_of_mass);
        let alone = Input {
            predicted: drag + still,
            base_drag: Vec3::new(1.2, 1.6, 1.0),
            ..Input::of_motion(&body, &condition, &immersion)
        };
        let asked = Input { elsewhere: Some(drag * -1.0), ..alone };
        let law = DragCoefficientError { law: DragLaw::Proportional };
        let [alone, asked] = [alone, asked].map(|input| {
            let mut found = [Wrench::default(); 3];
            law.basis(&Memory::default(), &input, &mut |axis, _, load| found[axis] += load);
            found
        });
        for (alone, asked) in alone.iter().zip(&asked) {
            let off = *alone + *asked * -1.0;
            assert!(off.force.norm() < 1e-9 && off.moment.norm() < 1e-9, "{off:?}");
        }
        // along y with the whole moment about up
        assert!((asked[1].moment.z - 11.0 / 1.6).abs() < 1e-9);
    }
}
