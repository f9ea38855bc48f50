//! Promise: water that moves by a wave, by levels at the wheels or by a sheared current is answered with the same bits over every
//! transport, single and in batches, and what cannot be answered is refused by the name of its field.

use wade_client::{Client, ClientError};
use wade_wire::{Field, Problem, State};

use crate::common::{Served, VEHICLES, without_base_on};
use wade_core::model::kernel::Isa;
use wade_core::served::ServedVehicle;
use wade_core::vehicle::PerWheel;

/// States in moving water, of which each batch has one kind.
fn kinds() -> [Vec<State>; 3] {
    let still = |i: u8| {
        let i = f32::from(i);
        State {
            velocity: [0.4 - 0.1 * i, 0.2, 0.05 * i],
            current: [-0.6, 0.1 * i, 0.0],
            angular_velocity: [0.1 * i, -0.2, 0.3],
            gravity: [0.06, -0.08, -0.994_987_4],
            ..State::still(0.08 + 0.04 * i)
        }
    };
    let wave = |i: u8| State {
        wave_vector: [1.5, -0.5 * f32::from(i), 0.1],
        wave_amplitude: 0.03,
        wave_phase: 1.7 * f32::from(i),
        ..still(i)
    };
    let levels = |i: u8| State {
        wheel_levels: Some([0.0, 0.02 * f32::from(i), -0.03, 0.01].into()),
        depth: f32::NAN,
        water_level: Some(-0.02),
        ..still(i)
    };
    let sheared = |i: u8| State { current_exponent: 0.1 * f32::from(i) + 0.1, ..still(i) };
    let five = |kind: &dyn Fn(u8) -> State| (0..5).map(kind).collect();
    [five(&wave), five(&levels), five(&sheared)]
}

#[test]
fn every_transport_has_the_same_bits() {
    let served = Served::start();
    for vehicle in VEHICLES {
        for states in kinds() {
            let still: Vec<State> = states
                .iter()
                .map(|s| State { wave_amplitude: 0.0, wheel_levels: None, current_exponent: 0.0, ..*s })
                .collect();
            let mut expected = None;
            for (name, mut client) in served.clients(vehicle) {
                let alone: Vec<_> =
                    states.iter().map(|state| client.evaluate(state).expect("answered").force).collect();
                let batch = client.evaluate_batch(&states).expect("answered");
                let batch: Vec<_> = batch.into_iter().map(|reply| reply.force).collect();
                let without: Vec<_> =
                    still.iter().map(|state| client.evaluate(state).expect("answered").force).collect();
                // a stream remembers from state to state, and so does a run: their times stand still here
                assert_eq!(alone, batch, "{name}");
                let expected = expected.get_or_insert_with(|| alone.clone());
                assert_eq!(*expected, alone, "{name}");
                assert!(alone.iter().zip(&without).all(|(moving, still)| moving != still), "{name}");
            }
        }
    }
}

fn refusal(client: &mut Client, state: &State) -> (Option<(Field, Problem)>, String) {
    let error = client.evaluate(state).expect_err("it is refused");
    let told = match &error {
        ClientError::Invalid(invalid) => Some((invalid.field, invalid.problem)),
        _ => None,
    };
    (told, error.to_string())
}

#[test]
fn what_cannot_be_answered_is_refused_by_name() {
    let served = Served::start();
    let good = State { wave_vector: [1.0, 0.0, 0.0], wave_amplitude: 0.05, ..State::still(0.1) };
    let levels = Some([0.0, f32::NAN, 0.0, 0.0].into());
    let cases = [
        (State { wave_vector: [f32::NAN, 0.0, 0.0], ..good }, Field::WaveVector, Problem::NotFinite),
        (State { wave_vector: [0.0; 3], ..good }, Field::WaveVector, Problem::NotPositive),
        (State { wave_vector: [1e9, 0.0, 0.0], ..good }, Field::WaveVector, Problem::TooLarge),
        (State { wave_amplitude: -0.1, ..good }, Field::WaveAmplitude, Problem::Negative),
        (State { wave_amplitude: f32::NAN, ..good }, Field::WaveAmplitude, Problem::NotFinite),
        (State { wave_phase: f32::INFINITY, ..good }, Field::WavePhase, Problem::NotFinite),
        (State { wheel_levels: Some([0.0; 4].into()), ..good }, Field::WheelWaterLevel, Problem::Unsupported),
        (State { wheel_levels: levels, ..State::still(0.1) }, Field::WheelWaterLevel, Problem::NotFinite),
        (
            State { wheel_levels: PerWheel::new(&[0.0; 3]), ..State::still(0.1) },
            Field::WheelWaterLevel,
            Problem::Count,
        ),
        (State { current_exponent: -1.0, ..good }, Field::CurrentExponent, Problem::Negative),
        (State { current_exponent: 11.0, ..good }, Field::CurrentExponent, Problem::TooLarge),
        (State { jacobian: true, ..good }, Field::Jacobian, Problem::Unsupported),
    ];
    for (name, mut client) in served.clients("husky") {
        for (state, field, problem) in &cases {
            let (told, words) = refusal(&mut client, state);
            assert!(words.contains(field.name()), "{name}: {words}");
            if let Some(told) = told {
                assert_eq!(told, (*field, *problem), "{name}");
            }
            client.evaluate(&good).expect("the next is answered");
        }
    }
}

#[test]
fn a_bundle_without_the_physical_base_knows_still_and_even_water_alone() {
    let old = ServedVehicle::new(without_base_on("husky", Isa::available()[0]), None);
    for states in kinds() {
        let invalid = states[1].check_for(&old).expect_err("refused");
        assert_eq!(invalid.problem, Problem::Unsupported);
        assert!(invalid.to_string().contains("husky is answered in still and even water alone"), "{invalid}");
    }
}
