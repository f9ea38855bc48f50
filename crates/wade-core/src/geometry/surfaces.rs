//! The hull split into named patches, and what the network is told about each.

use nalgebra::Matrix3;

use super::mesh::{Bounds, Mesh};
use crate::frame::Vec3;

/// A closed mesh whose every face belongs to a surface; body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Hull {
    /// The faces, watertight, normals outward.
    pub mesh: Mesh,
    /// The surface of each face, an index into the vehicle's surfaces.
    pub face_surface: Vec<u16>,
}

impl Hull {
    /// The faces of one surface.
    pub fn faces_of(&self, surface: usize) -> impl Iterator<Item = usize> + '_ {
        self.face_surface.iter().enumerate().filter(move |(_, s)| **s as usize == surface).map(|(f, _)| f)
    }

    /// The box around one surface [m]; `None` when it has no face.
    pub fn bounds_of(&self, surface: usize) -> Option<Bounds> {
        let corners = self.faces_of(surface).flat_map(|face| self.mesh.faces[face]);
        Bounds::around(corners.map(|corner| &self.mesh.vertices[corner as usize]))
    }

    /// Area moments of one surface; `None` when it has no face.
    pub fn patch(&self, surface: usize) -> Option<Patch> {
        Patch::of(&self.mesh, self.faces_of(surface))
    }
}

/// Area, centroid, normals and spread of a set of faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Total area [m2].
    pub area: f64,
    /// Area centroid [m].
    pub centroid: Vec3,
    /// Sum of the faces' area vectors [m2]; zero for a closed part.
    pub area_vector: Vec3,
    /// Second area moment about the centroid over the area, `int (x - c)(x - c)^T dA / A` [m2].
    pub spread: Matrix3<f64>,
}

impl Patch {
    /// Moments of the faces listed; `None` when there are none.
    pub fn of(mesh: &Mesh, faces: impl Iterator<Item = usize>) -> Option<Self> {
        let (mut area, mut first, mut second, mut vector) =
            (0.0, Vec3::zeros(), Matrix3::zeros(), Vec3::zeros());
        for face in faces {
            let [a, b, c] = mesh.triangle(face);
            let face_vector = mesh.area_vector(face);
            let face_area = face_vector.norm();
            area += face_area;
            vector += face_vector;
            for midpoint in [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5] {
                first += midpoint * (face_area / 3.0);
                second += midpoint * midpoint.transpose() * (face_area / 3.0);
            }
        }
        let centroid = first / area;
        let spread = second / area - centroid * centroid.transpose();
        (area > 0.0).then_some(Self { area, centroid, area_vector: vector, spread })
    }

    /// Direction of the area-weighted mean of the face normals; `None` when the normals cancel, as on a wheel.
    pub fn mean_normal(&self) -> Option<Vec3> {
        (self.area_vector.norm() > 1e-3 * self.area).then(|| self.area_vector.normalize())
    }

    /// How far `other` is from this patch reflected in the plane through the origin across `axis`: the largest of the
    /// differences in centroid, and in area, normals and spread as lengths.
    pub fn mirror_fault(&self, other: &Self, axis: usize) -> MirrorFault {
        let mut flip = Matrix3::identity();
        flip[(axis, axis)] = -1.0;
        let size = self.area.sqrt();
        let place = flip * self.centroid;
        let spread = (flip * self.spread * flip - other.spread).norm() / self.spread.norm().sqrt().max(size);
        let distance = (place - other.centroid)
            .norm()
            .max((self.area - other.area).abs() / size)
            .max((flip * self.area_vector - other.area_vector).norm() / size)
            .max(spread);
        MirrorFault { distance, place, tolerance: MIRROR_TOLERANCE * (size + self.centroid.norm()) }
    }
}

/// Share of its size by which a surface may miss its mirror image.
const MIRROR_TOLERANCE: f64 = 1e-6;

/// A surface beside the mirror image of its partner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MirrorFault {
    /// By how much they differ [m].
    pub distance: f64,
    /// Centroid of the mirror image [m].
    pub place: Vec3,
    /// Difference that rounding explains [m].
    pub tolerance: f64,
}

impl MirrorFault {
    /// True for mirror images.
    pub fn is_mirrored(&self) -> bool {
        self.distance <= self.tolerance
    }
}
