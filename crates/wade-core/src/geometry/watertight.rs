//! Is a mesh a closed body? Hydrostatics of anything else is a plausible wrong number, so a mesh is inspected first.

use super::mesh::Mesh;
use super::parts::{Part, THIN_SHARE, parts};

/// What is wrong with a mesh, in numbers; all zero and empty for a set of closed, disjoint, outward bodies.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// Faces in all.
    pub faces: usize,
    /// Connected parts (joined by edges).
    pub parts: usize,
    /// Edges with a face on one side only.
    pub open_edges: usize,
    /// Edges with three or more faces whose windings do not cancel.
    pub non_manifold_edges: usize,
    /// Edges whose two faces are wound against each other.
    pub inverted_edges: usize,
    /// Closed parts whose faces point inward and that lie in no other part.
    pub inward_parts: Vec<usize>,
    /// Parts that lie inside another part: an inner skin, whichever way its faces point.
    pub inner_parts: Vec<usize>,
    /// Closed parts that fill less than `THIN_SHARE` of their convex hull, with that share.
    pub thin_parts: Vec<(usize, f64)>,
    /// Pairs of parts that cut through each other: their common volume would count twice.
    pub overlaps: Vec<(usize, usize)>,
}

/// Why a mesh is not a body that pressure can be integrated over. Parts are numbered in the order of their first face.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LeakError {
    /// No face at all.
    #[error("the mesh has no face")]
    Empty,
    /// Holes, or edges with three or more faces.
    #[error(
        "not watertight: {open_edges} open and {non_manifold_edges} non-manifold edges in {parts} parts; close them in the CAD file, or build with sealing (convex hull of each leaky part)"
    )]
    Open {
        /// Edges with one face.
        open_edges: usize,
        /// Edges with more than two faces.
        non_manifold_edges: usize,
        /// Connected parts.
        parts: usize,
    },
    /// Neighbouring faces that disagree on what is outside.
    #[error(
        "{inverted_edges} edges join faces of opposite winding; recalculate the normals, or build with sealing"
    )]
    Inverted {
        /// Edges whose two faces run along them in the same direction.
        inverted_edges: usize,
    },
    /// A part turned inside out.
    #[error("part {part} is inside out (its faces point inward); flip its normals, or build with sealing")]
    Inward {
        /// The part.
        part: usize,
    },
    /// A skin within a skin.
    #[error(
        "double skin: part {part} lies inside another part and would take away or add volume twice; delete it, or build with sealing"
    )]
    InnerSkin {
        /// The inner part.
        part: usize,
    },
    /// A closed sheet around an open cavity.
    #[error(
        "double skin: part {part} fills {percent:.1} % of its convex hull, so it displaces its sheet metal and not its cavity; build with sealing, or set allow_thin_parts if it really is a frame that floods"
    )]
    Thin {
        /// The part.
        part: usize,
        /// Volume over the volume of the convex hull [%].
        percent: f64,
    },
    /// Two parts in the same place.
    #[error(
        "parts {first} and {second} overlap and would displace their common volume twice ({pairs} such pairs); unite them in the CAD file, or set allow_overlaps to accept the excess"
    )]
    Overlap {
        /// One part.
        first: usize,
        /// The other.
        second: usize,
        /// Number of overlapping pairs.
        pairs: usize,
    },
}

/// Exceptions that a vehicle file may make, each by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Allowances {
    /// Accept parts that fill little of their convex hull: frames, bars.
    pub thin_parts: bool,
    /// Accept parts that overlap; the common volume counts twice.
    pub overlaps: bool,
}

/// Refuses a mesh that is not a set of closed, disjoint bodies with outward faces.
pub fn check(mesh: &Mesh) -> Result<(), LeakError> {
    check_allowing(mesh, Allowances::default())
}

/// As `check`, with exceptions.
pub fn check_allowing(mesh: &Mesh, allow: Allowances) -> Result<(), LeakError> {
    inspect(mesh).verdict(allow)
}

impl Report {
    /// The gravest finding as an error.
    pub fn verdict(&self, allow: Allowances) -> Result<(), LeakError> {
        let Self { open_edges, non_manifold_edges, inverted_edges, parts, .. } = *self;
        if self.faces == 0 {
            return Err(LeakError::Empty);
        }
        if open_edges + non_manifold_edges > 0 {
            return Err(LeakError::Open { open_edges, non_manifold_edges, parts });
        }
        if inverted_edges > 0 {
            return Err(LeakError::Inverted { inverted_edges });
        }
        if let Some(&part) = self.inner_parts.first() {
            return Err(LeakError::InnerSkin { part });
        }
        if let Some(&part) = self.inward_parts.first() {
            return Err(LeakError::Inward { part });
        }
        match (self.thin_parts.first(), self.overlaps.first()) {
            (Some(&(part, share)), _) if !allow.thin_parts => {
                Err(LeakError::Thin { part, percent: share * 100.0 })
            }
            (_, Some(&(first, second))) if !allow.overlaps => {
                Err(LeakError::Overlap { first, second, pairs: self.overlaps.len() })
            }
            _ => Ok(()),
        }
    }
}

/// Examines a mesh. Parts with open edges take no part in the tests of volume, which need an inside.
pub fn inspect(mesh: &Mesh) -> Report {
    let parts: Vec<Part> = parts(mesh).iter().map(|faces| Part::new(mesh.part(faces))).collect();
    let mut report = Report { faces: mesh.faces.len(), parts: parts.len(), ..Report::default() };
    for part in &parts {
        report.open_edges += part.edges.open;
        report.non_manifold_edges += part.edges.non_manifold;
        report.inverted_edges += part.edges.inverted;
    }
    relate(&parts, &mut report);
    for (index, part) in parts.iter().enumerate().filter(|(_, p)| p.edges.closed()) {
        if report.inner_parts.contains(&index) {
            continue;
        }
        if part.volume < 0.0 {
            report.inward_parts.push(index);
        }
        match part.share_of_hull() {
            Some(share) if share < THIN_SHARE => report.thin_parts.push((index, share)),
            _ => {}
        }
    }
    report
}

fn relate(parts: &[Part], report: &mut Report) {
    for (i, a) in parts.iter().enumerate() {
        for (j, b) in parts.iter().enumerate().filter(|(j, b)| *j != i && a.near(b)) {
            if b.edges.closed() && a.lies_in(b) {
                report.inner_parts.push(i);
            } else if i < j && (a.pierces(b) || b.pierces(a)) && !b.lies_in(a) {
                report.overlaps.push((i, j));
            }
        }
    }
    report.inner_parts.dedup();
}
