//! States as they travel, for tests of the contract and above.
#![allow(dead_code, reason = "every test binary uses a part")]

use wade_wire::State;

use super::bundles::{Drawn, Numbers};

impl From<Drawn> for State {
    fn from(drawn: Drawn) -> Self {
        Self {
            velocity: drawn.velocity,
            current: drawn.current,
            angular_velocity: drawn.angular_velocity,
            acceleration: drawn.acceleration,
            angular_acceleration: drawn.angular_acceleration,
            gravity: drawn.gravity,
            depth: drawn.depth,
            density: drawn.density,
            dry_contact: drawn.dry_contact,
            heading: Some(drawn.heading),
            depth_rate: Some(drawn.depth_rate),
            wheel_speeds: Some(drawn.wheel_speeds.into()),
            time_step: drawn.time_step,
            implicit_added_mass: false,
            ..Self::default()
        }
    }
}

impl Numbers {
    pub fn state(&mut self) -> State {
        self.drawn().into()
    }
}
