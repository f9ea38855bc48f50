//! Which thread moves the bytes of a connection. Those of a batch are some hundred kilobytes, and whoever writes them loses its
//! place before others who want the processor: a connection with heavy calls is served beside the work on them, and comes back
//! when it has had none for a while. Its single calls are answered by the thread that reads all along.

use std::future::{Future, poll_fn};
use std::pin::Pin;
use std::sync::Arc;
use std::task::Poll;

use tokio::runtime::Handle;

use crate::service::accounts::Connection;
use crate::service::bulk::Bulk;

/// Starts calls on the thread that reads, whichever serves their connection.
#[derive(Debug, Clone)]
pub struct Reading(pub Handle);

impl<F> hyper::rt::Executor<F> for Reading
where
    F: Future + Send + 'static,
    F::Output: Send + 'static,
{
    fn execute(&self, call: F) {
        self.0.spawn(call);
    }
}

/// Serves a connection until it ends, on the thread that suits it.
pub fn spawn(
    serving: impl Future<Output = ()> + Send + 'static,
    connection: Arc<Connection>,
    reading: Reading,
    bulk: Arc<Bulk>,
) {
    on(Box::pin(serving), false, connection, reading, bulk);
}

fn on(
    mut serving: Pin<Box<dyn Future<Output = ()> + Send>>,
    heavy: bool,
    connection: Arc<Connection>,
    reading: Reading,
    bulk: Arc<Bulk>,
) {
    let thread = if heavy { bulk.thread() } else { reading.0.clone() };
    thread.spawn(async move {
        let ended = poll_fn(|cx| match serving.as_mut().poll(cx) {
            Poll::Ready(()) => Poll::Ready(true),
            // polled on the other thread, everything that it waits for wakes it there
            Poll::Pending if connection.is_heavy() != heavy => Poll::Ready(false),
            Poll::Pending => Poll::Pending,
        });
        if !ended.await {
            on(serving, !heavy, connection, reading, bulk);
        }
    });
}
