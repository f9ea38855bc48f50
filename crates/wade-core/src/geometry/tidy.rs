//! Mends what exporters leave in a mesh without changing its shape: corners that differ by rounding, faces without area, faces
//! that are written twice.

use std::collections::{HashMap, HashSet};

use super::mesh::Mesh;
use super::parts::{EdgeFaults, edges};
use crate::frame::Vec3;

/// Corners nearer than this share of the mesh's diagonal are one corner, where that closes the mesh.
pub const WELD_SHARE: f64 = 1e-6;

/// A face is flat whose height is below this share of its longest edge.
pub const FLAT_SHARE: f64 = 1e-6;

/// Steps of f32 by which two copies of a corner may differ: exporters turn and move parts before they write them.
const WELD_STEPS: f64 = 2.0;

/// What was mended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tidying {
    /// Corners joined to one within the tolerance.
    pub joined_corners: usize,
    /// Faces without area that were dropped.
    pub dropped_faces: usize,
    /// Faces that were dropped because the same one stands before them.
    pub repeated_faces: usize,
}

impl Tidying {
    /// True where the mesh is as it was.
    pub fn is_nothing(&self) -> bool {
        *self == Self::default()
    }
}

/// Joins near corners and drops flat faces where the mesh is closed by that, or no less closed than before.
///
/// A mesh that is closed and has neither a flat face nor one twice stays as it is, bit for bit.
pub fn tidy(mesh: Mesh) -> (Mesh, Tidying) {
    let mut done = Tidying::default();
    let mesh = without_repeated_faces(without_flat_faces(mesh, &mut done), &mut done);
    let faults = EdgeFaults::of(&mesh);
    if faults.closed() {
        return (mesh, done);
    }
    let (joined, corners) = welded(&mesh, weld_tolerance(&mesh));
    let mut after = Tidying { joined_corners: corners, ..done };
    let joined = without_repeated_faces(without_flat_faces(joined, &mut after), &mut after);
    if EdgeFaults::of(&joined).count() < faults.count() { (joined, after) } else { (mesh, done) }
}

/// Distance below which corners are joined [m].
pub fn weld_tolerance(mesh: &Mesh) -> f64 {
    let Some(bounds) = mesh.bounds() else { return 0.0 };
    let largest = bounds.min.amax().max(bounds.max.amax());
    (WELD_SHARE * bounds.extent().norm()).max(WELD_STEPS * f64::from(f32::EPSILON) * largest)
}

/// Every corner at the place of the first one within `tolerance` [m], and how many moved.
pub fn welded(mesh: &Mesh, tolerance: f64) -> (Mesh, usize) {
    let cell = tolerance.max(f64::MIN_POSITIVE);
    let key = |p: &Vec3| [p.x, p.y, p.z].map(|c| (c / cell).floor() as i64);
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut kept: Vec<Vec3> = Vec::new();
    let mut place = Vec::with_capacity(mesh.vertices.len());
    for vertex in &mesh.vertices {
        let [x, y, z] = key(vertex);
        let neighbors = (0..27).map(|n| [x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1]);
        let near = neighbors
            .filter_map(|key| cells.get(&key))
            .flatten()
            .copied()
            .find(|&other| (kept[other as usize] - vertex).norm() <= tolerance);
        place.push(near.unwrap_or_else(|| {
            let index = kept.len() as u32;
            kept.push(*vertex);
            cells.entry([x, y, z]).or_default().push(index);
            index
        }));
    }
    let joined = mesh.vertices.len() - kept.len();
    let faces = mesh.faces.iter().map(|face| face.map(|v| place[v as usize])).collect();
    (Mesh { vertices: kept, faces }, joined)
}

/// Drops faces of which two corners are one, and flat ones whose edges then cancel better than before.
fn without_flat_faces(mesh: Mesh, done: &mut Tidying) -> Mesh {
    let mut keep: Vec<bool> = mesh.faces.iter().map(|&[a, b, c]| a != b && b != c && c != a).collect();
    let flat: Vec<usize> =
        (0..mesh.faces.len()).filter(|&face| keep[face] && is_flat(mesh.triangle(face))).collect();
    if !flat.is_empty() {
        let mut balance: HashMap<(u32, u32), i32> = HashMap::new();
        for face in (0..mesh.faces.len()).filter(|&face| keep[face]) {
            for (edge, forward) in edges(&mesh.faces[face]) {
                *balance.entry(edge).or_default() += if forward { 1 } else { -1 };
            }
        }
        // one that goes may free the next: flat faces come in strips
        let mut again = true;
        while again {
            again = false;
            for &face in &flat {
                if keep[face] && is_in_the_way(&mesh, face, &balance) {
                    (keep[face], again) = (false, true);
                    for (edge, forward) in edges(&mesh.faces[face]) {
                        *balance.entry(edge).or_default() -= if forward { 1 } else { -1 };
                    }
                }
            }
        }
    }
    let faces: Vec<usize> = (0..mesh.faces.len()).filter(|&face| keep[face]).collect();
    done.dropped_faces += mesh.faces.len() - faces.len();
    if faces.len() == mesh.faces.len() { mesh } else { mesh.part(&faces) }
}

/// Drops faces whose corners are, in the same order, those of a face before them: a solid that is written twice is one solid.
fn without_repeated_faces(mesh: Mesh, done: &mut Tidying) -> Mesh {
    let mut seen = HashSet::new();
    let faces: Vec<usize> =
        (0..mesh.faces.len()).filter(|&face| seen.insert(turned(mesh.faces[face]))).collect();
    done.repeated_faces += mesh.faces.len() - faces.len();
    if faces.len() == mesh.faces.len() { mesh } else { mesh.part(&faces) }
}

/// The corners of a face, from the smallest index on: the same for every way to write it.
pub fn turned([a, b, c]: [u32; 3]) -> [u32; 3] {
    match a.min(b).min(c) {
        least if least == a => [a, b, c],
        least if least == b => [b, c, a],
        _ => [c, a, b],
    }
}

/// True where the edges of a face cancel better without it.
fn is_in_the_way(mesh: &Mesh, face: usize, balance: &HashMap<(u32, u32), i32>) -> bool {
    let change = edges(&mesh.faces[face]).map(|(edge, forward)| {
        let now = balance.get(&edge).copied().unwrap_or_default();
        let without = now - if forward { 1 } else { -1 };
        without.abs() - now.abs()
    });
    change.iter().sum::<i32>() < 0
}

fn is_flat([a, b, c]: [Vec3; 3]) -> bool {
    let longest = (b - a).norm_squared().max((c - a).norm_squared()).max((c - b).norm_squared());
    (b - a).cross(&(c - a)).norm() <= FLAT_SHARE * longest
}
