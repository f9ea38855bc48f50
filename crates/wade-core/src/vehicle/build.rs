//! From an STL and a vehicle file to a vehicle.

use nalgebra::Matrix3;

use super::patches::{assign, index_of};
use super::plausible::{Implausible, check_size};
use super::spec::{ContactSpec, PatchSpec, VehicleSpec};
use super::{ContactPatch, Dimensions, Hull, Surface, SurfaceKind, Vehicle, VehicleError};
use crate::frame::Vec3;
use crate::geometry::mesh::{Mesh, StlError, read_stl, write_stl};
use crate::geometry::sampling::{Partners, sample_hull};
use crate::geometry::seal::{Sealing, seal};
use crate::geometry::submergence::SamplesError;
use crate::geometry::surfaces::{MirrorFault, Patch};
use crate::geometry::tidy::{Tidying, tidy};
use crate::geometry::watertight::{Allowances, LeakError, inspect};

/// Why no vehicle could be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BuildError {
    /// The STL is damaged.
    #[error("STL: {0}")]
    Stl(#[from] StlError),
    /// The mesh is not a closed body.
    #[error("hull: {0}")]
    Leak(#[from] LeakError),
    /// The values do not make a vehicle.
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
    /// A surface ended up without samples.
    #[error("samples: {0}; is z0 above part of the hull?")]
    Samples(#[from] SamplesError),
    /// The scale is not positive or the axes are not a right-handed frame.
    #[error(
        "body_from_stl is no rotation with a positive scale (determinant {determinant}): check the signs of the axes"
    )]
    Axes {
        /// Determinant of the transform.
        determinant: f64,
    },
    /// Faces that no rule takes.
    #[error("{faces} faces match no rule, the first at ({x_m:.3}, {y_m:.3}, {z_m:.3}) m in the body frame")]
    NoPatch {
        /// Number of such faces.
        faces: usize,
        /// Centroid of the first [m].
        x_m: f64,
        /// Centroid of the first [m].
        y_m: f64,
        /// Centroid of the first [m].
        z_m: f64,
    },
    /// A patch that no face belongs to.
    #[error("patch `{name}` gets no face from the rules")]
    EmptyPatch {
        /// The patch.
        name: String,
    },
    /// A rule, mirror or contact names a patch that does not exist.
    #[error("there is no patch called `{name}`")]
    UnknownPatch {
        /// The name.
        name: String,
    },
    /// Mirror partners that are not mirror images although the file claims it.
    #[error(
        "`{name}` and `{partner}` are not mirror images: the image of `{name}` about ({:.4}, {:.4}, {:.4}) m differs from `{partner}` by {:.6} m, and {:.7} m is allowed; correct the patches or set {flag} = false",
        fault.place.x, fault.place.y, fault.place.z, fault.distance, fault.tolerance
    )]
    NotMirrored {
        /// One surface.
        name: String,
        /// Its partner.
        partner: String,
        /// The claim in the vehicle file.
        flag: &'static str,
        /// By how much and where.
        fault: MirrorFault,
    },
    /// A claim of symmetry for a surface without counterpart.
    #[error(
        "`{name}` names no front_rear counterpart; name one, itself where it is its own mirror image, or set symmetric_front_rear = false"
    )]
    NoCounterpart {
        /// The surface.
        name: String,
    },
    /// No center of mass, or two.
    #[error(
        "state the center of mass once: center_of_mass_m from the center of the hull's bounding box, or center_of_mass_stl in the frame and unit of the STL"
    )]
    CenterOfMass,
    /// A size and a mass that no vehicle has.
    #[error(transparent)]
    Implausible(#[from] Implausible),
}

/// A vehicle, and what had to be done to the mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Corners joined and faces dropped.
    pub tidying: Tidying,
    /// What sealing did; `None` when the mesh was sound.
    pub sealing: Option<Sealing>,
    /// Volume that overlapping parts displace twice [m3], where the vehicle file allows it.
    pub overlap_m3: f64,
}

/// A hull whose faces have their surfaces already, for `build_from_hull`.
#[derive(Debug, Clone, PartialEq)]
pub struct AssignedHull {
    /// Closed mesh, axes of the body, any origin [m].
    pub mesh: Mesh,
    /// The surface of each face, an index into the patches of the vehicle file.
    pub face_surface: Vec<u16>,
}

/// Builds a vehicle; `sealed` allows leaky and double-skinned parts to be replaced by their convex hulls.
pub fn build(spec: &VehicleSpec, stl: &[u8], sealed: bool) -> Result<Vehicle, BuildError> {
    build_reporting(spec, stl, sealed).map(|built| built.vehicle)
}

/// As `build`, and says what was done to the mesh.
pub fn build_reporting(spec: &VehicleSpec, stl: &[u8], sealed: bool) -> Result<Built, BuildError> {
    let transform = spec.body_from_stl.matrix();
    let determinant = transform.determinant();
    if !(determinant > 0.0 && determinant.is_finite()) {
        return Err(BuildError::Axes { determinant });
    }
    let mut mesh = read_stl(stl)?;
    mesh.vertices.iter_mut().for_each(|v| *v = transform * *v);
    let (mesh, tidying) = tidy(mesh);
    let (mesh, sealing, overlap_m3) = closed(mesh, spec, sealed)?;
    let (mesh, translation) = centered(mesh)?;
    let face_surface = assign(spec, &mesh)?;
    let vehicle = assemble(spec, Hull { mesh, face_surface }, translation)?;
    Ok(Built { vehicle, tidying, sealing, overlap_m3 })
}

/// Builds a vehicle from a closed hull whose faces have their surfaces; the rules of the vehicle file are not used.
///
/// `center_of_mass_stl` and the mesh share one frame. Faces that the rounding of the bundle's STL makes vanish go.
pub fn build_from_hull(spec: &VehicleSpec, hull: AssignedHull) -> Result<Vehicle, BuildError> {
    let AssignedHull { mut mesh, face_surface } = hull;
    let center = mesh.bounds().ok_or(LeakError::Empty)?.center();
    mesh.vertices.iter_mut().for_each(|v| *v -= center);
    let mesh = read_stl(&write_stl(&mesh))?;
    let stays = |face: &usize| {
        let [a, b, c] = mesh.faces[*face];
        a != b && b != c && c != a
    };
    let kept: Vec<usize> = (0..mesh.faces.len()).filter(stays).collect();
    let face_surface = kept.iter().map(|face| face_surface[*face]).collect();
    // parts of the last face alone may be gone with it
    let mesh = read_stl(&write_stl(&mesh.part(&kept)))?;
    assemble(spec, Hull { mesh, face_surface }, -center)
}

/// The closed mesh, what sealing did, and the volume that overlapping parts displace twice [m3].
fn closed(mesh: Mesh, spec: &VehicleSpec, sealed: bool) -> Result<(Mesh, Option<Sealing>, f64), BuildError> {
    let allow = Allowances { thin_parts: spec.allow_thin_parts, overlaps: spec.allow_overlaps };
    let report = inspect(&mesh);
    match report.verdict(allow) {
        Ok(()) => Ok((mesh, None, report.overlap_volume())),
        Err(leak) if !sealed => Err(leak.into()),
        Err(_) => {
            let (mesh, sealing) = seal(&mesh);
            // hulls may have flat faces
            let (mesh, _) = tidy(mesh);
            let report = inspect(&mesh);
            report.verdict(allow)?;
            Ok((mesh, Some(sealing), report.overlap_volume()))
        }
    }
}

/// Centered on the bounding box, and rounded as the bundle's STL stores it: what is built is what is loaded.
fn centered(mut mesh: Mesh) -> Result<(Mesh, Vec3), BuildError> {
    let center = mesh.bounds().ok_or(LeakError::Empty)?.center();
    mesh.vertices.iter_mut().for_each(|v| *v -= center);
    let rounded = read_stl(&write_stl(&mesh))?;
    let (tidied, tidying) = tidy(rounded);
    // rounding may join corners; a mesh that changed is numbered in the order of its file again
    let mesh = if tidying.is_nothing() { tidied } else { read_stl(&write_stl(&tidied))? };
    Ok((mesh, -center))
}

fn assemble(spec: &VehicleSpec, hull: Hull, translation: Vec3) -> Result<Vehicle, BuildError> {
    let bounds = hull.mesh.bounds().ok_or(LeakError::Empty)?;
    let [length, width, height] = spec.dimensions_m.unwrap_or(bounds.extent().into());
    let dimensions = Dimensions { length, width, height };
    let z0 = spec.z0_m.unwrap_or(bounds.min.z);
    check_size(spec.mass_kg, &bounds, hull.mesh.volume())?;
    let surfaces = surfaces(spec, &hull)?;
    let symmetry = Symmetry::of(spec, &hull, &surfaces)?;
    let partners = symmetry.partners(&surfaces);
    let inertia = spec.inertia_kg_m2.map_or_else(|| box_inertia(spec.mass_kg, &dimensions), rows);
    let vehicle = Vehicle {
        name: spec.name.clone(),
        dimensions,
        z0,
        mass: spec.mass_kg,
        inertia,
        center_of_mass: center_of_mass(spec, translation)?,
        body_from_stl: spec.body_from_stl,
        translation,
        symmetric_left_right: symmetry.left_right,
        symmetric_front_rear: symmetry.front_rear,
        contacts: spec.contact.iter().map(|c| contact(spec, c, &surfaces, z0)).collect::<Result<_, _>>()?,
        samples: sample_hull(&hull, &partners, z0)?,
        surfaces,
        hull,
    };
    vehicle.validate()?;
    Ok(vehicle)
}

/// In the body frame [m].
fn center_of_mass(spec: &VehicleSpec, translation: Vec3) -> Result<Vec3, BuildError> {
    match (spec.center_of_mass_m, spec.center_of_mass_stl) {
        (Some(center), None) => Ok(Vec3::from(center)),
        (None, Some(center)) => Ok(spec.body_from_stl.matrix() * Vec3::from(center) + translation),
        _ => Err(BuildError::CenterOfMass),
    }
}

fn rows(rows: [[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| rows[i][j])
}

/// A solid box of even density: the estimate when nothing better is known.
fn box_inertia(mass: f64, d: &Dimensions) -> Matrix3<f64> {
    let [l2, w2, h2] = [d.length, d.width, d.height].map(|e| e * e);
    Matrix3::from_diagonal(&(Vec3::new(w2 + h2, l2 + h2, l2 + w2) * (mass / 12.0)))
}

fn surfaces(spec: &VehicleSpec, hull: &Hull) -> Result<Vec<Surface>, BuildError> {
    let mut surfaces = Vec::with_capacity(spec.patch.len());
    for (index, patch) in spec.patch.iter().enumerate() {
        let empty = || BuildError::EmptyPatch { name: patch.name.clone() };
        let moments = hull.patch(index).ok_or_else(empty)?;
        let partner = |name: &Option<String>| name.as_deref().map(|n| index_of(spec, n)).transpose();
        surfaces.push(Surface {
            name: patch.name.clone(),
            kind: patch.kind,
            centroid: moments.centroid,
            normal: normal(patch, &moments),
            area: moments.area,
            mirror_left_right: partner(&patch.left_right)?.unwrap_or(index),
            mirror_front_rear: partner(&patch.front_rear)?,
            sprocket_radius: match patch.kind {
                SurfaceKind::Track => {
                    patch.sprocket_radius_m.or(hull.bounds_of(index).map(|b| 0.5 * b.extent().z))
                }
                _ => patch.sprocket_radius_m,
            },
        });
    }
    Ok(surfaces)
}

/// Where the face normals cancel and the file states none, the direction that the kind suggests: a wheel's axle.
fn normal(spec: &PatchSpec, moments: &Patch) -> Vec3 {
    let stated = spec.normal.map(|n| Vec3::from(n).normalize());
    stated.or(moments.mean_normal()).unwrap_or_else(|| match spec.kind {
        SurfaceKind::Bottom => -Vec3::z(),
        SurfaceKind::Front => Vec3::x(),
        SurfaceKind::Rear => -Vec3::x(),
        SurfaceKind::Side | SurfaceKind::Wheel | SurfaceKind::Track => {
            Vec3::y() * 1f64.copysign(moments.centroid.y)
        }
    })
}

/// Across which planes the hull is its own mirror image.
#[derive(Debug, Clone, Copy)]
struct Symmetry {
    left_right: bool,
    front_rear: bool,
}

impl Symmetry {
    /// What the vehicle file claims, checked; what the mesh says where it claims nothing.
    fn of(spec: &VehicleSpec, hull: &Hull, surfaces: &[Surface]) -> Result<Self, BuildError> {
        let moments: Vec<Option<Patch>> = (0..surfaces.len()).map(|s| hull.patch(s)).collect();
        let left_right = |index: usize| Some(surfaces[index].mirror_left_right);
        let front_rear = |index: usize| surfaces[index].mirror_front_rear;
        let left_right = mirrored(surfaces, &moments, left_right, 1);
        let front_rear = mirrored(surfaces, &moments, front_rear, 0);
        let decide = |claim: Option<bool>, found: Result<(), BuildError>| match claim {
            Some(false) => Ok(false),
            Some(true) => found.map(|()| true),
            None => Ok(found.is_ok()),
        };
        Ok(Self {
            left_right: decide(spec.symmetric_left_right, left_right)?,
            front_rear: decide(spec.symmetric_front_rear, front_rear)?,
        })
    }

    /// The partners whose points may be mirrored.
    fn partners(self, surfaces: &[Surface]) -> Vec<Partners> {
        let partners = |surface: &Surface| Partners {
            left_right: self.left_right.then_some(surface.mirror_left_right),
            front_rear: surface.mirror_front_rear.filter(|_| self.front_rear),
        };
        surfaces.iter().map(partners).collect()
    }
}

/// Every surface and its partner are mirror images across the plane through the origin across `axis`.
fn mirrored(
    surfaces: &[Surface],
    moments: &[Option<Patch>],
    partner: impl Fn(usize) -> Option<usize>,
    axis: usize,
) -> Result<(), BuildError> {
    let flag = if axis == 1 { "symmetric_left_right" } else { "symmetric_front_rear" };
    for (index, surface) in surfaces.iter().enumerate() {
        let name = surface.name.clone();
        let Some(partner) = partner(index) else { return Err(BuildError::NoCounterpart { name }) };
        let Some((a, b)) = moments[index].zip(moments[partner]) else {
            return Err(BuildError::EmptyPatch { name });
        };
        let fault = a.mirror_fault(&b, axis);
        if !fault.is_mirrored() {
            let partner = surfaces[partner].name.clone();
            return Err(BuildError::NotMirrored { name, partner, flag, fault });
        }
    }
    Ok(())
}

fn contact(
    spec: &VehicleSpec,
    c: &ContactSpec,
    surfaces: &[Surface],
    z0: f64,
) -> Result<ContactPatch, BuildError> {
    let surface = index_of(spec, &c.patch)?;
    let centroid = surfaces[surface].centroid;
    let [x, y] = c.center_xy_m.unwrap_or([centroid.x, centroid.y]);
    Ok(ContactPatch { surface, center: Vec3::new(x, y, z0), area: c.area_m2 })
}
