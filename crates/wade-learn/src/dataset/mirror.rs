//! Mirror images of samples (source paper, "Symmetry-based Augmentation").
//!
//! A reflection changes the sign of one component of forces, velocities and the up vector, and of the other two of
//! moments and angular velocities; the load on a surface becomes that on its partner.

use std::collections::BTreeMap;

use nalgebra::UnitVector3;

use super::{Dataset, Image, Rest, Sample, SurfaceLoad};
use wade_core::condition::Condition;
use wade_core::frame::Vec3;
use wade_core::vehicle::{Surface, Vehicle};

/// A plane through the body origin that images are reflected across.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// y = 0.
    LeftRight,
    /// x = 0.
    FrontRear,
}

/// Why a sample has no mirror image.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MirrorError {
    /// A vehicle whose partners are not known.
    #[error("vehicle `{vehicle}` is in the data set, but its bundle was not given")]
    UnknownVehicle {
        /// Its name.
        vehicle: String,
    },
    /// Surfaces of another version of the vehicle.
    #[error(
        "vehicle `{vehicle}`: the bundle and the data set do not name the same surfaces; `{surface}` is in one of them"
    )]
    Surfaces {
        /// The vehicle.
        vehicle: String,
        /// A surface that only one of them has.
        surface: String,
    },
    /// A surface without counterpart.
    #[error("vehicle `{vehicle}`: surface `{surface}` has no front_rear partner in the vehicle file")]
    NoPartner {
        /// The vehicle.
        vehicle: String,
        /// The surface.
        surface: String,
    },
    /// Images of images would be there twice.
    #[error("case `{case}` has mirror images already")]
    Mirrored {
        /// The case.
        case: String,
    },
}

impl Plane {
    fn axis(self) -> usize {
        match self {
            Self::LeftRight => 1,
            Self::FrontRear => 0,
        }
    }

    /// The image of a velocity or force.
    pub(crate) fn polar(self, v: &Vec3) -> Vec3 {
        let mut image = *v;
        image[self.axis()] = -v[self.axis()];
        image
    }

    /// The image of an angular velocity or moment.
    pub(crate) fn axial(self, v: &Vec3) -> Vec3 {
        -self.polar(v)
    }

    /// Where the image of a surface lies, by its number.
    pub(crate) fn partner(self, surface: &Surface) -> Option<usize> {
        match self {
            Self::LeftRight => Some(surface.mirror_left_right),
            Self::FrontRear => surface.mirror_front_rear,
        }
    }

    fn condition(self, c: &Condition) -> Condition {
        Condition {
            velocity: self.polar(&c.velocity),
            ground_velocity: self.polar(&c.ground_velocity),
            angular_velocity: self.axial(&c.angular_velocity),
            acceleration: self.polar(&c.acceleration),
            angular_acceleration: self.axial(&c.angular_acceleration),
            up: UnitVector3::new_unchecked(self.polar(&c.up)),
            ..*c
        }
    }

    fn load(self, load: &SurfaceLoad) -> SurfaceLoad {
        SurfaceLoad {
            force: self.polar(&load.force),
            moment: load.moment.as_ref().map(|v| self.axial(v)),
            viscous: load.viscous.as_ref().map(|v| self.polar(v)),
            rest: load
                .rest
                .map(|rest| Rest { force: self.polar(&rest.force), moment: self.axial(&rest.moment) }),
        }
    }

    fn image(self, image: Image) -> Image {
        match (self, image) {
            (Self::LeftRight, Image::Original) | (Self::FrontRear, Image::Both) => Image::LeftRight,
            (Self::FrontRear, Image::Original) | (Self::LeftRight, Image::Both) => Image::FrontRear,
            (Self::LeftRight, Image::FrontRear) | (Self::FrontRear, Image::LeftRight) => Image::Both,
            (Self::LeftRight, Image::LeftRight) | (Self::FrontRear, Image::FrontRear) => Image::Original,
        }
    }
}

/// The partner of each surface of a data set, in its order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Partners {
    plane: Plane,
    of: Vec<usize>,
}

impl Partners {
    /// Looks the partners up in the vehicle; `surfaces` are those of the data set.
    pub fn new(plane: Plane, vehicle: &Vehicle, surfaces: &[String]) -> Result<Self, MirrorError> {
        let name = || vehicle.name.clone();
        let unknown = |surface: &str| MirrorError::Surfaces { vehicle: name(), surface: surface.to_owned() };
        let here = |surface: &str| surfaces.iter().position(|other| other == surface);
        if let Some(extra) = vehicle.surfaces.iter().find(|surface| here(&surface.name).is_none()) {
            return Err(unknown(&extra.name));
        }
        let partner = |surface: &String| {
            let index = vehicle.surface_index(surface).ok_or_else(|| unknown(surface))?;
            let partner = plane.partner(&vehicle.surfaces[index]);
            let no_partner = || MirrorError::NoPartner { vehicle: name(), surface: surface.clone() };
            let partner = &vehicle.surfaces[partner.ok_or_else(no_partner)?].name;
            here(partner).ok_or_else(|| unknown(partner))
        };
        Ok(Self { plane, of: surfaces.iter().map(partner).collect::<Result<_, _>>()? })
    }

    /// The mirror image of a sample.
    pub fn reflect(&self, sample: &Sample) -> Sample {
        // partners name each other, so what comes from the partner is what goes to it
        let surfaces = self.of.iter().map(|&partner| self.plane.load(&sample.surfaces[partner])).collect();
        Sample {
            image: self.plane.image(sample.image),
            condition: self.plane.condition(&sample.condition),
            surfaces,
            ..sample.clone()
        }
    }
}

/// Adds the mirror images of every sample: left to right where the vehicle file declares the hull symmetric, front to
/// rear likewise, or with `front_rear_anyway` on any hull whose surfaces have counterparts, as the source paper did.
pub fn augment(
    dataset: &Dataset,
    vehicles: &BTreeMap<String, Vehicle>,
    front_rear_anyway: bool,
) -> Result<Dataset, MirrorError> {
    if let Some(image) = dataset.samples.iter().find(|sample| sample.image != Image::Original) {
        return Err(MirrorError::Mirrored { case: image.case.clone() });
    }
    let mut samples = dataset.samples.clone();
    let mut meta = dataset.meta.clone();
    for (name, surfaces) in &dataset.meta.vehicles {
        let vehicle =
            vehicles.get(name).ok_or_else(|| MirrorError::UnknownVehicle { vehicle: name.clone() })?;
        let planes = [
            (Plane::LeftRight, vehicle.symmetric_left_right),
            (Plane::FrontRear, vehicle.symmetric_front_rear || front_rear_anyway),
        ];
        for (plane, _) in planes.into_iter().filter(|(_, wanted)| *wanted) {
            let partners = Partners::new(plane, vehicle, surfaces)?;
            let of_vehicle = samples.iter().filter(|sample| sample.vehicle == *name);
            let images: Vec<Sample> = of_vehicle.map(|sample| partners.reflect(sample)).collect();
            samples.extend(images);
        }
        if front_rear_anyway && !vehicle.symmetric_front_rear {
            let note =
                "front_rear images of a hull that is not symmetric front to rear, as in the source paper";
            meta.notes.insert(format!("augmentation of {name}"), note.to_owned());
        }
    }
    Ok(Dataset { meta, samples })
}
