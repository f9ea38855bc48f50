//! The signed distance to the hull on a regular grid.

#[cfg(feature = "build")]
mod build;
mod error;

#[cfg(feature = "build")]
pub use build::signed_distances;
pub use error::GridError;

use crate::frame::Vec3;

/// Cells along the longest edge of the bounding box (source paper).
pub const CELLS: f64 = 64.0;

/// Space around the bounding box [m] (source paper).
pub const MARGIN: f64 = 0.5;

/// Most grid points; a vehicle of a metre has two million.
pub const MAX_POINTS: usize = 1 << 25;

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

impl SignedDistanceGrid {
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
