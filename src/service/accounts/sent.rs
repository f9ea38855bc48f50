//! Answers on their way: what they hold until their last byte has left.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use hyper::body::{Body, Bytes, Frame, SizeHint};

use super::{Connection, Place};

/// The body of an answer, with the place of its call.
#[derive(Debug)]
pub struct Sent<B> {
    body: B,
    connection: Arc<Connection>,
    place: Option<Arc<Place>>,
}

impl<B> Sent<B> {
    /// An answer to this connection.
    pub fn new(body: B, connection: Arc<Connection>, place: Option<Place>) -> Self {
        Self { body, connection, place: place.map(Arc::new) }
    }
}

impl<B: Body<Data = Bytes> + Unpin> Body for Sent<B> {
    type Data = Bytes;
    type Error = B::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, B::Error>>> {
        let this = &mut *self;
        let polled = Pin::new(&mut this.body).poll_frame(cx);
        let unsent = |bytes: Bytes| {
            this.connection.unsent(bytes.len());
            let (connection, place) = (Arc::clone(&this.connection), this.place.clone());
            Bytes::from_owner(Unsent { bytes, connection, _place: place })
        };
        polled.map_ok(|frame| frame.map_data(unsent))
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// Bytes that the library keeps until they are written.
struct Unsent {
    bytes: Bytes,
    connection: Arc<Connection>,
    _place: Option<Arc<Place>>,
}

impl AsRef<[u8]> for Unsent {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl Drop for Unsent {
    fn drop(&mut self) {
        self.connection.no_longer_unsent(self.bytes.len());
    }
}
