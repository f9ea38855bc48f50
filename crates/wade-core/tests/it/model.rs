//! Promise: the net wrench is the sum of the surfaces, dry surfaces are exactly zero, and the conventions hold.

use crate::common::{Numbers, VEHICLES, model};
use nalgebra::UnitVector3;
use wade_core::condition::{Condition, GroundContact};
use wade_core::domain::Quantity;
use wade_core::forces::{Forces, SurfaceForce};
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::model::{Model, Weights, Workspace};
use wade_core::physics::Motion;

fn evaluate(model: &Model, condition: &Condition) -> Forces {
    let mut forces = Forces::default();
    model.evaluate(condition, &mut Workspace::new(), &mut forces);
    forces
}

#[test]
fn a_vehicle_above_the_water_feels_nothing() {
    for vehicle in VEHICLES {
        let forces = evaluate(&model(vehicle), &Condition::level(Vec3::new(1.0, 0.0, 0.0), 0.0));
        for load in &forces.surfaces {
            assert_eq!((load.force, load.wetted_fraction), (Vec3::zeros(), 0.0));
        }
        assert_eq!(forces.wrench, wade_core::wrench::Wrench::default());
    }
}

#[test]
fn dry_surfaces_are_exactly_zero_and_wet_ones_are_not() {
    let mut numbers = Numbers::new(3);
    for vehicle in VEHICLES {
        let model = model(vehicle);
        let mut counts = [0, 0];
        for _ in 0..100 {
            let mut condition = numbers.condition();
            condition.ground_contact = model.weights().and_then(Weights::ground_contact).unwrap_or_default();
            for load in evaluate(&model, &condition).surfaces {
                let wet = load.wetted_fraction > 0.0;
                counts[usize::from(wet)] += 1;
                assert_eq!(load.force != Vec3::zeros(), wet);
            }
        }
        assert!(counts[0] > 50 && counts[1] > 50, "both kinds were seen: {counts:?}");
    }
}

#[test]
fn the_net_wrench_is_that_of_the_surfaces_about_the_center_of_mass() {
    let mut numbers = Numbers::new(5);
    for vehicle in VEHICLES {
        let model = model(vehicle);
        let about = model.vehicle().center_of_mass;
        for _ in 0..50 {
            let forces = evaluate(&model, &numbers.condition());
            let force: Vec3 = forces.surfaces.iter().map(|load| load.force).sum();
            let of = |load: &SurfaceForce| (load.point - about).cross(&load.force) + load.couple;
            let moment: Vec3 = forces.surfaces.iter().map(of).sum();
            assert!((forces.wrench.force - force).norm() <= 1e-9 * (1.0 + force.norm()));
            assert!((forces.wrench.moment - moment).norm() <= 1e-9 * (1.0 + moment.norm()));
        }
    }
}

#[test]
fn points_of_application_lie_in_the_wet_part() {
    let condition = Condition::level(Vec3::new(0.5, 0.0, 0.0), 0.12);
    for vehicle in VEHICLES {
        let model = model(vehicle);
        let water = model.vehicle().z0 + condition.depth;
        for load in evaluate(&model, &condition).surfaces.iter().filter(|load| load.wetted_fraction > 0.0) {
            assert!(load.point.z <= water && load.point.z >= model.vehicle().z0);
        }
    }
}

#[test]
fn dry_tires_lack_the_water_pressure_under_their_patches() {
    for vehicle in VEHICLES {
        let model = model(vehicle);
        let wetted = Condition::level(Vec3::new(0.5, 0.0, 0.0), 0.15);
        let dry = Condition { ground_contact: GroundContact::Dry, ..wetted };
        let difference = evaluate(&model, &wetted).wrench.force - evaluate(&model, &dry).wrench.force;
        let area: f64 = model.vehicle().contacts.iter().map(|patch| patch.area).sum();
        let pressure = wetted.density * GRAVITY * wetted.depth;
        assert!((difference - Vec3::z() * (pressure * area)).norm() < 1e-6 * pressure * area, "{difference}");
    }
}

#[test]
fn states_beyond_the_training_domain_are_answered_and_marked() {
    let model = model("husky");
    let inside = Condition::level(Vec3::new(0.5, 0.0, 0.0), 0.15);
    assert!(evaluate(&model, &inside).outside.is_inside());
    let outside = Condition { depth: 0.30, ..inside };
    let forces = evaluate(&model, &outside);
    let (quantity, excess) = forces.outside.iter().next().expect("the depth is outside");
    assert_eq!(quantity, Quantity::Depth);
    let deepest = model.domain().range(Quantity::Depth).expect("a range").max;
    assert!((excess - (0.30 - deepest)).abs() < 1e-9 && (deepest - 0.20).abs() < 0.01, "{excess}");
    assert!(forces.wrench.force.z > 0.0);
}

#[test]
fn a_wheel_that_only_just_touches_the_water_feels_nothing_below_either_convention() {
    let condition = Condition { ground_contact: GroundContact::Dry, ..Condition::level(Vec3::zeros(), 1e-9) };
    let forces = evaluate(&model("husky"), &condition);
    assert!(forces.surfaces.iter().all(|load| load.wetted_fraction > 0.0 || load.force == Vec3::zeros()));
}

/// Overturned, a hull has the coordinates of one that stands upright in the same water.
#[test]
fn weights_say_nothing_of_a_hull_that_lies_on_its_roof() {
    for vehicle in VEHICLES {
        let model = model(vehicle);
        let base =
            Model::of_physics(model.vehicle().clone(), 1, model.base().expect("the physical base").clone());
        let height = model.vehicle().dimensions.height;
        for (up, counts) in [(1.0, true), (-1.0, false)] {
            let level = Condition::level(Vec3::new(0.4 * model.domain().speed_mps.max, 0.0, 0.0), 0.0);
            let water_level = Some(model.vehicle().z0 + height * if up > 0.0 { 0.4 } else { 0.6 });
            let state = Condition {
                up: UnitVector3::new_normalize(Vec3::z() * up),
                water_level: water_level.map(|level| level * up),
                ..level
            };
            let [with, without] = [&model, &base].map(|model| evaluate(model, &state).wrench.force);
            assert_eq!(
                (with - without).norm() > 1e-3 * without.norm(),
                counts,
                "{vehicle} {up}: {with} {without}"
            );
        }
    }
}

/// Steady CFD has the moment of the added mass in an oblique stream in it, and so have weights that learned it.
#[test]
fn steady_motion_that_the_weights_know_gets_no_moment_of_the_added_mass_besides() {
    for vehicle in VEHICLES {
        let model = model(vehicle);
        let physics =
            Model::of_physics(model.vehicle().clone(), 1, model.base().expect("the physical base").clone());
        // half of the speed that it was trained at, at 40 degrees, in two thirds of the depth
        let (speed, depth) = (0.5 * model.domain().speed_mps.max, 0.67 * model.domain().depth_m.max);
        let (sin, cos) = 40.0_f64.to_radians().sin_cos();
        let state = Condition::level(Vec3::new(speed * cos, speed * sin, 0.0), depth);
        let moments = |model: &Model| {
            [&Motion::ALONE, &Motion::QUASI_STEADY].map(|motion| {
                let mut forces = Forces::default();
                model.evaluate_moving(&state, (motion, None), &mut Workspace::new(), &mut forces);
                forces.wrench.moment.z
            })
        };
        let [whole, steady] = moments(&model);
        let [base, base_steady] = moments(&physics);
        assert!((base - base_steady).abs() > 0.1 * steady.abs(), "{vehicle}: {base} {base_steady}");
        assert!((whole - steady).abs() < 1e-9 * steady.abs(), "{vehicle}: {whole} against {steady} N m");
    }
}
