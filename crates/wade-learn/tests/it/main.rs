//! What learning and judging promise, a module a promise.

#![allow(clippy::unwrap_used)]

#[path = "../../../../tests/common/bundles.rs"]
mod common;

mod anchored;
mod backwater;
mod dataset;
mod dataset_import;
mod evaluate;
mod gradient;
mod training;
mod trials;
mod validate;
