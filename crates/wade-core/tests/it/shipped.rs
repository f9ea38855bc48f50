//! The shipped hulls against the sealed public meshes they stand for.
//!
//! Facts: force, moment about the public meshes' link origin and wetted area in fresh water at g = 9.81, computed from
//! the public Clearpath meshes with every part sealed by its convex hull. Positive pitch lowers the nose.

#![allow(clippy::unwrap_used)]

use wade_core::condition::FRESH_WATER;
use wade_core::frame::{GRAVITY, Vec3, WaterPlane, up_from_roll_pitch};
use wade_core::geometry::hydrostatics::{Hydrostatics, hydrostatics};
use wade_core::vehicle::Vehicle;
use wade_core::vehicle::shipped::{husky, warthog};

/// Depth [m], pitch and roll [degrees], force [N], moment about x and y [N m], wetted area [m2].
type Row = (f64, f64, f64, [f64; 3], [f64; 2], f64);

#[rustfmt::skip]
const HUSKY: &[Row] = &[
    (0.06, 0.0, 0.0, [0.0, 0.0, 48.7], [0.0, 0.0], 0.218),
    (0.06, 5.0, 0.0, [-4.5, 0.0, 51.1], [0.0, -6.9], 0.221),
    (0.06, 10.0, 0.0, [-10.2, 0.0, 58.1], [0.0, -13.3], 0.229),
    (0.06, 0.0, 5.0, [0.0, 4.5, 51.1], [-8.0, -0.0], 0.220),
    (0.1, 0.0, 0.0, [0.0, 0.0, 101.5], [0.0, -0.0], 0.354),
    (0.1, 5.0, 0.0, [-9.0, 0.0, 102.6], [0.0, -8.4], 0.357),
    (0.1, 10.0, 0.0, [-19.7, 0.0, 111.8], [0.0, -18.3], 0.432),
    (0.1, 0.0, 5.0, [0.0, 9.0, 102.5], [-9.5, 0.0], 0.356),
    (0.14, 0.0, 0.0, [0.0, 0.0, 161.4], [0.0, 0.0], 0.499),
    (0.14, 5.0, 0.0, [-16.2, 0.0, 184.9], [0.0, -15.2], 0.682),
    (0.14, 10.0, 0.0, [-38.7, 0.0, 219.5], [0.0, -33.4], 0.734),
    (0.14, 0.0, 5.0, [0.0, 15.3, 175.1], [-12.5, -0.0], 0.677),
    (0.16, 0.0, 0.0, [0.0, 0.0, 251.9], [0.0, -0.0], 0.958),
    (0.16, 5.0, 0.0, [-23.1, 0.0, 263.6], [0.0, -22.9], 0.908),
    (0.16, 10.0, 0.0, [-51.8, 0.0, 294.0], [0.0, -42.2], 0.892),
    (0.16, 0.0, 5.0, [0.0, 22.6, 258.6], [-17.4, -0.0], 0.952),
    (0.18, 0.0, 0.0, [0.0, 0.0, 364.2], [0.0, -0.0], 1.113),
    (0.18, 5.0, 0.0, [-32.2, 0.0, 367.5], [0.0, -27.1], 1.106),
    (0.18, 10.0, 0.0, [-67.2, 0.0, 380.9], [0.0, -49.9], 1.056),
    (0.18, 0.0, 5.0, [0.0, 31.9, 364.5], [-19.6, 0.0], 1.101),
    (0.2, 0.0, 0.0, [0.0, 0.0, 481.3], [0.0, 0.0], 1.243),
    (0.2, 5.0, 0.0, [-42.0, 0.0, 480.0], [0.0, -28.7], 1.238),
    (0.2, 10.0, 0.0, [-84.4, 0.0, 478.7], [0.0, -54.7], 1.226),
    (0.2, 0.0, 5.0, [0.0, 41.8, 477.9], [-20.2, 0.0], 1.241),
];

#[rustfmt::skip]
const WARTHOG: &[Row] = &[
    (0.1, 0.0, 0.0, [0.0, 0.0, 244.2], [0.0, -0.1], 0.583),
    (0.1, 5.0, 0.0, [-23.0, 0.0, 263.0], [0.0, -72.9], 0.591),
    (0.1, 10.0, 0.0, [-56.6, 0.0, 321.3], [0.0, -138.2], 0.609),
    (0.1, 0.0, 5.0, [0.0, 23.6, 270.2], [-107.7, -0.1], 0.589),
    (0.1016, 0.0, 0.0, [0.0, 0.0, 250.7], [0.0, -0.1], 0.592),
    (0.1016, 5.0, 0.0, [-23.6, 0.0, 269.2], [0.0, -73.5], 0.600),
    (0.1016, 10.0, 0.0, [-57.6, 0.0, 326.5], [0.0, -139.6], 0.619),
    (0.1016, 0.0, 5.0, [0.0, 24.2, 276.2], [-108.6, -0.1], 0.598),
    (0.15, 0.0, 0.0, [0.0, 0.0, 469.5], [0.0, -0.1], 0.869),
    (0.15, 5.0, 0.0, [-42.1, 0.0, 480.8], [0.0, -87.8], 0.877),
    (0.15, 10.0, 0.0, [-91.8, 0.0, 520.9], [0.0, -172.8], 0.954),
    (0.15, 0.0, 5.0, [0.0, 42.3, 484.0], [-129.0, -0.1], 0.876),
    (0.2, 0.0, 0.0, [0.0, 0.0, 728.4], [0.0, -0.2], 1.260),
    (0.2, 5.0, 0.0, [-65.5, 0.0, 748.6], [0.0, -102.3], 1.292),
    (0.2, 10.0, 0.0, [-139.4, 0.0, 790.8], [0.0, -203.4], 1.385),
    (0.2, 0.0, 5.0, [0.0, 66.5, 760.2], [-151.2, -0.2], 1.328),
    (0.2032, 0.0, 0.0, [0.0, 0.0, 748.7], [0.0, -0.2], 1.298),
    (0.2032, 5.0, 0.0, [-67.2, 0.0, 768.2], [0.0, -103.5], 1.325),
    (0.2032, 10.0, 0.0, [-142.8, 0.0, 810.1], [0.0, -205.3], 1.415),
    (0.2032, 0.0, 5.0, [0.0, 68.3, 780.3], [-153.2, -0.2], 1.358),
    (0.25, 0.0, 0.0, [0.0, 0.0, 1085.1], [0.0, -0.2], 1.863),
    (0.25, 5.0, 0.0, [-95.7, 0.0, 1094.0], [0.0, -119.5], 1.865),
    (0.25, 10.0, 0.0, [-201.0, 0.0, 1139.9], [0.0, -242.6], 2.094),
    (0.25, 0.0, 5.0, [0.0, 96.3, 1101.2], [-179.7, -0.2], 1.856),
    (0.254, 0.0, 0.0, [0.0, 0.0, 1117.2], [0.0, -0.2], 1.912),
    (0.254, 5.0, 0.0, [-98.4, 0.0, 1124.9], [0.0, -120.4], 1.911),
    (0.254, 10.0, 0.0, [-207.3, 0.0, 1175.8], [0.0, -248.3], 2.171),
    (0.254, 0.0, 5.0, [0.0, 99.0, 1131.1], [-181.1, -0.2], 1.901),
    (0.3, 0.0, 0.0, [0.0, 0.0, 1512.3], [0.0, -0.3], 2.659),
    (0.3, 5.0, 0.0, [-137.0, 0.0, 1566.1], [0.0, -149.0], 2.980),
    (0.3, 10.0, 0.0, [-297.0, 0.0, 1684.3], [0.0, -323.7], 3.046),
    (0.3, 0.0, 5.0, [0.0, 134.1, 1533.2], [-198.6, -0.2], 2.730),
    (0.35, 0.0, 0.0, [0.0, 0.0, 2253.3], [0.1, 2.7], 4.056),
    (0.35, 5.0, 0.0, [-199.6, 0.0, 2281.4], [0.0, -212.5], 3.878),
    (0.35, 10.0, 0.0, [-414.0, 0.0, 2347.7], [0.0, -395.5], 3.856),
    (0.35, 0.0, 5.0, [0.0, 196.4, 2244.8], [-221.5, 2.5], 3.998),
    (0.4, 0.0, 0.0, [0.0, 0.0, 3131.9], [0.6, 13.4], 4.822),
    (0.4, 5.0, 0.0, [-270.7, 0.0, 3093.7], [0.0, -234.1], 4.804),
    (0.4, 10.0, 0.0, [-541.7, 0.0, 3072.0], [0.0, -444.2], 4.684),
    (0.4, 0.0, 5.0, [0.0, 271.9, 3107.9], [-218.1, 12.7], 4.817),
];

/// Height of the link origin above the ground [m].
const HUSKY_LINK: f64 = 0.1450;
const WARTHOG_LINK: f64 = 0.3177;

fn at(vehicle: &Vehicle, row: &Row, link: f64) -> Hydrostatics {
    let (depth, pitch, roll, ..) = *row;
    let up = up_from_roll_pitch(roll.to_radians(), pitch.to_radians());
    let plane = WaterPlane::new(vehicle.z0, depth, up);
    hydrostatics(&vehicle.hull.mesh, &plane, FRESH_WATER, &Vec3::new(0.0, 0.0, vehicle.z0 + link))
}

/// A row may differ by 10 % of its vertical force; a tilted one, of which the table's plane is uncertain, by 2 N more.
fn assert_forces(vehicle: &Vehicle, rows: &[Row], link: f64) {
    for row in rows {
        let force = at(vehicle, row, link).wrench.force;
        let off = (force - Vec3::from(row.3)).norm();
        let slack = if (row.1, row.2) == (0.0, 0.0) { 0.0 } else { 2.0 };
        assert!(off < 0.10 * row.3[2] + slack, "{}: {row:?} but {force:?}", vehicle.name);
    }
}

/// Moments stand for where the buoyancy acts: within `arm` metres of where it acts on the public mesh.
fn assert_moments(vehicle: &Vehicle, rows: &[Row], link: f64, arm: f64) {
    for row in rows {
        let moment = at(vehicle, row, link).wrench.moment;
        let off = (moment.xy() - nalgebra::Vector2::from(row.4)).norm() / row.3[2];
        assert!(off < arm, "{}: {row:?} but {moment:?}, {off} m off", vehicle.name);
    }
}

/// Depth at which buoyancy carries the weight [m].
fn float_depth(vehicle: &Vehicle) -> f64 {
    let lift = |depth| {
        let plane = WaterPlane::level(vehicle.z0, depth);
        hydrostatics(&vehicle.hull.mesh, &plane, FRESH_WATER, &Vec3::zeros()).wrench.force.z
    };
    let (mut low, mut high) = (0.0, vehicle.dimensions.height);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if lift(middle) < vehicle.mass * GRAVITY { low = middle } else { high = middle }
    }
    low
}

#[test]
fn the_husky_matches_the_sealed_mesh() {
    let vehicle = husky().unwrap().vehicle().unwrap();
    assert_forces(&vehicle, HUSKY, HUSKY_LINK);
    assert_moments(&vehicle, HUSKY, HUSKY_LINK, 0.02);
    assert!((float_depth(&vehicle) / 0.202 - 1.0).abs() < 0.03);
}

#[test]
fn the_warthog_matches_the_sealed_mesh() {
    let vehicle = warthog().unwrap().vehicle().unwrap();
    assert_forces(&vehicle, WARTHOG, WARTHOG_LINK);
    assert_moments(&vehicle, WARTHOG, WARTHOG_LINK, 0.02);
    assert!((float_depth(&vehicle) / 0.378 - 1.0).abs() < 0.03);
}

#[test]
fn surfaces_are_those_of_the_source_paper() {
    let names = |v: &Vehicle| v.surfaces.iter().map(|s| s.name.clone()).collect::<Vec<_>>();
    let husky = husky().unwrap().vehicle().unwrap();
    let expected = "front_lower front_mid front_upper rear_lower rear_mid rear_upper left right bottom \
                    wheel_fl wheel_fr wheel_rl wheel_rr";
    assert_eq!(names(&husky), expected.split_whitespace().collect::<Vec<_>>());
    let warthog = warthog().unwrap().vehicle().unwrap();
    let expected = "front rear left right underbody_left underbody_right wheel_fl wheel_fr wheel_rl wheel_rr";
    assert_eq!(names(&warthog), expected.split_whitespace().collect::<Vec<_>>());
}

#[test]
fn surfaces_look_where_their_name_says() {
    for vehicle in [husky().unwrap().vehicle().unwrap(), warthog().unwrap().vehicle().unwrap()] {
        for s in &vehicle.surfaces {
            let (axis, sign) = match s.name.split('_').next().unwrap() {
                "front" => (0, 1.0),
                "rear" => (0, -1.0),
                "left" => (1, 1.0),
                "right" => (1, -1.0),
                "bottom" | "underbody" => (2, -1.0),
                _ => (1, if s.name.ends_with('l') { 1.0 } else { -1.0 }),
            };
            assert!(s.normal[axis] * sign > 0.5, "{} {}: {:?}", vehicle.name, s.name, s.normal);
            let placed = s.centroid[axis] * sign > 0.0;
            assert!(placed || vehicle.name == "warthog" && axis == 2, "{}: {:?}", s.name, s.centroid);
        }
        let areas: f64 = vehicle.surfaces.iter().map(|s| s.area).sum();
        assert!((areas / vehicle.hull.mesh.area() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn mirror_partners_are_mirror_images() {
    for vehicle in [husky().unwrap().vehicle().unwrap(), warthog().unwrap().vehicle().unwrap()] {
        for s in &vehicle.surfaces {
            let p = &vehicle.surfaces[s.mirror_left_right];
            let flip = |v: Vec3| Vec3::new(v.x, -v.y, v.z);
            assert!((flip(s.centroid) - p.centroid).norm() < 1e-6, "{}", s.name);
            assert!((flip(s.normal) - p.normal).norm() < 1e-6, "{}", s.name);
        }
    }
}

#[test]
fn dry_contact_patches_take_away_the_pressure_under_the_tires() {
    // 0.157 m2 in all: the warthog-like CFD mesh loses 157, 313 and 392 N at 4, 8 and 10 in against Archimedes
    let vehicle = warthog().unwrap().vehicle().unwrap();
    for (depth, lost) in [(0.1016, 157.0), (0.2032, 313.0), (0.254, 392.0)] {
        let plane = WaterPlane::level(vehicle.z0, depth);
        let loads = vehicle.contacts.iter().map(|c| c.lost_pressure(&plane, FRESH_WATER, &Vec3::zeros()));
        let sum = loads.fold(wade_core::wrench::Wrench::default(), |a, b| a + b);
        assert!((sum.force.z + lost).abs() < 2.0, "{depth}: {sum:?}");
        assert!(sum.moment.norm() < 1e-9);
    }
}
