//! Work that takes milliseconds, on threads of its own that give way to those that answer single queries: batches, maps of
//! stability, inference. Each peer has one piece of it under way on each thread, and the pieces take turns slice by slice, so
//! that a peer who asks for much gets no more than one who asks for little.

use std::collections::HashMap;
use std::io;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use rustix::process::setpriority_process;
use rustix::thread::gettid;
use tokio::runtime::Handle;
use tokio::sync::Semaphore;
use tokio::task::JoinHandle;

use super::accounts::Peer;

/// Niceness of threads that give way: a tenth of the weight of a thread that answers queries.
const NICE: i32 = 10;

/// Lets the other threads of this machine go first from now on.
pub(crate) fn give_way() {
    if let Err(error) = setpriority_process(Some(gettid()), NICE) {
        tracing::warn!(%error, "a thread of long work runs with the priority of queries");
    }
}

/// Ends a task that nobody waits for any more.
pub(crate) struct Owned<T>(pub(crate) JoinHandle<T>);

impl<T> Drop for Owned<T> {
    fn drop(&mut self) {
        self.0.abort();
    }
}

/// The threads of long work.
#[derive(Debug)]
pub struct Bulk {
    threads: Vec<Handle>,
    next: AtomicUsize,
    /// The right of each peer that has work under way.
    rights: Mutex<HashMap<Peer, Weak<Semaphore>>>,
}

/// Forgets a peer's right with the last of its work, which is dropped before this.
struct Forgets<'b> {
    bulk: &'b Bulk,
    peer: Peer,
}

impl Drop for Forgets<'_> {
    fn drop(&mut self) {
        let mut rights = self.bulk.rights();
        if rights.get(&self.peer).is_some_and(|pieces| pieces.strong_count() == 0) {
            rights.remove(&self.peer);
        }
    }
}

impl Bulk {
    /// Has work done by these runtimes, each on a thread of its own.
    pub fn new(threads: Vec<Handle>) -> Self {
        Self { threads, next: AtomicUsize::new(0), rights: Mutex::default() }
    }

    fn rights(&self) -> MutexGuard<'_, HashMap<Peer, Weak<Semaphore>>> {
        self.rights.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn right_of(&self, peer: Peer) -> Arc<Semaphore> {
        let mut rights = self.rights();
        let known = rights.get(&peer).and_then(Weak::upgrade);
        let pieces = known.unwrap_or_else(|| Arc::new(Semaphore::new(self.threads.len())));
        rights.insert(peer, Arc::downgrade(&pieces));
        pieces
    }

    /// Has a piece of work done for a peer when it is its turn. Work that nobody waits for ends at its next pause.
    pub async fn run<T: Send + 'static>(
        &self,
        peer: Peer,
        work: impl Future<Output = T> + Send + 'static,
    ) -> io::Result<T> {
        let _forgets = Forgets { bulk: self, peer };
        let right = self.right_of(peer);
        // it is never closed
        let _piece = right.acquire().await.map_err(io::Error::other)?;
        let mut task = Owned(self.thread().spawn(work));
        (&mut task.0).await.map_err(io::Error::other)
    }

    /// One of the threads, each in its turn.
    pub fn thread(&self) -> Handle {
        self.threads[self.next.fetch_add(1, Relaxed) % self.threads.len()].clone()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn work(log: &Arc<Mutex<Vec<i32>>>, peer: i32) -> impl Future<Output = ()> + Send + 'static {
        let log = Arc::clone(log);
        async move {
            for _ in 0..10 {
                log.lock().expect("no panic").push(peer);
                tokio::task::yield_now().await;
            }
        }
    }

    #[tokio::test]
    async fn a_peer_with_twenty_pieces_gets_no_more_turns_than_one_with_a_single_piece() {
        let bulk = Arc::new(Bulk::new(vec![Handle::current()]));
        let log = Arc::default();
        let mut tasks = Vec::new();
        for piece in 0..21 {
            let peer = i32::from(piece == 20);
            let (bulk, work) = (Arc::clone(&bulk), work(&log, peer));
            tasks.push(tokio::spawn(async move { bulk.run(Peer::Process(peer), work).await }));
        }
        for task in tasks {
            task.await.expect("no panic").expect("done");
        }
        let log = log.lock().expect("no panic");
        let last = log.iter().rposition(|&peer| peer == 1).expect("it had turns");
        // in turns, where it would have come after two hundred
        assert!(last < 25, "{log:?}");
        assert_eq!(log.len(), 210);
        assert!(bulk.rights().is_empty());
    }

    #[tokio::test]
    async fn work_that_is_given_up_ends_and_leaves_its_place() {
        let bulk = Bulk::new(vec![Handle::current()]);
        let (peer, done) = (Peer::Process(1), Arc::new(AtomicUsize::new(0)));
        let counted = Arc::clone(&done);
        let endless = async move {
            loop {
                counted.fetch_add(1, Relaxed);
                tokio::task::yield_now().await;
            }
        };
        let waited = tokio::time::timeout(Duration::from_millis(20), bulk.run::<()>(peer, endless)).await;
        assert!(waited.is_err());
        bulk.run(peer, async {}).await.expect("the place is free");
        let before = done.load(Relaxed);
        tokio::time::sleep(Duration::from_millis(10)).await;
        assert!(before > 0 && done.load(Relaxed) == before);
        assert!(bulk.rights().is_empty());
    }
}
