//! The derivatives of the wrench are those of the wrench, in random states of the whole space.

use nalgebra::{SVector, UnitQuaternion, UnitVector3};
use wade_core::condition::{Condition, GroundContact};
use wade_core::effects::Circumstances;
use wade_core::forces::Forces;
use wade_core::frame::Vec3;
use wade_core::model::{COLUMNS, Jacobian, JacobianWorkspace, Model, Workspace};
use wade_core::physics::{BaseLoads, Memory, Motion, Physics};
use wade_core::served::{Loads, ServedVehicle, Session};
use wade_core::vehicle::MAX_SURFACES;

use crate::common::{VEHICLES, every_effect, served_with};
use crate::physics::{Subject, subjects};
use crate::random::Random;

const STATES: usize = 100;
/// Steps of the differences in the unit of each column.
const STEP: f64 = 1e-5;

/// The state a step along a column further.
fn stepped(state: &Condition, z0: f64, column: usize, step: f64) -> Condition {
    let level = state.water_plane(z0).offset;
    let mut next = Condition { water_level: Some(level), ..*state };
    match column {
        0..3 => {
            next.velocity[column] += step;
            next.ground_velocity[column] += step;
        }
        3..6 => next.angular_velocity[column - 3] += step,
        6 => next.water_level = Some(level + step),
        7..10 => {
            let turn = UnitQuaternion::from_scaled_axis(Vec3::ith(column - 7, step));
            next.up = UnitVector3::new_normalize(turn.inverse() * state.up.into_inner());
        }
        _ => next.density += step,
    }
    next
}

struct Asked<'a> {
    model: &'a Model,
    motion: Motion<'a>,
    memory: Option<Memory>,
    workspace: Workspace,
    forces: Forces,
}

impl<'a> Asked<'a> {
    fn of(model: &'a Model, motion: Motion<'a>) -> Self {
        Self { model, motion, memory: None, workspace: Workspace::new(), forces: Forces::default() }
    }

    /// Force, and moment over the length of the hull.
    fn wrench(&mut self, state: &Condition) -> SVector<f64, 6> {
        let mut memory = self.memory;
        self.model.evaluate_moving(
            state,
            (&self.motion, memory.as_mut()),
            &mut self.workspace,
            &mut self.forces,
        );
        let (f, m) =
            (self.forces.wrench.force, self.forces.wrench.moment / self.model.vehicle().dimensions.length);
        SVector::<f64, 6>::from([f.x, f.y, f.z, m.x, m.y, m.z])
    }

    fn jacobian(&mut self, state: &Condition, slopes: &mut JacobianWorkspace) -> Jacobian {
        let mut memory = self.memory;
        let asked = (&self.motion, memory.as_mut());
        let room = (&mut self.workspace, slopes);
        self.model.evaluate_with_jacobian(state, asked, room, &mut self.forces).expect("a base")
    }

    fn difference(&mut self, state: &Condition, column: usize, step: f64) -> SVector<f64, 6> {
        let z0 = self.model.vehicle().z0;
        let [ahead, behind] = [step, -step].map(|step| self.wrench(&stepped(state, z0, column, step)));
        (ahead - behind) / (2.0 * step)
    }
}

/// Errors of the columns over the size of the derivative, rising, of those whose differences of two steps agree, and the share of
/// the others.
fn errors(subject: &Subject, asked: &mut Asked<'_>, dry_contact: bool) -> (Vec<f64>, f64) {
    let mut random = Random::new(5);
    let mut workspace = JacobianWorkspace::new();
    let (mut errors, mut kinks) = (Vec::new(), 0.0);
    for _ in 0..STATES {
        let state = Condition {
            acceleration: random.direction() * 3.0,
            angular_acceleration: random.direction() * 3.0,
            ground_contact: if dry_contact { GroundContact::Dry } else { GroundContact::Wetted },
            ..subject.random(&mut random)
        };
        let jacobian = asked.jacobian(&state, &mut workspace);
        let size = asked.wrench(&state).norm();
        for column in 0..COLUMNS {
            // the others change by a few units, density by hundreds
            let step = if column == 10 { 100.0 * STEP } else { STEP };
            let [coarse, fine] = [step, 0.5 * step].map(|step| asked.difference(&state, column, step));
            let mut found = jacobian.column(column).into_owned();
            found.fixed_rows_mut::<3>(3).unscale_mut(subject.vehicle.dimensions.length);
            let rounding = 1e-13 * size / step;
            if (coarse - fine).norm() > 1e-5 * fine.norm() + rounding {
                kinks += 1.0;
            } else {
                errors.push(((found - fine).norm() - rounding).max(0.0) / (fine.norm() + 1e-6 * size));
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    (errors, kinks / (STATES * COLUMNS) as f64)
}

fn check(subject: &Subject, motion: Motion<'_>, memory: Option<Memory>, dry_contact: bool) {
    let model = Model::of_physics(subject.vehicle.clone(), 1, subject.base.clone());
    let mut asked = Asked { memory, ..Asked::of(&model, motion) };
    let (errors, kinks) = errors(subject, &mut asked, dry_contact);
    let (worst, name) = (errors[errors.len() - 1], &subject.vehicle.name);
    println!("{name}: worst of {} {worst:.1e}, {:.2} % at kinks", errors.len(), 100.0 * kinks);
    assert!(worst < 1e-4 && kinks < 0.02, "{name}: {worst:e}, {kinks} at kinks");
}

const ALONE: Motion<'_> = Motion::ALONE;

#[test]
fn derivatives_of_the_base_are_those_of_its_loads() {
    for subject in subjects() {
        for physics in [Physics::Hydrostatic, Physics::QuasiSteady, Physics::Full] {
            check(subject, Motion { physics, ..ALONE }, None, false);
        }
        check(subject, Motion { implicit_added_mass: true, ..ALONE }, None, true);
    }
}

#[test]
fn derivatives_with_wheels_and_tracks_that_turn_are_those_of_the_loads() {
    let mut random = Random::new(11);
    let speeds: [f64; MAX_SURFACES] = std::array::from_fn(|_| 40.0 * random.unit() - 20.0);
    for subject in subjects() {
        check(subject, Motion { wheel_speeds: &speeds, ..ALONE }, None, false);
    }
}

/// A session some steps into a motion.
fn remembered(subject: &Subject, begun: Memory) -> Memory {
    let (mut memory, mut loads) = (begun, BaseLoads::default());
    let mut random = Random::new(17);
    for _ in 0..20 {
        let state = Condition { up: Vec3::z_axis(), ..subject.random(&mut random) };
        let motion = Motion { time_step: 0.05, ..ALONE };
        subject.base.evaluate(&state, &motion, Some(&mut memory), &mut loads);
    }
    memory
}

#[test]
fn derivatives_in_a_session_are_those_of_the_next_load() {
    for subject in subjects() {
        for begun in [Memory::default(), Memory::of_recording()] {
            let memory = remembered(subject, begun);
            for implicit_added_mass in [false, true] {
                check(subject, Motion { time_step: 0.01, implicit_added_mass, ..ALONE }, Some(memory), false);
            }
        }
    }
}

/// The network computes in single precision, so differences have a long step and see its switches.
#[test]
fn derivatives_with_weights_are_those_of_the_wrench() {
    for subject in subjects() {
        let Some(model) = &subject.model else { continue };
        let base = Model::of_physics(subject.vehicle.clone(), 1, subject.base.clone());
        let [mut asked, mut of_base] = [model, &base].map(|model| Asked::of(model, ALONE));
        let mut random = Random::new(23);
        let mut workspace = JacobianWorkspace::new();
        let (mut errors, mut learned) = (Vec::new(), 0);
        while learned < STATES {
            let (sine, cosine) = (std::f64::consts::TAU * random.unit()).sin_cos();
            let velocity = Vec3::new(cosine, sine, 0.0) * (0.5 + 2.5 * random.unit());
            let depth = subject.vehicle.dimensions.height * (0.2 + 0.5 * random.unit());
            let tilt = random.direction() * (0.1 * random.unit());
            let state = Condition {
                up: UnitVector3::new_normalize(Vec3::z() + tilt),
                angular_velocity: random.direction() * 0.2,
                ..Condition::level(velocity, depth)
            };
            let [found, without] =
                [&mut asked, &mut of_base].map(|asked| asked.jacobian(&state, &mut workspace));
            if (found - without).norm() < 1e-3 * without.norm() {
                continue;
            }
            learned += 1;
            for column in 0..COLUMNS {
                let step = if column == 10 { 1.0 } else { 1e-3 };
                let difference = asked.difference(&state, column, step);
                let mut found = found.column(column).into_owned();
                found.fixed_rows_mut::<3>(3).unscale_mut(subject.vehicle.dimensions.length);
                errors.push((found - difference).norm() / difference.norm());
            }
        }
        errors.sort_by(f64::total_cmp);
        let [median, most] = [0.5, 0.95].map(|share| errors[(errors.len() as f64 * share) as usize]);
        println!("{}: median {median:.1e}, 95 % below {most:.1e}", subject.vehicle.name);
        assert!(median < 2e-3 && most < 5e-2, "{}: {median:e} {most:e}", subject.vehicle.name);
    }
}

/// Every effect on a base without weights, in states within the box in which it was seen and outside it, alone and in a session.
#[test]
fn derivatives_with_effects_are_those_of_the_wrench() {
    for vehicle in VEHICLES {
        let subject = subjects().iter().find(|subject| subject.vehicle.name == vehicle).expect("shipped");
        let base = Model::of_physics(subject.vehicle.clone(), 1, subject.base.clone());
        let served = ServedVehicle::new(base, Some(every_effect(vehicle)));
        let z0 = subject.vehicle.z0;
        let (mut random, mut loads) = (Random::new(29), Loads::default());
        let circumstances = Circumstances {
            heading: Some(0.4),
            wheel_speeds: Some([3.0, 4.0, 5.0, 6.0].into()),
            time_step: 0.01,
            ..Circumstances::default()
        };
        let mut begun = Session::default();
        served.evaluate(&subject.random(&mut random), &circumstances, Some(&mut begun), &mut loads);
        let (mut worst, mut kinks, mut columns, mut outside) = (0.0_f64, 0, 0, 0);
        for round in 0..STATES {
            let state = Condition {
                acceleration: random.direction() * 0.3,
                velocity: random.direction() * (0.8 * random.unit()),
                ..subject.random(&mut random)
            };
            let state = if round % 2 == 0 {
                Condition {
                    up: Vec3::z_axis(),
                    ..Condition::level(state.velocity, 0.1 + 0.1 * random.unit())
                }
            } else {
                state
            };
            let begun = (round % 3 == 0).then_some(begun);
            let mut wrench = |state: &Condition, jacobian: bool| {
                let mut session = begun;
                let circumstances = Circumstances { jacobian, ..circumstances };
                served.evaluate(state, &circumstances, session.as_mut(), &mut loads);
                outside += usize::from(loads.effects.outside.iter().any(|excess| *excess > 0.0));
                (loads.forces.wrench.column(), loads.jacobian)
            };
            let (here, jacobian) = wrench(&state, true);
            let jacobian = jacobian.expect("a base");
            for column in 0..COLUMNS {
                let step = if column == 10 { 100.0 * STEP } else { STEP };
                let [coarse, fine] = [step, 0.3 * step].map(|step| {
                    let [ahead, behind] =
                        [step, -step].map(|step| wrench(&stepped(&state, z0, column, step), false).0);
                    (ahead - behind) / (2.0 * step)
                });
                let found = jacobian.column(column);
                columns += 1;
                if (coarse - fine).norm() > 1e-5 * fine.norm() + 1e-12 * here.norm() / step {
                    kinks += 1;
                    continue;
                }
                let error = (found - fine).norm() / (fine.norm() + 1e-6 * here.norm());
                worst = worst.max(error);
            }
        }
        let kinks = f64::from(kinks) / f64::from(columns);
        println!("{vehicle}: worst {worst:.1e}, {:.1} % at kinks, {outside} outside", 100.0 * kinks);
        assert!(worst < 1e-4 && kinks < 0.05 && outside > 100, "{vehicle}: {worst:e}, {kinks} at kinks");
    }
}

/// The same with weights, which effects ask in other states: in single precision, with the switches of the network.
#[test]
fn derivatives_with_effects_and_weights_are_those_of_the_wrench() {
    for vehicle in VEHICLES {
        let subject = subjects().iter().find(|subject| subject.vehicle.name == vehicle).expect("shipped");
        let served = served_with(vehicle, every_effect(vehicle));
        let z0 = subject.vehicle.z0;
        let (mut random, mut loads) = (Random::new(31), Loads::default());
        let circumstances = Circumstances {
            heading: Some(0.4),
            wheel_speeds: Some([3.0, 4.0, 5.0, 6.0].into()),
            ..Circumstances::default()
        };
        let mut wrench = |state: &Condition, jacobian: bool| {
            served.evaluate(state, &Circumstances { jacobian, ..circumstances }, None, &mut loads);
            (loads.forces.wrench.column(), loads.jacobian)
        };
        let mut errors: [Vec<f64>; COLUMNS] = Default::default();
        for _ in 0..STATES {
            let (sine, cosine) = (std::f64::consts::TAU * random.unit()).sin_cos();
            let state = Condition {
                up: UnitVector3::new_normalize(Vec3::z() + random.direction() * (0.1 * random.unit())),
                angular_velocity: random.direction() * 0.2,
                ..Condition::level(
                    // neither in nor out of the water: between the two the load of entry begins
                    Vec3::new(cosine, sine, 0.1) * (0.5 + 1.5 * random.unit()),
                    subject.vehicle.dimensions.height * (0.2 + 0.5 * random.unit()),
                )
            };
            let jacobian = wrench(&state, true).1.expect("a base");
            for (column, errors) in errors.iter_mut().enumerate() {
                let step = [1e-3, 1e-4, 1.0][usize::from(column >= 6) + usize::from(column == 10)];
                let [ahead, behind] =
                    [step, -step].map(|step| wrench(&stepped(&state, z0, column, step), false).0);
                let difference = (ahead - behind) / (2.0 * step);
                errors.push((jacobian.column(column) - difference).norm() / difference.norm());
            }
        }
        for (column, errors) in errors.iter_mut().enumerate() {
            errors.sort_by(f64::total_cmp);
            let [median, most] = [0.5, 0.95].map(|share| errors[(errors.len() as f64 * share) as usize]);
            println!("{vehicle} column {column}: median {median:.1e}, 95 % below {most:.1e}");
            assert!(median < 2e-3 && most < 5e-2, "{vehicle} column {column}: {median:e} {most:e}");
        }
    }
}

#[test]
fn derivatives_are_finite_at_rest_dry_and_where_water_just_reaches_the_hull() {
    let mut workspace = JacobianWorkspace::new();
    for subject in subjects() {
        let base = Model::of_physics(subject.vehicle.clone(), 1, subject.base.clone());
        let corners = &subject.vehicle.hull.mesh.vertices;
        for model in subject.model.iter().chain([&base]) {
            let mut asked = Asked::of(model, ALONE);
            for up in [Vec3::z(), -Vec3::z(), Vec3::x(), Vec3::new(0.0, 0.02, 1.0)] {
                let up = UnitVector3::new_normalize(up);
                let heights = corners.iter().map(|corner| up.dot(corner));
                let (low, high) =
                    heights.fold((f64::MAX, f64::MIN), |(low, high), h| (low.min(h), high.max(h)));
                for level in [low, high, corners[0].dot(&up), 0.5 * (low + high)] {
                    for past in [-1e-3, -1e-9, -1e-15, 0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3] {
                        for velocity in [Vec3::zeros(), Vec3::x(), Vec3::new(0.0, 1e-12, 0.0)] {
                            let water_level = Some(level + past);
                            let state = Condition { up, water_level, ..Condition::level(velocity, 0.0) };
                            let found = asked.jacobian(&state, &mut workspace);
                            let all = found.iter().all(|slope| slope.is_finite());
                            assert!(all, "{}: {state:?} {found}", subject.vehicle.name);
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn almost_no_motion_and_almost_no_tilt_have_derivatives() {
    let mut slopes = JacobianWorkspace::default();
    for name in VEHICLES {
        let model = crate::common::model(name);
        let motion = Motion {
            wheel_speeds: &[0.0; MAX_SURFACES],
            time_step: 0.0,
            implicit_added_mass: false,
            physics: Physics::Full,
            waters: None,
        };
        for size in [0.0, 1e-300, 1e-160, 4e-45, 1e-20, 1e-13, 1e-12, 1e-11, 1e-9, 1e-6] {
            for moved in [[size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size], [0.0; 3]] {
                for tilt in [0.0, size] {
                    let velocity = Vec3::from(moved);
                    let up = UnitVector3::new_normalize(Vec3::new(0.0, tilt, 1.0));
                    let state =
                        Condition { up, ground_velocity: velocity, ..Condition::level(velocity, 0.2) };
                    let jacobian = Asked::of(&model, motion).jacobian(&state, &mut slopes);
                    assert!(
                        jacobian.iter().all(|value| value.is_finite()),
                        "{name}, {moved:?}, {tilt}: {jacobian}"
                    );
                }
            }
        }
    }
}
