//! The vehicle in the channel: rotated, standing on the bed, with what closes the gap under its tires.

use nalgebra::Rotation3;

use super::plan::Case;
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::{Bounds, Mesh};
use wade_core::vehicle::{ContactPatch, SurfaceKind, Vehicle};

/// How far a pad reaches below the bed [m], so that the bed surely cuts it.
const PAD_DEPTH: f64 = 0.1;

/// Where the vehicle stands; frame of the case.
#[derive(Debug, Clone, PartialEq)]
pub struct Placement {
    /// Rotation from the body frame.
    pub cfd_from_body: Rotation3<f64>,
    /// The body origin [m]: above the channel's center, high enough that the lowest point touches the bed.
    pub origin: Vec3,
    /// Height of the undisturbed water above the bed [m].
    pub water_level: f64,
    /// Yaw of the vehicle [rad].
    pub yaw: f64,
    /// The box around the hull [m].
    pub bounds: Bounds,
    /// The same in the body frame [m].
    pub body_bounds: Bounds,
    /// Each surface of the vehicle with its pads, in the vehicle's order.
    pub surfaces: Vec<Mesh>,
}

impl Placement {
    /// Places the vehicle of a case.
    pub fn new(vehicle: &Vehicle, case: &Case) -> Self {
        let cfd_from_body = case.cfd_from_body();
        let turned: Vec<Vec3> = vehicle.hull.mesh.vertices.iter().map(|v| cfd_from_body * v).collect();
        let lowest = turned.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
        let height = if case.is_level() { -vehicle.z0 } else { -lowest };
        let origin = Vec3::z() * height;
        let surface_point = cfd_from_body * Vec3::z() * (vehicle.z0 + case.depth_m);
        let pads = if case.is_level() { vehicle.contacts.as_slice() } else { &[] };
        let place = |mut mesh: Mesh| {
            mesh.vertices.iter_mut().for_each(|v| *v = cfd_from_body * *v + origin);
            mesh
        };
        let surface = |index: usize| {
            let faces: Vec<usize> = vehicle.hull.faces_of(index).collect();
            let mut mesh = vehicle.hull.mesh.part(&faces);
            let bounds = mesh.bounds();
            for patch in pads.iter().filter(|patch| patch.surface == index) {
                bounds.iter().for_each(|bounds| mesh.append(&pad(patch, bounds)));
            }
            place(mesh)
        };
        let surfaces = (0..vehicle.surfaces.len()).map(surface).collect();
        let points: Vec<Vec3> = turned.iter().map(|v| v + origin).collect();
        let bounds = Bounds::around(&points).unwrap_or(Bounds { min: origin, max: origin });
        let body_bounds = vehicle.hull.mesh.bounds().unwrap_or(bounds);
        let (yaw, water_level) = (-case.heading_deg.to_radians(), height + surface_point.z);
        Self { cfd_from_body, origin, water_level, yaw, bounds, body_bounds, surfaces }
    }

    /// Axle and center of each wheel in the frame of the case, with its radius [m].
    pub fn wheels(&self, vehicle: &Vehicle) -> Vec<Wheel> {
        let wheel = |(index, surface): (usize, &wade_core::vehicle::Surface)| {
            let faces: Vec<usize> = vehicle.hull.faces_of(index).collect();
            let bounds = vehicle.hull.mesh.part(&faces).bounds()?;
            Some(Wheel {
                surface: surface.name.clone(),
                center: self.cfd_from_body * bounds.center() + self.origin,
                axle: self.cfd_from_body * Vec3::y(),
                radius: bounds.extent().z / 2.0,
            })
        };
        let wheels = vehicle.surfaces.iter().enumerate().filter(|(_, s)| s.kind == SurfaceKind::Wheel);
        wheels.filter_map(wheel).collect()
    }
}

/// A wheel; frame of the case.
#[derive(Debug, Clone, PartialEq)]
pub struct Wheel {
    /// Name of its surface.
    pub surface: String,
    /// Center [m].
    pub center: Vec3,
    /// Direction of its axle, to the left of the vehicle.
    pub axle: Vec3,
    /// Radius [m].
    pub radius: f64,
}

/// A block with the area of the contact patch, as wide as the tire and up to where the tire is as long as it.
///
/// Between a round tire and the bed there is a wedge that no mesh resolves and a real tire fills.
fn pad(patch: &ContactPatch, tire: &Bounds) -> Mesh {
    let (width, radius) = (tire.extent().y, tire.extent().z / 2.0);
    let half_length = 0.5 * patch.area / width;
    let rise = radius - (radius * radius - half_length * half_length).max(0.0).sqrt();
    let half = Vec3::new(half_length, width / 2.0, 0.0);
    block(patch.center - half - Vec3::z() * PAD_DEPTH, patch.center + half + Vec3::z() * rise)
}

/// A box with its faces outward.
fn block(min: Vec3, max: Vec3) -> Mesh {
    let corner = |i: usize| {
        let pick = |bit: usize| if i >> bit & 1 == 1 { max[bit] } else { min[bit] };
        Vec3::new(pick(0), pick(1), pick(2))
    };
    let quads: [[u32; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Mesh {
        vertices: (0..8).map(corner).collect(),
        faces: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_block_is_closed_and_faces_outward() {
        let mesh = block(Vec3::new(0.0, 0.0, 0.0), Vec3::new(1.0, 2.0, 3.0));
        assert!((mesh.volume() - 6.0).abs() < 1e-12);
    }
}
