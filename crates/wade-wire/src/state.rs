//! A state as it travels, and the checks on it, the same for every transport.

use nalgebra::UnitVector3;

use wade_core::condition::{Condition, FRESH_WATER, GroundContact, LEAST_UPRIGHT};
use wade_core::effects::Circumstances;
use wade_core::frame::Vec3;
use wade_core::physics::Physics;
use wade_core::sea::{Sea, Wave};
use wade_core::served::ServedVehicle;
use wade_core::vehicle::{MAX_WHEELS, PerWheel};

/// A state as it travels: single precision, body frame, not yet checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Velocity over ground [m/s].
    pub velocity: [f32; 3],
    /// Velocity of the water over ground [m/s].
    pub current: [f32; 3],
    /// Angular velocity [rad/s].
    pub angular_velocity: [f32; 3],
    /// Acceleration [m/s2].
    pub acceleration: [f32; 3],
    /// Angular acceleration [rad/s2].
    pub angular_acceleration: [f32; 3],
    /// Unit vector along gravity (down).
    pub gravity: [f32; 3],
    /// Water surface above the ground-contact plane at the body origin [m]; NaN where `water_level` is given instead.
    pub depth: f32,
    /// Signed height of the still-water plane above the body origin along up [m].
    pub water_level: Option<f32>,
    /// Distance from the ground-contact plane down to the bed [m].
    pub bed_clearance: Option<f32>,
    /// Share of the motion through the water that is motion over the bed, 0 to 1.
    pub bed: Option<f32>,
    /// Density [kg/m3].
    pub density: f32,
    /// No water pressure under the contact patches.
    pub dry_contact: bool,
    /// Angle from the world's x to the body's x [rad].
    pub heading: Option<f32>,
    /// Rate at which the water rises at the body origin [m/s].
    pub depth_rate: Option<f32>,
    /// Speed of each wheel [rad/s], in the order of [`Vehicle::wheels`](wade_core::vehicle::Vehicle::wheels).
    pub wheel_speeds: Option<PerWheel<f32>>,
    /// Time since the state before it in the session [s].
    pub time_step: f32,
    /// The caller integrates added mass himself.
    pub implicit_added_mass: bool,
    /// How much of the physical base answers; by default as the server is set.
    pub physics: Option<Physics>,
    /// The derivatives of the wrench are asked for.
    pub jacobian: bool,
    /// Wave number of a regular wave along the direction in which it travels [rad/m].
    pub wave_vector: [f32; 3],
    /// Half its height [m]; 0 of none.
    pub wave_amplitude: f32,
    /// Its phase at the body origin [rad].
    pub wave_phase: f32,
    /// Height of the water surface above the body origin along up at each wheel [m], in the order of `wheel_speeds`.
    pub wheel_levels: Option<PerWheel<f32>>,
    /// Exponent of the profile of the current; 0 of one that is even.
    pub current_exponent: f32,
}

impl Default for State {
    fn default() -> Self {
        Self {
            velocity: [0.0; 3],
            current: [0.0; 3],
            angular_velocity: [0.0; 3],
            acceleration: [0.0; 3],
            angular_acceleration: [0.0; 3],
            gravity: [0.0, 0.0, -1.0],
            depth: f32::NAN,
            water_level: None,
            bed_clearance: None,
            bed: None,
            density: FRESH_WATER as f32,
            dry_contact: false,
            heading: None,
            depth_rate: None,
            wheel_speeds: None,
            time_step: 0.0,
            implicit_added_mass: false,
            physics: None,
            jacobian: false,
            wave_vector: [0.0; 3],
            wave_amplitude: 0.0,
            wave_phase: 0.0,
            wheel_levels: None,
            current_exponent: 0.0,
        }
    }
}

wade_core::named_enum! {
    /// A field of a state. The discriminants are the codes of the shared-memory layout.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[repr(u32)]
    pub enum Field {
        /// `velocity_mps`
        Velocity = 1 => "velocity_mps",
        /// `current_mps`
        Current = 2 => "current_mps",
        /// `angular_velocity_radps`
        AngularVelocity = 3 => "angular_velocity_radps",
        /// `acceleration_mps2`
        Acceleration = 4 => "acceleration_mps2",
        /// `angular_acceleration_radps2`
        AngularAcceleration = 5 => "angular_acceleration_radps2",
        /// `gravity_direction`
        Gravity = 6 => "gravity_direction",
        /// `depth_m`
        Depth = 7 => "depth_m",
        /// `density_kgpm3`
        Density = 8 => "density_kgpm3",
        /// `world_from_body`
        Quaternion = 9 => "world_from_body",
        /// `roll_pitch`
        RollPitch = 10 => "roll_pitch",
        /// `ground_contact`
        GroundContact = 11 => "ground_contact",
        /// `heading_rad`
        Heading = 12 => "heading_rad",
        /// `depth_rate_mps`
        DepthRate = 13 => "depth_rate_mps",
        /// `wheel_speed_radps`
        WheelSpeed = 14 => "wheel_speed_radps",
        /// `time_step_s`
        TimeStep = 15 => "time_step_s",
        /// `water_level_m`
        WaterLevel = 16 => "water_level_m",
        /// `bed_clearance_m`
        BedClearance = 17 => "bed_clearance_m",
        /// `bed`
        Bed = 18 => "bed",
        /// `wheel_water_level_m`
        WheelWaterLevel = 19 => "wheel_water_level_m",
        /// `flags`
        Flags = 20 => "flags",
        /// `physics`
        Physics = 21 => "physics",
        /// `jacobian`
        Jacobian = 22 => "jacobian",
        /// `wave_vector_radpm`
        WaveVector = 23 => "wave_vector_radpm",
        /// `wave_amplitude_m`
        WaveAmplitude = 24 => "wave_amplitude_m",
        /// `wave_phase_rad`
        WavePhase = 25 => "wave_phase_rad",
        /// `current_exponent`
        CurrentExponent = 26 => "current_exponent",
    }
}

impl Field {
    /// The field of a code of the shared-memory layout.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|&field| field as u32 == code)
    }
}

/// What is wrong with a field. The discriminants are the codes of the shared-memory layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Problem {
    /// A NaN or an infinity.
    NotFinite = 1,
    /// Beyond anything physical, see [`limit`].
    TooLarge = 2,
    /// Below zero.
    Negative = 3,
    /// Zero or below.
    NotPositive = 4,
    /// Length differs from 1 by more than [`UNIT_TOLERANCE`].
    NotUnit = 5,
    /// No value of the enumeration.
    Unknown = 6,
    /// Another number of values.
    Count = 7,
    /// An input that the server cannot use yet.
    Unsupported = 8,
    /// A value, but not the flag that says so.
    WithoutFlag = 9,
    /// Neither a depth nor a water level.
    NoLevel = 10,
    /// A depth and a water level.
    TwoLevels = 11,
    /// A depth of a vehicle that lies on its side or its back.
    NoDepth = 12,
    /// Not between 0 and 1.
    NoShare = 13,
}

impl Problem {
    const ALL: [Self; 13] = [
        Self::NotFinite,
        Self::TooLarge,
        Self::Negative,
        Self::NotPositive,
        Self::NotUnit,
        Self::Unknown,
        Self::Count,
        Self::Unsupported,
        Self::WithoutFlag,
        Self::NoLevel,
        Self::TwoLevels,
        Self::NoDepth,
        Self::NoShare,
    ];

    /// The problem of a code of the shared-memory layout.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|&problem| problem as u32 == code)
    }
}

/// A field that no answer can be given for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InvalidState {
    /// The field.
    pub field: Field,
    /// What is wrong with it.
    pub problem: Problem,
    /// The same in words, where the two alone say too little.
    words: Option<Box<str>>,
}

impl InvalidState {
    /// This is wrong with that field.
    pub const fn new(field: Field, problem: Problem) -> Self {
        Self { field, problem, words: None }
    }

    /// So many values of wheels for a vehicle that has another number of them.
    pub fn wheel_count(field: Field, given: usize, vehicle: &ServedVehicle) -> Self {
        let wheels = vehicle.model().wheels();
        let name = |&wheel: &usize| vehicle.model().vehicle().surfaces[wheel].name.as_str();
        let names: Vec<&str> = wheels.iter().map(name).collect();
        Self::wheels(field, given, wheels.len(), &names.join(", "))
    }

    /// Derivatives of a vehicle that has none.
    fn no_jacobian(vehicle: &ServedVehicle) -> Self {
        let name = &vehicle.model().vehicle().name;
        let words = format!(
            "jacobian is set, and {name} has no derivatives: its bundle is from before the physical base, which they are of; \
             leave jacobian out"
        );
        Self { words: Some(words.into()), ..Self::new(Field::Jacobian, Problem::Unsupported) }
    }

    /// Water that moves in a way that the server does not know about this vehicle, or beside something else.
    fn unsupported(field: Field, words: &str) -> Self {
        let words = format!("{} is set, {words}", field.name());
        Self { words: Some(words.into()), ..Self::new(field, Problem::Unsupported) }
    }

    /// The same where the names of the wheels are not known; empty names are none.
    pub(crate) fn wheels(field: Field, given: usize, wheels: usize, names: &str) -> Self {
        let given = match given {
            1 => "1 value".to_owned(),
            given => format!("{given} values"),
        };
        let expected = match wheels {
            0 => "no wheels".to_owned(),
            1 => "1 wheel".to_owned(),
            wheels => format!("{wheels} wheels"),
        };
        let expected = match names {
            "" => expected,
            names => format!("{expected} ({names})"),
        };
        let limit = match wheels {
            0..=MAX_WHEELS => String::new(),
            _ => format!(": values of {MAX_WHEELS} wheels can be stated at most"),
        };
        let words = format!("{} has {given}, and the vehicle has {expected}{limit}", field.name());
        Self { words: Some(words.into()), ..Self::new(field, Problem::Count) }
    }
}

impl std::error::Error for InvalidState {}

impl std::fmt::Display for InvalidState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = self.field.name();
        if let Some(words) = &self.words {
            return f.write_str(words);
        }
        match self.problem {
            Problem::NotFinite => write!(f, "{name} must be finite"),
            Problem::TooLarge => write!(f, "{name} must not exceed {} in magnitude", limit(self.field)),
            Problem::Negative => write!(f, "{name} must not be negative"),
            Problem::NotPositive => write!(f, "{name} must be greater than zero"),
            Problem::Unknown => write!(f, "{name} must be one of the values of its enumeration"),
            Problem::Count => write!(f, "{name} must have one value for each wheel of the vehicle, or none"),
            Problem::Unsupported => write!(f, "{name} is set, which this server does not support yet"),
            Problem::WithoutFlag => write!(f, "{name} has a value, but its flag is not set"),
            Problem::NoLevel => write!(f, "{name} must be given, or water_level_m in its place"),
            Problem::TwoLevels => write!(f, "{name} and depth_m are both given: give one of the two"),
            Problem::NoDepth => write!(
                f,
                "{name} means nothing for a vehicle on its side or its back (body z within {:.0} degrees of level or below): give water_level_m",
                LEAST_UPRIGHT.asin().to_degrees()
            ),
            Problem::NoShare => write!(f, "{name} must lie between 0 (parked) and 1 (driving)"),
            Problem::NotUnit => write!(f, "{name} must have length 1 (within {UNIT_TOLERANCE})"),
        }
    }
}

/// How far the length of a direction or a quaternion may be from 1.
pub const UNIT_TOLERANCE: f64 = 1e-3;

/// Bounds far outside the physics, which keep every product in an evaluation finite.
pub fn limit(field: Field) -> f64 {
    match field {
        Field::Velocity | Field::Current | Field::AngularVelocity | Field::Depth => 1e3,
        Field::Acceleration | Field::AngularAcceleration | Field::Density => 1e5,
        // anything further from 1 is refused for its length
        Field::Gravity | Field::Quaternion => 1e3,
        Field::RollPitch | Field::GroundContact => 1e3,
        // a turn counter may have wound up
        Field::Heading => 1e6,
        Field::DepthRate | Field::WheelSpeed | Field::TimeStep => 1e3,
        Field::WaterLevel | Field::BedClearance | Field::Bed => 1e3,
        Field::WheelWaterLevel | Field::WaveVector | Field::WaveAmplitude => 1e3,
        // a phase may have been counted up
        Field::WavePhase => 1e6,
        // that of a jet along the surface: water at the bed stands still
        Field::CurrentExponent => 10.0,
        // these are refused whatever their value
        Field::Flags | Field::Physics | Field::Jacobian => 1e3,
    }
}

/// A state that has been checked: [`State::check`] alone makes one, and what evaluates takes nothing else.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckedState {
    condition: Condition,
    circumstances: Circumstances,
}

impl CheckedState {
    /// The condition that the state describes.
    pub fn condition(&self) -> &Condition {
        &self.condition
    }

    /// What effects need to know beside the condition.
    pub fn circumstances(&self) -> &Circumstances {
        &self.circumstances
    }
}

impl State {
    /// Level and at rest in fresh water of a depth [m].
    pub fn still(depth: f32) -> Self {
        Self { depth, ..Self::default() }
    }

    /// The state with every field checked for a vehicle, or the first field that is wrong.
    pub fn check_for(&self, vehicle: &ServedVehicle) -> Result<CheckedState, InvalidState> {
        if self.jacobian && !vehicle.has_jacobian() {
            return Err(InvalidState::no_jacobian(vehicle));
        }
        let per_wheel =
            [(Field::WheelSpeed, &self.wheel_speeds), (Field::WheelWaterLevel, &self.wheel_levels)];
        for (field, values) in per_wheel {
            if let Some(values) = values
                && values.len() != vehicle.model().wheels().len()
                && values.iter().all(|value| value.is_finite())
            {
                return Err(InvalidState::wheel_count(field, values.len(), vehicle));
            }
        }
        let checked = self.check()?;
        match self.moving_water() {
            Some(field) if vehicle.model().base().is_none() => {
                let name = &vehicle.model().vehicle().name;
                let words = format!(
                    "and {name} is answered in still and even water alone: its bundle is from before the physical base"
                );
                Err(InvalidState::unsupported(field, &words))
            }
            _ => Ok(checked),
        }
    }

    /// The field by which the water does more than lie still or flow evenly.
    fn moving_water(&self) -> Option<Field> {
        let moves = [
            (self.wave_amplitude != 0.0, Field::WaveAmplitude),
            (self.wheel_levels.is_some(), Field::WheelWaterLevel),
            (self.current_exponent != 0.0, Field::CurrentExponent),
        ];
        moves.into_iter().find_map(|(moves, field)| moves.then_some(field))
    }

    fn sea(&self) -> Result<Sea, InvalidState> {
        let vector = vector(Field::WaveVector, &self.wave_vector)?;
        let amplitude = scalar(Field::WaveAmplitude, self.wave_amplitude)?;
        let phase = scalar(Field::WavePhase, self.wave_phase)?;
        let wrong = |field: Field, problem: Problem| Err(InvalidState::new(field, problem));
        if amplitude < 0.0 {
            return wrong(Field::WaveAmplitude, Problem::Negative);
        }
        if amplitude > 0.0 && vector.norm() == 0.0 {
            return wrong(Field::WaveVector, Problem::NotPositive);
        }
        let exponent = scalar(Field::CurrentExponent, self.current_exponent)?;
        if exponent < 0.0 {
            return wrong(Field::CurrentExponent, Problem::Negative);
        }
        let levels =
            self.wheel_levels.map(|levels| levels.try_map(|level| scalar(Field::WheelWaterLevel, level)));
        let wheel_levels = levels.transpose()?;
        if wheel_levels.is_some() && amplitude > 0.0 {
            let words = "and wave_amplitude_m too: state the surface in one of the two ways";
            return Err(InvalidState::unsupported(Field::WheelWaterLevel, words));
        }
        if let Some(field) = self.moving_water().filter(|_| self.jacobian) {
            let words = format!("and {} too: derivatives are those in still and even water", field.name());
            return Err(InvalidState::unsupported(Field::Jacobian, &words));
        }
        let wave = (amplitude > 0.0).then_some(Wave { vector, amplitude, phase });
        Ok(Sea { wave, wheel_levels, current_exponent: exponent })
    }

    /// The same for a vehicle that is not known here: it may have another number of wheels than speeds are stated. Speeds that do
    /// not fit the vehicle that is evaluated are as if none were stated.
    pub fn check(&self) -> Result<CheckedState, InvalidState> {
        Ok(CheckedState { condition: self.condition()?, circumstances: self.circumstances()? })
    }

    fn circumstances(&self) -> Result<Circumstances, InvalidState> {
        let optional = |field: Field, value: Option<f32>| value.map(|value| scalar(field, value)).transpose();
        let time_step = scalar(Field::TimeStep, self.time_step)?;
        if time_step < 0.0 {
            return Err(InvalidState::new(Field::TimeStep, Problem::Negative));
        }
        let wheel_speeds =
            self.wheel_speeds.map(|speeds| speeds.try_map(|speed| scalar(Field::WheelSpeed, speed)));
        Ok(Circumstances {
            heading: optional(Field::Heading, self.heading)?,
            depth_rate: optional(Field::DepthRate, self.depth_rate)?,
            wheel_speeds: wheel_speeds.transpose()?,
            time_step,
            implicit_added_mass: self.implicit_added_mass,
            physics: self.physics,
            jacobian: self.jacobian,
            sea: self.sea()?,
        })
    }

    /// Depth and water level, of which one is given.
    fn levels(&self, up: &UnitVector3<f64>) -> Result<(f64, Option<f64>), InvalidState> {
        let wrong = |field: Field, problem: Problem| Err(InvalidState::new(field, problem));
        match (self.depth.is_nan(), self.water_level) {
            (true, Some(level)) => Ok((0.0, Some(scalar(Field::WaterLevel, level)?))),
            (true, None) => wrong(Field::Depth, Problem::NoLevel),
            (false, Some(_)) => wrong(Field::WaterLevel, Problem::TwoLevels),
            (false, None) => {
                let depth = scalar(Field::Depth, self.depth)?;
                if up.z < LEAST_UPRIGHT { wrong(Field::Depth, Problem::NoDepth) } else { Ok((depth, None)) }
            }
        }
    }

    fn condition(&self) -> Result<Condition, InvalidState> {
        let velocity = vector(Field::Velocity, &self.velocity)?;
        let current = vector(Field::Current, &self.current)?;
        let density = scalar(Field::Density, self.density)?;
        if density <= 0.0 {
            return Err(InvalidState::new(Field::Density, Problem::NotPositive));
        }
        let up = -direction(&self.gravity)?;
        let (depth, water_level) = self.levels(&up)?;
        let optional = |field: Field, value: Option<f32>| value.map(|value| scalar(field, value)).transpose();
        let bed_clearance = optional(Field::BedClearance, self.bed_clearance)?;
        if bed_clearance.is_some_and(|clearance| clearance < 0.0) {
            return Err(InvalidState::new(Field::BedClearance, Problem::Negative));
        }
        let stated_bed = optional(Field::Bed, self.bed)?;
        if stated_bed.is_some_and(|bed| !(0.0..=1.0).contains(&bed)) {
            return Err(InvalidState::new(Field::Bed, Problem::NoShare));
        }
        Ok(Condition {
            velocity: velocity - current,
            ground_velocity: velocity,
            angular_velocity: vector(Field::AngularVelocity, &self.angular_velocity)?,
            acceleration: vector(Field::Acceleration, &self.acceleration)?,
            angular_acceleration: vector(Field::AngularAcceleration, &self.angular_acceleration)?,
            depth,
            water_level,
            bed_clearance,
            stated_bed,
            density,
            up,
            ground_contact: if self.dry_contact { GroundContact::Dry } else { GroundContact::Wetted },
        })
    }
}

fn vector(field: Field, values: &[f32; 3]) -> Result<Vec3, InvalidState> {
    let [x, y, z] = values.map(|value| scalar(field, value));
    Ok(Vec3::new(x?, y?, z?))
}

/// A number that is finite and within its limit.
pub(crate) fn scalar(field: Field, value: f32) -> Result<f64, InvalidState> {
    let value = f64::from(value);
    if !value.is_finite() {
        Err(InvalidState::new(field, Problem::NotFinite))
    } else if value.abs() > limit(field) {
        Err(InvalidState::new(field, Problem::TooLarge))
    } else {
        Ok(value)
    }
}

fn direction(gravity: &[f32; 3]) -> Result<UnitVector3<f64>, InvalidState> {
    let gravity = Vec3::from(gravity.map(f64::from));
    if !gravity.iter().all(|x| x.is_finite()) {
        return Err(InvalidState::new(Field::Gravity, Problem::NotFinite));
    }
    if (gravity.norm() - 1.0).abs() > UNIT_TOLERANCE {
        return Err(InvalidState::new(Field::Gravity, Problem::NotUnit));
    }
    Ok(UnitVector3::new_normalize(gravity))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(state: State) -> (Field, Problem) {
        let invalid = state.check().expect_err("the state is invalid");
        (invalid.field, invalid.problem)
    }

    #[test]
    fn each_bad_field_is_named() {
        let good = State { depth: 0.1, ..State::default() };
        assert!(good.check().is_ok());
        let cases = [
            (State { velocity: [f32::NAN, 0.0, 0.0], ..good }, Field::Velocity, Problem::NotFinite),
            (State { current: [0.0, f32::INFINITY, 0.0], ..good }, Field::Current, Problem::NotFinite),
            (State { angular_velocity: [0.0, 0.0, 1e9], ..good }, Field::AngularVelocity, Problem::TooLarge),
            (State { acceleration: [f32::NAN; 3], ..good }, Field::Acceleration, Problem::NotFinite),
            (State { depth: f32::NAN, ..good }, Field::Depth, Problem::NoLevel),
            (State { depth: f32::INFINITY, ..good }, Field::Depth, Problem::NotFinite),
            (State { water_level: Some(0.1), ..good }, Field::WaterLevel, Problem::TwoLevels),
            (State { gravity: [0.0, 0.0, 1.0], ..good }, Field::Depth, Problem::NoDepth),
            (State { bed_clearance: Some(-0.1), ..good }, Field::BedClearance, Problem::Negative),
            (State { bed: Some(1.5), ..good }, Field::Bed, Problem::NoShare),
            (State { density: 0.0, ..good }, Field::Density, Problem::NotPositive),
            (State { density: f32::NAN, ..good }, Field::Density, Problem::NotFinite),
            (State { gravity: [0.0, 0.0, -0.9], ..good }, Field::Gravity, Problem::NotUnit),
            (State { gravity: [0.0; 3], ..good }, Field::Gravity, Problem::NotUnit),
            (State { gravity: [f32::NAN; 3], ..good }, Field::Gravity, Problem::NotFinite),
            (State { heading: Some(f32::NAN), ..good }, Field::Heading, Problem::NotFinite),
            (State { depth_rate: Some(1e9), ..good }, Field::DepthRate, Problem::TooLarge),
            (
                State { wheel_speeds: Some([f32::INFINITY; 4].into()), ..good },
                Field::WheelSpeed,
                Problem::NotFinite,
            ),
            (State { time_step: -0.001, ..good }, Field::TimeStep, Problem::Negative),
        ];
        for (state, field, expected) in cases {
            assert_eq!(problem(state), (field, expected));
        }
    }

    #[test]
    fn a_current_is_subtracted() {
        let state =
            State { velocity: [1.0, 0.0, 0.0], current: [0.25, 0.5, 0.0], depth: 0.1, ..State::default() };
        let checked = state.check().expect("valid");
        let condition = checked.condition();
        assert_eq!(condition.velocity, Vec3::new(0.75, -0.5, 0.0));
        assert_eq!(condition.ground_velocity, Vec3::new(1.0, 0.0, 0.0));
    }

    #[test]
    fn codes_name_the_same_field_and_problem_on_both_sides() {
        for field in Field::ALL {
            assert_eq!(Field::from_code(field as u32), Some(field));
        }
        for problem in Problem::ALL {
            assert_eq!(Problem::from_code(problem as u32), Some(problem));
        }
        assert_eq!(Field::from_code(0), None);
    }
}
