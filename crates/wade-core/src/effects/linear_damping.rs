//! Drag in proportion to speed: waves and viscosity at low speed, where the quadratic law has none.
//!
//! `f_i = -c_i rho sqrt(g L) A_i u_i` on each wet panel with its local velocity `u = v + omega x r`; `A_i` is the wet area
//! that looks along axis i, both ways. `sqrt(g L)` is the speed of the waves as long as the hull, so `c` has no dimension.
//! Fossen, Handbook of Marine Craft Hydrodynamics, section 6.4, has the linear term of a hull that makes waves at a few
//! per cent of this scale to a few tenths. Meant for Froude numbers below about 0.3.

use super::input::{Input, Memory, Part};
use super::law::Law;
use super::spec::{Coefficient, EffectSpec, Quantity};
use crate::frame::{GRAVITY, Vec3};
use crate::wrench::Wrench;

/// Damping in proportion to speed; its law has one form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LinearDamping;

impl Law for LinearDamping {
    const SPEC: EffectSpec = EffectSpec {
        name: "linear_damping",
        summary: "drag in proportion to speed",
        equation: "f_i = -c_i rho sqrt(g L) A_i u_i, u = v + omega x r",
        corrects: "radiation damping and skin friction",
        total: "takes power",
        coefficients: &[
            Coefficient::published("surge", 0.0, 5.0, [0.0, 0.5]),
            Coefficient::published("sway", 0.0, 5.0, [0.0, 0.5]),
            Coefficient::published("heave", 0.0, 5.0, [0.0, 0.5]),
        ],
        inputs: &[Quantity::Velocity, Quantity::AngularVelocity],
        experiment: "hold a very low speed (Froude number below 0.1) and a high one at one depth",
        ..EffectSpec::COMMON
    };

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let scale = input.condition.density * (GRAVITY * input.body.length).sqrt();
        let omega = input.condition.angular_velocity;
        for (index, panel) in input.body.panels.iter().enumerate() {
            let part = &input.immersion.panels[index];
            if part.fraction == 0.0 {
                continue;
            }
            let area = (panel.facing_plus + panel.facing_minus) * (part.fraction * scale);
            let u = input.local_velocity(&part.point);
            let variance = panel.wet_spread(part).map(|spread| spread * spread);
            for axis in 0..3 {
                let mut load = input.at(Vec3::ith(axis, -area[axis] * u[axis]), &part.point);
                // velocity and lever both vary linearly over the panel: the second moments of its area give the rest exactly
                let turned =
                    Vec3::from_fn(|i, _| if i == axis { 0.0 } else { omega[i] * variance[3 - axis - i] });
                load.moment -= turned * area[axis];
                emit(axis, Part::Panel(index), load);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::condition::Condition;
    use crate::effects::{Body, Immersion};
    use crate::vehicle::shipped;

    #[test]
    fn second_moments_give_what_four_points_give() {
        let body = Body::of_vehicle(&shipped::husky().unwrap().vehicle().unwrap());
        let condition = Condition {
            angular_velocity: Vec3::new(0.3, -0.5, 0.8),
            ..Condition::level(Vec3::new(0.4, -0.2, 0.1), 0.17)
        };
        let mut immersion = Immersion::default();
        body.immerse(&condition, &mut immersion);
        let input = Input::of_motion(&body, &condition, &immersion);
        let mut found = [Wrench::default(); 3];
        LinearDamping.basis(&Memory::default(), &input, &mut |axis, _, load| found[axis] += load);
        let scale = 1000.0 * (GRAVITY * body.length).sqrt();
        let mut expected = [Wrench::default(); 3];
        for (panel, part) in body.panels.iter().zip(&immersion.panels) {
            let area = (panel.facing_plus + panel.facing_minus) * (0.25 * part.fraction * scale);
            for point in panel.points(part) {
                let u = input.local_velocity(&point);
                for (axis, sum) in expected.iter_mut().enumerate() {
                    *sum += input.at(Vec3::ith(axis, -area[axis] * u[axis]), &point);
                }
            }
        }
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found.force - expected.force).norm() < 1e-9 * (1.0 + expected.force.norm()));
            assert!((found.moment - expected.moment).norm() < 1e-9 * (1.0 + expected.moment.norm()));
            assert!(expected.moment.norm() > 0.1);
        }
    }
}
