//! Hydrodynamic forces on ground vehicles that drive into water: a vehicle's geometry and weights in, forces on each
//! surface and the net wrench out. No runtime, no server, no data sets; feature `build` adds what makes bundles.
//!
//! Body frame: right-handed FLU (x forward, y left, z up), origin at the center of the hull's bounding box. SI units,
//! radians, forces in N, moments in N m about the center of mass. Depth is the height of the undisturbed water surface
//! above the ground-contact plane at the body origin. Velocity is the vehicle's velocity through the water.
//!
//! Modules in reading order; each uses only those above it:
//! values ([`at`], [`caught`], [`frame`], [`wrench`], [`condition`], [`domain`], [`digest`], [`forces`]), the body ([`geometry`], [`vehicle`]),
//! the inputs of the network and the loads by formula ([`features`], [`effects`], [`analytic`], [`anchor`]), the network ([`model`]),
//! with the effects added to it ([`served`]), its files ([`bundle`]), and how a vehicle stands under its loads ([`stability`]).

pub mod at;
pub mod caught;
pub mod condition;
pub mod digest;
pub mod domain;
pub mod forces;
pub mod frame;
mod lanes;
mod named_enum;
pub mod real;
pub mod sea;
pub mod wrench;

pub mod geometry;
pub mod vehicle;

pub mod analytic;
pub mod anchor;
pub mod effects;
pub mod features;
pub mod physics;

pub mod bundle;
pub mod model;
pub mod served;
pub mod stability;

/// The example of the README compiles and runs.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
