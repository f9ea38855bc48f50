//! Primitive shapes as closed meshes about their own origin.

use nalgebra::{Isometry3, Matrix3, UnitQuaternion};
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::{Bounds, Mesh};
use wade_core::geometry::parametric::{cuboid, cylinder, revolve, sphere};

use crate::limits::FACETS;

/// A primitive of a robot description; cylinder and capsule about z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Primitive {
    /// Edge lengths [m].
    Box(Vec3),
    /// Radius and length [m].
    Cylinder(f64, f64),
    /// Radius and length without the caps [m].
    Capsule(f64, f64),
    /// Radius [m].
    Sphere(f64),
    /// Half axes [m].
    Ellipsoid(Vec3),
}

impl Primitive {
    /// True for sizes that are positive numbers.
    pub fn is_sound(&self) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        match *self {
            Self::Box(size) | Self::Ellipsoid(size) => size.iter().all(|x| positive(*x)),
            Self::Cylinder(radius, length) => positive(radius) && positive(length),
            Self::Capsule(radius, length) => positive(radius) && length >= 0.0 && length.is_finite(),
            Self::Sphere(radius) => positive(radius),
        }
    }

    /// Its name in messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Box(_) => "box",
            Self::Cylinder(..) => "cylinder",
            Self::Capsule(..) => "capsule",
            Self::Sphere(_) => "sphere",
            Self::Ellipsoid(_) => "ellipsoid",
        }
    }

    /// Closed, outward.
    pub fn mesh(&self) -> Mesh {
        let origin = Vec3::zeros();
        match *self {
            Self::Box(size) => cuboid(&Bounds { min: -0.5 * size, max: 0.5 * size }),
            Self::Cylinder(radius, length) => upright(cylinder(&origin, radius, length, FACETS)),
            Self::Capsule(radius, length) => upright(capsule(radius, length)),
            Self::Sphere(radius) => sphere(&origin, radius, FACETS),
            Self::Ellipsoid(half) => scaled(&sphere(&origin, 1.0, FACETS), &Matrix3::from_diagonal(&half)),
        }
    }
}

/// From the lateral axis of `revolve` to z.
fn upright(mesh: Mesh) -> Mesh {
    let turn = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2);
    moved(&mesh, &Isometry3::from_parts(Vec3::zeros().into(), turn))
}

fn capsule(radius: f64, length: f64) -> Mesh {
    let bands = FACETS / 4;
    let cap = |i: u32| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * f64::from(i) / f64::from(bands)).sin_cos();
        (radius * cos, if i == 0 { 0.0 } else { radius * sin })
    };
    let lower = (0..=bands).map(|i| (-0.5 * length - cap(i).0, cap(i).1));
    // a sphere has one ring in the middle
    let upper = (0..=bands).rev().filter(|i| length > 0.0 || *i < bands);
    let profile: Vec<(f64, f64)> = lower.chain(upper.map(|i| (0.5 * length + cap(i).0, cap(i).1))).collect();
    revolve(&Vec3::zeros(), &profile, FACETS)
}

/// A mesh somewhere else.
pub fn moved(mesh: &Mesh, pose: &Isometry3<f64>) -> Mesh {
    let vertices = mesh.vertices.iter().map(|v| (pose * nalgebra::Point3::from(*v)).coords).collect();
    Mesh { vertices, faces: mesh.faces.clone() }
}

/// A mesh under a linear map; a mirror image stays outward.
pub fn scaled(mesh: &Mesh, map: &Matrix3<f64>) -> Mesh {
    let mut out =
        Mesh { vertices: mesh.vertices.iter().map(|v| map * v).collect(), faces: mesh.faces.clone() };
    if map.determinant() < 0.0 {
        out.faces.iter_mut().for_each(|face| face.swap(1, 2));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primitives_are_closed_and_have_the_volume_of_the_formula() {
        use std::f64::consts::PI;
        let cases = [
            (Primitive::Box(Vec3::new(0.1, 0.2, 0.3)), 0.006),
            (Primitive::Cylinder(0.1, 0.5), PI * 0.01 * 0.5),
            (Primitive::Sphere(0.3), 4.0 / 3.0 * PI * 0.027),
            (Primitive::Capsule(0.1, 0.5), PI * 0.01 * 0.5 + 4.0 / 3.0 * PI * 0.001),
            (Primitive::Capsule(0.1, 0.0), 4.0 / 3.0 * PI * 0.001),
            (Primitive::Ellipsoid(Vec3::new(0.1, 0.2, 0.3)), 4.0 / 3.0 * PI * 0.006),
        ];
        for (primitive, volume) in cases {
            let mesh = primitive.mesh();
            assert!(wade_core::geometry::watertight::is_closed(&mesh), "{primitive:?}");
            assert!((mesh.volume() / volume - 1.0).abs() < 4e-3, "{primitive:?} {} {volume}", mesh.volume());
        }
        let tall = Primitive::Cylinder(0.1, 0.5).mesh().bounds().map(|b| b.extent());
        assert!(tall.is_some_and(|e| (e - Vec3::new(0.2, 0.2, 0.5)).norm() < 1e-12), "{tall:?}");
    }
}
