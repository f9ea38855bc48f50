//! Points on the surfaces of a hull, spread by area, the same for the same mesh.

use super::submergence::{Samples, SamplesError};
use super::surfaces::Hull;
use crate::frame::Vec3;

/// Points aimed at over the whole hull.
pub const TOTAL: usize = 4096;

/// Fewest points a surface.
pub const MINIMUM: usize = 64;

/// Mirror partner of a surface across each plane of symmetry: itself, another, or none where the hull has no such
/// symmetry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Partners {
    /// Across the plane y = 0.
    pub left_right: Option<usize>,
    /// Across the plane x = 0.
    pub front_rear: Option<usize>,
}

/// A point and its outward normal, rounded to what a bundle stores.
type Sample = ([f32; 3], [f32; 3]);

/// Area-proportional samples of every surface, without those below the ground-contact plane `z = floor` [m].
///
/// The source paper draws at random. Here equal steps of area choose the face and a low-discrepancy sequence the place
/// in it (Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018), so equal meshes give equal points;
/// mirror images get mirrored points, so a mirrored state has mirrored features bit for bit.
pub fn sample_hull(hull: &Hull, partners: &[Partners], floor: f64) -> Result<Samples, SamplesError> {
    let total: f64 = hull.mesh.area();
    let mut sets: Vec<Option<Vec<Sample>>> = vec![None; partners.len()];
    for surface in 0..partners.len() {
        if sets[surface].is_some() {
            continue;
        }
        let faces: Vec<usize> = hull.faces_of(surface).collect();
        let area: f64 = faces.iter().map(|f| hull.mesh.area_vector(*f).norm()).sum();
        let count = ((TOTAL as f64 * area / total).round() as usize).max(MINIMUM);
        let set =
            symmetrized(surface, partners[surface], |share| draw(hull, &faces, area, count.div_ceil(share)));
        spread(&mut sets, partners, surface, set);
    }
    assemble(sets, floor)
}

/// Half or a quarter of the points and their images, for a surface that is its own mirror image.
fn symmetrized(surface: usize, partners: Partners, draw: impl Fn(usize) -> Vec<Sample>) -> Vec<Sample> {
    let own: Vec<usize> = [(partners.front_rear, 0), (partners.left_right, 1)]
        .into_iter()
        .filter(|(partner, _)| *partner == Some(surface))
        .map(|(_, axis)| axis)
        .collect();
    own.iter().fold(draw(1 << own.len()), |mut set, axis| {
        set.extend_from_within(..);
        let half = set.len() / 2;
        set[half..].iter_mut().for_each(|s| *s = mirrored(*s, *axis));
        set
    })
}

/// Gives the set to the surface and its images to the partners that have none, and to theirs.
fn spread(sets: &mut [Option<Vec<Sample>>], partners: &[Partners], surface: usize, set: Vec<Sample>) {
    let mut open = vec![(surface, set)];
    while let Some((surface, set)) = open.pop() {
        for (partner, axis) in [(partners[surface].front_rear, 0), (partners[surface].left_right, 1)] {
            if let Some(partner) = partner.filter(|p| *p != surface && sets[*p].is_none()) {
                open.push((partner, set.iter().map(|s| mirrored(*s, axis)).collect()));
            }
        }
        sets[surface].get_or_insert(set);
    }
}

fn mirrored((mut point, mut normal): Sample, axis: usize) -> Sample {
    point[axis] = -point[axis];
    normal[axis] = -normal[axis];
    (point, normal)
}

/// `count` points at equal steps of area over the faces.
fn draw(hull: &Hull, faces: &[usize], area: f64, count: usize) -> Vec<Sample> {
    let mut samples = Vec::with_capacity(count);
    let mut below = 0.0;
    for &face in faces {
        let vector = hull.mesh.area_vector(face);
        let upto = below + vector.norm();
        while samples.len() < count && (samples.len() as f64 + 0.5) * area / (count as f64) < upto {
            let point = place(hull.mesh.triangle(face), samples.len());
            samples.push((rounded(&point), rounded(&vector.normalize())));
        }
        below = upto;
    }
    samples
}

/// The `index`-th point of the R2 sequence, folded into the triangle.
fn place([a, b, c]: [Vec3; 3], index: usize) -> Vec3 {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let n = index as f64;
    let (mut u, mut v) = ((0.5 + n / PLASTIC).fract(), (0.5 + n / (PLASTIC * PLASTIC)).fract());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    a + (b - a) * u + (c - a) * v
}

fn rounded(v: &Vec3) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

fn assemble(sets: Vec<Option<Vec<Sample>>>, floor: f64) -> Result<Samples, SamplesError> {
    let (mut points, mut normals, mut offsets) = (Vec::new(), Vec::new(), vec![0]);
    for mut set in sets.into_iter().map(Option::unwrap_or_default) {
        // a hair of room: a wheel touches the floor and f32 rounds either way
        set.retain(|(p, _)| f64::from(p[2]) >= floor - 1e-6);
        set.sort_by(|(a, _), (b, _)| a[2].total_cmp(&b[2]));
        points.extend(set.iter().map(|s| s.0));
        normals.extend(set.iter().map(|s| s.1));
        offsets.push(points.len());
    }
    Samples::from_parts(&points, &normals, &offsets)
}
