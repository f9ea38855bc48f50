//! The exact motion of a trial.

use super::Wrench6;
use super::profile::Profile;
use wade_core::condition::Condition;
use wade_core::frame::{Vec3, up_from_roll_pitch};
use wade_learn::recordings::generated::{Motion as RunMotion, Run};

/// Density of the water of all generated trials [kg/m3].
pub(super) const DENSITY: f64 = 1000.0;
/// Width of the channel of most trials [m].
pub(super) const CHANNEL: f64 = 3.0;
/// Half the interval for accelerations of a run, whose velocity is known to 1e-10 m/s [s].
const INSTANT: f64 = 1e-3;

/// An instant; vectors in the body frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// Time in the trial [s].
    pub t: f64,
    /// Velocity over ground [m/s].
    pub velocity: Vec3,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vec3,
    /// Acceleration in an inertial frame, `dv/dt + omega x v` [m/s2].
    pub acceleration: Vec3,
    /// Angular acceleration [rad/s2].
    pub angular_acceleration: Vec3,
    /// Roll, pitch, yaw [rad].
    pub attitude: [f64; 3],
    /// Place over the ground, world axes [m].
    pub place: [f64; 2],
    /// Undisturbed water surface above the ground-contact plane at the body origin [m].
    pub depth: f64,
    /// Wheel speeds [rad/s]: front left and right, rear left and right.
    pub wheels: [f64; 4],
    /// Known load on the sensor besides the water's.
    pub known_load: Wrench6,
}

impl State {
    /// The same for a query, in still water.
    pub fn condition(&self) -> Condition {
        Condition {
            angular_velocity: self.angular_velocity,
            acceleration: self.acceleration,
            angular_acceleration: self.angular_acceleration,
            density: DENSITY,
            up: up_from_roll_pitch(self.attitude[0], self.attitude[1]),
            ..Condition::level(self.velocity, self.depth)
        }
    }

    /// Depth Froude number `|v| / sqrt(g d)`; 0 on dry ground.
    pub fn froude(&self) -> f64 {
        if self.depth <= 0.0 {
            return 0.0;
        }
        self.velocity.norm() / (wade_core::frame::GRAVITY * self.depth).sqrt()
    }
}

/// The motion of one trial at even instants.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Name, which says that it is generated.
    pub name: String,
    /// When the trial began in the session [s].
    pub session_time: f64,
    /// Width of the channel [m].
    pub channel_width: f64,
    /// Time between samples [s].
    pub step: f64,
    /// The samples.
    pub states: Vec<State>,
}

/// A motion by its parts; the body is towed or drives, so every part is prescribed.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Motion {
    /// Velocity along the body's axes [m/s].
    pub surge: Profile,
    pub sway: Profile,
    /// Up [m]; the depth falls by as much.
    pub heave: Profile,
    /// Attitude [rad].
    pub roll: Profile,
    pub pitch: Profile,
    pub yaw: Profile,
    /// Wheel speed beyond that of rolling [rad/s].
    pub slip: Profile,
    /// Known forces hung on the sensor, along the body's axes [N].
    pub hung: [Profile; 3],
    /// Water depth where heave is 0 [m].
    pub depth: f64,
}

impl Motion {
    /// Samples the motion from 0 to `duration` [s].
    pub fn track(&self, name: String, duration: f64, rate: f64, wheel_radius: f64) -> Track {
        let count = (duration * rate) as usize + 1;
        let mut place = [0.0, 0.0];
        let states = (0..count).map(|index| {
            let state = self.state(index as f64 / rate, place, wheel_radius);
            let (sine, cosine) = state.attitude[2].sin_cos();
            place[0] += (state.velocity.x * cosine - state.velocity.y * sine) / rate;
            place[1] += (state.velocity.x * sine + state.velocity.y * cosine) / rate;
            state
        });
        let states = states.collect();
        Track { name, session_time: 0.0, channel_width: CHANNEL, step: 1.0 / rate, states }
    }

    fn known_load(&self, t: f64) -> Wrench6 {
        let [x, y, z] = [0, 1, 2].map(|axis| self.hung[axis].at(t)[0]);
        Wrench6::new(x, y, z, 0.0, 0.0, 0.0)
    }

    fn state(&self, t: f64, place: [f64; 2], wheel_radius: f64) -> State {
        let [surge, sway, heave] = [&self.surge, &self.sway, &self.heave].map(|profile| profile.at(t));
        let angles = [&self.roll, &self.pitch, &self.yaw].map(|profile| profile.at(t));
        // roll and pitch are small and never go with yaw, so that their rates are those of the body
        let velocity = Vec3::new(surge[0], sway[0], heave[1]);
        let angular_velocity = Vec3::from(angles.map(|angle| angle[1]));
        let rolling = surge[0] / wheel_radius + self.slip.at(t)[0];
        State {
            t,
            velocity,
            angular_velocity,
            acceleration: Vec3::new(surge[1], sway[1], heave[2]) + angular_velocity.cross(&velocity),
            angular_acceleration: Vec3::from(angles.map(|angle| angle[2])),
            attitude: angles.map(|angle| angle[0]),
            place,
            depth: self.depth - heave[0],
            wheels: [rolling; 4],
            known_load: self.known_load(t),
        }
    }
}

/// Samples what is seen of a run of the paper's schedule.
pub(super) fn of_run(name: &str, run: &Run, rate: f64, wheel_radius: f64) -> Track {
    let [first, last] = run.seen;
    let count = ((last - first) * rate) as usize + 1;
    let motion = |t: f64| run.motion(t);
    let states = (0..count).map(|index| {
        let t = first + index as f64 / rate;
        let RunMotion { velocity, angular_velocity, depth } = motion(t);
        let (before, after) = (motion(t - INSTANT), motion(t + INSTANT));
        let (marker, rotation) = run.marker_pose(t);
        let (roll, pitch, yaw) = rotation.euler_angles();
        let rate_of = |a: Vec3, b: Vec3| (b - a) / (2.0 * INSTANT);
        State {
            t: index as f64 / rate,
            velocity,
            angular_velocity,
            acceleration: rate_of(before.velocity, after.velocity) + angular_velocity.cross(&velocity),
            angular_acceleration: rate_of(before.angular_velocity, after.angular_velocity),
            attitude: [roll, pitch, yaw],
            place: [marker.x, marker.y],
            depth,
            wheels: [velocity.x / wheel_radius; 4],
            known_load: Wrench6::zeros(),
        }
    });
    let states = states.collect();
    Track { name: name.to_owned(), session_time: 0.0, channel_width: CHANNEL, step: 1.0 / rate, states }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_steady_turn_accelerates_towards_its_center() {
        let motion = Motion {
            surge: Profile::constant(2.0),
            yaw: Profile::default().step(0.0, 1.0, 0.5).step(1.0, 1.0, 0.5),
            depth: 0.2,
            ..Motion::default()
        };
        let track = motion.track("generated".into(), 2.0, 100.0, 0.3);
        for state in &track.states {
            let expected = state.angular_velocity.z * 2.0;
            assert!((state.acceleration - Vec3::y() * expected).norm() < 1e-12);
        }
        assert!((track.states[100].wheels[0] - 2.0 / 0.3).abs() < 1e-12);
    }
}
