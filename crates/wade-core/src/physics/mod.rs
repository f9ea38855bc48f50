//! The physical base: loads on a closed hull in any state, with no learned number.
//!
//! [`base`] sums what the modules before it compute: [`elements`] of the hull, [`drag`] on each, and [`radiation`], the
//! table of added mass and waves over the [`immersion`] of the hull, which [`panel`] estimates from the hull alone.

pub mod base;
pub mod drag;
pub mod elements;
pub mod immersion;
pub mod panel;
pub mod radiation;

pub use base::{Base, BaseLoads, Memory, Motion, Physics, STATED_NONE, origin_from};
pub use radiation::Radiation;
