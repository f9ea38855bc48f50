//! Promise: what the anchored model knows by itself is right: Archimedes at rest, nothing on a dry surface and nothing
//! that jumps when it gets wet, and mirror images of a state that give mirror images of any network's answer.

use nalgebra::UnitVector3;
use wade_core::anchor::{Anchor, DYNAMIC, GLOBAL, OUTPUTS, Reading, Remainder, STATIC, SurfaceReading};
use wade_core::condition::{Condition, GroundContact};
use wade_core::frame::{Vec3, up_from_roll_pitch};
use wade_core::vehicle::Vehicle;

fn vehicle(name: &str) -> Vehicle {
    crate::common::model(name).vehicle().clone()
}

fn read(vehicle: &Vehicle, condition: &Condition) -> Reading {
    let mut reading = Reading::default();
    Anchor::new(vehicle, Remainder::OfDrag).read(vehicle, condition, &mut reading);
    reading
}

/// Both vehicles, read for weights of either kind.
fn anchors() -> impl Iterator<Item = (&'static str, Vehicle, Anchor)> {
    crate::common::VEHICLES.into_iter().flat_map(|name| {
        [Remainder::OfDrag, Remainder::OfPhysics].map(|remainder| {
            let vehicle = vehicle(name);
            let anchor = Anchor::new(&vehicle, remainder);
            (name, vehicle, anchor)
        })
    })
}

fn states() -> Vec<Condition> {
    let attitudes = [(0.0, 0.0), (0.12, 0.0), (-0.08, 0.15)];
    let velocities = [(0.8, 0.0), (0.5, 0.4), (-0.7, -0.2), (0.0, 0.9)];
    let depths = [0.07, 0.14, 0.19];
    let mut states = Vec::new();
    for (roll, pitch) in attitudes {
        for (x, y) in velocities {
            for depth in depths {
                let up = up_from_roll_pitch(roll, pitch);
                let level = Condition::level(Vec3::new(x, y, 0.0), depth);
                states.push(Condition { up, bed_clearance: Some(0.5 * depth), ..level });
            }
        }
    }
    states
}

/// Any smooth function of all that a network is told.
fn answer(global: &[f64; GLOBAL], fixed: &[f32; STATIC], dynamic: &[f32; DYNAMIC]) -> [f32; OUTPUTS] {
    let told = global.iter().map(|x| *x as f32).chain(fixed.iter().copied()).chain(dynamic.iter().copied());
    let told: Vec<f32> = told.collect();
    std::array::from_fn(|output| {
        let sum: f32 =
            told.iter().enumerate().map(|(i, x)| x * ((i * 7 + output * 13) as f32 * 0.37).sin()).sum();
        sum.sin()
    })
}

fn loads(vehicle: &Vehicle, anchor: &Anchor, condition: &Condition) -> Vec<(Vec3, Vec3)> {
    let fixed = anchor.static_rows(vehicle);
    let mut reading = Reading::default();
    anchor.read(vehicle, condition, &mut reading);
    let load = |(surface, fixed): (&SurfaceReading, &[f32; STATIC])| {
        let output = answer(&reading.global, fixed, &surface.told());
        (surface.force(&output), surface.moment(&output))
    };
    reading.surfaces.iter().zip(&fixed).map(load).collect()
}

#[test]
fn a_mirror_image_of_the_state_gets_the_mirror_image_of_any_answer() {
    let reflect = |v: Vec3| Vec3::new(v.x, -v.y, v.z);
    // a moment is an axial vector
    let reflect_moment = |m: Vec3| -reflect(m);
    for (name, vehicle, anchor) in anchors() {
        for state in states() {
            let velocity = reflect(state.velocity);
            let up = UnitVector3::new_unchecked(reflect(state.up.into_inner()));
            let mirrored = Condition { velocity, ground_velocity: velocity, up, ..state };
            let (here, there) = (loads(&vehicle, &anchor, &state), loads(&vehicle, &anchor, &mirrored));
            let scale: f64 = here.iter().map(|(force, _)| force.norm()).sum();
            for (index, surface) in vehicle.surfaces.iter().enumerate() {
                let partner = there[surface.mirror_left_right];
                assert!(
                    (here[index].0 - reflect(partner.0)).norm() < 1e-4 * scale,
                    "{name} {}",
                    surface.name
                );
                assert!(
                    (here[index].1 - reflect_moment(partner.1)).norm() < 1e-4 * scale,
                    "{name} {}",
                    surface.name
                );
            }
        }
    }
}

#[test]
fn at_rest_the_surfaces_feel_archimedes_and_nothing_else() {
    for name in crate::common::VEHICLES {
        let vehicle = vehicle(name);
        for contact in [GroundContact::Wetted, GroundContact::Dry] {
            let level = Condition::level(Vec3::zeros(), 0.15);
            let state = Condition { ground_contact: contact, ..level };
            let reading = read(&vehicle, &state);
            let net: Vec3 = reading.surfaces.iter().map(|s| s.hydrostatic.force).sum();
            let truth: Vec3 = wade_core::analytic::loads(&vehicle, &state).iter().sum();
            assert!((net - truth).norm() < 1e-6 * truth.norm(), "{name}: {net} {truth}");
            assert!(reading.surfaces.iter().all(|s| s.unit == 0.0 && s.drag == Vec3::zeros()));
        }
    }
}

#[test]
fn a_dry_surface_has_nothing_and_gets_wet_without_a_jump() {
    for (name, vehicle, anchor) in anchors() {
        let mut reading = Reading::default();
        let mut before: Option<Vec<f64>> = None;
        for step in 0..4000 {
            let depth = 1e-4 * f64::from(step);
            anchor.read(&vehicle, &Condition::level(Vec3::new(0.9, 0.3, 0.0), depth), &mut reading);
            for surface in reading.surfaces.iter().filter(|s| s.wet_fraction == 0.0) {
                assert_eq!((surface.unit, surface.drag, surface.hydrostatic.force), Default::default());
            }
            let sizes: Vec<f64> = reading
                .surfaces
                .iter()
                .map(|s| s.drag.norm() + s.hydrostatic.force.norm() + s.unit)
                .collect();
            if let Some(before) = &before {
                for (now, before) in sizes.iter().zip(before) {
                    assert!(
                        (now - before).abs() < 5.0,
                        "{name} at {depth}: from {before} to {now} N in 0.1 mm"
                    );
                }
            }
            before = Some(sizes);
        }
    }
}

#[test]
fn no_load_steps_where_the_water_reaches_a_level_face() {
    const NEAR: f64 = 1e-7;
    for (name, vehicle, anchor) in anchors() {
        let mesh = &vehicle.hull.mesh;
        let mut levels: Vec<f64> = mesh.vertices.iter().map(|vertex| vertex.z - vehicle.z0).collect();
        levels.sort_by(f64::total_cmp);
        levels.dedup_by(|next, kept| *next - *kept < 1e-5);
        for velocity in [Vec3::new(3.0, 0.8, 0.0), Vec3::new(-0.7, 0.2, 0.0), Vec3::new(0.0, 1.0, 0.0)] {
            let at = |depth: f64| loads(&vehicle, &anchor, &Condition::level(velocity, depth));
            for &level in levels.iter().filter(|level| **level > 1e-3) {
                let (below, above) = (at(level - NEAR), at(level + NEAR));
                let scale: f64 = above.iter().map(|(force, _)| force.norm()).sum();
                for (index, surface) in vehicle.surfaces.iter().enumerate() {
                    let step = (above[index].0 - below[index].0).norm();
                    assert!(step < 1e-4 * scale, "{name} {} at {level} m: {step} of {scale} N", surface.name);
                }
            }
        }
    }
}

#[test]
fn a_force_acts_where_the_water_may_reach_and_has_the_moment_of_the_answer_where_it_can() {
    for name in crate::common::VEHICLES {
        let vehicle = vehicle(name);
        let fixed = Anchor::new(&vehicle, Remainder::OfDrag).static_rows(&vehicle);
        let (mut held, mut moved) = (0, 0);
        for state in states() {
            let reading = read(&vehicle, &state);
            for (surface, fixed) in reading.surfaces.iter().zip(&fixed).filter(|(s, _)| s.wet_fraction > 0.0)
            {
                let output = answer(&reading.global, fixed, &surface.told()).map(|x| 0.02 * x);
                let load = surface.load(&output);
                let [low, high] = surface.reach;
                let strictly = |margin: f64| {
                    (0..3).all(|i| load.point[i] > low[i] + margin && load.point[i] < high[i] - margin)
                };
                assert!(strictly(-1e-9), "{name}: {} in {low} {high}", load.point);
                if !strictly(1e-9) {
                    held += 1;
                    continue;
                }
                moved += 1;
                // what of a moment is along the force no point gives it
                let moment = surface.hydrostatic.moment - surface.center.cross(&surface.hydrostatic.force)
                    + surface.moment(&output);
                let served = (load.point - surface.center).cross(&load.force);
                let along = load.force.normalize();
                let across = moment - along * moment.dot(&along);
                let size = load.force.norm() * (high - low).norm();
                assert!((served - across).norm() < 1e-9 * size, "{name}: {served} {across}");
            }
        }
        assert!(moved > 100 && held > 0, "{moved} inside, {held} at an edge");
    }
}
