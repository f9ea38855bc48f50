//! The signed distance to the hull on a regular grid.

use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::mesh::Mesh;
use super::parry::Solid;
use crate::frame::Vec3;

/// Cells along the longest edge of the bounding box (source paper).
pub const CELLS: f64 = 64.0;

/// Space around the bounding box [m] (source paper).
pub const MARGIN: f64 = 0.5;

/// Most grid points; a vehicle of a metre has two million.
pub const MAX_POINTS: usize = 1 << 25;

/// Why a grid was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GridError {
    /// A mesh without faces.
    #[error("a signed distance needs a mesh with faces")]
    Empty,
    /// More points than `MAX_POINTS`: a hull far smaller than the margin.
    #[error(
        "a grid of {x} x {y} x {z} points is too large: the spacing of {spacing_m} m is too fine for a margin of 0.5 m"
    )]
    TooLarge {
        /// Points along x.
        x: usize,
        /// Points along y.
        y: usize,
        /// Points along z.
        z: usize,
        /// Grid spacing [m].
        spacing_m: f64,
    },
    /// Stored values that do not fit the shape, or a spacing that is not positive.
    #[error("{values} values do not fill a grid of {expected} points with spacing {spacing_m} m")]
    Shape {
        /// Number of values.
        values: usize,
        /// Product of the shape.
        expected: usize,
        /// Grid spacing [m].
        spacing_m: f64,
    },
    /// A NaN or infinite number.
    #[error("grid value {index} is not finite")]
    NotFinite {
        /// Index of the value.
        index: usize,
    },
}

/// Signed distance to the hull, negative inside; frame of the mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct SignedDistanceGrid {
    /// Position of the first grid point [m].
    pub origin: Vec3,
    /// Distance between neighbours along each axis [m].
    pub spacing: f64,
    /// Points along x, y, z; two at least.
    pub shape: [usize; 3],
    /// Distances [m], x fastest: point (i, j, k) is at `i + shape[0] * (j + shape[1] * k)`.
    pub values: Vec<f32>,
}

/// Signed distances of points to a closed mesh [m], negative inside.
pub fn signed_distances(mesh: &Mesh, points: &[Vec3]) -> Result<Vec<f64>, GridError> {
    let solid = Solid::new(mesh).ok_or(GridError::Empty)?;
    Ok(points.iter().map(|point| solid.signed_distance(point)).collect())
}

impl SignedDistanceGrid {
    /// The grid of the source paper: spacing of the longest edge over 64, 0.5 m around the bounding box.
    ///
    /// The mesh must be closed. Takes seconds on all cores; `progress` gets slices done and in all.
    pub fn build(mesh: &Mesh, progress: &(dyn Fn(usize, usize) + Sync)) -> Result<Self, GridError> {
        let extent = mesh.bounds().ok_or(GridError::Empty)?.extent();
        Self::with_spacing(mesh, extent.max() / CELLS, MARGIN, progress)
    }

    /// As `build`, with a spacing and margin of one's own [m].
    pub fn with_spacing(
        mesh: &Mesh,
        spacing: f64,
        margin: f64,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Self, GridError> {
        let bounds = mesh.bounds().ok_or(GridError::Empty)?;
        let solid = Solid::new(mesh).ok_or(GridError::Empty)?;
        let cells = ((bounds.extent().add_scalar(2.0 * margin)) / spacing).map(f64::ceil);
        let shape: [usize; 3] = cells.map(|c| c as usize).map(|c| c.saturating_add(1)).into();
        points_in(shape, spacing)?;
        let origin = bounds.center() - cells * (0.5 * spacing);
        let values = fill(&solid, origin, spacing, shape, progress);
        Ok(Self { origin, spacing, shape, values })
    }

    /// Builds from stored values, checked.
    pub fn from_parts(
        origin: Vec3,
        spacing: f64,
        shape: [usize; 3],
        values: Vec<f32>,
    ) -> Result<Self, GridError> {
        let expected = points_in(shape, spacing)?;
        let sound = spacing > 0.0 && spacing.is_finite() && origin.iter().all(|c| c.is_finite());
        if !sound || values.len() != expected || shape.iter().any(|n| *n < 2) {
            return Err(GridError::Shape { values: values.len(), expected, spacing_m: spacing });
        }
        match values.iter().position(|v| !v.is_finite()) {
            Some(index) => Err(GridError::NotFinite { index }),
            None => Ok(Self { origin, spacing, shape, values }),
        }
    }

    /// Trilinear value at a point [m]; `None` outside the grid.
    pub fn sample(&self, point: &Vec3) -> Option<f64> {
        let at = (point - self.origin) / self.spacing;
        let inside = (0..3).all(|i| at[i] >= 0.0 && at[i] <= (self.shape[i] - 1) as f64);
        if !inside {
            return None;
        }
        let cell: [usize; 3] = std::array::from_fn(|i| (at[i] as usize).min(self.shape[i] - 2));
        let share: [f64; 3] = std::array::from_fn(|i| at[i] - cell[i] as f64);
        let corner = |c: usize| {
            let bits = [c & 1, (c >> 1) & 1, c >> 2];
            let weight =
                (0..3).map(|i| if bits[i] == 1 { share[i] } else { 1.0 - share[i] }).product::<f64>();
            weight * f64::from(self.values[self.index(std::array::from_fn(|i| cell[i] + bits[i]))])
        };
        Some((0..8).map(corner).sum())
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.shape[0] * (j + self.shape[1] * k)
    }
}

fn points_in([x, y, z]: [usize; 3], spacing_m: f64) -> Result<usize, GridError> {
    let points = x.checked_mul(y).and_then(|p| p.checked_mul(z)).filter(|p| *p <= MAX_POINTS);
    points.ok_or(GridError::TooLarge { x, y, z, spacing_m })
}

/// Slices of constant z, taken in turn by one thread a core.
fn fill(
    solid: &Solid,
    origin: Vec3,
    spacing: f64,
    shape: [usize; 3],
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Vec<f32> {
    let mut values = vec![0f32; shape.iter().product()];
    let done = AtomicUsize::new(0);
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
    let mut turns: Vec<Vec<(usize, &mut [f32])>> = (0..threads).map(|_| Vec::new()).collect();
    for (k, slice) in values.chunks_mut(shape[0] * shape[1]).enumerate() {
        turns[k % threads].push((k, slice));
    }
    std::thread::scope(|scope| {
        for slices in turns {
            scope.spawn(|| {
                for (k, slice) in slices {
                    for (n, value) in slice.iter_mut().enumerate() {
                        let step = Vec3::new((n % shape[0]) as f64, (n / shape[0]) as f64, k as f64);
                        *value = solid.signed_distance(&(origin + step * spacing)) as f32;
                    }
                    progress(done.fetch_add(1, Ordering::Relaxed) + 1, shape[2]);
                }
            });
        }
    });
    values
}
