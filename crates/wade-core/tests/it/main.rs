//! What the core promises, a module a promise.

#![allow(clippy::unwrap_used)]

#[path = "../../../../tests/common/bundles.rs"]
mod common;

mod analytic_loads;
mod anchor;
mod bodies;
mod bundle;
mod bundle_files;
mod closed_forms;
mod effects_bundle;
mod effects_served;
mod floods;
mod hydrostatics;
mod jacobian;
mod kernel;
mod kvlcc2;
mod mesh;
mod model;
mod physics;
mod random;
mod release;
mod sea;
mod shipped;
mod stability;
mod submergence;
mod symmetry;
mod wheels;
