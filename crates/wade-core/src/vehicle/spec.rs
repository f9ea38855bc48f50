//! The vehicle file from which a bundle is built: TOML, lengths in the body frame, units in the keys.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::SurfaceKind;
use crate::frame::Vec3;

/// Everything about a vehicle that its STL does not hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VehicleSpec {
    /// Name of the vehicle.
    pub name: String,
    /// Mass [kg].
    pub mass_kg: f64,
    /// Center of mass in the body frame [m], whose origin is the center of the hull's bounding box; this or
    /// `center_of_mass_stl`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center_of_mass_m: Option<[f64; 3]>,
    /// Center of mass in the frame and the unit of the STL.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center_of_mass_stl: Option<[f64; 3]>,
    /// Inertia about the center of mass [kg m2]; default: a solid box of the dimensions, an estimate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertia_kg_m2: Option<[[f64; 3]; 3]>,
    /// Reference length, width, height [m]; default: the bounding box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dimensions_m: Option<[f64; 3]>,
    /// Height of the ground-contact plane in the body frame [m]; default: the lowest point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z0_m: Option<f64>,
    /// Left and right are claimed, and checked, to be mirror images; default: what the mesh says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub symmetric_left_right: Option<bool>,
    /// Front and rear are claimed, and checked, to be mirror images; default: what the mesh says, false where a surface
    /// names no counterpart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub symmetric_front_rear: Option<bool>,
    /// Accept closed parts that fill little of their convex hull (frames that flood).
    #[serde(default)]
    pub allow_thin_parts: bool,
    /// Accept overlapping parts, whose common volume then counts twice.
    #[serde(default)]
    pub allow_overlaps: bool,
    /// How the STL is turned into the body frame; default: metres, already FLU.
    #[serde(default)]
    pub body_from_stl: BodyFromStl,
    /// The surfaces, in the order of the answers.
    pub patch: Vec<PatchSpec>,
    /// Which faces belong to which surface: the first rule that holds for a face decides.
    pub rule: Vec<Rule>,
    /// Contact patches of the tires.
    #[serde(default)]
    pub contact: Vec<ContactSpec>,
}

/// Scale and axes of the STL; the hull is then centered on its bounding box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BodyFromStl {
    /// Metres per unit of the file: 0.001 for millimetres.
    pub scale: f64,
    /// The axis of the file that points forward.
    pub x: Axis,
    /// The axis of the file that points left.
    pub y: Axis,
    /// The axis of the file that points up.
    pub z: Axis,
}

impl Default for BodyFromStl {
    fn default() -> Self {
        Self { scale: 1.0, x: Axis::PlusX, y: Axis::PlusY, z: Axis::PlusZ }
    }
}

impl BodyFromStl {
    /// Scale times rotation; the determinant is negative for a left-handed choice of axes.
    pub fn matrix(&self) -> Matrix3<f64> {
        let rows = [self.x, self.y, self.z].map(|a| a.direction().transpose());
        Matrix3::from_rows(&rows) * self.scale
    }
}

/// A signed axis of the STL file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Axis {
    /// +x
    #[serde(rename = "x")]
    PlusX,
    /// -x
    #[serde(rename = "-x")]
    MinusX,
    /// +y
    #[serde(rename = "y")]
    PlusY,
    /// -y
    #[serde(rename = "-y")]
    MinusY,
    /// +z
    #[serde(rename = "z")]
    PlusZ,
    /// -z
    #[serde(rename = "-z")]
    MinusZ,
}

impl Axis {
    fn direction(self) -> Vec3 {
        match self {
            Self::PlusX => Vec3::x(),
            Self::MinusX => -Vec3::x(),
            Self::PlusY => Vec3::y(),
            Self::MinusY => -Vec3::y(),
            Self::PlusZ => Vec3::z(),
            Self::MinusZ => -Vec3::z(),
        }
    }
}

/// One surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchSpec {
    /// Unique name.
    pub name: String,
    /// What it is to the flow.
    pub kind: SurfaceKind,
    /// Name of the counterpart across y = 0; default: itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_right: Option<String>,
    /// Name of the counterpart across x = 0; default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub front_rear: Option<String>,
    /// Normal to state where the mean of the faces would mislead: a deck folded into a front panel, a wheel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
    /// Radius of the drive sprocket of a track [m]; default: half the height of the track.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sprocket_radius_m: Option<f64>,
}

/// Faces of one surface: all the conditions given must hold; a rule without conditions takes every face.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rule {
    /// The surface that gets the faces.
    pub patch: String,
    /// Connected parts, numbered in the order of their first face in the (sealed) mesh.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<usize>,
    /// Lower corner of a box that holds the centroid of the face [m]; -inf and inf are allowed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_m: Option<[f64; 3]>,
    /// Upper corner of that box [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_m: Option<[f64; 3]>,
    /// Direction that the face looks in, with `within_deg`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub facing: Option<[f64; 3]>,
    /// Largest angle between the outward normal and `facing` [degrees]; default 45.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within_deg: Option<f64>,
}

/// One tire's contact with the ground.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactSpec {
    /// The surface that stands there.
    pub patch: String,
    /// Area without water in the convention `dry` [m2].
    pub area_m2: f64,
    /// Center [m]; default: below the centroid of the surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center_xy_m: Option<[f64; 2]>,
}
