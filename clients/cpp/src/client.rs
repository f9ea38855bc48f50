//! A client over any transport.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use wade_client::Address;
use wade_wire::shm::Wait;
use wade_wire::{DERIVATIVES, InvalidState};

use crate::abi::{WADE_MAX_BATCH, WADE_NEVER, WadeBatch, WadeForces, WadeState, WadeStatus};
use crate::bounded::Budget;
use crate::connection::Connection;
use crate::convert::checked;
use crate::credentials::CredentialFiles;
use crate::grpc::Grpc;
use crate::known::Known;
use crate::last::nanoseconds_since;
use crate::shm::Shm;

/// Derivatives of force and moment by rows.
pub type Jacobian = [f32; DERIVATIVES];

/// Longest budget that the clock is asked for.
const DAY: Duration = Duration::from_secs(86_400);

/// A client of one vehicle of one server. Any number of threads may call it; their calls are answered one at a time.
pub struct WadeClient {
    transport: Transport,
    known: Arc<Known>,
    max_batch: usize,
    /// When the last batch was asked that was answered.
    batch_asked: Mutex<Option<Instant>>,
}

enum Transport {
    Shm(Shm),
    Grpc(Grpc),
}

impl WadeClient {
    /// Starts to look for the server. None where an option is wrong or the system gives no thread.
    pub fn open(
        address: &Address,
        vehicle: &str,
        credentials: CredentialFiles,
        wait: Wait,
        max_batch: u32,
    ) -> Option<Self> {
        if vehicle.is_empty() || max_batch > WADE_MAX_BATCH {
            return None;
        }
        let max_batch = max_batch as usize;
        let known = Arc::new(Known::new());
        let of_transport = Arc::clone(&known);
        let transport = match address {
            Address::Shm(namespace) => {
                Transport::Shm(Shm::open(namespace, vehicle, wait, max_batch, of_transport).ok()?)
            }
            Address::Tcp(_) | Address::Tls(_) | Address::Unix(_) => Transport::Grpc(
                Grpc::open(address.url()?, vehicle, credentials, max_batch, of_transport).ok()?,
            ),
        };
        Some(Self { transport, known, max_batch, batch_asked: Mutex::default() })
    }

    /// Whether it is connected.
    pub fn connection(&self) -> &Connection {
        &self.known.connection
    }

    /// The forces in a state, or the last ones, and their derivatives where there is room for them.
    pub fn evaluate(
        &self,
        state: &WadeState,
        budget_ns: u64,
        forces: &mut WadeForces,
        jacobian: Option<&mut Jacobian>,
    ) -> WadeStatus {
        let budget = budget(budget_ns);
        let valid = match checked(state) {
            Ok(valid) => valid,
            Err(invalid) => {
                self.known.last.get(forces);
                forces.blame(&invalid);
                return WadeStatus::InvalidState;
            }
        };
        match &self.transport {
            Transport::Shm(client) => client.evaluate(&valid, state.session, budget, (forces, jacobian)),
            Transport::Grpc(client) => client.evaluate(&valid, state.session, budget, (forces, jacobian)),
        }
    }

    /// The forces in the states of a batch, or none.
    pub fn evaluate_batch(
        &self,
        states: &[WadeState],
        budget_ns: u64,
        forces: &mut [WadeForces],
        batch: &mut WadeBatch,
    ) -> WadeStatus {
        let budget = budget(budget_ns);
        *batch = WadeBatch::default();
        if states.is_empty() || states.len() > self.max_batch {
            return WadeStatus::InvalidArgument;
        }
        let invalid =
            states.iter().enumerate().find_map(|(index, state)| Some((index, checked(state).err()?)));
        let status = match (invalid, &self.transport) {
            (Some((index, invalid)), _) => batch.blame(index, &invalid),
            (None, Transport::Shm(client)) => client.evaluate_batch(states, budget, (forces, batch)),
            (None, Transport::Grpc(client)) => client.evaluate_batch(states, budget, (forces, batch)),
        };
        if let Some(mut asked) = crate::bounded::lock_until(&self.batch_asked, budget.deadline) {
            if status == WadeStatus::Ok {
                *asked = Some(budget.start);
            }
            batch.age_ns = asked.map_or(WADE_NEVER, nanoseconds_since);
        }
        status
    }

    /// Ends the client's thread.
    pub fn close(self) {
        match self.transport {
            Transport::Shm(client) => client.close(),
            Transport::Grpc(client) => client.close(),
        }
    }
}

/// The budget of a call that begins now.
fn budget(budget_ns: u64) -> Budget {
    let start = Instant::now();
    Budget { start, deadline: start + Duration::from_nanos(budget_ns).min(DAY) }
}

impl Default for WadeBatch {
    fn default() -> Self {
        Self { age_ns: WADE_NEVER, invalid_index: 0, invalid_field: 0, invalid_problem: 0, reserved: 0 }
    }
}

impl WadeBatch {
    /// Names what is wrong with which state.
    pub fn blame(&mut self, index: usize, invalid: &InvalidState) -> WadeStatus {
        self.invalid_index = index as u32;
        (self.invalid_field, self.invalid_problem) = (invalid.field as u32, invalid.problem as u32);
        WadeStatus::InvalidState
    }
}
