//! Promise: a mirrored state gives mirrored features on a symmetric hull.

use crate::common::{Numbers, VEHICLES, model};
use nalgebra::UnitVector3;
use wade_core::condition::Condition;
use wade_core::features;
use wade_core::frame::Vec3;

/// Reflects across the plane y = 0: vectors change the sign of y, axial vectors that of x and z.
fn mirrored(condition: &Condition) -> Condition {
    let polar = |v: &Vec3| Vec3::new(v.x, -v.y, v.z);
    let axial = |v: &Vec3| Vec3::new(-v.x, v.y, -v.z);
    Condition {
        velocity: polar(&condition.velocity),
        ground_velocity: polar(&condition.ground_velocity),
        acceleration: polar(&condition.acceleration),
        angular_velocity: axial(&condition.angular_velocity),
        angular_acceleration: axial(&condition.angular_acceleration),
        up: UnitVector3::new_unchecked(polar(&condition.up)),
        ..*condition
    }
}

#[test]
fn a_mirrored_state_gives_mirrored_features() {
    let mut numbers = Numbers::new(11);
    for name in VEHICLES {
        let model = model(name);
        let vehicle = model.vehicle();
        for _ in 0..50 {
            let state = numbers.condition();
            let image = mirrored(&state);
            let (a, b) = (
                features::global(&state, &vehicle.dimensions),
                features::global(&image, &vehicle.dimensions),
            );
            for (name, (a, b)) in features::GLOBAL_NAMES.iter().zip(a.iter().zip(b)) {
                let expected = if *name == "vy" { -b } else { b };
                assert!((a - expected).abs() < 1e-12, "{name}: {a} and {b}");
            }
            for (index, surface) in vehicle.surfaces.iter().enumerate() {
                let partner = surface.mirror_left_right;
                let dynamic = |index: usize, condition: &Condition| {
                    let plane = condition.water_plane(vehicle.z0);
                    let wet = vehicle.samples.surfaces[index].submergence(&plane);
                    let direction = features::direction(&condition.velocity);
                    features::surface_dynamic(&vehicle.surfaces[index], &wet, &direction, &vehicle.dimensions)
                };
                let (a, b) = (dynamic(index, &state), dynamic(partner, &image));
                for (a, b) in a.iter().zip(b) {
                    assert!((a - b).abs() < 1e-5, "{name} {}: {a} and {b}", surface.name);
                }
            }
        }
    }
}

#[test]
fn static_features_of_partners_mirror_each_other() {
    for name in VEHICLES {
        let model = model(name);
        let vehicle = model.vehicle();
        for surface in &vehicle.surfaces {
            let a = features::surface_static(surface, &vehicle.dimensions);
            let b =
                features::surface_static(&vehicle.surfaces[surface.mirror_left_right], &vehicle.dimensions);
            for (i, feature) in features::SURFACE_NAMES[..features::STATIC].iter().enumerate() {
                let expected = if ["y", "ny"].contains(feature) { -b[i] } else { b[i] };
                assert!((a[i] - expected).abs() < 1e-5, "{} {feature}: {} and {}", surface.name, a[i], b[i]);
            }
        }
    }
}
