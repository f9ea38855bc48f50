//! Judging weights by states that they have not learnt from: the source paper's tables, beside simple models that were
//! fitted to the same training states, and beside the paper's own figures, which are of other data.
//!
//! Reading order: `held_out` (which states), `states` (what was measured there), `predict` (what a model says), `baseline`,
//! `contest` (several models on the same states), `measure`, `regimes`, `report`, `paper`, `page`.

pub mod baseline;
pub mod contest;
mod error;
pub mod held_out;
pub mod measure;
mod page;
pub mod paper;
pub mod predict;
pub mod regimes;
pub mod report;
pub mod states;

pub use error::EvaluateError;
