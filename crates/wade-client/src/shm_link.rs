//! What a shared-memory client holds open: it asks, and looks for the answer until a deadline. Opening takes milliseconds and
//! memory; asking and answering take neither.

use std::hash::{BuildHasher, RandomState};
use std::time::{Duration, Instant};

use iceoryx2::config::Config;
use iceoryx2::node::Node;
use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::ReceiveError;
use iceoryx2::port::client::{Client, RequestSendError};
use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::port_name::PortName;
use iceoryx2::prelude::{MessagingPattern, PortFactory as _, ZeroCopySend, ipc_threadsafe};
use iceoryx2::service::Service as _;
use tonic::Code;

use super::ClientError;
use wade_wire::shm::layout::{
    Answer, BatchAnswer, BatchHeader, BatchQuery, JacobianAnswer, Names, Query, SERVER_POLLS, VERSION,
    VehicleAnswer, wake_name,
};
use wade_wire::shm::served::{self, Served};
use wade_wire::shm::{self, OpenError, ShmError, Wait, room};

/// A link may be opened by one thread and used by another.
type Ipc = ipc_threadsafe::Service;

/// Spins this often between two looks at the clock.
const SPINS_PER_LOOK: u32 = 64;

/// The ports to the server of one vehicle; they come before the node, so that they go first.
#[derive(Debug)]
pub struct ShmLink {
    single: Client<Ipc, Query, (), Answer, ()>,
    batch: Client<Ipc, BatchQuery, (), BatchAnswer, ()>,
    /// Opened by whoever asks for derivatives.
    jacobian: Option<Client<Ipc, Query, (), JacobianAnswer, ()>>,
    wake: Notifier<Ipc>,
    sleep: Option<(Listener<Ipc>, u64)>,
    server_polls: bool,
    sequence: u64,
    /// Names this client in its queries.
    owner: u64,
    node: Node<Ipc>,
}

/// A question that is open. Dropped, it is withdrawn.
#[derive(Debug)]
pub struct Asked<Q, A>(PendingResponse<Ipc, Q, (), A, ()>)
where
    Q: ZeroCopySend + std::fmt::Debug + 'static,
    A: ZeroCopySend + std::fmt::Debug + 'static;

/// The link is of no more use: nobody is connected to it, or a port broke.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Lost {
    /// No server is connected.
    #[error("the server is gone")]
    Server,
    /// The port for requests.
    #[error("asking: {0:?}")]
    Send(RequestSendError),
    /// The port for responses.
    #[error("receiving the answer: {0:?}")]
    Receive(ReceiveError),
    /// The listener.
    #[error("waiting for the answer: {0:?}")]
    Wait(ListenerWaitError),
}

impl ShmLink {
    /// Opens the ports to a vehicle's server. Takes milliseconds.
    pub fn open(names: &Names, vehicle: &str, wait: Wait) -> Result<Self, ClientError> {
        let at = || names.evaluate(vehicle);
        let failed = |error: ShmError| ClientError::NoServer { at: at(), reason: error.to_string() };
        // a client that waits for a server looks every now and then: what it does for that is to read a file
        if is_absent(&at()) {
            return Err(why_not(names, vehicle));
        }
        // a page without memory behind it would end the program by SIGBUS when it is first written
        room::check_client().map_err(|error| ClientError::Refused {
            code: Code::ResourceExhausted,
            message: error.to_string(),
        })?;
        let node = shm::node::<Ipc>().map_err(failed)?;
        let not_open = |error: OpenError| match error {
            OpenError::Absent => why_not(names, vehicle),
            OpenError::OtherTypes => {
                let found = format!("{} with other types", at());
                ClientError::Layout { expected: VERSION.into(), found }
            }
            OpenError::Failed(error) => failed(error),
        };
        let single = shm::open::<_, Query, Answer>(&node, &at()).map_err(not_open)?;
        let batch = shm::open::<_, BatchQuery, BatchAnswer>(&node, &names.evaluate_batch(vehicle));
        let batch = batch.map_err(not_open)?;
        if single.dynamic_config().number_of_servers() == 0 {
            // other clients keep the service of a server that is gone
            return Err(why_not(names, vehicle));
        }
        let no_place = |error: &dyn std::fmt::Display| no_place(vehicle, error);
        let single = single.client_builder().create().map_err(|error| no_place(&error))?;
        let batch = batch.client_builder().create().map_err(|error| no_place(&error))?;
        let wake = shm::events(&node, &names.wake()).map_err(failed)?.notifier_builder().create();
        let wake = wake.map_err(|error| no_place(&error))?;
        let sleep = (wait == Wait::Block).then(|| listener(&node, names)).transpose().map_err(failed)?;
        Ok(Self {
            single,
            batch,
            jacobian: None,
            wake,
            sleep,
            server_polls: false,
            sequence: 0,
            owner: drawn(),
            node,
        })
    }

    /// Asks for the forces in one state.
    pub fn ask(&mut self, query: Query) -> Result<Asked<Query, Answer>, Lost> {
        let (sequence, wake_key) = (self.next_sequence(), self.wake_key());
        let pending = self
            .single
            .send_copy(Query { sequence, wake_key, owner: self.owner, ..query })
            .map_err(Lost::Send)?;
        self.notify();
        connected(pending)
    }

    /// What `take` makes of the answer to one state; none where there is none until the deadline. One that has passed means
    /// one look.
    pub fn answer<T>(
        &mut self,
        asked: &Asked<Query, Answer>,
        deadline: Instant,
        take: impl FnOnce(&Answer) -> T,
    ) -> Result<Option<T>, Lost> {
        self.until(deadline, asked, |answer| (answer.flags, take(answer)))
    }

    /// Whether [`Self::open_jacobian`] has opened the port for derivatives.
    pub fn has_jacobian(&self) -> bool {
        self.jacobian.is_some()
    }

    /// Opens the port for derivatives, where it is not open yet. Takes milliseconds.
    pub fn open_jacobian(&mut self, names: &Names, vehicle: &str) -> Result<(), ClientError> {
        if self.jacobian.is_none() {
            let at = names.evaluate_jacobian(vehicle);
            self.jacobian = Some(later_port(&self.node, at, vehicle, "derivatives")?);
        }
        Ok(())
    }

    /// What the server says of the vehicle; none where it does not answer until the deadline. Opens a port for this one
    /// question, which takes milliseconds.
    pub fn describe<T>(
        &mut self,
        names: &Names,
        vehicle: &str,
        deadline: Instant,
        take: impl FnOnce(&VehicleAnswer) -> T,
    ) -> Result<Option<T>, ClientError> {
        let at = names.vehicle(vehicle);
        let lost =
            |lost: Lost| ClientError::NoServer { at: names.vehicle(vehicle), reason: lost.to_string() };
        let port: Client<Ipc, Query, (), VehicleAnswer, ()> =
            later_port(&self.node, at, vehicle, "descriptions")?;
        let (sequence, wake_key) = (self.next_sequence(), self.wake_key());
        let pending = port.send_copy(Query { sequence, wake_key, owner: self.owner, ..Query::UNSET });
        let pending = pending.map_err(|error| lost(Lost::Send(error)))?;
        self.notify();
        let asked = connected(pending).map_err(lost)?;
        self.until(deadline, &asked, |answer| (answer.flags, take(answer))).map_err(lost)
    }

    /// Asks for the forces in one state with their derivatives, once [`Self::open_jacobian`] has opened the port.
    pub fn ask_jacobian(&mut self, query: Query) -> Result<Asked<Query, JacobianAnswer>, Lost> {
        let (sequence, wake_key) = (self.next_sequence(), self.wake_key());
        let port = self.jacobian.as_ref().ok_or(Lost::Server)?;
        let pending =
            port.send_copy(Query { sequence, wake_key, owner: self.owner, ..query }).map_err(Lost::Send)?;
        self.notify();
        connected(pending)
    }

    /// What `take` makes of the answer with derivatives; as [`ShmLink::answer`].
    pub fn answer_jacobian<T>(
        &mut self,
        asked: &Asked<Query, JacobianAnswer>,
        deadline: Instant,
        take: impl FnOnce(&JacobianAnswer) -> T,
    ) -> Result<Option<T>, Lost> {
        self.until(deadline, asked, |page| (page.answer.flags, take(page)))
    }

    /// Asks for the forces in the states of a batch: those of `queries` after the first [`MAX_BATCH`](wade_wire::shm::layout::MAX_BATCH) are left out.
    pub fn ask_batch(
        &mut self,
        queries: impl Iterator<Item = Query>,
    ) -> Result<Asked<BatchQuery, BatchAnswer>, Lost> {
        let (sequence, wake_key) = (self.next_sequence(), self.wake_key());
        let mut slot = self.batch.loan_uninit().map_err(|error| Lost::Send(error.into()))?;
        let batch = shm::in_place(slot.payload_mut());
        batch.header = BatchHeader { sequence, wake_key, ..BatchHeader::UNSET };
        for (place, query) in batch.queries.iter_mut().zip(queries) {
            *place = query;
            batch.header.count += 1;
        }
        let pending = shm::written(slot).send().map_err(Lost::Send)?;
        self.notify();
        connected(pending)
    }

    /// What `take` makes of the answer to a batch; as [`ShmLink::answer`].
    pub fn answer_batch<T>(
        &mut self,
        asked: &Asked<BatchQuery, BatchAnswer>,
        deadline: Instant,
        take: impl FnOnce(&BatchAnswer) -> T,
    ) -> Result<Option<T>, Lost> {
        self.until(deadline, asked, |answer| (answer.flags, take(answer)))
    }

    fn next_sequence(&mut self) -> u64 {
        self.sequence += 1;
        self.sequence
    }

    fn wake_key(&self) -> u64 {
        self.sleep.as_ref().map_or(0, |(_, key)| *key)
    }

    /// Wakes the server, unless its last answer said that it polls.
    fn notify(&self) {
        if !self.server_polls
            && let Err(error) = self.wake.notify()
        {
            tracing::debug!(?error, "waking the server");
        }
    }

    fn until<T, Q, A>(
        &mut self,
        deadline: Instant,
        asked: &Asked<Q, A>,
        take: impl FnOnce(&A) -> (u64, T),
    ) -> Result<Option<T>, Lost>
    where
        Q: ZeroCopySend + std::fmt::Debug + 'static,
        A: ZeroCopySend + std::fmt::Debug + 'static,
    {
        loop {
            let spins = if self.sleep.is_some() { 1 } else { SPINS_PER_LOOK };
            for _ in 0..spins {
                if let Some(answer) = asked.0.receive().map_err(Lost::Receive)? {
                    let (flags, taken) = take(&answer);
                    self.server_polls = flags & SERVER_POLLS != 0;
                    return Ok(Some(taken));
                }
                std::hint::spin_loop();
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            if let Some((listener, _)) = &self.sleep {
                // less than a microsecond would mean no limit to the system call
                match listener.timed_wait(|_| {}, left.max(Duration::from_micros(1))) {
                    Ok(_) | Err(ListenerWaitError::InterruptSignal) => {}
                    Err(error) => return Err(Lost::Wait(error)),
                }
            }
        }
    }
}

fn no_place(vehicle: &str, error: &dyn std::fmt::Display) -> ClientError {
    ClientError::Refused {
        code: Code::ResourceExhausted,
        message: format!("no place for another client of {vehicle}: {error}; the limit is shm.max_clients"),
    }
}

/// A port to a service that servers of the first day do not have.
fn later_port<A: ZeroCopySend + std::fmt::Debug + 'static>(
    node: &Node<Ipc>,
    at: String,
    vehicle: &str,
    what: &str,
) -> Result<Client<Ipc, Query, (), A, ()>, ClientError> {
    let service = shm::open::<_, Query, A>(node, &at).map_err(|error| match error {
        OpenError::Failed(error) => ClientError::NoServer { at, reason: error.to_string() },
        OpenError::Absent | OpenError::OtherTypes => ClientError::Refused {
            code: Code::Unimplemented,
            message: format!(
                "the server has no {what} over shared memory: it is of an earlier version ({at})"
            ),
        },
    })?;
    service.client_builder().create().map_err(|error| no_place(vehicle, &error))
}

fn connected<Q, A>(pending: PendingResponse<Ipc, Q, (), A, ()>) -> Result<Asked<Q, A>, Lost>
where
    Q: ZeroCopySend + std::fmt::Debug + 'static,
    A: ZeroCopySend + std::fmt::Debug + 'static,
{
    if pending.number_of_server_connections() == 0 { Err(Lost::Server) } else { Ok(Asked(pending)) }
}

/// The reason why there is no server for a vehicle: what the one of this namespace tells of itself.
fn why_not(names: &Names, vehicle: &str) -> ClientError {
    match served::served::<Ipc>(names) {
        Some(Served { layout, .. }) if layout != VERSION => {
            ClientError::Layout { expected: VERSION.into(), found: layout }
        }
        Some(Served { vehicles, .. }) if vehicles.iter().all(|served| served != vehicle) => {
            ClientError::UnknownVehicle { vehicle: vehicle.to_owned(), served: vehicles }
        }
        _ => {
            let reason =
                "no server has opened this service; is wade serve running with shm.enabled and this vehicle?";
            ClientError::NoServer { at: names.evaluate(vehicle), reason: reason.into() }
        }
    }
}

/// The error of a vehicle that was unloaded while its ports stayed open.
pub(super) fn not_served(names: &Names, vehicle: &str) -> ClientError {
    let told = served::served::<Ipc>(names);
    let mut served = told.map(|served| served.vehicles).unwrap_or_default();
    // the list may be a moment old
    served.retain(|served| served != vehicle);
    ClientError::UnknownVehicle { vehicle: vehicle.to_owned(), served }
}

/// True where nobody has created a service, as far as one look at its file tells.
fn is_absent(service: &str) -> bool {
    let name = service.try_into();
    name.is_ok_and(|name| {
        matches!(Ipc::details(&name, Config::global_config(), MessagingPattern::RequestResponse), Ok(None))
    })
}

/// A number that no other client has, and that is not 0.
fn drawn() -> u64 {
    // the standard library's hasher is seeded at random in each process, and again for each instance
    RandomState::new().hash_one(std::process::id()).max(1)
}

/// A listener under a name that no other client has.
fn listener(node: &Node<Ipc>, names: &Names) -> Result<(Listener<Ipc>, u64), ShmError> {
    let key = drawn();
    let error = |error: &dyn std::fmt::Display| ShmError::new("a listener")(error);
    let name = PortName::new(&wake_name(key)).map_err(|e| error(&format!("{e:?}")))?;
    let listener = shm::events(node, &names.done())?.listener_builder().name(&name).create();
    Ok((listener.map_err(|e| error(&e))?, key))
}
