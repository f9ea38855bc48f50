//! Geometry of a hull: from an STL file to the quantities that the forces are computed from.
//!
//! Everything here is in SI units; after `vehicle::build` it is in the body frame as well.
//! Reading order: `mesh` and `stl` (triangles in and out), `parts`, `tidy`, `watertight` and `seal` (refuse or repair), `surfaces`
//! (named patches), `immersion` and `hydrostatics` (clipping at the water plane, pressure), `submergence` (samples),
//! `flats` and `wetting` (pressure and wet area in the time of a query), `distance` (signed distance grid), `parametric` (closed parts by formula).

pub mod distance;
mod flats;
pub mod hydrostatics;
pub mod immersion;
pub mod mesh;
#[cfg(feature = "build")]
pub mod parametric;
#[cfg(feature = "build")]
mod parry;
#[cfg(feature = "build")]
pub mod parts;
#[cfg(feature = "build")]
pub mod sampling;
#[cfg(feature = "build")]
pub mod seal;
pub mod stl;
pub mod submergence;
pub mod surfaces;
#[cfg(feature = "build")]
pub mod tidy;
#[cfg(feature = "build")]
pub mod watertight;
pub mod wetting;
