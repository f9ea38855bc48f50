//! Lift of a hull that turns or drifts while it moves ahead, linear in yaw rate and drift.
//!
//! A hull under way sheds lift as a wing of low aspect ratio does: in proportion to speed times drift and to speed times yaw
//! rate. In the derivatives of maneuvering with the signs of SNAME (Nomenclature for Treating the Motion of a Submerged Body
//! through a Fluid, 1950), which stay the same where the axes are turned by half a turn about x:
//!
//! `Y = 1/2 rho A L Y_r u r`, `N = 1/2 rho A L N_v u v`
//!
//! `A` is the wet area seen from the side. Both change their sign astern, as they must for a hull that is alike fore and aft. The
//! other two derivatives are those of drag: `Y_v` of a coefficient across the hull, and `N_r` of the local velocity (`rotation`),
//! which is linear in a yaw rate that is small against speed over length. Inoue, Hirano and Kijima (Hydrodynamic derivatives on
//! ship manoeuvring, International Shipbuilding Progress 28, 1981) have `Y_r = pi k / 4` and `N_v = -k` with `k = 2 T / L`; the
//! bands are those of `k` up to 1, and of twice that in shallow water.

use super::input::{Input, Memory, Part};
use super::law::Law;
use super::spec::{Coefficient, EffectSpec, Quantity, Rate};
use crate::frame::Vec3;
use crate::wrench::Wrench;

/// Lift of a hull that turns or drifts; its law has one form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HullLift;

impl Law for HullLift {
    const SPEC: EffectSpec = EffectSpec {
        name: "hull_lift",
        summary: "lift of a hull that turns or drifts, linear in yaw rate and drift",
        equation: "Y = 1/2 rho A L Y_r u r, N = 1/2 rho A L N_v u v, A the wet area seen from the side",
        corrects: "none: drag of the elements is quadratic",
        total: "either: a lift is across the motion",
        coefficients: &[
            Coefficient::published("sway_of_yaw", -4.0, 4.0, [0.0, 1.6]),
            Coefficient::published("yaw_of_drift", -4.0, 4.0, [-2.0, 0.0]),
        ],
        inputs: &[Quantity::Velocity, Quantity::AngularVelocity],
        rates: &[Rate::Attitude],
        not_excited: "no trial turns or drifts while it moves ahead",
        experiment: "turn at two rates while moving ahead at one speed, and tow the vehicle at two angles of drift",
        ..EffectSpec::COMMON
    };

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let (mut area, mut middle) = (0.0, Vec3::zeros());
        let panels = input.body.panels.iter().zip(&input.immersion.panels);
        for (panel, wet) in panels.filter(|(_, wet)| wet.fraction > 0.0) {
            let own = 0.5 * (panel.facing_plus.y + panel.facing_minus.y) * wet.fraction;
            (area, middle) = (area + own, middle + wet.point * own);
        }
        if area == 0.0 {
            return;
        }
        let (v, r) = (input.condition.velocity, input.condition.angular_velocity.z);
        let scale = input.half_density() * area * input.body.length * v.x;
        let amidships = Vec3::new(0.0, 0.0, middle.z / area);
        emit(0, Part::Hull, input.at(Vec3::y() * (scale * r), &amidships));
        emit(1, Part::Hull, Wrench { force: Vec3::zeros(), moment: Vec3::z() * (scale * v.y) });
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::condition::Condition;
    use crate::effects::{Body, Immersion};
    use crate::vehicle::shipped;

    /// Loads of both coefficients at 1, at `[u, v, r]`.
    fn loads([u, v, r]: [f64; 3]) -> [Wrench; 2] {
        let body = Body::of_vehicle(&shipped::husky().unwrap().vehicle().unwrap());
        let condition =
            Condition { angular_velocity: Vec3::z() * r, ..Condition::level(Vec3::new(u, v, 0.0), 0.17) };
        let mut immersion = Immersion::default();
        body.immerse(&condition, &mut immersion);
        let input = Input::of_motion(&body, &condition, &immersion);
        let mut found = [Wrench::default(); 2];
        HullLift.basis(&Memory::default(), &input, &mut |coefficient, _, load| found[coefficient] += load);
        found
    }

    #[test]
    fn lift_is_mirrored_port_to_starboard_and_fore_to_aft() {
        let [u, v, r] = [0.8, 0.2, 0.4];
        let of = |state| {
            let [turning, drifting] = loads(state);
            [turning.force.y, drifting.moment.z]
        };
        let ahead @ [y, n] = of([u, v, r]);
        assert!(y.abs() > 1.0 && n.abs() > 1.0, "{ahead:?}");
        assert_eq!(of([u, -v, -r]), [-y, -n]);
        assert_eq!(of([-u, v, -r]), [y, -n]);
    }

    #[test]
    fn it_grows_with_speed_times_yaw_rate_and_speed_times_drift() {
        let of = |state| loads(state).map(|load| load.force.y + load.moment.z);
        let once = of([0.5, 0.1, 0.3]);
        for twice in [of([1.0, 0.1, 0.3]), of([0.5, 0.2, 0.6])] {
            let ratios = [twice[0] / once[0], twice[1] / once[1]];
            assert!(ratios.iter().all(|ratio| (ratio - 2.0).abs() < 1e-12), "{ratios:?}");
        }
    }
}
