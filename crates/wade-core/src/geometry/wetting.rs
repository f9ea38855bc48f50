//! What the water reaches on each surface, exactly and in the time of a query: pressure load, wet area and where it is.
//!
//! The load of a wholly wet face is linear in the water plane, so a tree of boxes over the faces holds such terms for each box;
//! only faces in boxes that the surface crosses are clipped, some in lock step. On level water even that is known beforehand:
//! between two levels at which a vertex gets wet or soaked every quantity is a polynomial of the water level of degree four
//! at most, so each such interval stores one.
//!
//! The wet area steps where the water reaches a level face, and nothing that is felt does. So there is beside it the soaked
//! area, in which a place counts by its depth over the first centimeter: the mean of the wet areas of all water levels
//! from here to a centimeter lower.

use nalgebra::{Matrix3, SMatrix, UnitVector3, Vector3};

use super::flats::merged;
use super::mesh::Bounds;
use super::surfaces::Hull;
use crate::frame::{Vec3, WaterPlane};
use crate::lanes::{Instructions, run_for, sum};
use crate::real::{Dual, Real};
use crate::wrench::Wrench;

/// Intervals of level water that are stored for all surfaces together; a finer hull is clipped at every query.
const MOST_INTERVALS: usize = 40_000;
/// Heights closer than this are one [m]: a polynomial over less would be rounding.
const LEAST_INTERVAL: f64 = 1e-6;
/// Faces that are clipped in lock step.
const LANES: usize = 8;
const THIRD: f64 = 1.0 / 3.0;
const TWELFTH: f64 = 1.0 / 12.0;
/// Room for rounding of a length [m].
const ROOM: f64 = 1e-9;
/// Weights of a box's extent along the body's axes: a vehicle mostly stands within 10 degrees of upright, where a plane reaches
/// over 0.2 of a box's length.
const UPRIGHT: Vec3 = Vec3::new(0.2, 0.2, 1.0);
/// Faces of the smallest boxes, at most.
const LEAF: usize = 4;
/// Coefficients of a polynomial: degree four.
const TERMS: usize = 5;
/// Quantities of a surface: force, moment, wet area, soaked area and its first moment.
const QUANTITIES: usize = 11;
/// Depth at which a wet place counts as soaked [m].
const FILM: f64 = 0.01;

/// What the water reaches on one surface; body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wetting<T = f64> {
    /// Pressure load about the body origin in a fluid with `rho g = 1` [m3, m4].
    pub pressure: Wrench<T>,
    /// Wet area [m2]. It steps where the water reaches a level face.
    pub area: T,
    /// Integral of `min(depth / 1 cm, 1)` over the wet area: the same without steps [m2].
    pub soaked_area: T,
    /// Integral of the position over the soaked area [m3].
    pub soaked_moment: Vector3<T>,
}

impl<T: Real> Default for Wetting<T> {
    fn default() -> Self {
        Self {
            pressure: Wrench::default(),
            area: T::zero(),
            soaked_area: T::zero(),
            soaked_moment: Vector3::zeros(),
        }
    }
}

impl<T: Real> Wetting<T> {
    /// The same in other numbers.
    pub fn map<U: Real>(&self, with: impl Fn(T) -> U) -> Wetting<U> {
        let vector = |v: &Vector3<T>| v.map(&with);
        let Wrench { force, moment } = &self.pressure;
        Wetting {
            pressure: Wrench { force: vector(force), moment: vector(moment) },
            area: with(self.area),
            soaked_area: with(self.soaked_area),
            soaked_moment: vector(&self.soaked_moment),
        }
    }

    /// Centroid of the soaked area [m]; `None` where nothing is wet.
    pub fn centroid(&self) -> Option<Vector3<T>> {
        (self.soaked_area.value() > 0.0).then(|| self.soaked_moment / self.soaked_area)
    }
}

impl Wetting {
    fn values(&self) -> [f64; QUANTITIES] {
        let (f, m, s) = (self.pressure.force, self.pressure.moment, self.soaked_moment);
        [f.x, f.y, f.z, m.x, m.y, m.z, self.area, self.soaked_area, s.x, s.y, s.z]
    }

    fn from_values(v: &[f64; QUANTITIES]) -> Self {
        let pressure = Wrench { force: Vec3::new(v[0], v[1], v[2]), moment: Vec3::new(v[3], v[4], v[5]) };
        Self { pressure, area: v[6], soaked_area: v[7], soaked_moment: Vec3::new(v[8], v[9], v[10]) }
    }
}

type Lane = [f64; LANES];

/// A hull prepared for [`WettingTable::wetting_into`]; body frame.
#[derive(Debug, Clone)]
pub struct WettingTable {
    surfaces: Vec<SurfaceTable>,
    instructions: Instructions,
}

/// A tree of boxes in the order of a walk through it, each before what it holds.
#[derive(Debug, Clone)]
struct SurfaceTable {
    faces: Vec<Face>,
    boxes: Vec<Node>,
    /// Over the faces of each box.
    terms: Vec<Terms>,
    level: Option<LevelTable>,
}

/// Box around faces that stand side by side.
#[derive(Debug, Clone, Copy)]
struct Node {
    center: Vec3,
    half: Vec3,
    /// The box after all that this one holds.
    next: usize,
    /// From, to; none where smaller boxes follow.
    faces: [usize; 2],
}

/// Polynomials over the intervals between the levels at which a surface's vertices get wet and soaked.
#[derive(Debug, Clone, Default)]
struct LevelTable {
    heights: Vec<f64>,
    /// One an interval, in powers of the share of the interval that is under water.
    intervals: Vec<[[f64; QUANTITIES]; TERMS]>,
}

#[derive(Debug, Clone, Copy)]
struct Face {
    corners: [Vec3; 3],
    /// Outward.
    normal: Vec3,
    area: f64,
}

/// Faces of which the water may reach a part, collected to be clipped in lock step.
#[derive(Default)]
struct Clipping {
    count: usize,
    surfaces: [usize; LANES],
    faces: Faces,
    values: [Lane; QUANTITIES],
}

/// Faces in lock step with the depths of their corners; lanes without a face have no area.
#[derive(Default)]
struct Faces {
    corners: [[Lane; 3]; 3],
    depths: [Lane; 3],
    normal: [Lane; 3],
    area: Lane,
}

/// Of one face below one plane: area, integrals of the depth [m3] and of depth times position [m4].
type Below = (f64, f64, [f64; 3]);

/// What a wet face contributes besides the plane `n . x = c`:
/// force `-(c S - T n)`, moment about the origin `-(c P - U n)`.
#[derive(Debug, Clone, Copy, Default)]
struct Terms {
    /// `S = sum A` of area vectors.
    area_vector: Vec3,
    /// `T = sum A x^T` with the centroid x.
    first: Matrix3<f64>,
    /// `P = sum x cross A`.
    moment: Vec3,
    /// `U = -sum [A]x Q` with the mean Q of `x x^T` over the face.
    second: Matrix3<f64>,
    /// `sum |A|`.
    area: f64,
    /// `sum |A| x`.
    area_moment: Vec3,
}

impl WettingTable {
    /// Prepares the hull of a vehicle with `count` surfaces.
    pub fn new(hull: &Hull, count: usize) -> Self {
        let mut surfaces: Vec<SurfaceTable> = (0..count).map(|s| SurfaceTable::new(hull, s)).collect();
        let heights: Vec<Vec<f64>> = surfaces.iter().map(SurfaceTable::levels).collect();
        if heights.iter().map(Vec::len).sum::<usize>() <= MOST_INTERVALS {
            for (surface, heights) in surfaces.iter_mut().zip(heights) {
                surface.level = Some(LevelTable::new(surface, heights));
            }
        }
        Self { surfaces, instructions: Instructions::fastest() }
    }

    /// What the water reaches on each surface; `out` has one entry a surface. No allocation.
    pub fn wetting_into(&self, plane: &WaterPlane, out: &mut [Wetting]) {
        run_for!(self.instructions, WettingTable::wet(self, plane: &WaterPlane, out: &mut [Wetting]));
    }

    /// `known`, which [`Self::wetting_into`] found at this plane, with derivatives, but for those of the wet area, on which no load
    /// depends.
    pub fn dual_into<const N: usize>(
        &self,
        plane: &WaterPlane<Dual<N>>,
        known: &[Wetting],
        out: &mut [Wetting<Dual<N>>],
    ) {
        let normal = plane.normal.into_inner();
        let up = normal.map(Real::value);
        // it is a unit vector already
        let values = WaterPlane { normal: UnitVector3::new_unchecked(up), offset: plane.offset.value };
        for ((table, known), out) in self.surfaces.iter().zip(known).zip(out) {
            *out = table.moments(&values).wetting(known, &plane.offset, &normal);
        }
    }

    #[inline(always)]
    fn wet(&self, plane: &WaterPlane, out: &mut [Wetting]) {
        let mut clipping = Clipping::default();
        for (surface, table) in self.surfaces.iter().enumerate() {
            let known = table.level.as_ref().filter(|_| plane.is_level());
            match known.map(|level| level.at(plane.offset)) {
                Some(Some(wetting)) => out[surface] = wetting,
                Some(None) => out[surface] = table.terms[0].wetting(plane),
                None => table.clip(surface, plane, &mut clipping, out),
            }
        }
        clipping.finish(out);
    }
}

impl SurfaceTable {
    fn new(hull: &Hull, surface: usize) -> Self {
        let own: Vec<usize> = hull.faces_of(surface).collect();
        let mut faces: Vec<Face> = merged(&hull.mesh, &own).into_iter().map(Face::new).collect();
        let (mut boxes, mut terms) = (Vec::new(), Vec::new());
        grow(&mut faces, 0, &mut boxes, &mut terms);
        Self { faces, boxes, terms, level: None }
    }

    /// Levels at which a vertex gets wet or soaked, rising, those that are one left out.
    fn levels(&self) -> Vec<f64> {
        let corners = self.faces.iter().flat_map(|face| face.corners);
        let mut levels: Vec<f64> = corners.flat_map(|corner| [corner.z, corner.z + FILM]).collect();
        levels.sort_by(f64::total_cmp);
        levels.dedup_by(|next, kept| *next - *kept < LEAST_INTERVAL);
        levels
    }

    fn wetting(&self, plane: &WaterPlane) -> Wetting {
        let (mut clipping, mut out) = (Clipping::default(), [Wetting::default()]);
        self.clip(0, plane, &mut clipping, &mut out);
        clipping.finish(&mut out);
        out[0]
    }

    /// Sets the wetting of `surface` but for the faces that are left in `clipping`.
    #[inline(always)]
    fn clip(&self, surface: usize, plane: &WaterPlane, clipping: &mut Clipping, out: &mut [Wetting]) {
        let up = plane.normal.into_inner();
        let across = up.abs();
        let mut soaked = Terms::default();
        out[surface] = Wetting::default();
        let mut index = 0;
        while let Some(node) = self.boxes.get(index) {
            let (depth, reach) = (plane.depth_below(&node.center), across.dot(&node.half));
            if depth - reach >= FILM {
                soaked += self.terms[index];
            } else if depth + reach > 0.0 {
                let [from, to] = node.faces;
                if from == to {
                    index += 1;
                    continue;
                }
                for face in &self.faces[from..to] {
                    clipping.add(surface, face, plane, out);
                }
            }
            index = node.next;
        }
        out[surface] += soaked.wetting(plane);
    }
}

/// Moments of what is wet, which are the derivatives of a [`Wetting`] with respect to the plane `up . x = c`.
#[derive(Default)]
struct Moments {
    /// Those of the pressure load, of what is soaked and of wet parts of faces.
    terms: Terms,
    /// Over [`FILM`], of what is wet and not soaked: `int |dA|`, `int |dA| x`, `int |dA| x x^T`.
    film_area: f64,
    film_first: Vec3,
    film_second: Matrix3<f64>,
}

impl SurfaceTable {
    fn moments(&self, plane: &WaterPlane) -> Moments {
        let across = plane.normal.abs();
        let lower = WaterPlane { offset: plane.offset - FILM, ..*plane };
        let mut moments = Moments::default();
        let mut index = 0;
        while let Some(node) = self.boxes.get(index) {
            let (depth, reach) = (plane.depth_below(&node.center), across.dot(&node.half));
            if depth - reach >= FILM {
                moments.terms += self.terms[index];
            } else if depth + reach > 0.0 {
                let [from, to] = node.faces;
                if from == to {
                    index += 1;
                    continue;
                }
                for face in &self.faces[from..to] {
                    let below = face.below(plane);
                    moments.add_wet(face, &below);
                    moments.add_film(&below, 1.0);
                    moments.add_film(&face.below(&lower), -1.0);
                }
            }
            index = node.next;
        }
        moments
    }
}

impl Moments {
    fn add_wet(&mut self, face: &Face, (area, first, second): &(f64, Vec3, Matrix3<f64>)) {
        self.terms += Terms {
            area_vector: face.normal * *area,
            first: face.normal * first.transpose(),
            moment: first.cross(&face.normal),
            second: -(face.normal.cross_matrix() * second),
            area: *area,
            area_moment: *first,
        };
    }

    fn add_film(&mut self, (area, first, second): &(f64, Vec3, Matrix3<f64>), sign: f64) {
        self.film_area += area * (sign / FILM);
        self.film_first += first * (sign / FILM);
        self.film_second += second * (sign / FILM);
    }

    fn wetting<const N: usize>(
        &self,
        value: &Wetting,
        offset: &Dual<N>,
        up: &Vector3<Dual<N>>,
    ) -> Wetting<Dual<N>> {
        // of a quantity that grows by `with_offset` and by `with_up`
        let dual = |value: f64, with_offset: f64, with_up: [f64; 3]| {
            let slope = |n: usize| {
                with_offset * offset.slope[n] + (0..3).map(|k| with_up[k] * up[k].slope[n]).sum::<f64>()
            };
            Dual { value, slope: std::array::from_fn(slope) }
        };
        let vector = |value: &Vec3, with_offset: &Vec3, with_up: &Matrix3<f64>| {
            Vector3::from_fn(|k, _| dual(value[k], with_offset[k], with_up.row(k).transpose().into()))
        };
        Wetting {
            pressure: Wrench {
                force: vector(&value.pressure.force, &-self.terms.area_vector, &self.terms.first),
                moment: vector(&value.pressure.moment, &-self.terms.moment, &self.terms.second),
            },
            area: value.area.into(),
            soaked_area: dual(value.soaked_area, self.film_area, (-self.film_first).into()),
            soaked_moment: vector(&value.soaked_moment, &self.film_first, &-self.film_second),
        }
    }
}

/// Splits the faces so that water meets the fewest, each half counted by its extent: puts them in order, and tells how many are
/// in the first half.
fn split(faces: &mut [Face]) -> usize {
    let count = faces.len();
    let mut best = (f64::INFINITY, 2, count / 2);
    // never so uneven that the tree gets deep
    let least = count.div_ceil(8);
    let met = |bounds: &Bounds| bounds.extent().dot(&UPRIGHT);
    let along = |axis: usize| move |a: &Face, b: &Face| a.center()[axis].total_cmp(&b.center()[axis]);
    let mut ahead = vec![0.0; count];
    for axis in 0..3 {
        faces.sort_by(along(axis));
        let mut bounds = faces[0].bounds();
        for index in 1..count {
            ahead[index] = met(&bounds) * index as f64;
            bounds = bounds.union(&faces[index].bounds());
        }
        let mut bounds = faces[count - 1].bounds();
        for index in (1..count).rev() {
            bounds = bounds.union(&faces[index].bounds());
            let cost = ahead[index] + met(&bounds) * (count - index) as f64;
            if cost < best.0 && index >= least && index <= count - least {
                best = (cost, axis, index);
            }
        }
    }
    faces.sort_by(along(best.1));
    best.2
}

/// Orders the faces and adds the boxes over them, of which the first is `first`.
fn grow(faces: &mut [Face], first: usize, boxes: &mut Vec<Node>, terms: &mut Vec<Terms>) {
    let Some(bounds) = Bounds::around(faces.iter().flat_map(|face| &face.corners)) else { return };
    let (index, leaf) = (boxes.len(), faces.len() <= LEAF);
    let range = if leaf { [first, first + faces.len()] } else { [first; 2] };
    let half = (bounds.extent() * 0.5).add_scalar(ROOM);
    boxes.push(Node { center: bounds.center(), half, next: 0, faces: range });
    let mut sum = Terms::default();
    faces.iter().for_each(|face| sum.add(face));
    terms.push(sum);
    if !leaf {
        let middle = split(faces);
        let (near, far) = faces.split_at_mut(middle);
        grow(near, first, boxes, terms);
        grow(far, first + middle, boxes, terms);
    }
    boxes[index].next = boxes.len();
}

impl LevelTable {
    fn new(surface: &SurfaceTable, heights: Vec<f64>) -> Self {
        // inside the interval: at its ends a horizontal face is about to get wet
        let nodes: [f64; TERMS] = std::array::from_fn(|i| (i as f64 + 0.5) / TERMS as f64);
        let powers = SMatrix::<f64, TERMS, TERMS>::from_fn(|row, column| nodes[row].powi(column as i32));
        // five different nodes: never singular
        let coefficients = powers.try_inverse().unwrap_or_else(SMatrix::identity);
        let interval = |pair: &[f64]| {
            let values = nodes.map(|share| {
                let level = pair[0] + share * (pair[1] - pair[0]);
                surface.wetting(&WaterPlane::level(level, 0.0)).values()
            });
            std::array::from_fn(|term| {
                std::array::from_fn(|quantity| {
                    (0..TERMS).map(|node| coefficients[(term, node)] * values[node][quantity]).sum()
                })
            })
        };
        Self { intervals: heights.windows(2).map(interval).collect(), heights }
    }

    /// `None` where the surface is wholly soaked.
    fn at(&self, level: f64) -> Option<Wetting> {
        let above = self.heights.partition_point(|height| *height < level);
        if above == 0 {
            return Some(Wetting::default());
        }
        let polynomial = self.intervals.get(above - 1)?;
        let share = (level - self.heights[above - 1]) / (self.heights[above] - self.heights[above - 1]);
        let mut values = polynomial[TERMS - 1];
        for term in polynomial[..TERMS - 1].iter().rev() {
            for (value, term) in values.iter_mut().zip(term) {
                *value = *value * share + term;
            }
        }
        Some(Wetting::from_values(&values))
    }
}

impl Face {
    fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners;
        let vector = (b - a).cross(&(c - a)) * 0.5;
        let area = vector.norm();
        // one without an area has no direction, and bears nothing
        let normal = if area > 0.0 { vector / area } else { Vec3::zeros() };
        Self { corners, normal, area }
    }

    fn center(&self) -> Vec3 {
        self.corners.iter().sum::<Vec3>() / 3.0
    }

    /// Area, first and second moment of the part below a plane.
    fn below(&self, plane: &WaterPlane) -> (f64, Vec3, Matrix3<f64>) {
        let depths = self.corners.map(|corner| plane.depth_below(&corner));
        if depths.iter().all(|depth| *depth <= 0.0) {
            return (0.0, Vec3::zeros(), Matrix3::zeros());
        }
        let mut polygon = [Vec3::zeros(); 4];
        let mut count = 0;
        let mut push = |point: Vec3| {
            polygon[count] = point;
            count += 1;
        };
        for (here, there) in [(0, 1), (1, 2), (2, 0)] {
            if depths[here] > 0.0 {
                push(self.corners[here]);
            }
            if (depths[here] > 0.0) != (depths[there] > 0.0) {
                let share = depths[here] / (depths[here] - depths[there]);
                push(self.corners[here] + (self.corners[there] - self.corners[here]) * share);
            }
        }
        let mut sum = (0.0, Vec3::zeros(), Matrix3::zeros());
        for last in 2..count {
            let corners = [polygon[0], polygon[last - 1], polygon[last]];
            let [a, b, c] = corners;
            let (area, whole) = ((b - a).cross(&(c - a)).dot(&self.normal) * 0.5, a + b + c);
            let squares = corners.iter().fold(whole * whole.transpose(), |sum, x| sum + x * x.transpose());
            sum = (sum.0 + area, sum.1 + whole * (area / 3.0), sum.2 + squares * (area / 12.0));
        }
        sum
    }

    fn bounds(&self) -> Bounds {
        let [a, b, c] = &self.corners;
        Bounds { min: a.inf(b).inf(c), max: a.sup(b).sup(c) }
    }
}

impl Clipping {
    /// Takes a face unless it is dry; where there is no more room the faces so far are clipped.
    #[inline(always)]
    fn add(&mut self, surface: usize, face: &Face, plane: &WaterPlane, out: &mut [Wetting]) {
        // with a sign of its own a zero would be cut from a zero
        let depths = three(|corner| plane.depth_below(&face.corners[corner]) + 0.0);
        let (lane, faces) = (self.count, &mut self.faces);
        self.surfaces[lane] = surface;
        for (axis, depth) in depths.into_iter().enumerate() {
            for corner in 0..3 {
                faces.corners[corner][axis][lane] = face.corners[corner][axis];
            }
            faces.depths[axis][lane] = depth;
            faces.normal[axis][lane] = face.normal[axis];
        }
        faces.area[lane] = face.area;
        // what is dry is written over by the next: no branch that cannot be foreseen
        self.count += usize::from((depths[0] > 0.0) | (depths[1] > 0.0) | (depths[2] > 0.0));
        if self.count == LANES {
            self.flush(out);
        }
    }

    #[inline(always)]
    fn finish(&mut self, out: &mut [Wetting]) {
        if self.count > 0 {
            self.faces.area[self.count..].fill(0.0);
            self.flush(out);
        }
    }

    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "a lane is an index into many arrays")]
    fn flush(&mut self, out: &mut [Wetting]) {
        let (faces, values) = (&self.faces, &mut self.values);
        for i in 0..LANES {
            let depths = three(|corner| faces.depths[corner][i]);
            let n = three(|axis| faces.normal[axis][i]);
            let (area, depth, m) = faces.below(i, depths);
            let (_, lower_depth, lower_m) = faces.below(i, three(|corner| depths[corner] - FILM));
            for axis in 0..3 {
                let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
                values[axis][i] = -n[axis] * depth;
                values[3 + axis][i] = m[last] * n[next] - m[next] * n[last];
                values[8 + axis][i] = (m[axis] - lower_m[axis]) * FILM.recip();
            }
            values[6][i] = area;
            values[7][i] = (depth - lower_depth) * FILM.recip();
        }
        let surfaces = &self.surfaces[..self.count];
        if surfaces.iter().all(|surface| *surface == surfaces[0]) {
            // lanes without a face hold nothing
            let mut sums = [0.0; QUANTITIES];
            sums.iter_mut().zip(&*values).for_each(|(out, lane)| *out = sum(lane));
            out[surfaces[0]] += Wetting::from_values(&sums);
        } else {
            for (lane, surface) in surfaces.iter().enumerate() {
                out[*surface] += Wetting::from_values(&values.each_ref().map(|value| value[lane]));
            }
        }
        self.count = 0;
    }
}

/// Of each corner or axis; not `array::from_fn`, which is inlined here by chance and costs a tilted query a quarter where it is not.
#[inline(always)]
fn three<T>(of: impl Fn(usize) -> T) -> [T; 3] {
    [of(0), of(1), of(2)]
}

impl Faces {
    /// Of a face, the part of which the depth is positive: at most two triangles. Only positive terms are added, so that
    /// the centroid of a sliver lies on it. Without a branch, so that all lanes go the same way.
    #[inline(always)]
    fn below(&self, i: usize, depths: [f64; 3]) -> Below {
        let dry = three(|corner| negative(depths[corner]));
        // the corner that is alone on its side of the surface comes first
        let second = (dry[1] ^ dry[0]) & (dry[1] ^ dry[2]);
        let third = (dry[2] ^ dry[0]) & (dry[2] ^ dry[1]);
        let turned = |[u, v, w]: [f64; 3]| {
            [
                select(third, w, select(second, v, u)),
                select(third, u, select(second, w, v)),
                select(third, v, select(second, u, w)),
            ]
        };
        let [da, db, dc] = turned(depths);
        let [x, y, z] = three(|axis| turned(three(|corner| self.corners[corner][axis][i])));
        let [a, b, c] = three(|corner| [x[corner], y[corner], z[corner]]);
        let (first_dry, others_dry) = (negative(da), negative(db));
        let (tip, blunt) = (!first_dry & others_dry, first_dry & !others_dry);
        // where an edge meets the surface, from its wet end, so that the two faces of an edge agree; the share that is wet
        let cut = |other: [f64; 3], depth: f64| {
            let (under, over) = (select(tip, da, depth), select(tip, depth, da));
            let share = under / (under - over);
            let point = three(|axis| {
                let (from, to) = (select(tip, a[axis], other[axis]), select(tip, other[axis], a[axis]));
                from + (to - from) * share
            });
            (point, share)
        };
        let ((p, to_p), (q, to_q)) = (cut(b, db), cut(c, dc));
        let choose = |condition: u64, yes: [f64; 3], no: [f64; 3]| -> [f64; 3] {
            three(|axis| select(condition, yes[axis], no[axis]))
        };
        let corners = [choose(blunt, p, a), choose(tip, p, b), choose(tip, q, c)];
        let (depth, moment) =
            weighted(corners, [select(blunt, 0.0, da), select(tip, 0.0, db), select(tip, 0.0, dc)]);
        let area = self.area[i];
        let whole = select(first_dry | others_dry, 0.0, area);
        let near = select(tip, area * to_p * to_q, select(blunt, area * to_p, whole));
        // the other triangle of a quadrilateral, of which one corner is under water
        let far = select(blunt, area * (1.0 - to_p) * to_q, 0.0);
        let beyond = three(|axis| select(blunt, dc * (p[axis] + 2.0 * c[axis] + q[axis]), 0.0));
        (
            near + far,
            (near * depth + far * dc) * THIRD,
            three(|axis| (near * moment[axis] + far * beyond[axis]) * TWELFTH),
        )
    }
}

/// All bits where the sign is set: unlike a choice between two values it is never turned into a choice of where to read.
#[inline(always)]
fn negative(value: f64) -> u64 {
    (value.to_bits().cast_signed() >> 63).cast_unsigned()
}

#[inline(always)]
fn select(mask: u64, yes: f64, no: f64) -> f64 {
    f64::from_bits((mask & yes.to_bits()) | (!mask & no.to_bits()))
}

/// Sums over a triangle by which it weighs the depth: `int delta dA = A / 3` of the first, `int delta x dA = A / 12` of the
/// second.
#[inline(always)]
fn weighted([a, b, c]: [[f64; 3]; 3], [da, db, dc]: [f64; 3]) -> (f64, [f64; 3]) {
    let sum = da + db + dc;
    let moment = |axis: usize| a[axis] * (sum + da) + b[axis] * (sum + db) + c[axis] * (sum + dc);
    (sum, [moment(0), moment(1), moment(2)])
}

impl<T: Real> std::ops::AddAssign for Wetting<T> {
    fn add_assign(&mut self, other: Self) {
        self.pressure += other.pressure;
        self.area += other.area;
        self.soaked_area += other.soaked_area;
        self.soaked_moment += other.soaked_moment;
    }
}

impl std::ops::AddAssign for Terms {
    fn add_assign(&mut self, other: Self) {
        self.area_vector += other.area_vector;
        self.first += other.first;
        self.moment += other.moment;
        self.second += other.second;
        self.area += other.area;
        self.area_moment += other.area_moment;
    }
}

impl Terms {
    fn add(&mut self, face: &Face) {
        let [a, b, c] = face.corners;
        let vector = face.normal * face.area;
        let centroid = (a + b + c) / 3.0;
        let midpoints = [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5];
        let spread = midpoints.iter().map(|m| m * m.transpose()).sum::<Matrix3<f64>>() / 3.0;
        self.area_vector += vector;
        self.first += vector * centroid.transpose();
        self.moment += centroid.cross(&vector);
        self.second -= vector.cross_matrix() * spread;
        self.area += face.area;
        self.area_moment += centroid * face.area;
    }

    #[inline(always)]
    fn wetting(&self, plane: &WaterPlane) -> Wetting {
        let (n, c) = (plane.normal.into_inner(), plane.offset);
        let force = self.first * n - self.area_vector * c;
        let moment = self.second * n - self.moment * c;
        Wetting {
            pressure: Wrench { force, moment },
            area: self.area,
            soaked_area: self.area,
            soaked_moment: self.area_moment,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::frame::up_from_roll_pitch;
    use crate::geometry::hydrostatics::surface_hydrostatics;
    use crate::geometry::immersion::wet_triangles;
    use crate::vehicle::shipped;

    /// Largest difference to the pressure integral face by face, over the weight of the water displaced.
    fn worst(planes: impl Iterator<Item = WaterPlane>) -> f64 {
        let mut worst = 0.0_f64;
        let planes: Vec<WaterPlane> = planes.collect();
        for shipped in [shipped::husky().unwrap(), shipped::warthog().unwrap()] {
            let vehicle = shipped.vehicle().unwrap();
            let count = vehicle.surfaces.len();
            let table = WettingTable::new(&vehicle.hull, count);
            let mut wetting = vec![Wetting::default(); count];
            for plane in &planes {
                table.wetting_into(plane, &mut wetting);
                let rho_g = 1.0 / crate::frame::GRAVITY;
                let truth = surface_hydrostatics(&vehicle.hull, count, plane, rho_g, &Vec3::zeros());
                for (surface, (got, want)) in wetting.iter().zip(&truth).enumerate() {
                    worst = worst.max((got.pressure.force - want.force).norm());
                    worst = worst.max((got.pressure.moment - want.moment).norm());
                    let faces = vehicle.hull.faces_of(surface);
                    let wet = faces.flat_map(|f| wet_triangles(&vehicle.hull.mesh, f, plane).to_vec());
                    let area: f64 = wet.map(|triangle| triangle.area_vector().norm()).sum();
                    worst = worst.max((got.area - area).abs());
                }
            }
        }
        worst
    }

    #[test]
    fn level_water_is_exact_at_every_depth_also_over_the_deck() {
        let worst = worst((0..600).map(|i| WaterPlane::level(-0.5, f64::from(i) * 0.001_7)));
        assert!(worst < 1e-9, "{worst:e}");
    }

    fn tilted() -> impl Iterator<Item = WaterPlane> {
        let angles = [(0.1, -0.2), (-0.4, 0.3), (1.2, 0.9), (2.5, 0.0)];
        angles.into_iter().flat_map(|(roll, pitch)| {
            [-0.1, 0.0, 0.1, 0.3].map(|d| WaterPlane::new(-0.2, d, up_from_roll_pitch(roll, pitch)))
        })
    }

    #[test]
    fn tilted_water_is_exact() {
        let worst = worst(tilted());
        assert!(worst < 1e-9, "{worst:e}");
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let vehicle = shipped::warthog().unwrap().vehicle().unwrap();
        let count = vehicle.surfaces.len();
        let fast = WettingTable::new(&vehicle.hull, count);
        let plain = WettingTable { instructions: Instructions::Portable, ..fast.clone() };
        let mut wetting = [0, 1].map(|_| vec![Wetting::default(); count]);
        for plane in tilted().chain([WaterPlane::level(-0.2, 0.0)]) {
            fast.wetting_into(&plane, &mut wetting[0]);
            plain.wetting_into(&plane, &mut wetting[1]);
            assert_eq!(wetting[0], wetting[1]);
        }
    }

    #[test]
    fn what_is_soaked_is_the_mean_of_what_lower_water_would_wet() {
        const LEVELS: u32 = 500;
        let level = [-0.45, -0.31, -0.2, 0.0, 0.4].map(|height| WaterPlane::level(height, 0.0));
        let planes: Vec<WaterPlane> = level.into_iter().chain(tilted()).collect();
        for shipped in [shipped::husky().unwrap(), shipped::warthog().unwrap()] {
            let hull = shipped.vehicle().unwrap().hull;
            let count = shipped.vehicle().unwrap().surfaces.len();
            let table = WettingTable::new(&hull, count);
            let mut wetting = vec![Wetting::default(); count];
            for plane in &planes {
                table.wetting_into(plane, &mut wetting);
                for (surface, got) in wetting.iter().enumerate() {
                    let (mut area, mut moment, mut whole) = (0.0, Vec3::zeros(), 0.0);
                    for step in 0..LEVELS {
                        let lower = (f64::from(step) + 0.5) / f64::from(LEVELS) * FILM;
                        let plane = WaterPlane { offset: plane.offset - lower, ..*plane };
                        for face in hull.faces_of(surface) {
                            for triangle in wet_triangles(&hull.mesh, face, &plane).iter() {
                                let part = triangle.area_vector().norm() / f64::from(LEVELS);
                                area += part;
                                moment += triangle.vertices.iter().sum::<Vec3>() / 3.0 * part;
                            }
                        }
                    }
                    for face in hull.faces_of(surface) {
                        whole += hull.mesh.area_vector(face).norm();
                    }
                    // a level face is met by one of the levels, so by a share of one in their number
                    let near = whole / f64::from(LEVELS) + 1e-12;
                    assert!((got.soaked_area - area).abs() < near, "{} {area}", got.soaked_area);
                    assert!((got.soaked_moment - moment).norm() < near, "{} {moment}", got.soaked_moment);
                }
            }
        }
    }
}
