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
