//! The hull that a mesh really has, read from its boundary, and the load on it at rest.
//!
//! A staircase of cells displaces another volume than the hull it stands for, and feels no pressure where a tire
//! stands on the bed. Taking the mesh's own load at rest from the forces leaves the dynamic part.

use std::path::{Path, PathBuf};

use super::case::AIR_DENSITY;
use super::placement::Placement;
use wade_core::condition::Condition;
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::geometry::hydrostatics::surface_hydrostatics;
use wade_core::geometry::mesh::Mesh;
use wade_core::geometry::surfaces::Hull;
use wade_core::vehicle::Vehicle;
use wade_core::wrench::Wrench;

/// Why a mesh could not be read.
#[derive(Debug, thiserror::Error)]
pub enum PolyMeshError {
    /// A file that cannot be read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file that does not parse.
    #[error("{path}: expected {expected}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// What should have stood there.
        expected: &'static str,
    },
    /// A surface without a patch.
    #[error("the mesh has no face on surface `{surface}`: the cells are too coarse for it")]
    NoFaces {
        /// The surface.
        surface: String,
    },
}

/// The hull of the mesh, body frame; faces outward.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshHull {
    /// Its faces with the surface of each.
    pub hull: Hull,
    /// Cells of the mesh.
    pub cells: usize,
}

impl MeshHull {
    /// Reads `constant/polyMesh` of a case folder; ASCII.
    pub fn read(folder: &Path, vehicle: &Vehicle, placement: &Placement) -> Result<Self, PolyMeshError> {
        let folder = folder.join("constant/polyMesh");
        let boundary = read(&folder.join("boundary"))?;
        let points_path = folder.join("points");
        let points = vectors(&read(&points_path)?)
            .ok_or(PolyMeshError::Syntax { path: points_path, expected: "a list of points" })?;
        let faces_path = folder.join("faces");
        let faces_text = read(&faces_path)?;
        let bad_faces = || PolyMeshError::Syntax { path: faces_path.clone(), expected: "a list of faces" };
        let faces = lists(&faces_text).ok_or_else(bad_faces)?;
        let back = placement.cfd_from_body.inverse();
        let mut hull = Hull {
            mesh: Mesh {
                vertices: points.iter().map(|p| back * (p - placement.origin)).collect(),
                faces: Vec::new(),
            },
            face_surface: Vec::new(),
        };
        for (index, surface) in vehicle.surfaces.iter().enumerate() {
            let missing = || PolyMeshError::NoFaces { surface: surface.name.clone() };
            let (start, count) = patch(&boundary, &format!("hull_{}", surface.name)).ok_or_else(missing)?;
            if count == 0 {
                return Err(missing());
            }
            for face in faces.get(start..start + count).ok_or_else(bad_faces)? {
                // faces of the boundary point out of the fluid, into the hull: turned round they point outward
                for pair in face.windows(2).skip(1) {
                    hull.mesh.faces.push([face[0], pair[1], pair[0]]);
                    hull.face_surface.push(index as u16);
                }
            }
        }
        let count = hull.mesh.vertices.len() as u32;
        if hull.mesh.faces.iter().flatten().any(|v| *v >= count) {
            return Err(bad_faces());
        }
        Ok(Self { hull, cells: cell_count(&read(&folder.join("owner"))?) })
    }

    /// Load on each surface at rest about the body origin [N, N m], body frame: water and the air above it.
    pub fn at_rest(&self, vehicle: &Vehicle, condition: &Condition) -> Vec<Wrench> {
        let plane = condition.water_plane(vehicle.z0);
        let about = Vec3::zeros();
        let density = condition.density - AIR_DENSITY;
        let mut loads = surface_hydrostatics(&self.hull, vehicle.surfaces.len(), &plane, density, &about);
        for (face, &surface) in self.hull.face_surface.iter().enumerate() {
            let centroid = self.hull.mesh.face_centroid(face);
            let pressure = AIR_DENSITY * GRAVITY * plane.depth_below(&centroid);
            let force = self.hull.mesh.area_vector(face) * -pressure;
            loads[surface as usize] += Wrench::from_force_at(force, &centroid, &about);
        }
        loads
    }
}

fn read(path: &Path) -> Result<String, PolyMeshError> {
    std::fs::read_to_string(path).map_err(|source| PolyMeshError::Io { path: path.to_owned(), source })
}

/// The entries of a list `count ( ... )` after the header.
fn body(text: &str) -> Option<&str> {
    let after_header = &text[text.find("FoamFile")?..];
    let after_header = &after_header[after_header.find('}')? + 1..];
    let open = after_header.find('(')?;
    let close = after_header.rfind(')')?;
    after_header.get(open + 1..close)
}

fn vectors(text: &str) -> Option<Vec<Vec3>> {
    let one = |line: &str| {
        let mut numbers = line.trim().strip_prefix('(')?.strip_suffix(')')?.split_ascii_whitespace();
        let mut next = || numbers.next()?.parse().ok();
        Some(Vec3::new(next()?, next()?, next()?))
    };
    body(text)?.lines().filter(|line| !line.trim().is_empty()).map(one).collect()
}

/// Faces as `4(0 1 2 3)`, one a line; a face of many corners may run over several lines.
fn lists(text: &str) -> Option<Vec<Vec<u32>>> {
    let mut faces = Vec::new();
    let mut rest = body(text)?;
    while let Some(open) = rest.find('(') {
        let close = open + rest[open..].find(')')?;
        let corners = rest[open + 1..close].split_ascii_whitespace().map(|v| v.parse().ok());
        faces.push(corners.collect::<Option<Vec<u32>>>()?);
        rest = &rest[close + 1..];
    }
    Some(faces)
}

/// First face and number of faces of a patch.
fn patch(boundary: &str, name: &str) -> Option<(usize, usize)> {
    let mut words = boundary.split_ascii_whitespace().skip_while(|word| *word != name);
    let entry: Vec<&str> = words.by_ref().take_while(|word| *word != "}").collect();
    let value = |key: &str| {
        let at = entry.iter().position(|word| *word == key)?;
        entry.get(at + 1)?.trim_end_matches(';').parse().ok()
    };
    Some((value("startFace")?, value("nFaces")?))
}

/// `nCells:55670` in the note of the file `owner`.
fn cell_count(owner: &str) -> usize {
    let digits = owner.split("nCells:").nth(1).unwrap_or_default().trim_start();
    digits.chars().take_while(char::is_ascii_digit).collect::<String>().parse().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn reads_lists_as_openfoam_writes_them() {
        let faces = "FoamFile\n{\n version 2.0;\n}\n// * //\n\n2\n(\n4(0 1 2 3)\n5\n(\n0\n1\n5\n4\n6\n)\n)\n";
        assert_eq!(lists(faces).unwrap(), [vec![0, 1, 2, 3], vec![0, 1, 5, 4, 6]]);
        let points = "FoamFile\n{\n}\n2\n(\n(0 1 2)\n(-1e-3 0 0.5)\n)\n";
        assert_eq!(vectors(points).unwrap()[1], Vec3::new(-1e-3, 0.0, 0.5));
        let boundary = "2 ( ground { type wall; nFaces 7; startFace 100; } hull_a { type wall; nFaces 3; startFace 107; } )";
        assert_eq!(patch(boundary, "hull_a"), Some((107, 3)));
        assert_eq!(patch(boundary, "hull_b"), None);
    }
}
