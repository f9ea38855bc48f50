//! The analytic loads: symmetric, at rest purely hydrostatic, and near the drag known from elsewhere.

#![allow(clippy::unwrap_used)]

use std::sync::OnceLock;

use proptest::prelude::*;
use wade_core::analytic::loads;
use wade_core::condition::{Condition, GroundContact};
use wade_core::effects::skin_friction;
use wade_core::frame::Vec3;
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::vehicle::{Vehicle, shipped};

fn warthog() -> &'static Vehicle {
    static VEHICLE: OnceLock<Vehicle> = OnceLock::new();
    VEHICLE.get_or_init(|| shipped::warthog().unwrap().vehicle().unwrap())
}

fn husky() -> &'static Vehicle {
    static VEHICLE: OnceLock<Vehicle> = OnceLock::new();
    VEHICLE.get_or_init(|| shipped::husky().unwrap().vehicle().unwrap())
}

fn net(vehicle: &Vehicle, condition: &Condition) -> Vec3 {
    loads(vehicle, condition).iter().sum()
}

fn of<'a>(vehicle: &Vehicle, forces: &'a [Vec3], name: &str) -> &'a Vec3 {
    &forces[vehicle.surface_index(name).unwrap()]
}

#[test]
fn drag_constant_of_the_warthog_is_near_the_known_baseline() {
    // C = -Fx / v^2 [N s2/m2] at 4, 8, 10 in: Cd 2.1 on the wetted width of front wheels and rockers. The shipped tire
    // is rounded at its shoulders where the baseline takes its full width, hence the wide tolerance in shallow water.
    for (depth, baseline, tolerance) in [(0.1016, 54.3, 0.25), (0.2032, 109.8, 0.2), (0.254, 149.5, 0.2)] {
        let c = -net(warthog(), &Condition::level(Vec3::x() * 2.0, depth)).x / 4.0;
        println!("C({depth}) = {c:.1}, baseline {baseline}");
        assert!((c / baseline - 1.0).abs() < tolerance, "C({depth}) = {c}, baseline {baseline}");
    }
}

#[test]
fn wheels_share_the_drag_as_in_cfd() {
    let rest = loads(warthog(), &Condition::level(Vec3::zeros(), 0.2032));
    let moving = loads(warthog(), &Condition::level(Vec3::x() * 2.0, 0.2032));
    for (name, cfd) in [("wheel_fl", -126.5), ("wheel_rr", -63.3)] {
        let drag = of(warthog(), &moving, name).x - of(warthog(), &rest, name).x;
        println!("{name}: {drag:.1} N, CFD {cfd} N");
        assert!((drag / cfd - 1.0).abs() < 0.2, "{name}: {drag} N, CFD {cfd} N");
    }
}

#[test]
fn at_rest_only_archimedes_is_left() {
    for vehicle in [husky(), warthog()] {
        let condition = Condition { density: 1300.0, ..Condition::level(Vec3::zeros(), 0.17) };
        let plane = condition.water_plane(vehicle.z0);
        let expected = hydrostatics(&vehicle.hull.mesh, &plane, 1300.0, &Vec3::zeros()).wrench.force;
        assert!((net(vehicle, &condition) - expected).norm() < 1e-9 * expected.norm());
    }
}

#[test]
fn a_dry_contact_patch_takes_its_pressure_away() {
    let wetted = Condition::level(Vec3::zeros(), 0.2032);
    let dry = Condition { ground_contact: GroundContact::Dry, ..wetted };
    let lost = net(warthog(), &wetted) - net(warthog(), &dry);
    let area: f64 = warthog().contacts.iter().map(|c| c.area).sum();
    assert!((lost.z - 1000.0 * 9.81 * 0.2032 * area).abs() < 1e-6);
}

#[test]
fn skin_friction_follows_the_ittc_line_and_stays_finite() {
    assert!((skin_friction::coefficient(1e7) - 0.003).abs() < 1e-12);
    assert_eq!(skin_friction::coefficient(0.0), skin_friction::coefficient(skin_friction::RE_FLOOR));
    let mut forces = vec![Vec3::zeros(); husky().surfaces.len()];
    skin_friction::add(husky(), &Condition::level(Vec3::x() * 1e-9, 0.2), &mut forces);
    assert!(forces.iter().all(|f| f.norm() < 1e-15));
}

prop_compose! {
    fn state()(speed in 0.0..4.0, angle in 0.0..std::f64::consts::TAU, density in 1000.0..1900.0, depth in 0.05..0.6)
        -> Condition {
        let velocity = Vec3::new(angle.sin(), angle.cos(), 0.0) * speed;
        Condition { density, ..Condition::level(velocity, depth) }
    }
}

fn flipped(v: &Vec3, axis: usize) -> Vec3 {
    let mut v = *v;
    v[axis] = -v[axis];
    v
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_mirrored_state_has_mirrored_loads(condition in state()) {
        for (vehicle, axes) in [(husky(), &[0, 1][..]), (warthog(), &[1])] {
            for &axis in axes {
                let mirrored = Condition { velocity: flipped(&condition.velocity, axis), ..condition };
                let (here, there) = (loads(vehicle, &condition), loads(vehicle, &mirrored));
                for (surface, force) in vehicle.surfaces.iter().zip(&here) {
                    let partner = if axis == 1 { Some(surface.mirror_left_right) } else { surface.mirror_front_rear };
                    let image = flipped(&there[partner.unwrap()], axis);
                    prop_assert!((image - force).norm() < 1e-6 * (1.0 + force.norm()), "{}", surface.name);
                }
            }
        }
    }

    #[test]
    fn drag_opposes_motion_and_form_drag_is_linear_in_density(condition in state()) {
        let mut single = vec![Vec3::zeros(); warthog().surfaces.len()];
        let mut double = single.clone();
        wade_core::effects::form_drag::add(warthog(), &condition, &mut single);
        let denser = Condition { density: 2.0 * condition.density, ..condition };
        wade_core::effects::form_drag::add(warthog(), &denser, &mut double);
        for (one, two) in single.iter().zip(&double) {
            prop_assert_eq!(one * 2.0, *two);
            prop_assert!(one.dot(&condition.velocity) <= 0.0);
        }
    }
}
