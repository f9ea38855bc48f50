//! Where the water reaches.

use crate::frame::Vec3;

/// How far a body is under water; body frame. Reused from state to state: `panels` keeps its memory.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Immersion {
    /// Share of each panel under water, 0 to 1.
    pub panels: Vec<f64>,
    /// Volume under water [m3].
    pub volume: f64,
    /// Centroid of that volume [m]; the origin when dry.
    pub center_of_buoyancy: Vec3,
    /// Area that the body cuts out of the water surface [m2].
    pub waterplane_area: f64,
    /// Centroid of that area [m].
    pub waterplane_center: Vec3,
    /// Depth of the water above the ground-contact plane, not below 0 [m].
    pub depth: f64,
}
