//! The doors through which queries come: checks, gRPC, shared memory, administration.

pub mod admin;
pub mod grpc;
pub mod http;
pub mod shm;
pub mod shm_layout;
pub mod wire;

use std::time::Instant;

use crate::forces::Forces;
use crate::model::{Model, Workspace};
use wire::{InvalidState, State};

/// Generated from proto/wade/v1.
pub mod proto {
    #![allow(missing_docs, clippy::all, reason = "generated; the comments are in the .proto files")]
    tonic::include_proto!("wade.v1");

    /// The descriptors of everything in proto/, for reflection.
    pub const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/descriptors.bin"));
}

/// What every transport does between its checks and its answer. Owned by one thread.
#[derive(Debug, Default)]
pub struct Evaluator {
    workspace: Workspace,
    forces: Forces,
}

/// An answer that lives in its [`Evaluator`].
#[derive(Debug)]
pub struct Evaluated<'e> {
    /// The forces.
    pub forces: &'e Forces,
    /// Time from the checked state to the forces [ns].
    pub compute_ns: u64,
}

impl Evaluator {
    /// Checks a state and answers it.
    pub fn evaluate(&mut self, model: &Model, state: &State) -> Result<Evaluated<'_>, InvalidState> {
        let condition = state.check()?;
        let start = Instant::now();
        model.evaluate(&condition, &mut self.workspace, &mut self.forces);
        Ok(Evaluated { forces: &self.forces, compute_ns: nanoseconds_since(start) })
    }
}

/// Nanoseconds since an instant.
pub fn nanoseconds_since(start: Instant) -> u64 {
    u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX)
}
