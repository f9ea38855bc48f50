//! glTF 2.0 and GLB: the triangles of the scene's nodes, each under the transforms above it.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use gltf::buffer::Source;
use gltf::mesh::Mode;
use gltf::{Document, Gltf, Node};
use nalgebra::{Matrix3, Matrix4, Vector3};
use wade_core::caught::caught;
use wade_core::geometry::mesh::Mesh;

use super::locate::decoded;
use super::meshes::{Part, fan, strip};
use super::{ReadError, bytes};
use crate::limits::{MOST_DEPTH, MOST_FACES, MOST_LINKS, MOST_MESH_BYTES};

/// The parts of a file, a node each.
pub fn load(path: &Path) -> Result<Vec<Part>, ReadError> {
    // the library looks up what a file names without asking whether it is there
    let what = "damaged: it refers to data that are not there; export the file again".to_owned();
    caught(|| decode(path)).unwrap_or_else(|_| Err(ReadError::GltfContent { path: path.to_owned(), what }))
}

fn decode(path: &Path) -> Result<Vec<Part>, ReadError> {
    let damaged = |fault| ReadError::Gltf { path: path.to_owned(), fault };
    let content = |what: String| ReadError::GltfContent { path: path.to_owned(), what };
    let Gltf { document, blob } =
        Gltf::from_slice_without_validation(&bytes(path, MOST_MESH_BYTES)?).map_err(damaged)?;
    let mut json = document.into_json();
    // the library refuses every extension that it does not know, also those of how a surface looks
    let required = std::mem::take(&mut json.extensions_required);
    if let Some(name) = required.iter().find(|name| !is_of_looks(name)) {
        return Err(content(format!(
            "requires the extension {name}, which is not read: export it without compression, quantization and instances"
        )));
    }
    let document = Document::from_json(json).map_err(damaged)?;
    let buffers = buffers(path, &document, blob)?;
    check_views(&document, &buffers).map_err(content)?;
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let roots: Vec<Node<'_>> = match &scene {
        Some(scene) => scene.nodes().collect(),
        None => document.nodes().collect(),
    };
    let mut open: Vec<(Node<'_>, Matrix4<f64>, usize)> =
        roots.into_iter().map(|node| (node, Matrix4::identity(), 0)).collect();
    open.reverse();
    let (mut parts, mut seen, mut faces) = (Vec::new(), 0, 0);
    while let Some((node, above, depth)) = open.pop() {
        seen += 1;
        if seen > MOST_LINKS || depth > MOST_DEPTH {
            return Err(content(format!(
                "more than {MOST_LINKS} nodes, or nodes nested more than {MOST_DEPTH} deep: is a node its own child?"
            )));
        }
        let own = Matrix4::from_fn(|row, column| f64::from(node.transform().matrix()[column][row]));
        let transform = above * own;
        if let Some(mesh) = node.mesh() {
            let name =
                node.name().or(mesh.name()).map_or_else(|| format!("node {}", node.index()), str::to_owned);
            let mut whole = Mesh::default();
            for primitive in mesh.primitives().filter(|primitive| has_faces(primitive.mode())) {
                let count = primitive
                    .indices()
                    .or(primitive.get(&gltf::Semantic::Positions))
                    .map_or(0, |a| a.count());
                faces += match primitive.mode() {
                    Mode::Triangles => count / 3,
                    _ => count.saturating_sub(2),
                };
                if faces > MOST_FACES {
                    return Err(ReadError::Faces { path: path.to_owned(), faces });
                }
                whole.append(&triangles(&primitive, &buffers, &transform));
            }
            if !whole.faces.is_empty() {
                parts.push(Part { name, mesh: whole });
            }
        }
        open.extend(node.children().map(|child| (child, transform, depth + 1)));
    }
    Ok(parts)
}

/// True of an extension of materials, textures and lights, which change no shape.
fn is_of_looks(extension: &str) -> bool {
    ["_materials_", "_texture_", "_lights_"].iter().any(|word| extension.contains(word))
}

/// Points and lines have none.
fn has_faces(mode: Mode) -> bool {
    matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)
}

fn triangles(primitive: &gltf::Primitive<'_>, buffers: &[Vec<u8>], transform: &Matrix4<f64>) -> Mesh {
    let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
    let linear: Matrix3<f64> = transform.fixed_view::<3, 3>(0, 0).into_owned();
    let shift: Vector3<f64> = transform.fixed_view::<3, 1>(0, 3).into_owned();
    let vertices: Vec<Vector3<f64>> = reader
        .read_positions()
        .into_iter()
        .flatten()
        .map(|p| linear * Vector3::from(p.map(f64::from)) + shift)
        .collect();
    let indices: Vec<u32> = match reader.read_indices() {
        Some(indices) => indices.into_u32().collect(),
        None => (0..vertices.len() as u32).collect(),
    };
    let mut faces: Vec<[u32; 3]> = match primitive.mode() {
        Mode::TriangleStrip => strip(&indices),
        Mode::TriangleFan => fan(&indices),
        _ => indices.chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect(),
    };
    if linear.determinant() < 0.0 {
        faces.iter_mut().for_each(|face| face.swap(1, 2));
    }
    Mesh { vertices, faces }
}

/// The bytes of every buffer: in the file, in a data URI, or in a file beside it.
fn buffers(path: &Path, document: &Document, blob: Option<Vec<u8>>) -> Result<Vec<Vec<u8>>, ReadError> {
    let content = |what: String| ReadError::GltfContent { path: path.to_owned(), what };
    let mut blob = blob;
    let mut all = Vec::new();
    for buffer in document.buffers() {
        let data = match buffer.source() {
            Source::Bin => blob.take().ok_or_else(|| content("it has no binary part".to_owned()))?,
            Source::Uri(uri) => match uri.strip_prefix("data:") {
                Some(data) => {
                    let encoded = data.split_once(";base64,").map(|(_, encoded)| encoded);
                    let decoded = encoded.and_then(|encoded| STANDARD.decode(encoded).ok());
                    decoded.ok_or_else(|| content(format!("buffer {} is no base64 data", buffer.index())))?
                }
                None => {
                    let beside = [path.with_file_name(uri), path.with_file_name(decoded(uri))];
                    let [literal, address] = &beside;
                    bytes(if literal.is_file() { literal } else { address }, MOST_MESH_BYTES)?
                }
            },
        };
        if data.len() < buffer.length() {
            return Err(content(format!(
                "buffer {} has {} bytes and {} are declared: truncated",
                buffer.index(),
                data.len(),
                buffer.length()
            )));
        }
        all.push(data);
    }
    Ok(all)
}

/// Every view lies in its buffer, and every accessor in its view.
fn check_views(document: &Document, buffers: &[Vec<u8>]) -> Result<(), String> {
    for view in document.views() {
        let end = view.offset().checked_add(view.length());
        let length = buffers.get(view.buffer().index()).map_or(0, Vec::len);
        if end.is_none_or(|end| end > length) {
            return Err(format!("buffer view {} reaches beyond its buffer", view.index()));
        }
    }
    for accessor in document.accessors() {
        let Some(view) = accessor.view() else { continue };
        let stride = view.stride().unwrap_or(accessor.size());
        let last = accessor.count().saturating_sub(1).checked_mul(stride);
        let end = last.and_then(|last| last.checked_add(accessor.size())?.checked_add(accessor.offset()));
        if end.is_none_or(|end| end > view.length()) {
            return Err(format!("accessor {} reaches beyond its buffer view", accessor.index()));
        }
    }
    Ok(())
}
