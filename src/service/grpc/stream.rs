//! One answer a request, computed where the request is read, with no channel between.

use std::pin::Pin;
use std::task::{Context, Poll};

use tokio::time::Instant;
use tokio_stream::Stream;
use tonic::{Code, Status, Streaming};

use super::size_limit;
use crate::metrics::Transport;
use crate::service::call::{Call, STATES_PER_TURN, Shared, answer_state};
use crate::service::taps::{Seen, Tapped};
use wade_core::served::Session;
use wade_wire::Refusal;
use wade_wire::proto;

/// The answering half of a `Stream` call.
pub struct Answers {
    requests: Streaming<proto::EvaluateRequest>,
    shared: Shared,
    vehicle: String,
    /// What the effects of that vehicle remember.
    session: Session,
    transport: Transport,
    deadline: Option<Instant>,
    answers_this_turn: usize,
    ended: bool,
    /// Where the page may look in.
    tapped: Tapped,
}

impl Answers {
    pub(super) fn new(
        requests: Streaming<proto::EvaluateRequest>,
        shared: Shared,
        transport: Transport,
        deadline: Option<Instant>,
    ) -> Self {
        let tapped = shared.taps.open(transport);
        Self {
            requests,
            shared,
            vehicle: String::new(),
            session: Session::default(),
            transport,
            deadline,
            answers_this_turn: 0,
            ended: false,
            tapped,
        }
    }

    fn answer(&mut self, request: proto::EvaluateRequest) -> Result<proto::EvaluateResponse, Status> {
        let call = Call::arriving(&self.shared, self.transport, self.deadline);
        if !request.vehicle.is_empty() && request.vehicle != self.vehicle {
            self.vehicle = request.vehicle;
            self.session = Session::default();
        }
        let vehicle = || Ok::<_, Refusal>(self.shared.engine.vehicle(&self.vehicle)?);
        let answer = call.check_deadline(None).and_then(|()| vehicle());
        let session = &mut self.session;
        let answer = answer.and_then(|vehicle| answer_state(&vehicle, request.state.as_ref(), Some(session)));
        let answer = call.end(answer)?.into_inner();
        if let Some(state) = request.state {
            let (vehicle, seen) = (&self.vehicle, &answer);
            self.tapped.offer(|| Seen {
                at: Instant::now(),
                vehicle: vehicle.clone(),
                state,
                answer: seen.clone(),
            });
        }
        Ok(answer)
    }
}

impl Stream for Answers {
    type Item = Result<proto::EvaluateResponse, Status>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        if self.ended {
            return Poll::Ready(None);
        }
        if self.answers_this_turn == STATES_PER_TURN {
            // a client that sends without waiting would keep the thread to itself
            self.answers_this_turn = 0;
            context.waker().wake_by_ref();
            return Poll::Pending;
        }
        let answer = match Pin::new(&mut self.requests).poll_next(context) {
            Poll::Ready(Some(Ok(request))) => self.answer(request),
            Poll::Ready(Some(Err(status))) if status.code() == Code::OutOfRange => Err(size_limit(&status)),
            Poll::Ready(Some(Err(status))) => Err(status),
            Poll::Ready(None) => return Poll::Ready(None),
            Poll::Pending => {
                self.answers_this_turn = 0;
                return Poll::Pending;
            }
        };
        self.answers_this_turn += 1;
        self.ended = answer.is_err();
        Poll::Ready(Some(answer))
    }
}
