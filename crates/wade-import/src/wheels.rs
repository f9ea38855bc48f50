//! Which shapes are wheels: by their joints, or in plain meshes by their form.

use std::f64::consts::TAU;

use wade_core::frame::Vec3;
use wade_core::geometry::mesh::Bounds;
use wade_core::vehicle::{SurfaceKind, by_axle};

use crate::at;
use crate::limits::{
    LEAST_ROUNDNESS, LEAST_ROUNDNESS_UNNAMED, WHEEL_AXIS_DEGREES, WHEEL_GROUND_SHARE, WHEEL_SECTORS,
};
use crate::scene::{Joint, Scene};
use crate::solid::Piece;
use crate::tracks;

/// A wheel or a track of the vehicle; body axes, origin of the files.
#[derive(Debug, Clone, PartialEq)]
pub struct Wheel {
    /// Name of its surface.
    pub name: String,
    /// Wheel or track.
    pub kind: SurfaceKind,
    /// The link or part that it was.
    pub source: String,
    /// Unit vector along its axle, to the left.
    pub axis: Vec3,
    /// Middle of the wheel on its axle, or of the track [m].
    pub center: Vec3,
    /// Largest radius of a wheel, half the height of a track [m].
    pub radius: f64,
    /// Width along the axle [m].
    pub width: f64,
    /// Length along x: the diameter of a wheel [m].
    pub length: f64,
    /// Smallest over largest radius around the axle; 1 for a cylinder, 0 for a track.
    pub roundness: f64,
    /// True on the left of the middle of the vehicle, or in it.
    pub is_left: bool,
}

/// Finds wheels and tracks, marks their pieces and orders them: wheels from the front, the left one first, and then the tracks.
pub fn find(
    scene: &Scene,
    pieces: &mut [Piece],
    notes: &mut Vec<String>,
    warnings: &mut Vec<String>,
) -> Vec<Wheel> {
    let has_joints = scene.links.iter().any(|link| link.joint != Joint::Fixed);
    let mut found = by_joints(scene, pieces, notes);
    if !has_joints && found.is_empty() {
        found = by_form(pieces);
        if !found.is_empty() {
            notes.push(format!(
                "{} parts are round about the lateral axis and stand on the ground: wheels",
                found.len()
            ));
        }
    }
    let tracks = tracks::find(scene, pieces, &mut found, notes);
    let places: Vec<(Vec3, f64)> = found.iter().map(|(wheel, _)| (wheel.center, wheel.radius)).collect();
    let mut found: Vec<_> = by_axle(&places).into_iter().map(|place| found[place].clone()).collect();
    let middle = Bounds::around(pieces.iter().flat_map(|piece| &piece.mesh.vertices));
    let middle = middle.map_or(0.0, |bounds| bounds.center().y);
    found.iter_mut().for_each(|(wheel, _)| wheel.is_left = wheel.center.y >= middle);
    let names = names(&found);
    found.iter_mut().zip(names).for_each(|((wheel, _), name)| wheel.name = name);
    found.extend(tracks);
    for (index, (wheel, members)) in found.iter().enumerate() {
        members.iter().for_each(|piece| pieces[*piece].wheel = Some(index));
        if wheel.kind == SurfaceKind::Track {
            notes.push(format!(
                "track `{}`: {}, length {:.4} m, height {:.4} m, width {:.4} m, center {}; radius of its sprocket taken as half the height",
                wheel.name,
                wheel.source,
                wheel.length,
                2.0 * wheel.radius,
                wheel.width,
                at(&wheel.center)
            ));
            continue;
        }
        if wheel.roundness < LEAST_ROUNDNESS {
            warnings.push(format!(
                "wheel `{}` ({}) is no cylinder: its radius about the axle through {} is {:.4} to {:.4} m",
                wheel.name,
                wheel.source,
                at(&wheel.center),
                wheel.roundness * wheel.radius,
                wheel.radius
            ));
        }
        notes.push(format!(
            "wheel `{}`: {}, radius {:.4} m, width {:.4} m, center {}",
            wheel.name,
            wheel.source,
            wheel.radius,
            wheel.width,
            at(&wheel.center)
        ));
    }
    if found.is_empty() {
        notes.push("no wheel found: every face belongs to the body".to_owned());
    }
    found.into_iter().map(|(wheel, _)| wheel).collect()
}

/// `wheel_fl` and so on for two pairs, else numbers from the front a side.
fn names(found: &[(Wheel, Vec<usize>)]) -> Vec<String> {
    let count = found.iter().filter(|(wheel, _)| wheel.is_left).count();
    let is_car = found.len() == 4 && count == 2;
    let (mut lefts, mut rights) = (0, 0);
    found
        .iter()
        .map(|(wheel, _)| {
            let (side, number) = if wheel.is_left { ("left", &mut lefts) } else { ("right", &mut rights) };
            *number += 1;
            match is_car {
                true => format!("wheel_{}{}", if *number == 1 { "f" } else { "r" }, &side[..1]),
                false => format!("wheel_{side}_{number}"),
            }
        })
        .collect()
}

/// Links that turn without limits about a lateral axis, with what is fixed to them.
fn by_joints(scene: &Scene, pieces: &[Piece], notes: &mut Vec<String>) -> Vec<(Wheel, Vec<usize>)> {
    let least = WHEEL_AXIS_DEGREES.to_radians().cos();
    let mut found = Vec::new();
    for (index, link) in scene.links.iter().enumerate() {
        let Joint::Turning { name, axis, origin } = &link.joint else { continue };
        let members: Vec<usize> =
            (0..pieces.len()).filter(|piece| carrier(scene, pieces[*piece].link) == Some(index)).collect();
        if members.is_empty() {
            continue;
        }
        if axis.y.abs() < least {
            notes.push(format!(
                "joint `{name}` turns without limits about {}, which is not lateral: link `{}` is no wheel",
                direction(axis),
                link.name
            ));
            continue;
        }
        let axis = axis * axis.y.signum();
        found.push((measure(&link.name, axis, *origin, pieces, &members), members));
    }
    found
}

/// The link that turns and to which a link is fixed, itself or through others.
fn carrier(scene: &Scene, link: usize) -> Option<usize> {
    let mut at = link;
    loop {
        match scene.links[at].joint {
            Joint::Turning { .. } => return Some(at),
            // parents come first, so this ends
            Joint::Fixed => at = scene.links[at].parent?,
            Joint::Other => return None,
        }
    }
}

fn measure(source: &str, axis: Vec3, origin: Vec3, pieces: &[Piece], members: &[usize]) -> Wheel {
    let (u, v) = across(&axis);
    let mut sectors = [0.0_f64; WHEEL_SECTORS];
    let mut along = [f64::INFINITY, f64::NEG_INFINITY];
    for vertex in outline(pieces, members) {
        let arm = vertex - origin;
        let (x, y) = (arm.dot(&u), arm.dot(&v));
        let height = arm.dot(&axis);
        along = [along[0].min(height), along[1].max(height)];
        let sector = ((y.atan2(x) / TAU).rem_euclid(1.0) * WHEEL_SECTORS as f64) as usize;
        let radius = &mut sectors[sector.min(WHEEL_SECTORS - 1)];
        *radius = radius.max(x.hypot(y));
    }
    let radius = sectors.iter().copied().fold(0.0, f64::max);
    // a sector without a vertex is spanned by its neighbors
    let seen = sectors.iter().copied().filter(|radius| *radius > 0.0);
    let smallest = seen.fold(radius, f64::min);
    Wheel {
        name: String::new(),
        kind: SurfaceKind::Wheel,
        source: source.to_owned(),
        axis,
        center: origin + axis * (0.5 * (along[0] + along[1])),
        radius,
        width: along[1] - along[0],
        length: 2.0 * radius,
        roundness: if radius > 0.0 { smallest / radius } else { 0.0 },
        is_left: true,
    }
}

/// The corners and points along the edges, so that long edges fill their sectors.
fn outline(pieces: &[Piece], members: &[usize]) -> Vec<Vec3> {
    const STEPS: usize = 8;
    let mut points = Vec::new();
    for mesh in members.iter().map(|member| &pieces[*member].mesh) {
        points.extend(mesh.vertices.iter().copied());
        for &[a, b, c] in &mesh.faces {
            for (p, q) in [(a, b), (b, c), (c, a)].into_iter().filter(|(p, q)| p < q) {
                let (p, q) = (mesh.vertices[p as usize], mesh.vertices[q as usize]);
                points.extend((1..STEPS).map(|i| p + (q - p) * (i as f64 / STEPS as f64)));
            }
        }
    }
    points
}

fn across(axis: &Vec3) -> (Vec3, Vec3) {
    let u = axis.cross(&if axis.z.abs() < 0.9 { Vec3::z() } else { Vec3::x() }).normalize();
    (u, axis.cross(&u))
}

fn direction(axis: &Vec3) -> String {
    // a rounded zero has no sign
    let [x, y, z] = [axis.x, axis.y, axis.z].map(|c| (c * 100.0).round() / 100.0 + 0.0);
    format!("({x:.2}, {y:.2}, {z:.2})")
}

/// Number of parts that look like wheels in the axes of the body.
pub fn count_by_form(pieces: &[Piece]) -> usize {
    by_form(pieces).len()
}

/// Parts that are round about the lateral axis, narrower than high, and stand on the ground; two of them or more.
fn by_form(pieces: &[Piece]) -> Vec<(Wheel, Vec<usize>)> {
    let Some(whole) = Bounds::around(pieces.iter().flat_map(|piece| &piece.mesh.vertices)) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for (index, piece) in pieces.iter().enumerate() {
        let Some(bounds) = piece.mesh.bounds() else { continue };
        let extent = bounds.extent();
        let diameter = extent.z;
        let is_upright =
            (extent.x / diameter - 1.0).abs() < 1.0 - LEAST_ROUNDNESS_UNNAMED && extent.y < diameter;
        let stands = bounds.min.z - whole.min.z < WHEEL_GROUND_SHARE * diameter;
        if !(is_upright && stands) {
            continue;
        }
        let wheel = measure(&piece.source, Vec3::y(), bounds.center(), pieces, &[index]);
        if wheel.roundness >= LEAST_ROUNDNESS_UNNAMED {
            found.push((wheel, vec![index]));
        }
    }
    // one round part is a roller or the body itself
    if found.len() < 2 { Vec::new() } else { found }
}
