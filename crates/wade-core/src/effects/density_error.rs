//! The water is denser than stated: `W = e W_model`, since every load of the model is linear in density.
//!
//! Muddy flood water reaches 1.1 of fresh water (FEMA P-646), mud flows 1.9.

use super::input::{Input, Part};
use crate::wrench::Wrench;

pub(super) fn basis(input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    emit(0, Part::Hull, input.predicted);
}
