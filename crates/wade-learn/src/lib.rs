//! Everything that a model is trained on, trained by and judged by; serving never depends on it.
//!
//! Modules in reading order; each uses only those above it: tools ([`files`], [`page`], [`random`], [`signal`]), what is given
//! ([`published`] figures, [`parameter_table`]), what is read and generated ([`dataset`], [`trials`], [`recordings`]), where the data come from ([`cfd`]), what trains on them ([`train`]), judges by held-out cases
//! ([`evaluate`]) and by measured motion ([`validate`]); all of it from files to files in
//! [`workflow`].

pub mod files;
pub mod page;
pub mod random;
pub mod signal;

pub mod parameter_table;
pub mod published;

pub mod dataset;
pub mod recordings;
pub mod trials;

pub mod cfd;
pub mod evaluate;
pub mod panel_code;
pub mod train;
pub mod validate;

pub mod workflow;
