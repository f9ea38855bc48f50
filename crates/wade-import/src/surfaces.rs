//! A surface for every face: one a wheel and a track, and of the body bottom, front, rear, left and right.

use wade_core::geometry::mesh::Mesh;
use wade_core::vehicle::spec::PatchSpec;
use wade_core::vehicle::{MAX_SURFACES, SurfaceKind};

use crate::limits::LEVEL_DEGREES;
use crate::solid::Piece;
use crate::unite::United;
use crate::wheels::Wheel;

/// A hull with its surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct Assigned {
    /// Closed [m].
    pub mesh: Mesh,
    /// The surface of each face.
    pub face_surface: Vec<u16>,
    /// The surfaces.
    pub patches: Vec<PatchSpec>,
}

/// Surfaces of the body in the order of the answers.
const BODY: [(&str, SurfaceKind); 5] = [
    ("front", SurfaceKind::Front),
    ("rear", SurfaceKind::Rear),
    ("left", SurfaceKind::Side),
    ("right", SurfaceKind::Side),
    ("bottom", SurfaceKind::Bottom),
];

/// Gives every face a surface. Wheels beyond what a vehicle may have belong to the sides.
pub fn assign(united: &United, pieces: &[Piece], wheels: &[Wheel]) -> Assigned {
    let most = MAX_SURFACES - BODY.len();
    let middle = united.mesh.bounds().map_or(0.0, |bounds| bounds.center().y);
    let surface = |face: usize| {
        let wheel = pieces[united.face_piece[face]].wheel.filter(|wheel| *wheel < most);
        wheel.map_or_else(|| body_surface(&united.mesh, face, middle), |wheel| BODY.len() + wheel)
    };
    let all: Vec<usize> = (0..united.mesh.faces.len()).map(surface).collect();
    let mut area = vec![0.0; BODY.len() + wheels.len().min(most)];
    all.iter().enumerate().for_each(|(face, surface)| area[*surface] += united.mesh.area_vector(face).norm());
    // what is wholly inside another shape, or has no area, is no surface
    let total: f64 = area.iter().sum();
    let is_there = |surface: usize| area[surface] > 1e-9 * total;
    let kept: Vec<usize> = (0..area.len()).filter(|surface| is_there(*surface)).collect();
    let name = |surface: usize| match surface.checked_sub(BODY.len()) {
        None => BODY[surface].0.to_owned(),
        Some(wheel) => wheels[wheel].name.clone(),
    };
    let names: Vec<String> = kept.iter().map(|surface| name(*surface)).collect();
    let partner = |surface: usize, of: fn(&str) -> Option<String>| {
        of(&name(surface)).filter(|partner| names.contains(partner))
    };
    let patch = |&surface: &usize| PatchSpec {
        name: name(surface),
        kind: surface.checked_sub(BODY.len()).map_or_else(|| BODY[surface].1, |wheel| wheels[wheel].kind),
        left_right: partner(surface, left_right),
        front_rear: partner(surface, front_rear),
        normal: normal(surface, wheels),
        sprocket_radius_m: None,
    };
    let patches = kept.iter().map(patch).collect();
    // a face of a surface that is none goes to the first: it has no area
    let index = |surface: &usize| kept.iter().position(|kept| kept == surface).unwrap_or(0) as u16;
    Assigned { mesh: united.mesh.clone(), face_surface: all.iter().map(index).collect(), patches }
}

/// Index into `BODY`: the deck belongs to the sides, half and half.
fn body_surface(mesh: &Mesh, face: usize, middle: f64) -> usize {
    let normal = mesh.area_vector(face).try_normalize(0.0).unwrap_or_default();
    let level = LEVEL_DEGREES.to_radians().cos();
    let is_left = |y: f64| if y >= 0.0 { 2 } else { 3 };
    if normal.z < -level {
        4
    } else if normal.z > level {
        is_left(mesh.face_centroid(face).y - middle)
    } else if normal.x.abs() >= normal.y.abs() {
        if normal.x >= 0.0 { 0 } else { 1 }
    } else {
        is_left(normal.y)
    }
}

/// Stated where the mean of the faces would mislead: the deck folded into the sides, wheels and tracks.
fn normal(surface: usize, wheels: &[Wheel]) -> Option<[f64; 3]> {
    match surface {
        2 => Some([0.0, 1.0, 0.0]),
        3 => Some([0.0, -1.0, 0.0]),
        0 | 1 | 4 => None,
        _ => {
            let wheel = &wheels[surface - BODY.len()];
            Some((wheel.axis * if wheel.is_left { 1.0 } else { -1.0 }).into())
        }
    }
}

/// Name of the counterpart on the other side.
fn left_right(name: &str) -> Option<String> {
    let swapped = match name {
        "left" => "right".to_owned(),
        "right" => "left".to_owned(),
        "track_left" => "track_right".to_owned(),
        "track_right" => "track_left".to_owned(),
        "wheel_fl" => "wheel_fr".to_owned(),
        "wheel_fr" => "wheel_fl".to_owned(),
        "wheel_rl" => "wheel_rr".to_owned(),
        "wheel_rr" => "wheel_rl".to_owned(),
        other if other.starts_with("wheel_left") => other.replace("left", "right"),
        other if other.starts_with("wheel_right") => other.replace("right", "left"),
        other => other.to_owned(),
    };
    Some(swapped)
}

/// Name of the counterpart at the other end.
fn front_rear(name: &str) -> Option<String> {
    let swapped = match name {
        "front" => "rear",
        "rear" => "front",
        "wheel_fl" => "wheel_rl",
        "wheel_fr" => "wheel_rr",
        "wheel_rl" => "wheel_fl",
        "wheel_rr" => "wheel_fr",
        "left" | "right" | "bottom" | "track_left" | "track_right" => name,
        _ => return None,
    };
    Some(swapped.to_owned())
}
