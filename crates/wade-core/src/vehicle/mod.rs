//! A vehicle: its hull in the body frame, the named surfaces of the hull, and its mass. Plain values, no IO.
//!
//! `spec` is the vehicle file, `build` makes a vehicle from it and an STL, `shipped` holds the two that come with us.

#[cfg(feature = "build")]
pub mod build;
#[cfg(feature = "build")]
mod patches;
#[cfg(feature = "build")]
pub mod plausible;
#[cfg(feature = "build")]
pub mod shipped;
pub mod spec;
mod validate;
mod wheels;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

pub use crate::geometry::submergence::Samples;
pub use crate::geometry::surfaces::Hull;
pub use validate::VehicleError;
pub use wheels::{MAX_WHEELS, PerWheel, by_axle};

use crate::condition::{Condition, GroundContact};
use crate::frame::{GRAVITY, Vec3, WaterPlane};
use crate::geometry::hydrostatics::surface_hydrostatics;
use crate::real::Real;
use crate::wrench::Wrench;
use spec::BodyFromStl;

/// Most surfaces a vehicle may have.
pub const MAX_SURFACES: usize = 64;

crate::named_enum! {
    /// What a surface is to the flow; the order of the first five is the one-hot order of the network's input.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum SurfaceKind {
        /// Faces down.
        Bottom => "bottom",
        /// Faces forward.
        Front => "front",
        /// Faces backward.
        Rear => "rear",
        /// Faces sideways.
        Side => "side",
        /// A wheel.
        Wheel => "wheel",
        /// A track: a belt that runs round about the body's y.
        Track => "track",
    }
}

impl SurfaceKind {
    /// True of what has a shaft whose speed can be stated.
    pub fn turns(self) -> bool {
        matches!(self, Self::Wheel | Self::Track)
    }

    /// Place of the kind among the inputs of a network, which know five: to a network that was trained without tracks a track is a
    /// wheel.
    pub fn network_input(self) -> usize {
        match self {
            Self::Track => Self::Wheel as usize,
            kind => kind as usize,
        }
    }
}

/// A named region of the hull with the source paper's descriptors; body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Unique name.
    pub name: String,
    /// What it is to the flow.
    pub kind: SurfaceKind,
    /// Area centroid [m].
    pub centroid: Vec3,
    /// Unit normal: stated by the vehicle file, else the area-weighted mean of the face normals.
    ///
    /// The paper's mean is not weighted; weighting makes the normal independent of how finely a face is cut.
    pub normal: Vec3,
    /// Area of all faces [m2].
    pub area: f64,
    /// Index of the mirror image across y = 0; itself when it lies on that plane.
    pub mirror_left_right: usize,
    /// Index of the counterpart across x = 0, itself when it lies on that plane; `None` when it has none.
    pub mirror_front_rear: Option<usize>,
    /// Radius of the drive sprocket of a track, which turns its speed into that of the belt [m]; `None` of what is no track.
    pub sprocket_radius: Option<f64>,
}

/// Size of the bounding box or as stated [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dimensions {
    /// Along x.
    pub length: f64,
    /// Along y.
    pub width: f64,
    /// Along z.
    pub height: f64,
}

/// Where a tire stands on the ground; body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPatch {
    /// Index of the surface that stands there.
    pub surface: usize,
    /// Center of the patch, in the ground-contact plane [m].
    pub center: Vec3,
    /// Area [m2].
    pub area: f64,
}

impl ContactPatch {
    /// The load that the hull loses when no water reaches under the patch, about `about` [N, N m].
    ///
    /// `F = -rho g delta A z` with the depth `delta` of the center: add it to the hydrostatics of the surface for
    /// `GroundContact::Dry`.
    pub fn lost_pressure<T: Real>(&self, plane: &WaterPlane<T>, density: T, about: &Vec3) -> Wrench<T> {
        let [center, about, up] = [self.center, *about, Vec3::z()].map(|vector| vector.map(T::from));
        let depth = plane.depth_below(&center).max(T::zero());
        Wrench::from_force_at(up * -(depth * self.area * (density * GRAVITY)), &center, &about)
    }
}

/// A vehicle as the forces are computed for it; body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Vehicle {
    /// Name of the bundle.
    pub name: String,
    /// Reference lengths.
    pub dimensions: Dimensions,
    /// Height of the ground-contact plane in the body frame [m]; negative.
    pub z0: f64,
    /// Mass [kg].
    pub mass: f64,
    /// Inertia about the center of mass [kg m2].
    pub inertia: Matrix3<f64>,
    /// Center of mass [m].
    pub center_of_mass: Vec3,
    /// How the coordinates of the STL became the body frame's.
    pub body_from_stl: BodyFromStl,
    /// What was added after scale and axes, so that the hull is centered [m].
    pub translation: Vec3,
    /// True when left and right are mirror images, checked at the build.
    pub symmetric_left_right: bool,
    /// True when front and rear are mirror images, checked at the build.
    pub symmetric_front_rear: bool,
    /// The named surfaces, K of them.
    pub surfaces: Vec<Surface>,
    /// Contact patches of the tires; may be empty.
    pub contacts: Vec<ContactPatch>,
    /// The closed hull and the surface of each face.
    pub hull: Hull,
    /// Sampled points of each surface.
    pub samples: Samples,
}

impl Vehicle {
    /// Hydrostatic load on each surface about the body origin [N, N m], in the ground-contact convention of the state.
    pub fn at_rest(&self, condition: &Condition) -> Vec<Wrench> {
        let (plane, origin) = (condition.water_plane(self.z0), Vec3::zeros());
        let mut loads =
            surface_hydrostatics(&self.hull, self.surfaces.len(), &plane, condition.density, &origin);
        if condition.ground_contact == GroundContact::Dry {
            for patch in &self.contacts {
                loads[patch.surface] += patch.lost_pressure(&plane, condition.density, &origin);
            }
        }
        loads
    }
}

impl Vehicle {
    /// Index of the surface of that name.
    pub fn surface_index(&self, name: &str) -> Option<usize> {
        self.surfaces.iter().position(|s| s.name == name)
    }
}
