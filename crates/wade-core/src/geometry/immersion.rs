//! Clipping a hull at the water plane, face by face.

use super::mesh::Mesh;
use crate::frame::{Vec3, WaterPlane};

/// A triangle that lies wholly under water, wound as the face it was cut from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WetTriangle {
    /// Corners [m], frame of the mesh.
    pub vertices: [Vec3; 3],
    /// Depth of each corner below the surface [m], never negative.
    pub depths: [f64; 3],
}

impl WetTriangle {
    /// Outward normal times area [m2].
    pub fn area_vector(&self) -> Vec3 {
        let [a, b, c] = self.vertices;
        (b - a).cross(&(c - a)) * 0.5
    }

    /// Midpoints of the three edges with their depths [m]: with equal weights they integrate a quadratic exactly.
    pub fn edge_midpoints(&self) -> [(Vec3, f64); 3] {
        [(0, 1), (1, 2), (2, 0)].map(|(i, j)| {
            ((self.vertices[i] + self.vertices[j]) * 0.5, (self.depths[i] + self.depths[j]) * 0.5)
        })
    }
}

/// The wet part of one face: none, one or two triangles.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WetTriangles {
    triangles: [WetTriangle; 2],
    count: usize,
}

impl std::ops::Deref for WetTriangles {
    type Target = [WetTriangle];
    fn deref(&self) -> &[WetTriangle] {
        &self.triangles[..self.count]
    }
}

/// The part of a face below the water plane; both in the same frame.
#[inline]
pub fn wet_triangles(mesh: &Mesh, face: usize, plane: &WaterPlane) -> WetTriangles {
    clip(mesh.triangle(face), plane)
}

/// The part of a triangle below the water plane; both in the same frame.
#[inline]
pub fn clip(corners: [Vec3; 3], plane: &WaterPlane) -> WetTriangles {
    let depths = corners.map(|p| plane.depth_below(&p));
    let wet = depths.map(|d| d > 0.0);
    match wet.iter().map(|w| usize::from(*w)).sum::<usize>() {
        0 => WetTriangles::default(),
        3 => one(WetTriangle { vertices: corners, depths }),
        1 => {
            let [a, b, c] = starting_at(wet.iter().position(|w| *w), corners, depths);
            one(triangle(a, cut(a, b).0, cut(a, c).0))
        }
        _ => {
            let [a, b, c] = starting_at(wet.iter().position(|w| !*w), corners, depths);
            let (ab, ca) = (cut(b, a).0, cut(c, a).0);
            WetTriangles { triangles: [triangle(ab, b, c), triangle(ab, c, ca)], count: 2 }
        }
    }
}

/// A place and its depth.
type Corner = (Vec3, f64);

fn one(triangle: WetTriangle) -> WetTriangles {
    WetTriangles { triangles: [triangle, WetTriangle::default()], count: 1 }
}

fn triangle(a: Corner, b: Corner, c: Corner) -> WetTriangle {
    WetTriangle { vertices: [a.0, b.0, c.0], depths: [a.1, b.1, c.1] }
}

fn starting_at(first: Option<usize>, p: [Vec3; 3], d: [f64; 3]) -> [Corner; 3] {
    let i = first.unwrap_or(0);
    [i, (i + 1) % 3, (i + 2) % 3].map(|k| (p[k], d[k]))
}

/// Where an edge from a wet to a dry corner meets the surface, and which share of it is wet; always computed from the wet
/// end, so that the two faces of an edge agree on the point.
fn cut((wet, depth): Corner, (dry, height): Corner) -> (Corner, f64) {
    let share = depth / (depth - height);
    ((wet + (dry - wet) * share, 0.0), share)
}

/// Sums over a wet triangle by which it weighs the depth: `int delta dA = A / 3` of the first, `int delta x dA = A / 12` of the
/// second. The three edge midpoints, which are exact, collected by corner.
#[inline(always)]
pub(super) fn depth_moments([(a, da), (b, db), (c, dc)]: [Corner; 3]) -> (f64, Vec3) {
    let sum = da + db + dc;
    (sum, a * (sum + da) + b * (sum + db) + c * (sum + dc))
}
