//! Which face belongs to which surface.

use super::build::BuildError;
use super::spec::{Rule, VehicleSpec};
use crate::frame::Vec3;
use crate::geometry::mesh::Mesh;
use crate::geometry::parts::parts;

/// The surface of every face by the rules of the vehicle file.
pub(super) fn assign(spec: &VehicleSpec, mesh: &Mesh) -> Result<Vec<u16>, BuildError> {
    let targets = spec.rule.iter().map(|r| index_of(spec, &r.patch)).collect::<Result<Vec<_>, _>>()?;
    let part_of = part_of_faces(mesh);
    let mut stray = Vec::new();
    let mut face_surface = Vec::with_capacity(mesh.faces.len());
    for (face, &part) in part_of.iter().enumerate() {
        match spec.rule.iter().position(|r| holds(r, mesh, face, part)) {
            Some(rule) => face_surface.push(targets[rule] as u16),
            None => stray.push(face),
        }
    }
    if let Some(&first) = stray.first() {
        let [x_m, y_m, z_m] = mesh.face_centroid(first).into();
        return Err(BuildError::NoPatch { faces: stray.len(), x_m, y_m, z_m });
    }
    match (0..spec.patch.len()).find(|p| !face_surface.contains(&(*p as u16))) {
        Some(empty) => Err(BuildError::EmptyPatch { name: spec.patch[empty].name.clone() }),
        None => Ok(face_surface),
    }
}

/// Index of the patch of that name.
pub(super) fn index_of(spec: &VehicleSpec, name: &str) -> Result<usize, BuildError> {
    let index = spec.patch.iter().position(|p| p.name == name);
    index.ok_or_else(|| BuildError::UnknownPatch { name: name.to_owned() })
}

fn part_of_faces(mesh: &Mesh) -> Vec<usize> {
    let mut part_of = vec![0; mesh.faces.len()];
    for (part, faces) in parts(mesh).iter().enumerate() {
        faces.iter().for_each(|f| part_of[*f] = part);
    }
    part_of
}

fn holds(rule: &Rule, mesh: &Mesh, face: usize, part: usize) -> bool {
    let centroid = mesh.face_centroid(face);
    let above = |min: [f64; 3]| (0..3).all(|i| centroid[i] >= min[i]);
    let below = |max: [f64; 3]| (0..3).all(|i| centroid[i] <= max[i]);
    let facing = |direction: [f64; 3]| {
        mesh.area_vector(face).angle(&Vec3::from(direction)).to_degrees() <= rule.within_deg.unwrap_or(45.0)
    };
    (rule.parts.is_empty() || rule.parts.contains(&part))
        && rule.min_m.is_none_or(above)
        && rule.max_m.is_none_or(below)
        && rule.facing.is_none_or(facing)
}
