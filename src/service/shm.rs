//! The shared-memory server: one thread that polls or sleeps, copies each request once, checks it and answers. Batches are
//! answered slice by slice, and single queries go between.

#![allow(unsafe_code)]

use std::collections::HashMap;
use std::mem::MaybeUninit;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use iceoryx2::active_request::ActiveRequest;
use iceoryx2::identifiers::UniqueClientId;
use iceoryx2::node::Node;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::{ListenerKey, Notifier};
use iceoryx2::port::server::Server;
use iceoryx2::prelude::{BackpressureStrategy, CallbackProgression, MessagingPattern, ZeroCopySend, ipc};
use iceoryx2::response_mut_uninit::ResponseMutUninit;
use iceoryx2::service::port_factory::event;
use serde::{Deserialize, Serialize};

use super::shm_probe::{Own, Pulse};
use super::shm_remains::{self, Remains, ServiceFiles};
use super::shm_turns::Turns;
use crate::engine::Engine;
use crate::metrics::{Metrics, Recorder, Transport};
use wade_core::served::ServedVehicle;
use wade_wire::shm::layout::{
    Answer, BatchAnswer, BatchHeader, BatchQuery, JacobianAnswer, MAX_BATCH, Names, Query, SERVER_POLLS,
    SESSION_BEGINS, Status, VehicleAnswer, wake_name,
};
use wade_wire::shm::{
    Exchange, MAX_CLIENTS, NAMESPACE, ShmError, Wait, events, in_place, node, open, served as shm_served,
};
use wade_wire::{
    DERIVATIVES, Evaluator, Field, InvalidState, Problem, Refusal, Sessions, State, derivatives,
    nanoseconds_since,
};

/// Settings of the shared-memory server.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Whether it runs.
    pub enabled: bool,
    /// How it waits.
    pub wait: Wait,
    /// Most clients of one vehicle at a time, at most [`MAX_CLIENTS`]; of all vehicles together there can be that many.
    pub max_clients: usize,
    /// First part of the services' names; servers beside each other need one each.
    pub namespace: String,
    /// The program whose command `serve-shm` serves it: this one.
    #[serde(skip, default = "this_program")]
    pub program: PathBuf,
}

/// The running program, also where its file has been replaced.
fn this_program() -> PathBuf {
    "/proc/self/exe".into()
}

impl Default for Config {
    fn default() -> Self {
        let (namespace, program) = (NAMESPACE.into(), this_program());
        Self { enabled: true, wait: Wait::Block, max_clients: 16, namespace, program }
    }
}

/// How long the server sleeps at most before it looks for a shutdown and for new vehicles.
const HOUSEKEEPING: Duration = Duration::from_millis(50);

/// Rounds of polling or of work between two looks at the clock.
const ROUNDS_PER_LOOK: u32 = 1 << 10;
/// Rounds of polling after which the core is offered to others.
const ROUNDS_PER_YIELD: u32 = 1 << 12;

/// Most requests of a service in one round: more than its clients can have open, which only a forged queue has.
const MOST_A_ROUND: usize = 1024;

/// States of a batch between two looks at what else has come in: a query waits for so many, a third of a millisecond.
const STATES_PER_SLICE: usize = 16;

/// Pause after a wait that failed, so that a lasting failure does not spin.
const PAUSE: Duration = Duration::from_millis(1);

/// Opens or creates a request-response service: what a dead client left behind is neither answered
/// nor waited for.
fn exchange<Q, A>(
    node: &Node<ipc::Service>,
    name: &str,
    max_clients: usize,
) -> Result<Exchange<ipc::Service, Q, A>, ShmError>
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
        .or_else(|error| {
            // a client that outlived a server with smaller limits keeps its service: those limits stay until it goes
            let open = open::<_, Q, A>(node, name).map_err(|_| ShmError::new(name)(&error))?;
            tracing::warn!(name, %error, "a living client keeps this service's former limits");
            Ok(open)
        })
}

fn replacing(name: &str, error: &ShmError) {
    tracing::info!(name, %error, "a service that cannot be opened is replaced");
}

/// What a server needs beside its settings and its vehicles.
pub(crate) struct Opening {
    /// Where requests are counted.
    pub metrics: Arc<Metrics>,
    /// What is known of the processes before this one.
    pub remains: Remains,
    /// Whose requests are not counted.
    pub own: Own,
    /// What shows that the server goes on.
    pub pulse: Arc<Pulse>,
}

type Request<Q, A> = ActiveRequest<ipc::Service, Q, (), A, ()>;

/// A batch that has been begun.
struct Batch {
    /// The version that answers all of it, whatever is swapped meanwhile.
    vehicle: Arc<ServedVehicle>,
    /// Number of the vehicle's ports.
    ports: usize,
    recorder: Arc<Recorder>,
    arrived: Instant,
    header: BatchHeader,
    /// States that were answered, and how many of them lie outside the training domain.
    answered: usize,
    outside: u64,
    // given back before the request that it belongs to
    slot: ResponseMutUninit<ipc::Service, MaybeUninit<BatchAnswer>, ()>,
    request: Request<BatchQuery, BatchAnswer>,
}

/// Who asks: a port, or a client that names itself, whose ports are one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Asker {
    Port(UniqueClientId),
    Owner(u64),
}

/// A run of states of one client and one vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Run {
    asker: Asker,
    /// Number of the vehicle's ports.
    ports: usize,
    session: u64,
}

/// One service of a vehicle, and what has come in through it in this round.
struct Port<Q, A>
where
    Q: ZeroCopySend + std::fmt::Debug + 'static,
    A: ZeroCopySend + std::fmt::Debug + 'static,
{
    server: Server<ipc::Service, Q, (), A, ()>,
    waiting: Vec<(Instant, Request<Q, A>)>,
}

impl<Q, A> Port<Q, A>
where
    Q: ZeroCopySend + std::fmt::Debug + 'static,
    A: ZeroCopySend + std::fmt::Debug + 'static,
{
    fn open(node: &Node<ipc::Service>, name: &str, max_clients: usize) -> Result<Self, ShmError> {
        let service = exchange::<Q, A>(node, name, max_clients)?;
        // an answer that a client does not take is dropped: no client can hold up the others
        let builder = service.server_builder().backpressure_strategy(BackpressureStrategy::DiscardData);
        let server =
            builder.create().map_err(|error| ShmError::new(format!("a server of {name}"))(&error))?;
        Ok(Self { server, waiting: Vec::new() })
    }

    /// Takes what is waiting; true where there is anything.
    fn take(&mut self) -> bool {
        while self.waiting.len() < MOST_A_ROUND
            && let Some(request) = taken(self.server.receive())
        {
            self.waiting.push((Instant::now(), request));
        }
        !self.waiting.is_empty()
    }
}

/// A page that a single query is answered with.
trait Page: Copy + ZeroCopySend + std::fmt::Debug + 'static {
    /// One that says nothing yet.
    const UNSET: Self;

    /// Its answer, and its room for derivatives where it has that.
    fn parts(&mut self) -> (&mut Answer, Option<&mut [f32; DERIVATIVES]>);
}

impl Page for Answer {
    const UNSET: Self = Self::UNSET;

    fn parts(&mut self) -> (&mut Answer, Option<&mut [f32; DERIVATIVES]>) {
        (self, None)
    }
}

impl Page for JacobianAnswer {
    const UNSET: Self = Self::UNSET;

    fn parts(&mut self) -> (&mut Answer, Option<&mut [f32; DERIVATIVES]>) {
        (&mut self.answer, Some(&mut self.jacobian))
    }
}

/// The ports of one vehicle.
struct Ports {
    vehicle: String,
    single: Port<Query, Answer>,
    jacobian: Port<Query, JacobianAnswer>,
    description: Port<Query, VehicleAnswer>,
    batch: Port<BatchQuery, BatchAnswer>,
    single_recorder: Arc<Recorder>,
    batch_recorder: Arc<Recorder>,
}

/// The server of every vehicle, owned by one thread.
pub struct ShmServer {
    config: Config,
    names: Names,
    node: Node<ipc::Service>,
    ports: Vec<Ports>,
    batches: Turns<UniqueClientId, Batch>,
    wake: Listener<ipc::Service>,
    told: Told,
    responder: Responder,
    files: ServiceFiles,
}

/// What clients are told of this server.
#[derive(Default)]
struct Told {
    vehicles: Vec<String>,
    /// None where it could not be told.
    _service: Option<event::PortFactory<ipc::Service>>,
}

/// What it takes to answer.
struct Responder {
    engine: Arc<Engine>,
    metrics: Arc<Metrics>,
    evaluator: Evaluator,
    sessions: Sessions<Run>,
    /// [`Answer::flags`] of every answer.
    flags: u64,
    done: Notifier<ipc::Service>,
    /// Listeners of the clients that sleep, by wake key.
    sleepers: HashMap<u64, ListenerKey>,
    own: Own,
    pulse: Arc<Pulse>,
}

impl ShmServer {
    /// Opens the services of every vehicle that is served, for the owner of the namespace.
    pub(crate) fn new(config: Config, engine: Arc<Engine>, opening: Opening) -> Result<Self, ShmError> {
        let Opening { metrics, remains, own, pulse } = opening;
        let names = Names::new(&config.namespace);
        shm_remains::prepare(&names, engine.vehicles().keys(), &remains);
        let node = node().or_else(|_| {
            shm_remains::remove_node_counter();
            node()
        })?;
        let wake = events(&node, &names.wake())?.listener_builder().create();
        let done = events(&node, &names.done())?.notifier_builder().create();
        let responder = Responder {
            engine,
            metrics,
            evaluator: Evaluator::default(),
            sessions: Sessions::new(Sessions::<Run>::CAPACITY),
            flags: if config.wait == Wait::Spin { SERVER_POLLS } else { 0 },
            done: done.map_err(|error| ShmError::new("the notifier")(&error))?,
            sleepers: HashMap::new(),
            own,
            pulse,
        };
        let wake = wake.map_err(|error| ShmError::new("the listener")(&error))?;
        let files = ServiceFiles::default();
        for name in [names.wake(), names.done()] {
            files.add(&name, MessagingPattern::Event);
        }
        let told = Told::default();
        let batches = Turns::new();
        let mut server =
            Self { config, names, node, ports: Vec::new(), batches, wake, told, responder, files };
        for vehicle in server.without_ports() {
            server.open_ports(vehicle)?;
        }
        server.tell();
        Ok(server)
    }

    /// The files of its services.
    pub(crate) fn files(&self) -> ServiceFiles {
        self.files.clone()
    }

    /// Vehicles that are served and have no ports yet.
    fn without_ports(&self) -> Vec<String> {
        let vehicles = self.responder.engine.vehicles();
        let has_ports = |name: &String| self.ports.iter().any(|ports| ports.vehicle == *name);
        vehicles.keys().filter(|name| !has_ports(name)).cloned().collect()
    }

    fn open_ports(&mut self, vehicle: String) -> Result<(), ShmError> {
        let clients = self.config.max_clients;
        // one more where the server's own client asks, which is at the first vehicle
        let own = usize::from(self.ports.is_empty());
        let names = &self.names;
        let single = Port::open(&self.node, &names.evaluate(&vehicle), clients + own)?;
        let batch = Port::open(&self.node, &names.evaluate_batch(&vehicle), clients)?;
        let jacobian = Port::open(&self.node, &names.evaluate_jacobian(&vehicle), clients)?;
        let description = Port::open(&self.node, &names.vehicle(&vehicle), clients)?;
        for name in names.of_vehicle(&vehicle) {
            self.files.add(&name, MessagingPattern::RequestResponse);
        }
        let metrics = &self.responder.metrics;
        self.ports.push(Ports {
            single,
            jacobian,
            description,
            batch,
            single_recorder: metrics.recorder(Transport::shm, &vehicle),
            batch_recorder: metrics.recorder(Transport::shm_batch, &vehicle),
            vehicle,
        });
        Ok(())
    }

    /// Answers until `stop` turns true, and then what has come in until then.
    pub fn run(mut self, stop: &AtomicBool) {
        let mut next_housekeeping = Instant::now() + HOUSEKEEPING;
        let mut round = 0_u32;
        self.responder.pulse.begin();
        while !stop.load(Ordering::Relaxed) {
            round = round.wrapping_add(1);
            self.responder.pulse.round();
            let idle = !self.answer_round();
            if idle {
                self.wait(round);
            }
            // the clock is read after a sleep, and now and then while there is work or polling
            let look = (idle && self.config.wait == Wait::Block) || round.is_multiple_of(ROUNDS_PER_LOOK);
            if look && Instant::now() >= next_housekeeping {
                next_housekeeping = Instant::now() + HOUSEKEEPING;
                self.open_new_ports();
                self.tell();
            }
        }
        let end = Instant::now() + HOUSEKEEPING;
        while self.answer_round() && Instant::now() < end {}
    }

    /// One vehicle's trouble is not the others'. Services of a new vehicle that cannot be opened are replaced.
    fn open_new_ports(&mut self) {
        for vehicle in self.without_ports() {
            let opened = self.open_ports(vehicle.clone()).or_else(|error| {
                for name in self.names.of_vehicle(&vehicle) {
                    replacing(&name, &error);
                    shm_remains::remove(&name, MessagingPattern::RequestResponse);
                }
                self.open_ports(vehicle)
            });
            if let Err(error) = opened {
                tracing::error!(%error, "a new vehicle is not served over shared memory");
            }
        }
    }

    /// Tells clients which vehicles there are, where that has changed.
    fn tell(&mut self) {
        let vehicles = self.responder.engine.vehicles();
        if vehicles.keys().eq(&self.told.vehicles) {
            return;
        }
        let vehicles: Vec<String> = vehicles.keys().cloned().collect();
        // the name is free when the service before is closed
        self.told = Told::default();
        let tell = || shm_served::tell(&self.node, &self.names, &vehicles);
        let told = tell().or_else(|error| {
            replacing(&self.names.served(), &error);
            shm_remains::remove(&self.names.served(), MessagingPattern::Event);
            tell()
        });
        let service = told.inspect_err(|error| {
            tracing::warn!(%error, "clients cannot look up the vehicles");
        });
        self.told = Told { vehicles, _service: service.ok() };
    }

    fn wait(&mut self, round: u32) {
        match self.config.wait {
            Wait::Spin if round.is_multiple_of(ROUNDS_PER_YIELD) => std::thread::yield_now(),
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

    /// Takes everything that is waiting, then answers it: taking one at a time would serve the first connections again
    /// and again, since that is where looking starts. Of batches it goes on with one. True where there was anything.
    fn answer_round(&mut self) -> bool {
        let mut any = false;
        for (number, ports) in self.ports.iter_mut().enumerate() {
            any |=
                ports.single.take() | ports.jacobian.take() | ports.batch.take() | ports.description.take();
            let served = self.responder.engine.vehicle(&ports.vehicle).ok();
            for (_, request) in ports.description.waiting.drain(..) {
                self.responder.describe(served.as_deref(), &request);
            }
            if let Some(vehicle) = served {
                for arrival in ports.batch.waiting.drain(..) {
                    let client = arrival.1.origin();
                    if let Some(batch) =
                        self.responder.begin(&vehicle, number, arrival, &ports.batch_recorder)
                    {
                        self.batches.push(client, batch);
                    }
                }
                let at = At { vehicle: &vehicle, ports: number };
                for (arrived, request) in ports.single.waiting.drain(..) {
                    self.responder.answer(at, arrived, &request, &ports.single_recorder);
                }
                for (arrived, request) in ports.jacobian.waiting.drain(..) {
                    self.responder.answer(at, arrived, &request, &ports.single_recorder);
                }
            } else {
                for (_, request) in ports.single.waiting.drain(..) {
                    self.responder.decline(&request);
                }
                for (_, request) in ports.jacobian.waiting.drain(..) {
                    self.responder.decline(&request);
                }
                for (_, request) in ports.batch.waiting.drain(..) {
                    self.responder.decline_batch(&request);
                }
            }
        }
        if let Some((client, batch)) = self.batches.next() {
            any = true;
            if let Some(batch) = self.responder.go_on(batch) {
                self.batches.give_back(client, batch);
            }
        }
        any
    }
}

/// Whom a request is for.
#[derive(Clone, Copy)]
struct At<'s> {
    vehicle: &'s ServedVehicle,
    ports: usize,
}

impl Responder {
    /// Writes the answer to a query, in its session where it has one.
    fn evaluate<P: Page>(
        &mut self,
        at: At,
        asker: Asker,
        query: &Query,
        page: &mut P,
    ) -> Result<(), InvalidState> {
        self.pulse.step();
        let run = Run { asker, ports: at.ports, session: query.session };
        let (answer, mut room) = page.parts();
        let asked = query.state().and_then(|state| match (&room, state.jacobian) {
            (None, true) => Err(InvalidState::new(Field::Jacobian, Problem::Unsupported)),
            _ => State { jacobian: room.is_some(), ..state }.check_for(at.vehicle),
        });
        let outcome = asked.map(|state| {
            // a query that was refused has begun no session
            let known = (query.session != 0).then(|| self.sessions.get(run));
            let (session, begins) = known.map_or((None, false), |(session, begins)| (Some(session), begins));
            let evaluated = self.evaluator.evaluate(at.vehicle, &state, session);
            answer.fill(at.vehicle, &evaluated);
            answer.flags |= if begins { SESSION_BEGINS } else { 0 };
            if let (Some(room), Some(jacobian)) = (&mut room, evaluated.jacobian) {
                **room = derivatives(jacobian);
            }
        });
        if let Err(invalid) = &outcome {
            if let Some(room) = room {
                *room = [f32::NAN; DERIVATIVES];
            }
            answer.refuse(invalid, at.vehicle);
        }
        answer.sequence = query.sequence;
        answer.flags |= self.flags;
        outcome
    }

    fn answer<P: Page>(
        &mut self,
        at: At,
        arrived: Instant,
        request: &Request<Query, P>,
        recorder: &Recorder,
    ) {
        let query = copy(request.payload());
        let Some(mut slot) = loaned(request.loan_uninit()) else { return };
        let page = in_place(slot.payload_mut());
        let asker = if query.owner == 0 { Asker::Port(request.origin()) } else { Asker::Owner(query.owner) };
        let outcome = self.evaluate(at, asker, &query, page);
        let (answer, _) = page.parts();
        let (is_outside, status) = (answer.is_outside(), answer.status);
        // SAFETY: it has been written.
        if sent(unsafe { slot.assume_init() }.send()) {
            wake(&self.done, &mut self.sleepers, query.wake_key);
        }
        match outcome {
            Ok(()) if self.is_own(request.origin()) => {}
            Ok(()) => recorder.record(arrived.elapsed(), is_outside.into()),
            Err(invalid) => self.metrics.refuse(Transport::shm, Refusal::from(invalid).reason()),
        }
        tracing::debug!(target: "wade::request", transport = "shm", vehicle = at.vehicle.model().vehicle().name, status);
    }

    /// Whether the server's own client asks.
    fn is_own(&self, client: UniqueClientId) -> bool {
        *self.own.lock().unwrap_or_else(PoisonError::into_inner) == Some(client)
    }

    /// Says what a vehicle is, or that it is not served any more.
    fn describe(&mut self, vehicle: Option<&ServedVehicle>, request: &Request<Query, VehicleAnswer>) {
        let query = copy(request.payload());
        let Some(mut slot) = loaned(request.loan_uninit()) else { return };
        let answer = in_place(slot.payload_mut());
        answer.fill(vehicle);
        (answer.sequence, answer.flags) = (query.sequence, self.flags);
        let status = answer.status;
        // SAFETY: it has been written, but for bytes that do not count, which are numbers too.
        if sent(unsafe { slot.assume_init() }.send()) {
            wake(&self.done, &mut self.sleepers, query.wake_key);
        }
        tracing::debug!(target: "wade::request", transport = "shm", description = true, status);
    }

    /// Says that the vehicle is not served any more.
    fn decline<P: Page>(&mut self, request: &Request<Query, P>) {
        let query = copy(request.payload());
        let Some(slot) = loaned(request.loan_uninit()) else { return };
        let mut page = P::UNSET;
        let (answer, _) = page.parts();
        (answer.sequence, answer.status, answer.flags) =
            (query.sequence, Status::NotServed as u32, self.flags);
        if sent(slot.write_payload(page).send()) {
            wake(&self.done, &mut self.sleepers, query.wake_key);
        }
        self.metrics.refuse(Transport::shm, "not_found");
    }

    /// Says that the vehicle is not served any more.
    fn decline_batch(&mut self, request: &Request<BatchQuery, BatchAnswer>) {
        let header = copy(&request.payload().header);
        let Some(mut slot) = loaned(request.loan_uninit()) else { return };
        let answer = in_place(slot.payload_mut());
        (answer.sequence, answer.flags) = (header.sequence, self.flags);
        (answer.status, answer.index, answer.count) = (Status::NotServed as u32, 0, 0);
        // SAFETY: it has been written, but for answers that do not count, which are numbers too.
        if sent(unsafe { slot.assume_init() }.send()) {
            wake(&self.done, &mut self.sleepers, header.wake_key);
        }
        self.metrics.refuse(Transport::shm_batch, "not_found");
    }

    /// Begins the answer to a batch; nothing where there is no room for it, or where its header is wrong.
    fn begin(
        &mut self,
        vehicle: &Arc<ServedVehicle>,
        ports: usize,
        (arrived, request): (Instant, Request<BatchQuery, BatchAnswer>),
        recorder: &Arc<Recorder>,
    ) -> Option<Batch> {
        let header = copy(&request.payload().header);
        let mut slot = loaned(request.loan_uninit())?;
        let answer = in_place(slot.payload_mut());
        (answer.sequence, answer.flags) = (header.sequence, self.flags);
        (answer.status, answer.index, answer.count) = (Status::Ok as u32, 0, 0);
        let (vehicle, recorder) = (Arc::clone(vehicle), Arc::clone(recorder));
        let batch =
            Batch { vehicle, ports, recorder, arrived, header, answered: 0, outside: 0, slot, request };
        if (1..=MAX_BATCH).contains(&(header.count as usize)) && header.flags == 0 {
            return Some(batch);
        }
        self.end(batch, Status::InvalidBatch);
        None
    }

    /// Answers a slice of a batch, which is returned where more of it is left. What nobody waits for any more has ended.
    fn go_on(&mut self, mut batch: Batch) -> Option<Batch> {
        if !batch.request.is_connected() {
            return None;
        }
        let count = batch.header.count as usize;
        // a run in batches is another than that of the same number in single calls
        let (asker, answer) = (Asker::Port(batch.request.origin()), in_place(batch.slot.payload_mut()));
        for i in batch.answered..count.min(batch.answered + STATES_PER_SLICE) {
            let query = copy(&batch.request.payload().queries[i]);
            let at = At { vehicle: &batch.vehicle, ports: batch.ports };
            if self.evaluate(at, asker, &query, &mut answer.answers[i]).is_err() {
                answer.index = i as u32;
                self.end(batch, Status::InvalidState);
                return None;
            }
            batch.outside += u64::from(answer.answers[i].is_outside());
            batch.answered += 1;
        }
        if batch.answered < count {
            return Some(batch);
        }
        self.end(batch, Status::Ok);
        None
    }

    /// Sends what has been answered of a batch.
    fn end(&mut self, batch: Batch, status: Status) {
        let Batch { vehicle, recorder, arrived, header, answered, outside, mut slot, .. } = batch;
        let answer = in_place(slot.payload_mut());
        (answer.status, answer.count) = (status as u32, answered as u32);
        answer.compute_ns = nanoseconds_since(arrived);
        // SAFETY: it has been written, but for answers that do not count, which are numbers too.
        if sent(unsafe { slot.assume_init() }.send()) {
            wake(&self.done, &mut self.sleepers, header.wake_key);
        }
        if status == Status::Ok {
            recorder.record(arrived.elapsed(), outside);
        } else {
            self.metrics.refuse(Transport::shm_batch, "invalid_argument");
        }
        tracing::debug!(target: "wade::request", transport = "shm_batch", vehicle = vehicle.model().vehicle().name, answered, ?status);
    }
}

/// Copies a value out of memory that another process may be changing, so that what was checked is what is used.
fn copy<T: Copy + ZeroCopySend>(shared: &T) -> T {
    // SAFETY: the reference is valid; the shared types hold numbers alone, for which every bit pattern is a value, and
    // a volatile read keeps the compiler from reading again after the checks.
    unsafe { std::ptr::read_volatile(shared) }
}

/// A request, if there is one; a connection that failed is a client's trouble, not ours.
fn taken<R, E: std::fmt::Debug>(received: Result<Option<R>, E>) -> Option<R> {
    received.unwrap_or_else(|error| {
        tracing::debug!(?error, "receiving over shared memory");
        None
    })
}

/// A slot for an answer, if there is one.
fn loaned<T, E: std::fmt::Debug>(loan: Result<T, E>) -> Option<T> {
    loan.inspect_err(|failure| tracing::debug!(?failure, "answering over shared memory")).ok()
}

fn sent<E: std::fmt::Debug>(outcome: Result<(), E>) -> bool {
    outcome.inspect_err(|failure| tracing::debug!(?failure, "answering over shared memory")).is_ok()
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
    if sleepers.len() >= MAX_CLIENTS {
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

#[cfg(test)]
mod tests {
    use iceoryx2::port::client::Client;
    use wade_core::bundle::Library;
    use wade_core::model::kernel::Isa;

    use super::*;

    fn client<Q, A>(node: &Node<ipc::Service>, name: &str) -> Client<ipc::Service, Q, (), A, ()>
    where
        Q: ZeroCopySend + std::fmt::Debug + 'static,
        A: ZeroCopySend + std::fmt::Debug + 'static,
    {
        open::<_, Q, A>(node, name).expect("it is served").client_builder().create().expect("there is room")
    }

    fn batch(client: &Client<ipc::Service, BatchQuery, (), BatchAnswer, ()>, sequence: u64) -> Pending {
        let mut slot = client.loan_uninit().expect("there is room");
        let query = in_place(slot.payload_mut());
        query.header = BatchHeader {
            sequence,
            wake_key: 0,
            flags: 0,
            count: MAX_BATCH as u32,
            spare: 0,
            reserved: [0; wade_wire::shm::layout::RESERVED_LEN],
        };
        query.queries = [Query::from(&State::still(0.2)); MAX_BATCH];
        wade_wire::shm::written(slot).send().expect("sent")
    }

    type Pending = iceoryx2::pending_response::PendingResponse<ipc::Service, BatchQuery, (), BatchAnswer, ()>;

    #[test]
    fn a_query_waits_for_a_slice_of_the_batches_before_it_and_batches_take_turns() {
        let vehicles = concat!(env!("CARGO_MANIFEST_DIR"), "/vehicles");
        let library = Library::open(Some(vehicles.as_ref())).expect("the shipped vehicles");
        let engine = Arc::new(Engine::default());
        engine.swap(library.served("husky", Isa::available()[0]).expect("husky"));
        let namespace = format!("slices{}", std::process::id());
        let opening = Opening {
            metrics: Arc::new(Metrics::new()),
            remains: Remains { crashed: false, former: Vec::new() },
            own: Own::default(),
            pulse: Arc::default(),
        };
        let config = Config { namespace: namespace.clone(), ..Config::default() };
        let mut server = ShmServer::new(config, engine, opening).expect("nobody else has the namespace");
        let (node, names) = (node::<ipc::Service>().expect("a node"), Names::new(&namespace));
        let [first, second] = [(); 2].map(|()| client(&node, &names.evaluate_batch("husky")));
        let single = client::<Query, Answer>(&node, &names.evaluate("husky"));

        let slices = MAX_BATCH / STATES_PER_SLICE;
        let long = [batch(&first, 1), batch(&first, 2)];
        assert!(server.answer_round());
        let short = batch(&second, 3);
        let query = single.send_copy(Query::from(&State::still(0.2))).expect("sent");
        assert!(server.answer_round());
        assert!(query.receive().expect("connected").is_some(), "a round has one slice of a batch");
        let mut ended = Vec::new();
        for round in 2.. {
            for pending in long.iter().chain([&short]) {
                if let Some(answer) = pending.receive().expect("connected") {
                    assert_eq!((answer.status, answer.count), (Status::Ok as u32, MAX_BATCH as u32));
                    ended.push((answer.sequence, round));
                }
            }
            if !server.answer_round() {
                break;
            }
        }
        // the second client came after two slices of the first, and from then on each had every other one
        assert_eq!(ended, [(1, 2 * slices - 2), (3, 2 * slices + 1), (2, 3 * slices)]);

        drop(long);
        let given_up = batch(&first, 4);
        assert!(server.answer_round());
        drop(given_up);
        assert!(server.answer_round());
        assert!(!server.answer_round(), "nobody waits for it any more");
    }
}
