//! What the rest of the program may rely on in a vehicle.

use super::{ContactPatch, Dimensions, MAX_SURFACES, SurfaceKind, Vehicle};
use crate::frame::Vec3;

/// Farthest that a point of a vehicle may lie from its origin [m]: no deeper water can be asked about.
const FARTHEST: f64 = 1e3;

/// Why a set of values is no vehicle.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VehicleError {
    /// No surface, or too many.
    #[error("{count} surfaces, 1 to {MAX_SURFACES} are allowed")]
    SurfaceCount {
        /// Number of surfaces.
        count: usize,
    },
    /// Two surfaces of one name.
    #[error("two surfaces are called `{name}`")]
    DuplicateName {
        /// The name.
        name: String,
    },
    /// A number out of its range.
    #[error("{quantity} is {value}, which is not {expected}")]
    Number {
        /// Which one.
        quantity: &'static str,
        /// What it is.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// A surface with impossible geometry.
    #[error("surface `{name}`: area, centroid or unit normal is not a sound number")]
    Surface {
        /// The surface.
        name: String,
    },
    /// A track without the radius of its sprocket, or another surface with one.
    #[error("surface `{name}`: a track has a positive sprocket_radius_m, and nothing else has one")]
    Sprocket {
        /// The surface.
        name: String,
    },
    /// Mirror partners that do not point back at each other.
    #[error("surface `{name}`: its mirror partner does not name it in return")]
    Mirror {
        /// The surface.
        name: String,
    },
    /// A claim of symmetry for a surface without counterpart: no data of it could be mirrored.
    #[error(
        "surface `{name}` has no front_rear counterpart although the hull is symmetric_front_rear; name one in the vehicle file, or set symmetric_front_rear = false"
    )]
    NoCounterpart {
        /// The surface.
        name: String,
    },
    /// The table from faces to surfaces does not fit.
    #[error("{entries} patch entries for {faces} faces, each must name one of {surfaces} surfaces")]
    FaceTable {
        /// Entries in the table.
        entries: usize,
        /// Faces of the mesh.
        faces: usize,
        /// Number of surfaces.
        surfaces: usize,
    },
    /// A surface without a face.
    #[error("surface `{name}` has no face")]
    NoFace {
        /// The surface.
        name: String,
    },
    /// A hull that no water could reach, or that holds none.
    #[error(
        "the hull reaches {farthest} m from its origin and holds {volume} m3: at most {FARTHEST} m, and a volume, are allowed"
    )]
    Hull {
        /// The largest coordinate of a vertex [m].
        farthest: f64,
        /// The volume [m3].
        volume: f64,
    },
    /// Samples of another vehicle.
    #[error("samples of {samples} surfaces for {surfaces} surfaces")]
    SampleCount {
        /// Surfaces that have samples.
        samples: usize,
        /// Number of surfaces.
        surfaces: usize,
    },
    /// A contact patch that names no surface or has no area.
    #[error("contact patch {index} names no surface or has no sound area and center")]
    Contact {
        /// Index of the contact patch.
        index: usize,
    },
}

impl Vehicle {
    /// Checks all that the rest of the program relies on; whoever makes a vehicle calls it once.
    pub fn validate(&self) -> Result<(), VehicleError> {
        self.check_numbers()?;
        self.check_surfaces()?;
        self.check_faces()?;
        let (samples, surfaces) = (self.samples.surfaces.len(), self.surfaces.len());
        if samples != surfaces {
            return Err(VehicleError::SampleCount { samples, surfaces });
        }
        let sound = |c: &ContactPatch| {
            c.surface < surfaces && c.area > 0.0 && finite(&c.center) && c.area.is_finite()
        };
        match self.contacts.iter().position(|c| !sound(c)) {
            Some(index) => Err(VehicleError::Contact { index }),
            None => Ok(()),
        }
    }

    fn check_numbers(&self) -> Result<(), VehicleError> {
        let Dimensions { length, width, height } = self.dimensions;
        for (quantity, value) in [("length", length), ("width", width), ("height", height)] {
            if !(value > 0.0 && value <= 2.0 * FARTHEST) {
                return Err(VehicleError::Number {
                    quantity,
                    value,
                    expected: "positive and at most 2000 m",
                });
            }
        }
        if !(self.mass > 0.0 && self.mass.is_finite()) {
            let value = self.mass;
            return Err(VehicleError::Number { quantity: "mass", value, expected: "positive and finite" });
        }
        for (quantity, value) in [("z0", self.z0), ("center of mass", self.center_of_mass.amax())] {
            if value.is_nan() || value.abs() > FARTHEST {
                return Err(VehicleError::Number {
                    quantity,
                    value,
                    expected: "within 1000 m of the origin",
                });
            }
        }
        let skew = (self.inertia - self.inertia.transpose()).norm();
        let definite = (1..=3).all(|n| self.inertia.view((0, 0), (n, n)).determinant() > 0.0);
        if !definite || skew > 1e-9 * self.inertia.norm() {
            let value = self.inertia.determinant();
            let expected = "that of a symmetric, positive definite matrix";
            return Err(VehicleError::Number { quantity: "determinant of the inertia", value, expected });
        }
        Ok(())
    }

    fn check_surfaces(&self) -> Result<(), VehicleError> {
        let count = self.surfaces.len();
        if count == 0 || count > MAX_SURFACES {
            return Err(VehicleError::SurfaceCount { count });
        }
        let partner = |index: usize| self.surfaces.get(index);
        for (index, s) in self.surfaces.iter().enumerate() {
            let name = s.name.clone();
            if self.surfaces[..index].iter().any(|other| other.name == name) {
                return Err(VehicleError::DuplicateName { name });
            }
            let unit = (s.normal.norm() - 1.0).abs() < 1e-6;
            if !(unit && s.area > 0.0 && s.area.is_finite() && finite(&s.centroid)) {
                return Err(VehicleError::Surface { name });
            }
            let is_track = s.kind == SurfaceKind::Track;
            let sprocket = s.sprocket_radius.map(|radius| radius > 0.0 && radius.is_finite());
            if sprocket != is_track.then_some(true) {
                return Err(VehicleError::Sprocket { name });
            }
            let left_right = partner(s.mirror_left_right).is_some_and(|p| p.mirror_left_right == index);
            let back = |p: usize| partner(p).is_some_and(|p| p.mirror_front_rear == Some(index));
            if !left_right || !s.mirror_front_rear.is_none_or(back) {
                return Err(VehicleError::Mirror { name });
            }
            if self.symmetric_front_rear && s.mirror_front_rear.is_none() {
                return Err(VehicleError::NoCounterpart { name });
            }
        }
        Ok(())
    }

    fn check_faces(&self) -> Result<(), VehicleError> {
        let farthest = self.hull.mesh.vertices.iter().map(|vertex| vertex.amax()).fold(0.0, f64::max);
        let volume = self.hull.mesh.volume();
        if !(farthest <= FARTHEST && volume > 0.0) {
            return Err(VehicleError::Hull { farthest, volume });
        }
        let (entries, faces, surfaces) =
            (self.hull.face_surface.len(), self.hull.mesh.faces.len(), self.surfaces.len());
        let mut seen = [false; MAX_SURFACES];
        let known = self.hull.face_surface.iter().all(|s| {
            let known = (*s as usize) < surfaces;
            seen[*s as usize % MAX_SURFACES] |= known;
            known
        });
        if !known || entries != faces {
            return Err(VehicleError::FaceTable { entries, faces, surfaces });
        }
        match self.surfaces.iter().zip(seen).find(|(_, seen)| !seen) {
            Some((s, _)) => Err(VehicleError::NoFace { name: s.name.clone() }),
            None => Ok(()),
        }
    }
}

fn finite(v: &Vec3) -> bool {
    v.iter().all(|c| c.is_finite())
}
