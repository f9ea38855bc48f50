//! Tensors to the batch that they mean.

use std::collections::HashMap;
use std::time::Duration;

use wade_core::served::ServedVehicle;
use wade_core::vehicle::MAX_WHEELS;
use wade_wire::proto;
use wade_wire::proto::inference::infer_parameter::ParameterChoice;
use wade_wire::proto::inference::model_infer_request::InferInputTensor;
use wade_wire::proto::inference::{InferParameter, ModelInferRequest};
use wade_wire::{Field, InvalidState, Problem, Refusal, TensorFault};

/// The inputs of every vehicle with their values a state, by the names of the arrays of a batch. All are FP32.
const INPUTS: [(Field, usize); 17] = [
    (Field::Depth, 1),
    (Field::WaterLevel, 1),
    (Field::BedClearance, 1),
    (Field::Bed, 1),
    (Field::Velocity, 3),
    (Field::Current, 3),
    (Field::AngularVelocity, 3),
    (Field::Acceleration, 3),
    (Field::AngularAcceleration, 3),
    (Field::Density, 1),
    (Field::Gravity, 3),
    (Field::Heading, 1),
    (Field::DepthRate, 1),
    (Field::WaveVector, 3),
    (Field::WaveAmplitude, 1),
    (Field::WavePhase, 1),
    (Field::CurrentExponent, 1),
];

/// Those with a value a wheel.
const OF_WHEELS: [Field; 2] = [Field::WheelSpeed, Field::WheelWaterLevel];

/// The inputs of a vehicle with the rest of their shapes behind the number of states: a scalar has none.
pub fn of_vehicle(vehicle: &ServedVehicle) -> impl Iterator<Item = (Field, Option<usize>)> {
    let wheels = vehicle.model().wheels().len();
    let of_wheels = OF_WHEELS.into_iter().filter(move |_| (1..=MAX_WHEELS).contains(&wheels));
    let input = |(field, width): (Field, usize)| (field, (width > 1).then_some(width));
    INPUTS.into_iter().map(input).chain(of_wheels.map(move |field| (field, Some(wheels))))
}

/// The parameters of a request, which hold for all its states.
const PARAMETERS: &str = "ground_contact (string), implicit_added_mass (bool), jacobian (bool), timeout (int64 [us]), priority (uint64)";

/// Longest name that an error repeats.
const MAX_NAME: usize = 64;

/// A name that fits into an error.
pub fn short(name: &str) -> String {
    name.chars().take(MAX_NAME).collect()
}

/// The shape of a tensor of so many rows.
pub fn shape(rows: i64, width: Option<usize>) -> Vec<i64> {
    std::iter::once(rows).chain(width.map(|width| width as i64)).collect()
}

/// The batch that a request asks a vehicle for.
pub fn batch(
    request: &ModelInferRequest,
    vehicle: &ServedVehicle,
    max: usize,
) -> Result<proto::EvaluateBatchRequest, Refusal> {
    let (inputs, raw) = (&request.inputs, &request.raw_input_contents);
    if !raw.is_empty() && raw.len() != inputs.len() {
        return Err(TensorFault::RawCount { raw: raw.len(), inputs: inputs.len() }.into());
    }
    let rows = rows(inputs, max)?;
    let mut batch = proto::EvaluateBatchRequest { vehicle: request.model_name.clone(), ..Default::default() };
    let mut seen: Vec<&str> = Vec::new();
    for (index, input) in inputs.iter().enumerate() {
        let name = || short(&input.name);
        if seen.contains(&input.name.as_str()) {
            return Err(TensorFault::Repeated { name: name() }.into());
        }
        seen.push(&input.name);
        check_wheels(input, vehicle)?;
        let known = of_vehicle(vehicle).find(|(field, _)| field.name() == input.name);
        let unknown = || TensorFault::Unknown { name: name(), known: names(vehicle) };
        let (field, width) = known.ok_or_else(unknown)?;
        if let Some(parameter) = input.parameters.keys().next() {
            return Err(TensorFault::Parameter { name: short(parameter), known: "none" }.into());
        }
        let values = values(input, raw.get(index).map(Vec::as_slice), rows, width)?;
        if let Some(array) = array(&mut batch, field) {
            *array = values;
        }
    }
    parameters(&request.parameters, &mut batch)?;
    Ok(batch)
}

fn names(vehicle: &ServedVehicle) -> String {
    of_vehicle(vehicle).map(|(field, _)| field.name()).collect::<Vec<_>>().join(", ")
}

/// Refuses values of another number of wheels than the vehicle has, and names these.
fn check_wheels(input: &InferInputTensor, vehicle: &ServedVehicle) -> Result<(), Refusal> {
    let wheels = vehicle.model().wheels().len();
    match (input.shape.as_slice(), OF_WHEELS.into_iter().find(|field| field.name() == input.name)) {
        (&[_, given], Some(field)) if given != wheels as i64 => {
            Err(InvalidState::wheel_count(field, usize::try_from(given).unwrap_or(0), vehicle).into())
        }
        _ => Ok(()),
    }
}

/// The number of states: the rows of depth_m, or of water_level_m where there are none.
fn rows(inputs: &[InferInputTensor], max: usize) -> Result<usize, Refusal> {
    let named = |field: Field| inputs.iter().find(|input| input.name == field.name());
    let depth = named(Field::Depth).or_else(|| named(Field::WaterLevel)).ok_or(TensorFault::NoDepth)?;
    let rows = match depth.shape.as_slice() {
        &[rows] => usize::try_from(rows).ok(),
        _ => None,
    };
    let expected =
        || TensorFault::Shape { name: depth.name.clone(), shape: start(&depth.shape), expected: vec![-1] };
    let rows = rows.ok_or_else(expected)?;
    match rows {
        0 => Err(Refusal::EmptyBatch),
        len if len > max => Err(Refusal::BatchTooLong { len, limit: max }),
        rows => Ok(rows),
    }
}

/// A shape that fits into an error.
fn start(shape: &[i64]) -> Vec<i64> {
    shape.iter().take(4).copied().collect()
}

fn values(
    input: &InferInputTensor,
    raw: Option<&[u8]>,
    rows: usize,
    width: Option<usize>,
) -> Result<Vec<f32>, TensorFault> {
    let name = || input.name.clone();
    if input.datatype != "FP32" {
        return Err(TensorFault::Datatype { name: name(), datatype: short(&input.datatype) });
    }
    let expected = shape(rows as i64, width);
    if input.shape != expected {
        return Err(TensorFault::Shape { name: name(), shape: start(&input.shape), expected });
    }
    let count = rows * width.unwrap_or(1);
    let length = |len, expected, unit| Err(TensorFault::Length { name: name(), len, expected, unit });
    match (raw, &input.contents) {
        (Some(_), Some(_)) => Err(TensorFault::Both { name: name() }),
        (Some(bytes), None) => {
            let (values, rest) = bytes.as_chunks::<4>();
            if values.len() != count || !rest.is_empty() {
                return length(bytes.len(), 4 * count, "bytes");
            }
            Ok(values.iter().copied().map(f32::from_le_bytes).collect())
        }
        (None, contents) => {
            let values = contents.as_ref().map_or(&[][..], |contents| &contents.fp32_contents);
            if values.len() != count {
                return length(values.len(), count, "values");
            }
            Ok(values.to_vec())
        }
    }
}

/// Where a batch has the values of a field; none for the fields that are no inputs.
fn array(batch: &mut proto::EvaluateBatchRequest, field: Field) -> Option<&mut Vec<f32>> {
    Some(match field {
        Field::Depth => &mut batch.depth_m,
        Field::Velocity => &mut batch.velocity_mps,
        Field::Current => &mut batch.current_mps,
        Field::AngularVelocity => &mut batch.angular_velocity_radps,
        Field::Acceleration => &mut batch.acceleration_mps2,
        Field::AngularAcceleration => &mut batch.angular_acceleration_radps2,
        Field::Density => &mut batch.density_kgpm3,
        Field::Gravity => &mut batch.gravity_direction,
        Field::Heading => &mut batch.heading_rad,
        Field::DepthRate => &mut batch.depth_rate_mps,
        Field::WheelSpeed => &mut batch.wheel_speed_radps,
        Field::Quaternion | Field::RollPitch | Field::GroundContact | Field::TimeStep => return None,
        Field::WaterLevel => &mut batch.water_level_m,
        Field::BedClearance => &mut batch.bed_clearance_m,
        Field::Bed => &mut batch.bed,
        Field::WheelWaterLevel => &mut batch.wheel_water_level_m,
        Field::WaveVector => &mut batch.wave_vector_radpm,
        Field::WaveAmplitude => &mut batch.wave_amplitude_m,
        Field::WavePhase => &mut batch.wave_phase_rad,
        Field::CurrentExponent => &mut batch.current_exponent,
        Field::Flags | Field::Physics | Field::Jacobian => return None,
    })
}

fn parameters(
    parameters: &HashMap<String, InferParameter>,
    batch: &mut proto::EvaluateBatchRequest,
) -> Result<(), Refusal> {
    for (name, parameter) in parameters {
        match (name.as_str(), &parameter.parameter_choice) {
            ("ground_contact", Some(ParameterChoice::StringParam(value))) => {
                let unknown = InvalidState::new(Field::GroundContact, Problem::Unknown);
                let contact = proto::GroundContact::from_str_name(value).ok_or(unknown)?;
                batch.ground_contact = contact as i32;
            }
            ("implicit_added_mass", Some(ParameterChoice::BoolParam(value))) => {
                batch.implicit_added_mass = *value;
            }
            ("jacobian", Some(ParameterChoice::BoolParam(value))) => batch.jacobian = *value,
            // a deadline is the caller's affair, and nothing waits here that a priority could put first
            (
                "timeout" | "priority",
                Some(ParameterChoice::Int64Param(_) | ParameterChoice::Uint64Param(_)),
            ) => {}
            _ => return Err(TensorFault::Parameter { name: short(name), known: PARAMETERS }.into()),
        }
    }
    Ok(())
}

/// How long a request may take, where it says so; as in Triton, 0 is any time.
pub fn timeout(request: &ModelInferRequest) -> Option<Duration> {
    let us = match request.parameters.get("timeout")?.parameter_choice {
        Some(ParameterChoice::Int64Param(us)) => u64::try_from(us).ok()?,
        Some(ParameterChoice::Uint64Param(us)) => us,
        _ => return None,
    };
    (us > 0).then(|| Duration::from_micros(us))
}
