//! Hydrostatic pressure integrated exactly over the wet part of a hull.

use nalgebra::Unit;

use super::immersion::{WetTriangle, depth_moments, wet_triangles};
use super::mesh::Mesh;
use super::surfaces::Hull;
use crate::condition::FRESH_WATER;
use crate::frame::{GRAVITY, Vec3, WaterPlane};
use crate::wrench::Wrench;

/// Buoyancy of a closed hull; frame of the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Hydrostatics {
    /// Force and moment of the pressure about the point asked for [N, N m].
    pub wrench: Wrench,
    /// Volume under the water plane [m3].
    pub displaced_volume: f64,
    /// Centroid of the displaced volume [m]; `None` when dry.
    pub center_of_buoyancy: Option<Vec3>,
    /// Area of the hull under water [m2].
    pub wetted_area: f64,
    /// Area that the hull cuts out of the water surface [m2].
    pub waterplane_area: f64,
}

/// Pressure load and displaced volume of a closed hull for any attitude of the water plane.
///
/// `dF = -rho g delta n dA` with depth `delta` (Archimedes; Newman, Marine Hydrodynamics, section 2.17). Depth is
/// linear and its moment quadratic over a triangle, for which the three edge midpoints are exact. The cut at the
/// surface needs no lid: pressure is zero there. Density and gravity multiply last, so loads are linear in density.
pub fn hydrostatics(mesh: &Mesh, plane: &WaterPlane, density: f64, about: &Vec3) -> Hydrostatics {
    let mut sums = Sums::default();
    for face in 0..mesh.faces.len() {
        wet_triangles(mesh, face, plane).iter().for_each(|t| sums.add(t, about));
    }
    sums.finish(plane, density, about)
}

/// Depth at which a level hull of `mass` [kg] floats in fresh water [m]; the height of the hull where it sinks.
pub fn float_depth(mesh: &Mesh, z0: f64, mass: f64) -> f64 {
    let top = mesh.bounds().map_or(z0, |bounds| bounds.max.z);
    depth_that_carries(mesh, mass, top - z0, |depth| WaterPlane::level(z0, depth))
}

/// Water plane across `up` on which a hull of `mass` [kg] floats in fresh water; over its highest corner where it sinks.
pub fn float_plane(mesh: &Mesh, up: Unit<Vec3>, mass: f64) -> WaterPlane {
    let heights = || mesh.vertices.iter().map(|vertex| up.dot(vertex));
    let (lowest, highest) =
        (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    let plane = |depth: f64| WaterPlane { normal: up, offset: lowest + depth };
    plane(depth_that_carries(mesh, mass, highest - lowest, plane))
}

fn depth_that_carries(mesh: &Mesh, mass: f64, most: f64, plane: impl Fn(f64) -> WaterPlane) -> f64 {
    let (mut sinks, mut floats) = (0.0, most);
    // the displaced volume grows with depth: bisection to a micrometer, or as far as numbers go
    while floats - sinks > 1e-6 {
        let depth = 0.5 * (sinks + floats);
        if depth <= sinks || depth >= floats {
            break;
        }
        let displaced = hydrostatics(mesh, &plane(depth), FRESH_WATER, &Vec3::zeros()).displaced_volume;
        if displaced * FRESH_WATER < mass { sinks = depth } else { floats = depth }
    }
    floats
}

/// The pressure load on each surface about `about` [N, N m], in the order of the surfaces.
pub fn surface_hydrostatics(
    hull: &Hull,
    count: usize,
    plane: &WaterPlane,
    density: f64,
    about: &Vec3,
) -> Vec<Wrench> {
    let mut wrenches = vec![Wrench::default(); count];
    surface_hydrostatics_into(hull, plane, density, about, &mut wrenches);
    wrenches
}

/// As `surface_hydrostatics`, into a slice with one entry a surface and without allocation.
pub fn surface_hydrostatics_into(
    hull: &Hull,
    plane: &WaterPlane,
    density: f64,
    about: &Vec3,
    out: &mut [Wrench],
) {
    out.fill(Wrench::default());
    for (face, &surface) in hull.face_surface.iter().enumerate() {
        for triangle in wet_triangles(&hull.mesh, face, plane).iter() {
            out[surface as usize] += unit_load(triangle, about);
        }
    }
    out.iter_mut().for_each(|w| *w = scaled(*w, density * GRAVITY));
}

/// Load of a fluid with `rho g = 1` on one triangle: `-int delta n dA` [m3] and its moment [m4].
fn unit_load(triangle: &WetTriangle, about: &Vec3) -> Wrench {
    let area = triangle.area_vector();
    let (depth, moment) = depth_moments([0, 1, 2].map(|i| (triangle.vertices[i], triangle.depths[i])));
    let first_moment = moment / 12.0 - about * (depth / 3.0);
    Wrench { force: -area * (depth / 3.0), moment: -first_moment.cross(&area) }
}

fn scaled(unit: Wrench, factor: f64) -> Wrench {
    Wrench { force: unit.force * factor, moment: unit.moment * factor }
}

#[derive(Default)]
struct Sums {
    load: Wrench,
    area: f64,
    area_vector: Vec3,
    /// `int delta^2 / 2 n dA`: its component along the plane normal is the first moment of depth over the volume.
    depth_moment: Vec3,
}

impl Sums {
    fn add(&mut self, triangle: &WetTriangle, about: &Vec3) {
        let area = triangle.area_vector();
        self.load += unit_load(triangle, about);
        self.area += area.norm();
        self.area_vector += area;
        self.depth_moment += area * (triangle.edge_midpoints().iter().map(|(_, d)| d * d).sum::<f64>() / 6.0);
    }

    fn finish(self, plane: &WaterPlane, density: f64, about: &Vec3) -> Hydrostatics {
        let up = plane.normal.into_inner();
        let volume = self.load.force.dot(&up);
        Hydrostatics {
            wrench: scaled(self.load, density * GRAVITY),
            displaced_volume: volume,
            center_of_buoyancy: (volume > 0.0).then(|| self.centroid(plane, volume, about)),
            wetted_area: self.area,
            waterplane_area: -self.area_vector.dot(&up),
        }
    }

    /// Across the plane normal from the moment `r x V up`, along it from `int delta dV = -int delta^2 / 2 up.n dA`.
    fn centroid(&self, plane: &WaterPlane, volume: f64, about: &Vec3) -> Vec3 {
        let up = plane.normal.into_inner();
        let across = about + up.cross(&self.load.moment) / volume;
        let mean_depth = -self.depth_moment.dot(&up) / volume;
        across + up * (plane.offset - mean_depth - up.dot(&across))
    }
}
