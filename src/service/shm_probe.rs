//! What shows whether shared memory is served: a client that lives beside the server and asks it, as any other client would, and
//! the pulse of the thread that answers. Whoever can write to shared memory can make iceoryx2 look for something without end, or
//! lose what was sent. A clock on the wall cannot tell either from a busy machine; what the thread has done can.

use std::sync::atomic::Ordering::{Acquire, Relaxed, Release};
use std::sync::atomic::{AtomicI32, AtomicU64};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use iceoryx2::identifiers::UniqueClientId;
use iceoryx2::node::Node;
use iceoryx2::port::client::Client;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::ipc;
use iceoryx2::service::port_factory::client::ClientCreateError;
use rustix::thread::gettid;

use wade_wire::State;
use wade_wire::shm::layout::{Answer, Names, Query};
use wade_wire::shm::{self, ShmError};

/// How often an answer is looked for.
const LOOK: Duration = Duration::from_millis(1);

/// Longest processor time that the thread takes for one thing: a state takes 20 us, the opening of a vehicle's services some
/// milliseconds.
const LONGEST_STEP: Duration = Duration::from_millis(300);

/// Rounds of the thread after which what was sent before them was answered: the one under way, and a whole one.
const ROUNDS: u64 = 3;

/// What the thread that answers has done.
#[derive(Debug, Default)]
pub(crate) struct Pulse {
    rounds: AtomicU64,
    steps: AtomicU64,
    thread: AtomicI32,
}

impl Pulse {
    /// The calling thread is the one that answers.
    pub(super) fn begin(&self) {
        self.thread.store(gettid().as_raw_nonzero().get(), Release);
    }

    /// A look at everything that waits begins, and those before it have ended.
    pub(super) fn round(&self) {
        // there is one writer
        self.rounds.store(self.rounds.load(Relaxed) + 1, Release);
        self.step();
    }

    /// A state is answered.
    pub(super) fn step(&self) {
        self.steps.store(self.steps.load(Relaxed) + 1, Relaxed);
    }

    /// Processor time of the thread; none before it begins, and where the system does not say.
    fn processor_time(&self) -> Option<Duration> {
        let thread = Some(self.thread.load(Acquire)).filter(|&thread| thread != 0)?;
        let text = std::fs::read_to_string(format!("/proc/self/task/{thread}/schedstat")).ok()?;
        text.split(' ').next()?.parse().ok().map(Duration::from_nanos)
    }
}

/// Notices where the thread takes longer for one thing than anything takes.
pub(crate) struct Stall {
    pulse: Arc<Pulse>,
    steps: u64,
    since: Option<Duration>,
}

impl Stall {
    /// Looks at a thread from now on.
    pub(crate) fn new(pulse: Arc<Pulse>) -> Self {
        Self { pulse, steps: 0, since: None }
    }

    /// Whether it has been at one thing for too long, as far as that is known.
    pub(crate) fn is_there(&mut self) -> bool {
        let (steps, now) = (self.pulse.steps.load(Relaxed), self.pulse.processor_time());
        if steps != self.steps || self.since.is_none() {
            (self.steps, self.since) = (steps, now);
            return false;
        }
        now.zip(self.since).is_some_and(|(now, since)| now.saturating_sub(since) > LONGEST_STEP)
    }
}

/// What became of a question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Probed {
    /// It was answered.
    Answered,
    /// It was not, although the thread had its rounds, or not in time.
    Lost,
    /// The thread does not come back from something.
    Stalled,
}

/// Whose questions are the server's own, and so are not counted.
pub(crate) type Own = Arc<Mutex<Option<UniqueClientId>>>;

/// A connection to the service of one vehicle.
pub(crate) struct Probe {
    client: Client<ipc::Service, Query, (), Answer, ()>,
    wake: Notifier<ipc::Service>,
    sequence: u64,
    _node: Node<ipc::Service>,
}

impl Probe {
    /// Connects to a vehicle of the namespace; none where other clients have every place.
    pub(crate) fn new(namespace: &str, vehicle: &str, own: &Own) -> Result<Option<Self>, ShmError> {
        let names = Names::new(namespace);
        let node = shm::node::<ipc::Service>()?;
        let name = names.evaluate(vehicle);
        let failed = |reason: &dyn std::fmt::Display| ShmError::new("the server's own client")(reason);
        let service = shm::open::<_, Query, Answer>(&node, &name).map_err(|error| failed(&error))?;
        let client = match service.client_builder().create() {
            Ok(client) => client,
            Err(ClientCreateError::ExceedsMaxSupportedClients) => return Ok(None),
            Err(error) => return Err(failed(&error)),
        };
        let wake = shm::events(&node, &names.wake())?.notifier_builder().create();
        let wake = wake.map_err(|error| failed(&error))?;
        *own.lock().unwrap_or_else(PoisonError::into_inner) = Some(client.id());
        Ok(Some(Self { client, wake, sequence: 0, _node: node }))
    }

    /// Asks, and waits for the answer.
    pub(crate) fn ask(&mut self, timeout: Duration, stall: &mut Stall) -> Probed {
        self.sequence += 1;
        let query = Query { sequence: self.sequence, ..Query::from(&State::still(0.0)) };
        let Ok(pending) = self.client.send_copy(query) else { return Probed::Lost };
        let _ = self.wake.notify();
        let (begin, end) = (stall.pulse.rounds.load(Acquire), Instant::now() + timeout);
        loop {
            // before the look: an answer of those rounds is there by then
            let had_its_rounds = stall.pulse.rounds.load(Acquire) >= begin + ROUNDS;
            match pending.receive() {
                Ok(Some(answer)) if answer.sequence == self.sequence => return Probed::Answered,
                Ok(_) => {}
                Err(_) => return Probed::Lost,
            }
            if stall.is_there() {
                return Probed::Stalled;
            }
            if had_its_rounds || Instant::now() >= end {
                return Probed::Lost;
            }
            std::thread::sleep(LOOK);
        }
    }
}
