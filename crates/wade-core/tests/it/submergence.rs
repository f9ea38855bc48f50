//! Sampled submergence against the obvious loop, and against geometry.

#![allow(clippy::unwrap_used)]

use std::sync::LazyLock;

use nalgebra::UnitVector3;
use proptest::prelude::*;
use wade_core::frame::{Vec3, WaterPlane, up_from_roll_pitch};
use wade_core::geometry::submergence::{Samples, SamplesError, Submergence, SurfaceSamples};
use wade_core::vehicle::shipped::{husky, warthog};
use wade_core::vehicle::{SurfaceKind, Vehicle};

static HUSKY: LazyLock<Vehicle> = LazyLock::new(|| husky().unwrap().vehicle().unwrap());
static WARTHOG: LazyLock<Vehicle> = LazyLock::new(|| warthog().unwrap().vehicle().unwrap());

/// The definition in the source paper, point by point.
fn brute(samples: &SurfaceSamples, plane: &WaterPlane) -> Submergence {
    let points: Vec<Vec3> = samples.points().map(|p| Vec3::from(p.map(f64::from))).collect();
    let wet: Vec<&Vec3> = points.iter().filter(|p| plane.depth_below(p) >= 0.0).collect();
    if wet.is_empty() {
        return Submergence::default();
    }
    let n = wet.len() as f64;
    Submergence {
        fraction: n / points.len() as f64,
        mean_depth: wet.iter().map(|p| plane.depth_below(p)).sum::<f64>() / n,
        wet_centroid: wet.iter().copied().sum::<Vec3>() / n,
    }
}

fn close(a: &Submergence, b: &Submergence, one_point: f64) -> bool {
    // a point within f32 rounding of the surface may fall on either side
    (a.fraction - b.fraction).abs() <= one_point * 1.01
        && (a.mean_depth - b.mean_depth).abs() < 1e-5 + 2.0 * one_point
        && (a.wet_centroid - b.wet_centroid).norm() < 1e-5 + 4.0 * one_point
}

proptest! {
    #[test]
    fn level_water_agrees_with_brute_force(depth in -0.05..0.9) {
        for vehicle in [&*HUSKY, &*WARTHOG] {
            let plane = WaterPlane::level(vehicle.z0, depth);
            for samples in &vehicle.samples.surfaces {
                let (fast, slow) = (samples.submergence(&plane), brute(samples, &plane));
                prop_assert_eq!(fast.fraction, slow.fraction);
                prop_assert!((fast.mean_depth - slow.mean_depth).abs() < 1e-12);
                prop_assert!((fast.wet_centroid - slow.wet_centroid).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn tilted_water_agrees_with_brute_force(
        x in -1.0..1.0, y in -1.0..1.0, z in -1.0..1.0, offset in -1.0..1.0,
    ) {
        let up = Vec3::new(x, y, z);
        prop_assume!(up.norm() > 0.1);
        let plane = WaterPlane { normal: UnitVector3::new_normalize(up), offset };
        for samples in HUSKY.samples.surfaces.iter().chain(&WARTHOG.samples.surfaces) {
            let one_point = 1.0 / samples.len() as f64;
            prop_assert!(close(&samples.submergence(&plane), &brute(samples, &plane), one_point));
        }
    }

    #[test]
    fn more_water_never_wets_less(depth in 0.0..0.8, more in 0.0..0.2, roll in -0.5..0.5, pitch in -0.5..0.5) {
        let up = up_from_roll_pitch(roll, pitch);
        for samples in &WARTHOG.samples.surfaces {
            let at = |d| samples.submergence(&WaterPlane::new(WARTHOG.z0, d, up)).fraction;
            prop_assert!(at(depth) <= at(depth + more));
        }
    }

    #[test]
    fn a_mirrored_state_has_mirrored_submergence_bit_for_bit(depth in 0.0..0.5, roll in -0.4..0.4, pitch in -0.4..0.4) {
        for vehicle in [&*HUSKY, &*WARTHOG] {
            let plane = WaterPlane::new(vehicle.z0, depth, up_from_roll_pitch(roll, pitch));
            let mirrored = WaterPlane::new(vehicle.z0, depth, up_from_roll_pitch(-roll, pitch));
            for (s, surface) in vehicle.surfaces.iter().enumerate() {
                let own_image = surface.mirror_left_right == s;
                let here = vehicle.samples.surfaces[s].submergence(&plane);
                let there = vehicle.samples.surfaces[surface.mirror_left_right].submergence(&mirrored);
                prop_assert_eq!(here.fraction, there.fraction);
                // its own image sums the same points in another order
                let tolerance = if own_image { 1e-6 } else { 0.0 };
                prop_assert!((here.mean_depth - there.mean_depth).abs() <= tolerance);
                prop_assert!((here.wet_centroid.y + there.wet_centroid.y).abs() <= tolerance);
                prop_assert!((here.wet_centroid.x - there.wet_centroid.x).abs() <= tolerance);
            }
        }
    }
}

#[test]
fn a_husky_turned_round_has_the_submergence_of_its_counterparts() {
    let plane = |pitch: f64| WaterPlane::new(HUSKY.z0, 0.15, up_from_roll_pitch(0.0, pitch));
    for (s, surface) in HUSKY.surfaces.iter().enumerate() {
        let other = surface.mirror_front_rear.unwrap_or(s);
        let here = HUSKY.samples.surfaces[s].submergence(&plane(0.1));
        let there = HUSKY.samples.surfaces[other].submergence(&plane(-0.1));
        assert!(
            (here.fraction - there.fraction).abs() < 1e-12 || surface.mirror_front_rear.is_none(),
            "{}",
            surface.name
        );
    }
}

#[test]
fn dry_is_exactly_zero_and_drowned_is_exactly_one() {
    for vehicle in [&*HUSKY, &*WARTHOG] {
        for up in
            [Vec3::z_axis(), up_from_roll_pitch(0.1, -0.1), up_from_roll_pitch(std::f64::consts::PI, 0.0)]
        {
            for samples in &vehicle.samples.surfaces {
                let dry = samples.submergence(&WaterPlane { normal: up, offset: -3.0 });
                assert_eq!(dry, Submergence::default());
                let drowned = samples.submergence(&WaterPlane { normal: up, offset: 3.0 });
                assert_eq!(drowned.fraction, 1.0);
                assert!((drowned.mean_depth - (3.0 - up.dot(&drowned.wet_centroid))).abs() < 1e-5);
            }
        }
    }
}

#[test]
fn a_level_plane_that_looks_down_is_an_overturned_vehicle() {
    let plane = WaterPlane { normal: -Vec3::z_axis(), offset: 0.1 };
    for samples in &HUSKY.samples.surfaces {
        assert!(close(&samples.submergence(&plane), &brute(samples, &plane), 1.0 / samples.len() as f64));
    }
}

#[test]
fn samples_stand_for_the_area_under_water() {
    // half-immersed wheels, and all surfaces drowned: the centroid of the samples is that of the area
    for (s, surface) in HUSKY.surfaces.iter().enumerate() {
        let samples = &HUSKY.samples.surfaces[s];
        if surface.kind == SurfaceKind::Wheel {
            let half = samples.submergence(&WaterPlane::level(HUSKY.z0, 0.1778));
            assert!((half.fraction - 0.5).abs() < 0.02, "{}: {half:?}", surface.name);
        }
        let all = samples.submergence(&WaterPlane::level(HUSKY.z0, 1.0));
        assert!((all.wet_centroid - surface.centroid).norm() < 0.02, "{}: {all:?}", surface.name);
    }
}

#[test]
fn the_number_of_samples_follows_the_area() {
    let total: usize = WARTHOG.samples.surfaces.iter().map(SurfaceSamples::len).sum();
    assert!((4000..4500).contains(&total));
    let area: f64 = WARTHOG.surfaces.iter().map(|s| s.area).sum();
    for (samples, surface) in WARTHOG.samples.surfaces.iter().zip(&WARTHOG.surfaces) {
        assert!(samples.len() >= 64);
        let expected = (4096.0 * surface.area / area).max(64.0);
        assert!((samples.len() as f64 - expected).abs() < 5.0, "{}", surface.name);
    }
}

#[test]
fn the_same_mesh_gives_the_same_points() {
    assert_eq!(husky().unwrap().vehicle().unwrap().samples, HUSKY.samples);
}

#[test]
fn points_below_the_ground_are_dropped() {
    let mut shipped = husky().unwrap();
    shipped.spec.z0_m = Some(-0.1);
    let vehicle = shipped.vehicle().unwrap();
    let lowest = vehicle.samples.points().iter().map(|p| p[2]).fold(f32::INFINITY, f32::min);
    assert!((-0.1001..-0.09).contains(&lowest), "{lowest}");
}

#[test]
fn parts_restore_the_samples() {
    let s = &HUSKY.samples;
    assert_eq!(&Samples::from_parts(&s.points(), &s.normals(), &s.offsets()).unwrap(), s);
}

#[test]
fn damaged_parts_are_refused_by_name() {
    let up = [0.0, 0.0, 1.0];
    let from = |z: &[f32], offsets: &[usize]| {
        let points: Vec<[f32; 3]> = z.iter().map(|z| [0.0, 0.0, *z]).collect();
        Samples::from_parts(&points, &vec![up; points.len()], offsets)
    };
    assert!(from(&[0.0, 1.0], &[0, 1, 2]).is_ok());
    assert_eq!(from(&[0.0, -1.0], &[0, 2]), Err(SamplesError::Unsorted { index: 1 }));
    assert_eq!(from(&[0.0, f32::NAN], &[0, 2]), Err(SamplesError::NotFinite { index: 1 }));
    assert_eq!(from(&[0.0, 1.0], &[0, 2, 2]), Err(SamplesError::EmptySurface { surface: 1 }));
    assert_eq!(from(&[0.0, 1.0], &[0, 3, 2]), Err(SamplesError::EmptySurface { surface: 1 }));
    assert_eq!(from(&[0.0, 1.0], &[0, 3]), Err(SamplesError::Lengths { points: 2, normals: 2, end: 3 }));
    assert_eq!(from(&[], &[]), Err(SamplesError::Lengths { points: 0, normals: 0, end: 0 }));
}
