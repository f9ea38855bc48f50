//! Local velocity of a turning hull, for a model that knows the velocity of the origin only.
//!
//! `f = D(v + omega x r) - D(v)` on each wet panel with the quadratic drag `D_i(u) = -1/2 rho C A_i |u| u_i`, `r` over four
//! points of the panel. `C` is that of a bluff body, 0.4 to 2.1 (as `drag_coefficient_error`). Strips know the load across
//! the hull alone, see [`Extent`]. With [`DragSpeed::PerAxis`] it is the cross-flow principle, `|u_y| u_y` across the hull
//! and nothing else (Fossen, Handbook of Marine Craft Hydrodynamics, section 6.4).

use super::input::{DragSpeed, Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, form, unused};
use super::spec::{Coefficient, EffectSpec, Quantity, Rate};
use crate::frame::Vec3;
use crate::wrench::Wrench;

/// Which loads a turning hull adds. The numbers are those of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Extent {
    /// 0: across the hull and upwards, of strips that have one velocity each.
    #[default]
    Strips,
    /// 1: along the hull as well, each side with its own velocity.
    Whole,
}

/// Drag of a turning hull with its form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rotation {
    /// Which loads it adds.
    pub extent: Extent,
    /// Speed of the drag; where each axis has its own, the drag across the hull is the only one.
    pub speed: DragSpeed,
}

impl Law for Rotation {
    const SPEC: EffectSpec = EffectSpec {
        name: "rotation",
        summary: "local velocity from the angular velocity",
        equation: "f = D(v + omega x r) - D(v), D_i(u) = -1/2 rho C A_i |u| u_i",
        corrects: "drag with the local velocity v + omega x r",
        total: "takes power",
        coefficients: &[Coefficient::published("drag_coefficient", 0.0, 6.0, [0.4, 2.1])],
        inputs: &[Quantity::Velocity, Quantity::AngularVelocity],
        rates: &[Rate::Attitude],
        not_excited: "no trial turns",
        experiment: "turn on the spot at two rates without moving ahead",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 2)?;
        let extent = form(numbers, 0, &[Extent::Strips, Extent::Whole])?;
        Ok(Self { extent, speed: form(numbers, 1, &DragSpeed::ALL)? })
    }

    fn to_numbers(&self) -> Numbers {
        [f64::from(self.extent as u8), f64::from(self.speed as u8), 0.0]
    }

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let velocity = input.condition.velocity;
        let cross_flow = self.speed == DragSpeed::PerAxis;
        for (index, panel) in input.body.panels.iter().enumerate() {
            let part = &input.immersion.panels[index];
            let wet = part.fraction;
            if wet == 0.0 {
                continue;
            }
            let drag = |u: &Vec3| {
                let speed = if cross_flow { u.abs() } else { Vec3::repeat(u.norm()) };
                -panel.windward(u).component_mul(u).component_mul(&speed)
            };
            let scale = 0.25 * wet * input.half_density();
            for point in panel.points(part) {
                // a strip has one velocity across the hull; its two sides share it
                let across =
                    panel.facing_plus.y + panel.facing_minus.y > 0.0 && self.extent == Extent::Strips;
                let at = if across { Vec3::new(point.x, 0.0, point.z) } else { point };
                let local = input.local_velocity(&at);
                let force: Vec3 = (drag(&local) - drag(&velocity)) * scale;
                let along = if self.extent == Extent::Whole { force.x } else { 0.0 };
                let up = if cross_flow { 0.0 } else { force.z };
                emit(0, Part::Panel(index), input.at(Vec3::new(along, force.y, up), &point));
            }
        }
    }
}
