//! The vehicle in the channel: rotated, standing on the bed, with what closes the gap under its tires.

use nalgebra::Rotation3;

use super::plan::{Case, Ground};
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::{Bounds, Mesh};
use wade_core::vehicle::{ContactPatch, SurfaceKind, Vehicle};

/// How far a pad reaches below the bed [m], so that the bed surely cuts it.
const PAD_DEPTH: f64 = 0.1;
/// How far a ramp goes on below the lowest contact patch and above the highest one, in vehicle lengths.
const RAMP_REACH: [f64; 2] = [0.5, 0.1];

/// Where the vehicle stands; frame of the case.
#[derive(Debug, Clone, PartialEq)]
pub struct Placement {
    /// Rotation from the body frame.
    pub cfd_from_body: Rotation3<f64>,
    /// The body origin [m]: above the channel's center, as high as bed and clearance demand.
    pub origin: Vec3,
    /// Height of the undisturbed water above the bed, of a ramp above its foot [m].
    pub water_level: f64,
    /// Distance of the ground-contact plane from the bed below it, under the body origin [m].
    pub bed_clearance: f64,
    /// The ramp that the wheels stand on.
    pub ramp: Option<Ramp>,
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
        let standing = cfd_from_body * Vec3::z() * vehicle.z0;
        let ramp = (case.ground == Ground::Ramp).then(|| Ramp::below(vehicle, &cfd_from_body)).flatten();
        let height = match ramp {
            Some(ramp) => ramp.height(0.0, 0.0) + ramp.rise(&standing) - standing.z,
            None if case.is_level() => case.clearance_m - vehicle.z0,
            None => case.clearance_m - lowest,
        };
        let origin = Vec3::z() * height;
        let bed_clearance = if ramp.is_some() { 0.0 } else { height + standing.z };
        let surface_point = cfd_from_body * Vec3::z() * (vehicle.z0 + case.depth_m);
        let pads = if case.stands() { vehicle.contacts.as_slice() } else { &[] };
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
        Self { cfd_from_body, origin, water_level, bed_clearance, ramp, yaw, bounds, body_bounds, surfaces }
    }

    /// Height of the bed [m].
    pub fn bed(&self, x: f64, y: f64) -> f64 {
        self.ramp.map_or(0.0, |ramp| ramp.height(x, y))
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

/// A bed that rises along one direction from a horizontal foot at z = 0 to a horizontal head; frame of the case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    /// Rise of the slope over the horizontal distance, along x and y.
    pub slope: [f64; 2],
    /// Distance of the slope's foot from the channel's center along the direction in which it rises [m]; negative.
    pub foot: f64,
    /// The same of its head [m].
    pub head: f64,
}

impl Ramp {
    /// Parallel to the wheels of a vehicle, from below the lowest contact patch to above the highest one; `None` for a vehicle
    /// that stands level.
    fn below(vehicle: &Vehicle, cfd_from_body: &Rotation3<f64>) -> Option<Self> {
        let normal = cfd_from_body * Vec3::z();
        let slope = [-normal.x / normal.z, -normal.y / normal.z];
        let steep = slope[0].hypot(slope[1]);
        if steep < 1e-6 {
            return None;
        }
        let along = |point: Vec3| (slope[0] * point.x + slope[1] * point.y) / steep;
        let places = vehicle.contacts.iter().map(|patch| along(cfd_from_body * patch.center));
        let (low, high) = places.fold((0.0, 0.0), |(low, high), s| (f64::min(low, s), f64::max(high, s)));
        let [below, above] = RAMP_REACH.map(|share| share * vehicle.dimensions.length);
        Some(Self { slope, foot: low - below, head: high + above })
    }

    fn steepness(&self) -> f64 {
        self.slope[0].hypot(self.slope[1])
    }

    /// Rise along the slope from the channel's center to a point over the plane [m].
    fn rise(&self, point: &Vec3) -> f64 {
        self.slope[0] * point.x + self.slope[1] * point.y
    }

    /// Height of the bed [m].
    pub fn height(&self, x: f64, y: f64) -> f64 {
        let along = self.rise(&Vec3::new(x, y, 0.0)) / self.steepness();
        self.steepness() * (along.clamp(self.foot, self.head) - self.foot)
    }

    /// Height of the head, where the water is shallowest [m].
    pub fn top(&self) -> f64 {
        self.steepness() * (self.head - self.foot)
    }

    /// Slope and head out to `reach` from the center; the slope goes on below the foot, where the bed of the channel covers it.
    pub fn surface(&self, reach: f64) -> Mesh {
        let steep = self.steepness();
        let up = Vec3::new(self.slope[0], self.slope[1], 0.0) / steep;
        let aside = Vec3::new(-up.y, up.x, 0.0) * reach;
        let edge = |along: f64, height: f64| {
            let middle = up * along + Vec3::z() * height;
            [middle - aside, middle + aside]
        };
        let below = self.foot - reach;
        let vertices =
            [edge(below, -steep * reach), edge(self.head, self.top()), edge(reach, self.top())].concat();
        Mesh { vertices, faces: vec![[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]] }
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

    use super::super::plan::Set;
    use wade_core::vehicle::shipped;

    fn tilted(roll_deg: f64, pitch_deg: f64) -> Case {
        let heading_deg = 70.0;
        Case { roll_deg, pitch_deg, heading_deg, ..Case::steady("husky", Set::Drive, 0, 0.5, 0.1) }
    }

    #[test]
    fn a_tilted_hull_touches_a_flat_bed_or_is_as_far_off_as_stated() {
        let vehicle = shipped::husky().unwrap().vehicle().unwrap();
        for clearance_m in [0.0, 0.05, 0.7] {
            let placement = Placement::new(&vehicle, &Case { clearance_m, ..tilted(-9.0, 14.0) });
            assert!((placement.bounds.min.z - clearance_m).abs() < 1e-12);
            let depth = placement.water_level - placement.bed_clearance;
            let up = tilted(-9.0, 14.0).up().z;
            assert!((depth - 0.1 * up).abs() < 1e-12, "the depth is that at the body origin");
        }
        let level = Case { clearance_m: 0.2, ..tilted(0.0, 0.0) };
        let placement = Placement::new(&vehicle, &level);
        assert!((placement.bed_clearance - 0.2).abs() < 1e-12);
        assert!((placement.water_level - 0.3).abs() < 1e-12);
    }

    #[test]
    fn all_wheels_stand_on_a_ramp_that_has_a_foot_and_a_head() {
        let vehicle = shipped::husky().unwrap().vehicle().unwrap();
        for (roll, pitch) in [(0.0, 20.0), (15.0, 0.0), (-10.0, -14.0)] {
            let case = Case { ground: Ground::Ramp, ..tilted(roll, pitch) };
            let placement = Placement::new(&vehicle, &case);
            let ramp = placement.ramp.unwrap();
            for patch in &vehicle.contacts {
                let place = placement.cfd_from_body * patch.center + placement.origin;
                assert!((placement.bed(place.x, place.y) - place.z).abs() < 1e-9, "{place}");
            }
            let surface_depth = placement.water_level - placement.bed(0.0, 0.0);
            assert!(surface_depth > 0.0 && placement.bed_clearance == 0.0);
            let [x, y] = ramp.slope.map(|slope| slope * 100.0);
            assert!((placement.bed(x, y) - ramp.top()).abs() < 1e-12 && placement.bed(-x, -y) == 0.0);
            let mesh = ramp.surface(20.0);
            let up = (0..4).all(|face| mesh.area_vector(face).z > 0.0);
            let on_it =
                mesh.vertices.iter().all(|v| v.z < 1e-9 || (placement.bed(v.x, v.y) - v.z).abs() < 1e-9);
            assert!(up && on_it, "{mesh:?}");
        }
        let level = Case { ground: Ground::Ramp, ..tilted(0.0, 0.0) };
        assert_eq!(Placement::new(&vehicle, &level), Placement::new(&vehicle, &tilted(0.0, 0.0)));
    }

    #[test]
    fn a_block_is_closed_and_faces_outward() {
        let mesh = block(Vec3::new(0.0, 0.0, 0.0), Vec3::new(1.0, 2.0, 3.0));
        assert!((mesh.volume() - 6.0).abs() < 1e-12);
    }
}
