//! A hull as panels of about one size that share their corners, as a boundary-element code wants them.
//!
//! Surface nets (Gibson 1998, Constrained elastic surface nets): a corner in each cell of a cubic grid that the surface
//! crosses, at the mean of its crossings with the edges of the cell; a panel across each crossed edge. The surface is that at
//! a constant distance outside the hull, which closes gaps of up to twice the distance: the water in them moves with the hull.
//! The distance is chosen so that the panels displace as much as the hull.

use wade_core::frame::{Vec3, WaterPlane};
use wade_core::geometry::distance::signed_distances;
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::geometry::mesh::Mesh;

/// Gap between parts that is closed wherever it lies, over the length of a cell [-].
const LEAST_GAP: f64 = 0.03;
/// Largest gap that is closed for the volume, over the length of a cell [-].
const MOST_GAP: f64 = 0.6;
/// Most by which the displaced volume of the panels may miss that of the hull [-].
const MOST_MISSED: f64 = 0.03;
/// Factor by which the cells of the grid grow until few enough panels are left and they displace the volume.
const GROWTH: f64 = 1.05;
/// Cells that are tried on either side of the expected one.
const STEPS: i32 = 10;

/// A panel: corners counter-clockwise seen from outside, the last one twice in a triangle; body frame [m].
pub type Panel = [[f64; 3]; 4];

/// Why a hull has no panels.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "{most} panels, of {cell:.3} m, displace {share:.2} times the volume of the hull: it has walls or parts thinner than a panel"
)]
pub struct Unresolved {
    most: usize,
    cell: f64,
    share: f64,
}

impl Unresolved {
    fn missed(&self) -> f64 {
        (self.share - 1.0).abs()
    }
}

/// At most `most` panels of the wet part of an upright hull in level water; heights over the body origin [m].
pub fn wet_panels(mesh: &Mesh, level: f64, most: usize) -> Result<Vec<Panel>, Unresolved> {
    let plane = WaterPlane::level(level, 0.0);
    let volume = hydrostatics(mesh, &plane, 1.0, &Vec3::zeros()).displaced_volume;
    let mut cell = (mesh.area() / most as f64).sqrt() / GROWTH.powi(STEPS);
    let mut nearest: Option<Unresolved> = None;
    loop {
        let Some(grid) = Grid::new(mesh, cell) else { return Ok(Vec::new()) };
        let panels = grid.displacing(level, volume);
        if panels.len() <= most {
            let this = Unresolved { most, cell, share: displaced(&panels, level) / volume };
            if this.missed() < MOST_MISSED {
                return Ok(panels);
            }
            let nearest = nearest.get_or_insert(this);
            if this.missed() < nearest.missed() {
                *nearest = this;
            }
        }
        if let Some(nearest) = nearest.filter(|nearest| cell > nearest.cell * GROWTH.powi(STEPS)) {
            return Err(nearest);
        }
        cell *= GROWTH;
    }
}

/// Signed distances to a hull at the points of a grid that is symmetric about y = 0.
struct Grid {
    cell: f64,
    first: Vec3,
    shape: [usize; 3],
    distances: Vec<f64>,
}

impl Grid {
    fn new(mesh: &Mesh, cell: f64) -> Option<Self> {
        let bounds = mesh.bounds()?;
        let mut middle = bounds.center();
        middle.y = 0.0;
        let half = (bounds.max - middle).sup(&(middle - bounds.min));
        // a point beyond the surface on each side
        let counts = half.map(|x| (x / cell).ceil() + 2.0);
        let first = middle - (counts - Vec3::repeat(0.5)) * cell;
        let shape: [usize; 3] = counts.map(|count| 2 * count as usize).into();
        let [nx, ny, nz] = shape;
        let points: Vec<Vec3> = (0..nz)
            .flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
            .map(|index| first + Vec3::from(index.map(|i| i as f64)) * cell)
            .collect();
        let distances = signed_distances(mesh, &points).ok()?;
        Some(Self { cell, first, shape, distances })
    }

    /// The panels under a level whose distance from the hull makes them displace a volume, as far as a distance does.
    fn displacing(&self, level: f64, volume: f64) -> Vec<Panel> {
        let [mut low, mut high] = [LEAST_GAP, MOST_GAP].map(|gap| 0.5 * gap * self.cell);
        let at = |outside: f64| below(&self.panels(outside), level);
        let nearest = at(low);
        if displaced(&nearest, level) >= volume {
            return nearest;
        }
        for _ in 0..12 {
            let middle = 0.5 * (low + high);
            if displaced(&at(middle), level) < volume { low = middle } else { high = middle }
        }
        at(high)
    }

    fn value(&self, [i, j, k]: [usize; 3]) -> f64 {
        self.distances[i + self.shape[0] * (j + self.shape[1] * k)]
    }

    /// The closed surface at a distance outside the hull.
    fn panels(&self, outside: f64) -> Vec<Panel> {
        let value = |index: [usize; 3]| self.value(index) - outside;
        let [nx, ny, nz] = self.shape;
        let mut panels = Vec::new();
        // the first and last points lie outside: an edge between others has four cells round it
        for k in 1..nz - 1 {
            for j in 1..ny - 1 {
                for i in 1..nx - 1 {
                    let at = [i, j, k];
                    let is_inside = value(at) < 0.0;
                    for axis in 0..3 {
                        let mut next = at;
                        next[axis] += 1;
                        if (value(next) < 0.0) == is_inside {
                            continue;
                        }
                        let corner = |[du, dv]: [usize; 2]| {
                            let mut cell = at;
                            cell[(axis + 1) % 3] -= du;
                            cell[(axis + 2) % 3] -= dv;
                            self.corner(cell, outside).into()
                        };
                        let mut round = [[1, 1], [0, 1], [0, 0], [1, 0]];
                        if !is_inside {
                            round.reverse();
                        }
                        panels.push(round.map(corner));
                    }
                }
            }
        }
        panels
    }

    /// The mean of the crossings of the surface with the edges of a cell.
    fn corner(&self, cell: [usize; 3], outside: f64) -> Vec3 {
        let (mut sum, mut count) = (Vec3::zeros(), 0.0);
        for axis in 0..3 {
            for [u, v] in [[0, 0], [0, 1], [1, 0], [1, 1]] {
                let mut from = cell;
                from[(axis + 1) % 3] += u;
                from[(axis + 2) % 3] += v;
                let mut to = from;
                to[axis] += 1;
                let (a, b) = (self.value(from) - outside, self.value(to) - outside);
                if (a < 0.0) != (b < 0.0) {
                    let start = Vec3::from(from.map(|i| i as f64));
                    sum += start + Vec3::ith(axis, a / (a - b));
                    count += 1.0;
                }
            }
        }
        self.first + sum * (self.cell / count)
    }
}

/// The parts of panels below a level.
fn below(panels: &[Panel], level: f64) -> Vec<Panel> {
    let mut wet = Vec::with_capacity(panels.len());
    for panel in panels {
        let mut polygon = Vec::with_capacity(5);
        for (from, to) in panel.iter().zip(panel.iter().cycle().skip(1)) {
            if from[2] <= level {
                polygon.push(*from);
            }
            if (from[2] < level && to[2] > level) || (from[2] > level && to[2] < level) {
                let share = (level - from[2]) / (to[2] - from[2]);
                let across = |i: usize| from[i] + share * (to[i] - from[i]);
                polygon.push([across(0), across(1), level]);
            }
        }
        match polygon[..] {
            [a, b, c] => wet.push([a, b, c, c]),
            [a, b, c, d] => wet.push([a, b, c, d]),
            [a, b, c, d, e] => wet.extend([[a, b, c, d], [a, d, e, e]]),
            _ => {}
        }
    }
    wet
}

/// Volume between panels and the water surface that closes them [m3].
fn displaced(panels: &[Panel], level: f64) -> f64 {
    let arm = |corner: [f64; 3]| Vec3::from(corner) - Vec3::z() * level;
    panels
        .iter()
        .map(|corners| {
            let [a, b, c, d] = corners.map(arm);
            (a.dot(&b.cross(&c)) + a.dot(&c.cross(&d))) / 6.0
        })
        .sum()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::collections::HashMap;

    use wade_core::geometry::mesh::Bounds;
    use wade_core::geometry::parametric::{cuboid, sphere};

    use super::*;

    fn block(min: [f64; 3], max: [f64; 3]) -> Mesh {
        cuboid(&Bounds { min: min.into(), max: max.into() })
    }

    /// Edges that no panel shares in the other direction.
    fn open_edges(panels: &[Panel]) -> usize {
        let key = |corner: [f64; 3]| corner.map(f64::to_bits);
        let mut edges = HashMap::<_, i32>::new();
        for panel in panels {
            for (from, to) in panel.iter().zip(panel.iter().cycle().skip(1)) {
                *edges.entry((key(*from), key(*to))).or_default() += 1;
                *edges.entry((key(*to), key(*from))).or_default() -= 1;
            }
        }
        edges.values().filter(|count| **count != 0).count()
    }

    #[test]
    fn a_covered_sphere_is_closed_and_displaces_its_volume() {
        let panels = wet_panels(&sphere(&Vec3::zeros(), 0.5, 48), 1.0, 400).unwrap();
        assert!((200..=400).contains(&panels.len()), "{}", panels.len());
        assert_eq!(open_edges(&panels), 0);
        let volume = std::f64::consts::PI / 6.0;
        assert!((displaced(&panels, 0.0) / volume - 1.0).abs() < MOST_MISSED);
        assert!((displaced(&panels, 7.0) - displaced(&panels, 0.0)).abs() < 1e-9, "closed");
    }

    #[test]
    fn a_gap_between_parts_is_closed_and_the_waterline_is_open() {
        let mut mesh = block([-0.5, -0.4, -0.2], [0.5, -0.002, 0.2]);
        mesh.append(&block([-0.5, 0.002, -0.2], [0.5, 0.4, 0.2]));
        let panels = wet_panels(&mesh, 0.05, 400).unwrap();
        assert!(panels.iter().flatten().all(|corner| corner[2] <= 0.05));
        let inside = panels
            .iter()
            .filter(|panel| panel.iter().all(|corner| corner[1].abs() < 0.1 && corner[2] > -0.1));
        assert!(
            inside.clone().all(|panel| panel.iter().all(|corner| corner[0].abs() > 0.4)),
            "a wall in the gap"
        );
        let mirrored = |panel: &Panel| panel.map(|[x, y, z]| [x, -y, z]);
        for panel in &panels {
            let there = mirrored(panel);
            let is_there = panels.iter().any(|other| {
                there.iter().all(|c| other.iter().any(|d| (0..3).all(|i| (c[i] - d[i]).abs() < 1e-9)))
            });
            assert!(is_there, "{panel:?} has no mirror image");
        }
    }

    #[test]
    fn walls_thinner_than_a_panel_are_refused() {
        let refused = wet_panels(&block([-1.0, -1.0, 0.0], [1.0, 1.0, 0.004]), 0.1, 400).unwrap_err();
        assert!(refused.to_string().contains("thinner than a panel"), "{refused}");
    }
}
