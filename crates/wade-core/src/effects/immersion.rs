//! Where the water reaches.

use crate::frame::Vec3;

/// The wet part of a panel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WetPanel {
    /// Share of the panel under water, 0 to 1.
    pub fraction: f64,
    /// Centroid of the wet part [m]; that of the panel when dry.
    pub point: Vec3,
}

/// How far a body is under water; body frame. Reused from state to state: `panels` keeps its memory.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Immersion {
    /// The wet part of each panel.
    pub panels: Vec<WetPanel>,
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
