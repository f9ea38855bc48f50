//! Is a mesh a closed body? Hydrostatics of anything else is a plausible wrong number, so a mesh is inspected first.

use super::mesh::Mesh;
use super::parry::convex_hull;
use super::parts::{Common, EdgeFaults, Hole, Part, THIN_SHARE, holes, parts};
use crate::frame::Vec3;

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
    pub overlaps: Vec<Overlap>,
    /// The largest of the open rims.
    pub largest_hole: Option<Hole>,
    /// Volume that the parts enclose [m3]; meaningless where edges are open.
    pub volume: f64,
}

/// Two parts that cut through each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// The parts.
    pub parts: (usize, usize),
    /// Their common volume [m3], counted on a grid to some 5 %; 0 beyond `MOST_MEASURED` pairs.
    pub volume: f64,
    /// Center of the common volume [m].
    pub center: Vec3,
}

/// Pairs of parts whose common volume is counted.
pub const MOST_MEASURED: usize = 64;

/// Why a mesh is not a body that pressure can be integrated over. Parts are numbered in the order of their first face.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LeakError {
    /// No face at all.
    #[error("the mesh has no face")]
    Empty,
    /// Holes, or edges with three or more faces.
    #[error(
        "not watertight: {open_edges} open and {non_manifold_edges} non-manifold edges in {parts} parts; the largest hole spans {:.4} m about ({:.4}, {:.4}, {:.4}) m in the axes and origin of the file; close it in the CAD file, or build with --seal (convex hull of each leaky part)",
        hole.extent, hole.center.x, hole.center.y, hole.center.z
    )]
    Open {
        /// Edges with one face.
        open_edges: usize,
        /// Edges with more than two faces.
        non_manifold_edges: usize,
        /// Connected parts.
        parts: usize,
        /// The largest hole.
        hole: Hole,
    },
    /// Neighbouring faces that disagree on what is outside.
    #[error(
        "{inverted_edges} edges join faces of opposite winding; recalculate the normals, or build with --seal"
    )]
    Inverted {
        /// Edges whose two faces run along them in the same direction.
        inverted_edges: usize,
    },
    /// A part turned inside out.
    #[error("part {part} is inside out (its faces point inward); flip its normals, or build with --seal")]
    Inward {
        /// The part.
        part: usize,
    },
    /// A skin within a skin.
    #[error(
        "double skin: part {part} lies inside another part and would take away or add volume twice; delete it, or build with --seal"
    )]
    InnerSkin {
        /// The inner part.
        part: usize,
    },
    /// A closed sheet around an open cavity.
    #[error(
        "double skin: part {part} fills {percent:.1} % of its convex hull, so it displaces its sheet metal and not its cavity; build with --seal, or set allow_thin_parts if it really is a frame that floods"
    )]
    Thin {
        /// The part.
        part: usize,
        /// Volume over the volume of the convex hull [%].
        percent: f64,
    },
    /// Two parts in the same place.
    #[error(
        "parts {} and {} share {:.3} l about ({:.4}, {:.4}, {:.4}) m in the axes and origin of the file, which would be displaced twice; {pairs} such pairs share {:.3} l in all, {:.1} % of the volume; unite them (wade vehicle import does), or set allow_overlaps to accept the excess",
        worst.parts.0, worst.parts.1, worst.volume * 1e3, worst.center.x, worst.center.y, worst.center.z,
        total_m3 * 1e3, percent
    )]
    Overlap {
        /// The pair with the largest common volume.
        worst: Overlap,
        /// Number of overlapping pairs.
        pairs: usize,
        /// Common volume of all pairs [m3].
        total_m3: f64,
        /// That over the volume of the mesh [%].
        percent: f64,
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
        if let Some(hole) = self.largest_hole.filter(|_| open_edges + non_manifold_edges > 0) {
            return Err(LeakError::Open { open_edges, non_manifold_edges, parts, hole });
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
        let worst = self.overlaps.iter().max_by(|a, b| a.volume.total_cmp(&b.volume));
        match (self.thin_parts.first(), worst) {
            (Some(&(part, share)), _) if !allow.thin_parts => {
                Err(LeakError::Thin { part, percent: share * 100.0 })
            }
            (_, Some(&worst)) if !allow.overlaps => {
                let total_m3 = self.overlap_volume();
                let percent = 100.0 * total_m3 / self.volume;
                Err(LeakError::Overlap { worst, pairs: self.overlaps.len(), total_m3, percent })
            }
            _ => Ok(()),
        }
    }

    /// Common volume of all overlapping pairs [m3].
    pub fn overlap_volume(&self) -> f64 {
        self.overlaps.iter().map(|overlap| overlap.volume).sum()
    }
}

/// True where every edge has as many faces on one side as on the other.
pub fn is_closed(mesh: &Mesh) -> bool {
    !mesh.faces.is_empty() && EdgeFaults::of(mesh).closed()
}

/// Volume over that of the convex hull; `None` for a mesh in a plane.
pub fn hull_share(mesh: &Mesh) -> Option<f64> {
    convex_hull(&mesh.vertices).map(|hull| mesh.volume().abs() / hull.volume())
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
    report.volume = parts.iter().map(|part| part.volume).sum();
    if report.open_edges + report.non_manifold_edges > 0 {
        report.largest_hole = holes(mesh).first().copied();
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
                let measured = report.overlaps.len() < MOST_MEASURED;
                let Common { volume, center } = if measured && a.edges.closed() && b.edges.closed() {
                    a.common_volume(b)
                } else {
                    Common { volume: 0.0, center: a.middle() }
                };
                report.overlaps.push(Overlap { parts: (i, j), volume, center });
            }
        }
    }
    report.inner_parts.dedup();
}
