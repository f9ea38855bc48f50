//! One answer a request, computed where the request is read, with no channel between.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use tokio::sync::watch;
use tokio_stream::Stream;
use tonic::{Code, Status, Streaming};

use super::handlers::{Call, answer};
use super::{Shared, size_limit, stopped};
use crate::engine::Permit;
use crate::model::Model;
use crate::service::proto;
use crate::service::wire::Refusal;

/// The answering half of a `Stream` call.
pub struct Answers {
    requests: Streaming<proto::EvaluateRequest>,
    shared: Shared,
    vehicle: String,
    stop: Pin<Box<dyn Future<Output = ()> + Send>>,
    ended: bool,
    _permit: Permit,
}

impl Answers {
    pub(super) fn new(
        requests: Streaming<proto::EvaluateRequest>,
        shared: Shared,
        permit: Permit,
        stop: watch::Receiver<bool>,
    ) -> Self {
        let stop = Box::pin(stopped(stop));
        Self { requests, shared, vehicle: String::new(), stop, ended: false, _permit: permit }
    }

    fn answer(&mut self, request: proto::EvaluateRequest) -> Result<proto::EvaluateResponse, Status> {
        let call = Call::in_stream(&self.shared);
        if !request.vehicle.is_empty() {
            self.vehicle = request.vehicle;
        }
        let model: Result<Arc<Model>, Refusal> =
            self.shared.engine.model(&self.vehicle).map_err(Refusal::from);
        let answer = model.and_then(|model| answer(&model, request.state.as_ref()));
        call.end(answer).map(tonic::Response::into_inner)
    }
}

impl Stream for Answers {
    type Item = Result<proto::EvaluateResponse, Status>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        if self.ended {
            return Poll::Ready(None);
        }
        let answer = match Pin::new(&mut self.requests).poll_next(context) {
            Poll::Ready(Some(Ok(request))) => self.answer(request),
            Poll::Ready(Some(Err(status))) if status.code() == Code::OutOfRange => Err(size_limit(&status)),
            Poll::Ready(Some(Err(status))) => Err(status),
            Poll::Ready(None) => return Poll::Ready(None),
            Poll::Pending if self.stop.as_mut().poll(context).is_ready() => {
                Err(Status::unavailable("the server is shutting down"))
            }
            Poll::Pending => return Poll::Pending,
        };
        self.ended = answer.is_err();
        Poll::Ready(Some(answer))
    }
}
