//! Makes closed bodies of a mesh that has none, part by part, and says what it did.

use super::mesh::Mesh;
use super::parry::convex_hull;
use super::parts::{Part, parts};

/// What sealing did; parts are numbered in the order of their first face in the mesh before.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sealing {
    /// Parts that were sound and stayed as they were.
    pub kept: Vec<usize>,
    /// Parts replaced by their convex hull.
    pub hulled: Vec<usize>,
    /// Parts dropped because they lie inside another: inner skins, engines.
    pub inside: Vec<usize>,
    /// Parts dropped because they have no volume: decals, stray triangles.
    pub flat: Vec<usize>,
}

/// Replaces every leaky, inverted or double-skinned part by its convex hull and drops what lies inside another part.
///
/// Sound parts keep their shape. A hull fills concave places, so the volume is an upper bound: look at the result.
/// Hulls may overlap each other; `watertight::check` on the result tells.
pub fn seal(mesh: &Mesh) -> (Mesh, Sealing) {
    let mut report = Sealing::default();
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
    (sealed, report)
}

/// Parts within another; of two equal ones the later.
fn inner(closed: &[(usize, Part)]) -> Vec<usize> {
    let within =
        |(i, a): &(usize, Part), (j, b): &(usize, Part)| i != j && a.lies_in(b) && (i > j || !b.lies_in(a));
    closed.iter().filter(|a| closed.iter().any(|b| within(a, b))).map(|(i, _)| *i).collect()
}
