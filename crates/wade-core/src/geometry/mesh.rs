//! A triangle mesh with shared vertices.

use crate::frame::Vec3;

pub use super::stl::{StlError, read_stl, write_stl};

/// Triangles over shared vertices; counter-clockwise seen from outside, so that normals point outward.
///
/// Indices in `faces` are valid for `vertices`: `read_stl` and `parametric` guarantee it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Vertex positions [m].
    pub vertices: Vec<Vec3>,
    /// Three vertex indices a triangle.
    pub faces: Vec<[u32; 3]>,
}

/// An axis-aligned box [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest corner [m].
    pub min: Vec3,
    /// Largest corner [m].
    pub max: Vec3,
}

impl Bounds {
    /// The smallest box around `points`; `None` when there are none.
    pub fn around<'a>(points: impl IntoIterator<Item = &'a Vec3>) -> Option<Self> {
        let mut points = points.into_iter();
        let first = *points.next()?;
        let start = Self { min: first, max: first };
        Some(points.fold(start, |b, p| Self { min: b.min.inf(p), max: b.max.sup(p) }))
    }

    /// The smallest box around both.
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.inf(&other.min), max: self.max.sup(&other.max) }
    }

    /// Edge lengths [m].
    pub fn extent(&self) -> Vec3 {
        self.max - self.min
    }

    /// The eight corners [m].
    pub fn corners(&self) -> [Vec3; 8] {
        let ends = [self.min, self.max];
        std::array::from_fn(|i| Vec3::new(ends[i & 1].x, ends[i >> 1 & 1].y, ends[i >> 2].z))
    }

    /// Midpoint [m].
    pub fn center(&self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// True when the two boxes share a volume of more than `tolerance` in every direction [m].
    pub fn overlaps(&self, other: &Self, tolerance: f64) -> bool {
        (0..3).all(|i| self.min[i] + tolerance < other.max[i] && other.min[i] + tolerance < self.max[i])
    }
}

impl Mesh {
    /// The corners of a face [m].
    pub fn triangle(&self, face: usize) -> [Vec3; 3] {
        self.faces[face].map(|v| self.vertices[v as usize])
    }

    /// Outward normal times area of a face [m2].
    pub fn area_vector(&self, face: usize) -> Vec3 {
        let [a, b, c] = self.triangle(face);
        (b - a).cross(&(c - a)) * 0.5
    }

    /// Centroid of a face [m].
    pub fn face_centroid(&self, face: usize) -> Vec3 {
        let [a, b, c] = self.triangle(face);
        (a + b + c) / 3.0
    }

    /// Enclosed volume by the divergence theorem [m3]; negative when the faces point inward, meaningless when open.
    pub fn volume(&self) -> f64 {
        let Some(origin) = self.bounds().map(|b| b.center()) else {
            return 0.0;
        };
        let six_volumes = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| self.vertices[v as usize] - origin);
            a.dot(&b.cross(&c))
        };
        self.faces.iter().map(six_volumes).sum::<f64>() / 6.0
    }

    /// Total area of the faces [m2].
    pub fn area(&self) -> f64 {
        (0..self.faces.len()).map(|f| self.area_vector(f).norm()).sum()
    }

    /// The box around all vertices [m]; `None` for an empty mesh.
    pub fn bounds(&self) -> Option<Bounds> {
        Bounds::around(&self.vertices)
    }

    /// The faces listed, with the vertices they use and no others.
    pub fn part(&self, faces: &[usize]) -> Mesh {
        let mut index = vec![u32::MAX; self.vertices.len()];
        let mut part = Mesh::default();
        for &face in faces {
            let corners = self.faces[face].map(|v| {
                let slot = &mut index[v as usize];
                if *slot == u32::MAX {
                    *slot = part.vertices.len() as u32;
                    part.vertices.push(self.vertices[v as usize]);
                }
                *slot
            });
            part.faces.push(corners);
        }
        part
    }

    /// Appends another mesh; parts stay separate, nothing is welded.
    pub fn append(&mut self, other: &Mesh) {
        let shift = self.vertices.len() as u32;
        self.vertices.extend_from_slice(&other.vertices);
        self.faces.extend(other.faces.iter().map(|f| f.map(|v| v + shift)));
    }
}
