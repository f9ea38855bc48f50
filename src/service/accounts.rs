//! One account of everything that a connection can make the server hold: connections, requests, streams and bytes, each
//! with a limit and with a share of it for one peer. What is full makes room: the connection that has kept the server
//! waiting for longest is closed.

mod connection;
mod sent;

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::net::IpAddr;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use prometheus_client::metrics::gauge::Gauge;
use tokio::sync::Notify;
use tokio::time::Instant;

pub use crate::metrics::Closed;
use crate::metrics::{Metrics, Resource};
pub use connection::{Computing, Connection, Heavy};
pub use sent::Sent;
use wade_wire::Overloaded;

/// A connection whose calls have made no progress for this long may be closed for the sake of others.
const PATIENCE_UNDER_PRESSURE: Duration = Duration::from_secs(1);
/// Longest wait for the place of a connection that is being closed.
const ROOM_IN: Duration = Duration::from_millis(50);

const RESOURCES: usize = Resource::ALL.len();

/// Who is at the other end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Peer {
    /// Another machine, by its address.
    Address(IpAddr),
    /// A process of this machine, on the Unix socket.
    Process(i32),
    /// A connection of this machine over TCP: all processes share the address, so that each connection counts by itself.
    Local(u16),
}

impl Peer {
    /// The peer of a TCP connection.
    pub fn of(address: std::net::SocketAddr) -> Self {
        let ip = address.ip().to_canonical();
        if ip.is_loopback() { Self::Local(address.port()) } else { Self::Address(ip) }
    }
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Address(address) => write!(f, "{address}"),
            Self::Process(pid) => write!(f, "process {pid}"),
            Self::Local(port) => write!(f, "local port {port}"),
        }
    }
}

/// The most that is held at a time.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// gRPC connections.
    pub connections: usize,
    /// HTTP connections.
    pub http_connections: usize,
    /// Requests that are being received, answered or sent.
    pub requests: usize,
    /// Streams.
    pub streams: usize,
    /// Bytes of requests that are not complete and of answers that are not sent.
    pub bytes: usize,
    /// The share of each that one peer may have, 0 to 1.
    pub peer_share: f64,
}

impl Limits {
    fn of(&self, resource: Resource) -> usize {
        match resource {
            Resource::connections => self.connections,
            Resource::http_connections => self.http_connections,
            // each has places of its own: probes and single queries are short, and must not wait behind batches
            Resource::requests | Resource::batches | Resource::probes => self.requests,
            Resource::streams | Resource::watches => self.streams,
            Resource::bytes => self.bytes,
        }
    }
}

/// What one peer holds.
#[derive(Debug, Default)]
struct Held([Gauge; RESOURCES]);

impl Held {
    fn get(&self, resource: Resource) -> usize {
        usize::try_from(self.0[resource as usize].get()).unwrap_or(0)
    }

    /// Adds, where the sum stays within the limit.
    fn add(&self, resource: Resource, amount: usize, limit: usize) -> bool {
        let gauge = &self.0[resource as usize];
        let before = usize::try_from(gauge.inc_by(amount as i64)).unwrap_or(0);
        let fits = before.saturating_add(amount) <= limit;
        if !fits {
            gauge.dec_by(amount as i64);
        }
        fits
    }

    fn give_back(&self, resource: Resource, amount: usize) {
        self.0[resource as usize].dec_by(amount as i64);
    }
}

/// The account of a server.
#[derive(Debug)]
pub struct Accounts {
    limits: [usize; RESOURCES],
    peer_limits: [usize; RESOURCES],
    /// The gauges that the metrics show.
    total: Held,
    open: Mutex<Open>,
    /// Told when something is given back.
    given_back: Notify,
    /// Whether a connection has ended by its peer's fault since this was last asked.
    fault: AtomicBool,
    metrics: Arc<Metrics>,
    start: Instant,
}

#[derive(Debug, Default)]
struct Open {
    peers: HashMap<Peer, Weak<Held>>,
    connections: BTreeMap<u64, Weak<Connection>>,
    next: u64,
}

impl Accounts {
    /// An empty account; its limits and what is held show in the metrics.
    pub fn new(limits: &Limits, metrics: Arc<Metrics>) -> Arc<Self> {
        let share = |limit: usize| ((limit as f64 * limits.peer_share).ceil() as usize).max(1);
        let of = Resource::ALL.map(|resource| limits.of(resource));
        for (resource, limit) in Resource::ALL.into_iter().zip(of) {
            metrics.set_limit(resource, limit);
        }
        Arc::new(Self {
            limits: of,
            peer_limits: of.map(share),
            total: Held(Resource::ALL.map(|resource| metrics.held(resource))),
            open: Mutex::default(),
            given_back: Notify::new(),
            fault: AtomicBool::new(false),
            metrics,
            start: Instant::now(),
        })
    }

    /// Where closed connections are counted.
    pub fn metrics(&self) -> &Arc<Metrics> {
        &self.metrics
    }

    /// An account for a new connection, which takes a place among those of its kind.
    pub async fn open(
        self: &Arc<Self>,
        peer: Peer,
        kind: Resource,
    ) -> Result<(Arc<Connection>, Place), Overloaded> {
        let connection = self.register(peer);
        let place = self.admit(&connection, kind).await?;
        Ok((connection, place))
    }

    fn register(self: &Arc<Self>, peer: Peer) -> Arc<Connection> {
        let mut open = self.lock();
        let held = open.peers.get(&peer).and_then(Weak::upgrade).unwrap_or_default();
        open.peers.insert(peer, Arc::downgrade(&held));
        open.next += 1;
        let connection = Arc::new(Connection::new(Arc::clone(self), open.next, peer, held));
        let id = open.next;
        open.connections.insert(id, Arc::downgrade(&connection));
        connection
    }

    fn forget(&self, id: u64, peer: Peer) {
        let mut open = self.lock();
        open.connections.remove(&id);
        // the connection that is dropped has its share of the count still
        if open.peers.get(&peer).is_some_and(|held| held.strong_count() <= 1) {
            open.peers.remove(&peer);
        }
    }

    /// A place for something of a connection, made by closing another where all are taken by those who stand still.
    pub async fn admit(
        self: &Arc<Self>,
        connection: &Arc<Connection>,
        resource: Resource,
    ) -> Result<Place, Overloaded> {
        let overloaded = match self.take(connection, resource, 1) {
            Ok(place) => return Ok(place),
            Err(overloaded) => overloaded,
        };
        if !self.make_room(connection, resource, overloaded.of_peer) {
            return Err(overloaded);
        }
        let room = async {
            loop {
                let given_back = self.given_back.notified();
                if let Ok(place) = self.take(connection, resource, 1) {
                    return place;
                }
                given_back.await;
            }
        };
        tokio::time::timeout(ROOM_IN, room).await.map_err(|_| overloaded)
    }

    /// Adds to what a connection holds.
    pub fn take(
        self: &Arc<Self>,
        connection: &Arc<Connection>,
        resource: Resource,
        amount: usize,
    ) -> Result<Place, Overloaded> {
        self.add(connection, resource, amount)?;
        Ok(Place { connection: Arc::clone(connection), resource, amount })
    }

    fn add(&self, connection: &Connection, resource: Resource, amount: usize) -> Result<(), Overloaded> {
        let (limit, share) = (self.limits[resource as usize], self.peer_limits[resource as usize]);
        if !connection.peer_held.add(resource, amount, share) {
            // where the share is the whole, it is the limit that was reached
            return Err(Overloaded { limit: share, of_peer: share < limit });
        }
        if !self.total.add(resource, amount, limit) {
            connection.peer_held.give_back(resource, amount);
            return Err(Overloaded { limit, of_peer: false });
        }
        connection.held.add(resource, amount, usize::MAX);
        Ok(())
    }

    fn give_back(&self, connection: &Connection, resource: Resource, amount: usize) {
        connection.held.give_back(resource, amount);
        connection.peer_held.give_back(resource, amount);
        self.total.give_back(resource, amount);
        if resource != Resource::bytes {
            self.given_back.notify_waiters();
        }
    }

    /// Closes the connection that has kept the server waiting for longest of those that hold this resource; of the same
    /// peer where it is the peer's share that is full. False where none may be closed.
    pub fn make_room(&self, newcomer: &Connection, resource: Resource, of_peer: bool) -> bool {
        let is_connection = matches!(resource, Resource::connections | Resource::http_connections);
        let open: Vec<_> = self.lock().connections.values().filter_map(Weak::upgrade).collect();
        let candidates = open.iter().filter(|connection| {
            let waits = !connection.is_computing() && connection.id != newcomer.id;
            let same = !of_peer || connection.peer == newcomer.peer;
            // a connection that asks nothing loses nothing
            let patience = PATIENCE_UNDER_PRESSURE * u32::from(!is_connection || connection.has_calls());
            waits && same && connection.held.get(resource) > 0 && connection.keeps_waiting_for() >= patience
        });
        let victim = candidates.max_by_key(|connection| connection.keeps_waiting_for());
        victim.is_some_and(|victim| {
            victim.close(Closed::made_room);
            true
        })
    }

    /// Has every gRPC connection closed, and waits until they are.
    pub async fn close_all(&self) {
        let open: Vec<_> = self.lock().connections.values().filter_map(Weak::upgrade).collect();
        for connection in open.iter().filter(|one| one.held.get(Resource::connections) > 0) {
            connection.close(Closed::drained);
        }
        drop(open);
        while self.total.get(Resource::connections) > 0 {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }

    /// How much is held by all together.
    pub fn held(&self, resource: Resource) -> usize {
        self.total.get(resource)
    }

    /// Whether all places are taken.
    pub fn is_full(&self, resource: Resource) -> bool {
        self.total.get(resource) >= self.limits[resource as usize]
    }

    /// Whether a connection has ended by its peer's fault since this was last asked: whoever is put out is back at once.
    pub fn take_fault(&self) -> bool {
        self.fault.swap(false, Relaxed)
    }

    /// Closes a connection without calls, for its descriptor.
    pub fn make_room_for_descriptor(self: &Arc<Self>) {
        let nobody = self.register(Peer::Process(0));
        let _ = self.make_room(&nobody, Resource::connections, false)
            || self.make_room(&nobody, Resource::http_connections, false);
    }

    /// Milliseconds since the start.
    fn now_ms(&self) -> u64 {
        u64::try_from(self.start.elapsed().as_millis()).unwrap_or(u64::MAX)
    }

    fn lock(&self) -> MutexGuard<'_, Open> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Something that is held, given back when this is dropped.
#[derive(Debug)]
pub struct Place {
    connection: Arc<Connection>,
    resource: Resource,
    amount: usize,
}

impl Drop for Place {
    fn drop(&mut self) {
        self.connection.accounts.give_back(&self.connection, self.resource, self.amount);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn accounts(limit: usize, peer_share: f64) -> Arc<Accounts> {
        let limits = Limits {
            connections: limit,
            http_connections: limit,
            requests: limit,
            streams: limit,
            bytes: 1000,
            peer_share,
        };
        Accounts::new(&limits, Arc::new(Metrics::new()))
    }

    #[test]
    fn a_refusal_takes_no_place_and_a_dropped_place_is_free_again() {
        let accounts = accounts(1, 1.0);
        let connection = accounts.register(Peer::Process(1));
        let first = accounts.take(&connection, Resource::requests, 1).expect("the first fits");
        let refused = accounts.take(&connection, Resource::requests, 1).expect_err("full");
        assert_eq!(refused, Overloaded { limit: 1, of_peer: false });
        drop(first);
        assert!(accounts.take(&connection, Resource::requests, 1).is_ok());
    }

    #[test]
    fn one_peer_has_its_share_over_all_its_connections_and_another_finds_room() {
        let accounts = accounts(4, 0.5);
        let [first, second] = [(); 2].map(|()| accounts.register(Peer::Process(1)));
        let _places =
            [&first, &second].map(|of| accounts.take(of, Resource::streams, 1).expect("in its share"));
        let refused = accounts.take(&first, Resource::streams, 1).expect_err("over its share");
        assert_eq!(refused, Overloaded { limit: 2, of_peer: true });
        let other = accounts.register(Peer::Process(2));
        accounts.take(&other, Resource::streams, 1).expect("another peer has its own");
    }

    #[test]
    fn a_connection_that_is_gone_leaves_nothing_behind() {
        let accounts = accounts(4, 0.5);
        for id in 0..100 {
            let connection = accounts.register(Peer::Process(id));
            let _place = accounts.take(&connection, Resource::bytes, 10);
        }
        let open = accounts.lock();
        assert_eq!((open.peers.len(), open.connections.len()), (0, 0));
        assert_eq!(accounts.total.get(Resource::bytes), 0);
    }
}
