//! Shapes by formula: is a point inside? They share no code with the meshes that are imported.

use nalgebra::{Isometry3, Point3};
use wade_core::frame::Vec3;

/// Edge of a cell of the count [m].
const CELL: f64 = 0.002;

/// A shape about its own origin; cylinder and capsule about z.
#[derive(Debug, Clone, Copy)]
pub enum Solid {
    /// Half edges.
    Box(Vec3),
    /// Inner radius, outer radius, half length.
    Ring(f64, f64, f64),
    /// Radius and half length without the caps.
    Capsule(f64, f64),
    /// Half axes.
    Ellipsoid(Vec3),
    /// Half edges of a box with a pocket from above, and the thickness of walls and floor.
    Tub(Vec3, f64),
}

impl Solid {
    fn holds(&self, p: &Point3<f64>) -> bool {
        let radius = p.x.hypot(p.y);
        let in_box = |half: Vec3| (0..3).all(|i| p[i].abs() <= half[i]);
        match *self {
            Self::Box(half) => in_box(half),
            Self::Ring(inner, outer, half) => p.z.abs() <= half && radius <= outer && radius >= inner,
            Self::Capsule(r, half) => radius.hypot((p.z.abs() - half).max(0.0)) <= r,
            Self::Ellipsoid(half) => p.coords.component_div(&half).norm() <= 1.0,
            Self::Tub(half, wall) => {
                let hollow = Vec3::new(half.x - wall, half.y - wall, half.z);
                in_box(half) && !(in_box(hollow) && p.z > -half.z + wall)
            }
        }
    }
}

/// Volume of the union of placed shapes, counted cell by cell [m3].
pub fn count(shapes: &[(Isometry3<f64>, Solid)], reach: f64) -> f64 {
    let inverse: Vec<_> = shapes.iter().map(|(pose, solid)| (pose.inverse(), *solid)).collect();
    let steps = (2.0 * reach / CELL).round() as usize;
    let at = |i: usize| (i as f64 + 0.5) * CELL - reach;
    let mut count = 0_usize;
    for i in 0..steps {
        for j in 0..steps {
            for k in 0..steps {
                let point = Point3::new(at(i), at(j), at(k));
                count += usize::from(inverse.iter().any(|(pose, solid)| solid.holds(&(pose * point))));
            }
        }
    }
    count as f64 * CELL.powi(3)
}

/// A place without a turn.
pub fn at(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Isometry3::translation(x, y, z)
}

/// A place with roll, pitch and yaw about fixed axes.
pub fn turned(xyz: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Isometry3<f64> {
    let turn = nalgebra::UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Isometry3::from_parts(Vec3::from(xyz).into(), turn)
}
