//! The connected parts of a mesh: are their edges closed, how do they lie to each other?

use std::collections::{BTreeMap, HashMap};

use super::mesh::{Bounds, Mesh};
use super::parry::{Solid, convex_hull};
use crate::frame::Vec3;

/// A part that fills less of its convex hull than this is taken for a double skin (two parallel sheets joined at an
/// opening). A measured example: the public Husky base mesh displaces 14 N where its sealed hull displaces 225 N.
pub const THIN_SHARE: f64 = 0.15;

/// Faces joined by shared edges, each part in face order, parts in the order of their first face.
///
/// Edges and not corners: two boxes that touch at a point are two parts.
pub fn parts(mesh: &Mesh) -> Vec<Vec<usize>> {
    let mut root: Vec<usize> = (0..mesh.faces.len()).collect();
    let mut first_on_edge = HashMap::new();
    for (face, corners) in mesh.faces.iter().enumerate() {
        for (edge, _) in edges(corners) {
            let other = *first_on_edge.entry(edge).or_insert(face);
            let (a, b) = (find(&mut root, face), find(&mut root, other));
            root[a.max(b)] = a.min(b);
        }
    }
    let mut parts: Vec<Vec<usize>> = Vec::new();
    let mut index = HashMap::new();
    for face in 0..mesh.faces.len() {
        let part = *index.entry(find(&mut root, face)).or_insert(parts.len());
        if part == parts.len() {
            parts.push(Vec::new());
        }
        parts[part].push(face);
    }
    parts
}

/// First member of the set that a member belongs to, by the member that each one points to.
pub fn find(root: &mut [usize], mut member: usize) -> usize {
    while root[member] != member {
        root[member] = root[root[member]];
        member = root[member];
    }
    member
}

/// The undirected edges of a face, and whether the face runs along each from the smaller index to the larger.
pub(super) fn edges(&[a, b, c]: &[u32; 3]) -> [((u32, u32), bool); 3] {
    [(a, b), (b, c), (c, a)].map(|(p, q)| ((p.min(q), p.max(q)), p < q))
}

/// How often each edge is run along from the smaller index to the larger, and back.
fn edge_uses(mesh: &Mesh) -> HashMap<(u32, u32), (usize, usize)> {
    let mut uses: HashMap<(u32, u32), (usize, usize)> = HashMap::new();
    for (edge, forward) in mesh.faces.iter().flat_map(edges) {
        let count = uses.entry(edge).or_default();
        if forward { count.0 += 1 } else { count.1 += 1 }
    }
    uses
}

/// A connected set of edges whose faces do not cancel: the rim of a hole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hole {
    /// Center of the box around its corners [m].
    pub center: Vec3,
    /// Diagonal of that box [m].
    pub extent: f64,
    /// Number of its edges.
    pub edges: usize,
}

/// The rims of all holes, the largest first.
pub fn holes(mesh: &Mesh) -> Vec<Hole> {
    let uses = edge_uses(mesh);
    let open = || uses.iter().filter(|(_, (forward, backward))| forward != backward).map(|(edge, _)| *edge);
    let mut root: Vec<usize> = (0..mesh.vertices.len()).collect();
    for (a, b) in open() {
        let (a, b) = (find(&mut root, a as usize), find(&mut root, b as usize));
        root[a.max(b)] = a.min(b);
    }
    let mut rims: BTreeMap<usize, (Bounds, usize)> = BTreeMap::new();
    for (a, b) in open() {
        let [p, q] = [a, b].map(|v| mesh.vertices[v as usize]);
        let rim = rims.entry(find(&mut root, a as usize)).or_insert((Bounds { min: p, max: p }, 0));
        rim.0 = Bounds { min: rim.0.min.inf(&p).inf(&q), max: rim.0.max.sup(&p).sup(&q) };
        rim.1 += 1;
    }
    let hole = |(bounds, edges): (Bounds, usize)| Hole {
        center: bounds.center(),
        extent: bounds.extent().norm(),
        edges,
    };
    let mut holes: Vec<Hole> = rims.into_values().map(hole).collect();
    holes.sort_by(|a, b| b.extent.total_cmp(&a.extent));
    holes
}

/// Counts of faulty edges.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct EdgeFaults {
    pub(super) open: usize,
    pub(super) non_manifold: usize,
    pub(super) inverted: usize,
}

impl EdgeFaults {
    pub(super) fn of(mesh: &Mesh) -> Self {
        let mut faults = Self::default();
        for count in edge_uses(mesh).values() {
            match *count {
                // two bodies that share an edge have four faces there and are closed all the same
                (forward, backward) if forward == backward => {}
                (1, 0) | (0, 1) => faults.open += 1,
                (2, 0) | (0, 2) => faults.inverted += 1,
                _ => faults.non_manifold += 1,
            }
        }
        faults
    }

    pub(super) fn closed(&self) -> bool {
        self.count() == 0
    }

    pub(super) fn count(&self) -> usize {
        self.open + self.non_manifold + self.inverted
    }
}

/// One connected part with what the tests need.
pub(super) struct Part {
    pub(super) mesh: Mesh,
    pub(super) edges: EdgeFaults,
    bounds: Bounds,
    solid: Option<Solid>,
    pub(super) volume: f64,
}

impl Part {
    pub(super) fn new(mesh: Mesh) -> Self {
        let edges = EdgeFaults::of(&mesh);
        let bounds = mesh.bounds().unwrap_or(Bounds { min: Default::default(), max: Default::default() });
        let volume = mesh.volume();
        let mut outward = mesh.clone();
        if volume < 0.0 {
            outward.faces.iter_mut().for_each(|f| f.swap(1, 2));
        }
        Self { solid: Solid::new(&outward), mesh, edges, bounds, volume }
    }

    /// Closed, outward, and not a double skin: may stand as it is.
    pub(super) fn is_sound(&self) -> bool {
        self.edges.closed() && self.volume > 0.0 && self.share_of_hull().is_some_and(|s| s >= THIN_SHARE)
    }

    pub(super) fn share_of_hull(&self) -> Option<f64> {
        convex_hull(&self.mesh.vertices).map(|hull| self.volume.abs() / hull.volume())
    }

    /// Center of its box [m].
    pub(super) fn middle(&self) -> Vec3 {
        self.bounds.center()
    }

    fn tolerance(&self) -> f64 {
        1e-6 * self.bounds.extent().norm()
    }

    pub(super) fn near(&self, other: &Self) -> bool {
        self.bounds.overlaps(&other.bounds, self.tolerance().max(other.tolerance()))
    }

    /// Depth of a point inside this part [m]; negative outside.
    fn depth_inside(&self, point: &Vec3) -> f64 {
        self.solid.as_ref().map_or(f64::NEG_INFINITY, |s| -s.signed_distance(point))
    }

    /// Every corner, middle of an edge and middle of a face inside or on the other part.
    pub(super) fn lies_in(&self, other: &Self) -> bool {
        let tolerance = other.tolerance();
        let corners = self.mesh.vertices.iter().copied();
        let middles = (0..self.mesh.faces.len()).flat_map(|face| {
            let [a, b, c] = self.mesh.triangle(face);
            [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0]
        });
        let within = corners.chain(middles).all(|point| other.depth_inside(&point) >= -tolerance);
        within && self.volume.abs() <= other.volume.abs() * (1.0 + 1e-9)
    }

    /// An edge of this part runs through the inside of the other, beyond touching.
    pub(super) fn pierces(&self, other: &Self) -> bool {
        let Some(solid) = other.solid.as_ref().filter(|_| other.edges.closed()) else {
            return false;
        };
        let (tolerance, probe) = (other.tolerance(), 1e-4 * other.bounds.extent().norm());
        self.mesh.faces.iter().flat_map(edges).filter(|(_, forward)| *forward).any(|((a, b), _)| {
            let (a, b) = (self.mesh.vertices[a as usize], self.mesh.vertices[b as usize]);
            if other.depth_inside(&a) > tolerance || other.depth_inside(&b) > tolerance {
                return true;
            }
            // abutting boxes meet edge on face without entering: look a little beyond the first hit
            solid.first_hit(&a, &b).is_some_and(|t| {
                let beyond = (t + probe / (b - a).norm()).min(1.0);
                other.depth_inside(&(a + (b - a) * beyond)) > tolerance
            })
        })
    }

    /// The common volume of two closed parts, counted on a grid over the box that they share.
    pub(super) fn common_volume(&self, other: &Self) -> Common {
        let (min, max) = (self.bounds.min.sup(&other.bounds.min), self.bounds.max.inf(&other.bounds.max));
        let step = (max - min) / OVERLAP_POINTS as f64;
        let (mut count, mut sum) = (0_usize, Vec3::zeros());
        for index in 0..OVERLAP_POINTS.pow(3) {
            let [i, j, k] = [index, index / OVERLAP_POINTS, index / OVERLAP_POINTS.pow(2)]
                .map(|n| (n % OVERLAP_POINTS) as f64 + 0.5);
            let point = min + Vec3::new(i, j, k).component_mul(&step);
            if self.depth_inside(&point) > 0.0 && other.depth_inside(&point) > 0.0 {
                count += 1;
                sum += point;
            }
        }
        let middle = (min + max) * 0.5;
        Common {
            volume: step.product() * count as f64,
            center: if count > 0 { sum / count as f64 } else { middle },
        }
    }
}

/// Points a direction by which a common volume is counted: 5 % for a sphere.
const OVERLAP_POINTS: usize = 20;

/// What two parts share.
#[derive(Debug, Clone, Copy)]
pub(super) struct Common {
    /// Volume [m3].
    pub(super) volume: f64,
    /// Its center [m].
    pub(super) center: Vec3,
}
