//! vehicle.toml.

use std::path::Path;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::{Bundle, FORMAT, Fault};
use crate::domain::{Domain, Quantity};
use crate::frame::Vec3;
use crate::geometry::submergence::Samples;
use crate::geometry::surfaces::Hull;
use crate::vehicle::spec::BodyFromStl;
use crate::vehicle::{ContactPatch, Dimensions, Surface, SurfaceKind, Vehicle};

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VehicleFile {
    format: u32,
    name: String,
    pub version: u32,
    /// Where the weights come from.
    #[serde(skip_serializing_if = "Option::is_none")]
    provenance: Option<String>,
    length_m: f64,
    width_m: f64,
    height_m: f64,
    z0_m: f64,
    mass_kg: f64,
    center_of_mass_m: [f64; 3],
    inertia_kgm2: [[f64; 3]; 3],
    symmetric_left_right: bool,
    symmetric_front_rear: bool,
    /// What was added after scale and axes of the STL [m].
    body_from_stl_translation_m: [f64; 3],
    /// Scale and axes of the STL that the hull came from.
    body_from_stl: BodyFromStl,
    #[serde(skip_serializing_if = "Option::is_none")]
    domain: Option<Domain>,
    surface: Vec<SurfaceEntry>,
    #[serde(default)]
    contact: Vec<ContactEntry>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SurfaceEntry {
    name: String,
    kind: SurfaceKind,
    centroid_m: [f64; 3],
    normal: [f64; 3],
    area_m2: f64,
    mirror_left_right: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    mirror_front_rear: Option<String>,
    /// Of a track alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    sprocket_radius_m: Option<f64>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ContactEntry {
    surface: String,
    center_m: [f64; 3],
    area_m2: f64,
}

/// A name that can be part of a path and of a service's name, and that is its folder's.
pub fn check_name(name: &str, directory: &Path) -> Result<(), Fault> {
    let allowed = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-' || b == b'_';
    if name.is_empty() || name.len() > 64 || !name.bytes().all(allowed) {
        return Err(Fault::NameSyntax { name: name.to_owned() });
    }
    // a path that ends in . or .. has no name of its own
    if directory.file_name().is_none_or(|folder| folder != name) {
        return Err(Fault::Name { name: name.to_owned() });
    }
    Ok(())
}

impl VehicleFile {
    /// Reads the file and checks what it says of itself.
    pub fn parse(bytes: &[u8], directory: &Path) -> Result<Self, Fault> {
        #[derive(Deserialize)]
        struct Format {
            format: u32,
        }
        let text = String::from_utf8_lossy(bytes);
        let Format { format } = toml::from_str(&text)?;
        if format > FORMAT {
            return Err(Fault::NewerFormat { found: format });
        }
        let file: Self = toml::from_str(&text)?;
        check_name(&file.name, directory)?;
        Ok(file)
    }

    pub fn new(bundle: &Bundle) -> Self {
        let vehicle = &bundle.vehicle;
        let name = |index: usize| vehicle.surfaces[index].name.clone();
        let surface = |surface: &Surface| SurfaceEntry {
            name: surface.name.clone(),
            kind: surface.kind,
            centroid_m: surface.centroid.into(),
            normal: surface.normal.into(),
            area_m2: surface.area,
            mirror_left_right: name(surface.mirror_left_right),
            mirror_front_rear: surface.mirror_front_rear.map(name),
            sprocket_radius_m: surface.sprocket_radius,
        };
        let contact = |contact: &ContactPatch| ContactEntry {
            surface: name(contact.surface),
            center_m: contact.center.into(),
            area_m2: contact.area,
        };
        Self {
            format: FORMAT,
            name: vehicle.name.clone(),
            version: bundle.version,
            provenance: bundle.trained.as_ref().map(|(weights, _)| weights.provenance.clone()),
            length_m: vehicle.dimensions.length,
            width_m: vehicle.dimensions.width,
            height_m: vehicle.dimensions.height,
            z0_m: vehicle.z0,
            mass_kg: vehicle.mass,
            center_of_mass_m: vehicle.center_of_mass.into(),
            inertia_kgm2: std::array::from_fn(|i| std::array::from_fn(|j| vehicle.inertia[(i, j)])),
            body_from_stl: vehicle.body_from_stl,
            body_from_stl_translation_m: vehicle.translation.into(),
            symmetric_left_right: vehicle.symmetric_left_right,
            symmetric_front_rear: vehicle.symmetric_front_rear,
            domain: bundle.trained.as_ref().map(|&(_, domain)| domain),
            surface: vehicle.surfaces.iter().map(surface).collect(),
            contact: vehicle.contacts.iter().map(contact).collect(),
        }
    }

    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("plain numbers, strings and tables are always TOML")
    }

    /// The vehicle that the file describes, with its hull and samples.
    pub fn vehicle(&self, hull: Hull, samples: Samples) -> Result<Vehicle, Fault> {
        let index = |name: &String| {
            let found = self.surface.iter().position(|surface| surface.name == *name);
            found.ok_or_else(|| Fault::UnknownSurface { name: name.clone() })
        };
        let surface = |entry: &SurfaceEntry| {
            Ok(Surface {
                name: entry.name.clone(),
                kind: entry.kind,
                centroid: Vec3::from(entry.centroid_m),
                normal: Vec3::from(entry.normal),
                area: entry.area_m2,
                mirror_left_right: index(&entry.mirror_left_right)?,
                mirror_front_rear: entry.mirror_front_rear.as_ref().map(index).transpose()?,
                sprocket_radius: entry.sprocket_radius_m,
            })
        };
        let contact = |entry: &ContactEntry| {
            let center = Vec3::from(entry.center_m);
            Ok(ContactPatch { surface: index(&entry.surface)?, center, area: entry.area_m2 })
        };
        let dimensions = Dimensions { length: self.length_m, width: self.width_m, height: self.height_m };
        Ok(Vehicle {
            name: self.name.clone(),
            dimensions,
            z0: self.z0_m,
            mass: self.mass_kg,
            inertia: Matrix3::from_fn(|i, j| self.inertia_kgm2[i][j]),
            center_of_mass: Vec3::from(self.center_of_mass_m),
            body_from_stl: self.body_from_stl,
            translation: Vec3::from(self.body_from_stl_translation_m),
            symmetric_left_right: self.symmetric_left_right,
            symmetric_front_rear: self.symmetric_front_rear,
            surfaces: self.surface.iter().map(surface).collect::<Result<_, Fault>>()?,
            contacts: self.contact.iter().map(contact).collect::<Result<_, Fault>>()?,
            hull,
            samples,
        })
    }

    /// Provenance and domain of the weights; none where neither is stated.
    pub fn training(&self) -> Result<Option<(String, Domain)>, Fault> {
        let (provenance, domain) = match (&self.provenance, self.domain) {
            (Some(provenance), Some(domain)) => (provenance.clone(), domain),
            (None, None) => return Ok(None),
            _ => return Err(Fault::Untrained),
        };
        match Quantity::ALL
            .into_iter()
            .find(|&quantity| domain.range(quantity).is_some_and(|range| !range.is_valid()))
        {
            Some(quantity) => Err(Fault::Domain { quantity: quantity.name() }),
            None => Ok(Some((provenance, domain))),
        }
    }
}
