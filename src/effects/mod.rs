//! Physical effects, one a file: equation, source, validity, coefficients with their units.
//!
//! Each `add` puts its share onto the force of every surface [N], body frame, in the order of the vehicle's surfaces,
//! and allocates nothing. Hydrostatics (E1) lies in `geometry::hydrostatics`, since it needs nothing but the mesh.

pub mod form_drag;
pub mod skin_friction;
