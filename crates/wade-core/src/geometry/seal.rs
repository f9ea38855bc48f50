//! Makes closed bodies of a mesh that has none, part by part, and says what it did.

use std::fmt;

use super::mesh::Mesh;
use super::parry::convex_hull;
use super::parts::{Part, parts};

/// What sealing did; parts are numbered in the order of their first face in the mesh before.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sealing {
    /// Parts that were sound and stayed as they were.
    pub kept: Vec<usize>,
    /// Parts replaced by their convex hull.
    pub hulled: Vec<usize>,
    /// Parts dropped because they lie inside another: inner skins, engines.
    pub inside: Vec<usize>,
    /// Parts dropped because they have no volume: decals, stray triangles.
    pub flat: Vec<usize>,
    /// Volume that the faces enclosed before [m3]; of a part with holes that is a guess.
    pub volume_before: f64,
    /// Volume after [m3].
    pub volume_after: f64,
}

impl fmt::Display for Sealing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kept, hulled, inside, flat, .. } = self;
        let list = |parts: &[usize]| parts.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
        let mut said = Vec::new();
        for (parts, what) in [
            (hulled, "replaced by their convex hulls"),
            (inside, "dropped, since they lie inside another part"),
            (flat, "dropped, since they have no volume"),
            (kept, "kept as they are"),
        ] {
            if !parts.is_empty() {
                said.push(format!("parts {}: {what}", list(parts)));
            }
        }
        // inside out it is negative
        let volumes = (self.volume_before.abs() * 1e3, self.volume_after * 1e3);
        write!(f, "{}; volume {:.3} l before, {:.3} l after", said.join("; "), volumes.0, volumes.1)
    }
}

/// Replaces every leaky, inverted or double-skinned part by its convex hull and drops what lies inside another part.
///
/// Sound parts keep their shape. A hull fills concave places, so the volume is an upper bound: look at the result.
/// Hulls may overlap each other; `watertight::check` on the result tells.
pub fn seal(mesh: &Mesh) -> (Mesh, Sealing) {
    let mut report = Sealing { volume_before: mesh.volume(), ..Sealing::default() };
    let mut closed = Vec::new();
    for (index, faces) in parts(mesh).iter().enumerate() {
        let part = Part::new(mesh.part(faces));
        if part.is_sound() {
            report.kept.push(index);
            closed.push((index, part));
        } else if let Some(hull) = convex_hull(&part.mesh.vertices) {
            report.hulled.push(index);
            closed.push((index, Part::new(hull)));
        } else {
            report.flat.push(index);
        }
    }
    report.inside = inner(&closed);
    report.kept.retain(|i| !report.inside.contains(i));
    report.hulled.retain(|i| !report.inside.contains(i));
    let mut sealed = Mesh::default();
    closed.iter().filter(|(i, _)| !report.inside.contains(i)).for_each(|(_, part)| sealed.append(&part.mesh));
    report.volume_after = sealed.volume();
    (sealed, report)
}

/// Parts within another; of two equal ones the later.
fn inner(closed: &[(usize, Part)]) -> Vec<usize> {
    let within =
        |(i, a): &(usize, Part), (j, b): &(usize, Part)| i != j && a.lies_in(b) && (i > j || !b.lies_in(a));
    closed.iter().filter(|a| closed.iter().any(|b| within(a, b))).map(|(i, _)| *i).collect()
}
