//! STL files, binary and ASCII. The bytes are not trusted: every length is checked before it is used.

use std::collections::HashMap;

use super::mesh::Mesh;
use crate::frame::Vec3;

/// Most faces that a file may hold; more than ten times a detailed vehicle.
pub const MAX_FACES: usize = 2_000_000;

const HEADER: usize = 84;
const RECORD: usize = 50;

const SOLID: &[u8] = b"solid";

/// What some Windows programs begin a text with.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Why an STL file was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StlError {
    /// Neither a binary header nor an ASCII `solid`.
    #[error(
        "{bytes} bytes are too few for an STL file: a binary one starts with 84 bytes, an ASCII one with `solid`"
    )]
    TooShort {
        /// Length of the input.
        bytes: usize,
    },
    /// The face count of a binary header does not match the length of the file.
    #[error("the header declares {declared} faces, the {bytes} bytes hold {held}: truncated or damaged")]
    FaceCount {
        /// Count in the header.
        declared: usize,
        /// Whole face records after the header.
        held: usize,
        /// Length of the input.
        bytes: usize,
    },
    /// More faces than `MAX_FACES`.
    #[error("{faces} faces, at most {MAX_FACES} are read: simplify the mesh")]
    TooManyFaces {
        /// Faces in the file.
        faces: usize,
    },
    /// A file without a face.
    #[error("the file holds no face")]
    Empty,
    /// A NaN or infinite coordinate.
    #[error("face {face} has a coordinate that is not a finite number")]
    NotFinite {
        /// Index of the face in the file.
        face: usize,
    },
    /// An ASCII file that breaks the grammar.
    #[error("ASCII STL, line {line}: expected {expected}")]
    Grammar {
        /// Line number from 1.
        line: usize,
        /// What should have stood there.
        expected: &'static str,
    },
}

/// Reads a binary or ASCII STL in the file's own frame and unit; corners that are equal in f32 become one vertex.
///
/// Stored normals are ignored: the winding decides. Faces without area are kept, since a mesh may need them to be closed;
/// `tidy` drops those that it does not need. A binary file may begin with `solid`, as its length tells what it is.
pub fn read_stl(bytes: &[u8]) -> Result<Mesh, StlError> {
    let is_binary =
        declared_faces(bytes).is_some_and(|n| n.checked_mul(RECORD) == Some(bytes.len() - HEADER));
    let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let is_ascii =
        text.trim_ascii_start().get(..SOLID.len()).is_some_and(|word| word.eq_ignore_ascii_case(SOLID));
    // the face count of a binary header has a zero byte, and text has none: a damaged binary file is refused as one
    if !is_binary && is_ascii && !bytes.iter().take(HEADER).any(|byte| *byte == 0) {
        return read_ascii(text);
    }
    read_binary(bytes)
}

fn declared_faces(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER - 4..HEADER)?;
    Some(u32::from_le_bytes(count.try_into().ok()?) as usize)
}

fn read_binary(bytes: &[u8]) -> Result<Mesh, StlError> {
    let declared = declared_faces(bytes).ok_or(StlError::TooShort { bytes: bytes.len() })?;
    let records = bytes[HEADER..].chunks_exact(RECORD);
    let held = records.len();
    if declared != held || !records.remainder().is_empty() {
        return Err(StlError::FaceCount { declared, held, bytes: bytes.len() });
    }
    if held > MAX_FACES {
        return Err(StlError::TooManyFaces { faces: held });
    }
    let mut welder = Welder::default();
    for record in records {
        let number = |i: usize| f32::from_le_bytes([record[i], record[i + 1], record[i + 2], record[i + 3]]);
        welder.push([12, 24, 36].map(|corner| [number(corner), number(corner + 4), number(corner + 8)]))?;
    }
    welder.finish()
}

fn read_ascii(bytes: &[u8]) -> Result<Mesh, StlError> {
    let text = String::from_utf8_lossy(bytes);
    let mut reader = AsciiReader::default();
    let mut last = 0;
    for (index, line) in text.lines().enumerate() {
        // old programs end lines with a bare carriage return
        for part in line.split('\r') {
            let mut words = part.split_ascii_whitespace();
            while let Some(word) = words.next() {
                last = index + 1;
                reader.read(&word.to_ascii_lowercase(), &mut words, last)?;
            }
        }
    }
    if reader.is_ended {
        reader.welder.finish()
    } else {
        Err(StlError::Grammar { line: last, expected: "`endsolid`: the file ends early" })
    }
}

/// Where the reader of an ASCII file is.
#[derive(Default)]
struct AsciiReader {
    welder: Welder,
    corners: [[f32; 3]; 3],
    count: usize,
    is_ended: bool,
}

impl AsciiReader {
    /// Takes a keyword in lower case and what belongs to it.
    fn read<'a>(
        &mut self,
        keyword: &str,
        words: &mut impl Iterator<Item = &'a str>,
        line: usize,
    ) -> Result<(), StlError> {
        let fail = |expected| StlError::Grammar { line, expected };
        self.is_ended = keyword == "endsolid";
        match keyword {
            // the rest of the line is a name
            "solid" | "endsolid" => words.for_each(drop),
            "normal" => words.take(3).for_each(drop),
            "facet" | "endfacet" | "loop" => {}
            "outer" => {
                words.next();
                self.count = 0;
            }
            "vertex" => {
                let corner = self.corners.get_mut(self.count).ok_or(fail("three corners a facet"))?;
                for value in corner.iter_mut() {
                    *value = words
                        .next()
                        .and_then(|word| word.parse().ok())
                        .ok_or(fail("three numbers after `vertex`"))?;
                }
                self.count += 1;
            }
            "endloop" if self.count == 3 => self.welder.push(self.corners)?,
            "endloop" => return Err(fail("three corners a facet")),
            _ => return Err(fail("an STL keyword")),
        }
        Ok(())
    }
}

/// Collects faces and joins corners whose coordinates are equal bit for bit (with -0 as 0), as exporters write them.
#[derive(Default)]
struct Welder {
    mesh: Mesh,
    index: HashMap<[u32; 3], u32>,
}

impl Welder {
    fn push(&mut self, corners: [[f32; 3]; 3]) -> Result<(), StlError> {
        let face = self.mesh.faces.len();
        if !corners.iter().flatten().all(|c| c.is_finite()) {
            return Err(StlError::NotFinite { face });
        }
        if face == MAX_FACES {
            return Err(StlError::TooManyFaces { faces: face + 1 });
        }
        let corners = corners.map(|c| self.vertex(c));
        self.mesh.faces.push(corners);
        Ok(())
    }

    fn vertex(&mut self, [x, y, z]: [f32; 3]) -> u32 {
        let key = [x, y, z].map(|c| (c + 0.0).to_bits());
        *self.index.entry(key).or_insert_with(|| {
            self.mesh.vertices.push(Vec3::new(f64::from(x), f64::from(y), f64::from(z)));
            (self.mesh.vertices.len() - 1) as u32
        })
    }

    fn finish(self) -> Result<Mesh, StlError> {
        if self.mesh.faces.is_empty() { Err(StlError::Empty) } else { Ok(self.mesh) }
    }
}

/// Writes a binary STL in the mesh's own frame [m, rounded to f32].
pub fn write_stl(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER + RECORD * mesh.faces.len());
    bytes.resize(HEADER - 4, 0);
    bytes[..17].copy_from_slice(b"wade hull, metres");
    bytes.extend_from_slice(&(mesh.faces.len() as u32).to_le_bytes());
    for face in 0..mesh.faces.len() {
        let normal = mesh.area_vector(face).try_normalize(0.0).unwrap_or_default();
        for point in std::iter::once(normal).chain(mesh.triangle(face)) {
            point.iter().for_each(|c| bytes.extend_from_slice(&(*c as f32).to_le_bytes()));
        }
        bytes.extend_from_slice(&[0, 0]);
    }
    bytes
}
