//! Meshes and files for the tests.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use nalgebra::Isometry3;
use tempfile::TempDir;
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::{Bounds, Mesh, write_stl};
use wade_core::geometry::parametric::cuboid;
use wade_import::{ImportError, Imported, Options};

/// A folder with files.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, bytes).unwrap();
        path
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

/// Imports with a name.
pub fn import(files: &[PathBuf], options: Options) -> Result<Imported, ImportError> {
    wade_import::import(files, &Options { name: "robot".to_owned(), ..options })
}

/// A URDF of this body.
pub fn urdf(body: &str) -> String {
    format!("<?xml version=\"1.0\"?>\n<robot name=\"r\">\n{body}\n</robot>\n")
}

/// A link with one visual shape.
pub fn link(name: &str, origin: &str, geometry: &str) -> String {
    format!(
        "<link name=\"{name}\"><visual><origin {origin}/><geometry>{geometry}</geometry></visual></link>\n"
    )
}

/// A joint of this type.
pub fn joint(kind: &str, parent: &str, child: &str, inside: &str) -> String {
    format!(
        "<joint name=\"{child}_joint\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>{inside}</joint>\n"
    )
}

/// A box by half edges.
pub fn block(half: [f64; 3]) -> Mesh {
    let half = Vec3::from(half);
    cuboid(&Bounds { min: -half, max: half })
}

/// A ring about z: inner and outer radius and half length.
pub fn ring(inner: f64, outer: f64, half: f64, facets: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..facets {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(facets)).sin_cos();
        for (radius, z) in [(inner, -half), (outer, -half), (outer, half), (inner, half)] {
            mesh.vertices.push(Vec3::new(radius * cos, radius * sin, z));
        }
    }
    for i in 0..facets {
        let (a, b) = (4 * i, 4 * ((i + 1) % facets));
        for (p, q) in [(0, 1), (1, 2), (2, 3), (3, 0)] {
            mesh.faces.extend([[a + p, b + p, b + q], [a + p, b + q, a + q]]);
        }
    }
    if mesh.volume() < 0.0 {
        mesh.faces.iter_mut().for_each(|face| face.swap(1, 2));
    }
    mesh
}

/// A box with a pocket from above, by half edges and the thickness of walls and floor.
pub fn tub(half: [f64; 3], wall: f64) -> Mesh {
    let [x, y, z] = half;
    let rim = |x: f64, y: f64, z: f64| [(-x, -y), (x, -y), (x, y), (-x, y)].map(|(x, y)| Vec3::new(x, y, z));
    let (low, high) = (rim(x, y, -z), rim(x, y, z));
    let (edge, floor) = (rim(x - wall, y - wall, z), rim(x - wall, y - wall, -z + wall));
    let mut mesh = Mesh { vertices: [low, high, edge, floor].concat(), faces: Vec::new() };
    let mut quad = |a: u32, b: u32, c: u32, d: u32| mesh.faces.extend([[a, b, c], [a, c, d]]);
    quad(3, 2, 1, 0);
    quad(12, 13, 14, 15);
    for i in 0..4 {
        let j = (i + 1) % 4;
        quad(i, j, j + 4, i + 4);
        quad(i + 4, j + 4, j + 8, i + 8);
        quad(i + 8, j + 8, j + 12, i + 12);
    }
    mesh
}

/// A mesh somewhere else, in another unit.
pub fn placed(mesh: &Mesh, pose: &Isometry3<f64>, scale: f64) -> Mesh {
    let place = |v: &Vec3| (pose * nalgebra::Point3::from(*v)).coords * scale;
    Mesh { vertices: mesh.vertices.iter().map(place).collect(), faces: mesh.faces.clone() }
}

pub fn stl(mesh: &Mesh) -> Vec<u8> {
    write_stl(mesh)
}

/// Objects with quadrilaterals where two faces in turn make one.
pub fn obj(parts: &[(&str, Mesh)]) -> String {
    let (mut text, mut first) = (String::new(), 1);
    for (name, mesh) in parts {
        writeln!(text, "o {name}").unwrap();
        mesh.vertices.iter().for_each(|v| writeln!(text, "v {} {} {}", v.x, v.y, v.z).unwrap());
        mesh.faces.iter().for_each(|f| {
            writeln!(text, "f {} {} {}", f[0] + first, f[1] + first, f[2] + first).unwrap();
        });
        first += mesh.vertices.len() as u32;
    }
    text
}

/// A glTF with its data inside: a node a part, each with more of its own JSON.
pub fn gltf(parts: &[(&str, Mesh, &str)]) -> String {
    use base64::Engine as _;
    let (mut data, mut views, mut accessors, mut meshes, mut nodes) =
        (Vec::new(), vec![], vec![], vec![], vec![]);
    for (index, (name, mesh, more)) in parts.iter().enumerate() {
        let start = data.len();
        mesh.vertices.iter().flatten().for_each(|c| data.extend((*c as f32).to_le_bytes()));
        let middle = data.len();
        mesh.faces.iter().flatten().for_each(|v| data.extend(v.to_le_bytes()));
        views.push(format!("{{\"buffer\":0,\"byteOffset\":{start},\"byteLength\":{}}}", middle - start));
        views
            .push(format!("{{\"buffer\":0,\"byteOffset\":{middle},\"byteLength\":{}}}", data.len() - middle));
        let bounds = mesh.bounds().unwrap();
        let list = |v: Vec3| format!("[{},{},{}]", v.x as f32, v.y as f32, v.z as f32);
        accessors.push(format!(
            "{{\"bufferView\":{},\"componentType\":5126,\"count\":{},\"type\":\"VEC3\",\"min\":{},\"max\":{}}}",
            2 * index,
            mesh.vertices.len(),
            list(bounds.min),
            list(bounds.max)
        ));
        accessors.push(format!(
            "{{\"bufferView\":{},\"componentType\":5125,\"count\":{},\"type\":\"SCALAR\"}}",
            2 * index + 1,
            3 * mesh.faces.len()
        ));
        meshes.push(format!(
            "{{\"primitives\":[{{\"attributes\":{{\"POSITION\":{}}},\"indices\":{}}}]}}",
            2 * index,
            2 * index + 1
        ));
        nodes.push(format!("{{\"name\":\"{name}\",\"mesh\":{index}{more}}}"));
    }
    let encoded = base64::engine::general_purpose::STANDARD.encode(&data);
    let roots: Vec<String> = (0..parts.len()).map(|i| i.to_string()).collect();
    format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[{}]}}],\"nodes\":[{}],\"meshes\":[{}],\
         \"accessors\":[{}],\"bufferViews\":[{}],\"buffers\":[{{\"byteLength\":{},\"uri\":\"data:application/octet-stream;base64,{encoded}\"}}]}}",
        roots.join(","),
        nodes.join(","),
        meshes.join(","),
        accessors.join(","),
        views.join(","),
        data.len()
    )
}
