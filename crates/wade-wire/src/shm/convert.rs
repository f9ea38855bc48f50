//! Between the pages of shared memory and what is behind them: a query to a checked kind of state, an evaluation to an answer.

use prost::Message;

use super::layout::{
    Answer, BatchAnswer, DRY_CONTACT, EffectAnswer, FULL, HAS_ADDED_MASS, HAS_BED, HAS_BED_CLEARANCE,
    HAS_CURRENT_EXPONENT, HAS_DAMPING, HAS_DEPTH_RATE, HAS_HEADING, HAS_SHAFT_POWER, HAS_WATER_LEVEL,
    HAS_WAVE, HAS_WHEEL_COUNT, HAS_WHEEL_LEVELS, HAS_WHEEL_SPEEDS, HYDROSTATIC, IMPLICIT_ADDED_MASS,
    JACOBIAN, JacobianAnswer, MAX_BATCH, MAX_EFFECTS, MAX_WHEELS, PROVENANCE_LEN, QUASI_STEADY, Query,
    RESERVED_LEN, Status, SurfaceAnswer, VehicleAnswer,
};
use crate::proto;
use crate::{Evaluated, Field, InvalidState, Problem, State, added_mass, by_rows, single};
use wade_core::domain::{Outside, Quantity};
use wade_core::effects::{BoxQuantity, OutsideBox};
use wade_core::physics::Physics;
use wade_core::served::ServedVehicle;
use wade_core::vehicle::{MAX_SURFACES, PerWheel};

/// Flags of a query that are known.
const QUERY_FLAGS: u64 = DRY_CONTACT
    | IMPLICIT_ADDED_MASS
    | HAS_HEADING
    | HAS_DEPTH_RATE
    | HAS_WHEEL_SPEEDS
    | HAS_WATER_LEVEL
    | HAS_BED_CLEARANCE
    | HAS_BED
    | HAS_WHEEL_LEVELS
    | HYDROSTATIC
    | QUASI_STEADY
    | FULL
    | JACOBIAN
    | HAS_WAVE
    | HAS_CURRENT_EXPONENT;

impl Query {
    /// The state, or what it sets that cannot be used. Its values are not checked yet.
    pub fn state(&self) -> Result<State, InvalidState> {
        if self.flags & !QUERY_FLAGS != 0 {
            return Err(InvalidState::new(Field::Flags, Problem::Unsupported));
        }
        let wheel_levels = self.has(HAS_WHEEL_LEVELS, Field::WheelWaterLevel, &self.wheel_water_level_m)?;
        let has_wave = self.flags & HAS_WAVE != 0;
        let optional = |flag: u64, field: Field, value: f32| {
            Ok::<_, InvalidState>(self.has(flag, field, &[value])?.then_some(value))
        };
        let water_level = optional(HAS_WATER_LEVEL, Field::WaterLevel, self.water_level_m)?;
        let bed_clearance = optional(HAS_BED_CLEARANCE, Field::BedClearance, self.bed_clearance_m)?;
        let bed = optional(HAS_BED, Field::Bed, self.bed)?;
        let heading = self.has(HAS_HEADING, Field::Heading, &[self.heading_rad])?;
        let depth_rate = self.has(HAS_DEPTH_RATE, Field::DepthRate, &[self.depth_rate_mps])?;
        let wheel_speeds = self.has(HAS_WHEEL_SPEEDS, Field::WheelSpeed, &self.wheel_speed_radps)?;
        Ok(State {
            velocity: self.velocity_mps,
            current: self.current_mps,
            angular_velocity: self.angular_velocity_radps,
            acceleration: self.acceleration_mps2,
            angular_acceleration: self.angular_acceleration_radps2,
            gravity: self.gravity_direction,
            depth: self.depth_m,
            water_level,
            bed_clearance,
            bed,
            density: self.density_kgpm3,
            dry_contact: self.flags & DRY_CONTACT != 0,
            heading: heading.then_some(self.heading_rad),
            depth_rate: depth_rate.then_some(self.depth_rate_mps),
            wheel_speeds: wheel_speeds.then(|| PerWheel::stated(&self.wheel_speed_radps)),
            time_step: self.time_step_s,
            implicit_added_mass: self.flags & IMPLICIT_ADDED_MASS != 0,
            physics: match self.flags & (HYDROSTATIC | QUASI_STEADY | FULL) {
                0 => None,
                HYDROSTATIC => Some(Physics::Hydrostatic),
                QUASI_STEADY => Some(Physics::QuasiSteady),
                FULL => Some(Physics::Full),
                _ => return Err(InvalidState::new(Field::Physics, Problem::Unknown)),
            },
            jacobian: self.flags & JACOBIAN != 0,
            wave_vector: if has_wave { self.wave_vector_radpm } else { [0.0; 3] },
            wave_amplitude: if has_wave { self.wave_amplitude_m } else { 0.0 },
            wave_phase: if has_wave { self.wave_phase_rad } else { 0.0 },
            wheel_levels: wheel_levels.then(|| PerWheel::stated(&self.wheel_water_level_m)),
            current_exponent: match self.flags & HAS_CURRENT_EXPONENT {
                0 => 0.0,
                _ => self.current_exponent,
            },
        })
    }

    /// Whether the flag of an input is set. A value without its flag is a client's mistake, not a value to pass over.
    fn has(&self, flag: u64, field: Field, values: &[f32]) -> Result<bool, InvalidState> {
        let has = self.flags & flag != 0;
        if !has && values.iter().any(|value| !value.is_nan()) {
            return Err(InvalidState::new(field, Problem::WithoutFlag));
        }
        Ok(has)
    }
}

/// Values of wheels in the first places, and NaN behind them.
fn places(values: Option<PerWheel<f32>>) -> [f32; MAX_WHEELS] {
    let mut places = [f32::NAN; MAX_WHEELS];
    if let Some(values) = values {
        places[..values.len()].copy_from_slice(&values);
    }
    places
}

impl From<&State> for Query {
    fn from(state: &State) -> Self {
        let flag = |set: bool, flag: u64| if set { flag } else { 0 };
        let (waves, sheared) = (state.wave_amplitude != 0.0, state.current_exponent != 0.0);
        let set = |set: bool, value: f32| if set { value } else { f32::NAN };
        Self {
            flags: flag(state.dry_contact, DRY_CONTACT)
                | flag(state.implicit_added_mass, IMPLICIT_ADDED_MASS)
                | flag(state.jacobian, JACOBIAN)
                | flag(state.heading.is_some(), HAS_HEADING)
                | flag(state.depth_rate.is_some(), HAS_DEPTH_RATE)
                | flag(state.wheel_speeds.is_some(), HAS_WHEEL_SPEEDS)
                | flag(state.water_level.is_some(), HAS_WATER_LEVEL)
                | flag(state.bed_clearance.is_some(), HAS_BED_CLEARANCE)
                | flag(state.bed.is_some(), HAS_BED)
                | flag(state.wheel_levels.is_some(), HAS_WHEEL_LEVELS)
                | flag(waves, HAS_WAVE)
                | flag(sheared, HAS_CURRENT_EXPONENT)
                | state.physics.map_or(0, |physics| match physics {
                    Physics::Hydrostatic => HYDROSTATIC,
                    Physics::QuasiSteady => QUASI_STEADY,
                    Physics::Full => FULL,
                }),
            depth_m: state.depth,
            water_level_m: state.water_level.unwrap_or(f32::NAN),
            bed_clearance_m: state.bed_clearance.unwrap_or(f32::NAN),
            bed: state.bed.unwrap_or(f32::NAN),
            density_kgpm3: state.density,
            velocity_mps: state.velocity,
            current_mps: state.current,
            angular_velocity_radps: state.angular_velocity,
            acceleration_mps2: state.acceleration,
            angular_acceleration_radps2: state.angular_acceleration,
            gravity_direction: state.gravity,
            heading_rad: state.heading.unwrap_or(f32::NAN),
            depth_rate_mps: state.depth_rate.unwrap_or(f32::NAN),
            wheel_speed_radps: places(state.wheel_speeds),
            wheel_water_level_m: places(state.wheel_levels),
            wave_vector_radpm: state.wave_vector.map(|part| set(waves, part)),
            wave_amplitude_m: set(waves, state.wave_amplitude),
            wave_phase_rad: set(waves, state.wave_phase),
            current_exponent: set(sheared, state.current_exponent),
            time_step_s: state.time_step,
            ..Self::UNSET
        }
    }
}

impl Answer {
    /// Becomes the forces of a vehicle, in place: an answer is too large to be handed around.
    pub fn fill(&mut self, vehicle: &ServedVehicle, evaluated: &Evaluated<'_>) {
        let (model, Evaluated { forces, effects, compute_ns, .. }) = (vehicle.model(), evaluated);
        *self = Self::UNSET;
        self.count_wheels(vehicle);
        self.compute_ns = *compute_ns;
        self.bundle_version = model.version();
        self.surface_count = forces.surfaces.len() as u32;
        self.effect_count = effects.loads.len() as u32;
        self.force_n = single(&forces.wrench.force);
        self.moment_nm = single(&forces.wrench.moment);
        self.about_m = single(&model.vehicle().center_of_mass);
        self.force_deviation_n = single(&forces.uncertainty);
        self.moment_deviation_nm = single(&forces.moment_uncertainty);
        if let Some(base) = &forces.base {
            self.water_level_m = base.water_level as f32;
            self.bed_clearance_m = base.bed_clearance as f32;
            self.bed = base.bed as f32;
            self.damping = by_rows(&base.damping);
            self.shaft_power_w = base.shaft_power as f32;
            self.flags |= HAS_DAMPING | HAS_SHAFT_POWER;
        }
        for (slot, excess) in self.outside.iter_mut().zip(forces.outside.excess) {
            *slot = excess as f32;
        }
        let provenance = model.provenance().as_bytes();
        let len = provenance.len().min(PROVENANCE_LEN);
        self.provenance[..len].copy_from_slice(&provenance[..len]);
        for (slot, load) in self.surfaces.iter_mut().zip(&forces.surfaces) {
            slot.force_n = single(&load.force);
            slot.point_m = single(&load.point);
            if forces.base.is_some() {
                slot.couple_nm = single(&load.couple);
            }
            slot.wetted_fraction = load.wetted_fraction as f32;
        }
        if let Some(matrix) = added_mass(effects) {
            self.added_mass = matrix;
            self.flags |= HAS_ADDED_MASS;
        }
        if effects.loads.is_empty() {
            return;
        }
        for (slot, excess) in self.effects_outside.iter_mut().zip(effects.outside) {
            *slot = excess as f32;
        }
        for (slot, load) in self.effects.iter_mut().zip(&effects.loads) {
            *slot = EffectAnswer {
                effect: load.effect.code(),
                left_out: load.left_out.map_or(0, |reason| reason as u32),
                force_n: single(&load.wrench.force),
                moment_nm: single(&load.wrench.moment),
            };
        }
        for (slot, force) in self.surfaces.iter_mut().zip(&effects.surface_forces) {
            slot.effect_force_n = single(force);
        }
    }

    fn count_wheels(&mut self, vehicle: &ServedVehicle) {
        self.wheel_count = vehicle.model().wheels().len() as u32;
        self.flags |= HAS_WHEEL_COUNT;
    }

    /// Becomes a refusal of a query to a vehicle that says which field is wrong.
    pub fn refuse(&mut self, invalid: &InvalidState, vehicle: &ServedVehicle) {
        *self = Self {
            status: Status::InvalidState as u32,
            field: invalid.field as u32,
            problem: invalid.problem as u32,
            ..Self::UNSET
        };
        self.count_wheels(vehicle);
    }

    /// A copy, for which what counts is read alone: memory that another core has written is slow to read.
    pub fn copied(&self) -> Self {
        let mut copy = Self {
            sequence: self.sequence,
            compute_ns: self.compute_ns,
            flags: self.flags,
            status: self.status,
            field: self.field,
            problem: self.problem,
            bundle_version: self.bundle_version,
            surface_count: self.surface_count,
            effect_count: self.effect_count,
            force_n: self.force_n,
            moment_nm: self.moment_nm,
            about_m: self.about_m,
            force_deviation_n: self.force_deviation_n,
            moment_deviation_nm: self.moment_deviation_nm,
            outside: self.outside,
            effects_outside: self.effects_outside,
            water_level_m: self.water_level_m,
            bed_clearance_m: self.bed_clearance_m,
            bed: self.bed,
            provenance: self.provenance,
            wheel_count: self.wheel_count,
            shaft_power_w: self.shaft_power_w,
            ..Self::UNSET
        };
        let (effects, surfaces) = (self.effects(), self.surfaces());
        copy.effects[..effects.len()].copy_from_slice(effects);
        copy.surfaces[..surfaces.len()].copy_from_slice(surfaces);
        if self.flags & HAS_ADDED_MASS != 0 {
            copy.added_mass = self.added_mass;
        }
        if self.flags & HAS_DAMPING != 0 {
            copy.damping = self.damping;
        }
        copy
    }

    /// What was wrong with the state, where something was.
    pub fn refusal(&self) -> Option<InvalidState> {
        (self.status == Status::InvalidState as u32)
            .then(|| {
                Some(InvalidState::new(Field::from_code(self.field)?, Problem::from_code(self.problem)?))
            })
            .flatten()
    }

    /// The same with the numbers of wheels in words, for the state that was asked about.
    pub fn refusal_of(&self, state: &State) -> Option<InvalidState> {
        let invalid = self.refusal()?;
        let wheels = (self.flags & HAS_WHEEL_COUNT != 0).then_some(self.wheel_count as usize);
        let given = match invalid.field {
            Field::WheelSpeed => &state.wheel_speeds,
            Field::WheelWaterLevel => &state.wheel_levels,
            _ => &None,
        };
        match (wheels, given) {
            (Some(wheels), Some(given)) if invalid.problem == Problem::Count => {
                // the names of the wheels are not in this page
                Some(InvalidState::wheels(invalid.field, given.len(), wheels, ""))
            }
            _ => Some(invalid),
        }
    }

    /// The surfaces that hold a load.
    pub fn surfaces(&self) -> &[SurfaceAnswer] {
        &self.surfaces[..(self.surface_count as usize).min(MAX_SURFACES)]
    }

    /// Power that the shafts of the wheels put in [W]; NaN where it is not stated.
    pub fn shaft_power(&self) -> f32 {
        if self.flags & HAS_SHAFT_POWER != 0 { self.shaft_power_w } else { f32::NAN }
    }

    /// The effects that hold a load.
    pub fn effects(&self) -> &[EffectAnswer] {
        &self.effects[..(self.effect_count as usize).min(MAX_EFFECTS)]
    }

    /// True where a quantity lies outside the training domain, be it one that this version does not know.
    pub fn is_outside(&self) -> bool {
        self.outside.iter().any(|&excess| excess != 0.0 && !excess.is_nan())
    }

    /// How far each quantity lies outside the training domain.
    pub fn outside(&self) -> Outside {
        Outside { excess: known::<{ Quantity::ALL.len() }>(&self.outside) }
    }

    /// How far the state lies outside the box in which the effects were seen.
    pub fn effects_outside(&self) -> OutsideBox {
        known::<{ BoxQuantity::ALL.len() }>(&self.effects_outside)
    }

    /// The provenance up to its padding.
    pub fn provenance(&self) -> &str {
        let end = self.provenance.iter().position(|&b| b == 0).unwrap_or(PROVENANCE_LEN);
        let bytes = &self.provenance[..end];
        // a name that was cut within a character is shown up to it
        std::str::from_utf8(bytes)
            .or_else(|e| std::str::from_utf8(&bytes[..e.valid_up_to()]))
            .unwrap_or_default()
    }
}

impl JacobianAnswer {
    /// A copy, for which what counts is read alone.
    pub fn copied(&self) -> Self {
        Self { answer: self.answer.copied(), jacobian: self.jacobian, ..Self::UNSET }
    }
}

/// The quantities that this version knows; one that is not judged is not outside.
fn known<const N: usize>(excess: &[f32]) -> [f64; N] {
    std::array::from_fn(|i| excess.get(i).filter(|excess| !excess.is_nan()).map_or(0.0, |&x| f64::from(x)))
}

impl VehicleAnswer {
    /// Becomes the description of a vehicle, or says that it is not served any more.
    pub fn fill(&mut self, vehicle: Option<&ServedVehicle>) {
        (self.status, self.len, self.reserved) = (Status::NotServed as u32, 0, [0; RESERVED_LEN]);
        if let Some(vehicle) = vehicle {
            self.hold(&crate::vehicle(vehicle, false).encode_to_vec());
        }
    }

    fn hold(&mut self, description: &[u8]) {
        self.status = Status::TooLong as u32;
        if let Some(room) = self.description.get_mut(..description.len()) {
            room.copy_from_slice(description);
            (self.status, self.len) = (Status::Ok as u32, description.len() as u32);
        }
    }

    /// The description, where the status says that there is one.
    pub fn decoded(&self) -> Result<proto::GetVehicleResponse, prost::DecodeError> {
        let len = (self.len as usize).min(self.description.len());
        proto::GetVehicleResponse::decode(&self.description[..len])
    }
}

impl BatchAnswer {
    /// What was wrong with which of the states that were asked about, where something was.
    pub fn refusal_of(&self, states: &[State]) -> Option<(InvalidState, usize)> {
        let index = self.index as usize % MAX_BATCH;
        (self.status == Status::InvalidState as u32)
            .then(|| Some((self.answers[index].refusal_of(states.get(index)?)?, index)))
            .flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shm::layout::DESCRIPTION_LEN;

    #[test]
    fn a_description_without_room_is_said_to_be_too_long() {
        let unset = VehicleAnswer {
            sequence: 0,
            flags: 0,
            status: 0,
            len: 0,
            reserved: [0; RESERVED_LEN],
            description: [0; DESCRIPTION_LEN],
        };
        for (len, status) in [(DESCRIPTION_LEN, Status::Ok), (DESCRIPTION_LEN + 1, Status::TooLong)] {
            let mut answer = unset;
            answer.hold(&vec![7; len]);
            let held = if status == Status::Ok { len as u32 } else { 0 };
            assert_eq!((answer.status, answer.len), (status as u32, held));
        }
    }
}
