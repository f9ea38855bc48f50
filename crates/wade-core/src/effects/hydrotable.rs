//! Displaced volume and waterplane by level and tilt, looked up instead of integrated.

use super::immersion::Immersion;
use crate::frame::{Vec3, WaterPlane, up_from_roll_pitch};
use crate::geometry::immersion::wet_triangles;
use crate::geometry::mesh::Mesh;

/// About a centimeter apart on our vehicles: parts with flat bottoms make the volume bend sharply.
const LEVELS: usize = 97;
const PITCHES: usize = 11;
const ROLLS: usize = 5;
/// Steepest attitude of the table [rad]; a steeper one is taken as this.
const STEEPEST: [f64; 2] = [0.15, 0.35];
/// Volume, its first moments, waterplane area, its first moments.
const VALUES: usize = 8;

/// Trilinear table over the plane's offset from the lowest to the highest point, pitch and roll.
#[derive(Debug, Clone)]
pub(super) struct Hydrotable {
    low: f64,
    high: f64,
    values: Vec<[f64; VALUES]>,
}

impl Hydrotable {
    /// Integrates the mesh at every node.
    pub(super) fn of(mesh: &Mesh, z0: f64, height: f64) -> Self {
        let reach = 0.5 * mesh.bounds().map_or(0.0, |bounds| bounds.extent().x.max(bounds.extent().y));
        let slack = reach * STEEPEST[1].sin();
        let (low, high) = (z0 - slack, z0 + height + slack);
        let mut values = Vec::with_capacity(LEVELS * PITCHES * ROLLS);
        for roll in 0..ROLLS {
            for pitch in 0..PITCHES {
                let angle = |index: usize, count: usize, steepest: f64| {
                    (2.0 * index as f64 / (count - 1) as f64 - 1.0) * steepest
                };
                let up =
                    up_from_roll_pitch(angle(roll, ROLLS, STEEPEST[0]), angle(pitch, PITCHES, STEEPEST[1]));
                for level in 0..LEVELS {
                    let offset = low + (high - low) * level as f64 / (LEVELS - 1) as f64;
                    values.push(integrate(mesh, &WaterPlane { normal: up, offset }));
                }
            }
        }
        Self { low, high, values }
    }

    pub(super) fn immerse(&self, plane: &WaterPlane, out: &mut Immersion) {
        let up = plane.normal.into_inner();
        let roll = (up.y / up.z.max(0.1)).atan();
        let pitch = -up.x.clamp(-1.0, 1.0).asin();
        let place = |share: f64, count: usize| {
            let at = share.clamp(0.0, 1.0) * (count - 1) as f64;
            let cell = (at as usize).min(count - 2);
            (cell, at - cell as f64)
        };
        let (i, x) = place((plane.offset - self.low) / (self.high - self.low), LEVELS);
        let (j, y) = place(0.5 + 0.5 * pitch / STEEPEST[1], PITCHES);
        let (k, z) = place(0.5 + 0.5 * roll / STEEPEST[0], ROLLS);
        let mut sum = [0.0; VALUES];
        for (corner, weight) in corners(x, y, z) {
            let [a, b, c] = corner;
            let values = &self.values[((k + c) * PITCHES + j + b) * LEVELS + i + a];
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
        }
        let [volume, vx, vy, vz, area, ax, ay, az] = sum;
        let center = |moment: Vec3, of: f64| if of > 1e-9 { moment / of } else { Vec3::zeros() };
        out.volume = volume;
        out.center_of_buoyancy = center(Vec3::new(vx, vy, vz), volume);
        out.waterplane_area = area;
        out.waterplane_center = center(Vec3::new(ax, ay, az), area);
    }
}

fn corners(x: f64, y: f64, z: f64) -> [([usize; 3], f64); 8] {
    std::array::from_fn(|corner| {
        let bits = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
        let weight = |bit: usize, share: f64| if bit == 1 { share } else { 1.0 - share };
        (bits, weight(bits[0], x) * weight(bits[1], y) * weight(bits[2], z))
    })
}

/// By the divergence theorem over the wet faces; the lid at the water surface gives the rest.
fn integrate(mesh: &Mesh, plane: &WaterPlane) -> [f64; VALUES] {
    let up = plane.normal.into_inner();
    let (mut lid, mut lid_moment) = (0.0, Vec3::zeros());
    let (mut volume, mut moment) = (0.0, Vec3::zeros());
    for face in 0..mesh.faces.len() {
        for triangle in wet_triangles(mesh, face, plane).iter() {
            let area = triangle.area_vector();
            let facing = -area.dot(&up);
            lid += facing;
            for (point, depth) in triangle.edge_midpoints() {
                // a column of water from the face up to the surface
                volume += facing * depth / 3.0;
                moment += (point + up * (0.5 * depth)) * (facing * depth / 3.0);
                lid_moment += (point + up * depth) * (facing / 3.0);
            }
        }
    }
    [volume, moment.x, moment.y, moment.z, lid, lid_moment.x, lid_moment.y, lid_moment.z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::hydrostatics::hydrostatics;
    use crate::vehicle::shipped;

    #[test]
    #[allow(clippy::unwrap_used)]
    fn the_table_agrees_with_the_integral() {
        let vehicle = shipped::warthog().unwrap().vehicle().unwrap();
        let table = Hydrotable::of(&vehicle.hull.mesh, vehicle.z0, vehicle.dimensions.height);
        for (roll, pitch, depth) in [(0.0, 0.0, 0.2), (0.02, 0.1, 0.25), (-0.03, -0.15, 0.15)] {
            let plane = WaterPlane::new(vehicle.z0, depth, up_from_roll_pitch(roll, pitch));
            let exact = hydrostatics(&vehicle.hull.mesh, &plane, 1000.0, &Vec3::zeros());
            let mut found = Immersion::default();
            table.immerse(&plane, &mut found);
            assert!((found.volume / exact.displaced_volume - 1.0).abs() < 0.03, "{found:?} {exact:?}");
            let center = exact.center_of_buoyancy.unwrap();
            assert!((found.center_of_buoyancy - center).norm() < 0.02, "{found:?} {center}");
        }
    }
}
