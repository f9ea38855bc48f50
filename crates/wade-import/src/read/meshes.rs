//! Mesh files: by themselves the parts of a vehicle, or the shapes of a robot's links.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use nalgebra::Isometry3;
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::{Mesh, read_stl};
use wade_core::geometry::parts::parts as connected_faces;
use wade_core::geometry::tidy::{weld_tolerance, welded};

use super::{Kind, ReadError, bytes, collada, gltf, without_mark};
use crate::file_name;
use crate::limits::{MOST_FACES, MOST_LINKS, MOST_MESH_BYTES};
use crate::scene::{Convention, Joint, Link, Role, Scene, Shape};
use crate::solid::{encloses, that_meet};

/// A named part of a mesh file, in the frame of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Name in the file, or that of the file.
    pub name: String,
    /// Its faces.
    pub mesh: Mesh,
}

/// The parts of a file.
pub fn load(path: &Path) -> Result<Vec<Part>, ReadError> {
    let parts = match Kind::of(path)? {
        Kind::Obj => obj(path)?,
        Kind::Gltf => gltf::load(path)?,
        Kind::Collada => collada::load(path)?,
        _ => {
            let stl = |fault| ReadError::Stl { path: path.to_owned(), fault };
            let mesh = read_stl(&bytes(path, MOST_MESH_BYTES)?).map_err(stl)?;
            vec![Part { name: file_name(path), mesh }]
        }
    };
    let faces: usize = parts.iter().map(|part| part.mesh.faces.len()).sum();
    if faces > MOST_FACES {
        return Err(ReadError::Faces { path: path.to_owned(), faces });
    }
    for part in &parts {
        check(path, part)?;
    }
    Ok(parts)
}

fn check(path: &Path, part: &Part) -> Result<(), ReadError> {
    let count = part.mesh.vertices.len();
    let fault =
        |what: String| ReadError::Mesh { path: path.to_owned(), what: format!("`{}`: {what}", part.name) };
    if let Some(at) = part.mesh.vertices.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
        return Err(fault(format!("vertex {at} has a coordinate that is not a finite number")));
    }
    match part.mesh.faces.iter().position(|face| face.iter().any(|v| *v as usize >= count)) {
        Some(at) => Err(fault(format!("face {at} names a vertex beyond the {count} that there are"))),
        None => Ok(()),
    }
}

fn obj(path: &Path) -> Result<Vec<Part>, ReadError> {
    let bytes = bytes(path, MOST_MESH_BYTES)?;
    let text = without_mark(&bytes);
    let mut reader = Cursor::new(text);
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let (models, _) = tobj::load_obj_buf(&mut reader, &options, |_| Ok(Default::default()))
        .map_err(|fault| ReadError::Obj { path: path.to_owned(), line: damaged_line(text), fault })?;
    let part = |model: tobj::Model| {
        let vertices = model.mesh.positions.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
        let faces = model.mesh.indices.chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect();
        Part { name: model.name, mesh: Mesh { vertices, faces } }
    };
    Ok(models.into_iter().map(part).filter(|part| !part.mesh.faces.is_empty()).collect())
}

/// The first line, from 1, with a corner that is not three numbers or a face whose corner is none of the file.
fn damaged_line(bytes: &[u8]) -> Option<usize> {
    let text = String::from_utf8_lossy(bytes);
    let corners = text.lines().filter(|line| line.split_ascii_whitespace().next() == Some("v")).count();
    let is_corner = |word: &str| {
        let index = word.split('/').next().and_then(|index| index.parse::<i64>().ok());
        index.is_some_and(|index| index != 0 && index.unsigned_abs() <= corners as u64)
    };
    let is_damaged = |line: &str| {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => words.by_ref().take(3).filter(|word| word.parse::<f64>().is_ok()).count() < 3,
            Some("f") => !words.all(is_corner),
            _ => false,
        }
    };
    text.lines().position(is_damaged).map(|before| before + 1)
}

/// The triangles of a strip: each corner makes one with the two before it, every other one the other way round.
pub fn strip(corners: &[u32]) -> Vec<[u32; 3]> {
    let turn = |(number, of): (usize, &[u32])| match number % 2 {
        0 => [of[0], of[1], of[2]],
        _ => [of[1], of[0], of[2]],
    };
    corners.windows(3).enumerate().map(turn).collect()
}

/// The triangles of a fan about the first corner, which a polygon is as well.
pub fn fan(corners: &[u32]) -> Vec<[u32; 3]> {
    let Some((&first, rest)) = corners.split_first() else { return Vec::new() };
    rest.windows(2).map(|of| [first, of[0], of[1]]).collect()
}

/// A vehicle of meshes alone: a link for each connected part, so that wheels can be recognized by their form.
pub fn scene(files: &[PathBuf], kinds: &[Kind]) -> Result<Scene, ReadError> {
    let (mut links, mut notes) = (Vec::new(), Vec::new());
    let mut faces = 0;
    for path in files {
        for part in joined(path, load(path)?, &mut notes) {
            faces += part.mesh.faces.len();
            if faces > MOST_FACES {
                return Err(ReadError::Faces { path: path.clone(), faces });
            }
            for (number, mesh) in connected(&part.mesh).into_iter().enumerate() {
                let name =
                    if number == 0 { part.name.clone() } else { format!("{} part {number}", part.name) };
                links.push(link(name, mesh));
            }
            if links.len() > MOST_LINKS {
                return Err(ReadError::Many { path: path.clone(), what: "connected parts" });
            }
        }
    }
    let is_gltf = kinds.iter().all(|kind| *kind == Kind::Gltf);
    let is_collada = kinds.iter().all(|kind| *kind == Kind::Collada);
    let convention = match (is_gltf, is_collada) {
        (true, _) => Convention::GLTF,
        // turned and in meters by its own header
        (_, true) => Convention::ROBOT,
        _ => Convention::OPEN,
    };
    if links.is_empty() {
        return Err(ReadError::Nothing { path: files[0].clone(), what: "triangle" });
    }
    let mut warnings = Vec::new();
    if !is_gltf && kinds.contains(&Kind::Gltf) {
        warnings
            .push("glTF and other meshes are mixed: all are taken to have the same axes and unit".to_owned());
    }
    notes.push(format!("{} connected parts in {} files", links.len(), files.len()));
    Ok(Scene { links, convention, notes, warnings })
}

/// The parts of a file, those that are open as one where their edges meet: a group or a material for each face or each side of
/// a hull splits a solid into pieces of which none is closed.
fn joined(path: &Path, parts: Vec<Part>, notes: &mut Vec<String>) -> Vec<Part> {
    let meshes: Vec<&Mesh> = parts.iter().map(|part| &part.mesh).collect();
    let groups = that_meet(&meshes);
    let several: Vec<usize> = groups.iter().map(Vec::len).filter(|pieces| *pieces > 1).collect();
    if several.is_empty() {
        return parts;
    }
    notes.push(format!(
        "{}: {} groups that are open alone are joined where their edges meet; parts made of them: {}",
        file_name(path),
        several.iter().sum::<usize>(),
        several.len()
    ));
    let whole = |group: &Vec<usize>| {
        let mut whole = Part { name: parts[group[0]].name.clone(), mesh: Mesh::default() };
        group.iter().for_each(|piece| whole.mesh.append(&parts[*piece].mesh));
        whole
    };
    groups.iter().map(whole).collect()
}

/// The connected parts of a mesh, its corners joined first: the copies of a corner that a format writes for each face
/// would make every face a part. A part with a cavity stays one with its shells.
fn connected(mesh: &Mesh) -> Vec<Mesh> {
    let (mesh, _) = welded(mesh, weld_tolerance(mesh));
    let solid = |face: &[u32; 3]| face[0] != face[1] && face[1] != face[2] && face[2] != face[0];
    let mesh = Mesh { faces: mesh.faces.iter().copied().filter(solid).collect(), vertices: mesh.vertices };
    let shells: Vec<Mesh> = connected_faces(&mesh).iter().map(|faces| mesh.part(faces)).collect();
    // an inward shell is the cavity of the smallest one around it, or inside out
    let around = |index: usize| {
        let is_around = |other: &usize| *other != index && encloses(&shells[*other], &shells[index]);
        let size = |other: &usize| shells[*other].volume().abs();
        (0..shells.len()).filter(is_around).min_by(|a, b| size(a).total_cmp(&size(b)))
    };
    let mut out: Vec<Option<Mesh>> = shells.iter().cloned().map(Some).collect();
    for index in (0..shells.len()).filter(|&index| shells[index].volume() <= 0.0) {
        if let Some(outer) = around(index)
            && let Some(cavity) = out[index].take()
        {
            match &mut out[outer] {
                Some(mesh) => mesh.append(&cavity),
                none => *none = Some(cavity),
            }
        }
    }
    out.into_iter().flatten().collect()
}

fn link(name: String, mesh: Mesh) -> Link {
    let shape = Shape { role: Role::Both, source: name.clone(), mesh };
    Link {
        name,
        parent: None,
        joint: Joint::Fixed,
        pose: Isometry3::identity(),
        shapes: vec![shape],
        inertial: None,
    }
}
