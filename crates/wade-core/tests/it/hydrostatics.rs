//! Pressure loads against closed forms, for any attitude of the water.

#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;

use nalgebra::{Rotation3, UnitVector3};
use proptest::prelude::*;
use wade_core::frame::{GRAVITY, Vec3, WaterPlane, up_from_roll_pitch};
use wade_core::geometry::hydrostatics::{hydrostatics, surface_hydrostatics};
use wade_core::geometry::mesh::{Bounds, Mesh};
use wade_core::geometry::parametric::{cuboid, cylinder, sphere};
use wade_core::geometry::surfaces::Hull;
use wade_core::wrench::Wrench;

const RHO: f64 = 1025.0;

fn cube(x: f64, y: f64, z: f64) -> Mesh {
    let half = Vec3::new(x, y, z) * 0.5;
    cuboid(&Bounds { min: -half, max: half })
}

fn plane(up: Vec3, offset: f64) -> WaterPlane {
    WaterPlane { normal: UnitVector3::new_normalize(up), offset }
}

#[test]
fn a_level_box_displaces_its_draft() {
    let h = hydrostatics(&cube(2.0, 1.0, 0.5), &plane(Vec3::z(), -0.1), RHO, &Vec3::new(1.0, 0.0, 0.0));
    let draft = 0.15;
    assert!((h.displaced_volume - 2.0 * draft).abs() < 1e-12);
    assert!((h.wrench.force.z - RHO * GRAVITY * 2.0 * draft).abs() < 1e-8);
    // acts on the axis, one metre behind the reference point: nose up is negative pitch
    assert!((h.wrench.moment - Vec3::new(0.0, h.wrench.force.z, 0.0)).norm() < 1e-8);
    assert!((h.waterplane_area - 2.0).abs() < 1e-12);
    assert!((h.wetted_area - (2.0 + 6.0 * draft)).abs() < 1e-12);
    assert!((h.center_of_buoyancy.unwrap() - Vec3::new(0.0, 0.0, -0.25 + draft / 2.0)).norm() < 1e-12);
}

#[test]
fn a_heeled_box_has_the_metacenter_of_the_wall_sided_formula() {
    // B(phi) of a wall-sided hull about its level center of buoyancy: BM tan(phi) sideways, BM tan^2(phi)/2 up
    let (length, beam, draft, heel) = (2.0, 1.0, 0.2, 0.1_f64);
    let up = up_from_roll_pitch(heel, 0.0);
    let water = WaterPlane::new(-0.25, draft, up);
    let h = hydrostatics(&cube(length, beam, 0.5), &water, RHO, &Vec3::zeros());
    let metacentric_radius = beam * beam / (12.0 * draft);
    let expected = Vec3::new(
        0.0,
        -metacentric_radius * heel.tan(),
        -0.25 + draft / 2.0 + 0.5 * metacentric_radius * heel.tan().powi(2),
    );
    assert!((h.center_of_buoyancy.unwrap() - expected).norm() < 1e-12);
    assert!((h.displaced_volume - length * beam * draft).abs() < 1e-12);
    assert!((h.waterplane_area - length * beam / heel.cos()).abs() < 1e-12);
}

#[test]
fn a_corner_of_a_box_displaces_a_tetrahedron() {
    // the plane cuts 0.3 m off each of the three edges at the lowest corner
    let corner = Vec3::new(-0.5, -0.5, -0.5);
    let up = Vec3::new(1.0, 1.0, 1.0);
    let water = plane(up, up.normalize().dot(&(corner + Vec3::new(0.3, 0.0, 0.0))));
    let h = hydrostatics(&cube(1.0, 1.0, 1.0), &water, RHO, &Vec3::zeros());
    assert!((h.displaced_volume - 0.3_f64.powi(3) / 6.0).abs() < 1e-14);
    assert!((h.center_of_buoyancy.unwrap() - corner - Vec3::repeat(0.3 / 4.0)).norm() < 1e-12);
    assert!((h.waterplane_area - 0.09 * 3.0_f64.sqrt() / 2.0).abs() < 1e-12);
}

#[test]
fn a_lying_cylinder_displaces_a_circular_segment_to_one_percent() {
    let (radius, width) = (0.3, 0.25);
    let wheel = cylinder(&Vec3::zeros(), radius, width, 64);
    for depth in [0.06, 0.1, 0.3, 0.5, 0.6] {
        let water = plane(Vec3::z(), depth - radius);
        let h = hydrostatics(&wheel, &water, RHO, &Vec3::zeros());
        let angle = ((radius - depth) / radius).clamp(-1.0, 1.0).acos();
        let segment = radius * radius * (angle - angle.sin() * angle.cos());
        assert!((h.displaced_volume / (segment * width) - 1.0).abs() < 0.01, "depth {depth}");
        let lever = 2.0 / 3.0 * (radius * angle.sin()).powi(3) / segment;
        assert!((h.center_of_buoyancy.unwrap().z + lever).abs() < 0.01 * radius, "depth {depth}");
    }
}

#[test]
fn a_sphere_displaces_a_spherical_cap_whatever_is_up() {
    let (radius, depth) = (0.5, 0.3);
    let ball = sphere(&Vec3::zeros(), radius, 128);
    let cap = PI * depth * depth * (3.0 * radius - depth) / 3.0;
    let below = 3.0 * (2.0 * radius - depth).powi(2) / (4.0 * (3.0 * radius - depth));
    for up in [Vec3::z(), -Vec3::z(), Vec3::x(), Vec3::new(0.3, -0.5, 0.8)] {
        let water = plane(up, depth - radius);
        let h = hydrostatics(&ball, &water, RHO, &Vec3::zeros());
        assert!((h.displaced_volume / cap - 1.0).abs() < 3e-3);
        assert!((h.center_of_buoyancy.unwrap() + water.normal.into_inner() * below).norm() < 1e-3);
        assert!((h.waterplane_area / (PI * depth * (2.0 * radius - depth)) - 1.0).abs() < 3e-3);
    }
}

#[test]
fn a_drowned_body_feels_archimedes_at_its_centroid() {
    let (center, up) = (Vec3::new(0.4, -0.2, 0.1), Vec3::new(0.2, 0.3, 0.9));
    let mut body = cube(0.6, 0.4, 0.2);
    body.vertices.iter_mut().for_each(|v| *v += center);
    let h = hydrostatics(&body, &plane(up, 5.0), RHO, &Vec3::zeros());
    let force = up.normalize() * (RHO * GRAVITY * 0.6 * 0.4 * 0.2);
    assert!((h.wrench.force - force).norm() < 1e-9 * force.norm());
    assert!((h.wrench.moment - center.cross(&force)).norm() < 1e-9 * force.norm());
    assert!((h.center_of_buoyancy.unwrap() - center).norm() < 1e-9);
    assert!(h.waterplane_area.abs() < 1e-12);
}

#[test]
fn a_dry_body_feels_nothing() {
    let h = hydrostatics(&cube(1.0, 1.0, 1.0), &plane(Vec3::z(), -0.5), RHO, &Vec3::x());
    assert_eq!(h, Default::default());
}

#[test]
fn the_surfaces_add_up_to_the_hull() {
    let mesh = cylinder(&Vec3::new(0.1, 0.2, 0.3), 0.4, 0.3, 24);
    let face_surface = (0..mesh.faces.len()).map(|f| (f % 3) as u16).collect();
    let hull = Hull { mesh, face_surface };
    let (water, about) = (plane(Vec3::new(0.1, -0.2, 0.9), 0.25), Vec3::new(-1.0, 0.5, 0.0));
    let whole = hydrostatics(&hull.mesh, &water, RHO, &about).wrench;
    let parts = surface_hydrostatics(&hull, 3, &water, RHO, &about);
    let sum = parts.iter().fold(Wrench::default(), |sum, w| sum + *w);
    assert!(parts.iter().all(|w| w.force.norm() > 1.0));
    assert!(
        (sum.force - whole.force).norm() + (sum.moment - whole.moment).norm() < 1e-9 * whole.force.norm()
    );
}

fn attitude() -> impl Strategy<Value = Vec3> {
    (-1.0..1.0, -1.0..1.0, -1.0..1.0)
        .prop_map(|(x, y, z)| Vec3::new(x, y, z))
        .prop_filter("a direction", |v| v.norm() > 0.1)
}

proptest! {
    #[test]
    fn force_is_along_up_for_a_closed_hull(up in attitude(), offset in -0.6..0.6) {
        let water = plane(up, offset);
        let wheel = cylinder(&Vec3::new(0.2, 0.1, 0.0), 0.4, 0.3, 17);
        let force = hydrostatics(&wheel, &water, RHO, &Vec3::zeros()).wrench.force;
        let across = force - water.normal.into_inner() * force.dot(&water.normal);
        prop_assert!(across.norm() < 1e-9 * RHO * GRAVITY);
        prop_assert!(force.dot(&water.normal) >= -1e-9);
    }

    #[test]
    fn moving_body_and_water_together_changes_nothing_else(
        up in attitude(), offset in -0.4..0.4, axis in attitude(), shift in attitude(), angle in -3.0..3.0,
    ) {
        let (water, body) = (plane(up, offset), cube(0.9, 0.7, 0.5));
        let rotation = Rotation3::from_axis_angle(&UnitVector3::new_normalize(axis), angle);
        let mut moved = body.clone();
        moved.vertices.iter_mut().for_each(|v| *v = rotation * *v + shift);
        let normal = rotation * water.normal;
        let water_moved = WaterPlane { normal, offset: offset + normal.dot(&shift) };
        let a = hydrostatics(&body, &water, RHO, &Vec3::zeros());
        let b = hydrostatics(&moved, &water_moved, RHO, &shift);
        prop_assert!((rotation * a.wrench.force - b.wrench.force).norm() < 1e-7);
        prop_assert!((rotation * a.wrench.moment - b.wrench.moment).norm() < 1e-7);
        prop_assert!((a.wetted_area - b.wetted_area).abs() < 1e-9);
        prop_assert!((a.waterplane_area - b.waterplane_area).abs() < 1e-9);
    }

    #[test]
    fn loads_are_linear_in_density_to_the_last_bit(up in attitude(), offset in -0.4..0.4, power in -3..4) {
        // scaling by a power of two is exact in binary, so equality may be demanded
        let (water, body, factor) = (plane(up, offset), cube(0.9, 0.7, 0.5), 2f64.powi(power));
        let one = hydrostatics(&body, &water, RHO, &Vec3::x()).wrench;
        let scaled = hydrostatics(&body, &water, RHO * factor, &Vec3::x()).wrench;
        prop_assert_eq!(one.force * factor, scaled.force);
        prop_assert_eq!(one.moment * factor, scaled.moment);
    }
}
