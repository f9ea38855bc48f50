//! How much of each surface is under water, from points sampled on it once.
//!
//! Level water: heights are sorted, so a binary search and prefix sums answer in O(log n). Tilted water: the same for
//! all heights that the plane does not cross within the surface, and for the others one pass over f32 arrays without
//! branches, which the compiler turns into SIMD. Neither allocates.

use crate::frame::{Vec3, WaterPlane};

/// Points a block of the tilted pass; arrays are padded to a multiple of it.
const LANES: usize = 8;

/// Room for f32 rounding of a height [m].
const F32_ROOM: f64 = 1e-5;

/// Most points that a file may hold for one vehicle.
pub const MAX_POINTS: usize = 1 << 20;

/// How much of a surface is under water; body frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Submergence {
    /// Share of the surface under water, 0 to 1.
    pub fraction: f64,
    /// Mean depth of the wet part below the surface [m]; 0 when dry.
    pub mean_depth: f64,
    /// Mean position of the wet part [m]; the origin when dry.
    pub wet_centroid: Vec3,
}

/// Why stored samples were refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SamplesError {
    /// Arrays that do not fit together.
    #[error("{points} points, {normals} normals, offsets up to {end}: the three must agree")]
    Lengths {
        /// Number of points.
        points: usize,
        /// Number of normals.
        normals: usize,
        /// Last offset.
        end: usize,
    },
    /// Offsets that do not start at zero and grow: a surface without samples.
    #[error("surface {surface} has no samples")]
    EmptySurface {
        /// Index of the surface.
        surface: usize,
    },
    /// More than `MAX_POINTS`.
    #[error("{points} samples, at most {MAX_POINTS} are read")]
    TooMany {
        /// Number of points.
        points: usize,
    },
    /// A NaN or infinite number.
    #[error("sample {index} is not finite")]
    NotFinite {
        /// Index of the sample.
        index: usize,
    },
    /// Heights out of order within a surface.
    #[error("sample {index} lies below the one before it: samples are stored by rising z")]
    Unsorted {
        /// Index of the sample.
        index: usize,
    },
}

/// The samples of all surfaces of a vehicle, in the order of its surfaces; body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    /// One entry a surface.
    pub surfaces: Vec<SurfaceSamples>,
}

impl Samples {
    /// Builds from stored parts: surface `s` owns `points[offsets[s]..offsets[s + 1]]`, sorted by rising z.
    ///
    /// The values are f32 because that is what a bundle stores: what is written is restored bit for bit.
    pub fn from_parts(
        points: &[[f32; 3]],
        normals: &[[f32; 3]],
        offsets: &[usize],
    ) -> Result<Self, SamplesError> {
        let end = offsets.last().copied().unwrap_or(0);
        if points.len() != normals.len() || points.len() != end || offsets.first() != Some(&0) {
            return Err(SamplesError::Lengths { points: points.len(), normals: normals.len(), end });
        }
        if points.len() > MAX_POINTS {
            return Err(SamplesError::TooMany { points: points.len() });
        }
        if let Some(surface) = offsets.windows(2).position(|w| w[0] >= w[1]) {
            return Err(SamplesError::EmptySurface { surface });
        }
        check_finite(points, normals)?;
        let surfaces = offsets.windows(2).map(|w| {
            SurfaceSamples::new(&points[w[0]..w[1]], &normals[w[0]..w[1]])
                .map_err(|index| SamplesError::Unsorted { index: w[0] + index })
        });
        Ok(Self { surfaces: surfaces.collect::<Result<_, _>>()? })
    }

    /// All points [m] in the order of the surfaces.
    pub fn points(&self) -> Vec<[f32; 3]> {
        self.surfaces.iter().flat_map(SurfaceSamples::points).collect()
    }

    /// All outward unit normals in the order of the points.
    pub fn normals(&self) -> Vec<[f32; 3]> {
        self.surfaces.iter().flat_map(|s| s.normals.iter().copied()).collect()
    }

    /// Where each surface starts in `points`, and the end: one more than there are surfaces.
    pub fn offsets(&self) -> Vec<usize> {
        let ends = self.surfaces.iter().scan(0, |end, s| {
            *end += s.len();
            Some(*end)
        });
        std::iter::once(0).chain(ends).collect()
    }
}

fn check_finite(points: &[[f32; 3]], normals: &[[f32; 3]]) -> Result<(), SamplesError> {
    let finite = |v: &[f32; 3]| v.iter().all(|c| c.is_finite());
    match points.iter().zip(normals).position(|(p, n)| !finite(p) || !finite(n)) {
        Some(index) => Err(SamplesError::NotFinite { index }),
        None => Ok(()),
    }
}

/// The samples of one surface by rising z; body frame [m].
#[derive(Debug, Clone)]
pub struct SurfaceSamples {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    normals: Vec<[f32; 3]>,
    x_range: [f64; 2],
    y_range: [f64; 2],
    /// Sums of x, y, z over the first k points.
    prefix: Vec<[f64; 3]>,
}

impl SurfaceSamples {
    /// The error is the index of the first point out of order.
    fn new(points: &[[f32; 3]], normals: &[[f32; 3]]) -> Result<Self, usize> {
        if let Some(index) = points.windows(2).position(|w| w[1][2] < w[0][2]) {
            return Err(index + 1);
        }
        let mut prefix = vec![[0.0; 3]];
        let mut sum = [0.0; 3];
        for point in points {
            (0..3).for_each(|i| sum[i] += f64::from(point[i]));
            prefix.push(sum);
        }
        let [x_range, y_range] = [0, 1].map(|i| {
            let values = points.iter().map(|p| f64::from(p[i]));
            [values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max)]
        });
        let [x, y, z] = [0, 1, 2].map(|i| padded(points.iter().map(|p| p[i])));
        Ok(Self { x, y, z, normals: normals.to_vec(), x_range, y_range, prefix })
    }

    /// Number of points, at least one.
    #[expect(clippy::len_without_is_empty, reason = "never empty by construction")]
    pub fn len(&self) -> usize {
        self.normals.len()
    }

    /// The points by rising z [m].
    pub fn points(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        (0..self.len()).map(|i| [self.x[i], self.y[i], self.z[i]])
    }

    /// Outward unit normals in the order of the points.
    pub fn normals(&self) -> &[[f32; 3]] {
        &self.normals
    }

    /// Wet share, mean depth and wet centroid for a water plane in the body frame.
    ///
    /// `fraction = wet / M`, `mean_depth = sum over wet of (z_water - z) / wet` (the source paper's submergence metrics,
    /// with distance to the plane in place of the height difference).
    pub fn submergence(&self, plane: &WaterPlane) -> Submergence {
        if plane.is_level() && plane.normal.z > 0.0 { self.level(plane.offset) } else { self.tilted(plane) }
    }

    fn level(&self, water: f64) -> Submergence {
        let wet = self.z[..self.len()].partition_point(|z| f64::from(*z) <= water);
        if wet == 0 {
            return Submergence::default();
        }
        let [x, y, z] = self.prefix[wet].map(|sum| sum / wet as f64);
        Submergence {
            fraction: wet as f64 / self.len() as f64,
            // rounding may leave a touching surface a hair below zero
            mean_depth: (water - z).max(0.0),
            wet_centroid: Vec3::new(x, y, z),
        }
    }

    /// The general case. Sorted heights decide all points outside the band of heights in which the plane crosses the
    /// surface; the points of the band are looked at one by one.
    fn tilted(&self, plane: &WaterPlane) -> Submergence {
        let (from, to) = self.undecided(plane);
        let [count, x, y, z] = self.wet_sums(plane, from, to);
        let count = count + from as f64;
        if count == 0.0 {
            return Submergence::default();
        }
        let [below_x, below_y, below_z] = self.prefix[from];
        let wet_centroid = Vec3::new(x + below_x, y + below_y, z + below_z) / count;
        Submergence {
            fraction: count / self.len() as f64,
            // depth is linear, so its mean is the depth of the mean
            mean_depth: plane.depth_below(&wet_centroid).max(0.0),
            wet_centroid,
        }
    }

    /// Whole blocks of points, from the first that may be dry to the last that may be wet.
    fn undecided(&self, plane: &WaterPlane) -> (usize, usize) {
        let up = plane.normal;
        // near the vertical the band is the whole surface
        if up.z < 0.1 {
            return (0, self.z.len());
        }
        let span = |n: f64, [low, high]: [f64; 2]| {
            if n < 0.0 { [n * high, n * low] } else { [n * low, n * high] }
        };
        let (x, y) = (span(up.x, self.x_range), span(up.y, self.y_range));
        let below = |height: f64| self.z[..self.len()].partition_point(|z| f64::from(*z) < height);
        let from = below((plane.offset - (x[1] + y[1])) / up.z - F32_ROOM);
        let to = below((plane.offset - (x[0] + y[0])) / up.z + F32_ROOM);
        (from / LANES * LANES, to.next_multiple_of(LANES))
    }

    /// Count, x, y, z summed over the wet points of whole blocks. Lanes are kept apart to the end, which lets the loop
    /// vectorise and keeps each f32 sum short. Padding is NaN: no comparison holds for it.
    fn wet_sums(&self, plane: &WaterPlane, from: usize, to: usize) -> [f64; 4] {
        let [nx, ny, nz] = [plane.normal.x as f32, plane.normal.y as f32, plane.normal.z as f32];
        let offset = plane.offset as f32;
        let mut sums = [[0f32; LANES]; 4];
        let [xs, ys, zs] = [&self.x, &self.y, &self.z].map(|v| v[from..to].as_chunks::<LANES>().0);
        for ((x, y), z) in xs.iter().zip(ys).zip(zs) {
            for i in 0..LANES {
                let wet = nx * x[i] + ny * y[i] + nz * z[i] <= offset;
                sums[0][i] += if wet { 1.0 } else { 0.0 };
                sums[1][i] += if wet { x[i] } else { 0.0 };
                sums[2][i] += if wet { y[i] } else { 0.0 };
                sums[3][i] += if wet { z[i] } else { 0.0 };
            }
        }
        sums.map(|lane| lane.iter().map(|v| f64::from(*v)).sum())
    }
}

/// Derived equality would compare the padding, and NaN equals nothing.
impl PartialEq for SurfaceSamples {
    fn eq(&self, other: &Self) -> bool {
        self.normals == other.normals && self.points().eq(other.points())
    }
}

fn padded(values: impl Iterator<Item = f32>) -> Vec<f32> {
    let mut values: Vec<f32> = values.collect();
    values.resize(values.len().next_multiple_of(LANES), f32::NAN);
    values
}
