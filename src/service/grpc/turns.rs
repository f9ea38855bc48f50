//! The turns of connections on the one thread: whoever asks for much at once stands back after three calls, and
//! of all who stand back one goes on for each round of the others, however many they are. So a query waits for one of them.

use std::future::{Future, ready};
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::service::accounts::Connection;

/// Held while a connection goes on that had stood back.
pub type Turn = Option<OwnedSemaphorePermit>;

/// Where connections wait that stand back: first come, first served.
#[derive(Debug, Clone)]
pub struct Turnstile(Arc<Semaphore>);

impl Turnstile {
    /// Nobody waits.
    pub fn new() -> Self {
        Self(Arc::new(Semaphore::new(1)))
    }

    /// The turns of a new connection.
    pub fn turns(&self) -> Turns {
        Turns { turnstile: Arc::clone(&self.0), next: None }
    }
}

/// The turns of one connection.
pub struct Turns {
    turnstile: Arc<Semaphore>,
    next: Option<Pin<Box<dyn Future<Output = Turn> + Send>>>,
}

impl Turns {
    /// Ready when it is the connection's turn.
    pub fn poll_turn(&mut self, connection: &Connection, cx: &mut Context<'_>) -> Poll<Turn> {
        let turn = match &mut self.next {
            Some(next) => ready!(next.as_mut().poll(cx)),
            None => None,
        };
        self.next = None;
        connection.set_stands_back(false);
        Poll::Ready(turn)
    }

    /// The connection was polled: where it stands back, it is polled again when it is its turn. To be asked before the turn
    /// that it had is dropped, which is the next one's then.
    pub fn end_turn(&mut self, connection: &Connection, cx: &mut Context<'_>) {
        if !connection.stands_back() {
            return;
        }
        let turnstile = Arc::clone(&self.turnstile);
        // it is never closed
        let mut next = Box::pin(async move { turnstile.acquire_owned().await.ok() });
        self.next = Some(match next.as_mut().poll(cx) {
            Poll::Ready(turn) => {
                // nobody waits, and those who are ready go first
                cx.waker().wake_by_ref();
                Box::pin(ready(turn))
            }
            Poll::Pending => next,
        });
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
    use std::task::{Wake, Waker};

    use super::*;
    use crate::metrics::Metrics;
    use crate::service::accounts::{Accounts, Limits, Peer};

    #[derive(Default)]
    struct Woken(AtomicUsize);

    impl Wake for Woken {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Relaxed);
        }
    }

    struct Heavy {
        turns: Turns,
        connection: Arc<Connection>,
        woken: Arc<Woken>,
    }

    impl Heavy {
        /// Polled once: whether it was its turn, which it uses up.
        fn polled(&mut self) -> bool {
            self.woken.0.store(0, Relaxed);
            let waker = Waker::from(Arc::clone(&self.woken));
            let mut cx = Context::from_waker(&waker);
            let Poll::Ready(_turn) = self.turns.poll_turn(&self.connection, &mut cx) else { return false };
            self.connection.set_stands_back(true);
            self.turns.end_turn(&self.connection, &mut cx);
            true
        }

        fn is_woken(&self) -> bool {
            self.woken.0.load(Relaxed) > 0
        }
    }

    #[tokio::test]
    async fn of_those_who_stand_back_one_at_a_time_goes_on_and_none_is_forgotten() {
        let limits = Limits {
            connections: 9,
            http_connections: 9,
            requests: 9,
            streams: 9,
            bytes: 9,
            peer_share: 1.0,
        };
        let accounts = Accounts::new(&limits, Arc::new(Metrics::new()));
        let turnstile = Turnstile::new();
        let mut heavies = Vec::new();
        for pid in 0..3 {
            let (connection, _) =
                accounts.open(Peer::Process(pid), crate::metrics::Resource::connections).await.expect("room");
            heavies.push(Heavy { turns: turnstile.turns(), connection, woken: Arc::default() });
        }
        // the first turn is everybody's
        assert!(heavies.iter_mut().all(Heavy::polled));
        let mut had = [0; 3];
        for _ in 0..30 {
            let woken: Vec<_> = (0..3).filter(|&index| heavies[index].is_woken()).collect();
            assert_eq!(woken.len(), 1, "one goes on in each round");
            assert!(heavies[woken[0]].polled());
            had[woken[0]] += 1;
        }
        assert_eq!(had, [10; 3]);
        // one that waits and is polled for another reason waits on; one that has gone is passed over
        let next = (0..3).find(|&index| heavies[index].is_woken()).expect("one");
        assert!(!heavies[(next + 1) % 3].polled());
        drop(heavies.remove(next));
        assert_eq!(heavies.iter().filter(|heavy| heavy.is_woken()).count(), 1);
    }
}
