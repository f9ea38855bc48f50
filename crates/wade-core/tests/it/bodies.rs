//! Hulls of other kinds than the shipped ones: a box, a sphere, a car, a tub, a tracked one.

use std::collections::BTreeMap;
use std::sync::Mutex;

use nalgebra::Matrix3;
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::{Bounds, Mesh};
use wade_core::geometry::parametric::{Section, cuboid, cylinder, loft, sphere};
use wade_core::physics::Radiation;
use wade_core::vehicle::{Dimensions, Hull, Surface, SurfaceKind, Vehicle, shipped};

/// The shipped vehicles and five other bodies, all symmetric from left to right.
pub fn bodies() -> Vec<Vehicle> {
    let shipped = [shipped::husky(), shipped::warthog()].map(|v| v.expect("sound").vehicle().expect("sound"));
    let parts = |parts: &[(Mesh, SurfaceKind)]| parts.to_vec();
    let block =
        |x: f64, y: f64, z: f64| cuboid(&Bounds { min: Vec3::new(-x, -y, -z), max: Vec3::new(x, y, z) });
    let car: Vec<(Mesh, SurfaceKind)> = [(1.3, 0.75), (1.3, -0.75), (-1.3, 0.75), (-1.3, -0.75)]
        .map(|(x, y)| (cylinder(&Vec3::new(x, y, -0.42), 0.3, 0.2, 32), SurfaceKind::Wheel))
        .into_iter()
        .chain([(car_body(), SurfaceKind::Bottom)])
        .collect();
    let others = [
        body("box", 60.0, &parts(&[(block(0.5, 0.3, 0.2), SurfaceKind::Bottom)])),
        body("sphere", 260.0, &parts(&[(sphere(&Vec3::zeros(), 0.5, 32), SurfaceKind::Bottom)])),
        body("car", 1050.0, &car),
        body("tub", 90.0, &parts(&[(tub(), SurfaceKind::Bottom)])),
        tracked(),
    ];
    shipped.into_iter().chain(others).collect()
}

/// The estimated table of waves of a body; computed once.
pub fn radiation(vehicle: &Vehicle) -> Radiation {
    static KNOWN: Mutex<BTreeMap<String, Radiation>> = Mutex::new(BTreeMap::new());
    let mut known = KNOWN.lock().expect("no test panics with it");
    known.entry(vehicle.name.clone()).or_insert_with(|| Radiation::estimate(vehicle)).clone()
}

fn car_body() -> Mesh {
    let section = |z: f64, from: f64, to: f64, half: f64| Section { z, x: [from, to], y: [-half, half] };
    loft(
        &[
            section(-0.55, -1.9, 1.9, 0.6),
            section(-0.3, -2.1, 2.1, 0.62),
            section(0.15, -2.1, 2.0, 0.62),
            section(0.72, -1.4, 0.6, 0.5),
        ],
        [0.0, 0.0],
    )
}

/// A hull between two tracks, each a belt round two sprockets of 0.25 m, 1.6 m apart.
pub fn tracked() -> Vehicle {
    let hull = cuboid(&Bounds { min: Vec3::new(-0.9, -0.4, -0.05), max: Vec3::new(0.9, 0.4, 0.4) });
    let track = |y: f64| (belt(0.8, 0.25, [y - 0.15, y + 0.15]), SurfaceKind::Track);
    body("tracked", 500.0, &[track(0.6), track(-0.6), (hull, SurfaceKind::Bottom)])
}

/// A prism along y between two sides whose outline is a belt: two half circles about (-half, 0) and (half, 0), and the straight
/// runs between them.
fn belt(half: f64, radius: f64, sides: [f64; 2]) -> Mesh {
    const ARC: usize = 12;
    let at = |i: usize| {
        let angle = std::f64::consts::PI * ((i % (ARC + 1)) as f64 / ARC as f64 - 0.5);
        let (x, z) = (half + radius * angle.cos(), radius * angle.sin());
        if i <= ARC { [x, z] } else { [-x, -z] }
    };
    let count = 2 * (ARC + 1);
    let ring = |y: f64| (0..count).map(move |i| Vec3::new(at(i)[0], y, at(i)[1]));
    let vertices: Vec<Vec3> = sides.into_iter().flat_map(ring).collect();
    let n = count as u32;
    let mut faces = Vec::new();
    for i in 0..n {
        let next = (i + 1) % n;
        faces.extend([[i, i + n, next], [next, i + n, next + n]]);
    }
    for i in 1..n - 1 {
        faces.extend([[0, i, i + 1], [n, n + i + 1, n + i]]);
    }
    let mesh = Mesh { vertices, faces };
    let width = sides[1] - sides[0];
    let polygon =
        4.0 * half * radius + radius * radius * ARC as f64 * (std::f64::consts::PI / ARC as f64).sin();
    assert!((mesh.volume() - polygon * width).abs() < 1e-9, "{} {}", mesh.volume(), polygon * width);
    mesh
}

/// A box open above with walls of 5 cm: one closed skin, outside, rim and inside.
fn tub() -> Mesh {
    let ring = |x: f64, y: f64, z: f64| {
        [Vec3::new(-x, -y, z), Vec3::new(x, -y, z), Vec3::new(x, y, z), Vec3::new(-x, y, z)]
    };
    let rings = [ring(0.6, 0.4, -0.25), ring(0.6, 0.4, 0.25), ring(0.55, 0.35, 0.25), ring(0.55, 0.35, -0.2)];
    let mut mesh = Mesh { vertices: rings.concat(), faces: Vec::new() };
    for lower in 0..3_u32 {
        for i in 0..4 {
            let (a, b) = (4 * lower + i, 4 * lower + (i + 1) % 4);
            mesh.faces.extend([[a, b, b + 4], [a, b + 4, a + 4]]);
        }
    }
    mesh.faces.extend([[0, 3, 2], [0, 2, 1], [12, 13, 14], [12, 14, 15]]);
    assert!((mesh.volume() - (1.2 * 0.8 * 0.5 - 1.1 * 0.7 * 0.45)).abs() < 1e-9, "{}", mesh.volume());
    mesh
}

/// A vehicle of closed parts, a surface each, centered on the box around it, with the inertia of a solid box.
pub fn body(name: &str, mass: f64, parts: &[(Mesh, SurfaceKind)]) -> Vehicle {
    let mut mesh = Mesh::default();
    let mut face_surface = Vec::new();
    for (index, (part, _)) in parts.iter().enumerate() {
        mesh.append(part);
        face_surface.extend(std::iter::repeat_n(index as u16, part.faces.len()));
    }
    let bounds = mesh.bounds().expect("faces");
    let center = bounds.center();
    mesh.vertices.iter_mut().for_each(|vertex| *vertex -= center);
    let extent = bounds.extent();
    let hull = Hull { mesh, face_surface };
    let patch = |index: usize| hull.patch(index).expect("faces");
    let mirror = |index: usize| {
        let place = patch(index).centroid;
        let image = Vec3::new(place.x, -place.y, place.z);
        (0..parts.len()).find(|other| (patch(*other).centroid - image).norm() < 1e-6).expect("symmetric")
    };
    let surface = |(index, (_, kind)): (usize, &(Mesh, SurfaceKind))| Surface {
        name: format!("part_{index}"),
        kind: *kind,
        centroid: patch(index).centroid,
        normal: Vec3::z(),
        area: patch(index).area,
        mirror_left_right: mirror(index),
        mirror_front_rear: None,
        sprocket_radius: hull
            .bounds_of(index)
            .filter(|_| *kind == SurfaceKind::Track)
            .map(|b| 0.5 * b.extent().z),
    };
    let squares = extent.component_mul(&extent) / 12.0;
    let inertia = Vec3::new(squares.y + squares.z, squares.x + squares.z, squares.x + squares.y) * mass;
    Vehicle {
        name: name.to_owned(),
        dimensions: Dimensions { length: extent.x, width: extent.y, height: extent.z },
        z0: -0.5 * extent.z,
        mass,
        inertia: Matrix3::from_diagonal(&inertia),
        center_of_mass: Vec3::new(0.0, 0.0, -0.1 * extent.z),
        surfaces: parts.iter().enumerate().map(surface).collect(),
        contacts: Vec::new(),
        symmetric_left_right: true,
        symmetric_front_rear: false,
        hull,
        ..shipped::husky().expect("sound").vehicle().expect("sound")
    }
}
