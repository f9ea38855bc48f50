//! Promise: whatever numbers come in, the answer is an error that names the field or forces that are finite.

mod common;

use common::model;
use proptest::prelude::*;
use std::sync::LazyLock;
use wade::model::Model;
use wade::service::Evaluator;
use wade::service::wire::State;

static HUSKY: LazyLock<Model> = LazyLock::new(|| model("husky"));

/// Any bit pattern at all, with the plausible ones common enough to get past the checks.
fn number(scale: f32) -> impl Strategy<Value = f32> {
    prop_oneof![8 => -scale..scale, 1 => any::<u32>().prop_map(f32::from_bits), 1 => Just(0.0)]
}

fn vector(scale: f32) -> impl Strategy<Value = [f32; 3]> {
    [number(scale), number(scale), number(scale)]
}

fn direction() -> impl Strategy<Value = [f32; 3]> {
    let unit = (-3.2_f64..3.2, -3.2_f64..3.2).prop_map(|(roll, pitch)| {
        wade::service::grpc::single(&-wade::frame::up_from_roll_pitch(roll, pitch).into_inner())
    });
    prop_oneof![6 => unit, 2 => Just([0.0, 0.0, -1.0]), 1 => vector(1.0)]
}

prop_compose! {
    fn state()(
        velocity in vector(1e3), current in vector(1e3), angular_velocity in vector(1e3),
        acceleration in vector(1e5), angular_acceleration in vector(1e5), gravity in direction(),
        depth in number(1e3), density in number(1e5), dry_contact in any::<bool>(),
    ) -> State {
        State { velocity, current, angular_velocity, acceleration, angular_acceleration, gravity, depth: depth.abs(),
                density: density.abs(), dry_contact }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn an_answer_is_finite_or_an_error_that_names_a_field(state in state()) {
        let mut evaluator = Evaluator::default();
        match evaluator.evaluate(&HUSKY, &state) {
            Ok(evaluated) => {
                let forces = evaluated.forces;
                let single = |v: &wade::frame::Vec3| wade::service::grpc::single(v).iter().all(|x| x.is_finite());
                prop_assert!(single(&forces.wrench.force) && single(&forces.wrench.moment), "{forces:?}");
                prop_assert!(forces.surfaces.iter().all(|load| single(&load.force) && single(&load.point)));
                prop_assert!(single(&forces.uncertainty));
            }
            Err(invalid) => prop_assert!(invalid.to_string().starts_with(invalid.field.name())),
        }
    }
}
