//! The connected parts of a mesh: are their edges closed, how do they lie to each other?

use std::collections::HashMap;

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

fn find(root: &mut [usize], mut face: usize) -> usize {
    while root[face] != face {
        root[face] = root[root[face]];
        face = root[face];
    }
    face
}

/// The undirected edges of a face, and whether the face runs along each from the smaller index to the larger.
fn edges(&[a, b, c]: &[u32; 3]) -> [((u32, u32), bool); 3] {
    [(a, b), (b, c), (c, a)].map(|(p, q)| ((p.min(q), p.max(q)), p < q))
}

/// Counts of faulty edges.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct EdgeFaults {
    pub(super) open: usize,
    pub(super) non_manifold: usize,
    pub(super) inverted: usize,
}

impl EdgeFaults {
    fn of(mesh: &Mesh) -> Self {
        let mut uses: HashMap<(u32, u32), (usize, usize)> = HashMap::new();
        for (edge, forward) in mesh.faces.iter().flat_map(edges) {
            let count = uses.entry(edge).or_default();
            if forward { count.0 += 1 } else { count.1 += 1 }
        }
        let mut faults = Self::default();
        for count in uses.values() {
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
        self.open + self.non_manifold + self.inverted == 0
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
}
