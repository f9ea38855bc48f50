//! The water is denser than stated: `W = e W_model`, since every load of the model is linear in density.
//!
//! Muddy flood water reaches 1.1 of fresh water (FEMA P-646), mud flows 1.9.

use super::input::{Input, Memory, Part};
use super::law::Law;
use super::spec::{Coefficient, EffectSpec, Quantity};
use crate::wrench::Wrench;

/// An error of the stated density; its law has one form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DensityError;

impl Law for DensityError {
    const SPEC: EffectSpec = EffectSpec {
        name: "density_error",
        summary: "the water is denser than stated",
        equation: "W = e W_model",
        corrects: "every term, in proportion",
        total: "a positive density",
        coefficients: &[Coefficient::new("relative_error", "1", -0.3, 1.0).up_to(0.2)],
        inputs: &[Quantity::ModelWrench],
        experiment: "stand still at three depths, and weigh a liter of the water; a wrong density grows with the depth",
        ..EffectSpec::COMMON
    };

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        emit(0, Part::Hull, input.predicted);
    }
}
