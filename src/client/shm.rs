//! The shared-memory client: polls or sleeps for its answer, and finds a server again that was killed and restarted.

use std::hash::{BuildHasher, RandomState};
use std::time::{Duration, Instant};

use iceoryx2::node::Node;
use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::client::Client;
use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::port_name::PortName;
use iceoryx2::prelude::{ZeroCopySend, ipc};

use super::{ClientError, EffectReply, Reply, SurfaceReply};
use crate::effects::{Effect, LeftOut};
use crate::service::shm::{self, ShmError, Wait};
use crate::service::shm_layout::{
    Answer, BatchAnswer, BatchHeader, BatchQuery, EffectAnswer, HAS_ADDED_MASS, MAX_BATCH, Names, Query,
    SERVER_POLLS, Status, wake_name,
};
use crate::service::wire::State;
use crate::vehicle::MAX_SURFACES;

/// Spins this often between two looks at the clock.
const SPINS_PER_LOOK: u32 = 64;

/// A client of one vehicle, owned by one thread.
#[derive(Debug)]
pub struct ShmClient {
    names: Names,
    vehicle: String,
    wait: Wait,
    timeout: Duration,
    sequence: u64,
    session: u64,
    link: Option<Link>,
}

/// What lasts until the server is lost. The ports come before the node, so that they go first.
#[derive(Debug)]
struct Link {
    single: Client<ipc::Service, Query, (), Answer, ()>,
    batch: Client<ipc::Service, BatchQuery, (), BatchAnswer, ()>,
    wake: Notifier<ipc::Service>,
    sleep: Option<(Listener<ipc::Service>, u64)>,
    server_polls: bool,
    _node: Node<ipc::Service>,
}

impl ShmClient {
    /// A client that connects with its first call. `timeout` bounds each call [s].
    pub fn new(vehicle: &str, wait: Wait, timeout: Duration) -> Self {
        let names = Names::new(shm::NAMESPACE);
        Self { names, vehicle: vehicle.to_owned(), wait, timeout, sequence: 0, session: 0, link: None }
    }

    /// Takes the states from now on for a run of this number, one after the other, so that effects remember; 0 for none.
    pub fn in_session(self, session: u64) -> Self {
        Self { session, ..self }
    }

    /// Asks the server of another namespace than the default.
    pub fn in_namespace(self, namespace: &str) -> Self {
        Self { names: Names::new(namespace), ..self }
    }

    /// The forces in one state.
    pub fn evaluate(&mut self, state: &State) -> Result<Answer, ClientError> {
        let session = self.session;
        let answer = self.exchange(|link, sequence, deadline| {
            let wake_key = link.wake_key();
            let query = Query { sequence, wake_key, session, ..Query::from(state) };
            let pending = link.single.send_copy(query).map_err(|error| link.lost(&error))?;
            link.notify();
            let taken = || pending.receive().map(|response| response.map(|response| *response));
            let answer = link.await_answer(deadline, &pending, taken)?;
            link.server_polls = answer.flags & SERVER_POLLS != 0;
            Ok(answer)
        })?;
        match answer.refusal() {
            Some(invalid) => Err(invalid.into()),
            None if answer.status == Status::Ok as u32 => Ok(answer),
            None => Err(unknown_status(answer.status)),
        }
    }

    /// The forces in each state of a batch.
    pub fn evaluate_batch(&mut self, states: &[State]) -> Result<Vec<Answer>, ClientError> {
        self.exchange_batch(states, |answer| answer.answers[..states.len()].to_vec())
    }

    /// The server's own time for a batch [ns].
    pub fn compute_batch(&mut self, states: &[State]) -> Result<u64, ClientError> {
        self.exchange_batch(states, |answer| answer.compute_ns)
    }

    fn exchange_batch<T>(
        &mut self,
        states: &[State],
        take: impl Fn(&BatchAnswer) -> T,
    ) -> Result<T, ClientError> {
        let len = states.len();
        if len > MAX_BATCH {
            return Err(ClientError::BatchTooLong { len, limit: MAX_BATCH });
        }
        let mut queries = Box::new([Query::default(); MAX_BATCH]);
        for (query, state) in queries.iter_mut().zip(states) {
            *query = Query { session: self.session, ..Query::from(state) };
        }
        self.exchange(|link, sequence, deadline| {
            let header = BatchHeader { sequence, wake_key: link.wake_key(), count: len as u32, reserved: 0 };
            let query = BatchQuery { header, queries: *queries };
            let pending = link.batch.send_copy(query).map_err(|error| link.lost(&error))?;
            link.notify();
            let taken = || {
                let of = |answer: &BatchAnswer| {
                    let refusal = answer.answers[answer.index as usize % MAX_BATCH].refusal();
                    (answer.flags, answer.status, refusal, take(answer))
                };
                pending.receive().map(|response| response.map(|answer| of(&answer)))
            };
            let (flags, status, refusal, taken) = link.await_answer(deadline, &pending, taken)?;
            link.server_polls = flags & SERVER_POLLS != 0;
            match refusal {
                _ if status == Status::Ok as u32 => Ok(taken),
                Some(invalid) => Err(invalid.into()),
                None if status == Status::InvalidBatch as u32 => Err(ClientError::Refused {
                    code: "InvalidArgument".into(),
                    message: "the batch is empty or too long".into(),
                }),
                None => Err(unknown_status(status)),
            }
        })
    }

    /// One call on a link that is opened where there is none and given up where nobody answers.
    fn exchange<T>(
        &mut self,
        call: impl FnOnce(&mut Link, u64, Instant) -> Result<T, ClientError>,
    ) -> Result<T, ClientError> {
        let deadline = Instant::now() + self.timeout;
        self.sequence += 1;
        let link = match &mut self.link {
            Some(link) => link,
            None => self.link.insert(Link::open(&self.names, &self.vehicle, self.wait)?),
        };
        let result = call(link, self.sequence, deadline);
        match &result {
            Err(ClientError::Timeout(_)) => {
                self.link = None;
                // the deadline is the caller's measure, not the time that was left
                return Err(ClientError::Timeout(self.timeout));
            }
            Err(ClientError::NoServer { .. }) => self.link = None,
            _ => {}
        }
        result
    }
}

impl Link {
    fn open(names: &Names, vehicle: &str, wait: Wait) -> Result<Self, ClientError> {
        let name = names.evaluate(vehicle);
        let no_server =
            |error: ShmError| ClientError::NoServer { at: name.clone(), reason: error.to_string() };
        Self::try_open(names, vehicle, wait).map_err(no_server)?.ok_or_else(|| ClientError::NoServer {
            at: name,
            reason:
                "no server has opened this service; is wade serve running with shm.enabled and this vehicle?"
                    .into(),
        })
    }

    fn try_open(names: &Names, vehicle: &str, wait: Wait) -> Result<Option<Self>, ShmError> {
        let node = shm::node()?;
        let Some(single) = shm::open::<Query, Answer>(&node, &names.evaluate(vehicle))? else {
            return Ok(None);
        };
        let Some(batch) = shm::open::<BatchQuery, BatchAnswer>(&node, &names.evaluate_batch(vehicle))? else {
            return Ok(None);
        };
        let single = single.client_builder().create().map_err(|error| ShmError::new("a client")(&error))?;
        let batch = batch.client_builder().create().map_err(|error| ShmError::new("a client")(&error))?;
        let wake = shm::events(&node, &names.wake())?.notifier_builder().create();
        let wake = wake.map_err(|error| ShmError::new("a notifier")(&error))?;
        let sleep = (wait == Wait::Block).then(|| listener(&node, names)).transpose()?;
        Ok(Some(Self { single, batch, wake, sleep, server_polls: false, _node: node }))
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

    fn lost(&self, error: &impl std::fmt::Debug) -> ClientError {
        ClientError::NoServer { at: "shared memory".into(), reason: format!("{error:?}") }
    }

    fn await_answer<T, Q, A, E: std::fmt::Debug>(
        &mut self,
        deadline: Instant,
        pending: &PendingResponse<ipc::Service, Q, (), A, ()>,
        mut taken: impl FnMut() -> Result<Option<T>, E>,
    ) -> Result<T, ClientError>
    where
        Q: ZeroCopySend + std::fmt::Debug + 'static,
        A: ZeroCopySend + std::fmt::Debug + 'static,
    {
        if pending.number_of_server_connections() == 0 {
            return Err(ClientError::NoServer {
                at: "shared memory".into(),
                reason: "the server is gone".into(),
            });
        }
        loop {
            for _ in 0..SPINS_PER_LOOK {
                if let Some(answer) = taken().map_err(|error| self.lost(&error))? {
                    return Ok(answer);
                }
                if self.sleep.is_some() {
                    break;
                }
                std::hint::spin_loop();
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(ClientError::Timeout(left));
            }
            if let Some((listener, _)) = &mut self.sleep {
                // less than a microsecond would mean no limit to the system call
                match listener.timed_wait(|_| {}, left.max(Duration::from_micros(1))) {
                    Ok(_) | Err(ListenerWaitError::InterruptSignal) => {}
                    Err(error) => return Err(self.lost(&error)),
                }
            }
        }
    }
}

/// A code that a newer server of the same layout may send.
fn unknown_status(status: u32) -> ClientError {
    ClientError::Refused {
        code: "Unknown".into(),
        message: format!("status {status}; is the client up to date?"),
    }
}

/// A listener under a name that no other client has.
fn listener(node: &Node<ipc::Service>, names: &Names) -> Result<(Listener<ipc::Service>, u64), ShmError> {
    // the standard library's hasher is seeded at random in each process, and anew for each instance
    let key = RandomState::new().hash_one(std::process::id()).max(1);
    let error = |error: &dyn std::fmt::Display| ShmError::new("a listener")(error);
    let name = PortName::new(&wake_name(key)).map_err(|e| error(&format!("{e:?}")))?;
    let listener = shm::events(node, &names.done())?.listener_builder().name(&name).create();
    Ok((listener.map_err(|e| error(&e))?, key))
}

impl From<&Answer> for Reply {
    fn from(answer: &Answer) -> Self {
        let surface = |i: usize| SurfaceReply {
            force: answer.surface_force_n[i],
            point: answer.surface_point_m[i],
            wetted_fraction: answer.wetted_fraction[i],
        };
        let effect = |slot: &EffectAnswer| {
            Some(EffectReply {
                effect: Effect::from_code(slot.effect)?,
                force: slot.force_n,
                moment: slot.moment_nm,
                left_out: LeftOut::from_code(slot.left_out),
            })
        };
        let surface_count = (answer.surface_count as usize).min(MAX_SURFACES);
        Self {
            version: answer.bundle_version,
            provenance: answer.provenance().to_owned(),
            surfaces: (0..surface_count).map(surface).collect(),
            force: answer.force_n,
            moment: answer.moment_nm,
            about: answer.about_m,
            uncertainty: answer.uncertainty_n,
            outside: answer.outside(),
            effects: answer.effects.iter().take(answer.effect_count as usize).filter_map(effect).collect(),
            effect_surface_forces: match answer.effect_count {
                0 => Vec::new(),
                _ => answer.effect_surface_force_n[..surface_count].to_vec(),
            },
            effects_outside: answer.effects_outside.map(f64::from),
            added_mass: (answer.flags & HAS_ADDED_MASS != 0).then_some(answer.added_mass),
            compute_ns: answer.compute_ns,
        }
    }
}
