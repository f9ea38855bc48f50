//! The one place that talks to parry, which uses glam where we use nalgebra.

use parry3d_f64::math::Vector;
use parry3d_f64::query::{PointQuery, Ray, RayCast};
use parry3d_f64::shape::{TriMesh, TriMeshFlags};
use parry3d_f64::transformation::try_convex_hull;

use super::mesh::Mesh;
use crate::frame::Vec3;

fn to_parry(p: &Vec3) -> Vector {
    Vector::new(p.x, p.y, p.z)
}

fn from_parry(p: &Vector) -> Vec3 {
    Vec3::new(p.x, p.y, p.z)
}

/// A mesh prepared for distance and ray queries.
pub(crate) struct Solid(TriMesh);

impl Solid {
    /// `None` for a mesh without faces.
    pub(crate) fn new(mesh: &Mesh) -> Option<Self> {
        let vertices = mesh.vertices.iter().map(to_parry).collect();
        // without ORIENTED parry answers unsigned distances and says nothing
        TriMesh::with_flags(vertices, mesh.faces.clone(), TriMeshFlags::ORIENTED).ok().map(Self)
    }

    /// Distance to the faces [m], negative inside.
    pub(crate) fn signed_distance(&self, point: &Vec3) -> f64 {
        self.0.distance_to_local_point(to_parry(point), false)
    }

    /// The first crossing between two points as a share of the way from `from` to `to`.
    pub(crate) fn first_hit(&self, from: &Vec3, to: &Vec3) -> Option<f64> {
        let ray = Ray::new(to_parry(from), to_parry(&(to - from)));
        self.0.cast_local_ray(&ray, 1.0, false)
    }
}

/// A hull with less than this share of the cube of its diagonal is flat.
const FLAT_SHARE: f64 = 1e-9;

/// The convex hull of the points, faces outward; `None` when they lie in a plane.
pub(crate) fn convex_hull(points: &[Vec3]) -> Option<Mesh> {
    let points: Vec<Vector> = points.iter().map(to_parry).collect();
    let (vertices, faces) = try_convex_hull(&points).ok()?;
    let hull = Mesh { vertices: vertices.iter().map(from_parry).collect(), faces };
    // of points in a plane parry makes a sheet with two sides
    let diagonal = hull.bounds()?.extent().norm();
    (hull.volume() > FLAT_SHARE * diagonal.powi(3)).then_some(hull)
}
