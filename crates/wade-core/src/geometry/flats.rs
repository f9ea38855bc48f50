//! A surface in as few triangles as its flat parts need, so that a plane cuts few of them.

use std::collections::{HashMap, HashSet};

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
pub(super) fn merged(triangles: &[Triangle]) -> Vec<Triangle> {
    let net = Net::new(triangles);
    let mut taken = vec![false; triangles.len()];
    let mut merged = Vec::new();
    let mut by_area: Vec<usize> = (0..triangles.len()).collect();
    // the largest knows its plane best
    by_area.sort_by(|a, b| area(&triangles[*b]).total_cmp(&area(&triangles[*a])));
    for seed in by_area {
        if taken[seed] {
            continue;
        }
        let part = net.flat_part(seed, &mut taken);
        let polygon = (part.len() > 1).then(|| net.convex_outline(&part, seed)).flatten();
        let old = part.iter().map(|face| triangles[*face]);
        let Some(polygon) = polygon else {
            merged.extend(old);
            continue;
        };
        let from = merged.len();
        layers(&polygon, &normal(&triangles[seed]).unwrap_or_default(), &mut merged);
        let areas = [old.clone().map(|t| area(&t)).sum(), merged[from..].iter().map(area).sum::<f64>()];
        if (areas[0] - areas[1]).abs() > SAME_AREA * areas[0] {
            merged.truncate(from);
            merged.extend(old);
        }
    }
    merged
}

/// Triangles with their corners by number and their neighbors across an edge.
struct Net<'a> {
    triangles: &'a [Triangle],
    places: Vec<Vec3>,
    corners: Vec<[usize; 3]>,
    /// The face that runs along an edge in this direction.
    along: HashMap<[usize; 2], usize>,
    tolerance: f64,
}

impl<'a> Net<'a> {
    fn new(triangles: &'a [Triangle]) -> Self {
        let (mut numbers, mut places, mut along) = (HashMap::new(), Vec::new(), HashMap::new());
        let mut number = |place: &Vec3| {
            *numbers.entry([place.x, place.y, place.z].map(f64::to_bits)).or_insert_with(|| {
                places.push(*place);
                places.len() - 1
            })
        };
        let corners: Vec<[usize; 3]> =
            triangles.iter().map(|t| [number(&t[0]), number(&t[1]), number(&t[2])]).collect();
        for (face, corners) in corners.iter().enumerate() {
            for edge in edges(corners) {
                along.insert(edge, face);
            }
        }
        let size = places.iter().map(Vec3::amax).fold(0.0, f64::max);
        Self { triangles, places, corners, along, tolerance: ROUNDING * size }
    }

    /// Faces that lie in the plane of `seed` and hang together with it.
    fn flat_part(&self, seed: usize, taken: &mut [bool]) -> Vec<usize> {
        taken[seed] = true;
        let mut part = vec![seed];
        let Some(normal) = normal(&self.triangles[seed]) else { return part };
        let origin = self.triangles[seed][0];
        let flat = |face: usize| {
            let triangle = &self.triangles[face];
            triangle.iter().all(|corner| (corner - origin).dot(&normal).abs() <= self.tolerance)
                && vector(triangle).dot(&normal) >= 0.0
        };
        let mut next = 0;
        while let Some(&face) = part.get(next) {
            next += 1;
            for [from, to] in edges(&self.corners[face]) {
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
    fn convex_outline(&self, part: &[usize], seed: usize) -> Option<Vec<Vec3>> {
        let normal = normal(&self.triangles[seed])?;
        let faces: HashSet<usize> = part.iter().copied().collect();
        let own = |edge: [usize; 2]| self.along.get(&edge).is_some_and(|face| faces.contains(face));
        let mut after = HashMap::new();
        for [from, to] in part.iter().flat_map(|face| edges(&self.corners[*face])) {
            if !own([to, from]) && after.insert(from, to).is_some() {
                return None;
            }
        }
        let start = *after.keys().min()?;
        let (mut outline, mut corner) = (Vec::new(), start);
        while outline.len() < after.len() {
            outline.push(self.places[corner]);
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
            (here - before).cross(&(next - here)).dot(&normal) > 0.0
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

fn edges([a, b, c]: &[usize; 3]) -> [[usize; 2]; 3] {
    [[*a, *b], [*b, *c], [*c, *a]]
}

fn vector([a, b, c]: &Triangle) -> Vec3 {
    (b - a).cross(&(c - a)) * 0.5
}

fn area(triangle: &Triangle) -> f64 {
    vector(triangle).norm()
}

fn normal(triangle: &Triangle) -> Option<Vec3> {
    vector(triangle).try_normalize(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::shipped;

    #[test]
    fn a_finely_cut_plate_becomes_a_few_triangles_and_a_fan_is_met_rarely() {
        // a square of sixteen squares
        let place = |x: usize, y: usize| Vec3::new(x as f64, y as f64, 1.0);
        let squares = (0..16).map(|i| (i % 4, i / 4));
        let plate: Vec<Triangle> = squares
            .flat_map(|(x, y)| {
                let [a, b, c, d] = [place(x, y), place(x + 1, y), place(x + 1, y + 1), place(x, y + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        let merged_plate = merged(&plate);
        assert_eq!(merged_plate.len(), 2);
        assert!(merged_plate.iter().all(|t| vector(t).z > 0.0));
        let rim = |i: usize| {
            let angle = i as f64 / 64.0 * std::f64::consts::TAU;
            Vec3::new(angle.cos(), 0.0, angle.sin())
        };
        let fan: Vec<Triangle> = (1..63).map(|i| [rim(0), rim(i + 1), rim(i)]).collect();
        let layers = merged(&fan);
        assert_eq!(layers.len(), 62);
        let met = |triangles: &[Triangle], height: f64| {
            let across = |t: &&Triangle| t.iter().any(|c| c.z < height) && t.iter().any(|c| c.z > height);
            triangles.iter().filter(across).count()
        };
        let most =
            |triangles: &[Triangle]| (0..99).map(|i| met(triangles, -0.98 + 0.02 * f64::from(i))).max();
        assert!(most(&layers) <= Some(3) && most(&fan) >= Some(30), "{:?} {:?}", most(&layers), most(&fan));
    }

    #[test]
    fn a_frame_and_a_corner_stay_as_they_are() {
        let place = |x: i32, y: i32| Vec3::new(f64::from(x), f64::from(y), 0.0);
        // an L of three squares
        let corner: Vec<Triangle> = [(0, 0), (1, 0), (0, 1)]
            .into_iter()
            .flat_map(|(x, y)| {
                let [a, b, c, d] = [place(x, y), place(x + 1, y), place(x + 1, y + 1), place(x, y + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        assert_eq!(merged(&corner).len(), 6);
        let around = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)];
        let frame: Vec<Triangle> = around
            .into_iter()
            .flat_map(|(x, y)| {
                let [a, b, c, d] = [place(x, y), place(x + 1, y), place(x + 1, y + 1), place(x, y + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        assert_eq!(merged(&frame).len(), 16);
    }

    #[test]
    fn the_shipped_hulls_keep_their_surfaces() {
        for vehicle in [shipped::husky(), shipped::warthog()] {
            let vehicle = vehicle.expect("sound").vehicle().expect("sound");
            for surface in 0..vehicle.surfaces.len() {
                let faces: Vec<Triangle> =
                    vehicle.hull.faces_of(surface).map(|face| vehicle.hull.mesh.triangle(face)).collect();
                let merged = merged(&faces);
                let sum = |triangles: &[Triangle]| triangles.iter().map(vector).sum::<Vec3>();
                let total = faces.iter().map(area).sum::<f64>();
                assert!((sum(&faces) - sum(&merged)).norm() < 1e-6 * total);
                assert!(merged.len() <= faces.len());
            }
        }
    }
}
