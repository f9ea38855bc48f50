//! What every transport does between its checks and its answer.

use std::time::Instant;

use super::state::CheckedState;
use wade_core::effects::EffectLoads;
use wade_core::forces::Forces;
use wade_core::model::Jacobian;
use wade_core::served::{Loads, ServedVehicle, Session};

/// What every transport does between its checks and its answer. Owned by one thread.
#[derive(Debug, Default)]
pub struct Evaluator {
    loads: Loads,
}

/// An answer that lives in its [`Evaluator`].
#[derive(Debug)]
pub struct Evaluated<'e> {
    /// The forces on the surfaces, and the net wrench.
    pub forces: &'e Forces,
    /// The share of the effects.
    pub effects: &'e EffectLoads,
    /// Derivatives of the net wrench, where they were asked for.
    pub jacobian: Option<&'e Jacobian>,
    /// Time from the checked state to the forces [ns].
    pub compute_ns: u64,
}

impl Evaluator {
    /// Answers a state. Effects that remember live in the session; without one they are left out.
    pub fn evaluate(
        &mut self,
        vehicle: &ServedVehicle,
        state: &CheckedState,
        session: Option<&mut Session>,
    ) -> Evaluated<'_> {
        let start = Instant::now();
        vehicle.evaluate(state.condition(), state.circumstances(), session, &mut self.loads);
        let Loads { forces, effects, jacobian, .. } = &self.loads;
        Evaluated { forces, effects, jacobian: jacobian.as_ref(), compute_ns: nanoseconds_since(start) }
    }
}

/// Nanoseconds since an instant.
pub fn nanoseconds_since(start: Instant) -> u64 {
    u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX)
}
