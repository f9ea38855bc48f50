//! The signed distance grid against closed forms, on coarse grids.

#![allow(clippy::unwrap_used)]

use std::sync::atomic::{AtomicUsize, Ordering};

use wade::frame::Vec3;
use wade::geometry::distance::{GridError, SignedDistanceGrid};
use wade::geometry::mesh::{Bounds, Mesh};
use wade::geometry::parametric::{cuboid, sphere};

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
