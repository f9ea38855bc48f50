//! The exact motion of one trial: a rigid vehicle that stays on the ground of a channel with a ramp.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

use super::super::mocap::Rig;
use super::CENTER_OF_MASS_FROM_MARKER;
use super::schedule::{Direction, Planned};
use crate::random::Random;
use wade_core::frame::Vec3;
use wade_core::vehicle::Vehicle;

/// Slope of the ramps, rise over run: chosen, the paper does not state it.
const SLOPE: f64 = 0.14;
/// Length over which slope turns into flat under the wheels: about the Warthog's wheelbase [m].
const BEND: f64 = 0.9;
/// Heading of the angled trials [rad]: chosen.
const ANGLE: f64 = 0.35;
/// Largest acceleration [m/s2]: chosen.
const ACCELERATION: f64 = 3.0;
/// Largest slope of a smooth step over its mean slope.
const STEEPEST: f64 = 1.875;
/// How long water takes to slow a vehicle that drives in [s]: chosen, 800 N on 280 kg.
const SLOWING: f64 = 0.5;
/// Command minus speed, over speed squared and depth [s/m2]: takes the fastest command of 4.952 m/s at 4 inches to the
/// paper's fastest section of 3.78 m/s.
const DROOP: f64 = 0.082 / 0.1016;
/// Shortest and longest flat piece that the cameras see [m]: chosen so that some trials show too little.
const SEEN: [f64; 2] = [0.3, 5.0];
/// How much of the ramp beyond the water's edge the cameras see [m].
const SEEN_DRY: f64 = 2.0;
/// Half the interval for derivatives of the exact pose [s]: errors of 1e-9.
const INSTANT: f64 = 1e-5;

/// Step from 0 to 1 between 0 and 1 with two continuous derivatives.
fn step(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
}

/// Integral of `step` from 0.
fn step_integral(u: f64) -> f64 {
    let v = u.clamp(0.0, 1.0);
    v.powi(4) * (2.5 - 3.0 * v + v * v) + (u - 1.0).max(0.0)
}

/// A change of speed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Change {
    /// When it begins [s].
    start: f64,
    /// How long it takes [s].
    duration: f64,
    /// By how much [m/s].
    by: f64,
}

impl Change {
    fn distance(&self, t: f64) -> f64 {
        self.by * self.duration * step_integral((t - self.start) / self.duration)
    }
}

/// One trial: at rest, then driving straight, over a ramp at one side of x = 0 and flat ground at altitude 0 on the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// First and last instant that the cameras see [s].
    pub seen: [f64; 2],
    /// 1 where the ramp lies ahead, -1 where it lies behind.
    ramp: f64,
    heading: f64,
    start_x: f64,
    changes: Vec<Change>,
    rig: Rig,
}

/// The motion at an instant, in the terms of a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Velocity of the center of mass, body frame [m/s].
    pub velocity: Vec3,
    /// Angular velocity, body frame [rad/s].
    pub angular_velocity: Vec3,
    /// Water surface above the ground-contact plane at the body origin [m].
    pub depth: f64,
}

impl Run {
    /// Plans the motion of a trial; how much of the flat ground is seen is random.
    pub fn new(planned: &Planned, vehicle: &Vehicle, random: &mut Random) -> Self {
        let marker = Vec3::from(CENTER_OF_MASS_FROM_MARKER);
        let rig = Rig::new(marker, vehicle, planned.depth);
        let seen_flat = SEEN[0] + (SEEN[1] - SEEN[0]) * random.unit();
        let heading = if planned.direction == Direction::RampInAngle { ANGLE } else { 0.0 };
        // speed + droop speed^2 = command
        let droop = DROOP * planned.depth;
        let in_water = ((1.0 + 4.0 * droop * planned.command).sqrt() - 1.0) / (2.0 * droop);
        let waterline = planned.depth / SLOPE;
        let started =
            |speed: f64| Change { start: 0.3, duration: STEEPEST * speed / ACCELERATION, by: speed };
        let run_up = |change: &Change| 0.5 * change.by * change.duration;
        match planned.direction {
            Direction::RampIn | Direction::RampInAngle => {
                let start = started(planned.command);
                let start_x = -waterline - (run_up(&start) + 0.5) * heading.cos();
                let mut run =
                    Self { seen: [0.0; 2], ramp: -1.0, heading, start_x, changes: vec![start], rig };
                let slowing =
                    Change { start: run.when(-waterline), duration: SLOWING, by: in_water - planned.command };
                run.changes.push(slowing);
                run.seen = [run.when(-waterline - SEEN_DRY), run.when(seen_flat)];
                run
            }
            Direction::RampOut => {
                let start = started(in_water);
                let start_x = -run_up(&start) - 0.5 - random.unit();
                let mut run = Self { seen: [0.0; 2], ramp: 1.0, heading, start_x, changes: vec![start], rig };
                run.seen = [run.when(-seen_flat), run.when(waterline + SEEN_DRY)];
                run
            }
        }
    }

    /// Where the marker is, and the rotation `world_from_body`.
    pub fn marker_pose(&self, t: f64) -> (Vec3, UnitQuaternion<f64>) {
        let traveled: f64 = self.changes.iter().map(|change| change.distance(t)).sum();
        let (sine, cosine) = self.heading.sin_cos();
        let x = self.start_x + traveled * cosine;
        let slope = self.slope(x);
        let ground = Vec3::new(x, traveled * sine, self.altitude(x));
        let forward = Vec3::new(cosine, sine, slope * cosine).normalize();
        let up = Vec3::new(-slope, 0.0, 1.0).normalize();
        let axes = Matrix3::from_columns(&[forward, up.cross(&forward), up]);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        let marker = ground + rotation * (Vec3::z() * -self.rig.z0 - self.rig.origin_from_marker);
        (marker, rotation)
    }

    /// The exact motion.
    pub fn motion(&self, t: f64) -> Motion {
        let (marker, rotation) = self.marker_pose(t);
        let [(before, _), (after, _)] = [t - INSTANT, t + INSTANT].map(|t| self.center_of_mass(t));
        let turned = self.marker_pose(t - INSTANT).1.inverse() * self.marker_pose(t + INSTANT).1;
        Motion {
            velocity: rotation.inverse() * (after - before) / (2.0 * INSTANT),
            angular_velocity: turned.scaled_axis() / (2.0 * INSTANT),
            depth: self.rig.depth(marker.z, &rotation),
        }
    }

    fn center_of_mass(&self, t: f64) -> (Vec3, UnitQuaternion<f64>) {
        let (marker, rotation) = self.marker_pose(t);
        (marker + rotation * self.rig.center_of_mass_from_marker, rotation)
    }

    /// Altitude of the ground [m]: the integral of `slope`, 0 on the flat.
    fn altitude(&self, x: f64) -> f64 {
        SLOPE * BEND * step_integral(self.ramp * x / BEND + 0.5)
    }

    /// Rise of the ground over x.
    fn slope(&self, x: f64) -> f64 {
        self.ramp * SLOPE * step(self.ramp * x / BEND + 0.5)
    }

    /// When the vehicle has come to a place that lies ahead of its start [s].
    fn when(&self, x: f64) -> f64 {
        let traveled = |t: f64| self.changes.iter().map(|change| change.distance(t)).sum::<f64>();
        let target = (x - self.start_x) / self.heading.cos();
        let (mut low, mut high) = (0.0, 1e3);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if traveled(middle) < target { low = middle } else { high = middle }
        }
        low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_integral_of_the_step_has_the_step_as_its_slope() {
        for u in [-0.5, 0.1, 0.5, 0.93, 1.4] {
            let slope = (step_integral(u + 1e-6) - step_integral(u - 1e-6)) * 5e5;
            assert!((slope - step(u)).abs() < 1e-8, "{u}");
        }
        assert!((step_integral(1.0) - 0.5).abs() < 1e-15);
    }
}
