//! From an STL and a vehicle file to a vehicle.

use nalgebra::Matrix3;

use super::patches::{assign, index_of};
use super::spec::{ContactSpec, PatchSpec, VehicleSpec};
use super::{ContactPatch, Dimensions, Hull, Surface, SurfaceKind, Vehicle, VehicleError};
use crate::frame::Vec3;
use crate::geometry::mesh::{Mesh, StlError, read_stl, write_stl};
use crate::geometry::sampling::{Partners, sample_hull};
use crate::geometry::seal::{Sealing, seal};
use crate::geometry::submergence::SamplesError;
use crate::geometry::surfaces::Patch;
use crate::geometry::watertight::{Allowances, LeakError, check_allowing};

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
    #[error("`{name}` and `{partner}` are not mirror images; correct the patches or set {flag} = false")]
    NotMirrored {
        /// One surface.
        name: String,
        /// Its partner.
        partner: String,
        /// The claim in the vehicle file.
        flag: &'static str,
    },
}

/// Builds a vehicle; `sealed` allows leaky and double-skinned parts to be replaced by their convex hulls.
pub fn build(spec: &VehicleSpec, stl: &[u8], sealed: bool) -> Result<Vehicle, BuildError> {
    build_reporting(spec, stl, sealed).map(|(vehicle, _)| vehicle)
}

/// As `build`, and says what sealing did; `None` when the mesh was sound.
pub fn build_reporting(
    spec: &VehicleSpec,
    stl: &[u8],
    sealed: bool,
) -> Result<(Vehicle, Option<Sealing>), BuildError> {
    let transform = spec.body_from_stl.matrix();
    let determinant = transform.determinant();
    if !(determinant > 0.0 && determinant.is_finite()) {
        return Err(BuildError::Axes { determinant });
    }
    let mut mesh = read_stl(stl)?;
    mesh.vertices.iter_mut().for_each(|v| *v = transform * *v);
    let (mesh, sealing) = closed(mesh, spec, sealed)?;
    let (mesh, translation) = centered(mesh)?;
    let vehicle = assemble(spec, mesh, translation)?;
    vehicle.validate()?;
    Ok((vehicle, sealing))
}

fn closed(mesh: Mesh, spec: &VehicleSpec, sealed: bool) -> Result<(Mesh, Option<Sealing>), BuildError> {
    let allow = Allowances { thin_parts: spec.allow_thin_parts, overlaps: spec.allow_overlaps };
    match check_allowing(&mesh, allow) {
        Ok(()) => Ok((mesh, None)),
        Err(leak) if !sealed => Err(leak.into()),
        Err(_) => {
            let (mesh, sealing) = seal(&mesh);
            check_allowing(&mesh, allow)?;
            Ok((mesh, Some(sealing)))
        }
    }
}

/// Centered on the bounding box, and rounded as the bundle's STL stores it: what is built is what is loaded.
fn centered(mut mesh: Mesh) -> Result<(Mesh, Vec3), BuildError> {
    let center = mesh.bounds().ok_or(LeakError::Empty)?.center();
    mesh.vertices.iter_mut().for_each(|v| *v -= center);
    Ok((read_stl(&write_stl(&mesh))?, -center))
}

fn assemble(spec: &VehicleSpec, mesh: Mesh, translation: Vec3) -> Result<Vehicle, BuildError> {
    let bounds = mesh.bounds().ok_or(LeakError::Empty)?;
    let [length, width, height] = spec.dimensions_m.unwrap_or(bounds.extent().into());
    let dimensions = Dimensions { length, width, height };
    let z0 = spec.z0_m.unwrap_or(bounds.min.z);
    let hull = Hull { face_surface: assign(spec, &mesh)?, mesh };
    let surfaces = surfaces(spec, &hull)?;
    let partners = partners(spec, &hull, &surfaces)?;
    let inertia = spec.inertia_kg_m2.map_or_else(|| box_inertia(spec.mass_kg, &dimensions), rows);
    Ok(Vehicle {
        name: spec.name.clone(),
        dimensions,
        z0,
        mass: spec.mass_kg,
        inertia,
        center_of_mass: Vec3::from(spec.center_of_mass_m),
        body_from_stl: spec.body_from_stl,
        translation,
        symmetric_left_right: spec.symmetric_left_right,
        symmetric_front_rear: spec.symmetric_front_rear,
        contacts: spec.contact.iter().map(|c| contact(spec, c, &surfaces, z0)).collect::<Result<_, _>>()?,
        samples: sample_hull(&hull, &partners, z0)?,
        surfaces,
        hull,
    })
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
        SurfaceKind::Side | SurfaceKind::Wheel => Vec3::y() * 1f64.copysign(moments.centroid.y),
    })
}

/// The partners whose points may be mirrored, after the file's claims of symmetry have been checked.
fn partners(spec: &VehicleSpec, hull: &Hull, surfaces: &[Surface]) -> Result<Vec<Partners>, BuildError> {
    let moments: Vec<Option<Patch>> = (0..surfaces.len()).map(|s| hull.patch(s)).collect();
    let claim = |index: usize, partner: usize, axis: usize, flag: &'static str| {
        let mirrored = moments[index].zip(moments[partner]).is_some_and(|(a, b)| a.is_mirror_of(&b, axis));
        let (name, partner_name) = (surfaces[index].name.clone(), surfaces[partner].name.clone());
        if mirrored {
            Ok(partner)
        } else {
            Err(BuildError::NotMirrored { name, partner: partner_name, flag })
        }
    };
    let one = |(index, s): (usize, &Surface)| {
        let left_right = spec.symmetric_left_right.then_some(s.mirror_left_right);
        let front_rear = s.mirror_front_rear.filter(|_| spec.symmetric_front_rear);
        Ok(Partners {
            left_right: left_right.map(|p| claim(index, p, 1, "symmetric_left_right")).transpose()?,
            front_rear: front_rear.map(|p| claim(index, p, 0, "symmetric_front_rear")).transpose()?,
        })
    };
    surfaces.iter().enumerate().map(one).collect()
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
