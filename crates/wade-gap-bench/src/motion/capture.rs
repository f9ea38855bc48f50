//! What is recorded of a motion: the pose by cameras, processed as the source paper does, and the force of the drive.

use nalgebra::UnitQuaternion;

use super::case::Flaw;
use super::cause::{Cause, Planted};
use super::command::Command;
use super::dynamics::{CAMERA_RATE, Instant, SUBSTEPS};
use crate::noise::rounded;
use crate::{Gaussian, Simulator, State};
use wade_core::frame::Vec3;
use wade_learn::random::Random;
use wade_learn::recordings::{Kinematics, MocapConfig, Recording, Rig, process};
use wade_learn::trials::{acceleration, derivative};

/// Of the samples after the processing, one in three is kept: 37 Hz.
const THINNED: usize = 3;
/// Standard deviation of a sample of the drive's force [N] and moment [N m]: chosen, half a per cent of 400 N.
const DRIVE_NOISE: [f64; 2] = [2.0, 1.0];
/// Standard deviation of colored noise of the drive over that of white noise, and its time constant [s].
const COLORED: (f64, f64) = (6.0, 0.3);
/// Quantum of a rounded drive over the standard deviation of its noise.
const QUANTUM: f64 = 8.0;
/// Standard deviation of a stamp of a clock that jitters [s].
const JITTER: f64 = 3e-4;
/// Share of pictures that are lost one by one, chance that a picture begins a hole, and its longest duration [s].
const LOST: (f64, f64, f64) = (0.02, 0.002, 0.3);
/// Standard deviation of a wheel's speed [rad/s].
const WHEEL_NOISE: f64 = 0.05;

/// What records.
#[derive(Debug, Clone, Copy)]
pub(super) struct Instruments<'a> {
    /// Standard deviation of a coordinate [m] and of an angle [rad] in a picture.
    pub marker: f64,
    pub flaw: Flaw,
    /// What is hidden; faults act here.
    pub planted: &'a [Planted],
    /// Mass as it is stated [kg].
    pub mass: f64,
    pub yaw_inertia: f64,
}

/// The record of one trial.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Record {
    pub states: Vec<State>,
    /// Force [N] and moment [N m] of the drive, a value a sample.
    pub drive: [Vec<f64>; 2],
    /// Force along x [N] and moment about z [N m] inferred from the exact motion less the prediction for the exact state.
    pub change: Vec<[f64; 2]>,
}

impl Instruments<'_> {
    fn size_of(&self, cause: Cause) -> f64 {
        self.planted.iter().find(|planted| planted.cause == cause).map_or(0.0, |planted| planted.size)
    }

    /// Delay of the pose in steps of the integration, so that it is exact.
    fn pose_delay(&self) -> usize {
        (self.size_of(Cause::PoseDelay) * CAMERA_RATE * SUBSTEPS as f64).round() as usize
    }

    /// Records a motion; `None` where it is too short for the filter.
    pub fn record(
        &self,
        command: &Command,
        instants: &[Instant],
        simulator: &Simulator,
        random: &mut Random,
    ) -> Option<Record> {
        let (mut cameras, mut drive, mut wheels) = (random.fork(), random.fork(), random.fork());
        let recording = self.pictures(instants, simulator, &mut cameras);
        let rig = Rig {
            center_of_mass_from_marker: Vec3::zeros(),
            origin_from_marker: Vec3::zeros(),
            z0: simulator.hull.z0,
            water_level: command.depth,
        };
        let motion = process(&recording, &rig, &MocapConfig::default()).ok()?;
        let states = states(&motion, instants, &mut wheels);
        let times: Vec<f64> = states.iter().map(|state| state.t).collect();
        let change = times.iter().map(|&t| self.change(command, instants, simulator, t)).collect();
        Some(Record { drive: self.drive(command, &times, &mut drive), states, change })
    }

    /// Poses with the errors of the cameras. The bed is at altitude 0.
    fn pictures(&self, instants: &[Instant], simulator: &Simulator, random: &mut Random) -> Recording {
        let mut gaussian = Gaussian::new(random.fork());
        let mut lost = random.fork();
        let late = self.pose_delay();
        let mut recording = Recording { t: Vec::new(), position: Vec::new(), rotation: Vec::new() };
        let mut missing_until = 0;
        for index in 0..instants.len().div_ceil(SUBSTEPS) {
            let state = &instants[(index * SUBSTEPS).saturating_sub(late)].state;
            let mut noise = || self.marker * gaussian.draw();
            let [x, y] = state.place;
            let position = Vec3::new(x + noise(), y + noise(), noise() - simulator.hull.z0);
            let rotation = UnitQuaternion::from_euler_angles(noise(), noise(), state.attitude[2] + noise());
            let stamp = if self.flaw == Flaw::JitteredClock { JITTER * gaussian.draw() } else { 0.0 };
            if self.flaw == Flaw::LostRows {
                let (one_by_one, hole, longest) = LOST;
                if lost.unit() < hole {
                    missing_until = index + (lost.unit() * longest * CAMERA_RATE) as usize;
                }
                if lost.unit() < one_by_one || index < missing_until {
                    continue;
                }
            }
            recording.t.push(index as f64 / CAMERA_RATE + stamp);
            recording.position.push(position);
            recording.rotation.push(rotation);
        }
        recording
    }

    /// The drive as its channel says it without noise.
    fn channel(&self, command: &Command, t: f64) -> [f64; 2] {
        let [force, moment] = command.drive_at(t - self.size_of(Cause::DriveDelay));
        let gain = 1.0 + self.size_of(Cause::DriveGain);
        [force / gain + self.size_of(Cause::DriveOffset), moment / gain]
    }

    fn drive(&self, command: &Command, times: &[f64], random: &mut Random) -> [Vec<f64>; 2] {
        [0, 1].map(|axis| {
            let mut gaussian = Gaussian::new(random.fork());
            let (size, memory) = COLORED;
            let is_colored = self.flaw == Flaw::ColoredDrive;
            let std = DRIVE_NOISE[axis] * if is_colored { size } else { 1.0 };
            let mut last = gaussian.draw();
            let mut before = times.first().copied().unwrap_or_default();
            let noise = times.iter().map(|&t| {
                let kept = if is_colored { (-(t - before) / memory).exp() } else { 0.0 };
                (last, before) = (last * kept + gaussian.draw() * (1.0 - kept * kept).sqrt(), t);
                std * last
            });
            let values = noise.zip(times).map(|(noise, &t)| self.channel(command, t)[axis] + noise);
            match self.flaw {
                Flaw::QuantizedDrive => values.map(|v| rounded(v, QUANTUM * DRIVE_NOISE[axis])).collect(),
                _ => values.collect::<Vec<_>>(),
            }
        })
    }

    /// The exact change at a time, linear between steps of the integration.
    pub fn change(&self, command: &Command, instants: &[Instant], simulator: &Simulator, t: f64) -> [f64; 2] {
        let place = (t * CAMERA_RATE * SUBSTEPS as f64).clamp(0.0, (instants.len() - 1) as f64);
        let below = (place as usize).min(instants.len() - 2);
        let channel = self.channel(command, t);
        let at = |index: usize| {
            let Instant { state, .. } = &instants[index.saturating_sub(self.pose_delay())];
            let predicted = simulator.predict(state);
            [
                self.mass * state.acceleration.x - predicted[0],
                self.yaw_inertia * state.angular_acceleration.z - predicted[5],
            ]
        };
        let (first, last, share) = (at(below), at(below + 1), place - below as f64);
        [0, 1].map(|axis| first[axis] + share * (last[axis] - first[axis]) - channel[axis])
    }
}

/// Samples of the processed pose, and wheel speeds with noise.
fn states(motion: &Kinematics, instants: &[Instant], random: &mut Random) -> Vec<State> {
    let acceleration = acceleration(&motion.t, &motion.velocity, &motion.angular_velocity);
    let angular_acceleration = derivative(&motion.t, &motion.angular_velocity);
    let mut gaussian = Gaussian::new(random.fork());
    let sample = |i: usize| {
        // as the file will have it
        let t = (motion.t[i] * 1e7).round() / 1e7;
        let nearest = (t * CAMERA_RATE * SUBSTEPS as f64).round() as usize;
        let wheels = instants[nearest.min(instants.len() - 1)].state.wheels;
        State {
            t,
            velocity: motion.velocity[i],
            angular_velocity: motion.angular_velocity[i],
            acceleration: acceleration[i],
            angular_acceleration: angular_acceleration[i],
            attitude: motion.attitude[i].into(),
            depth: motion.depth[i],
            wheels: wheels.map(|speed| speed + WHEEL_NOISE * gaussian.draw()),
            ..State::default()
        }
    };
    (0..motion.t.len()).step_by(THINNED).map(sample).collect()
}
