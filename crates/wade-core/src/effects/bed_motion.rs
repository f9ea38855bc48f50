//! Driving over the bed instead of standing on it in a current.
//!
//! A model learnt from parked hulls has the slow water near the bed under the hull; a hull that drives through still water
//! has not; and its wheels roll, which bear a side force of their own where it drifts. `F = 1/2 rho A |v_g| (-C_D v_g -
//! C_S v_gy y + C_L |v_g| up)` with the velocity over ground `v_g` and its part `v_gy` along the axles `y`. The slow layer is
//! thin, so the drag changes at the foot of the hull and the lift under its middle. The paper's CFD is of parked hulls. See
//! [`BedArea`] for `A`. Coefficients come from paired CFD cases; there is no published band.

use super::input::{Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, form, unused};
use super::spec::{Coefficient, EffectSpec, Quantity};
use crate::frame::Vec3;
use crate::wrench::Wrench;

/// Which area carries the load. The numbers are those of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BedArea {
    /// 0: the wet front.
    #[default]
    Front,
    /// 1: the wet underside, which does not grow with the depth.
    Underside,
    /// 2: the area that the model's own drag speaks of, `|D| / (1/2 rho K v^2)` with its coefficient `K` ahead.
    OfDrag,
}

/// Motion over the bed with the area that carries its load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BedMotion {
    /// Which area.
    pub area: BedArea,
}

impl Law for BedMotion {
    const SPEC: EffectSpec = EffectSpec {
        name: "bed_motion",
        summary: "the vehicle drives over the bed; the model's is parked in a current",
        equation: "F = 1/2 rho A |v_g| (-C_D v_g - C_S v_gy y + C_L |v_g| up), A the wet front or underside or |D| / (1/2 rho K v^2) with the model's drag D; the drag and the side force at the bed, the lift under the center of buoyancy",
        corrects: "none: the bed acts on added mass alone",
        total: "either across the motion; takes power along it",
        coefficients: &[
            Coefficient::new("drag", "1", -4.0, 4.0),
            Coefficient::new("lift", "1", -4.0, 4.0),
            Coefficient::new("side", "1", -4.0, 4.0),
        ],
        inputs: &[Quantity::GroundVelocity],
        experiment: "tow the parked vehicle (wheels locked, on a carriage) at the speeds at which it drove",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 1)?;
        Ok(Self { area: form(numbers, 0, &[BedArea::Front, BedArea::Underside, BedArea::OfDrag])? })
    }

    fn to_numbers(&self) -> Numbers {
        [f64::from(self.area as u8), 0.0, 0.0]
    }

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let state = input.condition;
        let up = state.up.into_inner();
        let ground = state.ground_velocity;
        let ground = ground - up * ground.dot(&up);
        let speed = ground.norm();
        let at_bed = |point: Vec3| Vec3::new(point.x, point.y, input.body.z0);
        let middle = at_bed(input.immersion.center_of_buoyancy);
        let across = Vec3::y() * ground.y;
        if self.area == BedArea::OfDrag {
            let load = input.half_density() * area_of_drag(input) * speed;
            emit(0, Part::Hull, input.at(ground * -load, &middle));
            emit(1, Part::Hull, input.at(up * (load * speed), &middle));
            emit(2, Part::Hull, input.at(across * -load, &middle));
            return;
        }
        for (index, panel) in input.body.panels.iter().enumerate() {
            let part = &input.immersion.panels[index];
            let underside = self.area == BedArea::Underside;
            let facing = if underside { panel.facing_minus.z } else { panel.windward(&ground).x };
            let load = input.half_density() * facing * part.fraction * speed;
            emit(0, Part::Panel(index), input.at(ground * -load, &at_bed(part.point)));
            emit(1, Part::Panel(index), input.at(up * (load * speed), &middle));
            emit(2, Part::Panel(index), input.at(across * -load, &at_bed(part.point)));
        }
    }

    fn is_in_proportion(&self) -> bool {
        self.area == BedArea::OfDrag
    }
}

/// Area that meets the flow as the model's drag across gravity has it [m2]; none where there is hardly a flow.
fn area_of_drag(input: &Input) -> f64 {
    const SLOWEST: f64 = 0.1;
    let speed = input.condition.velocity.norm();
    if speed < SLOWEST || input.base_drag.x < 1e-3 {
        return 0.0;
    }
    input.predicted_drag_force().norm() / (input.half_density() * speed * speed * input.base_drag.x)
}
