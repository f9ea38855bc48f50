//! Over gRPC a thread of the client's own has the connection: the caller hands it the question and waits for the answer.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use tokio::io::unix::AsyncFd;
use tonic::Code;
use wade_client::{ClientError, GrpcLink, Reply, replies};
use wade_core::vehicle::PerWheel;
use wade_wire::{DERIVATIVES, Field, InvalidState, Problem, State, proto};

use crate::abi::{WADE_SESSION_BEGINS, WadeBatch, WadeForces, WadeState, WadeStatus};
use crate::bounded::{Budget, lock, lock_until};
use crate::client::Jacobian;
use crate::connection::{RETRY, RETRY_REFUSED, status_of};
use crate::credentials::CredentialFiles;
use crate::event::Event;
use crate::known::Known;
use crate::skipped::Skipped;
use crate::worker::Worker;

/// A question that is open for longer than this has no server any more; also how long connecting may take.
const LOST_AFTER: Duration = Duration::from_secs(1);

/// A client over gRPC.
pub struct Grpc {
    shared: Arc<Shared>,
    worker: Worker,
}

struct Shared {
    url: String,
    vehicle: String,
    credentials: CredentialFiles,
    known: Arc<Known>,
    turn: Mutex<Turn>,
    /// The question for the worker, of which `asked` tells it.
    question: Mutex<Option<Question>>,
    asked: Arc<Event>,
    /// What the worker did last, of which `answered` tells.
    done: Mutex<Done>,
    answered: Event,
    batch: Mutex<Batch>,
    /// The derivatives of the last answer that had any.
    jacobian: Mutex<Jacobian>,
    /// How many wheels the vehicle had when the connection was made.
    wheels: AtomicUsize,
}

/// What belongs to the one thread whose call it is.
#[derive(Default)]
struct Turn {
    number: u64,
    /// The question of an earlier call. There is never more than one.
    open: Option<u64>,
    skipped: Skipped,
}

#[derive(Clone, Copy)]
struct Question {
    number: u64,
    at: Instant,
    what: What,
}

#[allow(clippy::large_enum_variant, reason = "a call allocates nothing")]
#[derive(Clone, Copy)]
enum What {
    State {
        state: State,
        session: u64,
    },
    /// The states lie in [`Shared::batch`].
    Batch,
}

#[derive(Clone, Copy)]
struct Done {
    number: u64,
    status: WadeStatus,
}

/// Room that is reserved when the client is opened.
struct Batch {
    states: Vec<State>,
    forces: Vec<WadeForces>,
}

impl Grpc {
    /// Starts to connect to `http://HOST:PORT`, `https://HOST:PORT` or `unix:PATH`.
    pub fn open(
        url: String,
        vehicle: &str,
        credentials: CredentialFiles,
        max_batch: usize,
        known: Arc<Known>,
    ) -> std::io::Result<Self> {
        let batch = Batch { states: Vec::with_capacity(max_batch), forces: Vec::with_capacity(max_batch) };
        let shared = Arc::new(Shared {
            url,
            vehicle: vehicle.to_owned(),
            credentials,
            known,
            turn: Mutex::default(),
            question: Mutex::default(),
            asked: Arc::new(Event::new()?),
            done: Mutex::new(Done { number: 0, status: WadeStatus::Ok }),
            answered: Event::new()?,
            batch: Mutex::new(batch),
            jacobian: Mutex::new([0.0; DERIVATIVES]),
            wheels: AtomicUsize::new(0),
        });
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let worked = Arc::clone(&shared);
        let work = move || {
            let work = || runtime.block_on(worked.work());
            let reason = match std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)) {
                Ok(Ok(())) => None,
                Ok(Err(error)) => Some(error.to_string()),
                Err(_) => Some("the thread that has the connection broke down".into()),
            };
            if let Some(reason) = reason {
                worked.known.connection.tell(WadeStatus::Internal, reason);
            }
            // a name that is being looked up is not waited for
            runtime.shutdown_background();
        };
        let worker = Worker::spawn("wade-grpc", work)?;
        Ok(Self { shared, worker })
    }

    /// Asks for the forces in a state until the deadline, and copies the last answer: where it says `Ok`, that to this state.
    pub fn evaluate(
        &self,
        state: &State,
        session: u64,
        budget: Budget,
        (forces, jacobian): (&mut WadeForces, Option<&mut Jacobian>),
    ) -> WadeStatus {
        let shared = &*self.shared;
        let state = &State { jacobian: jacobian.is_some(), ..*state };
        let mut turn = lock_until(&shared.turn, budget.deadline);
        let mut invalid = None;
        let status = match &mut turn {
            None => WadeStatus::Timeout,
            Some(turn) => {
                invalid = shared.other_wheels(state);
                match invalid {
                    Some(_) => WadeStatus::InvalidState,
                    None => shared.evaluate(turn, state, session, budget),
                }
            }
        };
        // while it is still this thread's turn, so that no other's answer comes between
        shared.known.last.get(forces);
        if let Some(jacobian) = jacobian.filter(|_| status == WadeStatus::Ok) {
            *jacobian = *lock(&shared.jacobian);
        }
        drop(turn);
        if let Some(invalid) = invalid {
            forces.blame(&invalid);
        }
        status
    }

    /// Asks for the forces in the states of a batch until the deadline; all of them are written, or none.
    pub fn evaluate_batch(
        &self,
        states: &[WadeState],
        budget: Budget,
        (forces, blamed): (&mut [WadeForces], &mut WadeBatch),
    ) -> WadeStatus {
        let shared = &*self.shared;
        let Some(mut turn) = lock_until(&shared.turn, budget.deadline) else { return WadeStatus::Timeout };
        let status = shared.known.connection.status();
        if status != WadeStatus::Ok {
            return status;
        }
        // the worker reads the states of an open batch
        if !shared.free(&mut turn, budget.deadline) {
            return WadeStatus::Timeout;
        }
        let Some(mut batch) = lock_until(&shared.batch, budget.deadline) else { return WadeStatus::Timeout };
        batch.states.clear();
        batch.states.extend(states.iter().map(State::from));
        let other = |(index, state)| Some((index, shared.other_wheels(state)?));
        if let Some((index, invalid)) = batch.states.iter().enumerate().find_map(other) {
            return blamed.blame(index, &invalid);
        }
        drop(batch);
        let status = shared.ask(&mut turn, What::Batch, budget);
        if status != WadeStatus::Ok {
            return status;
        }
        let Some(batch) = lock_until(&shared.batch, budget.deadline) else { return WadeStatus::Timeout };
        WadeForces::copy_batch(&batch.forces, budget.start, forces);
        WadeStatus::Ok
    }

    /// Ends the client's thread.
    pub fn close(self) {
        self.shared.known.connection.stop();
        self.shared.asked.set();
        self.worker.end();
    }
}

impl Shared {
    /// What is wrong with a state that has values of other wheels than those of the vehicle; over gRPC the server would say it in
    /// words alone.
    fn other_wheels(&self, state: &State) -> Option<InvalidState> {
        let wheels = self.wheels.load(Ordering::Acquire);
        let is_connected = self.known.connection.status() == WadeStatus::Ok;
        let given = [(state.wheel_speeds, Field::WheelSpeed), (state.wheel_levels, Field::WheelWaterLevel)];
        let is_other = |values: &PerWheel<f32>| is_connected && values.len() != wheels;
        let other = given.into_iter().find(|(values, _)| values.as_ref().is_some_and(is_other));
        other.map(|(_, field)| InvalidState::new(field, Problem::Count))
    }

    fn evaluate(&self, turn: &mut Turn, state: &State, session: u64, budget: Budget) -> WadeStatus {
        let status = self.known.connection.status();
        if status != WadeStatus::Ok {
            // what was remembered is lost with the connection
            turn.skipped = Skipped::default();
            return status;
        }
        let time_step = turn.skipped.step(session, state.time_step);
        let what = What::State { state: State { time_step, ..*state }, session };
        self.ask(turn, what, budget)
    }

    /// Waits until the question of an earlier call is answered; false where it is not until the deadline.
    fn free(&self, turn: &mut Turn, deadline: Instant) -> bool {
        if let Some(open) = turn.open
            && self.until_done(open, deadline).is_none()
        {
            return false;
        }
        turn.open = None;
        true
    }

    fn ask(&self, turn: &mut Turn, what: What, budget: Budget) -> WadeStatus {
        let Budget { start: at, deadline } = budget;
        if !self.free(turn, deadline) {
            return WadeStatus::Timeout;
        }
        // the open question may have ended with the connection: this one would be taken by the next one, and answered late
        let status = self.known.connection.status();
        if status != WadeStatus::Ok {
            return status;
        }
        let Some(mut question) = lock_until(&self.question, deadline) else { return WadeStatus::Timeout };
        turn.number += 1;
        let number = turn.number;
        *question = Some(Question { number, at, what });
        drop(question);
        self.asked.set();
        if let What::State { .. } = what {
            turn.skipped.asked();
        }
        self.until_done(number, deadline).unwrap_or_else(|| {
            turn.open = Some(number);
            WadeStatus::Timeout
        })
    }

    /// What the worker did with a question, unless it does not until the deadline.
    fn until_done(&self, number: u64, deadline: Instant) -> Option<WadeStatus> {
        loop {
            if let Some(done) = lock_until(&self.done, deadline)
                && done.number == number
            {
                return Some(done.status);
            }
            if !self.answered.wait(deadline) {
                return None;
            }
            self.answered.clear();
        }
    }

    /// Connects, answers until the server is lost, and connects again.
    async fn work(&self) -> std::io::Result<()> {
        let asked = self.asked.register()?;
        while !self.known.connection.is_stopped() {
            let connected = tokio::select! {
                connected = self.connect() => connected,
                stopped = self.stopped(&asked) => return stopped,
            };
            match connected {
                Ok(link) => {
                    self.known.connection.opened();
                    self.serve(link, &asked).await?;
                }
                Err(error) => {
                    self.known.connection.failed(&error);
                    let pause = match status_of(&error) {
                        WadeStatus::Credentials | WadeStatus::Refused => RETRY_REFUSED,
                        _ => RETRY,
                    };
                    tokio::select! {
                        () = tokio::time::sleep(pause) => {}
                        stopped = self.stopped(&asked) => return stopped,
                    }
                }
            }
        }
        Ok(())
    }

    /// Waits until the client is to end, while nobody can be asked.
    async fn stopped(&self, asked: &AsyncFd<Arc<Event>>) -> std::io::Result<()> {
        loop {
            let mut ready = asked.readable().await?;
            if self.known.connection.is_stopped() {
                return Ok(());
            }
            // of a question that was taken before it was waited for
            self.asked.clear();
            ready.clear_ready();
        }
    }

    /// Connects, and sees that the server has the vehicle.
    async fn connect(&self) -> Result<GrpcLink, ClientError> {
        let mut link = self.credentials.connect(&self.url, &self.vehicle, LOST_AFTER).await?;
        let vehicle = link.vehicle().await?;
        let turns = |surface: &&proto::Surface| matches!(surface.kind.as_str(), "wheel" | "track");
        self.wheels.store(vehicle.surfaces.iter().filter(turns).count(), Ordering::Release);
        Ok(link)
    }

    /// Answers until the server is lost or the client is to end.
    async fn serve(&self, mut link: GrpcLink, asked: &AsyncFd<Arc<Event>>) -> std::io::Result<()> {
        let mut session = 0;
        loop {
            let question = lock(&self.question).take();
            let Some(question) = question else {
                let mut ready = asked.readable().await?;
                self.asked.clear();
                ready.clear_ready();
                if self.known.connection.is_stopped() {
                    return Ok(());
                }
                continue;
            };
            let answer = match question.what {
                What::Batch => self.answer_batch(&mut link).await,
                What::State { state, session: of } => {
                    let answer = answer(&mut link, &state, of, &mut session).await;
                    answer.map(|(forces, jacobian)| {
                        if let Some(jacobian) = jacobian {
                            *lock(&self.jacobian) = jacobian;
                        }
                        self.known.last.put(forces, question.at);
                    })
                }
            };
            let status = answer.as_ref().map_or_else(status_of, |()| WadeStatus::Ok);
            let lost = answer.err().filter(|error| {
                use WadeStatus::{LayoutMismatch, NoServer, Timeout, UnknownVehicle};
                matches!(status, Timeout | NoServer | UnknownVehicle | LayoutMismatch) || is_unwelcome(error)
            });
            // told before the caller goes on
            if let Some(error) = &lost {
                self.known.connection.failed(error);
            }
            *lock(&self.done) = Done { number: question.number, status };
            self.answered.set();
            if lost.is_some() {
                return Ok(());
            }
        }
    }

    async fn answer_batch(&self, link: &mut GrpcLink) -> Result<(), ClientError> {
        let states = std::mem::take(&mut lock(&self.batch).states);
        let answer = link.evaluate_batch(&states).await.map(replies);
        let mut batch = lock(&self.batch);
        batch.states = states;
        batch.forces.clear();
        batch.forces.extend(answer?.iter().map(WadeForces::from));
        Ok(())
    }
}

/// Whether the server does not accept what was shown to it: a renewed token or certificate is shown to the next connection.
fn is_unwelcome(error: &ClientError) -> bool {
    matches!(error, ClientError::Refused { code: Code::Unauthenticated | Code::PermissionDenied, .. })
}

/// The forces in a state, and their derivatives where it asks for them: in the stream where it belongs to a session, which has a
/// stream of its own.
async fn answer(
    link: &mut GrpcLink,
    state: &State,
    session: u64,
    streamed: &mut u64,
) -> Result<(WadeForces, Option<Jacobian>), ClientError> {
    if session == 0 {
        let reply = Reply::from(link.evaluate(state).await?);
        return Ok((WadeForces::from(&reply), reply.jacobian));
    }
    if session != *streamed {
        link.end_stream();
        *streamed = session;
    }
    let begins = if link.has_stream() { 0 } else { WADE_SESSION_BEGINS };
    let reply = Reply::from(link.evaluate_in_stream(state).await?);
    let mut forces = WadeForces::from(&reply);
    forces.flags |= begins;
    Ok((forces, reply.jacobian))
}
