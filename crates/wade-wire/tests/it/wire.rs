//! Promise: whatever numbers come in, the answer is an error that names the field or forces that are finite.

use crate::common::{every_effect, served_with};
use proptest::prelude::*;
use std::sync::LazyLock;
use wade_core::served::ServedVehicle;
use wade_core::served::Session;
use wade_wire::Evaluator;
use wade_wire::State;

static HUSKY: LazyLock<ServedVehicle> = LazyLock::new(|| served_with("husky", every_effect("husky")));

/// Any bit pattern at all, with the plausible ones common enough to get past the checks.
fn number(scale: f32) -> impl Strategy<Value = f32> {
    prop_oneof![8 => -scale..scale, 1 => any::<u32>().prop_map(f32::from_bits), 1 => Just(0.0)]
}

fn vector(scale: f32) -> impl Strategy<Value = [f32; 3]> {
    [number(scale), number(scale), number(scale)]
}

fn direction() -> impl Strategy<Value = [f32; 3]> {
    let unit = (-3.2_f64..3.2, -3.2_f64..3.2).prop_map(|(roll, pitch)| {
        wade_wire::single(&-wade_core::frame::up_from_roll_pitch(roll, pitch).into_inner())
    });
    prop_oneof![6 => unit, 2 => Just([0.0, 0.0, -1.0]), 1 => vector(1.0)]
}

prop_compose! {
    fn state()(
        velocity in vector(1e3), current in vector(1e3), angular_velocity in vector(1e3),
        acceleration in vector(1e5), angular_acceleration in vector(1e5), gravity in direction(),
        depth in number(1e3), density in number(1e5), dry_contact in any::<bool>(),
        given in (number(1e6), number(1e3), number(1e3), number(1e3)), implicit_added_mass in any::<bool>(),
    ) -> State {
        let (heading, depth_rate, wheel_speed, time_step) = given;
        State { velocity, current, angular_velocity, acceleration, angular_acceleration, gravity, depth: depth.abs(),
                density: density.abs(), dry_contact, heading: Some(heading), depth_rate: Some(depth_rate),
                wheel_speeds: Some([wheel_speed; 4].into()), time_step: time_step.abs(), implicit_added_mass, ..State::default() }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn an_answer_is_finite_or_an_error_that_names_a_field(state in state()) {
        let mut evaluator = Evaluator::default();
        let mut session = Session::default();
        match state.check().map(|checked| evaluator.evaluate(&HUSKY, &checked, Some(&mut session))) {
            Ok(evaluated) => {
                let forces = evaluated.forces;
                let effects = evaluated.effects;
                let single = |v: &wade_core::frame::Vec3| wade_wire::single(v).iter().all(|x| x.is_finite());
                prop_assert!(single(&forces.wrench.force) && single(&forces.wrench.moment), "{forces:?}");
                prop_assert!(forces.surfaces.iter().all(|load| single(&load.force) && single(&load.point)));
                prop_assert!(single(&forces.uncertainty));
                let finite = |w: &wade_core::wrench::Wrench| single(&w.force) && single(&w.moment);
                prop_assert!(effects.loads.iter().all(|load| finite(&load.wrench)), "{effects:?}");
                prop_assert!(effects.surface_forces.iter().all(single));
                prop_assert!(effects.added_mass.is_some_and(|m| m.iter().all(|x| (*x as f32).is_finite())));
            }
            Err(invalid) => prop_assert!(invalid.to_string().starts_with(invalid.field.name())),
        }
    }
}
