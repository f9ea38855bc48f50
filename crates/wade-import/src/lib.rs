//! Vehicles from the files that robots and CAD programs write: URDF, SDF, MJCF, STL, OBJ and glTF.
//!
//! [`import`] reads links, shapes and mass (`read`), turns every shape into a closed mesh (`solid`), unites what
//! overlaps (`unite`), finds the wheels (`wheels`), gives every face a surface (`surfaces`) and builds the
//! vehicle. What it had to guess or mend stands in words in [`Imported::notes`] and [`Imported::warnings`]. It writes
//! nothing.

mod halve;
pub mod limits;
mod mass;
mod place;
mod read;
mod scene;
mod shapes;
mod solid;
mod surfaces;
mod tracks;
mod unite;
mod watch;
mod wheels;

use std::path::{Path, PathBuf};

pub use place::{PlaceError, Unit};
pub use read::ReadError;
pub use solid::SolidError;
pub use unite::UniteError;
pub use wheels::Wheel;

use wade_core::frame::Vec3;
use wade_core::vehicle::build::{AssignedHull, BuildError, build_from_hull};
use wade_core::vehicle::plausible::{Floating, questions};
use wade_core::vehicle::spec::{Axis, BodyFromStl, ContactSpec, VehicleSpec};
use wade_core::vehicle::{SurfaceKind, Vehicle};

use limits::{ASSUMED_DENSITY, MOST_FACES};
use place::Placement;
use read::Wanted;
use scene::{Role, Scene};
use solid::Piece;
use surfaces::Assigned;
use watch::Watch;

/// Which shapes of a link make its hull.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shapes {
    /// The visual shapes; where they are open, or there are none, the collision shapes, with a warning.
    #[default]
    Auto,
    /// The visual shapes alone.
    Visual,
    /// The collision shapes alone.
    Collision,
}

impl Shapes {
    /// The word of the option.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Visual => "visual",
            Self::Collision => "collision",
        }
    }
}

/// How to import.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Name of the vehicle.
    pub name: String,
    /// Mass [kg]; default: the sum of the links.
    pub mass: Option<f64>,
    /// Meters a unit of the files; default: 1 for robots and glTF, guessed by size and mass for STL and OBJ.
    pub scale: Option<f64>,
    /// The axis of the files that points forward; default: x, for glTF z.
    pub forward: Option<Axis>,
    /// The axis of the files that points up; default: z, for glTF y.
    pub up: Option<Axis>,
    /// Close holes, where a shape is open.
    pub seal: bool,
    /// Which shapes of a link make its hull.
    pub shapes: Shapes,
}

/// A vehicle from files.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The vehicle, with its hull and surfaces.
    pub vehicle: Vehicle,
    /// Displaced volume and floating position.
    pub floating: Floating,
    /// Its wheels and tracks, in the order of their surfaces.
    pub wheels: Vec<Wheel>,
    /// What was found and guessed, a sentence each.
    pub notes: Vec<String>,
    /// What looks wrong or had to be mended, a sentence each.
    pub warnings: Vec<String>,
}

/// Why no vehicle was made. The message names the file, the link or the place, the size of the fault and the way out.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A file that cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// Files without any shape.
    #[error("{}: no link has a shape of the kind asked for (--shapes {asked}); it has {visual} visual and {collision} collision shapes", .path.display())]
    NoShape {
        /// The first file.
        path: PathBuf,
        /// The option.
        asked: &'static str,
        /// Number of visual shapes.
        visual: usize,
        /// Number of collision shapes.
        collision: usize,
    },
    /// A shape without inside.
    #[error(transparent)]
    Solid(#[from] SolidError),
    /// Too many faces.
    #[error(
        "{faces} triangles, at most {MOST_FACES} are imported; simplify the meshes, or use the simpler ones of the collision shapes (--shapes collision)"
    )]
    TooManyFaces {
        /// Triangles of all shapes.
        faces: usize,
    },
    /// A union that failed.
    #[error(transparent)]
    Unite(#[from] UniteError),
    /// Axes or a size that make no vehicle.
    #[error("{0}")]
    Place(#[from] PlaceError),
    /// A mass that is no number.
    #[error("a mass of {mass} kg is not positive: give --mass KG")]
    Mass {
        /// The mass.
        mass: f64,
    },
    /// The hull makes no vehicle.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// Imports a vehicle from a robot description, or from mesh files that are its parts.
///
/// With a description among the files the others are where its meshes may be found. Nothing is written.
pub fn import(files: &[PathBuf], options: &Options) -> Result<Imported, ImportError> {
    let (mut notes, mut warnings) = (Vec::new(), Vec::new());
    let wanted =
        Wanted { visual: options.shapes != Shapes::Collision, collision: options.shapes != Shapes::Visual };
    let mut scene = read::read(files, wanted)?;
    notes.append(&mut scene.notes);
    warnings.append(&mut scene.warnings);
    let chosen = solid::choose(&scene, options.shapes, &mut warnings);
    if chosen.is_empty() {
        let count = |role: Role| {
            let shapes = scene.links.iter().flat_map(|link| &link.shapes);
            shapes.filter(|shape| shape.role == role || shape.role == Role::Both).count()
        };
        return Err(ImportError::NoShape {
            path: files.first().cloned().unwrap_or_default(),
            asked: options.shapes.name(),
            visual: count(Role::Visual),
            collision: count(Role::Collision),
        });
    }
    let faces: usize = chosen.iter().map(|piece| piece.mesh.faces.len()).sum();
    if faces > MOST_FACES {
        return Err(ImportError::TooManyFaces { faces });
    }
    let placement = Placement::of(&scene, &chosen, options, (&mut notes, &mut warnings))?;
    let mut pieces: Vec<Piece> = chosen.into_iter().map(|piece| placement.piece(piece)).collect();
    let watch = Watch::start();
    solid::close_all(&mut pieces, options.seal, &watch, &mut warnings)?;
    let scene = placement.scene(scene);
    let wheels = wheels::find(&scene, &mut pieces, &mut notes, &mut warnings);
    let united = halve::halve(unite::unite(&pieces, &watch, &mut notes, &mut warnings)?);
    let assigned = surfaces::assign(&united, &pieces, &wheels);
    let contacts = contacts(&wheels, &assigned);
    let vehicle = build(&scene, options, assigned, contacts, &mut warnings)?;
    let floating = Floating::of(&vehicle);
    warnings.extend(questions(&vehicle, &floating));
    let is_open = !scene.convention.is_metric && options.forward.is_none() && wheels.is_empty();
    if is_open && vehicle.dimensions.width > vehicle.dimensions.length {
        warnings
            .push("the vehicle is wider than long: does another axis point forward? --forward y".to_owned());
    }
    Ok(Imported { vehicle, floating, wheels, notes, warnings })
}

fn build(
    scene: &Scene,
    options: &Options,
    assigned: Assigned,
    contacts: Vec<ContactSpec>,
    warnings: &mut Vec<String>,
) -> Result<Vehicle, ImportError> {
    let volume = assigned.mesh.volume();
    let body = mass::sum(scene, warnings);
    let mass_kg = match (options.mass, &body) {
        (Some(mass), _) => mass,
        (None, Some(body)) => body.mass,
        (None, None) => {
            let mass = volume * ASSUMED_DENSITY;
            warnings.push(format!(
                "no file states a mass: {mass:.3} kg are assumed, {ASSUMED_DENSITY} kg a cubic meter of hull; give --mass KG"
            ));
            mass
        }
    };
    if !(mass_kg > 0.0 && mass_kg.is_finite()) {
        return Err(ImportError::Mass { mass: mass_kg });
    }
    let (center, inertia) = match &body {
        Some(body) => (body.center, body.inertia.map(|inertia| inertia * (mass_kg / body.mass))),
        None => {
            warnings.push(
                "no file states a center of mass: that of a hull filled evenly is taken, and the inertia of a box"
                    .to_owned(),
            );
            (mass::centroid(&assigned.mesh), None)
        }
    };
    let spec = VehicleSpec {
        name: options.name.clone(),
        mass_kg,
        center_of_mass_m: None,
        center_of_mass_stl: Some(center.into()),
        inertia_kg_m2: inertia.map(|m| std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]))),
        dimensions_m: None,
        z0_m: None,
        symmetric_left_right: None,
        symmetric_front_rear: None,
        allow_thin_parts: true,
        allow_overlaps: true,
        body_from_stl: BodyFromStl::default(),
        patch: assigned.patches,
        rule: Vec::new(),
        contact: contacts,
    };
    let hull = AssignedHull { mesh: assigned.mesh, face_surface: assigned.face_surface };
    Ok(build_from_hull(&spec, hull)?)
}

/// Where wheels and tracks stand on the ground, for the convention without water under the tires.
fn contacts(wheels: &[Wheel], assigned: &Assigned) -> Vec<ContactSpec> {
    let lowest = |vertices: &[Vec3]| vertices.iter().map(|vertex| vertex.z).fold(f64::INFINITY, f64::min);
    let ground = lowest(&assigned.mesh.vertices);
    let stands = |wheel: &&Wheel| {
        wheel.center.z - wheel.radius - ground <= limits::WHEEL_GROUND_SHARE * 2.0 * wheel.radius
            && assigned.patches.iter().any(|patch| patch.name == wheel.name)
    };
    // a track lies flat between its two ends
    let length = |wheel: &Wheel| match wheel.kind {
        SurfaceKind::Track => (wheel.length - 2.0 * wheel.radius).max(limits::CONTACT_SHARE * wheel.radius),
        _ => limits::CONTACT_SHARE * wheel.radius,
    };
    let contact = |wheel: &Wheel| ContactSpec {
        patch: wheel.name.clone(),
        area_m2: length(wheel) * wheel.width,
        center_xy_m: None,
    };
    wheels.iter().filter(stands).map(contact).collect()
}

/// A place in words [m], without the sign of a rounded zero.
pub(crate) fn at(point: &Vec3) -> String {
    use wade_core::vehicle::plausible::Rounded;
    format!("({}, {}, {}) m", Rounded(point.x), Rounded(point.y), Rounded(point.z))
}

/// The last part of a path, for messages.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}
