//! The exact motion: surge, sway and yaw under drive, tires and water, by Runge and Kutta's method of fourth order.
//!
//! `m (du/dt - r v) = X`, `m (dv/dt + r u) = Y`, `I dr/dt = N` with the water's wrench at the accelerations themselves: what
//! is proportional to them, the water that moves with the hull and the wheels that spin, stands on the left.

use nalgebra::{Matrix3, SVector, Vector3};

use super::cause::{Cause, Planted};
use super::command::Command;
use super::yaw_inertia;
use crate::hidden::{MEMORY_DRAFT, MEMORY_RATIO, Setting, momenta, rolling_resistance};
use crate::track::CHANNEL;
use crate::{Simulator, State, Wrench6};
use wade_core::frame::{GRAVITY, Vec3};

/// Pictures a second [Hz].
pub(super) const CAMERA_RATE: f64 = 111.0;
/// Steps of the integration from picture to picture.
pub(super) const SUBSTEPS: usize = 4;
/// Force against sideways motion of the tires [N s/m]: chosen, so that a turn at 0.5 rad/s slips by a few degrees.
const SIDE_CREEP: f64 = 2000.0;
/// Distance of the driven wheels from the middle [m].
const HALF_TRACK: f64 = 0.35;

/// x, y, yaw, u, v, r; force and moment of a drive that lags; the memory of waves, surge and sway, real and imaginary.
type Motion = SVector<f64, 12>;
const U: usize = 3;
const R: usize = 5;
const LAG: usize = 6;
const MEMORY: usize = 8;

/// An instant of the exact motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Instant {
    pub state: State,
    /// Force [N] and moment [N m] of the drive on the body.
    pub drive: [f64; 2],
    /// Wrench of the water along x [N] and about z [N m].
    pub water: [f64; 2],
}

/// What moves.
pub(super) struct Vehicle<'a> {
    pub simulator: Simulator<'a>,
    /// What is hidden and changes the motion.
    pub planted: &'a [Planted],
    /// Friction of the bearings, the same on dry ground [N].
    pub friction: f64,
}

/// What does not change in a trial.
struct Fixed<'a> {
    command: &'a Command,
    /// Load that the wheels bear: the weight less the buoyancy of the prediction [N].
    wheel_load: f64,
    /// Force of the blockage by surge velocity [N].
    blockage: Option<Table>,
}

/// A function of the surge velocity, cubic between even velocities (Catmull and Rom).
///
/// One-dimensional flow past a body chokes with an infinite slope, on which no step of an integration is small enough.
struct Table(Vec<f64>);

/// Largest velocity of a table, and its step [m/s].
const TABLE: [f64; 2] = [4.0, 0.04];

impl Table {
    fn new(of: impl Fn(f64) -> f64) -> Self {
        let [most, step] = TABLE;
        let count = (2.0 * most / step).round() as usize + 1;
        Self((0..count).map(|i| of(i as f64 * step - most)).collect())
    }

    fn at(&self, velocity: f64) -> f64 {
        let [most, step] = TABLE;
        let place = ((velocity + most) / step).clamp(1.0, self.0.len() as f64 - 2.0 - 1e-9);
        let (below, s) = (place as usize, place.fract());
        let [p0, p1, p2, p3] = [0, 1, 2, 3].map(|i| self.0[below + i - 1]);
        0.5 * (2.0 * p1
            + (p2 - p0) * s
            + (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) * (s * s)
            + (3.0 * p1 - p0 - 3.0 * p2 + p3) * (s * s * s))
    }
}

/// What acts in an instant.
struct Acting {
    drive: [f64; 2],
    /// Load of the water in the plane but for what is proportional to acceleration [N, N m].
    water: Vector3<f64>,
    /// Mass of the water that moves with the hull [kg, kg m2].
    added: Matrix3<f64>,
    /// Rate of the velocities [m/s2, rad/s2].
    rate: Vector3<f64>,
}

impl Vehicle<'_> {
    /// The motion at even instants, `substeps` of the integration to a picture.
    pub fn drive(&self, command: &Command, substeps: usize) -> Vec<Instant> {
        let step = 1.0 / (CAMERA_RATE * substeps as f64);
        let count = (command.duration * CAMERA_RATE) as usize * substeps + 1;
        let fixed = self.fixed(command);
        let mut motion = self.start(command);
        let mut instants = Vec::with_capacity(count);
        for index in 0..count {
            let t = index as f64 * step;
            instants.push(self.instant(&fixed, t, &motion));
            let rate = |t: f64, motion: &Motion| self.rate(&fixed, t, motion);
            let k1 = rate(t, &motion);
            let k2 = rate(t + 0.5 * step, &(motion + k1 * (0.5 * step)));
            let k3 = rate(t + 0.5 * step, &(motion + k2 * (0.5 * step)));
            let k4 = rate(t + step, &(motion + k3 * step));
            motion += (k1 + 2.0 * k2 + 2.0 * k3 + k4) * (step / 6.0);
        }
        instants
    }

    fn size_of(&self, cause: Cause) -> Option<f64> {
        self.planted.iter().find(|planted| planted.cause == cause).map(|planted| planted.size)
    }

    fn memory(&self) -> Option<&Planted> {
        self.planted.iter().find(|planted| planted.cause == Cause::WaveMemory)
    }

    fn fixed<'b>(&self, command: &'b Command) -> Fixed<'b> {
        let level = State { depth: command.depth, ..State::default() };
        let setting = self.setting(command);
        let blockage = self.planted.iter().find(|planted| planted.cause == Cause::ChannelBlockage);
        let blockage = blockage.and_then(Planted::hidden).map(|hidden| {
            let at = |velocity: f64| State { velocity: Vec3::x() * velocity, ..level };
            Table::new(|velocity| hidden.load(&setting, CHANNEL, &at(velocity))[0])
        });
        let wheel_load = self.simulator.hull.mass * GRAVITY - self.simulator.predict(&level)[2];
        Fixed { command, wheel_load, blockage }
    }

    fn setting(&self, command: &Command) -> Setting<'_> {
        Setting { simulator: self.simulator, session: command.duration }
    }

    fn start(&self, command: &Command) -> Motion {
        let mut motion = Motion::zeros();
        motion[2] = command.heading;
        motion[U] = command.speed;
        // the memory of a steady speed: its integral is that of the kernel, 1 / (a - i b)
        if let Some(Planted { shape: [a, b, _], .. }) = self.memory() {
            let scale = command.speed / (a * a + b * b);
            (motion[MEMORY], motion[MEMORY + 1]) = (a * scale, b * scale);
        }
        motion
    }

    fn state(&self, command: &Command, t: f64, motion: &Motion) -> State {
        let (surge, turning) = (motion[U], motion[R]);
        let radius = self.simulator.hull.wheel[0];
        let wheel = |side: f64| (surge - side * HALF_TRACK * turning) / radius;
        State {
            t,
            velocity: Vec3::new(surge, motion[U + 1], 0.0),
            angular_velocity: Vec3::z() * turning,
            attitude: [0.0, 0.0, motion[2]],
            place: [motion[0], motion[1]],
            depth: command.depth,
            wheels: [1.0, -1.0, 1.0, -1.0].map(wheel),
            ..State::default()
        }
    }

    fn acting(&self, fixed: &Fixed, state: &State, motion: &Motion) -> Acting {
        let (hull, command) = (self.simulator.hull, fixed.command);
        let commanded = command.drive_at(state.t);
        let is_late = self.size_of(Cause::DriveLag).is_some();
        let drive = if is_late { [motion[LAG], motion[LAG + 1]] } else { commanded };
        let setting = self.setting(command);
        let mut water = planar(&self.simulator.drag_share(state));
        match &fixed.blockage {
            Some(blockage) => water.x += blockage.at(state.velocity.x),
            None => {
                let hidden = self.planted.iter().filter_map(Planted::hidden);
                hidden.for_each(|hidden| water += planar(&hidden.load(&setting, CHANNEL, state)));
            }
        }
        if let Some(planted) = self.memory() {
            water += remembered(planted, command.depth, motion);
        }
        let (added, bias) = self.added_mass(state);
        water += bias;
        let mut load = water + Vector3::new(drive[0], -SIDE_CREEP * state.velocity.y, drive[1]);
        if let Some(coefficient) = self.size_of(Cause::RollingResistance) {
            load.x += rolling_resistance(coefficient, fixed.wheel_load, state)[0];
        }
        load.x += rolling_resistance(1.0, self.friction, state)[0];
        let (m, v, r) = (hull.mass, state.velocity, state.angular_velocity.z);
        let mut mass = Matrix3::from_diagonal(&Vector3::new(m, m, yaw_inertia(hull))) + added;
        if let Some(spinning) = self.size_of(Cause::DrivetrainInertia) {
            mass[(0, 0)] += spinning;
            mass[(2, 2)] += spinning * HALF_TRACK * HALF_TRACK;
        }
        let turned = Vector3::new(m * r * v.y, -m * r * v.x, 0.0);
        // positive definite: two masses and a moment of inertia, and what can only add to them
        let rate = mass.lu().solve(&(load + turned)).unwrap_or_default();
        Acting { drive, water, added, rate }
    }

    /// Kirchhoff's equations in the plane: what is proportional to the rates, and the rest.
    fn added_mass(&self, state: &State) -> (Matrix3<f64>, Vector3<f64>) {
        let Some(size) = self.size_of(Cause::AddedMass) else {
            return Default::default();
        };
        let hull = self.simulator.hull;
        let (v, omega) = (state.velocity, state.angular_velocity);
        let unit = |axis: usize| {
            let still = State { velocity: Vec3::zeros(), angular_velocity: Vec3::zeros(), ..*state };
            let (p, q) = momenta(
                hull,
                &match axis {
                    2 => State { angular_velocity: Vec3::z(), ..still },
                    _ => State { velocity: Vec3::ith(axis, 1.0), ..still },
                },
            );
            Vector3::new(p.x, p.y, q.z) * size
        };
        let (p, q) = momenta(hull, state);
        let (force, moment) = (-omega.cross(&p), -(omega.cross(&q) + v.cross(&p)));
        let bias = Vector3::new(force.x, force.y, moment.z) * size;
        (Matrix3::from_columns(&[unit(0), unit(1), unit(2)]), bias)
    }

    fn rate(&self, fixed: &Fixed, t: f64, motion: &Motion) -> Motion {
        let command = fixed.command;
        let state = self.state(command, t, motion);
        let acting = self.acting(fixed, &state, motion);
        let (sine, cosine) = motion[2].sin_cos();
        let v = state.velocity;
        let mut rate = Motion::zeros();
        rate[0] = v.x * cosine - v.y * sine;
        rate[1] = v.x * sine + v.y * cosine;
        rate[2] = motion[R];
        rate.fixed_rows_mut::<3>(U).copy_from(&acting.rate);
        if let Some(lag) = self.size_of(Cause::DriveLag) {
            let commanded = command.drive_at(t);
            (0..2).for_each(|axis| rate[LAG + axis] = (commanded[axis] - motion[LAG + axis]) / lag);
        }
        if let Some(Planted { shape: [a, b, _], .. }) = self.memory() {
            // z' = (-a + i b) z + v, whose solution is the integral of exp((-a + i b) s) v(t - s)
            for (axis, speed) in [v.x, v.y].into_iter().enumerate() {
                let [re, im] = [0, 1].map(|part| motion[MEMORY + 2 * axis + part]);
                rate[MEMORY + 2 * axis] = -a * re - b * im + speed;
                rate[MEMORY + 2 * axis + 1] = b * re - a * im;
            }
        }
        rate
    }

    fn instant(&self, fixed: &Fixed, t: f64, motion: &Motion) -> Instant {
        let state = self.state(fixed.command, t, motion);
        let acting = self.acting(fixed, &state, motion);
        let (rate, v, r) = (acting.rate, state.velocity, state.angular_velocity.z);
        let water = acting.water - acting.added * rate;
        Instant {
            state: State {
                acceleration: Vec3::new(rate.x - r * v.y, rate.y + r * v.x, 0.0),
                angular_acceleration: Vec3::z() * rate.z,
                ..state
            },
            drive: acting.drive,
            water: [water.x, water.z],
        }
    }
}

/// Forces along x and y and the moment about z.
fn planar(wrench: &Wrench6) -> Vector3<f64> {
    Vector3::new(wrench[0], wrench[1], wrench[5])
}

/// `-K0 int_0^inf k(s) v(t - s) ds` with `k = exp(-a s) (cos b s - a / b sin b s)`, as `hidden::memory` has it.
fn remembered(planted: &Planted, depth: f64, motion: &Motion) -> Vector3<f64> {
    let [a, b, _] = planted.shape;
    let draft = depth.max(0.0);
    let of = |axis: usize| {
        let [re, im] = [0, 1].map(|part| motion[MEMORY + 2 * axis + part]);
        -(re - a / b * im) * MEMORY_RATIO[axis] * planted.size * draft / MEMORY_DRAFT
    };
    Vector3::new(of(0), of(1), 0.0)
}
