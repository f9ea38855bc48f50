//! A surface in as few triangles as its flat parts need, so that a plane cuts few of them.

use std::collections::{HashMap, HashSet};

use super::mesh::Mesh;
use crate::frame::Vec3;

type Triangle = [Vec3; 3];

/// Rounding of a coordinate in single precision, in which STL files hold them, over the coordinate [-].
const ROUNDING: f64 = 2.0 * f32::EPSILON as f64;
/// Relative difference between the areas of a flat part and of the triangles put in its place.
const SAME_AREA: f64 = 1e-6;
/// Sine of the slope below which a flat part counts as level [-].
const LEVEL: f64 = 1e-3;

/// The same surface, in which each flat convex part that was several triangles is cut into layers across the body's z, two
/// triangles each: the water of a vehicle that stands nearly upright meets few of them, where it meets half of a fan. What is not
/// convex, or has a hole, stays as it is. Flat is what the rounding of an STL file cannot tell from a plane.
pub(super) fn merged(mesh: &Mesh, faces: &[usize]) -> Vec<Triangle> {
    let net = Net::new(mesh, faces);
    let mut taken = vec![false; mesh.faces.len()];
    let mut merged = Vec::new();
    let mut by_area = faces.to_vec();
    // the largest knows its plane best
    by_area.sort_by(|a, b| mesh.area_vector(*b).norm().total_cmp(&mesh.area_vector(*a).norm()));
    for seed in by_area {
        if taken[seed] {
            continue;
        }
        let part = net.flat_part(seed, &mut taken);
        let normal = net.normal(seed).filter(|_| part.len() > 1);
        let outline = normal.and_then(|normal| Some((normal, net.convex_outline(&part, &normal)?)));
        let old = part.iter().map(|face| mesh.triangle(*face));
        let Some((normal, polygon)) = outline else {
            merged.extend(old);
            continue;
        };
        let from = merged.len();
        layers(&polygon, &normal, &mut merged);
        let before = part.iter().map(|face| mesh.area_vector(*face).norm()).sum::<f64>();
        let after = merged[from..].iter().map(|triangle| vector(triangle).norm()).sum::<f64>();
        if (before - after).abs() > SAME_AREA * before {
            merged.truncate(from);
            merged.extend(old);
        }
    }
    merged
}

/// Faces of a mesh with their neighbors across an edge.
struct Net<'a> {
    mesh: &'a Mesh,
    /// The face that runs along an edge in this direction.
    along: HashMap<[u32; 2], usize>,
    tolerance: f64,
}

impl<'a> Net<'a> {
    fn new(mesh: &'a Mesh, faces: &[usize]) -> Self {
        let runs = |&face: &usize| edges(&mesh.faces[face]).map(|edge| (edge, face));
        let size = mesh.vertices.iter().map(Vec3::amax).fold(0.0, f64::max);
        Self { mesh, along: faces.iter().flat_map(runs).collect(), tolerance: ROUNDING * size }
    }

    fn normal(&self, face: usize) -> Option<Vec3> {
        self.mesh.area_vector(face).try_normalize(0.0)
    }

    /// Faces that lie in the plane of `seed` and hang together with it.
    fn flat_part(&self, seed: usize, taken: &mut [bool]) -> Vec<usize> {
        taken[seed] = true;
        let mut part = vec![seed];
        let Some(normal) = self.normal(seed) else { return part };
        let origin = self.mesh.triangle(seed)[0];
        let flat = |face: usize| {
            let corners = self.mesh.triangle(face);
            corners.iter().all(|corner| (corner - origin).dot(&normal).abs() <= self.tolerance)
                && self.mesh.area_vector(face).dot(&normal) >= 0.0
        };
        let mut next = 0;
        while let Some(&face) = part.get(next) {
            next += 1;
            for [from, to] in edges(&self.mesh.faces[face]) {
                let Some(&neighbor) = self.along.get(&[to, from]) else { continue };
                if !taken[neighbor] && flat(neighbor) {
                    taken[neighbor] = true;
                    part.push(neighbor);
                }
            }
        }
        part
    }

    /// Corners of the one outline of a part, those within an edge left out; `None` where it is not convex.
    fn convex_outline(&self, part: &[usize], normal: &Vec3) -> Option<Vec<Vec3>> {
        let faces: HashSet<usize> = part.iter().copied().collect();
        let own = |edge: [u32; 2]| self.along.get(&edge).is_some_and(|face| faces.contains(face));
        let mut after = HashMap::new();
        for [from, to] in part.iter().flat_map(|face| edges(&self.mesh.faces[*face])) {
            if !own([to, from]) && after.insert(from, to).is_some() {
                return None;
            }
        }
        let start = *after.keys().min()?;
        let (mut outline, mut corner) = (Vec::new(), start);
        while outline.len() < after.len() {
            outline.push(self.mesh.vertices[corner as usize]);
            corner = *after.get(&corner)?;
            if corner == start {
                break;
            }
        }
        if corner != start || outline.len() != after.len() {
            return None;
        }
        // one after the other, since of two close corners only one may go
        let mut index = 0;
        while outline.len() >= 3 && index < outline.len() {
            let [before, here, next] =
                [outline.len() - 1, 0, 1].map(|step| outline[(index + step) % outline.len()]);
            let chord = next - before;
            if (here - before).cross(&chord).norm() <= self.tolerance * chord.norm() {
                outline.remove(index);
            } else {
                index += 1;
            }
        }
        let convex = |i: usize| {
            let [before, here, next] = [0, 1, 2].map(|step| outline[(i + step) % outline.len()]);
            (here - before).cross(&(next - here)).dot(normal) > 0.0
        };
        (outline.len() >= 3 && (0..outline.len()).all(convex)).then_some(outline)
    }
}

/// Cuts a convex polygon into layers, from its highest corner down on both sides.
fn layers(polygon: &[Vec3], normal: &Vec3, out: &mut Vec<Triangle>) {
    let upward = Vec3::z() - normal * normal.z;
    // a level one has no height; along the body then
    let upward = if upward.norm() > LEVEL { upward } else { Vec3::x() };
    let height = |corner: &Vec3| corner.dot(&upward);
    let count = polygon.len();
    let top = (0..count).max_by(|a, b| height(&polygon[*a]).total_cmp(&height(&polygon[*b]))).unwrap_or(0);
    let ahead = |step: usize| polygon[(top + step) % count];
    let back = |step: usize| polygon[(top + count - step) % count];
    let (mut left, mut right) = (1, 0);
    while left + right < count - 1 {
        let (next_left, next_right) = (ahead(left + 1), back(right + 1));
        if height(&next_left) >= height(&next_right) {
            out.push([ahead(left), next_left, back(right)]);
            left += 1;
        } else {
            out.push([ahead(left), next_right, back(right)]);
            right += 1;
        }
    }
}

fn edges(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

fn vector([a, b, c]: &Triangle) -> Vec3 {
    (b - a).cross(&(c - a)) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::shipped;

    /// Unit squares of a plane, two triangles each.
    fn squares(places: impl IntoIterator<Item = (u32, u32)>) -> Mesh {
        let row = 8;
        let vertices = (0..row * row).map(|i| Vec3::new(f64::from(i % row), f64::from(i / row), 1.0));
        let two = |(x, y): (u32, u32)| {
            let at = |dx: u32, dy: u32| x + dx + row * (y + dy);
            [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]]
        };
        Mesh { vertices: vertices.collect(), faces: places.into_iter().flat_map(two).collect() }
    }

    fn all(mesh: &Mesh) -> Vec<Triangle> {
        merged(mesh, &(0..mesh.faces.len()).collect::<Vec<_>>())
    }

    #[test]
    fn a_finely_cut_plate_becomes_a_few_triangles_and_a_fan_is_met_rarely() {
        let plate = all(&squares((0..16).map(|i| (i % 4, i / 4))));
        assert_eq!(plate.len(), 2);
        assert!(plate.iter().all(|t| vector(t).z > 0.0));
        let rim = |i: u32| {
            let angle = f64::from(i) / 64.0 * std::f64::consts::TAU;
            Vec3::new(angle.cos(), 0.0, angle.sin())
        };
        let fan =
            Mesh { vertices: (0..64).map(rim).collect(), faces: (1..63).map(|i| [0, i + 1, i]).collect() };
        let layers = all(&fan);
        assert_eq!(layers.len(), 62);
        let met = |triangles: &[Triangle], height: f64| {
            let across = |t: &&Triangle| t.iter().any(|c| c.z < height) && t.iter().any(|c| c.z > height);
            triangles.iter().filter(across).count()
        };
        let most =
            |triangles: &[Triangle]| (0..99).map(|i| met(triangles, -0.98 + 0.02 * f64::from(i))).max();
        let fan: Vec<Triangle> = (0..62).map(|face| fan.triangle(face)).collect();
        assert!(most(&layers) <= Some(3) && most(&fan) >= Some(30), "{:?} {:?}", most(&layers), most(&fan));
    }

    #[test]
    fn a_frame_and_a_corner_stay_as_they_are() {
        assert_eq!(all(&squares([(0, 0), (1, 0), (0, 1)])).len(), 6);
        let around = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)];
        assert_eq!(all(&squares(around)).len(), 16);
    }

    #[test]
    fn the_shipped_hulls_keep_their_surfaces() {
        for vehicle in [shipped::husky(), shipped::warthog()] {
            let vehicle = vehicle.expect("sound").vehicle().expect("sound");
            for surface in 0..vehicle.surfaces.len() {
                let own: Vec<usize> = vehicle.hull.faces_of(surface).collect();
                let merged = merged(&vehicle.hull.mesh, &own);
                let faces: Vec<Triangle> = own.iter().map(|face| vehicle.hull.mesh.triangle(*face)).collect();
                let sum = |triangles: &[Triangle]| triangles.iter().map(vector).sum::<Vec3>();
                let total = faces.iter().map(|t| vector(t).norm()).sum::<f64>();
                assert!((sum(&faces) - sum(&merged)).norm() < 1e-6 * total);
                assert!(merged.len() <= faces.len());
            }
        }
    }
}
