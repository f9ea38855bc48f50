//! The water level is higher than stated.
//!
//! `W = dF/dd` per meter: `rho g A_wp` upwards at the center of the waterplane (Archimedes), and the model's drag in
//! proportion to the wet part of each panel, whose area is taken as even over its height. Exact to first order in the
//! offset; meant for offsets below a fifth of the depth.

use super::input::{DragSpeed, Input, Memory, Part};
use super::law::Law;
use super::spec::{Coefficient, EffectSpec, Quantity};
use crate::frame::GRAVITY;
use crate::wrench::Wrench;

/// An error of the stated water level; its law has one form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WaterLevelOffset;

impl Law for WaterLevelOffset {
    const SPEC: EffectSpec = EffectSpec {
        name: "water_level_offset",
        summary: "the water level is higher than stated",
        equation: "W = offset dF/dd: rho g A_wp upwards, and the model's drag in proportion to the depth",
        corrects: "pressure of still water: its level",
        total: "either",
        coefficients: &[Coefficient::new("offset", "m", -0.2, 0.2).up_to(0.05)],
        inputs: &[Quantity::Velocity, Quantity::ModelWrench],
        acts_on_own_drag: true,
        experiment: "stand still at two depths that differ by half, each measured with a ruler at the hull",
        ..EffectSpec::COMMON
    };

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let (state, immersion) = (input.condition, input.immersion);
        let stiffness = state.density * GRAVITY * immersion.waterplane_area * state.up.z;
        emit(0, Part::Hull, input.at(state.up.into_inner() * stiffness, &immersion.waterplane_center));
        let velocity = state.velocity;
        let drag = input.own_drag(DragSpeed::Whole);
        for (index, panel) in input.body.panels.iter().enumerate() {
            let part = &immersion.panels[index];
            // a panel that is wet in part grows with the level, by its height a meter
            let height = 12_f64.sqrt() * panel.spread.z;
            if part.fraction > 0.0 && part.fraction < 1.0 && height > 0.0 {
                let area = panel.windward(&velocity).component_mul(&drag) / height;
                let force = area.component_mul(&velocity) * (-input.half_density() * velocity.norm());
                emit(0, Part::Panel(index), input.at(force, &part.point));
            }
        }
    }
}
