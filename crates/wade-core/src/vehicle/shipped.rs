//! The two vehicles that come with us, as parametric bodies. They pass through the same `build` as anybody's STL.
//!
//! Each dimension is marked: published (Clearpath user manuals), measured (on the public meshes, undeflected tires),
//! tuned (so that the vertical force of the sealed public mesh is met at every depth of its table), or chosen (free).

use super::Vehicle;
use super::build::{BuildError, build};
use super::spec::VehicleSpec;
use crate::frame::Vec3;
use crate::geometry::mesh::{Bounds, Mesh, write_stl};
use crate::geometry::parametric::{Section, Tire, cuboid, cylinder, loft, tire};

/// Facets of a wheel: the displaced volume of a cylinder is right to 1 % from a fifth of the radius up.
pub const WHEEL_FACETS: u32 = 64;

/// The vehicle file of the Husky.
pub const HUSKY_SPEC: &str = include_str!("husky.toml");

/// The vehicle file of the Warthog.
pub const WARTHOG_SPEC: &str = include_str!("warthog.toml");

/// A mesh and its vehicle file, before the build.
#[derive(Debug, Clone, PartialEq)]
pub struct Shipped {
    /// Closed parts, body frame.
    pub mesh: Mesh,
    /// The vehicle file.
    pub spec: VehicleSpec,
}

impl Shipped {
    /// The mesh as a binary STL.
    pub fn stl(&self) -> Vec<u8> {
        write_stl(&self.mesh)
    }

    /// The vehicle, by the same pipeline as any other.
    pub fn vehicle(&self) -> Result<Vehicle, BuildError> {
        build(&self.spec, &self.stl(), false)
    }
}

/// Clearpath Husky A200 without bumpers and top plate; symmetric left to right and front to rear.
pub fn husky() -> Result<Shipped, toml::de::Error> {
    let ground = -0.5 * 0.369; // height 0.369 measured
    let section = |height: f64, length: f64| {
        // width tuned: what is left between the wheels, less 1 mm a side
        Section { z: ground + height, x: [-0.5 * length, 0.5 * length], y: [-0.2270, 0.2270] }
    };
    let mut mesh = Mesh::default();
    // radius and width measured; wheelbase 0.512 published; track from the measured width of 0.685
    for (x, y) in corners(0.5 * 0.512, 0.5 * (0.685 - 0.1143)) {
        mesh.append(&cylinder(&Vec3::new(x, y, ground + 0.1778), 0.1778, 0.1143, WHEEL_FACETS));
    }
    // bottom at 0.142 and length 0.868 measured; length of the bottom and height of the taper tuned; the upper panel
    // starts and leans back as chosen
    let chassis = [section(0.142, 0.76), section(0.175, 0.868), section(0.25, 0.868), section(0.369, 0.82)];
    mesh.append(&loft(&chassis, [0.0, 0.0]));
    Ok(Shipped { mesh, spec: toml::from_str(HUSKY_SPEC)? })
}

/// Clearpath Warthog; the chassis is 66 mm longer to the rear, the rest symmetric.
pub fn warthog() -> Result<Shipped, toml::de::Error> {
    let ground = -0.5 * 0.826; // height 0.826 measured
    let mut mesh = Mesh::default();
    // radius and width measured, axles from the measured length 1.524 and width 1.391; tread and shoulder tuned to the
    // sealed wheels alone (251, 745, 1027 N at 4, 8, 10 in)
    for (x, y) in corners(0.5 * 1.524 - 0.305, 0.5 * (1.391 - 0.254)) {
        let of_warthog = Tire { radius: 0.305, width: 0.254, tread: 0.115, shoulder: 0.056 };
        mesh.append(&tire(&Vec3::new(x, y, ground + 0.305), of_warthog, WHEEL_FACETS));
    }
    mesh.append(&warthog_chassis(ground));
    for side in [1.0, -1.0] {
        mesh.append(&warthog_rocker(ground, side));
    }
    for side in [1.0, -1.0] {
        mesh.append(&warthog_fender(ground, side));
    }
    Ok(Shipped { mesh, spec: toml::from_str(WARTHOG_SPEC)? })
}

/// Bottom at 0.2875, ends at -0.7135 and 0.6477 and width 0.707 measured; the flare below 0.326 tuned.
fn warthog_chassis(ground: f64) -> Mesh {
    let full = |z: f64| Section { z: ground + z, x: [-0.7135, 0.6477], y: [-0.3535, 0.3535] };
    let bottom = Section { z: ground + 0.2875, x: [-0.25, 0.25], y: [-0.15, 0.15] };
    loft(&[bottom, full(0.326), full(0.826)], [0.0, 0.0])
}

/// A drive unit below the chassis, inside the wheels: start at 0.198, width 0.118 and length 1.339 measured; its
/// boat-shaped lower end tuned; its place across chosen, clear of wheel and chassis.
fn warthog_rocker(ground: f64, side: f64) -> Mesh {
    let center = side * 0.381;
    let section = |z: f64, length: f64, width: f64| Section {
        z: ground + z,
        x: [-0.5 * length, 0.5 * length],
        y: [center - 0.5 * width, center + 0.5 * width],
    };
    loft(&[section(0.198, 0.63, 0.067), section(0.2865, 1.339, 0.118)], [0.0, center])
}

/// The part of a fender that hangs between the wheels: start at 0.270 measured; length, width and top chosen to fill
/// the gap between the wheels up to their height, less 4 mm a side.
fn warthog_fender(ground: f64, side: f64) -> Mesh {
    let (inner, outer) = (side * 0.4435, side * 0.6935);
    cuboid(&Bounds {
        min: Vec3::new(-0.148, inner.min(outer), ground + 0.27),
        max: Vec3::new(0.148, inner.max(outer), ground + 0.6),
    })
}

/// Front left, front right, rear left, rear right.
fn corners(x: f64, y: f64) -> [(f64, f64); 4] {
    [(x, y), (x, -y), (-x, y), (-x, -y)]
}
