//! Hydrodynamic forces on ground vehicles that drive into water: a vehicle's geometry and weights in, forces on each
//! surface and the net wrench out.
//!
//! Body frame: right-handed FLU (x forward, y left, z up), origin at the center of the hull's bounding box. SI units,
//! radians, forces in N, moments in N m about the center of mass. Depth is the height of the undisturbed water surface
//! above the ground-contact plane at the body origin. Velocity is the vehicle's velocity through the water.
//!
//! Modules in reading order; each uses only those above it:
//! values ([`frame`], [`wrench`], [`condition`], [`domain`], [`files`], [`forces`], [`page`], [`random`], [`signal`]), the body ([`geometry`],
//! [`vehicle`]), its inputs to the network and the loads by formula ([`features`], [`effects`], [`analytic`], [`anchor`]),
//! the network ([`model`]), with the effects added to it ([`served`]), its files ([`bundle`]), what serves it ([`engine`], [`metrics`]), what it is learnt from and
//! held against ([`dataset`], [`trials`]), the doors ([`service`], [`client`], [`soak`]), where the data come from
//! ([`cfd`]), what learns it ([`train`]), judges it by held-out cases ([`evaluate`]), holds it against measured motion
//! ([`validate`]), names what it lacks ([`gap`]) and scores tools that name what is missing ([`gap_bench`]), the settings ([`config`]) and the server
//! as a whole ([`server`]).

pub mod condition;
pub mod domain;
pub mod files;
pub mod forces;
pub mod frame;
pub mod page;
pub mod random;
pub mod signal;
pub mod wrench;

pub mod geometry;
pub mod vehicle;

pub mod analytic;
pub mod anchor;
pub mod effects;
pub mod features;

pub mod bundle;
pub mod model;
pub mod served;

pub mod wire;

pub mod dataset;
pub mod engine;
pub mod metrics;
pub mod trials;

pub mod parameter_table;
pub mod published;
pub mod recordings;

pub mod client;
pub mod cores;
pub mod soak;
pub mod states;

pub mod cfd;
pub mod evaluate;
pub mod gap;
pub mod gap_bench;
pub mod train;
pub mod validate;

pub mod config;
pub mod server;
pub mod service;
