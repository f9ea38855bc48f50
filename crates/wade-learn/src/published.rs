//! What the source paper reports for its own trials and its own network: other data, to be set beside ours.

use serde::Serialize;

/// How these figures are labelled wherever they stand beside ours.
pub const LABEL: &str = "published, different data";

/// The vehicle of the paper's trials.
pub const VEHICLE: &str = "warthog";

/// R2 of the line through the paper's three buoyancy intercepts.
pub const F0_R2: f64 = 0.973;

/// The width with which the paper's C_D follows from its C_D,eff [m]: the maker's, rounded, not the mesh's 1.391.
pub const WIDTH_M: f64 = 1.38;

/// Speed-matched pairs of the paper.
pub const PAIRS: usize = 177;

/// One depth of the paper's results, section "Experimental Validation".
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PaperDepth {
    /// Depth [m]: 4, 8 or 10 inches.
    pub depth_m: f64,
    /// Planar sections.
    pub sections: usize,
    /// Effective drag parameter [N s2/m2].
    pub c_d_eff: f64,
    /// R2 of its fit.
    pub drag_r2: f64,
    /// Drag coefficient.
    pub c_d: f64,
    /// Mean vertical force [N].
    pub mean_fz_n: f64,
    /// Buoyancy intercept [N].
    pub f0_n: f64,
    /// R2 of its fit, where the paper states it.
    pub fz_r2: Option<f64>,
}

/// The three depths.
pub const DEPTHS: [PaperDepth; 3] = [
    PaperDepth {
        depth_m: 0.1016,
        sections: 29,
        c_d_eff: 49.2,
        drag_r2: 0.995,
        c_d: 0.70,
        mean_fz_n: 442.0,
        f0_n: 280.0,
        fz_r2: Some(0.93),
    },
    PaperDepth {
        depth_m: 0.2032,
        sections: 14,
        c_d_eff: 108.3,
        drag_r2: 0.991,
        c_d: 0.77,
        mean_fz_n: 650.0,
        f0_n: 543.0,
        fz_r2: None,
    },
    PaperDepth {
        depth_m: 0.254,
        sections: 14,
        c_d_eff: 157.7,
        drag_r2: 0.980,
        c_d: 0.90,
        mean_fz_n: 816.0,
        f0_n: 784.0,
        fz_r2: Some(0.23),
    },
];

/// Depths this near are the same fill [m].
const SAME_DEPTH: f64 = 0.01;

/// The paper's figures for a vehicle and a depth, where it has any.
pub fn at(vehicle: &str, depth: f64) -> Option<PaperDepth> {
    let near = |paper: &&PaperDepth| (paper.depth_m - depth).abs() < SAME_DEPTH;
    DEPTHS.iter().find(near).filter(|_| vehicle == VEHICLE).copied()
}
