//! The body under water as columns: a table of fullness over height, on a grid over length and width.

use wade_core::frame::{GRAVITY, Vec3};
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::geometry::immersion::wet_triangles;
use wade_core::vehicle::Vehicle;

use super::{State, Wrench6};
use wade_core::frame::WaterPlane;

/// Columns along x and y.
const ALONG: usize = 15;
const ACROSS: usize = 5;
/// Slices over the height.
const SLICES: usize = 48;

/// A body whose beam at a height is the same share of its width all along.
#[derive(Debug, Clone, PartialEq)]
pub struct Hull {
    /// Along x [m].
    pub length: f64,
    /// Along y [m].
    pub width: f64,
    /// Of the body above the ground-contact plane [m].
    pub height: f64,
    /// Mass [kg].
    pub mass: f64,
    /// Height of the ground-contact plane in the body frame [m].
    pub z0: f64,
    /// Center of mass, body frame [m].
    pub center_of_mass: Vec3,
    /// Radius and width of a wheel [m].
    pub wheel: [f64; 2],
    /// Volume below a height, over length and width, at even heights from 0 to `height` [m].
    filled: Vec<f64>,
    /// Area below these heights of the sides that look along x and y, both ways [m2].
    facing: Vec<[f64; 2]>,
}

/// A transverse strip of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Strip {
    /// Its middle from the center of mass, along x [m].
    pub x: f64,
    /// The middle of its wet height from the center of mass, along z [m].
    pub z: f64,
    /// Length along x [m].
    pub dx: f64,
    /// Local water depth above the ground-contact plane [m]; not below 0.
    pub draft: f64,
    /// Mean beam below water [m].
    pub beam: f64,
}

impl Hull {
    /// A closed box of an axis ratio between a Husky and a Warthog, standing on its bottom.
    pub fn generated_box() -> Self {
        let (length, width, height) = (1.2, 0.8, 0.5);
        let heights = || (0..=SLICES).map(|i| height * i as f64 / SLICES as f64);
        Self {
            length,
            width,
            height,
            mass: 150.0,
            z0: -0.25,
            center_of_mass: Vec3::zeros(),
            wheel: [0.2, 0.12],
            filled: heights().collect(),
            facing: heights().map(|height| [2.0 * width * height, 2.0 * length * height]).collect(),
        }
    }

    /// The columns of a vehicle, from the volume that its mesh displaces level.
    pub fn of_vehicle(vehicle: &Vehicle) -> Self {
        let (length, width) = (vehicle.dimensions.length, vehicle.dimensions.width);
        let height = vehicle.dimensions.height;
        let heights = || (0..=SLICES).map(|i| height * i as f64 / SLICES as f64);
        let mesh = &vehicle.hull.mesh;
        let volume = |depth: f64| {
            let plane = WaterPlane::level(vehicle.z0, depth);
            hydrostatics(mesh, &plane, 1.0, &Vec3::zeros()).displaced_volume / (length * width)
        };
        let facing = |depth: f64| {
            let plane = WaterPlane::level(vehicle.z0, depth);
            let wet = (0..mesh.faces.len()).flat_map(|face| wet_triangles(mesh, face, &plane).to_vec());
            wet.fold([0.0; 2], |[x, y], triangle| {
                let area = triangle.area_vector();
                [x + area.x.abs(), y + area.y.abs()]
            })
        };
        Self {
            length,
            width,
            height,
            mass: vehicle.mass,
            z0: vehicle.z0,
            center_of_mass: vehicle.center_of_mass,
            wheel: wheel_of(vehicle),
            filled: heights().map(volume).collect(),
            facing: heights().map(facing).collect(),
        }
    }

    /// Volume below a height over the area of the bounding box [m].
    pub(super) fn filled(&self, depth: f64) -> f64 {
        self.between(depth, |slice| self.filled[slice])
    }

    /// Wet area of the sides that look along x or y, both ways, level [m2].
    pub(super) fn facing(&self, depth: f64, axis: usize) -> f64 {
        self.between(depth, |slice| self.facing[slice][axis])
    }

    /// A number of the slices at a height between them.
    fn between(&self, depth: f64, at: impl Fn(usize) -> f64) -> f64 {
        let place = (depth / self.height).clamp(0.0, 1.0) * SLICES as f64;
        let below = (place as usize).min(SLICES - 1);
        at(below) + (at(below + 1) - at(below)) * (place - below as f64)
    }

    /// Displaced volume, level [m3].
    pub fn volume(&self, depth: f64) -> f64 {
        self.length * self.width * self.filled(depth)
    }

    /// Waterplane area, level [m2].
    pub fn waterplane(&self, depth: f64) -> f64 {
        let h = self.height / SLICES as f64;
        if depth <= 0.0 {
            return 0.0;
        }
        (self.volume(depth + h) - self.volume(depth - h)) / (2.0 * h)
    }

    /// Transverse strips at the state's attitude, `raise` being added to the water level [m].
    pub(super) fn strips(&self, state: &State, raise: f64) -> [Strip; ALONG] {
        let dx = self.length / ALONG as f64;
        let slope = state.attitude[1].tan();
        std::array::from_fn(|i| {
            let x = (i as f64 + 0.5) * dx - 0.5 * self.length;
            // positive pitch lowers the nose
            let draft = (state.depth + raise + x * slope).clamp(0.0, self.height);
            let beam = if draft > 0.0 { self.width * self.filled(draft) / draft } else { 0.0 };
            let z = self.z0 + 0.5 * draft - self.center_of_mass.z;
            Strip { x: x - self.center_of_mass.x, z, dx, draft, beam }
        })
    }

    /// Hydrostatic wrench about the center of mass: a force along world up at the middle of each column's wet part.
    /// `level` gives the water level above the undisturbed one at a place in the body [m].
    pub(super) fn buoyancy(&self, state: &State, density: f64, level: impl Fn(f64, f64) -> f64) -> Wrench6 {
        let [roll, pitch, _] = state.attitude;
        let up = wade_core::frame::up_from_roll_pitch(roll, pitch).into_inner();
        let (dx, dy) = (self.length / ALONG as f64, self.width / ACROSS as f64);
        let mut sum = Wrench6::zeros();
        for i in 0..ALONG {
            let x = (i as f64 + 0.5) * dx - 0.5 * self.length;
            for j in 0..ACROSS {
                let y = (j as f64 + 0.5) * dy - 0.5 * self.width;
                let depth = state.depth + level(x, y) - (up.x * x + up.y * y) / up.z;
                if depth <= 0.0 {
                    continue;
                }
                let force = up * (density * GRAVITY * self.filled(depth) * dx * dy);
                let arm = Vec3::new(x, y, self.z0 + 0.5 * depth) - self.center_of_mass;
                sum += wrench(force, arm);
            }
        }
        sum
    }
}

/// Radius and width of the first wheel; 0 of a vehicle that has none [m].
fn wheel_of(vehicle: &Vehicle) -> [f64; 2] {
    let bounds = vehicle.wheels().first().and_then(|&wheel| vehicle.hull.bounds_of(wheel));
    bounds.map_or([0.0; 2], |bounds| [0.5 * bounds.extent().x, bounds.extent().y])
}

/// A force acting at an arm from the center of mass.
pub(super) fn wrench(force: Vec3, arm: Vec3) -> Wrench6 {
    let moment = arm.cross(&force);
    Wrench6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use wade_core::vehicle::shipped;

    #[test]
    fn a_box_floats_as_archimedes_says_and_rights_itself() {
        let hull = Hull::generated_box();
        let level = State { depth: 0.2, ..State::default() };
        let force = hull.buoyancy(&level, 1000.0, |_, _| 0.0);
        assert!((force[2] - 9810.0 * 1.2 * 0.8 * 0.2).abs() < 1e-6);
        // waterplane moment rho g B L^3 / 12, of which midpoints of 15 columns miss 1 / 225, less weight of the column
        let pitched = State { attitude: [0.0, 0.01, 0.0], ..level };
        let moment = hull.buoyancy(&pitched, 1000.0, |_, _| 0.0)[4];
        let righting = 9810.0 * 0.8 * 1.2f64.powi(3) / 12.0 * (1.0 - 1.0 / 225.0) * 0.01;
        let center_below = 9810.0 * 1.2 * 0.8 * 0.2 * 0.15 * 0.01;
        assert!((moment - (center_below - righting)).abs() < 0.05, "{moment} {}", center_below - righting);
        let strips = hull.strips(&pitched, 0.0);
        assert!(strips[14].draft > 0.2 && strips[0].draft < 0.2);
    }

    #[test]
    fn a_vehicle_keeps_its_displacement() {
        let vehicle = shipped::warthog().unwrap().vehicle().unwrap();
        let hull = Hull::of_vehicle(&vehicle);
        for depth in [0.1016, 0.2032, 0.254] {
            let plane = WaterPlane::level(vehicle.z0, depth);
            let exact = hydrostatics(&vehicle.hull.mesh, &plane, 1000.0, &Vec3::zeros()).wrench.force.z;
            let ours = hull.buoyancy(&State { depth, ..State::default() }, 1000.0, |_, _| 0.0)[2];
            assert!((ours / exact - 1.0).abs() < 0.02, "{depth}: {ours} {exact}");
        }
    }

    #[test]
    fn sides_are_what_looks_along_an_axis() {
        let hull = Hull::generated_box();
        assert!((hull.facing(0.2, 0) - 2.0 * 0.8 * 0.2).abs() < 1e-12);
        assert!((hull.facing(0.2, 1) - 2.0 * 1.2 * 0.2).abs() < 1e-12);
        // two segments of a disc on each of four wheels, below the hull
        let vehicle = shipped::warthog().unwrap().vehicle().unwrap();
        let hull = Hull::of_vehicle(&vehicle);
        let (radius, depth) = (hull.wheel[0], 0.1);
        let above: f64 = radius - depth;
        let segment =
            radius.powi(2) * (above / radius).acos() - above * (radius.powi(2) - above.powi(2)).sqrt();
        let sides = hull.facing(depth, 1);
        assert!((sides / (8.0 * segment) - 1.0).abs() < 0.05, "{sides} {}", 8.0 * segment);
    }
}
