//! Hydrostatic loads of the surfaces in the time of a query: `hydrostatics` with everything known beforehand summed up.
//!
//! The load of a wholly wet face is linear in the water plane, so the faces that lie below the waterline for sure enter
//! as one prefix sum; only faces that the surface may cross are clipped.

use nalgebra::Matrix3;

use super::hydrostatics::unit_load;
use super::immersion::wet_triangles;
use super::surfaces::Hull;
use crate::frame::{GRAVITY, Vec3, WaterPlane};
use crate::wrench::Wrench;

/// Room for rounding of a height [m].
const ROOM: f64 = 1e-9;

/// Sums over the faces of each surface; body frame.
#[derive(Debug, Clone)]
pub struct PressureTable {
    surfaces: Vec<SurfaceTable>,
}

/// Faces by rising top, so that the wet ones come first.
#[derive(Debug, Clone)]
struct SurfaceTable {
    faces: Vec<usize>,
    tops: Vec<f64>,
    bottoms: Vec<f64>,
    x_range: [f64; 2],
    y_range: [f64; 2],
    /// Over the first k faces.
    prefix: Vec<Terms>,
}

/// What the load of a wet face needs besides the plane `n . x = c`:
/// force `-(c S - T n)`, moment about the origin `-(c P - U n)`.
#[derive(Debug, Clone, Copy, Default)]
struct Terms {
    /// `S = sum A` of area vectors.
    area: Vec3,
    /// `T = sum A x^T` with the centroid x.
    first: Matrix3<f64>,
    /// `P = sum x cross A`.
    moment: Vec3,
    /// `U = -sum [A]x Q` with the mean Q of `x x^T` over the face.
    second: Matrix3<f64>,
}

impl PressureTable {
    /// Prepares the hull of a vehicle with `count` surfaces.
    pub fn new(hull: &Hull, count: usize) -> Self {
        Self { surfaces: (0..count).map(|s| SurfaceTable::new(hull, s)).collect() }
    }

    /// The pressure load on each surface about `about` [N, N m], as `surface_hydrostatics` gives it to rounding.
    ///
    /// `hull` is the one the table was made from; `out` has one entry a surface. No allocation.
    pub fn loads_into(
        &self,
        hull: &Hull,
        plane: &WaterPlane,
        density: f64,
        about: &Vec3,
        out: &mut [Wrench],
    ) {
        for (table, load) in self.surfaces.iter().zip(out) {
            let unit = table.unit_load(hull, plane);
            let factor = density * GRAVITY;
            let about_there = unit.moved(&Vec3::zeros(), about);
            *load = Wrench { force: about_there.force * factor, moment: about_there.moment * factor };
        }
    }
}

impl SurfaceTable {
    fn new(hull: &Hull, surface: usize) -> Self {
        let mesh = &hull.mesh;
        let corner_z = |f: usize| mesh.triangle(f).map(|p| p.z);
        let top = |f: usize| corner_z(f).into_iter().fold(f64::NEG_INFINITY, f64::max);
        let mut faces: Vec<usize> = hull.faces_of(surface).collect();
        faces.sort_by(|a, b| top(*a).total_cmp(&top(*b)));
        let mut prefix = vec![Terms::default()];
        let mut sum = Terms::default();
        for &face in &faces {
            sum.add(mesh.triangle(face));
            prefix.push(sum);
        }
        let range = |axis: usize| {
            let values = || faces.iter().flat_map(|f| mesh.triangle(*f)).map(|p| p[axis]);
            [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
        };
        Self {
            tops: faces.iter().map(|f| top(*f)).collect(),
            bottoms: faces.iter().map(|f| corner_z(*f).into_iter().fold(f64::INFINITY, f64::min)).collect(),
            x_range: range(0),
            y_range: range(1),
            prefix,
            faces,
        }
    }

    /// Load about the body origin in a fluid with `rho g = 1`.
    fn unit_load(&self, hull: &Hull, plane: &WaterPlane) -> Wrench {
        let (low, high) = self.waterline_heights(plane);
        let wet = self.tops.partition_point(|top| *top <= low);
        let mut load = self.prefix[wet].load(plane);
        for (face, bottom) in self.faces[wet..].iter().zip(&self.bottoms[wet..]) {
            if *bottom < high {
                for triangle in wet_triangles(&hull.mesh, *face, plane).iter() {
                    load += unit_load(triangle, &Vec3::zeros());
                }
            }
        }
        load
    }

    /// Heights between which the plane crosses this surface's footprint; all heights for a vehicle near its side.
    fn waterline_heights(&self, plane: &WaterPlane) -> (f64, f64) {
        let up = plane.normal;
        if up.z < 0.1 {
            return (f64::NEG_INFINITY, f64::INFINITY);
        }
        let across = |n: f64, range: [f64; 2]| range.map(|v| n * v);
        let ([x0, x1], [y0, y1]) = (across(up.x, self.x_range), across(up.y, self.y_range));
        let low = (plane.offset - x0.max(x1) - y0.max(y1)) / up.z;
        let high = (plane.offset - x0.min(x1) - y0.min(y1)) / up.z;
        (low - ROOM, high + ROOM)
    }
}

impl Terms {
    fn add(&mut self, [a, b, c]: [Vec3; 3]) {
        let area = (b - a).cross(&(c - a)) * 0.5;
        let centroid = (a + b + c) / 3.0;
        let midpoints = [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5];
        let spread = midpoints.iter().map(|m| m * m.transpose()).sum::<Matrix3<f64>>() / 3.0;
        self.area += area;
        self.first += area * centroid.transpose();
        self.moment += centroid.cross(&area);
        self.second -= area.cross_matrix() * spread;
    }

    fn load(&self, plane: &WaterPlane) -> Wrench {
        let (n, c) = (plane.normal.into_inner(), plane.offset);
        Wrench { force: self.first * n - self.area * c, moment: self.second * n - self.moment * c }
    }
}
