//! A hull as elements: small patches with area, normal, position and spread, for loads that are sums over the surface.
//!
//! An element is a group of pieces of faces of one surface that lie in one cell of a grid and face about the same way. It is
//! wet by a share that varies continuously with the water plane, whatever the attitude. Left and right of a symmetric
//! vehicle are mirror images to the bit.

use nalgebra::Matrix3;

use crate::frame::Vec3;
use crate::geometry::mesh::Mesh;
use crate::vehicle::Vehicle;

/// Elements that are evaluated in one step; the elements of a surface are padded to a multiple of it.
pub const LANES: usize = 8;

/// Elements aimed at for a hull: `docs/src/results/latency.md` has the table of error against cost.
pub const COUNT: usize = 256;

/// Most pieces that a hull is cut into before they are grouped; a finer mesh is grouped as it is.
const MAX_PIECES: usize = 1 << 20;

/// Steps by which the cells of the grid grow until few enough elements are left.
const GROWTH: f64 = 1.1;

/// Area below which a piece counts for nothing, over the square of the cell [-].
const LEAST_AREA: f64 = 1e-9;

/// One element; body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Element {
    /// Index of the surface.
    pub surface: usize,
    /// Area [m2].
    pub area: f64,
    /// Area vector over its length: unit, outward.
    pub normal: Vec3,
    /// Area centroid [m].
    pub center: Vec3,
    /// Second area moment about the centroid over the area [m2].
    pub spread: Matrix3<f64>,
}

impl Element {
    fn mirrored(&self, surface: usize) -> Self {
        let flip = Matrix3::from_diagonal(&Vec3::new(1.0, -1.0, 1.0));
        Self {
            surface,
            area: self.area,
            normal: flip * self.normal,
            center: flip * self.center,
            spread: flip * self.spread * flip,
        }
    }
}

/// Cuts the hull of a vehicle into at most about `count` elements, those of a surface side by side.
pub fn elements(vehicle: &Vehicle, count: usize) -> Vec<Element> {
    let symmetric = vehicle.symmetric_left_right;
    // half a hull for half the elements; a surface on the plane of symmetry is cut there
    let wanted = if symmetric { count.div_ceil(2) } else { count };
    let area = vehicle.hull.mesh.area() / if symmetric { 2.0 } else { 1.0 };
    let mut cell = (area / wanted as f64).sqrt();
    let shortest = shortest_piece(&vehicle.hull.mesh);
    let mut half = grouped(vehicle, (cell, shortest), symmetric);
    while half.len() > wanted && half.len() > vehicle.surfaces.len() {
        cell *= GROWTH;
        let coarser = grouped(vehicle, (cell, shortest), symmetric);
        // a cell beyond the size of the hull groups no more
        if cell > area.sqrt() && coarser.len() >= half.len() {
            break;
        }
        half = coarser;
    }
    let mut all = half.clone();
    if symmetric {
        all.extend(half.iter().map(|e| e.mirrored(vehicle.surfaces[e.surface].mirror_left_right)));
    }
    all.sort_by_key(|element| element.surface);
    all
}

/// Place of a piece in the grid: surface, cell and direction.
type Key = (usize, [i64; 3], [i8; 3]);

#[derive(Default)]
struct Group {
    area: f64,
    vector: Vec3,
    first: Vec3,
    second: Matrix3<f64>,
}

/// How short pieces may be, so that there is room for all: of a broad face by its area, of a sliver by its length.
fn shortest_piece(mesh: &Mesh) -> f64 {
    let lengths: f64 = (0..mesh.faces.len()).map(|face| longest_edge(&mesh.triangle(face))).sum();
    let most = MAX_PIECES as f64;
    (2.0 * mesh.area() / most).sqrt().max(2.0 * lengths / most)
}

/// The pieces of the hull by cell; none is longer than a cell or, where that is longer, than the shortest that there is room for.
fn grouped(vehicle: &Vehicle, (cell, shortest): (f64, f64), left_half: bool) -> Vec<Element> {
    let mut groups = std::collections::BTreeMap::<Key, Group>::new();
    let mesh = &vehicle.hull.mesh;
    let piece = cell.max(shortest);
    let mut stack = Vec::new();
    for (face, &surface) in vehicle.hull.face_surface.iter().enumerate() {
        stack.push(mesh.triangle(face));
        while let Some(corners) = stack.pop() {
            if left_half && corners.iter().all(|corner| corner.y <= 0.0) {
                continue;
            }
            if left_half && corners.iter().any(|corner| corner.y < 0.0) {
                stack.extend(left_of_plane(corners));
                continue;
            }
            match halves(corners, piece) {
                Some(halves) => stack.extend(halves),
                None => add_piece(&mut groups, surface as usize, corners, cell),
            }
        }
    }
    groups.into_iter().filter_map(|((surface, ..), group)| group.element(surface)).collect()
}

fn add_piece(
    groups: &mut std::collections::BTreeMap<Key, Group>,
    surface: usize,
    corners: [Vec3; 3],
    cell: f64,
) {
    let [a, b, c] = corners;
    let vector = (b - a).cross(&(c - a)) * 0.5;
    let area = vector.norm();
    if area <= LEAST_AREA * cell * cell {
        return;
    }
    let center = (a + b + c) / 3.0;
    // a face that lies on a boundary of cells falls on one side of it, whatever the rounding
    let place = center.map(|x| (x / cell + 1e-6).floor() as i64);
    // 26 directions: each component by thirds of a turn
    let direction = (vector / area * 1.3).map(|x| x.round() as i8);
    let group = groups.entry((surface, place.into(), direction.into())).or_default();
    group.area += area;
    group.vector += vector;
    group.first += center * area;
    for middle in [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5] {
        group.second += middle * middle.transpose() * (area / 3.0);
    }
}

impl Group {
    fn element(self, surface: usize) -> Option<Element> {
        let center = self.first / self.area;
        let normal = self.vector.try_normalize(1e-3 * self.area)?;
        let spread = self.second / self.area - center * center.transpose();
        Some(Element { surface, area: self.area, normal, center, spread })
    }
}

fn longest_edge([a, b, c]: &[Vec3; 3]) -> f64 {
    (b - a).norm().max((c - b).norm()).max((a - c).norm())
}

/// The two halves of a triangle cut at the middle of its longest edge; `None` where no edge is longer than `limit`.
fn halves([a, b, c]: [Vec3; 3], limit: f64) -> Option<[[Vec3; 3]; 2]> {
    let edges = [(b - a).norm(), (c - b).norm(), (a - c).norm()];
    let longest = edges[0].max(edges[1]).max(edges[2]);
    if longest <= limit {
        return None;
    }
    let [a, b, c] = if longest == edges[0] {
        [a, b, c]
    } else if longest == edges[1] {
        [b, c, a]
    } else {
        [c, a, b]
    };
    let middle = (a + b) * 0.5;
    Some([[a, middle, c], [middle, b, c]])
}

/// The part of a triangle with y >= 0, of a triangle with corners on both sides.
fn left_of_plane(corners: [Vec3; 3]) -> impl Iterator<Item = [Vec3; 3]> {
    let mut polygon: Vec<Vec3> = Vec::with_capacity(4);
    for i in 0..3 {
        let (p, q) = (corners[i], corners[(i + 1) % 3]);
        if p.y >= 0.0 {
            polygon.push(p);
        }
        if (p.y > 0.0 && q.y < 0.0) || (p.y < 0.0 && q.y > 0.0) {
            let mut cut = p + (q - p) * (p.y / (p.y - q.y));
            cut.y = 0.0;
            polygon.push(cut);
        }
    }
    let fan = if polygon.len() < 3 { 0 } else { polygon.len() - 2 };
    (0..fan).map(move |i| [polygon[0], polygon[i + 1], polygon[i + 2]])
}
