//! A state from the command line.

use anyhow::Result;
use clap::{Args, ValueEnum};
use wade::frame::up_from_roll_pitch;
use wade::service::grpc::single;
use wade::service::wire::State;

/// The state of the vehicle, SI units, radians, body frame (x forward, y left, z up).
#[derive(Debug, Args)]
pub struct StateArgs {
    /// Speed straight ahead [m/s]
    #[arg(long, allow_negative_numbers = true, conflicts_with = "velocity")]
    speed: Option<f32>,
    /// Velocity over ground [m/s]
    #[arg(long, value_name = "VX,VY,VZ", value_parser = vector, allow_hyphen_values = true)]
    velocity: Option<[f32; 3]>,
    /// Angular velocity [rad/s]
    #[arg(long, value_name = "WX,WY,WZ", value_parser = vector, allow_hyphen_values = true)]
    angular: Option<[f32; 3]>,
    /// Water surface above the ground under the vehicle [m]
    #[arg(long, allow_negative_numbers = true)]
    depth: f32,
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
    #[arg(long, value_name = "CX,CY,CZ", value_parser = vector, allow_hyphen_values = true)]
    current: Option<[f32; 3]>,
    /// Acceleration [m/s2]
    #[arg(long, value_name = "AX,AY,AZ", value_parser = vector, allow_hyphen_values = true)]
    acceleration: Option<[f32; 3]>,
    /// Angular acceleration [rad/s2]
    #[arg(long, value_name = "AX,AY,AZ", value_parser = vector, allow_hyphen_values = true)]
    angular_acceleration: Option<[f32; 3]>,
    /// Whether water reaches under the tires
    #[arg(long, value_enum, default_value_t = Contact::Wetted)]
    ground_contact: Contact,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Contact {
    /// Full Archimedes
    Wetted,
    /// No pressure under the contact patches
    Dry,
}

impl StateArgs {
    /// The state, not yet checked.
    pub fn state(&self) -> State {
        State {
            velocity: self.velocity.unwrap_or([self.speed.unwrap_or(0.0), 0.0, 0.0]),
            current: self.current.unwrap_or_default(),
            angular_velocity: self.angular.unwrap_or_default(),
            acceleration: self.acceleration.unwrap_or_default(),
            angular_acceleration: self.angular_acceleration.unwrap_or_default(),
            gravity: gravity(self.roll, self.pitch),
            depth: self.depth,
            density: self.density,
            dry_contact: self.ground_contact == Contact::Dry,
        }
    }
}

/// The direction of gravity in the body frame.
fn gravity(roll: f64, pitch: f64) -> [f32; 3] {
    single(&-up_from_roll_pitch(roll, pitch).into_inner())
}

/// Three numbers with commas between.
pub fn vector(text: &str) -> Result<[f32; 3], String> {
    let values: Result<Vec<f32>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    let values = values.map_err(|error| format!("{error}: three numbers such as 0.5,0,-0.1 are needed"))?;
    <[f32; 3]>::try_from(values).map_err(|values| format!("{} numbers, three are needed", values.len()))
}
