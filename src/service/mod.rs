//! The doors through which queries come: checks, gRPC, shared memory, administration.

pub mod accounts;
pub mod admin;
pub mod answer;
pub mod grpc;
pub mod health;
pub mod http;
pub mod intake;
pub mod occupant;
mod sessions;
pub mod shm;
mod shm_convert;
pub mod shm_layout;
pub(crate) mod shm_owner;
pub(crate) mod shm_probe;
pub(crate) mod shm_remains;
pub(crate) mod shm_room;
pub(crate) mod shm_served;
pub mod wire;

use std::time::Instant;

use crate::effects::{EffectLoads, Session};
use crate::forces::Forces;
use crate::model::Workspace;
use crate::served::{Loads, ServedVehicle};
use wire::{InvalidState, State};

/// Generated from proto/wade/v1.
pub mod proto {
    #![allow(missing_docs, clippy::all, reason = "generated; the comments are in the .proto files")]
    tonic::include_proto!("wade.v1");

    /// Generated from proto/inference.
    pub mod inference {
        tonic::include_proto!("inference");
    }

    /// The descriptors of everything in proto/, for reflection.
    pub const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/descriptors.bin"));
}

/// What every transport does between its checks and its answer. Owned by one thread.
#[derive(Debug, Default)]
pub struct Evaluator {
    workspace: Workspace,
    loads: Loads,
}

/// An answer that lives in its [`Evaluator`].
#[derive(Debug)]
pub struct Evaluated<'e> {
    /// The forces on the surfaces, and the net wrench.
    pub forces: &'e Forces,
    /// The share of the effects.
    pub effects: &'e EffectLoads,
    /// Time from the checked state to the forces [ns].
    pub compute_ns: u64,
}

impl Evaluator {
    /// Checks a state and answers it. Effects that remember live in the session; without one they are left out.
    pub fn evaluate(
        &mut self,
        vehicle: &ServedVehicle,
        state: &State,
        session: Option<&mut Session>,
    ) -> Result<Evaluated<'_>, InvalidState> {
        let condition = state.check()?;
        let circumstances = state.circumstances()?;
        let start = Instant::now();
        vehicle.evaluate(&condition, &circumstances, session, &mut self.workspace, &mut self.loads);
        let Loads { forces, effects, .. } = &self.loads;
        Ok(Evaluated { forces, effects, compute_ns: nanoseconds_since(start) })
    }
}

/// Nanoseconds since an instant.
pub fn nanoseconds_since(start: Instant) -> u64 {
    u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX)
}
