//! Over shared memory the calling thread asks and waits by itself: a hand-over to another thread would cost more than the
//! answer. The ports are opened, and given up, by a thread of the client's own.

use std::sync::{Arc, Mutex, MutexGuard};
use std::thread;
use std::time::{Duration, Instant};

use wade_client::{Asked, Lost, ShmLink};
use wade_wire::shm::Wait;
use wade_wire::shm::layout::{Answer, BatchAnswer, JacobianAnswer, MAX_BATCH, Names, Query, Status};
use wade_wire::{InvalidState, State};

use crate::abi::{WadeBatch, WadeForces, WadeState, WadeStatus};
use crate::bounded::{Budget, PAUSE, lock, lock_until};
use crate::client::Jacobian;
use crate::connection::{RETRY, status_of};
use crate::convert::{Refused, answered, refused};
use crate::known::Known;
use crate::skipped::Skipped;
use crate::worker::Worker;

/// A question that is open for longer than this has no server any more. iceoryx2 says nothing of one that was killed.
const LOST_AFTER: Duration = Duration::from_millis(200);

/// A client over shared memory.
pub struct Shm {
    shared: Arc<Shared>,
    keeper: Worker,
}

struct Shared {
    names: Names,
    vehicle: String,
    wait: Wait,
    known: Arc<Known>,
    turn: Mutex<Turn>,
}

/// What belongs to the one thread whose call it is.
struct Turn {
    link: Option<ShmLink>,
    /// The question of an earlier call. There is never more than one, so that a server that is late is not asked for more.
    open: Option<Open>,
    /// What broke, for the keeper to close: that takes its time.
    given_up: Option<(ShmLink, Option<Open>)>,
    /// The port for derivatives, for the keeper to open.
    wanted: Wanted,
    skipped: Skipped,
    batch: Vec<WadeForces>,
    /// When the first of the batches was asked that have had no answer since.
    batch_asked: Option<Instant>,
    /// What the server refused of the last question, and of which state of a batch.
    invalid: Option<(usize, InvalidState)>,
}

struct Open {
    asked: Question,
    at: Instant,
}

enum Question {
    Forces(Asked<Query, Answer>),
    Jacobian(Asked<Query, JacobianAnswer>),
}

impl Question {
    fn ask(link: &mut ShmLink, query: Query, jacobian: bool) -> Result<Self, Lost> {
        if jacobian {
            return link.ask_jacobian(query).map(Self::Jacobian);
        }
        link.ask(query).map(Self::Forces)
    }

    /// The answer, if there is one until the deadline, with derivatives where they were asked for.
    fn answer(
        &self,
        link: &mut ShmLink,
        deadline: Instant,
        jacobian: Option<&mut Jacobian>,
    ) -> Result<Option<Result<WadeForces, Refused>>, Lost> {
        match self {
            Self::Forces(asked) => link.answer(asked, deadline, answered),
            Self::Jacobian(asked) => link.answer_jacobian(asked, deadline, |page| {
                let forces = answered(&page.answer)?;
                if let Some(jacobian) = jacobian {
                    *jacobian = page.jacobian;
                }
                Ok(forces)
            }),
        }
    }
}

/// Whether the keeper is to open the port for derivatives.
#[derive(Clone, Copy, PartialEq)]
enum Wanted {
    No,
    Yes,
    /// The server has none.
    Refused(WadeStatus),
}

impl Shm {
    /// Starts to look for the server of a namespace.
    pub fn open(
        namespace: &str,
        vehicle: &str,
        wait: Wait,
        max_batch: usize,
        known: Arc<Known>,
    ) -> std::io::Result<Self> {
        let turn = Turn {
            link: None,
            open: None,
            given_up: None,
            wanted: Wanted::No,
            skipped: Skipped::default(),
            batch: Vec::with_capacity(max_batch),
            batch_asked: None,
            invalid: None,
        };
        let shared = Arc::new(Shared {
            names: Names::new(namespace),
            vehicle: vehicle.to_owned(),
            wait,
            known,
            turn: Mutex::new(turn),
        });
        let kept = Arc::clone(&shared);
        let keeper = Worker::spawn("wade-shm", move || kept.keep_watched())?;
        Ok(Self { shared, keeper })
    }

    /// Asks for the forces in a state until the deadline, and copies the last answer: where it says `Ok`, that to this state.
    pub fn evaluate(
        &self,
        state: &State,
        session: u64,
        budget: Budget,
        (forces, jacobian): (&mut WadeForces, Option<&mut Jacobian>),
    ) -> WadeStatus {
        let turn = match &jacobian {
            None => lock_until(&self.shared.turn, budget.deadline),
            Some(_) => self.lock_with_jacobian(budget.deadline),
        };
        let Some(mut turn) = turn else {
            self.shared.known.last.get(forces);
            return WadeStatus::Timeout;
        };
        let query = Query { session, ..Query::from(state) };
        let status = turn.evaluate(&self.shared, query, budget, jacobian);
        self.wake_keeper(&turn);
        // while it is still this thread's turn, so that no other's answer comes between
        self.shared.known.last.get(forces);
        if let Some((_, invalid)) = turn.invalid.take() {
            forces.blame(&invalid);
        }
        status
    }

    /// This thread's turn, once the port for derivatives is open or nobody will open it.
    fn lock_with_jacobian(&self, deadline: Instant) -> Option<MutexGuard<'_, Turn>> {
        loop {
            let mut turn = lock_until(&self.shared.turn, deadline)?;
            let lacks = turn.link.as_ref().is_some_and(|link| !link.has_jacobian());
            if !lacks || matches!(turn.wanted, Wanted::Refused(_)) {
                return Some(turn);
            }
            turn.wanted = Wanted::Yes;
            drop(turn);
            self.keeper.thread().unpark();
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            thread::sleep(left.min(PAUSE));
        }
    }

    /// Asks for the forces in the states of a batch until the deadline; all of them are written, or none.
    pub fn evaluate_batch(
        &self,
        states: &[WadeState],
        budget: Budget,
        (forces, batch): (&mut [WadeForces], &mut WadeBatch),
    ) -> WadeStatus {
        let Some(mut turn) = lock_until(&self.shared.turn, budget.deadline) else {
            return WadeStatus::Timeout;
        };
        let status = turn.evaluate_batch(&self.shared, states, budget.deadline);
        self.wake_keeper(&turn);
        if let Some((index, invalid)) = turn.invalid.take() {
            batch.blame(index, &invalid);
        }
        if status == WadeStatus::Ok {
            WadeForces::copy_batch(&turn.batch, budget.start, forces);
        }
        status
    }

    fn wake_keeper(&self, turn: &Turn) {
        if turn.given_up.is_some() {
            self.keeper.thread().unpark();
        }
    }

    /// Ends the client's thread.
    pub fn close(self) {
        self.shared.known.connection.stop();
        self.keeper.thread().unpark();
        self.keeper.end();
    }
}

impl Turn {
    fn evaluate(
        &mut self,
        shared: &Shared,
        query: Query,
        budget: Budget,
        jacobian: Option<&mut Jacobian>,
    ) -> WadeStatus {
        let Budget { start, deadline } = budget;
        let Some(link) = &mut self.link else { return shared.why_not() };
        if let (Some(_), Wanted::Refused(status)) = (&jacobian, self.wanted) {
            return status;
        }
        let query = Query { time_step_s: self.skipped.step(query.session, query.time_step_s), ..query };
        if let Some(open) = &self.open {
            match open.asked.answer(link, deadline, None) {
                Ok(Some(answer)) => {
                    if let Ok(forces) = answer {
                        shared.known.last.put(forces, open.at);
                    }
                    self.open = None;
                }
                Ok(None) if open.at.elapsed() < LOST_AFTER => return WadeStatus::Timeout,
                Ok(None) => return self.give_up(shared, WadeStatus::Timeout),
                Err(_) => return self.give_up(shared, WadeStatus::NoServer),
            }
        }
        let Ok(asked) = Question::ask(link, query, jacobian.is_some()) else {
            return self.give_up(shared, WadeStatus::NoServer);
        };
        self.skipped.asked();
        match asked.answer(link, deadline, jacobian) {
            Ok(Some(Ok(forces))) => {
                shared.known.last.put(forces, start);
                WadeStatus::Ok
            }
            Ok(Some(Err(Refused { status, invalid }))) => {
                self.invalid = invalid.map(|invalid| (0, invalid));
                status
            }
            Ok(None) => {
                self.open = Some(Open { asked, at: start });
                WadeStatus::Timeout
            }
            Err(_) => self.give_up(shared, WadeStatus::NoServer),
        }
    }

    fn evaluate_batch(&mut self, shared: &Shared, states: &[WadeState], deadline: Instant) -> WadeStatus {
        let Self { link, batch, batch_asked, invalid, .. } = self;
        let Some(link) = link else { return shared.why_not() };
        batch.clear();
        while batch.len() < states.len() {
            let chunk = &states[batch.len()..];
            let chunk = &chunk[..chunk.len().min(MAX_BATCH)];
            let queries = chunk
                .iter()
                .map(|state| Query { session: state.session, ..Query::from(&State::from(state)) });
            let since = *batch_asked.get_or_insert_with(Instant::now);
            let start = batch.len();
            let taken = link.ask_batch(queries).and_then(|asked| {
                let taken = |answer: &BatchAnswer| (answer.index, take(answer, chunk.len(), batch));
                link.answer_batch(&asked, deadline, taken)
            });
            if let Ok(Some(_)) = taken {
                *batch_asked = None;
            }
            match taken {
                Ok(Some((_, Ok(())))) => {}
                Ok(Some((index, Err(refused)))) => {
                    *invalid = refused.invalid.map(|invalid| (start + index as usize, invalid));
                    return refused.status;
                }
                Ok(None) if since.elapsed() < LOST_AFTER => return WadeStatus::Timeout,
                Ok(None) => return self.give_up(shared, WadeStatus::Timeout),
                Err(_) => return self.give_up(shared, WadeStatus::NoServer),
            }
        }
        WadeStatus::Ok
    }

    fn give_up(&mut self, shared: &Shared, status: WadeStatus) -> WadeStatus {
        shared.known.connection.lost();
        // what was remembered is lost with the link
        (self.skipped, self.batch_asked, self.wanted) = (Skipped::default(), None, Wanted::No);
        self.given_up = self.link.take().map(|link| (link, self.open.take()));
        status
    }
}

/// Adds the answers to a part of a batch to those before it. A bundle that was exchanged on the way would mix two versions in
/// one answer: then it is begun again.
fn take(answer: &BatchAnswer, count: usize, batch: &mut Vec<WadeForces>) -> Result<(), Refused> {
    if answer.status != Status::Ok as u32 {
        return Err(refused(answer.status, answer.answers[answer.index as usize % MAX_BATCH].refusal()));
    }
    let answers = &answer.answers[..count];
    let version = answers.first().map(|answer| answer.bundle_version);
    if batch.first().is_some_and(|first| Some(first.bundle_version) != version) {
        batch.clear();
    } else {
        batch.extend(answers.iter().map(WadeForces::from));
    }
    Ok(())
}

impl Shared {
    /// Why there is no link.
    fn why_not(&self) -> WadeStatus {
        match self.known.connection.status() {
            WadeStatus::Ok => WadeStatus::NoServer,
            status => status,
        }
    }

    fn keep_watched(&self) {
        let kept = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| self.keep()));
        if kept.is_err() {
            self.known
                .connection
                .tell(WadeStatus::Internal, "the thread that keeps the connection broke down".into());
        }
    }

    /// Opens a link where there is none, and closes what was given up.
    fn keep(&self) {
        while !self.known.connection.is_stopped() {
            let mut turn = lock(&self.turn);
            let given_up = turn.given_up.take();
            if let (Wanted::Yes, Some(link)) = (turn.wanted, &mut turn.link) {
                let opened = link.open_jacobian(&self.names, &self.vehicle);
                turn.wanted = opened.map_or_else(|error| Wanted::Refused(status_of(&error)), |()| Wanted::No);
            }
            let linked = turn.link.is_some();
            drop(turn);
            if let Some((link, open)) = given_up {
                drop((open, link));
            }
            if linked {
                thread::park();
                continue;
            }
            match ShmLink::open(&self.names, &self.vehicle, self.wait) {
                Ok(link) => {
                    let mut turn = lock(&self.turn);
                    turn.link = Some(link);
                    self.known.connection.opened();
                }
                Err(error) => {
                    self.known.connection.failed(&error);
                    thread::park_timeout(RETRY);
                }
            }
        }
        let mut turn = lock(&self.turn);
        let (link, open) = (turn.link.take(), turn.open.take());
        drop(turn);
        drop((open, link));
    }
}
