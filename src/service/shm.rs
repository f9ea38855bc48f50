//! The shared-memory server: one thread that polls or sleeps, copies each request once, checks it and answers.

#![allow(unsafe_code)]

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use iceoryx2::active_request::ActiveRequest;
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::{ListenerKey, Notifier};
use iceoryx2::port::server::Server;
use iceoryx2::prelude::{BackpressureStrategy, CallbackProgression, SignalHandlingMode, ZeroCopySend, ipc};
use iceoryx2::service::port_factory::{event, request_response};
use serde::{Deserialize, Serialize};

use super::shm_layout::{
    Answer, BatchAnswer, BatchQuery, MAX_BATCH, Names, Query, SERVER_POLLS, Status, wake_name,
};
use super::wire::{Refusal, State};
use super::{Evaluator, nanoseconds_since};
use crate::engine::Engine;
use crate::metrics::{Metrics, Recorder, Transport};

/// How the server waits for requests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Wait {
    /// Sleeps until a client wakes it.
    #[default]
    Block,
    /// Polls without pause: the lowest latency, and a core of its own.
    Spin,
}

/// Settings of the shared-memory server.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Whether it runs.
    pub enabled: bool,
    /// How it waits.
    pub wait: Wait,
    /// Most clients of one vehicle at a time.
    pub max_clients: usize,
    /// First part of the services' names; servers beside each other need one each.
    pub namespace: String,
}

impl Default for Config {
    fn default() -> Self {
        Self { enabled: true, wait: Wait::Block, max_clients: 16, namespace: NAMESPACE.into() }
    }
}

/// The namespace unless configured otherwise.
pub const NAMESPACE: &str = "wade";

/// Most sleeping clients that are remembered, and that can be at a time.
const MAX_SLEEPERS: usize = 64;

/// How long the server sleeps at most before it looks for a shutdown and for new vehicles.
const HOUSEKEEPING: Duration = Duration::from_millis(50);

/// Pause after a wait that failed, so that a lasting failure does not spin.
const PAUSE: Duration = Duration::from_millis(1);

/// The shared memory could not be set up.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("shared memory: cannot create {what}: {reason}")]
pub struct ShmError {
    /// Node, service or port.
    pub what: String,
    /// The reason that iceoryx2 gives.
    pub reason: String,
}

impl ShmError {
    pub(crate) fn new(what: impl Into<String>) -> impl FnOnce(&dyn std::fmt::Display) -> Self {
        let what = what.into();
        move |reason| Self { what, reason: reason.to_string() }
    }
}

/// A node that leaves the signals to their owner.
pub(crate) fn node() -> Result<Node<ipc::Service>, ShmError> {
    let node = NodeBuilder::new().signal_handling_mode(SignalHandlingMode::Disabled).create::<ipc::Service>();
    node.map_err(|error| {
        let hint = "; its files lie in /tmp/iceoryx2 and /dev/shm and serve the one user who owns them";
        ShmError::new("a node")(&format!("{error}{hint}"))
    })
}

pub(crate) type Exchange<Q, A> = request_response::PortFactory<ipc::Service, Q, (), A, ()>;

/// Opens or creates a request-response service: what a dead client left behind is neither answered
/// nor waited for.
fn exchange<Q, A>(
    node: &Node<ipc::Service>,
    name: &str,
    max_clients: usize,
) -> Result<Exchange<Q, A>, ShmError>
where
    Q: ZeroCopySend + std::fmt::Debug + 'static,
    A: ZeroCopySend + std::fmt::Debug + 'static,
{
    let service = name.try_into().map_err(|error| ShmError::new(name)(&error))?;
    node.service_builder(&service)
        .request_response::<Q, A>()
        .max_clients(max_clients)
        .max_servers(1)
        .max_nodes(max_clients + 4)
        .max_active_requests_per_client(2)
        .max_loaned_requests(1)
        .max_response_buffer_size(1)
        .max_borrowed_responses_per_pending_response(1)
        .enable_safe_overflow_for_requests(true)
        .enable_safe_overflow_for_responses(true)
        .enable_fire_and_forget_requests(false)
        .open_or_create()
        .map_err(|error| ShmError::new(name)(&error))
}

/// Opens a service that a server has created; none where there is no such server.
pub(crate) fn open<Q, A>(node: &Node<ipc::Service>, name: &str) -> Result<Option<Exchange<Q, A>>, ShmError>
where
    Q: ZeroCopySend + std::fmt::Debug + 'static,
    A: ZeroCopySend + std::fmt::Debug + 'static,
{
    use iceoryx2::service::builder::request_response::RequestResponseOpenError as OpenError;
    let service = name.try_into().map_err(|error| ShmError::new(name)(&error))?;
    match node.service_builder(&service).request_response::<Q, A>().open() {
        Ok(exchange) => Ok(Some(exchange)),
        Err(OpenError::DoesNotExist) => Ok(None),
        Err(error) => Err(ShmError::new(name)(&error)),
    }
}

/// Opens or creates an event service.
pub(crate) fn events(
    node: &Node<ipc::Service>,
    name: &str,
) -> Result<event::PortFactory<ipc::Service>, ShmError> {
    let service = name.try_into().map_err(|error| ShmError::new(name)(&error))?;
    let builder = node
        .service_builder(&service)
        .event()
        .max_listeners(MAX_SLEEPERS)
        .max_notifiers(MAX_SLEEPERS)
        .max_nodes(96);
    builder.open_or_create().map_err(|error| ShmError::new(name)(&error))
}

/// The ports of one vehicle.
struct Door {
    vehicle: String,
    single: Server<ipc::Service, Query, (), Answer, ()>,
    batch: Server<ipc::Service, BatchQuery, (), BatchAnswer, ()>,
    single_recorder: Arc<Recorder>,
    batch_recorder: Arc<Recorder>,
}

/// The server of every vehicle, owned by one thread.
pub struct ShmServer {
    config: Config,
    names: Names,
    engine: Arc<Engine>,
    metrics: Arc<Metrics>,
    node: Node<ipc::Service>,
    doors: Vec<Door>,
    wake: Listener<ipc::Service>,
    done: Notifier<ipc::Service>,
    /// Listeners of the clients that sleep, by wake key.
    sleepers: HashMap<u64, ListenerKey>,
    evaluator: Evaluator,
}

impl ShmServer {
    /// Opens the services of every vehicle that is served.
    pub fn new(config: Config, engine: Arc<Engine>, metrics: Arc<Metrics>) -> Result<Self, ShmError> {
        let node = node()?;
        let names = Names::new(&config.namespace);
        let wake = events(&node, &names.wake())?
            .listener_builder()
            .create()
            .map_err(|error| ShmError::new("the listener")(&error))?;
        let done = events(&node, &names.done())?
            .notifier_builder()
            .create()
            .map_err(|error| ShmError::new("the notifier")(&error))?;
        let (doors, sleepers, evaluator) = (Vec::new(), HashMap::new(), Evaluator::default());
        let mut server =
            Self { config, names, engine, metrics, node, doors, wake, done, sleepers, evaluator };
        server.open_new_doors()?;
        Ok(server)
    }

    /// Opens the services of vehicles that were added since.
    fn open_new_doors(&mut self) -> Result<(), ShmError> {
        for vehicle in self.engine.models().keys() {
            if self.doors.iter().any(|door| door.vehicle == *vehicle) {
                continue;
            }
            let clients = self.config.max_clients;
            let single = exchange::<Query, Answer>(&self.node, &self.names.evaluate(vehicle), clients)?;
            let batch = exchange::<BatchQuery, BatchAnswer>(
                &self.node,
                &self.names.evaluate_batch(vehicle),
                clients,
            )?;
            // an answer that a client does not take is dropped: no client can hold up the others
            let discard = BackpressureStrategy::DiscardData;
            let port =
                |error: &dyn std::fmt::Display| ShmError::new(format!("a server for {vehicle}"))(error);
            self.doors.push(Door {
                vehicle: vehicle.clone(),
                single: single
                    .server_builder()
                    .backpressure_strategy(discard)
                    .create()
                    .map_err(|e| port(&e))?,
                batch: batch
                    .server_builder()
                    .backpressure_strategy(discard)
                    .create()
                    .map_err(|e| port(&e))?,
                single_recorder: self.metrics.recorder(Transport::shm, vehicle),
                batch_recorder: self.metrics.recorder(Transport::shm_batch, vehicle),
            });
        }
        Ok(())
    }

    /// Answers until `stop` turns true.
    pub fn run(mut self, stop: &AtomicBool) {
        let mut next_housekeeping = Instant::now() + HOUSEKEEPING;
        let mut idle = 0_u32;
        while !stop.load(Ordering::Relaxed) {
            idle = if self.answer_round() { 0 } else { idle.saturating_add(1) };
            if idle > 0 {
                self.wait(idle);
            }
            // the clock is read when there is nothing to do, and now and then under load
            if idle.is_multiple_of(256) && Instant::now() >= next_housekeeping {
                next_housekeeping = Instant::now() + HOUSEKEEPING;
                if let Err(error) = self.open_new_doors() {
                    tracing::error!(%error, "a new vehicle is not served over shared memory");
                }
            }
        }
    }

    fn wait(&mut self, idle: u32) {
        match self.config.wait {
            Wait::Spin if idle.is_multiple_of(4096) => std::thread::yield_now(),
            Wait::Spin => std::hint::spin_loop(),
            // a request that came before the listener slept has left its event, so it is not slept over
            Wait::Block => {
                if let Err(error) = self.wake.timed_wait(|_| {}, HOUSEKEEPING) {
                    // a signal, most likely; whatever it was, requests are still looked for
                    tracing::debug!(?error, "waiting for shared-memory requests");
                    std::thread::sleep(PAUSE);
                }
            }
        }
    }

    /// Answers at most one request of each kind and vehicle; true where there was any.
    fn answer_round(&mut self) -> bool {
        let mut answered = false;
        for index in 0..self.doors.len() {
            answered |= self.answer_single(index) | self.answer_batch(index);
        }
        answered
    }

    fn answer_single(&mut self, index: usize) -> bool {
        let door = &self.doors[index];
        let Some(request) = taken(door.single.receive()) else { return false };
        let arrived = Instant::now();
        let query = copy(request.payload());
        let Ok(model) = self.engine.model(&door.vehicle) else { return true };
        let mut answer = match self.evaluator.evaluate(&model, &State::from(&query)) {
            Ok(evaluated) => Answer::new(&model, evaluated.forces, evaluated.compute_ns),
            Err(invalid) => Answer::invalid(invalid),
        };
        answer.sequence = query.sequence;
        answer.flags = self.flags();
        if sent(request.loan_uninit().map(|slot| slot.write_payload(answer).send())) {
            wake(&self.done, &mut self.sleepers, query.wake_key);
        }
        match answer.refusal() {
            None => door.single_recorder.record(arrived.elapsed(), answer.is_outside().into()),
            Some(invalid) => self.metrics.refuse(Transport::shm, Refusal::from(invalid).reason()),
        }
        true
    }

    fn answer_batch(&mut self, index: usize) -> bool {
        let door = &self.doors[index];
        let Some(request) = taken(door.batch.receive()) else { return false };
        let arrived = Instant::now();
        let header = copy(&request.payload().header);
        let Ok(model) = self.engine.model(&door.vehicle) else { return true };
        let Ok(mut slot) = request.loan_uninit() else { return true };
        let answer: *mut BatchAnswer = slot.payload_mut().as_mut_ptr();
        // SAFETY: the slot is ours until it is sent; all zeros is a valid BatchAnswer, whose fields are all numbers.
        let answer = unsafe {
            answer.write_bytes(0, 1);
            &mut *answer
        };
        answer.sequence = header.sequence;
        answer.flags = self.flags();
        let count = header.count as usize;
        let mut outside = 0;
        if count == 0 || count > MAX_BATCH {
            answer.status = Status::InvalidBatch as u32;
        } else {
            for (i, slot) in answer.answers[..count].iter_mut().enumerate() {
                let query = copy(&request.payload().queries[i]);
                match self.evaluator.evaluate(&model, &State::from(&query)) {
                    Ok(evaluated) => *slot = Answer::new(&model, evaluated.forces, evaluated.compute_ns),
                    Err(invalid) => {
                        *slot = Answer::invalid(invalid);
                        answer.status = Status::InvalidState as u32;
                        answer.index = i as u32;
                        break;
                    }
                }
                slot.sequence = query.sequence;
                outside += u64::from(slot.is_outside());
                answer.count += 1;
            }
        }
        answer.compute_ns = nanoseconds_since(arrived);
        let answered = answer.status == Status::Ok as u32;
        // SAFETY: every byte was written above.
        if sent(Ok::<_, ()>(unsafe { slot.assume_init() }.send())) {
            wake(&self.done, &mut self.sleepers, header.wake_key);
        }
        if answered {
            door.batch_recorder.record(arrived.elapsed(), outside);
        } else {
            self.metrics.refuse(Transport::shm_batch, "invalid_argument");
        }
        true
    }

    fn flags(&self) -> u32 {
        if self.config.wait == Wait::Spin { SERVER_POLLS } else { 0 }
    }
}

/// Copies a value out of memory that another process may be changing, so that what was checked is what is used.
fn copy<T: Copy + ZeroCopySend>(shared: &T) -> T {
    // SAFETY: the reference is valid; the shared types hold numbers alone, for which every bit pattern is a value, and
    // a volatile read keeps the compiler from reading again after the checks.
    unsafe { std::ptr::read_volatile(shared) }
}

type Received<Q, A, E> = Result<Option<ActiveRequest<ipc::Service, Q, (), A, ()>>, E>;

/// A request, if there is one; a connection that failed is a client's trouble, not ours.
fn taken<Q, A, E: std::fmt::Debug>(
    received: Received<Q, A, E>,
) -> Option<ActiveRequest<ipc::Service, Q, (), A, ()>>
where
    Q: ZeroCopySend + std::fmt::Debug + 'static,
    A: ZeroCopySend + std::fmt::Debug + 'static,
{
    received.unwrap_or_else(|error| {
        tracing::debug!(?error, "receiving over shared memory");
        None
    })
}

fn sent<L: std::fmt::Debug, S: std::fmt::Debug>(outcome: Result<Result<(), S>, L>) -> bool {
    match outcome {
        Ok(Ok(())) => true,
        failure => {
            tracing::debug!(?failure, "answering over shared memory");
            false
        }
    }
}

/// Wakes the one client that sleeps under this key.
fn wake(done: &Notifier<ipc::Service>, sleepers: &mut HashMap<u64, ListenerKey>, key: u64) {
    if key == 0 {
        return;
    }
    if sleepers.get(&key).is_some_and(|listener| done.notify_single_listener(listener).is_ok()) {
        return;
    }
    // a client that is new, or one that is gone: forget it and look through those that listen now
    sleepers.remove(&key);
    if sleepers.len() >= MAX_SLEEPERS {
        sleepers.clear();
    }
    let name = wake_name(key);
    done.for_each_listener(|listener, details| {
        if details.listener_name != name.as_str() {
            return CallbackProgression::Continue;
        }
        sleepers.insert(key, listener.listener_key());
        if let Err(error) = listener.notify() {
            tracing::debug!(?error, "waking a client");
        }
        CallbackProgression::Stop
    });
}
