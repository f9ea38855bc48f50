//! What every format is read into: links with their shapes, mass and joints, all in one frame.

use nalgebra::{Isometry3, Matrix3};
use wade_core::frame::Vec3;
use wade_core::geometry::mesh::Mesh;
use wade_core::vehicle::spec::Axis;

/// A robot or a set of meshes in the frame of its file, at its zero position.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Parents before children.
    pub links: Vec<Link>,
    /// Axes and unit that the format fixes, or leaves open.
    pub convention: Convention,
    /// What was found, a sentence each.
    pub notes: Vec<String>,
    /// What looks wrong, a sentence each.
    pub warnings: Vec<String>,
}

/// Axes and unit of a format.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convention {
    /// The axis that points forward.
    pub forward: Axis,
    /// The axis that points up.
    pub up: Axis,
    /// True where the format says that lengths are meters.
    pub is_metric: bool,
}

impl Convention {
    /// x forward, z up, meters: URDF, SDF and MJCF.
    pub const ROBOT: Self = Self { forward: Axis::PlusX, up: Axis::PlusZ, is_metric: true };
    /// z forward, y up, meters.
    pub const GLTF: Self = Self { forward: Axis::PlusZ, up: Axis::PlusY, is_metric: true };
    /// STL and OBJ fix nothing: x forward and z up are assumed.
    pub const OPEN: Self = Self { forward: Axis::PlusX, up: Axis::PlusZ, is_metric: false };
}

/// A rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Its name in the file.
    pub name: String,
    /// Index of the link that it is joined to.
    pub parent: Option<usize>,
    /// How it moves against that.
    pub joint: Joint,
    /// Its frame in that of the scene.
    pub pose: Isometry3<f64>,
    /// Its shapes.
    pub shapes: Vec<Shape>,
    /// Its mass.
    pub inertial: Option<Inertial>,
}

/// How a link moves against its parent.
#[derive(Debug, Clone, PartialEq)]
pub enum Joint {
    /// Not at all.
    Fixed,
    /// About an axis, without limits: a wheel, a propeller, a lidar.
    Turning {
        /// Name of the joint.
        name: String,
        /// Unit vector, frame of the scene.
        axis: Vec3,
        /// A point on the axis, frame of the scene [m].
        origin: Vec3,
    },
    /// In another way.
    Other,
}

/// What a shape is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// To be looked at.
    Visual,
    /// To collide.
    Collision,
    /// Both.
    Both,
}

/// A shape of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// What it is for.
    pub role: Role,
    /// File or kind, for messages.
    pub source: String,
    /// Closed or not, frame of the scene, unit of the file.
    pub mesh: Mesh,
}

/// Mass of a link, frame of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertial {
    /// Mass [kg].
    pub mass: f64,
    /// Center of mass.
    pub center: Vec3,
    /// Inertia about it [kg m2].
    pub inertia: Matrix3<f64>,
}
