//! The shared-memory side of the contract: what lies there ([`layout`]), and how nodes and services are opened by servers and
//! clients alike.

#![allow(unsafe_code)]

mod convert;
mod error;
pub mod layout;
pub mod room;
pub mod served;

pub use error::{OpenError, ShmError};
use std::mem::MaybeUninit;

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::prelude::{SignalHandlingMode, ZeroCopySend};
use iceoryx2::request_mut::RequestMut;
use iceoryx2::request_mut_uninit::RequestMutUninit;
use iceoryx2::service::Service;
use iceoryx2::service::port_factory::{event, request_response};
use serde::{Deserialize, Serialize};

/// Where the segments lie, and so the lock: whoever sees the one sees the other.
pub const SHARED_MEMORY: &str = "/dev/shm";

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

/// The namespace unless configured otherwise.
pub const NAMESPACE: &str = "wade";

/// Most clients of all vehicles together: each has a place among those that wake and are woken.
pub const MAX_CLIENTS: usize = 64;

/// A node that leaves the signals to their owner.
pub fn node<S: Service>() -> Result<Node<S>, ShmError> {
    let config = config();
    let builder = NodeBuilder::new().config(&config).signal_handling_mode(SignalHandlingMode::Disabled);
    builder.create::<S>().map_err(|error| {
        let hint = "; its files lie in /tmp/iceoryx2 and /dev/shm and serve the one user who owns them";
        ShmError::new("a node")(&format!("{error}{hint}"))
    })
}

/// The settings of every node here: what was left in a service is cleared when that service is opened, and the rest of the
/// machine by [`clear`] alone, not by whoever comes or goes.
pub fn config() -> Config {
    let mut config = Config::global_config().clone();
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    config
}

/// A service that answers requests.
pub type Exchange<S, Q, A> = request_response::PortFactory<S, Q, (), A, ()>;

/// Opens a service that a server has created.
pub fn open<S, Q, A>(node: &Node<S>, name: &str) -> Result<Exchange<S, Q, A>, OpenError>
where
    S: Service,
    Q: ZeroCopySend + std::fmt::Debug + 'static,
    A: ZeroCopySend + std::fmt::Debug + 'static,
{
    use iceoryx2::service::builder::request_response::RequestResponseOpenError as Reason;
    let failed = |reason: &dyn std::fmt::Display| OpenError::Failed(ShmError::new(name)(reason));
    let service = name.try_into().map_err(|error| failed(&error))?;
    node.service_builder(&service).request_response::<Q, A>().open().map_err(|error| match error {
        Reason::DoesNotExist => OpenError::Absent,
        Reason::IncompatibleRequestOrResponseType => OpenError::OtherTypes,
        error => failed(&error),
    })
}

/// Opens or creates an event service.
pub fn events<S: Service>(node: &Node<S>, name: &str) -> Result<event::PortFactory<S>, ShmError> {
    let service = name.try_into().map_err(|error| ShmError::new(name)(&error))?;
    let builder = node
        .service_builder(&service)
        .event()
        .max_listeners(MAX_CLIENTS + 1)
        .max_notifiers(MAX_CLIENTS + 1)
        .max_nodes(96);
    builder.open_or_create().map_err(|error| ShmError::new(name)(&error))
}

/// A loaned slot as what it is to hold, so that a large message is written where it lies.
pub fn in_place<T: Copy + ZeroCopySend>(slot: &mut MaybeUninit<T>) -> &mut T {
    // SAFETY: callers pass slots of shared memory alone, which was zero when it was made. The shared types hold numbers,
    // for which whatever a message before this one left is a value too.
    unsafe { slot.assume_init_mut() }
}

/// A request that was written [`in_place`].
pub fn written<S, Q, A>(slot: RequestMutUninit<S, MaybeUninit<Q>, (), A, ()>) -> RequestMut<S, Q, (), A, ()>
where
    S: Service,
    Q: Copy + ZeroCopySend + std::fmt::Debug + 'static,
    A: ZeroCopySend + std::fmt::Debug + 'static,
{
    // SAFETY: as in `in_place`: shared memory holds numbers from the start.
    unsafe { slot.assume_init() }
}
