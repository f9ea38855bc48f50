//! The grid of a mesh.

use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::{CELLS, GridError, MARGIN, SignedDistanceGrid, points_in};
use crate::frame::Vec3;
use crate::geometry::mesh::Mesh;
use crate::geometry::parry::Solid;

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
