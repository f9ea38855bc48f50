//! The water level is higher than stated.
//!
//! At the estimate `o` of the offset, `F(h + o) - F(h)` with what the model answers at either level. Without an estimate, and
//! where the model cannot be asked, a law: per meter the buoyancy of the layer up to `o`, `rho g (V(h + o) - V(h)) / o` upwards at
//! its center (Archimedes); without an estimate its limit, `rho g A_wp`. And the model's drag in proportion to the wet part of
//! each panel, whose area is taken as even over its height; this part is of first order, meant for offsets below a fifth of the
//! depth. Fitting sets the estimate to the offset again and again.

use super::immersion::Immersion;
use super::input::{DragSpeed, Elsewhere, Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, finite, unused};
use super::spec::{Coefficient, EffectSpec, Quantity};
use crate::condition::Condition;
use crate::frame::GRAVITY;
use crate::wrench::Wrench;

/// Least estimate whose layer is more than rounding [m].
const THIN: f64 = 1e-4;

/// An error of the stated water level with the estimate at which its buoyancy is exact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WaterLevelOffset {
    /// Estimate of the offset [m].
    pub estimate_m: f64,
}

impl Law for WaterLevelOffset {
    const SPEC: EffectSpec = EffectSpec {
        name: "water_level_offset",
        summary: "the water level is higher than stated",
        equation: "W = F(h + offset) - F(h) with the model's answer F",
        corrects: "pressure of still water: its level",
        total: "either",
        coefficients: &[Coefficient::new("offset", "m", -0.2, 0.2).up_to(0.05)],
        inputs: &[Quantity::Velocity, Quantity::ModelWrench],
        acts_on_own_drag: true,
        experiment: "stand still at two depths that differ by half, each measured with a ruler at the hull",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 1)?;
        Ok(Self { estimate_m: finite(numbers, 0)? })
    }

    fn to_numbers(&self) -> Numbers {
        [self.estimate_m, 0.0, 0.0]
    }

    fn elsewhere(&self, input: &Input) -> Option<Elsewhere> {
        let condition = input.condition;
        let condition = Condition {
            depth: condition.depth + self.estimate_m,
            // a depth is counted along the body's z
            water_level: condition.water_level.map(|level| level + self.estimate_m * condition.up.z),
            ..*condition
        };
        (self.estimate_m.abs() >= THIN).then_some(Elsewhere::of(condition))
    }

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let (state, immersion) = (input.condition, input.immersion);
        let mut law = Wrench::default();
        let mut emit_law = |part: Part, load: Wrench| {
            law += load;
            emit(0, part, load);
        };
        let upwards = state.up.into_inner() * (state.density * GRAVITY);
        let layer = if self.estimate_m.abs() < THIN {
            input.at(upwards * (immersion.waterplane_area * state.up.z), &immersion.waterplane_center)
        } else {
            // a depth is counted along the body's z
            let mut plane = state.water_plane(input.body.z0);
            plane.offset += self.estimate_m * state.up.z;
            let mut raised = Immersion::default();
            input.body.displace(&plane, &mut raised);
            let buoyancy =
                |of: &Immersion, share: f64| input.at(upwards * (of.volume * share), &of.center_of_buoyancy);
            let per_meter = self.estimate_m.recip();
            buoyancy(&raised, per_meter) + buoyancy(immersion, -per_meter)
        };
        emit_law(Part::Hull, layer);
        let velocity = state.velocity;
        let drag = input.own_drag(DragSpeed::Whole);
        for (index, panel) in input.body.panels.iter().enumerate() {
            let part = &immersion.panels[index];
            // a panel that is wet in part grows with the level, by its height a meter
            let height = 12_f64.sqrt() * panel.spread.z;
            if part.fraction > 0.0 && part.fraction < 1.0 && height > 0.0 {
                let area = panel.windward(&velocity).component_mul(&drag) / height;
                let force = area.component_mul(&velocity) * (-input.half_density() * velocity.norm());
                emit_law(Part::Panel(index), input.at(force, &part.point));
            }
        }
        if let Some(change) = input.elsewhere {
            emit(0, Part::Hull, change * self.estimate_m.recip() + law * -1.0);
        }
    }
}
