//! The generated types to and from ours, by hand.

use nalgebra::{Matrix6, Quaternion, UnitQuaternion};

use wade_core::domain::{Domain, Outside, Quantity};
use wade_core::effects::{self, BoxQuantity, EffectLoads, EffectsFile, OutsideBox, RegionLimit};
use wade_core::forces::Forces;
use wade_core::frame::{Vec3, up_from_quaternion, up_from_roll_pitch};
use wade_core::model::{COLUMNS, Jacobian};
use wade_core::physics::Physics;
use wade_core::served::ServedVehicle;
use wade_core::vehicle::{MAX_WHEELS, PerWheel, Surface};

use super::evaluator::Evaluated;
use super::proto::{self, state::Attitude};
use super::refusal::Refusal;
use super::state::{Field, InvalidState, Problem, State, UNIT_TOLERANCE, scalar};

/// Numbers of a Jacobian.
pub const DERIVATIVES: usize = 6 * COLUMNS;

/// The state of a single request to a vehicle.
pub fn state(message: &proto::State, vehicle: &ServedVehicle) -> Result<State, InvalidState> {
    let default = State::default();
    let vector = |v: &Option<proto::Vector3>| v.as_ref().map_or([0.0; 3], |v| [v.x, v.y, v.z]);
    Ok(State {
        velocity: vector(&message.velocity_mps),
        current: vector(&message.current_mps),
        angular_velocity: vector(&message.angular_velocity_radps),
        acceleration: vector(&message.acceleration_mps2),
        angular_acceleration: vector(&message.angular_acceleration_radps2),
        gravity: message.attitude.as_ref().map_or(Ok(default.gravity), gravity)?,
        depth: message.depth_m.unwrap_or(f32::NAN),
        water_level: message.water_level_m,
        bed_clearance: message.bed_clearance_m,
        bed: message.bed,
        density: message.density_kgpm3.unwrap_or(default.density),
        dry_contact: is_dry(message.ground_contact)?,
        heading: message.heading_rad.map_or_else(|| heading(message.attitude.as_ref()), |h| Ok(Some(h)))?,
        depth_rate: message.depth_rate_mps,
        wheel_speeds: per_wheel(Field::WheelSpeed, &message.wheel_speed_radps, vehicle)?,
        time_step: message.time_step_s,
        implicit_added_mass: message.implicit_added_mass,
        physics: physics(message.physics)?,
        jacobian: message.jacobian,
        wave_vector: vector(&message.wave_vector_radpm),
        wave_amplitude: message.wave_amplitude_m,
        wave_phase: message.wave_phase_rad,
        wheel_levels: per_wheel(Field::WheelWaterLevel, &message.wheel_water_level_m, vehicle)?,
        current_exponent: message.current_exponent,
    })
}

/// One value a wheel, or none.
fn per_wheel(
    field: Field,
    values: &[f32],
    vehicle: &ServedVehicle,
) -> Result<Option<PerWheel<f32>>, InvalidState> {
    match values {
        [] => Ok(None),
        values => {
            let count = || InvalidState::wheel_count(field, values.len(), vehicle);
            PerWheel::new(values).ok_or_else(count).map(Some)
        }
    }
}

fn physics(code: i32) -> Result<Option<Physics>, InvalidState> {
    match code {
        0 => Ok(None),
        code => Physics::ALL
            .into_iter()
            .find(|physics| *physics as i32 == code)
            .map(Some)
            .ok_or(InvalidState::new(Field::Physics, Problem::Unknown)),
    }
}

/// The heading of a quaternion; the other attitudes know none.
fn heading(attitude: Option<&Attitude>) -> Result<Option<f32>, InvalidState> {
    let Some(Attitude::WorldFromBody(q)) = attitude else { return Ok(None) };
    let (_, _, yaw) = quaternion(q)?.euler_angles();
    Ok(Some(yaw as f32))
}

fn quaternion(q: &proto::Quaternion) -> Result<UnitQuaternion<f64>, InvalidState> {
    let [w, x, y, z] = [q.w, q.x, q.y, q.z].map(|part| scalar(Field::Quaternion, part));
    let q = Quaternion::new(w?, x?, y?, z?);
    if (q.norm() - 1.0).abs() > UNIT_TOLERANCE {
        return Err(InvalidState::new(Field::Quaternion, Problem::NotUnit));
    }
    Ok(UnitQuaternion::from_quaternion(q))
}

pub(crate) fn is_dry(ground_contact: i32) -> Result<bool, InvalidState> {
    let known = proto::GroundContact::try_from(ground_contact);
    known
        .map(|contact| contact == proto::GroundContact::Dry)
        .map_err(|_| InvalidState::new(Field::GroundContact, Problem::Unknown))
}

fn gravity(attitude: &Attitude) -> Result<[f32; 3], InvalidState> {
    let up = match attitude {
        Attitude::GravityDirection(g) => return Ok([g.x, g.y, g.z]),
        Attitude::WorldFromBody(q) => up_from_quaternion(&quaternion(q)?),
        Attitude::RollPitch(attitude) => {
            let [roll, pitch] =
                [attitude.roll_rad, attitude.pitch_rad].map(|angle| scalar(Field::RollPitch, angle));
            up_from_roll_pitch(roll?, pitch?)
        }
    };
    Ok(single(&-up.into_inner()))
}

/// The states of a batch for a vehicle; every array is checked against the length of `depth_m`, or of `water_level_m` where that is
/// empty.
pub fn batch(
    message: &proto::EvaluateBatchRequest,
    vehicle: &ServedVehicle,
    max: usize,
) -> Result<Vec<State>, Refusal> {
    let levels = if message.depth_m.is_empty() { &message.water_level_m } else { &message.depth_m };
    let len = levels.len();
    if len == 0 {
        return Err(Refusal::EmptyBatch);
    }
    if len > max {
        return Err(Refusal::BatchTooLong { len, limit: max });
    }
    let default = State::default();
    let velocity = rows(Field::Velocity, &message.velocity_mps, len, default.velocity)?;
    let current = rows(Field::Current, &message.current_mps, len, default.current)?;
    let (rates, accelerations) = (&message.angular_velocity_radps, &message.angular_acceleration_radps2);
    let angular_velocity = rows(Field::AngularVelocity, rates, len, default.angular_velocity)?;
    let acceleration = rows(Field::Acceleration, &message.acceleration_mps2, len, default.acceleration)?;
    let angular_acceleration =
        rows(Field::AngularAcceleration, accelerations, len, default.angular_acceleration)?;
    let gravity = rows(Field::Gravity, &message.gravity_direction, len, default.gravity)?;
    let density = rows(Field::Density, &message.density_kgpm3, len, [default.density])?;
    let depth = rows(Field::Depth, &message.depth_m, len, [f32::NAN])?;
    let water_level = rows(Field::WaterLevel, &message.water_level_m, len, [f32::NAN])?;
    let bed_clearance = rows(Field::BedClearance, &message.bed_clearance_m, len, [f32::NAN])?;
    let bed = rows(Field::Bed, &message.bed, len, [f32::NAN])?;
    let stated = |[value]: [f32; 1]| Some(value).filter(|value| !value.is_nan());
    let physics = physics(message.physics)?;
    let dry_contact = is_dry(message.ground_contact)?;
    let heading = optional_rows::<1>(Field::Heading, &message.heading_rad, len)?;
    let depth_rate = optional_rows::<1>(Field::DepthRate, &message.depth_rate_mps, len)?;
    let wheel_speeds = wheel_rows(Field::WheelSpeed, &message.wheel_speed_radps, len, vehicle)?;
    let wheel_levels = wheel_rows(Field::WheelWaterLevel, &message.wheel_water_level_m, len, vehicle)?;
    let wave_vector = rows(Field::WaveVector, &message.wave_vector_radpm, len, default.wave_vector)?;
    let wave_amplitude = rows(Field::WaveAmplitude, &message.wave_amplitude_m, len, [0.0])?;
    let wave_phase = rows(Field::WavePhase, &message.wave_phase_rad, len, [0.0])?;
    let current_exponent = rows(Field::CurrentExponent, &message.current_exponent, len, [0.0])?;
    let state = |i: usize| State {
        velocity: velocity(i),
        current: current(i),
        angular_velocity: angular_velocity(i),
        acceleration: acceleration(i),
        angular_acceleration: angular_acceleration(i),
        gravity: gravity(i),
        depth: depth(i)[0],
        water_level: stated(water_level(i)),
        bed_clearance: stated(bed_clearance(i)),
        bed: stated(bed(i)),
        density: density(i)[0],
        dry_contact,
        heading: heading(i).map(|[heading]| heading),
        depth_rate: depth_rate(i).map(|[rate]| rate),
        wheel_speeds: wheel_speeds(i),
        // the states of a batch do not follow each other
        time_step: 0.0,
        implicit_added_mass: message.implicit_added_mass,
        physics,
        jacobian: message.jacobian,
        wave_vector: wave_vector(i),
        wave_amplitude: wave_amplitude(i)[0],
        wave_phase: wave_phase(i)[0],
        wheel_levels: wheel_levels(i),
        current_exponent: current_exponent(i)[0],
    };
    Ok((0..len).map(state).collect())
}

/// Row `i` of an array, or the default where the array is empty.
fn rows<const WIDTH: usize>(
    field: Field,
    values: &[f32],
    len: usize,
    default: [f32; WIDTH],
) -> Result<impl Fn(usize) -> [f32; WIDTH], Refusal> {
    let row = optional_rows(field, values, len)?;
    Ok(move |i| row(i).unwrap_or(default))
}

/// Row `i` of an array, or none where the array is empty.
fn optional_rows<const WIDTH: usize>(
    field: Field,
    values: &[f32],
    len: usize,
) -> Result<impl Fn(usize) -> Option<[f32; WIDTH]>, Refusal> {
    let (rows, rest) = values.as_chunks::<WIDTH>();
    if !values.is_empty() && (rows.len() != len || !rest.is_empty()) {
        return Err(Refusal::UnequalLength {
            name: field.name(),
            len: values.len(),
            expected: len * WIDTH,
            width: WIDTH,
        });
    }
    Ok(move |i| rows.get(i).copied())
}

/// The values of the wheels in state `i`, or none where the array is empty.
fn wheel_rows(
    field: Field,
    values: &[f32],
    len: usize,
    vehicle: &ServedVehicle,
) -> Result<impl Fn(usize) -> Option<PerWheel<f32>>, Refusal> {
    let name = field.name();
    let (given, wheels) = (values.len() / len, vehicle.model().wheels().len());
    if !values.len().is_multiple_of(len) {
        return Err(Refusal::UnequalLength {
            name,
            len: values.len(),
            expected: len * wheels,
            width: wheels,
        });
    }
    if !values.is_empty() && (given != wheels || given > MAX_WHEELS) {
        return Err(InvalidState::wheel_count(field, given, vehicle).into());
    }
    Ok(move |i| values.get(i * given..(i + 1) * given).filter(|row| !row.is_empty()).and_then(PerWheel::new))
}

/// A vector in the wire's precision.
pub fn single(vector: &Vec3) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
}

fn vector3(vector: &Vec3) -> proto::Vector3 {
    let [x, y, z] = single(vector);
    proto::Vector3 { x, y, z }
}

/// The answer to a single request.
pub fn response(vehicle: &ServedVehicle, evaluated: &Evaluated<'_>) -> proto::EvaluateResponse {
    let (model, Evaluated { forces, effects, jacobian, compute_ns }) = (vehicle.model(), evaluated);
    let mut response = proto::EvaluateResponse {
        wrench: Some(proto::Wrench {
            force_n: Some(vector3(&forces.wrench.force)),
            moment_nm: Some(vector3(&forces.wrench.moment)),
            about_m: Some(vector3(&model.vehicle().center_of_mass)),
        }),
        uncertainty_n: Some(vector3(&forces.uncertainty)),
        moment_uncertainty_nm: Some(vector3(&forces.moment_uncertainty)),
        base: forces.base.as_ref().map(base),
        in_domain: forces.outside.is_inside(),
        outside: outside(&forces.outside, 0).collect(),
        bundle_version: model.version(),
        provenance: model.provenance().to_owned(),
        compute_ns: *compute_ns,
        effects: effects.loads.iter().map(effect_load).collect(),
        effect_surface_force_n: effects.surface_forces.iter().flat_map(single).collect(),
        effects_outside: outside_box(&effects.outside, 0).collect(),
        added_mass: added_mass(effects).into_iter().flatten().collect(),
        jacobian: jacobian.iter().flat_map(|jacobian| derivatives(jacobian)).collect(),
        ..Default::default()
    };
    reserve_surfaces(&mut response, model.vehicle().surfaces.len());
    let (force, point) = (&mut response.surface_force_n, &mut response.surface_point_m);
    push_surfaces(forces, force, point, &mut response.wetted_fraction);
    push_couples(forces, &mut response.surface_couple_nm);
    response
}

fn base(base: &wade_core::forces::Base) -> proto::BaseAnswer {
    proto::BaseAnswer {
        water_level_m: base.water_level as f32,
        bed_clearance_m: base.bed_clearance as f32,
        bed: base.bed as f32,
        shaft_power_w: base.shaft_power as f32,
        damping: by_rows(&base.damping).to_vec(),
    }
}

/// A matrix by rows, in the wire's precision.
pub fn by_rows(matrix: &Matrix6<f64>) -> [f32; 36] {
    std::array::from_fn(|i| matrix[(i / 6, i % 6)] as f32)
}

/// Derivatives by rows, in the wire's precision.
pub fn derivatives(jacobian: &Jacobian) -> [f32; DERIVATIVES] {
    std::array::from_fn(|i| jacobian[(i / COLUMNS, i % COLUMNS)] as f32)
}

fn effect_load(load: &effects::EffectLoad) -> proto::EffectLoad {
    proto::EffectLoad {
        effect: load.effect.code() as i32,
        force_n: Some(vector3(&load.wrench.force)),
        moment_nm: Some(vector3(&load.wrench.moment)),
        left_out: left_out(load),
    }
}

fn left_out(load: &effects::EffectLoad) -> i32 {
    load.left_out.map_or(0, |reason| reason as i32)
}

/// The added mass by rows, in the wire's precision.
pub fn added_mass(effects: &EffectLoads) -> Option<[f32; 36]> {
    effects.added_mass.as_ref().map(by_rows)
}

fn outside_box(outside: &OutsideBox, index: u32) -> impl Iterator<Item = proto::EffectOutside> + '_ {
    let entries = BoxQuantity::ALL.into_iter().zip(outside).filter(|(_, excess)| **excess != 0.0);
    entries.map(move |(quantity, excess)| proto::EffectOutside {
        quantity: quantity as i32,
        excess: *excess as f32,
        index,
    })
}

fn reserve_surfaces(response: &mut proto::EvaluateResponse, surfaces: usize) {
    response.surface_force_n.reserve_exact(3 * surfaces);
    response.surface_point_m.reserve_exact(3 * surfaces);
    response.wetted_fraction.reserve_exact(surfaces);
}

fn push_surfaces(forces: &Forces, force: &mut Vec<f32>, point: &mut Vec<f32>, wetted: &mut Vec<f32>) {
    for load in &forces.surfaces {
        force.extend(single(&load.force));
        point.extend(single(&load.point));
        wetted.push(load.wetted_fraction as f32);
    }
}

/// Of a bundle without the physical base there are none.
fn push_couples(forces: &Forces, couples: &mut Vec<f32>) {
    if forces.base.is_some() {
        couples.extend(forces.surfaces.iter().flat_map(|load| single(&load.couple)));
    }
}

/// An empty answer to a batch with room for its states.
pub fn batch_response(
    vehicle: &ServedVehicle,
    len: usize,
    with_surfaces: bool,
) -> proto::EvaluateBatchResponse {
    let model = vehicle.model();
    let rows = if with_surfaces { len * model.vehicle().surfaces.len() } else { 0 };
    let effects = vehicle.effects().map_or(&[][..], |file| &file.effects);
    let codes: Vec<i32> = effects.iter().map(|effect| effect.effect().code() as i32).collect();
    proto::EvaluateBatchResponse {
        surface_force_n: Vec::with_capacity(3 * rows),
        surface_point_m: Vec::with_capacity(3 * rows),
        wetted_fraction: Vec::with_capacity(rows),
        force_n: Vec::with_capacity(3 * len),
        moment_nm: Vec::with_capacity(3 * len),
        about_m: Some(vector3(&model.vehicle().center_of_mass)),
        uncertainty_n: Vec::with_capacity(3 * len),
        moment_uncertainty_nm: Vec::with_capacity(3 * len),
        bundle_version: model.version(),
        provenance: model.provenance().to_owned(),
        effect_force_n: Vec::with_capacity(3 * len * codes.len()),
        effect_moment_nm: Vec::with_capacity(3 * len * codes.len()),
        effect_left_out: Vec::with_capacity(len * codes.len()),
        effects: codes,
        ..Default::default()
    }
}

/// Adds the forces of state `index` to the answer to a batch.
pub fn push(
    response: &mut proto::EvaluateBatchResponse,
    evaluated: &Evaluated<'_>,
    index: u32,
    with_surfaces: bool,
) {
    let Evaluated { forces, effects, jacobian, compute_ns } = evaluated;
    response.compute_ns += compute_ns;
    response.force_n.extend(single(&forces.wrench.force));
    response.moment_nm.extend(single(&forces.wrench.moment));
    response.uncertainty_n.extend(single(&forces.uncertainty));
    response.moment_uncertainty_nm.extend(single(&forces.moment_uncertainty));
    response.base.extend(forces.base.as_ref().map(base));
    response.outside.extend(outside(&forces.outside, index));
    for load in &effects.loads {
        response.effect_force_n.extend(single(&load.wrench.force));
        response.effect_moment_nm.extend(single(&load.wrench.moment));
        response.effect_left_out.push(left_out(load));
    }
    response.effects_outside.extend(outside_box(&effects.outside, index));
    response.added_mass.extend(added_mass(effects).into_iter().flatten());
    response.jacobian.extend(jacobian.iter().flat_map(|jacobian| derivatives(jacobian)));
    if with_surfaces {
        let (force, point) = (&mut response.surface_force_n, &mut response.surface_point_m);
        push_surfaces(forces, force, point, &mut response.wetted_fraction);
        push_couples(forces, &mut response.surface_couple_nm);
        response.effect_surface_force_n.extend(effects.surface_forces.iter().flat_map(single));
    }
}

fn outside(outside: &Outside, index: u32) -> impl Iterator<Item = proto::Outside> + '_ {
    outside.iter().map(move |(quantity, excess)| proto::Outside {
        quantity: quantity as i32,
        excess: excess as f32,
        index,
    })
}

/// What a list says of a vehicle.
pub fn summary(vehicle: &ServedVehicle) -> proto::VehicleSummary {
    let model = vehicle.model();
    proto::VehicleSummary {
        name: model.vehicle().name.clone(),
        bundle_version: model.version(),
        surface_count: model.vehicle().surfaces.len() as u32,
        provenance: model.provenance().to_owned(),
        origin: vehicle.origin().to_owned(),
        base: model.base_name().to_owned(),
    }
}

/// Everything about a vehicle.
pub fn vehicle(served: &ServedVehicle, include_mesh: bool) -> proto::GetVehicleResponse {
    let (model, vehicle) = (served.model(), served.model().vehicle());
    let mut response = proto::GetVehicleResponse {
        summary: Some(summary(served)),
        length_m: vehicle.dimensions.length,
        width_m: vehicle.dimensions.width,
        height_m: vehicle.dimensions.height,
        z0_m: vehicle.z0,
        mass_kg: vehicle.mass,
        center_of_mass_m: Some(vector3(&vehicle.center_of_mass)),
        inertia_kgm2: vehicle.inertia.transpose().iter().copied().collect(),
        surfaces: vehicle.surfaces.iter().map(surface).collect(),
        domain: ranges(model.domain()),
        effects: served.effects().map_or_else(Vec::new, active_effects),
        effects_validity: served.effects().map_or_else(Vec::new, box_ranges),
        ..Default::default()
    };
    if include_mesh {
        response.mesh_stl = wade_core::geometry::mesh::write_stl(&vehicle.hull.mesh);
        response.face_surface = vehicle.hull.face_surface.iter().map(|&s| s.into()).collect();
    }
    response
}

fn active_effects(file: &EffectsFile) -> Vec<proto::ActiveEffect> {
    let parameter = |(name, parameter): (&String, &effects::ParameterValue)| proto::EffectParameter {
        name: name.clone(),
        value: parameter.value,
        std: parameter.std,
        unit: parameter.unit.clone(),
    };
    let active = |effect: &effects::ActiveEffect| proto::ActiveEffect {
        effect: effect.effect().code() as i32,
        name: effect.effect().name().into(),
        equation: effect.equation.clone(),
        parameters: effect.parameters.iter().map(parameter).collect(),
        provisional: effect.provisional,
        region: effect.region.limits.iter().map(region_limit).collect(),
    };
    file.effects.iter().map(active).collect()
}

fn region_limit(limit: &RegionLimit) -> proto::RegionLimit {
    let border = |border: Option<[f64; 2]>| border.map_or_else(Vec::new, |border| border.to_vec());
    proto::RegionLimit {
        quantity: limit.quantity.name().into(),
        unit: limit.quantity.unit().into(),
        above: border(limit.above),
        at_most: border(limit.at_most),
    }
}

fn box_ranges(file: &EffectsFile) -> Vec<proto::BoxRange> {
    let range = |quantity: BoxQuantity| {
        let [minimum, maximum] = file.validity.range(quantity);
        proto::BoxRange { quantity: quantity as i32, minimum, maximum }
    };
    BoxQuantity::ALL.into_iter().map(range).collect()
}

fn surface(surface: &Surface) -> proto::Surface {
    proto::Surface {
        name: surface.name.clone(),
        kind: surface.kind.name().into(),
        centroid_m: Some(vector3(&surface.centroid)),
        normal: Some(vector3(&surface.normal)),
        area_m2: surface.area,
    }
}

fn ranges(domain: &Domain) -> Vec<proto::Range> {
    let range = |quantity: Quantity| {
        let range = domain.range(quantity)?;
        Some(proto::Range { quantity: quantity as i32, minimum: range.min, maximum: range.max })
    };
    Quantity::ALL.into_iter().filter_map(range).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use wade_core::effects::{Effect, Kind, LeftOut};

    fn husky() -> ServedVehicle {
        let bundle = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles/husky");
        wade_core::bundle::load_served(&bundle, wade_core::model::kernel::Isa::available()[0]).expect("sound")
    }

    #[test]
    fn the_numbers_of_the_wire_are_those_of_the_library() {
        for effect in Effect::ALL {
            let name = proto::Effect::try_from(effect.code() as i32)
                .map(|effect| effect.as_str_name().to_lowercase());
            let expected = (effect.kind() == Kind::Physics).then(|| format!("effect_{}", effect.name()));
            assert_eq!(name.ok(), expected);
        }
        // and the other way round: far beyond the list
        for code in (1..1000).filter(|&code| proto::Effect::try_from(code).is_ok()) {
            let effect = Effect::from_code(code as u32).map(Effect::kind);
            assert_eq!(effect, Some(Kind::Physics), "the proto has an effect {code}");
        }
        for reason in LeftOut::ALL {
            let name =
                proto::LeftOut::try_from(reason as i32).map(|reason| reason.as_str_name().to_lowercase());
            assert_eq!(name.ok(), Some(format!("left_out_{}", reason.name())));
        }
        for quantity in BoxQuantity::ALL {
            let name =
                proto::BoxQuantity::try_from(quantity as i32).expect("known").as_str_name().to_lowercase();
            let name = name.trim_start_matches("box_quantity_").to_owned();
            assert!(quantity.name().starts_with(&name), "{name}");
        }
    }

    #[test]
    fn a_quaternion_has_a_heading_and_a_tilt_has_none() {
        let q = UnitQuaternion::from_euler_angles(0.1, -0.2, 2.0).into_inner();
        let [w, x, y, z] = [q.w, q.i, q.j, q.k].map(|part| part as f32);
        let of = |attitude| {
            let message = proto::State { depth_m: Some(0.1), attitude: Some(attitude), ..Default::default() };
            state(&message, &husky()).expect("valid").heading
        };
        let heading = of(Attitude::WorldFromBody(proto::Quaternion { w, x, y, z })).expect("known");
        assert!((heading - 2.0).abs() < 1e-6);
        assert_eq!(of(Attitude::RollPitch(proto::RollPitch { roll_rad: 0.1, pitch_rad: 0.0 })), None);
    }

    #[test]
    fn an_array_of_another_length_is_named() {
        let message = proto::EvaluateBatchRequest {
            depth_m: vec![0.1, 0.2],
            velocity_mps: vec![0.0; 5],
            ..Default::default()
        };
        let refusal = batch(&message, &husky(), 10).expect_err("five values for two states");
        let expected = Refusal::UnequalLength { name: "velocity_mps", len: 5, expected: 6, width: 3 };
        assert_eq!(refusal, expected);
        let refusal = |wheel_speed_radps: Vec<f32>| {
            let message = proto::EvaluateBatchRequest {
                depth_m: vec![0.1, 0.2],
                wheel_speed_radps,
                ..Default::default()
            };
            batch(&message, &husky(), 10).expect_err("other wheels").to_string()
        };
        assert!(refusal(vec![0.0; 7]).contains("has 7 values, expected 8 (4 a state)"));
        let names = "wheel_fl, wheel_fr, wheel_rl, wheel_rr";
        let expected = format!("wheel_speed_radps has 6 values, and the vehicle has 4 wheels ({names})");
        assert_eq!(refusal(vec![0.0; 12]), expected);
    }
}
