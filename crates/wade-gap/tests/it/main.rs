//! What the gap workflow promises, a module a promise.

#![allow(clippy::unwrap_used)]

mod planted;

mod calibration;
mod driven;
mod explanations;
mod gap_recovery;
mod moments;
mod refusals;
mod sampling;
