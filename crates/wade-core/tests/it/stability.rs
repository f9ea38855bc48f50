//! Promise: how a vehicle stands is what statics say, and the probabilities are those of random draws.

use crate::bodies::{bodies, body, tracked};
use crate::random::Random;
use nalgebra::Vector2;
use wade_core::forces::Forces;
use wade_core::frame::{GRAVITY, Vec3, up_from_roll_pitch};
use wade_core::geometry::mesh::Bounds;
use wade_core::geometry::parametric::cuboid;
use wade_core::stability::{Friction, Modes, Stance};
use wade_core::vehicle::{SurfaceKind, Vehicle};
use wade_core::wrench::Wrench;

fn car() -> Vehicle {
    bodies().into_iter().find(|body| body.name == "car").expect("there is one")
}

fn pushed(force: Vec3, moment: Vec3) -> Forces {
    Forces { wrench: Wrench { force, moment }, ..Forces::default() }
}

fn margins(vehicle: &Vehicle, forces: &Forces, friction: f64) -> Modes<f64> {
    Stance::of(vehicle).stability(forces, &Vec3::z_axis(), &Friction::of(friction)).margins
}

#[test]
fn a_box_slides_and_topples_where_its_weight_and_its_width_say() {
    // 1 m x 0.6 m x 0.4 m, its center of mass 0.16 m over the ground
    let block = cuboid(&Bounds { min: Vec3::new(-0.5, -0.3, -0.2), max: Vec3::new(0.5, 0.3, 0.2) });
    let block = body("box", 60.0, &[(block, SurfaceKind::Bottom)]);
    let weight = 60.0 * GRAVITY;
    let height = 0.16;
    for (direction, half) in [(Vec3::x(), 0.5), (Vec3::y(), 0.3), (-Vec3::x(), 0.5), (-Vec3::y(), 0.3)] {
        for (share, lift) in [(0.2, 0.0), (0.5, 0.3), (0.9, 0.6)] {
            let load = pushed(direction * (share * weight) + Vec3::z() * (lift * weight), Vec3::zeros());
            let margins = margins(&block, &load, 0.8);
            let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
            close(margins.floats, 1.0 - lift);
            close(margins.slides, (1.0 - lift) - share / 0.8);
            close(margins.topples, (1.0 - lift) - share * height / half);
            assert_eq!(margins.steers, None, "a box has no axles");
        }
    }
}

#[test]
fn a_bed_that_falls_away_slides_and_topples_at_the_angles_of_statics() {
    let car = car();
    let stance = Stance::of(&car);
    let height = car.center_of_mass.z - car.z0;
    let half_track = stance.footing().feet().iter().fold(0.0_f64, |half, foot| half.max(foot.at.y));
    for roll in [-0.5_f64, -0.2, 0.1, 0.4] {
        let up = up_from_roll_pitch(roll, 0.0);
        let margins =
            stance.stability(&pushed(Vec3::zeros(), Vec3::zeros()), &up, &Friction::of(0.7)).margins;
        let [sin, cos] = [roll.sin().abs(), roll.cos()];
        assert!((margins.slides - (cos - sin / 0.7)).abs() < 1e-12);
        assert!((margins.topples - (cos - sin * height / half_track)).abs() < 1e-9, "{}", margins.topples);
    }
}

#[test]
fn a_yaw_moment_takes_the_grip_of_the_axles_and_a_pitch_moment_their_load() {
    let car = car();
    let base = 2.6;
    let weight = car.mass * GRAVITY;
    let yaw = 0.3 * weight;
    let steers = |load: Forces| margins(&car, &load, 0.6).steers.expect("axles");
    // each axle holds yaw / base with half the weight
    let expected = 1.0 - yaw / base / (0.6 * 0.5 * weight);
    assert!((steers(pushed(Vec3::zeros(), Vec3::z() * yaw)) - expected).abs() < 1e-12);
    // nose up: the front axle has lost all its load
    let lifted = pushed(Vec3::zeros(), -Vec3::y() * (0.5 * weight * base));
    assert!(steers(lifted).abs() < 1e-12);
}

#[test]
fn normal_forces_push_and_are_in_balance() {
    let mut random = Random::new(7);
    for vehicle in bodies().iter().chain([&tracked()]) {
        let stance = Stance::of(vehicle);
        let feet = stance.footing().feet();
        let center = vehicle.center_of_mass - Vec3::z() * vehicle.z0;
        let weight = vehicle.mass * GRAVITY;
        for _ in 0..200 {
            let part = |random: &mut Random| 0.15 * weight * random.between(-1.0, 1.0);
            let force = Vec3::new(part(&mut random), part(&mut random), 2.0 * part(&mut random));
            let moment = Vec3::from_fn(|_, _| 0.3 * part(&mut random));
            let load = pushed(force, moment);
            let answer = stance.stability(&load, &Vec3::z_axis(), &Friction::PUBLISHED);
            let normal_forces = stance.normal_forces(&load, &Vec3::z_axis());
            assert!(normal_forces.iter().all(|&n| n >= 0.0), "{normal_forces:?}");
            if answer.margins.topples <= 0.0 {
                continue;
            }
            let at = |i: usize| Vec3::new(feet[i].at.x, feet[i].at.y, 0.0);
            // gravity and water at the center of mass, the ground along z at the feet and along the bed anywhere on it
            let total = force - Vec3::z() * weight;
            let normal: f64 = normal_forces.iter().sum();
            let turning: Vec3 = (0..feet.len()).map(|i| at(i).cross(&(Vec3::z() * normal_forces[i]))).sum();
            let balance = turning + moment + center.cross(&total);
            assert!((normal + total.z).abs() < 1e-6 * weight, "{}: {normal} {}", vehicle.name, total.z);
            assert!(balance.xy().norm() < 1e-6 * weight, "{}: {balance}", vehicle.name);
        }
    }
}

/// The same by brute force: every draw stands or falls by the balance of its forces.
fn drawn(vehicle: &Vehicle, forces: &Forces, friction: &Friction, random: &mut Random) -> [f64; 4] {
    const COUNT: usize = 100_000;
    let stance = Stance::of(vehicle);
    let feet: Vec<Vector2<f64>> = stance.footing().feet().iter().map(|foot| foot.at).collect();
    let center = vehicle.center_of_mass - Vec3::z() * vehicle.z0;
    let mut counts = [0_usize; 4];
    for _ in 0..COUNT {
        let mut normal = || {
            let (a, b): (f64, f64) = (random.between(0.0, 1.0), random.between(0.0, 1.0));
            (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
        };
        let force = forces.wrench.force + forces.uncertainty.map(|deviation| deviation * normal());
        let moment = forces.wrench.moment + forces.moment_uncertainty.map(|deviation| deviation * normal());
        let mu = random.between(friction.min, friction.max);
        let total = force - Vec3::z() * (vehicle.mass * GRAVITY);
        let about = moment + center.cross(&total);
        let load = -total.z;
        let floats = load < 0.0;
        let slides = floats || total.xy().norm() > mu * load;
        let pressure = Vector2::new(about.y, -about.x) / load;
        // outside where the feet, seen from there, leave half the plane free
        let mut angles: Vec<f64> =
            feet.iter().map(|foot| (foot - pressure).y.atan2((foot - pressure).x)).collect();
        angles.sort_by(f64::total_cmp);
        let gap = (0..angles.len()).map(|i| match i {
            0 => angles[0] + std::f64::consts::TAU - angles[angles.len() - 1],
            i => angles[i] - angles[i - 1],
        });
        let topples = !floats && gap.fold(0.0, f64::max) > std::f64::consts::PI;
        let [front, rear] = [1.3, -1.3];
        let front_load = (about.y - rear * load) / (front - rear);
        let front_side = (-about.z + rear * total.y) / (front - rear);
        let loads = [front_load, load - front_load];
        let sides = [front_side, -total.y - front_side];
        let shares = [(center.x - rear) / (front - rear), (front - center.x) / (front - rear)];
        let holds = |i: usize| (total.x * shares[i]).hypot(sides[i]) <= mu * loads[i];
        let steers = !floats && holds(0) && holds(1);
        for (count, holds) in counts.iter_mut().zip([floats, slides, topples, steers]) {
            *count += usize::from(holds);
        }
    }
    counts.map(|count| count as f64 / COUNT as f64)
}

#[test]
fn probabilities_are_those_of_random_draws() {
    let car = Vehicle { center_of_mass: Vec3::new(0.1, 0.02, -0.2), ..car() };
    let weight = car.mass * GRAVITY;
    let mut random = Random::new(20_261_128);
    let (mut worst, mut squares) = ([0.0_f64; 4], 0.0);
    for _ in 0..60 {
        let between = |random: &mut Random, scale: f64| weight * scale * random.between(-1.0, 1.0);
        let force = Vec3::new(
            between(&mut random, 0.5),
            between(&mut random, 0.5),
            weight * random.between(-0.1, 1.2),
        );
        let moment =
            Vec3::new(between(&mut random, 0.5), between(&mut random, 0.8), between(&mut random, 0.5));
        let forces = Forces {
            uncertainty: Vec3::from_fn(|_, _| weight * random.between(0.0, 0.2)),
            moment_uncertainty: Vec3::from_fn(|_, _| weight * random.between(0.0, 0.2)),
            ..pushed(force, moment)
        };
        let chances = Stance::of(&car).stability(&forces, &Vec3::z_axis(), &Friction::PUBLISHED).chances;
        let ours = [chances.floats, chances.slides, chances.topples, chances.steers.expect("axles")];
        let theirs = drawn(&car, &forces, &Friction::PUBLISHED, &mut random);
        for (worst, (a, b)) in worst.iter_mut().zip(ours.iter().zip(theirs)) {
            *worst = worst.max((a - b).abs());
            squares += (a - b) * (a - b);
        }
    }
    let rms = (squares / 240.0).sqrt();
    println!("largest differences: {worst:?}, root mean square {rms}");
    // 0.005 is three deviations of a hundred thousand draws; floating is in closed form
    assert!(worst[0] < 0.005 && worst.iter().all(|worst| *worst < 0.03) && rms < 0.005, "{worst:?} {rms}");
}

#[test]
fn what_can_be_steered_neither_slides_nor_floats() {
    let mut random = Random::new(3);
    let car = car();
    let weight = car.mass * GRAVITY;
    for _ in 0..2000 {
        let mut part = |scale: f64| weight * scale * random.between(-1.0, 1.0);
        let forces =
            pushed(Vec3::new(part(0.5), part(0.5), part(1.1)), Vec3::new(part(0.3), part(0.5), part(0.3)));
        let chances = Stance::of(&car).stability(&forces, &Vec3::z_axis(), &Friction::of(0.5)).chances;
        let steers = chances.steers.expect("axles");
        assert!(steers + chances.slides <= 1.0 + 1e-12, "{chances:?}");
        assert!(chances.floats <= chances.slides, "{chances:?}");
    }
}

#[test]
fn every_vehicle_stands_on_what_reaches_the_ground() {
    let feet = |name: &str| {
        let vehicle = bodies().into_iter().find(|body| body.name == name).expect("known");
        Stance::of(&vehicle).footing().feet().len()
    };
    assert_eq!(["husky", "warthog", "car", "box", "tub", "tracked"].map(feet), [4, 4, 4, 4, 4, 4]);
    let mut lifted = car();
    lifted.z0 -= 0.1;
    assert!(Stance::of(&lifted).footing().feet().is_empty(), "no wheel reaches the ground");
}
