//! Closed parts by formula: boxes, stacked tapered boxes, and solids of revolution about a lateral axis.

use std::f64::consts::TAU;

use super::mesh::{Bounds, Mesh};
use crate::frame::Vec3;

/// A rectangular cross-section at a height [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Height.
    pub z: f64,
    /// Rear and front end.
    pub x: [f64; 2],
    /// Right and left side.
    pub y: [f64; 2],
}

/// A box.
pub fn cuboid(bounds: &Bounds) -> Mesh {
    let Bounds { min, max } = bounds;
    let section = |z| Section { z, x: [min.x, max.x], y: [min.y, max.y] };
    let center = bounds.center();
    loft(&[section(min.z), section(max.z)], [center.x, center.y])
}

/// A body through rectangular sections of rising z, straight between neighbours; one section or none gives nothing.
///
/// Every face is also cut by the planes `x = split[0]` and `y = split[1]`, which must lie inside all sections, so that
/// patches can meet there and a symmetric body keeps a symmetric mesh.
pub fn loft(sections: &[Section], split: [f64; 2]) -> Mesh {
    let (Some(bottom), Some(top)) = (sections.first(), sections.last()) else {
        return Mesh::default();
    };
    let mut mesh = Mesh::default();
    sections.iter().for_each(|s| mesh.vertices.extend(ring(s, split)));
    for lower in 0..sections.len() as u32 - 1 {
        for i in 0..8 {
            let (a, b) = (8 * lower + i, 8 * lower + (i + 1) % 8);
            quad(&mut mesh, [a, b, b + 8, a + 8]);
        }
    }
    cap(&mut mesh, bottom, split, 0, true);
    cap(&mut mesh, top, split, 8 * (sections.len() as u32 - 1), false);
    mesh
}

/// Corners and split points of a section, counter-clockwise seen from above.
fn ring(s: &Section, [mx, my]: [f64; 2]) -> [Vec3; 8] {
    let ([x0, x1], [y0, y1]) = (s.x, s.y);
    [(x1, y0), (x1, my), (x1, y1), (mx, y1), (x0, y1), (x0, my), (x0, y0), (mx, y0)]
        .map(|(x, y)| Vec3::new(x, y, s.z))
}

fn cap(mesh: &mut Mesh, section: &Section, split: [f64; 2], first: u32, down: bool) {
    let center = mesh.vertices.len() as u32;
    mesh.vertices.push(Vec3::new(split[0], split[1], section.z));
    for corner in [0, 2, 4, 6] {
        let [before, here, after] = [(corner + 7) % 8, corner, (corner + 1) % 8].map(|i| first + i);
        let corners = [before, here, after, center];
        quad(mesh, if down { [center, after, here, before] } else { corners });
    }
}

fn quad(mesh: &mut Mesh, [a, b, c, d]: [u32; 4]) {
    mesh.faces.extend([[a, b, c], [a, c, d]]);
}

/// A solid of revolution about the lateral axis through `center`, from a profile of `(y, radius)` by rising y.
///
/// The profile has three points or more; the first and last radius must be zero. One vertex of each ring is lowest, so a wheel touches `center.z - radius`;
/// the polygon is inscribed: with 64 facets its cross-section is 0.16 % too small.
pub fn revolve(center: &Vec3, profile: &[(f64, f64)], facets: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let flat = |i: usize, j: usize| profile[i].0 == profile[j].0;
    let (flat_start, flat_end) = (flat(0, 1), flat(profile.len() - 2, profile.len() - 1));
    let rim = &profile[usize::from(flat_start)..profile.len() - usize::from(flat_end)];
    let rings: Vec<(u32, u32)> = rim.iter().map(|p| add_ring(&mut mesh, center, *p, facets)).collect();
    if let (true, Some(&(first, _))) = (flat_start, rings.first()) {
        strips(&mut mesh, first, facets, true);
    }
    if let (true, Some(&(first, _))) = (flat_end, rings.last()) {
        strips(&mut mesh, first, facets, false);
    }
    for pair in rings.windows(2) {
        let ((a, na), (b, nb)) = (pair[0], pair[1]);
        for i in 0..facets {
            let j = (i + 1) % facets;
            match (na, nb) {
                (1, 1) => {}
                (1, _) => mesh.faces.push([a, b + i, b + j]),
                (_, 1) => mesh.faces.push([a + j, a + i, b]),
                _ => quad(&mut mesh, [a + i, b + i, b + j, a + j]),
            }
        }
    }
    mesh
}

/// A flat end in level strips: a waterline crosses two faces of it, where it would cross half of a fan.
fn strips(mesh: &mut Mesh, first: u32, facets: u32, right: bool) {
    for i in 1..facets - 1 {
        // down one side and up the other in turn: 1, n-1, 2, n-2, ...
        let at =
            |step: u32| first + if step % 2 == 1 { step.div_ceil(2) } else { (facets - step / 2) % facets };
        let (a, b, c) = (at(i - 1), at(i), at(i + 1));
        mesh.faces.push(if (i % 2 == 1) == right { [a, b, c] } else { [a, c, b] });
    }
}

/// First vertex of the ring and their number: a pole for radius zero.
fn add_ring(mesh: &mut Mesh, center: &Vec3, (y, radius): (f64, f64), facets: u32) -> (u32, u32) {
    let first = mesh.vertices.len() as u32;
    let count = if radius == 0.0 { 1 } else { facets };
    mesh.vertices.extend((0..count).map(|i| {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(facets)).sin_cos();
        center + Vec3::new(radius * sin, y, -radius * cos)
    }));
    (first, count)
}

/// A cylinder about the lateral axis.
pub fn cylinder(center: &Vec3, radius: f64, width: f64, facets: u32) -> Mesh {
    let half = 0.5 * width;
    revolve(center, &[(-half, 0.0), (-half, radius), (half, radius), (half, 0.0)], facets)
}

/// Sizes of a tire [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tire {
    /// Radius of the tread.
    pub radius: f64,
    /// Width of the tire.
    pub width: f64,
    /// Width of the tread.
    pub tread: f64,
    /// By how much the radius of the sides is smaller.
    pub shoulder: f64,
}

/// A tire: a cylinder whose tread of full radius is narrower than the tire, with conical shoulders.
pub fn tire(center: &Vec3, tire: Tire, facets: u32) -> Mesh {
    let Tire { radius, width, tread, shoulder } = tire;
    let (half, flat, edge) = (0.5 * width, 0.5 * tread, radius - shoulder);
    let profile = [(-half, 0.0), (-half, edge), (-flat, radius), (flat, radius), (half, edge), (half, 0.0)];
    revolve(center, &profile, facets)
}

/// A sphere of `facets` meridians and half as many parallels; inscribed.
pub fn sphere(center: &Vec3, radius: f64, facets: u32) -> Mesh {
    let bands = facets / 2;
    let profile: Vec<(f64, f64)> = (0..=bands)
        .map(|i| {
            let (sin, cos) = (0.5 * TAU * f64::from(i) / f64::from(bands)).sin_cos();
            (-radius * cos, if i == 0 || i == bands { 0.0 } else { radius * sin })
        })
        .collect();
    revolve(center, &profile, facets)
}
