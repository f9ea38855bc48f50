//! Condition and vehicle to the network's input rows: the only place that fixes the order of the features.
//!
//! Source: the paper, section "Neural Network Architecture". A row is the surface's 15 features followed by the 12
//! global ones, z = [S, G]. Global features are standardised before they enter the network, surface features are not.

use crate::condition::Condition;
use crate::frame::{GRAVITY, VISCOSITY, Vec3};
use crate::geometry::submergence::Submergence;
use crate::vehicle::{Dimensions, Surface};

/// Names of the global features, in order.
pub const GLOBAL_NAMES: [&str; 12] = [
    "speed",
    "density",
    "depth",
    "vx",
    "vy",
    "vz",
    "froude_length",
    "froude_depth",
    "reynolds",
    "length",
    "width",
    "height",
];

/// Names of the features of a surface, in order: twelve static ones, then three that change with the state.
pub const SURFACE_NAMES: [&str; 15] = [
    "bottom",
    "front",
    "rear",
    "side",
    "wheel",
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "area",
    "submerged_fraction",
    "submerged_depth",
    "projected_area",
];

/// Number of global features.
pub const GLOBAL: usize = GLOBAL_NAMES.len();
/// Number of features of a surface that do not change with the state.
pub const STATIC: usize = SURFACE_NAMES.len() - DYNAMIC;
/// Number of features of a surface that change with the state.
pub const DYNAMIC: usize = 3;
/// Number of features in a row.
pub const INPUTS: usize = GLOBAL + STATIC + DYNAMIC;

/// Characteristic submergence scale of the paper [m].
const SUBMERGENCE_SCALE: f64 = 0.366;

/// The paper clips the depth Froude number "to a finite range" without giving it. 5 lies above its fastest,
/// shallowest case (4 m/s in 0.10 m: 4.04). The length Froude number has the same bound.
const FROUDE_DEPTH_LIMIT: f64 = 5.0;

/// The global features of a state, not yet standardised.
pub fn global(condition: &Condition, dimensions: &Dimensions) -> [f64; GLOBAL] {
    let v = &condition.velocity;
    let speed = v.norm();
    // the vertical component of gravity in the body frame, as the paper takes it
    let gravity = GRAVITY * condition.up.z.abs();
    let froude = |length: f64| if speed == 0.0 { 0.0 } else { speed / (gravity * length).sqrt() };
    [
        speed,
        condition.density,
        condition.depth,
        v.x,
        v.y,
        v.z,
        froude(dimensions.length).min(FROUDE_DEPTH_LIMIT),
        froude(condition.depth).min(FROUDE_DEPTH_LIMIT),
        condition.density * speed * dimensions.length / VISCOSITY * 1e-6,
        dimensions.length,
        dimensions.width,
        dimensions.height,
    ]
}

/// The features of a surface that do not change with the state.
pub fn surface_static(surface: &Surface, dimensions: &Dimensions) -> [f64; STATIC] {
    let mut features = [0.0; STATIC];
    features[surface.kind.network_input()] = 1.0;
    features[5] = surface.centroid.x / dimensions.length;
    features[6] = surface.centroid.y / dimensions.width;
    features[7] = surface.centroid.z / dimensions.height;
    features[8..11].copy_from_slice(surface.normal.as_slice());
    features[11] = surface.area / reference_area(dimensions);
    features
}

/// The features of a surface that change with the state. `direction` is the unit velocity, or zero at rest.
pub fn surface_dynamic(
    surface: &Surface,
    submergence: &Submergence,
    direction: &Vec3,
    dimensions: &Dimensions,
) -> [f64; DYNAMIC] {
    let projected = surface.area * surface.normal.dot(direction).abs();
    [submergence.fraction, submergence.mean_depth / SUBMERGENCE_SCALE, projected / reference_area(dimensions)]
}

/// Unit vector along a velocity, zero where there is none.
pub fn direction(velocity: &Vec3) -> Vec3 {
    velocity.try_normalize(0.0).unwrap_or_else(Vec3::zeros)
}

fn reference_area(dimensions: &Dimensions) -> f64 {
    dimensions.length * dimensions.height
}
