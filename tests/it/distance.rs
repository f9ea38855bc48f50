//! The signed distance grid against closed forms on coarse grids, and the paper's grid of the shipped hulls against brute force.

#![allow(clippy::unwrap_used)]

use std::sync::atomic::{AtomicUsize, Ordering};

use wade_core::frame::Vec3;
use wade_core::geometry::distance::{CELLS, GridError, MARGIN, SignedDistanceGrid};
use wade_core::geometry::mesh::{Bounds, Mesh};
use wade_core::geometry::parametric::{cuboid, sphere};

fn quiet(_: usize, _: usize) {}

fn box_distance(p: &Vec3, half: &Vec3) -> f64 {
    let q = p.abs() - half;
    q.sup(&Vec3::zeros()).norm() + q.max().min(0.0)
}

#[test]
fn a_box_has_the_distance_of_the_closed_form() {
    let half = Vec3::new(0.5, 0.4, 0.3);
    let mesh = cuboid(&Bounds { min: -half, max: half });
    let grid = SignedDistanceGrid::with_spacing(&mesh, 0.1, 0.5, &quiet).unwrap();
    for (n, value) in grid.values.iter().enumerate() {
        let (i, j, k) =
            (n % grid.shape[0], n / grid.shape[0] % grid.shape[1], n / grid.shape[0] / grid.shape[1]);
        let point = grid.origin + Vec3::new(i as f64, j as f64, k as f64) * grid.spacing;
        assert!((f64::from(*value) - box_distance(&point, &half)).abs() < 1e-6, "{point:?}: {value}");
    }
    assert!((grid.sample(&Vec3::zeros()).unwrap() + 0.3).abs() < 0.05);
}

#[test]
fn a_sphere_is_negative_inside_and_rises_by_a_metre_a_metre() {
    let grid = SignedDistanceGrid::with_spacing(&sphere(&Vec3::zeros(), 0.5, 64), 0.05, 0.5, &quiet).unwrap();
    for direction in
        [Vec3::x(), Vec3::new(1.0, -2.0, 0.5).normalize(), Vec3::new(-0.3, 0.2, -0.9).normalize()]
    {
        for distance in [-0.3, -0.1, 0.0, 0.2, 0.4] {
            let value = grid.sample(&(direction * (0.5 + distance))).unwrap();
            assert!((value - distance).abs() < 5e-3, "{direction:?} {distance}: {value}");
        }
    }
}

#[test]
fn the_margin_is_covered_and_beyond_it_there_is_no_answer() {
    let mesh = cuboid(&Bounds { min: Vec3::new(0.0, 0.0, 0.0), max: Vec3::new(1.0, 0.5, 0.25) });
    let grid = SignedDistanceGrid::with_spacing(&mesh, 0.13, 0.5, &quiet).unwrap();
    assert!(grid.sample(&Vec3::new(-0.499, -0.499, -0.499)).is_some());
    assert!(grid.sample(&Vec3::new(1.499, 0.999, 0.749)).is_some());
    assert_eq!(grid.sample(&Vec3::new(1.7, 0.0, 0.0)), None);
    assert_eq!(grid.sample(&Vec3::new(f64::NAN, 0.0, 0.0)), None);
}

/// Distance to a triangle by the regions of Ericson, Real-Time Collision Detection, section 5.1.5.
fn to_triangle(p: &Vec3, [a, b, c]: [Vec3; 3]) -> f64 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ap.norm();
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return bp.norm();
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (ap - ab * (d1 / (d1 - d3))).norm();
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return cp.norm();
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (ap - ac * (d2 / (d2 - d6))).norm();
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return (bp - (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))).norm();
    }
    let sum = va + vb + vc;
    (ap - ab * (vb / sum) - ac * (vc / sum)).norm()
}

/// Times that the faces wind around a point, by the solid angles of Van Oosterom and Strackee: 1 inside, 0 outside.
fn winding(p: &Vec3, faces: &[[Vec3; 3]]) -> f64 {
    let angle = |[a, b, c]: &[Vec3; 3]| {
        let (a, b, c) = (a - p, b - p, c - p);
        let (x, y, z) = (a.norm(), b.norm(), c.norm());
        let denominator = x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y;
        2.0 * a.dot(&b.cross(&c)).atan2(denominator)
    };
    faces.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

#[test]
fn the_grid_that_the_command_writes_is_the_papers_and_agrees_with_every_face_taken_one_by_one() {
    for vehicle in ["husky", "warthog"] {
        let folder = tempfile::TempDir::new().unwrap();
        let out = folder.path().join("grid.safetensors");
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_wade"))
            .args(["vehicle", "sdf", vehicle, "--out", out.to_str().unwrap()])
            .env("WADE_VEHICLES", crate::common::vehicles())
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let grid = wade_core::bundle::distance_of(&std::fs::read(out).unwrap()).unwrap();
        let mesh =
            wade_core::bundle::read(&crate::common::vehicles().join(vehicle)).unwrap().vehicle.hull.mesh;
        let bounds = mesh.bounds().unwrap();
        assert!((grid.spacing - bounds.extent().max() / CELLS).abs() < 1e-12);
        let last = Vec3::from(grid.shape.map(|points| (points - 1) as f64)) * grid.spacing + grid.origin;
        for axis in 0..3 {
            let margins = [bounds.min[axis] - grid.origin[axis], last[axis] - bounds.max[axis]];
            assert!(
                margins.iter().all(|m| (MARGIN - 1e-9..MARGIN + grid.spacing).contains(m)),
                "{margins:?}"
            );
        }
        let faces: Vec<[Vec3; 3]> =
            mesh.faces.iter().map(|face| face.map(|index| mesh.vertices[index as usize])).collect();
        // a prime, so that every part of the grid is looked at
        let sampled = (0..grid.values.len()).step_by(2_503);
        let (mut inside, mut outside) = (0, 0);
        for n in sampled {
            let (i, j) = (n % grid.shape[0], n / grid.shape[0] % grid.shape[1]);
            let k = n / grid.shape[0] / grid.shape[1];
            let point = grid.origin + Vec3::new(i as f64, j as f64, k as f64) * grid.spacing;
            let nearest = faces.iter().map(|face| to_triangle(&point, *face)).fold(f64::INFINITY, f64::min);
            let value = f64::from(grid.values[n]);
            // stored in sixteen bits
            assert!((value.abs() - nearest).abs() < 1e-4, "{vehicle} {point:?}: {value}, {nearest}");
            if nearest > 1e-3 {
                let is_inside = winding(&point, &faces) > 0.5;
                assert_eq!(value < 0.0, is_inside, "{vehicle} {point:?}: {value}");
                *(if is_inside { &mut inside } else { &mut outside }) += 1;
            }
        }
        assert!(inside > 5 && outside > 100, "{inside} inside, {outside} outside");
    }
}

#[test]
fn progress_counts_every_slice_once() {
    let (calls, last) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let mesh = cuboid(&Bounds { min: Vec3::repeat(0.0), max: Vec3::repeat(1.0) });
    let progress = |done: usize, total: usize| {
        assert!(done <= total);
        calls.fetch_add(1, Ordering::Relaxed);
        last.fetch_max(done, Ordering::Relaxed);
    };
    let grid = SignedDistanceGrid::with_spacing(&mesh, 0.2, 0.5, &progress).unwrap();
    assert_eq!((calls.into_inner(), last.into_inner()), (grid.shape[2], grid.shape[2]));
}

#[test]
fn impossible_grids_are_refused() {
    assert_eq!(SignedDistanceGrid::build(&Mesh::default(), &quiet), Err(GridError::Empty));
    let speck = cuboid(&Bounds { min: Vec3::zeros(), max: Vec3::repeat(1e-4) });
    assert!(matches!(SignedDistanceGrid::build(&speck, &quiet), Err(GridError::TooLarge { .. })));
    let parts =
        |spacing, shape, values| SignedDistanceGrid::from_parts(Vec3::zeros(), spacing, shape, values);
    assert!(parts(0.1, [2, 2, 2], vec![0.0; 8]).is_ok());
    assert!(matches!(parts(0.1, [2, 2, 2], vec![0.0; 7]), Err(GridError::Shape { .. })));
    assert!(matches!(parts(0.0, [2, 2, 2], vec![0.0; 8]), Err(GridError::Shape { .. })));
    assert!(matches!(parts(0.1, [1, 2, 4], vec![0.0; 8]), Err(GridError::Shape { .. })));
    assert!(matches!(parts(0.1, [usize::MAX, 2, 2], vec![]), Err(GridError::TooLarge { .. })));
    assert_eq!(parts(0.1, [2, 2, 2], vec![f32::NAN; 8]), Err(GridError::NotFinite { index: 0 }));
}
