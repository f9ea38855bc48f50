//! Files in, a `Scene` out. Nothing in a file is trusted: sizes, depths and counts are bounded before they are used.

mod builder;
mod collada;
mod gltf;
mod locate;
mod meshes;
mod mjcf;
mod sdformat;
mod urdf;
mod xml;

use std::io::Read;
use std::path::{Path, PathBuf};

use wade_core::geometry::mesh::StlError;

use crate::limits::{MOST_DEPTH, MOST_DESCRIPTION_BYTES, MOST_FACES, MOST_LINKS, MOST_NODES};
use crate::scene::Scene;

/// Why files were refused.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // the message says what each field is
pub enum ReadError {
    /// A file that cannot be read.
    #[error("{}: {fault}", .path.display())]
    Io { path: PathBuf, fault: std::io::Error },
    /// A folder or a device.
    #[error("{}: not a regular file", .path.display())]
    NoFile { path: PathBuf },
    /// A file that is too large.
    #[error("{}: {bytes} bytes, at most {most} are read", .path.display())]
    Large { path: PathBuf, bytes: u64, most: u64 },
    /// A format that is not read.
    #[error("{}: {}; URDF, SDF, MJCF (.xml), STL, OBJ, glTF, GLB and COLLADA (.dae) are read", .path.display(), .hint)]
    Format { path: PathBuf, hint: &'static str },
    /// XML that is damaged, or has a DTD.
    #[error("{}: {fault}{}", .path.display(), xml_hint(.fault))]
    Xml { path: PathBuf, fault: roxmltree::Error },
    /// XML that is nested too deep.
    #[error("{}, line {line}: elements are nested more than {MOST_DEPTH} deep", .path.display())]
    Deep { path: PathBuf, line: u32 },
    /// An attribute or text that is no value.
    #[error("{}, line {line}: <{element}> {name} is `{text}`, which is not {expected}", .path.display())]
    Value { path: PathBuf, line: u32, element: String, name: String, text: String, expected: &'static str },
    /// Something that an element must have.
    #[error("{}, line {line}: <{element}> {what}", .path.display())]
    Element { path: PathBuf, line: u32, element: String, what: String },
    /// Links whose joints close a ring, or that are the child of two.
    #[error("{}: joints form a loop, or a link has two parents: {}; a vehicle is a tree of links, so remove one joint", .path.display(), .links.join(", "))]
    Loop { path: PathBuf, links: Vec<String> },
    /// Links that no joint connects.
    #[error("{}: no joint connects the links {}; a vehicle has one root link, so join the others to it by fixed joints", .path.display(), .links.join(", "))]
    Roots { path: PathBuf, links: Vec<String> },
    /// No robot in a file.
    #[error("{}: no {what} in it", .path.display())]
    Nothing { path: PathBuf, what: &'static str },
    /// Too many links or shapes.
    #[error("{}: more than {MOST_LINKS} {what}", .path.display())]
    Many { path: PathBuf, what: &'static str },
    /// Too many triangles.
    #[error("{}: {faces} triangles with the meshes before it, at most {MOST_FACES} are imported; simplify the mesh, or use the simpler shapes of the links: --shapes collision", .path.display())]
    Faces { path: PathBuf, faces: usize },
    /// A mesh file that is nowhere.
    #[error("{}, line {line}: link `{link}` wants the mesh `{reference}`, which is in none of these places: {}; name the mesh file on the command line after the description", .path.display(), list(.tried))]
    MeshMissing { path: PathBuf, line: u32, link: String, reference: String, tried: Vec<PathBuf> },
    /// A damaged STL.
    #[error("{}: {fault}", .path.display())]
    Stl { path: PathBuf, fault: StlError },
    /// A damaged OBJ.
    #[error("{}{}: {fault}", .path.display(), line.map_or_else(String::new, |line| format!(", line {line}")))]
    Obj { path: PathBuf, line: Option<usize>, fault: tobj::LoadError },
    /// A damaged glTF.
    #[error("{}: {fault}", .path.display())]
    Gltf { path: PathBuf, fault: ::gltf::Error },
    /// A glTF whose parts do not fit together.
    #[error("{}: {what}", .path.display())]
    GltfContent { path: PathBuf, what: String },
    /// Coordinates or indices that are none.
    #[error("{}: {what}", .path.display())]
    Mesh { path: PathBuf, what: String },
    /// Two descriptions.
    #[error("{} and {} both describe a robot: import one vehicle at a time", .first.display(), .second.display())]
    TwoRobots { first: PathBuf, second: PathBuf },
    /// No file named.
    #[error("no file to import is named")]
    NoFiles,
}

fn xml_hint(fault: &roxmltree::Error) -> String {
    match fault {
        roxmltree::Error::DtdDetected => {
            "; entities are not expanded: write their text in place, as xmllint --noent --dropdtd does"
                .to_owned()
        }
        roxmltree::Error::NodesLimitReached => format!("; at most {MOST_NODES} elements are read"),
        _ => String::new(),
    }
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// What a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Urdf,
    Sdf,
    Mjcf,
    Stl,
    Obj,
    Gltf,
    Collada,
}

impl Kind {
    fn is_robot(self) -> bool {
        matches!(self, Self::Urdf | Self::Sdf | Self::Mjcf)
    }

    fn of(path: &Path) -> Result<Self, ReadError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let format = |hint| ReadError::Format { path: path.to_owned(), hint };
        match extension.as_str() {
            "stl" => Ok(Self::Stl),
            "obj" => Ok(Self::Obj),
            "gltf" | "glb" => Ok(Self::Gltf),
            "xacro" => Err(format("a xacro macro file: expand it with `xacro FILE > robot.urdf`")),
            "dae" => Ok(Self::Collada),
            "step" | "stp" | "iges" | "igs" => Err(format("a CAD file: export it as STL")),
            "urdf" | "sdf" | "world" | "xml" | "mjcf" => {
                let text = text(path)?;
                let document = xml::parse(path, &text)?;
                match document.root_element().tag_name().name() {
                    "robot" => Ok(Self::Urdf),
                    "sdf" => Ok(Self::Sdf),
                    "mujoco" => Ok(Self::Mjcf),
                    _ => Err(format("its outermost element is neither <robot>, <sdf> nor <mujoco>")),
                }
            }
            _ => Err(format("unknown extension")),
        }
    }
}

/// Which shapes are read: the others' meshes may be large or missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// Shapes to be looked at.
    pub visual: bool,
    /// Shapes to collide.
    pub collision: bool,
}

/// Reads a description and its meshes, or meshes alone.
pub fn read(files: &[PathBuf], wanted: Wanted) -> Result<Scene, ReadError> {
    let kinds = files.iter().map(|file| Kind::of(file)).collect::<Result<Vec<_>, _>>()?;
    let robots: Vec<usize> = (0..files.len()).filter(|index| kinds[*index].is_robot()).collect();
    match robots[..] {
        [] if files.is_empty() => Err(ReadError::NoFiles),
        [] => meshes::scene(files, &kinds),
        [one] => {
            let beside: Vec<PathBuf> =
                (0..files.len()).filter(|index| *index != one).map(|index| files[index].clone()).collect();
            let reader = match kinds[one] {
                Kind::Sdf => sdformat::read,
                Kind::Mjcf => mjcf::read,
                _ => urdf::read,
            };
            reader(&files[one], beside, wanted)
        }
        [first, second, ..] => {
            Err(ReadError::TwoRobots { first: files[first].clone(), second: files[second].clone() })
        }
    }
}

/// The bytes of a regular file of at most so many.
fn bytes(path: &Path, most: u64) -> Result<Vec<u8>, ReadError> {
    let io = |fault| ReadError::Io { path: path.to_owned(), fault };
    let file = std::fs::File::open(path).map_err(io)?;
    let metadata = file.metadata().map_err(io)?;
    if !metadata.is_file() {
        return Err(ReadError::NoFile { path: path.to_owned() });
    }
    if metadata.len() > most {
        return Err(ReadError::Large { path: path.to_owned(), bytes: metadata.len(), most });
    }
    let mut bytes = Vec::new();
    // a file may grow while it is read
    file.take(most).read_to_end(&mut bytes).map_err(io)?;
    Ok(bytes)
}

/// The text of a description in UTF-8, or in UTF-16 where it begins with the mark of its byte order.
fn text(path: &Path) -> Result<String, ReadError> {
    let bytes = bytes(path, MOST_DESCRIPTION_BYTES)?;
    let wide = |unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes.chunks_exact(2).skip(1).map(|pair| unit([pair[0], pair[1]])).collect();
        String::from_utf16_lossy(&units)
    };
    Ok(match bytes[..] {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes),
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes),
        _ => String::from_utf8_lossy(without_mark(&bytes)).into_owned(),
    })
}

/// Bytes of UTF-8 without the mark that some programs begin a text with.
fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}
