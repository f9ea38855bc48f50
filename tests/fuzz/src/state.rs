//! A message of a state: refused with a reason, or answered with numbers, the same each time.

use prost::Message;
use wade_core::served::{ServedVehicle, Session};
use wade_wire::{Evaluator, State, proto};

use crate::bundles::{every_effect, served_vehicle, served_with};

thread_local! {
    /// A vehicle as it is shipped, and another with all effects.
    static VEHICLES: [ServedVehicle; 2] = [served_vehicle("husky"), served_with("warthog", every_effect("warthog"))];
}

/// Does this with one of the two vehicles.
pub fn with_vehicle(number: u8, work: impl FnOnce(&ServedVehicle)) {
    VEHICLES.with(|vehicles| work(&vehicles[usize::from(number) % vehicles.len()]));
}

/// Which vehicle, then the message.
pub fn run(bytes: &[u8]) {
    let Some((&number, message)) = bytes.split_first() else { return };
    let Ok(message) = proto::State::decode(message) else { return };
    with_vehicle(number, |vehicle| {
        if let Ok(state) = wade_wire::state(&message, vehicle) {
            answered(vehicle, &state);
        }
    });
}

/// Where the state is accepted: its answers in a session and without one are numbers, and what is answered twice is the same.
pub fn answered(vehicle: &ServedVehicle, state: &State) {
    let Ok(checked) = state.check_for(vehicle) else { return };
    let mut evaluator = Evaluator::default();
    let mut answer = |session: Option<&mut Session>| {
        let evaluated = evaluator.evaluate(vehicle, &checked, session);
        let response = wade_wire::response(vehicle, &evaluated);
        let deviations = [response.uncertainty_n, response.moment_uncertainty_nm].into_iter().flatten();
        let numbers = (response.surface_force_n.iter().copied())
            .chain(response.surface_point_m.iter().copied())
            .chain(response.surface_couple_nm.iter().copied())
            .chain(
                response
                    .wrench
                    .iter()
                    .flat_map(|wrench| [wrench.force_n, wrench.moment_nm])
                    .flatten()
                    .flat_map(components),
            )
            .chain(deviations.flat_map(components))
            .chain(response.jacobian.iter().copied());
        for number in numbers {
            assert!(number.is_finite(), "{state:?} is answered with {response:?}");
        }
        for share in &response.wetted_fraction {
            assert!((0.0..=1.0).contains(share), "{state:?} is answered with a wetted share of {share}");
        }
        proto::EvaluateResponse { compute_ns: 0, ..response }
    };
    let first = answer(None);
    assert_eq!(first.encode_to_vec(), answer(None).encode_to_vec(), "{state:?}");
    let mut session = Session::default();
    answer(Some(&mut session));
    answer(Some(&mut session));
}

fn components(vector: proto::Vector3) -> [f32; 3] {
    [vector.x, vector.y, vector.z]
}

/// A state with much of what a message can set.
pub fn message() -> proto::State {
    let vector = |x, y, z| Some(proto::Vector3 { x, y, z });
    proto::State {
        velocity_mps: vector(0.8, 0.1, 0.0),
        current_mps: vector(0.0, 0.5, 0.0),
        angular_velocity_radps: vector(0.0, 0.0, 0.2),
        acceleration_mps2: vector(0.1, 0.0, 0.0),
        angular_acceleration_radps2: vector(0.0, 0.0, 0.1),
        density_kgpm3: Some(1000.0),
        attitude: Some(proto::state::Attitude::RollPitch(proto::RollPitch {
            roll_rad: 0.1,
            pitch_rad: -0.1,
        })),
        water_level_m: Some(0.1),
        heading_rad: Some(1.0),
        wheel_speed_radps: vec![4.0; 4],
        time_step_s: 0.001,
        jacobian: true,
        wave_vector_radpm: vector(1.0, 0.5, 0.0),
        wave_amplitude_m: 0.05,
        wave_phase_rad: 0.3,
        wheel_water_level_m: vec![0.1; 4],
        current_exponent: 0.14,
        ..proto::State::default()
    }
}

/// Two states in one message.
pub fn batch_of_two() -> proto::EvaluateBatchRequest {
    proto::EvaluateBatchRequest {
        vehicle: "husky".into(),
        depth_m: vec![0.1, 0.3],
        velocity_mps: vec![0.8, 0.0, 0.0, 0.4, 0.4, 0.0],
        gravity_direction: vec![0.0, 0.0, -1.0, 0.1, 0.0, -0.99],
        ..proto::EvaluateBatchRequest::default()
    }
}

/// A full and a plain state for each vehicle.
pub fn seeds() -> Vec<Vec<u8>> {
    let plain = proto::State { depth_m: Some(0.2), ..proto::State::default() };
    let of = |number: u8, message: &proto::State| [vec![number], message.encode_to_vec()].concat();
    vec![of(0, &message()), of(1, &message()), of(0, &plain), of(1, &plain)]
}
