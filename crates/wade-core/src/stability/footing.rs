//! What a vehicle stands on: the places that bear its weight, the edges over which it can topple, and its axles.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::frame::Vec3;
use crate::vehicle::Vehicle;

/// How high over the ground-contact plane a wheel may end and still bear weight [m]: what a tire gives way under its load.
const GIVE: f64 = 0.01;

/// What makes the equations of feet in one line solvable, as a share of their size: it moves the forces by about as much.
const SOFT: f64 = 1e-11;

/// Length below which an edge or a wheelbase is none [m].
const NO_LENGTH: f64 = 1e-6;

/// A place that bears weight, in the ground-contact plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Index of the surface that stands there.
    pub surface: usize,
    /// x and y in the body frame [m].
    pub at: Vector2<f64>,
}

/// An edge of the area between the feet, counterclockwise seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Edge {
    /// Where it begins [m].
    pub(super) from: Vector2<f64>,
    /// Unit vector along it.
    pub(super) along: Vector2<f64>,
}

impl Edge {
    /// How far a point lies inside [m].
    pub(super) fn inside(&self, point: &Vector2<f64>) -> f64 {
        self.along.perp(&(point - self.from))
    }
}

/// Front and rear feet taken together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axles {
    /// Mean x of the front feet, and of the rear ones [m].
    pub(super) x: [f64; 2],
    /// Mean y of all [m].
    pub(super) y: f64,
}

impl Axles {
    /// Distance between them [m].
    pub(super) fn wheelbase(&self) -> f64 {
        self.x[0] - self.x[1]
    }
}

/// What a vehicle stands on.
#[derive(Debug, Clone, PartialEq)]
pub struct Footing {
    feet: Vec<Foot>,
    pub(super) edges: Vec<Edge>,
    /// None of what has no wheels or tracks, or has them all in one line across.
    pub(super) axles: Option<Axles>,
}

impl Footing {
    /// Of a vehicle: the contact patches of its tires where its file states them; else each wheel that reaches down to the
    /// ground-contact plane, and the two ends of the run of each track; of one without either the corners of what lies on the
    /// ground.
    pub fn of(vehicle: &Vehicle) -> Self {
        let contacts = vehicle.contacts.iter();
        let mut feet: Vec<Foot> =
            contacts.map(|patch| Foot { surface: patch.surface, at: patch.center.xy() }).collect();
        if feet.is_empty() {
            feet = vehicle.wheels().into_iter().flat_map(|surface| run(vehicle, surface)).collect();
        }
        let has_wheels = !feet.is_empty();
        let corners = if has_wheels { Vec::new() } else { lowest(vehicle, None) };
        let surface = |at: Vector2<f64>| Foot { surface: surface_at(vehicle, &at), at };
        let outline = outline(if has_wheels { feet.iter().map(|foot| foot.at).collect() } else { corners });
        if !has_wheels {
            feet = outline.iter().copied().map(surface).collect();
        }
        Self { axles: axles(&feet).filter(|_| has_wheels), edges: edges(&outline), feet }
    }

    /// The places that bear weight.
    pub fn feet(&self) -> &[Foot] {
        &self.feet
    }

    /// Normal forces on the feet [N] that together are `normal` and act at `center`, or at the place between the feet nearest to it.
    pub(super) fn normal_forces(&self, normal: f64, center: &Vector2<f64>) -> Vec<f64> {
        let mut forces = vec![0.0; self.feet.len()];
        if normal <= 0.0 {
            return forces;
        }
        let center = self.nearest(center);
        let row = |foot: usize| Vector3::new(1.0, self.feet[foot].at.x, self.feet[foot].at.y);
        let sum = Vector3::new(1.0, center.x, center.y) * normal;
        let mut bearing: Vec<usize> = (0..self.feet.len()).collect();
        while !bearing.is_empty() {
            // of the forces that are in balance those with the least sum of squares are those of equal springs
            let squares: Matrix3<f64> = bearing.iter().map(|&foot| row(foot) * row(foot).transpose()).sum();
            let stiff = squares + Matrix3::identity() * (SOFT * squares.trace());
            let Some(multipliers) = stiff.try_inverse().map(|inverse| inverse * sum) else { break };
            let force = |foot: usize| row(foot).dot(&multipliers);
            let lifted = bearing.iter().copied().min_by(|&a, &b| force(a).total_cmp(&force(b)));
            match lifted.filter(|&foot| force(foot) < -1e-9 * normal) {
                Some(foot) => bearing.retain(|&other| other != foot),
                None => {
                    bearing.iter().for_each(|&foot| forces[foot] = force(foot).max(0.0));
                    break;
                }
            }
        }
        forces
    }

    /// The point of the area between the feet that is nearest to this one.
    fn nearest(&self, point: &Vector2<f64>) -> Vector2<f64> {
        if !self.edges.is_empty() && self.edges.iter().all(|edge| edge.inside(point) >= 0.0) {
            return *point;
        }
        let ends = |i: usize| [self.edges[i].from, self.edges[(i + 1) % self.edges.len()].from];
        let on_edge = |i: usize| {
            let [from, to] = ends(i);
            let share = ((point - from).dot(&self.edges[i].along)).clamp(0.0, (to - from).norm());
            from + self.edges[i].along * share
        };
        let near = |a: &Vector2<f64>, b: &Vector2<f64>| (a - point).norm().total_cmp(&(b - point).norm());
        let corners = self.feet.iter().map(|foot| foot.at);
        (0..self.edges.len()).map(on_edge).chain(corners).min_by(near).unwrap_or(*point)
    }
}

/// Where a wheel stands, and the two ends of the run of a track; none of one that does not reach the ground.
fn run(vehicle: &Vehicle, surface: usize) -> Vec<Foot> {
    let lowest = lowest(vehicle, Some(surface));
    let Some(bounds) = vehicle.hull.bounds_of(surface).filter(|_| !lowest.is_empty()) else {
        return Vec::new();
    };
    let y = bounds.center().y;
    let foot = |x: f64| Foot { surface, at: Vector2::new(x, y) };
    if vehicle.surfaces[surface].sprocket_radius.is_none() {
        return vec![foot(bounds.center().x)];
    }
    let ends = |(rear, front): (f64, f64), at: &Vector2<f64>| (rear.min(at.x), front.max(at.x));
    let (rear, front) = lowest.iter().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    vec![foot(front), foot(rear)]
}

/// Corners of the hull, or of one surface of it, that lie on the ground.
fn lowest(vehicle: &Vehicle, surface: Option<usize>) -> Vec<Vector2<f64>> {
    let mesh = &vehicle.hull.mesh;
    let faces = vehicle.hull.face_surface.iter().enumerate();
    let of_surface = faces.filter(|(_, of)| surface.is_none_or(|surface| surface == usize::from(**of)));
    let corners =
        of_surface.flat_map(|(face, _)| mesh.faces[face]).map(|corner| mesh.vertices[corner as usize]);
    corners.filter(|corner| corner.z <= vehicle.z0 + GIVE).map(|corner| corner.xy()).collect()
}

/// The surface of a face that has its corner here, on the ground.
fn surface_at(vehicle: &Vehicle, at: &Vector2<f64>) -> usize {
    let mesh = &vehicle.hull.mesh;
    let is_here = |corner: &Vec3| corner.z <= vehicle.z0 + GIVE && (corner.xy() - at).norm() < NO_LENGTH;
    let has_corner = |face: &[u32; 3]| face.iter().any(|&corner| is_here(&mesh.vertices[corner as usize]));
    let face = mesh.faces.iter().position(has_corner);
    face.map_or(0, |face| vehicle.hull.face_surface[face].into())
}

/// The convex outline of points, counterclockwise, without points on its edges (Andrew's monotone chain).
fn outline(mut points: Vec<Vector2<f64>>) -> Vec<Vector2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup_by(|a, b| (*a - *b).norm() < NO_LENGTH);
    let half = |points: &mut dyn Iterator<Item = Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for point in points {
            while let [.., before, last] = chain[..]
                && (last - before).perp(&(point - last)) <= NO_LENGTH * NO_LENGTH
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    if points.len() < 3 {
        return points;
    }
    let lower = half(&mut points.iter().copied());
    let upper = half(&mut points.iter().rev().copied());
    [lower, upper].concat()
}

/// The edges of an outline; of two points the line between them, there and back.
fn edges(outline: &[Vector2<f64>]) -> Vec<Edge> {
    let next = |i: usize| outline[(i + 1) % outline.len()];
    let edge = |(i, &from): (usize, &Vector2<f64>)| {
        (next(i) - from).try_normalize(NO_LENGTH).map(|along| Edge { from, along })
    };
    outline.iter().enumerate().filter_map(edge).collect()
}

/// Feet ahead of the middle taken together, and those behind it.
fn axles(feet: &[Foot]) -> Option<Axles> {
    let xs = || feet.iter().map(|foot| foot.at.x);
    let middle = 0.5 * (xs().fold(f64::INFINITY, f64::min) + xs().fold(f64::NEG_INFINITY, f64::max));
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        sum / count
    };
    let front = mean(&mut xs().filter(|x| *x > middle));
    let rear = mean(&mut xs().filter(|x| *x < middle));
    let axles = Axles { x: [front, rear], y: mean(&mut feet.iter().map(|foot| foot.at.y)) };
    Some(axles).filter(|axles| axles.wheelbase() > NO_LENGTH)
}
