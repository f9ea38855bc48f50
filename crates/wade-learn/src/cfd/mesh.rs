//! The channel, its background mesh and where it is refined.

use nalgebra::Rotation3;
use serde::{Deserialize, Serialize};

use super::placement::Placement;
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::geometry::mesh::Bounds;

/// How fine the mesh is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MeshSettings {
    /// Background cells along the length of the vehicle.
    pub cells_per_length: f64,
    /// Height of the wet background cells over their length.
    pub wet_layer: f64,
    /// Halvings at the hull.
    pub hull_level: u32,
    /// Halvings at the wheels.
    pub wheel_level: u32,
    /// Length, width and height of the channel [m]; by default in vehicle lengths as in the source paper.
    pub channel_m: Option<[f64; 3]>,
}

impl Default for MeshSettings {
    fn default() -> Self {
        Self { cells_per_length: 6.1, wet_layer: 0.42, hull_level: 2, wheel_level: 3, channel_m: None }
    }
}

impl MeshSettings {
    /// Length, width and height of the channel of a vehicle of this length, larger by a factor [m].
    pub fn channel(&self, length: f64, scale: f64) -> Vec3 {
        // the paper's 10 x 6 x 3 m for the Warthog; its 6 x 5 x 1.5 m for the Husky is set in the Husky's campaign
        self.channel_m.map_or(Vec3::new(6.56, 3.94, 1.97) * length, Vec3::from) * scale
    }
}

/// Clearance over the vehicle's length above which the water under the hull gets cells of its own, and how much of it stays
/// as fine as the water around the hull.
const DEEP: [f64; 2] = [0.4, 0.25];

/// Background mesh and refinement boxes of one case; frame of the case.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Length, width, height [m]; the vehicle stands at the center of the bed.
    pub size: Vec3,
    /// Cells along x and y.
    pub cells: [usize; 2],
    /// Cells below and above the water level; below, without those of `deep`.
    pub layers: [usize; 2],
    /// Coarser water between the bed and a hull far above it.
    pub deep: Option<Deep>,
    /// Height of the last air cell over that of the first.
    pub air_grading: f64,
    /// Box around the vehicle and turned with it, refined as the hull.
    pub near: TurnedBox,
    /// Box around bow wave and wake, one halving.
    pub wake: Bounds,
}

/// Layers of cells from the bed up to a height, the highest ones as high as those above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deep {
    /// Height of the highest one [m].
    pub height: f64,
    /// Their number.
    pub layers: usize,
    /// Height of the highest one over that of the lowest.
    pub grading: f64,
}

/// A box turned about the vertical; frame of the case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnedBox {
    /// One corner [m].
    pub corner: Vec3,
    /// Direction of its first edge.
    pub forward: Vec3,
    /// Edge lengths [m].
    pub span: Vec3,
}

impl TurnedBox {
    /// From a margin around the lengths of a hull whose body origin is over the channel's center, from `bottom` up to `top`.
    fn around(hull: &Bounds, margin: f64, yaw: f64, [bottom, top]: [f64; 2]) -> Self {
        let turn = Rotation3::from_axis_angle(&Vec3::z_axis(), yaw);
        let corner = Vec3::new(hull.min.x - margin, hull.min.y - margin, 0.0);
        let extent = hull.extent() + Vec3::repeat(2.0 * margin);
        let corner = turn * corner + Vec3::z() * bottom;
        Self { corner, forward: turn * Vec3::x(), span: Vec3::new(extent.x, extent.y, top - bottom) }
    }
}

impl Channel {
    /// The channel for a vehicle of `length` in place, at `speed` [m/s]; `cell_scale` makes every cell coarser, `channel_scale`
    /// the channel larger.
    pub fn new(
        settings: &MeshSettings,
        placement: &Placement,
        length: f64,
        speed: f64,
        [cell_scale, channel_scale]: [f64; 2],
    ) -> Self {
        let size = settings.channel(length, channel_scale);
        let cell = length / settings.cells_per_length * cell_scale;
        let hull = placement.bounds;
        // the same air above a hull that does not stand at the foot
        let size = if hull.min.z > 1e-3 { size + Vec3::z() * hull.min.z } else { size };
        let bottom = match hull.min.z - 0.2 * length {
            bottom if bottom > 0.0 => bottom,
            _ => -1.0,
        };
        let deep = Deep::below(hull.min.z, length, settings.wet_layer * cell, cell);
        let level = placement.water_level - deep.map_or(0.0, |deep| deep.height);
        let wet = (level / (settings.wet_layer * cell)).round().max(1.0);
        let air_height = size.z - placement.water_level;
        let air = (air_height / cell).round().max(4.0);
        let first = level / wet;
        let count = |extent: f64| (extent / cell).round().max(8.0) as usize;
        // water runs up an obstacle by the velocity head at most
        let run_up = (0.5 * speed * speed / (2.0 * GRAVITY)).min(0.2 * length);
        let level = placement.water_level;
        let wake = |ahead: f64, behind: f64, aside: f64, top: f64| Bounds {
            min: Vec3::new(hull.min.x - behind * length, hull.min.y - aside * length, bottom),
            max: Vec3::new(
                hull.max.x + ahead * length,
                hull.max.y + aside * length,
                level + top * length + run_up,
            ),
        };
        Self {
            size,
            cells: [count(size.x), count(size.y)],
            layers: [wet as usize, air as usize],
            deep,
            air_grading: grading(air_height, air as usize, first),
            near: TurnedBox::around(
                &placement.body_bounds,
                0.2 * length,
                placement.yaw,
                [bottom, level + 0.13 * length + run_up],
            ),
            wake: wake(0.80, 1.47, 0.60, 0.16),
        }
    }
}

impl Deep {
    /// Below a hull whose lowest point is `clearance` above the bed; `layer` is the height of the cells around the hull.
    fn below(clearance: f64, length: f64, layer: f64, cell: f64) -> Option<Self> {
        let [least, kept] = DEEP.map(|share| share * length);
        if clearance < least {
            return None;
        }
        let height = clearance - kept;
        // from a layer to the length of a cell, in a geometric series
        let layers = ((height / (layer * cell).sqrt()).round() as usize).max(2);
        Some(Self { height, layers, grading: 1.0 / grading(height, layers, layer) })
    }
}

/// Ratio of the last to the first of `count` cells that grow geometrically over `extent` from `first`; 1 where even
/// equal ones are smaller.
fn grading(extent: f64, count: usize, first: f64) -> f64 {
    let first_of = |ratio: f64| {
        let growth = ratio.powf(1.0 / (count - 1) as f64);
        extent * (growth - 1.0) / (growth.powi(count as i32) - 1.0)
    };
    let (mut low, mut high) = (1.0 + 1e-6, 1e3);
    if first_of(low) <= first {
        return 1.0;
    }
    for _ in 0..60 {
        let middle = f64::sqrt(low * high);
        if first_of(middle) > first { low = middle } else { high = middle }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deep_water_has_few_layers_that_meet_those_around_the_hull() {
        assert_eq!(Deep::below(0.3, 0.868, 0.034, 0.114), None);
        let deep = Deep::below(1.0, 0.868, 0.034, 0.114).expect("deep");
        let growth = deep.grading.powf(1.0 / (deep.layers - 1) as f64);
        let lowest = 0.034 / deep.grading;
        let sum: f64 = (0..deep.layers).map(|i| lowest * growth.powi(i as i32)).sum();
        assert!((sum - deep.height).abs() < 1e-6 && lowest < 0.2, "{deep:?}");
        assert!((deep.height - (1.0 - 0.25 * 0.868)).abs() < 1e-12);
    }

    #[test]
    fn graded_cells_start_as_asked_and_fill_the_extent() {
        let (extent, count, first) = (2.8, 11, 0.1);
        let growth = grading(extent, count, first).powf(0.1);
        let sum: f64 = (0..count).map(|i| first * growth.powi(i as i32)).sum();
        assert!((sum - extent).abs() < 1e-9, "{sum}");
        assert!((grading(0.4, 4, 0.2) - 1.0).abs() < 1e-12);
    }
}
