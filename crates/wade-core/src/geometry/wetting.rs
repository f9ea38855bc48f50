//! What the water reaches on each surface, exactly and in the time of a query: pressure load, wet area and where it is.
//!
//! The load of a wholly wet face is linear in the water plane, so the faces that lie below the waterline for sure enter
//! as one prefix sum; only faces that the surface may cross are clipped. On level water even that is known beforehand:
//! between two levels at which a vertex gets wet or soaked every quantity is a polynomial of the water level of degree four
//! at most, so each such interval stores one.
//!
//! The wet area steps where the water reaches a level face, and nothing that is felt does. So there is beside it the soaked
//! area, in which a place counts by its depth over the first centimeter: the mean of the wet areas of all water levels
//! from here to a centimeter lower.

use nalgebra::{Matrix3, SMatrix};

use super::immersion::{Corner, cut, depth_moments};
use super::surfaces::Hull;
use crate::frame::{Vec3, WaterPlane};
use crate::wrench::Wrench;

/// Room for rounding of a height [m].
const ROOM: f64 = 1e-9;
/// Intervals of level water that are stored for all surfaces together; a finer hull is clipped at every query.
const MOST_INTERVALS: usize = 40_000;
/// Heights closer than this are one [m]: a polynomial over less would be rounding.
const LEAST_INTERVAL: f64 = 1e-6;
/// Faces that are passed over together where the water does not reach them.
const BLOCK: usize = 8;
/// Coefficients of a polynomial: degree four.
const TERMS: usize = 5;
/// Quantities of a surface: force, moment, wet area, soaked area and its first moment.
const QUANTITIES: usize = 11;
/// Depth at which a wet place counts as soaked [m].
const FILM: f64 = 0.01;

/// What the water reaches on one surface; body frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wetting {
    /// Pressure load about the body origin in a fluid with `rho g = 1` [m3, m4].
    pub pressure: Wrench,
    /// Wet area [m2]. It steps where the water reaches a level face.
    pub area: f64,
    /// Integral of `min(depth / 1 cm, 1)` over the wet area: the same without steps [m2].
    pub soaked_area: f64,
    /// Integral of the position over the soaked area [m3].
    pub soaked_moment: Vec3,
}

impl Wetting {
    /// Centroid of the soaked area [m]; `None` where nothing is wet.
    pub fn centroid(&self) -> Option<Vec3> {
        (self.soaked_area > 0.0).then(|| self.soaked_moment / self.soaked_area)
    }

    fn add(&mut self, face: &Face, wet: &Below, soaked: &Below) {
        self.pressure.force -= face.normal * wet.depth;
        self.pressure.moment -= wet.moment.cross(&face.normal);
        self.area += wet.area;
        self.soaked_area += (wet.depth - soaked.depth) * FILM.recip();
        self.soaked_moment += (wet.moment - soaked.moment) * FILM.recip();
    }

    fn values(&self) -> [f64; QUANTITIES] {
        let (f, m, s) = (self.pressure.force, self.pressure.moment, self.soaked_moment);
        [f.x, f.y, f.z, m.x, m.y, m.z, self.area, self.soaked_area, s.x, s.y, s.z]
    }

    fn from_values(v: &[f64; QUANTITIES]) -> Self {
        let pressure = Wrench { force: Vec3::new(v[0], v[1], v[2]), moment: Vec3::new(v[3], v[4], v[5]) };
        Self { pressure, area: v[6], soaked_area: v[7], soaked_moment: Vec3::new(v[8], v[9], v[10]) }
    }
}

/// A hull prepared for [`WettingTable::wetting_into`]; body frame.
#[derive(Debug, Clone)]
pub struct WettingTable {
    surfaces: Vec<SurfaceTable>,
}

/// Faces by rising top, so that the wet ones come first.
#[derive(Debug, Clone)]
struct SurfaceTable {
    faces: Vec<Face>,
    tops: Vec<f64>,
    /// One a block of faces.
    bottoms: Vec<f64>,
    x_range: [f64; 2],
    y_range: [f64; 2],
    /// Over the first k faces.
    prefix: Vec<Terms>,
    level: Option<LevelTable>,
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

/// What a face has below the surface, the depth being that of its corners.
#[derive(Debug, Clone, Copy, Default)]
struct Below {
    area: f64,
    /// Integral of the depth [m3].
    depth: f64,
    /// Integral of the depth times the position [m4].
    moment: Vec3,
}

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
        let heights: Vec<Vec<f64>> = surfaces.iter().map(SurfaceTable::heights).collect();
        if heights.iter().map(Vec::len).sum::<usize>() <= MOST_INTERVALS {
            for (surface, heights) in surfaces.iter_mut().zip(heights) {
                surface.level = Some(LevelTable::new(surface, heights));
            }
        }
        Self { surfaces }
    }

    /// What the water reaches on each surface; `out` has one entry a surface. No allocation.
    pub fn wetting_into(&self, plane: &WaterPlane, out: &mut [Wetting]) {
        for (table, out) in self.surfaces.iter().zip(out) {
            *out = match &table.level {
                Some(level) if plane.is_level() => {
                    level.at(plane.offset).unwrap_or_else(|| table.submerged().wetting(plane))
                }
                _ => table.clip(plane),
            };
        }
    }
}

impl SurfaceTable {
    fn new(hull: &Hull, surface: usize) -> Self {
        let mut faces: Vec<Face> = hull.faces_of(surface).map(|f| Face::new(hull.mesh.triangle(f))).collect();
        faces.sort_by(|a, b| a.range(2)[1].total_cmp(&b.range(2)[1]));
        let mut prefix = vec![Terms::default()];
        let mut sum = Terms::default();
        for face in &faces {
            sum.add(face);
            prefix.push(sum);
        }
        let lowest = |faces: &[Face]| faces.iter().map(|face| face.range(2)[0]).fold(f64::INFINITY, f64::min);
        let range = |axis: usize| {
            let ranges = faces.iter().map(|face| face.range(axis));
            ranges.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], [low, high]| [a.min(low), b.max(high)])
        };
        Self {
            tops: faces.iter().map(|face| face.range(2)[1]).collect(),
            bottoms: faces.chunks(BLOCK).map(lowest).collect(),
            x_range: range(0),
            y_range: range(1),
            prefix,
            faces,
            level: None,
        }
    }

    /// Sums over all faces.
    fn submerged(&self) -> Terms {
        self.prefix[self.faces.len()]
    }

    /// Levels at which a vertex gets wet or soaked, rising, those that are one left out.
    fn heights(&self) -> Vec<f64> {
        let corners = self.faces.iter().flat_map(|face| face.corners);
        let mut heights: Vec<f64> = corners.flat_map(|corner| [corner.z, corner.z + FILM]).collect();
        heights.sort_by(f64::total_cmp);
        heights.dedup_by(|next, kept| *next - *kept < LEAST_INTERVAL);
        heights
    }

    fn clip(&self, plane: &WaterPlane) -> Wetting {
        // what lies below both planes is soaked
        let film = WaterPlane { offset: plane.offset - FILM, ..*plane };
        let (low, _) = self.waterline_heights(&film);
        let (_, high) = self.waterline_heights(plane);
        let soaked = self.tops.partition_point(|top| *top <= low);
        let mut sum = self.prefix[soaked].wetting(plane);
        for (index, bottom) in self.bottoms.iter().enumerate().skip(soaked / BLOCK) {
            if *bottom >= high {
                continue;
            }
            let block = index * BLOCK..self.faces.len().min((index + 1) * BLOCK);
            for face in &self.faces[block.start.max(soaked)..block.end] {
                let depths = face.corners.map(|corner| plane.depth_below(&corner));
                if depths.iter().any(|depth| *depth > 0.0) {
                    sum.add(face, &face.below(depths), &face.below(depths.map(|depth| depth - FILM)));
                }
            }
        }
        sum
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
                surface.clip(&WaterPlane::level(level, 0.0)).values()
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

    fn range(&self, axis: usize) -> [f64; 2] {
        let values = self.corners.map(|corner| corner[axis]);
        [
            values.into_iter().fold(f64::INFINITY, f64::min),
            values.into_iter().fold(f64::NEG_INFINITY, f64::max),
        ]
    }

    /// The part of which the depth is positive, with the depths of the corners. Only positive terms are added, so that the
    /// centroid of a sliver lies on it.
    #[inline(always)]
    fn below(&self, depths: [f64; 3]) -> Below {
        let [a, b, c] = [0, 1, 2].map(|i| (self.corners[i], depths[i]));
        match depths.map(|depth| depth > 0.0) {
            [false, false, false] => Below::default(),
            [true, false, false] => self.tip(a, b, c),
            [false, true, false] => self.tip(b, c, a),
            [false, false, true] => self.tip(c, a, b),
            [false, true, true] => self.blunt(a, b, c),
            [true, false, true] => self.blunt(b, c, a),
            [true, true, false] => self.blunt(c, a, b),
            [true, true, true] => Below::over([a, b, c], self.area),
        }
    }

    /// Of which the first corner alone is wet.
    fn tip(&self, a: Corner, b: Corner, c: Corner) -> Below {
        let ((ab, along_b), (ac, along_c)) = (cut(a, b), cut(a, c));
        Below::over([a, ab, ac], self.area * along_b * along_c)
    }

    /// Of which the first corner alone is dry.
    fn blunt(&self, a: Corner, b: Corner, c: Corner) -> Below {
        let ((ab, from_b), (ac, from_c)) = (cut(b, a), cut(c, a));
        let near_b = Below::over([ab, b, c], self.area * from_b);
        let near_c = Below::over([ab, c, ac], self.area * (1.0 - from_b) * from_c);
        Below {
            area: near_b.area + near_c.area,
            depth: near_b.depth + near_c.depth,
            moment: near_b.moment + near_c.moment,
        }
    }
}

impl Below {
    /// Over a triangle of so much area.
    #[inline(always)]
    fn over(corners: [Corner; 3], area: f64) -> Self {
        let (depth, moment) = depth_moments(corners);
        Self { area, depth: area * depth / 3.0, moment: moment * (area / 12.0) }
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
