//! The physical base, alone and below the shipped weights, in random states of the whole space: any attitude, dry to drowned,
//! up to 6 m/s and 3 rad/s.

use std::f64::consts::TAU;

use nalgebra::{UnitQuaternion, UnitVector3};
use wade_core::condition::Condition;
use wade_core::forces::Forces;
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::geometry::hydrostatics::{float_depth, surface_hydrostatics};
use wade_core::model::{Model, Workspace};
use wade_core::physics::{Base, BaseLoads, Memory, Motion, Physics};
use wade_core::vehicle::{MAX_SURFACES, Vehicle};
use wade_core::wrench::Wrench;

use crate::bodies::{bodies, radiation};
use crate::common::{VEHICLES, model};
use crate::random::Random;
use crate::release::{Release, turns};

const STATES: usize = 100_000;

pub struct Subject {
    pub vehicle: Vehicle,
    pub base: Base,
    /// Weights and base, of what is shipped.
    pub model: Option<Model>,
}

/// Room for answers.
#[derive(Default)]
struct Answer {
    base: BaseLoads,
    forces: Forces,
    workspace: Workspace,
}

pub fn subjects() -> &'static [Subject] {
    static ALL: std::sync::OnceLock<Vec<Subject>> = std::sync::OnceLock::new();
    ALL.get_or_init(|| {
        let subject = |vehicle: Vehicle| {
            let base = Base::new(&vehicle, radiation(&vehicle));
            Subject { vehicle, base, model: None }
        };
        let shipped = |name: &str| {
            let model = model(name);
            let base = model.base().expect("the shipped bundles have it").clone();
            let vehicle = Vehicle { name: format!("{name}, trained"), ..model.vehicle().clone() };
            Subject { vehicle, base, model: Some(model) }
        };
        bodies().into_iter().map(subject).chain(VEHICLES.map(shipped)).collect()
    })
}

impl Subject {
    fn weight(&self) -> f64 {
        self.vehicle.mass * GRAVITY
    }

    fn size(&self) -> f64 {
        let d = self.vehicle.dimensions;
        Vec3::new(d.length, d.width, d.height).norm()
    }

    /// A state anywhere, wet in most cases.
    pub fn random(&self, random: &mut Random) -> Condition {
        let up = random.direction();
        let half = 0.5 * self.size();
        let density = 1000.0 + 900.0 * random.unit();
        let velocity = random.direction() * (6.0 * random.unit());
        let current =
            if random.unit() < 0.5 { Vec3::zeros() } else { random.direction() * (2.0 * random.unit()) };
        Condition {
            velocity,
            ground_velocity: velocity + current,
            angular_velocity: random.direction() * (3.0 * random.unit()),
            up: UnitVector3::new_normalize(up),
            water_level: Some(half * (3.0 * random.unit() - 1.2)),
            bed_clearance: (random.unit() < 0.5).then(|| 1.5 * random.unit() * half),
            density,
            ..Condition::level(velocity, 0.0)
        }
    }

    /// Load of still water and the rest, about the body origin.
    fn loads(&self, state: &Condition, speeds: &[f64], physics: Physics, out: &mut Answer) -> [Wrench; 2] {
        let motion = Motion {
            wheel_speeds: speeds,
            time_step: 0.0,
            implicit_added_mass: false,
            physics,
            waters: None,
        };
        self.base.evaluate(state, &motion, None, &mut out.base);
        let still = out.base.surfaces.iter().fold(Wrench::default(), |sum, s| sum + s.hydrostatic);
        let moving = match &self.model {
            None => out.base.surfaces.iter().fold(out.base.hull, |sum, s| sum + s.drag),
            Some(model) => {
                model.evaluate_moving(state, (&motion, None), &mut out.workspace, &mut out.forces);
                let about = &self.vehicle.center_of_mass;
                out.forces.wrench.moved(about, &Vec3::zeros()) + still * -1.0
            }
        };
        [still, moving]
    }
}

const NO_WHEELS: [f64; MAX_SURFACES] = [f64::NAN; MAX_SURFACES];

/// Accelerations that leave the body components of the velocity through the water as they are.
fn without_inertia(state: Condition) -> Condition {
    Condition { acceleration: state.angular_velocity.cross(&state.velocity), ..state }
}

/// The image of a force or a velocity across y = 0, and that of a moment or a rate.
fn flip(v: &Vec3) -> Vec3 {
    Vec3::new(v.x, -v.y, v.z)
}

fn turn(v: &Vec3) -> Vec3 {
    Vec3::new(-v.x, v.y, -v.z)
}

fn mirrored(state: &Condition) -> Condition {
    Condition {
        velocity: flip(&state.velocity),
        ground_velocity: flip(&state.ground_velocity),
        angular_velocity: turn(&state.angular_velocity),
        up: UnitVector3::new_normalize(flip(&state.up)),
        ..*state
    }
}

fn power(load: &Wrench, state: &Condition) -> f64 {
    load.force.dot(&state.velocity) + load.moment.dot(&state.angular_velocity)
}

#[test]
fn motion_through_the_water_costs_power_in_every_state() {
    let mut out = Answer::default();
    for subject in subjects() {
        let mut random = Random::new(1);
        let mut worst = f64::NEG_INFINITY;
        for index in 0..STATES {
            let state = without_inertia(subject.random(&mut random));
            let turning: [f64; MAX_SURFACES] = std::array::from_fn(|_| 40.0 * random.unit() - 20.0);
            let speeds = if index % 2 == 0 { &NO_WHEELS } else { &turning };
            let [_, moving] = subject.loads(&state, speeds, Physics::Full, &mut out);
            let scale = subject.weight() * (state.velocity.norm() + 0.1 * state.angular_velocity.norm());
            worst = worst.max((power(&moving, &state) - out.base.shaft_power.max(0.0)) / scale);
        }
        assert!(worst <= 1e-4, "{}: {worst}", subject.vehicle.name);
    }
}

#[test]
fn tracks_push_ahead_together_and_turn_the_hull_against_each_other() {
    let mut out = Answer::default();
    let subject = subjects().iter().find(|subject| subject.vehicle.name == "tracked").expect("there");
    // half of the tracks is under water; the order is left, right
    let state =
        Condition { water_level: Some(subject.vehicle.z0 + 0.25), ..Condition::level(Vec3::zeros(), 0.0) };
    let mut at = |speeds: [f64; 2], state: &Condition| {
        let mut all = NO_WHEELS;
        subject.vehicle.wheels().into_iter().zip(speeds).for_each(|(surface, speed)| all[surface] = speed);
        let [_, moving] = subject.loads(state, &all, Physics::QuasiSteady, &mut out);
        (moving, out.base.shaft_power)
    };
    assert_eq!(subject.vehicle.wheels().len(), 2);
    let (ahead, power) = at([12.0, 12.0], &state);
    let (force, moment) = (ahead.force, ahead.moment);
    assert!(force.x > 10.0 && force.y.abs() < 1e-9 * force.x, "{ahead:?}");
    assert!(moment.z.abs() < 1e-6 * force.x && power > 0.0, "{ahead:?} {power} W");
    let (astern, _) = at([-12.0, -12.0], &state);
    assert!((astern.force.x + force.x).abs() < 1e-6 * force.x, "{astern:?}");
    // the right track ahead and the left one astern: to the left
    let (turned, _) = at([-12.0, 12.0], &state);
    assert!(turned.moment.z > 10.0 && turned.force.x.abs() < 1e-6 * force.x, "{turned:?}");
    let (one, _) = at([0.0, 12.0], &state);
    assert!(one.moment.z > 0.0 && one.force.x > 0.0);

    let mut random = Random::new(11);
    for _ in 0..2_000 {
        let state = subject.random(&mut random);
        let [left, right] = [40.0 * random.unit() - 20.0, 40.0 * random.unit() - 20.0];
        let (load, power) = at([left, right], &state);
        let (image, other) = at([right, left], &mirrored(&state));
        let q = 0.5 * state.density * 100.0 * subject.size().powi(2);
        assert!((load.force - flip(&image.force)).norm() < 1e-5 * q, "{load:?} {image:?}");
        assert!((load.moment - turn(&image.moment)).norm() < 1e-5 * q * subject.size(), "{load:?} {image:?}");
        assert!((power - other).abs() < 1e-4 * q, "{power} {other}");
        assert_eq!(at([0.0, 0.0], &state).0, at([f64::NAN, f64::NAN], &state).0, "at rest");
        assert_eq!(at([0.0, 0.0], &state).1, 0.0);
    }
}

#[test]
fn a_wheel_that_stands_still_is_one_of_which_nothing_is_stated() {
    let mut out = Answer::default();
    for subject in subjects() {
        let mut random = Random::new(8);
        for _ in 0..200 {
            let state = subject.random(&mut random);
            let [_, unstated] = subject.loads(&state, &NO_WHEELS, Physics::Full, &mut out);
            let [_, still] = subject.loads(&state, &[0.0; MAX_SURFACES], Physics::Full, &mut out);
            assert_eq!(unstated, still, "{}", subject.vehicle.name);
        }
    }
}

#[test]
fn at_rest_force_and_moment_are_those_of_the_clipped_hull() {
    let mut out = Answer::default();
    for subject in subjects() {
        let mut random = Random::new(2);
        for _ in 0..STATES / 20 {
            let still = Vec3::zeros();
            let state = Condition {
                velocity: still,
                ground_velocity: still,
                angular_velocity: still,
                ..subject.random(&mut random)
            };
            let [rest, moving] = subject.loads(&state, &NO_WHEELS, Physics::Full, &mut out);
            let plane = state.water_plane(subject.vehicle.z0);
            let count = subject.vehicle.surfaces.len();
            let exact = surface_hydrostatics(&subject.vehicle.hull, count, &plane, state.density, &still);
            let exact = exact.into_iter().fold(Wrench::default(), |sum, load| sum + load);
            let sum = rest + moving;
            let force = (sum.force - exact.force).norm() / subject.weight();
            let moment = (sum.moment - exact.moment).norm() / (subject.weight() * subject.size());
            assert!(force < 1e-4 && moment < 1e-4, "{}: {force} {moment}", subject.vehicle.name);
        }
    }
}

#[test]
fn above_the_water_nothing_acts() {
    let mut out = Answer::default();
    for subject in subjects() {
        let mut random = Random::new(3);
        for _ in 0..STATES / 20 {
            let mut state = subject.random(&mut random);
            let lowest = subject
                .vehicle
                .hull
                .mesh
                .vertices
                .iter()
                .map(|vertex| state.up.dot(vertex))
                .fold(f64::INFINITY, f64::min);
            state.water_level = Some(lowest - 1e-9 - 0.1 * random.unit());
            let [still, moving] = subject.loads(&state, &NO_WHEELS, Physics::Full, &mut out);
            assert_eq!((still, moving), (Wrench::default(), Wrench::default()), "{}", subject.vehicle.name);
            assert_eq!(out.base.added_mass.norm(), 0.0);
        }
    }
}

#[test]
fn a_mirrored_state_has_a_mirrored_load() {
    let mut out = Answer::default();
    for subject in subjects() {
        let mut random = Random::new(4);
        for _ in 0..STATES / 10 {
            let state = subject.random(&mut random);
            let [_, one] = subject.loads(&state, &NO_WHEELS, Physics::Full, &mut out);
            let [_, other] = subject.loads(&mirrored(&state), &NO_WHEELS, Physics::Full, &mut out);
            let q = 0.5 * state.density * 40.0 * subject.size().powi(2);
            let force = (one.force - flip(&other.force)).norm() / q;
            let moment = (one.moment - turn(&other.moment)).norm() / (q * subject.size());
            assert!(force < 1e-5 && moment < 1e-5, "{}: {force} {moment}", subject.vehicle.name);
        }
    }
}

#[test]
fn added_mass_and_damping_are_symmetric_and_not_negative() {
    let mut out = Answer::default();
    for subject in subjects() {
        let mut random = Random::new(5);
        for _ in 0..STATES / 50 {
            let state = subject.random(&mut random);
            subject.loads(&state, &NO_WHEELS, Physics::Full, &mut out);
            for matrix in [out.base.added_mass, out.base.damping] {
                let size = matrix.norm().max(1e-9);
                assert!((matrix - matrix.transpose()).norm() <= 1e-12 * size);
                let least = matrix.symmetric_eigenvalues().min();
                assert!(least >= -1e-12 * size, "{}: {least} of {size}", subject.vehicle.name);
            }
        }
    }
}

/// Steps of 1 mm, 0.1 degree, 1 cm/s or 0.01 rad/s along random lines, and the largest jump that bisection leaves of the worst.
#[test]
fn no_line_through_the_states_has_a_jump() {
    const LINES: usize = 1_667;
    const STEPS: usize = 40;
    let mut out = Answer::default();
    for subject in subjects() {
        let mut random = Random::new(6);
        let (mut steepest, mut jump) = (0.0_f64, 0.0_f64);
        let (mut worst, mut cliff) = (String::new(), String::new());
        for _ in 0..LINES {
            let start = without_inertia(subject.random(&mut random));
            let kind = (random.unit() * 4.0) as usize;
            let axis = random.direction();
            let at = |x: f64| {
                let state = match kind {
                    0 => Condition { water_level: start.water_level.map(|l| l + 1e-3 * x), ..start },
                    1 => {
                        let turned = UnitQuaternion::from_scaled_axis(axis * (0.1_f64.to_radians() * x));
                        Condition { up: turned * start.up, ..start }
                    }
                    2 => {
                        let more = axis * (0.01 * x);
                        let ground_velocity = start.ground_velocity + more;
                        Condition { velocity: start.velocity + more, ground_velocity, ..start }
                    }
                    _ => Condition { angular_velocity: start.angular_velocity + axis * (0.01 * x), ..start },
                };
                without_inertia(state)
            };
            let room = |x: f64| {
                let state = at(x);
                let turning = state.angular_velocity.norm() * 0.5 * subject.size();
                let q = 0.5 * state.density * (state.velocity.norm() + turning).powi(2);
                0.01 * subject.weight() + 0.01 * q * subject.vehicle.hull.mesh.area()
            };
            let mut force = |x: f64| subject.loads(&at(x), &NO_WHEELS, Physics::Full, &mut out)[1].force;
            let values: Vec<Vec3> = (0..=STEPS).map(|i| force(i as f64)).collect();
            let (mut low, change) = (0..STEPS)
                .map(|i| (i as f64, (values[i + 1] - values[i]).norm() / room(i as f64)))
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .expect("steps");
            if change > steepest {
                steepest = change;
                worst = format!("kind {kind} {start:?} at {low}");
            }
            let mut width = 1.0;
            while width > 1e-7 {
                width *= 0.5;
                let [a, b, c] = [low, low + width, low + 2.0 * width].map(&mut force);
                if (c - b).norm() > (b - a).norm() {
                    low += width;
                }
            }
            let found = (force(low + width) - force(low)).norm() / subject.weight();
            if found > jump {
                jump = found;
                cliff = format!("kind {kind} {start:?} at {low}");
            }
        }
        assert!(steepest < 1.0, "{}: {steepest}, {worst}", subject.vehicle.name);
        assert!(jump < 1e-5, "{}: {jump}, {cliff}", subject.vehicle.name);
    }
}

/// A released body, integrated with the matrix of added mass in small steps; up is the world's z.
#[test]
fn what_the_water_does_never_adds_energy() {
    let mut out = BaseLoads::default();
    for subject in subjects().iter().filter(|subject| subject.model.is_none()) {
        let mut random = Random::new(7);
        for _ in 0..20 {
            let mut run = Release::random(&subject.vehicle, &mut random);
            let start = run.energy(&subject.base, &mut out);
            let scale = subject.weight() * subject.size();
            let (mut highest, mut least) = (0.0_f64, start);
            for _ in 0..2_000 {
                run.step(&subject.base, 1e-3, &mut out);
                let now = run.energy(&subject.base, &mut out);
                highest = highest.max((now - least) / scale);
                least = least.min(now);
            }
            assert!(highest < 1e-3, "{}: energy rose by {highest}", subject.vehicle.name);
        }
    }
}

fn shipped(name: &str) -> &'static Subject {
    subjects().iter().find(|subject| subject.vehicle.name == name).expect("shipped")
}

fn afloat(subject: &Subject) -> Release<'_> {
    let vehicle = &subject.vehicle;
    let mut run = Release::at(vehicle, float_depth(&vehicle.hull.mesh, vehicle.z0, vehicle.mass));
    run.memory = Some(Memory::default());
    run
}

/// Period [s] and damping ratio of a swing about its last value, by its extremes.
fn decay(swing: &[f64], dt: f64) -> (f64, f64) {
    let rest = swing[swing.len() - 1];
    let extremes: Vec<(f64, f64)> = turns(swing).map(|i| (i as f64 * dt, (swing[i] - rest).abs())).collect();
    let (first, third) = (extremes[0], extremes[2]);
    let decrement = (first.1 / third.1).ln();
    (third.0 - first.0, decrement / decrement.hypot(TAU))
}

/// Heave, roll and pitch of the Warthog from 5 cm and 3 degrees, as it is shipped. The periods are capytaine's for 308 panels of
/// another mesh, and so are the damping ratios of radiation, to which drag adds.
#[test]
fn a_floating_hull_that_is_let_go_swings_as_the_panel_method_says() {
    let subject = shipped("warthog, trained");
    let mut out = BaseLoads::default();
    for (mode, period, ratios) in [(2, 1.43, [0.17, 0.38]), (3, 1.33, [0.014, 0.1]), (4, 1.40, [0.05, 0.15])]
    {
        let mut run = afloat(subject);
        run.bed = Some(-100.0);
        if mode == 2 {
            run.height += 0.05;
        } else {
            run.attitude = UnitQuaternion::from_scaled_axis(Vec3::ith(mode - 3, 3.0_f64.to_radians()));
        }
        let dt = 2e-3;
        let swing: Vec<f64> = (0..6_000)
            .map(|_| {
                run.step(&subject.base, dt, &mut out);
                if mode == 2 { run.height } else { run.attitude.scaled_axis()[mode - 3] }
            })
            .collect();
        let (found, ratio) = decay(&swing, dt);
        assert!((found / period - 1.0).abs() < 0.1, "mode {mode}: {found} s");
        assert!(ratio > ratios[0] / 1.5 && ratio < ratios[1] * 1.5, "mode {mode}: {ratio}");
    }
}

#[test]
fn a_hull_that_is_held_across_a_current_stays_where_it_is() {
    let subject = shipped("warthog, trained");
    let mut out = BaseLoads::default();
    for speed in [1.0, 1.5, 2.0] {
        let mut run = afloat(subject);
        run.current = Vec3::y() * speed;
        let at = run.height;
        let (mut moved, mut tilt, mut late) = (0.0_f64, 0.0_f64, [f64::INFINITY, f64::NEG_INFINITY]);
        for step in 0..15_000 {
            run.step(&subject.base, 2e-3, &mut out);
            // held: it goes up and down and tilts alone
            let v = run.attitude * run.nu.fixed_rows::<3>(0).into_owned();
            let free = run.attitude.inverse() * Vec3::new(0.0, 0.0, v.z);
            run.nu.fixed_rows_mut::<3>(0).copy_from(&free);
            run.nu[5] = 0.0;
            moved = moved.max((run.height - at).abs());
            tilt = tilt.max((run.attitude * Vec3::z()).z.clamp(-1.0, 1.0).acos());
            if step > 12_500 {
                late = [late[0].min(run.height), late[1].max(run.height)];
            }
        }
        assert!(moved < 0.1 && tilt < 0.3, "{speed} m/s: {moved} m, {tilt} rad");
        assert!(late[1] - late[0] < 1e-3, "{speed} m/s: it heaves by itself");
    }
}

#[test]
fn a_recording_that_begins_in_motion_was_in_motion_before() {
    let subject = shipped("husky, trained");
    let state = Condition::level(Vec3::new(0.8, 0.3, 0.0), 0.15);
    let mut out = BaseLoads::default();
    let mut loads = |memory: &mut Memory| -> Vec<Vec3> {
        let motion = Motion {
            wheel_speeds: &NO_WHEELS,
            time_step: 0.01,
            implicit_added_mass: true,
            physics: Physics::Full,
            waters: None,
        };
        let mut load = || {
            subject.base.evaluate(&state, &motion, Some(memory), &mut out);
            out.hull.force
        };
        (0..2_000).map(|_| load()).collect()
    };
    let [recorded, started] =
        [Memory::of_recording(), Memory::default()].map(|mut memory| loads(&mut memory));
    assert!((recorded[0] - recorded[1_999]).norm() < 1e-9, "{:?}", recorded[0]);
    assert!((started[0] - started[1_999]).norm() > 0.1, "a hull that is set going makes waves");
}
