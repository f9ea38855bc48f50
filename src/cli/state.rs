//! A state from the command line.

use anyhow::Result;
use clap::{Args, ValueEnum};
use wade_core::condition::bed_from_word;
use wade_core::frame::up_from_roll_pitch;
use wade_core::physics::Physics;
use wade_core::vehicle::{MAX_WHEELS, PerWheel};
use wade_wire::State;
use wade_wire::single;

/// The state of the vehicle, SI units, radians, body frame (x forward, y left, z up).
#[derive(Debug, Args)]
pub struct StateArgs {
    /// Speed straight ahead [m/s]
    #[arg(long, allow_negative_numbers = true, conflicts_with = "velocity")]
    speed: Option<f32>,
    /// Velocity over ground [m/s]
    #[arg(long, value_name = "VX,VY,VZ", value_parser = numbers::<3>, allow_hyphen_values = true)]
    velocity: Option<[f32; 3]>,
    /// Angular velocity [rad/s]
    #[arg(long, value_name = "WX,WY,WZ", value_parser = numbers::<3>, allow_hyphen_values = true)]
    angular: Option<[f32; 3]>,
    /// Water surface above the ground under the vehicle [m]
    #[arg(long, allow_negative_numbers = true, required_unless_present = "water_level")]
    depth: Option<f32>,
    /// Still-water plane above the body origin along up [m], in the place of --depth
    #[arg(long, value_name = "M", allow_negative_numbers = true, conflicts_with = "depth")]
    water_level: Option<f32>,
    /// Distance from the ground-contact plane down to the bed [m] [default: on the bed until the vehicle floats]
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    bed_clearance: Option<f32>,
    /// Share of the motion through the water that is motion over the bed: 0 or parked, 1 or driving [default: from the velocities]
    #[arg(long, value_name = "B", value_parser = bed)]
    bed: Option<f32>,
    /// How much of the physical base answers [default: as the server is set; in process full]
    #[arg(long, value_enum)]
    physics: Option<Terms>,
    /// Density of the fluid [kg/m3]
    #[arg(long, default_value_t = 1000.0, allow_negative_numbers = true)]
    density: f32,
    /// Roll, positive lowers the right side [rad]
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    roll: f64,
    /// Pitch, positive lowers the nose [rad]
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pitch: f64,
    /// Velocity of the water over ground, body frame [m/s]
    #[arg(long, value_name = "CX,CY,CZ", value_parser = numbers::<3>, allow_hyphen_values = true)]
    current: Option<[f32; 3]>,
    /// Acceleration [m/s2]
    #[arg(long, value_name = "AX,AY,AZ", value_parser = numbers::<3>, allow_hyphen_values = true)]
    acceleration: Option<[f32; 3]>,
    /// Angular acceleration [rad/s2]
    #[arg(long, value_name = "AX,AY,AZ", value_parser = numbers::<3>, allow_hyphen_values = true)]
    angular_acceleration: Option<[f32; 3]>,
    /// Whether water reaches under the tires
    #[arg(long, value_enum, default_value_t = Contact::Wetted)]
    ground_contact: Contact,
    /// Angle from the world's x to the vehicle's [rad], for effects that are fixed in the world
    #[arg(long, allow_negative_numbers = true)]
    heading: Option<f32>,
    /// Rate at which the water rises [m/s], for the blow of entering it
    #[arg(long, allow_negative_numbers = true)]
    depth_rate: Option<f32>,
    /// Speed of each wheel [rad/s] by axle from the front, left before right: of four wheels FL,FR,RL,RR
    #[arg(long, value_name = "W,W,...", value_parser = per_wheel, allow_hyphen_values = true)]
    wheel_speeds: Option<PerWheel<f32>>,
    /// Wave number along the direction in which a regular wave travels [rad/m], body frame
    #[arg(long, value_name = "KX,KY,KZ", value_parser = numbers::<3>, allow_hyphen_values = true, requires = "wave_amplitude")]
    wave_vector: Option<[f32; 3]>,
    /// Half the height of the wave from trough to crest [m]
    #[arg(long, value_name = "A", requires = "wave_vector", allow_negative_numbers = true)]
    wave_amplitude: Option<f32>,
    /// Phase of the wave at the body origin [rad]: a crest at 0, and after it the water falls
    #[arg(long, value_name = "RAD", default_value_t = 0.0, allow_negative_numbers = true)]
    wave_phase: f32,
    /// Height of the water above the body origin at each wheel [m], in the order of --wheel-speeds
    #[arg(long, value_name = "H,H,...", value_parser = per_wheel, allow_hyphen_values = true)]
    wheel_levels: Option<PerWheel<f32>>,
    /// Exponent of the profile of the current over the height over the bed, such as 0.14; 0 of an even one
    #[arg(long, value_name = "N", default_value_t = 0.0, allow_negative_numbers = true)]
    current_exponent: f32,
    /// Leave the force of added mass out, for a caller who integrates with the matrix
    #[arg(long)]
    implicit_added_mass: bool,
    /// Answer with the derivatives of force and moment by velocity, angular velocity, water level, attitude and density
    #[arg(long)]
    jacobian: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Contact {
    /// Full Archimedes
    Wetted,
    /// No pressure under the contact patches
    Dry,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum Terms {
    /// The pressure of still water
    Hydrostatic,
    /// And drag and friction of the local velocity
    QuasiSteady,
    /// And added mass, entry and the waves that the hull makes
    Full,
}

impl From<Terms> for Physics {
    fn from(terms: Terms) -> Self {
        match terms {
            Terms::Hydrostatic => Self::Hydrostatic,
            Terms::QuasiSteady => Self::QuasiSteady,
            Terms::Full => Self::Full,
        }
    }
}

/// A share, or one of the two words for its ends.
fn bed(text: &str) -> Result<f32, String> {
    let number = bed_from_word(text).map_or_else(|| text.parse(), |share| Ok(share as f32));
    number.map_err(|_| format!("`{text}`: parked, driving or a number from 0 to 1"))
}

impl StateArgs {
    /// Roll as it was given [rad].
    pub fn roll(&self) -> f64 {
        self.roll
    }

    /// Pitch as it was given [rad].
    pub fn pitch(&self) -> f64 {
        self.pitch
    }

    /// The state, not yet checked.
    pub fn state(&self) -> State {
        State {
            velocity: self.velocity.unwrap_or([self.speed.unwrap_or(0.0), 0.0, 0.0]),
            current: self.current.unwrap_or_default(),
            angular_velocity: self.angular.unwrap_or_default(),
            acceleration: self.acceleration.unwrap_or_default(),
            angular_acceleration: self.angular_acceleration.unwrap_or_default(),
            gravity: gravity(self.roll, self.pitch),
            depth: self.depth.unwrap_or(f32::NAN),
            water_level: self.water_level,
            bed_clearance: self.bed_clearance,
            bed: self.bed,
            density: self.density,
            dry_contact: self.ground_contact == Contact::Dry,
            heading: self.heading,
            depth_rate: self.depth_rate,
            wheel_speeds: self.wheel_speeds,
            time_step: 0.0,
            implicit_added_mass: self.implicit_added_mass,
            physics: self.physics.map(Physics::from),
            jacobian: self.jacobian,
            wave_vector: self.wave_vector.unwrap_or_default(),
            wave_amplitude: self.wave_amplitude.unwrap_or(0.0),
            wave_phase: self.wave_phase,
            wheel_levels: self.wheel_levels,
            current_exponent: self.current_exponent,
        }
    }
}

/// The direction of gravity in the body frame.
fn gravity(roll: f64, pitch: f64) -> [f32; 3] {
    single(&-up_from_roll_pitch(roll, pitch).into_inner())
}

/// One number a wheel with commas between.
fn per_wheel(text: &str) -> Result<PerWheel<f32>, String> {
    let values =
        list(text).map_err(|error| format!("{error}: one number a wheel is needed, such as 3,3.5"))?;
    PerWheel::new(&values).ok_or_else(|| format!("{} numbers, {MAX_WHEELS} wheels at most", values.len()))
}

fn list(text: &str) -> Result<Vec<f32>, std::num::ParseFloatError> {
    text.split(',').map(|number| number.trim().parse()).collect()
}

/// So many numbers with commas between.
fn numbers<const COUNT: usize>(text: &str) -> Result<[f32; COUNT], String> {
    let values = list(text);
    let values = values.map_err(|error| format!("{error}: {COUNT} numbers such as 0.5,0,-0.1 are needed"))?;
    <[f32; COUNT]>::try_from(values).map_err(|values| format!("{} numbers, {COUNT} are needed", values.len()))
}
