//! A client that lives beside the server and asks it, as any other client would.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use iceoryx2::identifiers::UniqueClientId;
use iceoryx2::node::Node;
use iceoryx2::port::client::Client;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::ipc;
use iceoryx2::service::port_factory::client::ClientCreateError;

use wade_wire::State;
use wade_wire::shm::layout::{Answer, Names, Query};
use wade_wire::shm::{self, ShmError};

/// How often an answer is looked for.
const LOOK: Duration = Duration::from_millis(1);

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

    /// Whether a query is answered in this time.
    pub(crate) fn is_answered(&mut self, timeout: Duration) -> bool {
        self.sequence += 1;
        let query = Query { sequence: self.sequence, ..Query::from(&State::still(0.0)) };
        let Ok(pending) = self.client.send_copy(query) else { return false };
        let _ = self.wake.notify();
        let end = Instant::now() + timeout;
        loop {
            match pending.receive() {
                Ok(Some(answer)) if answer.sequence == self.sequence => return true,
                Ok(_) => {}
                Err(_) => return false,
            }
            if Instant::now() >= end {
                return false;
            }
            std::thread::sleep(LOOK);
        }
    }
}
