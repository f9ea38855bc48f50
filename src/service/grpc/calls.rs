//! Every call of a connection, whichever method: admitted, its request received within a deadline, its place held until
//! the last byte of its answer has left.

use std::convert::Infallible;
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use hyper::body::{Body as HttpBody, Bytes, Frame, Incoming, SizeHint};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::time::{Instant, Sleep};
use tonic::Status;
use tonic::body::Body;
use tonic::codegen::Service;
use tonic::codegen::http::{HeaderMap, Request, Response};
use tonic::service::Routes;

use super::handlers::Names;
use super::heavy::{Heavy, HeavyCalls};
use super::name_the_size_limit;
use crate::metrics::{Metrics, Resource, Transport};
use crate::service::access::{Acceptor, Caller, Role, Who};
use crate::service::accounts::{Computing, Connection, Place, Sent};
use crate::service::stopped;
use crate::service::traces::{self, Traced, Traces};
use wade_wire::Refusal;

/// What a method needs.
#[derive(Debug, Clone, Copy)]
struct Method {
    resource: Resource,
    transport: Transport,
    /// The role that it takes; probes take none.
    role: Option<Role>,
    /// Whether it takes milliseconds.
    heavy: Option<Heavy>,
}

impl Method {
    fn of(path: &str, names: &Names) -> Self {
        let of = |resource, transport| Self { resource, transport, role: Some(Role::Query), heavy: None };
        let heavy = |call, transport| Self { heavy: Some(call), ..of(Resource::batches, transport) };
        let observes = |method| Self { role: Some(Role::Observe), ..method };
        let administers = |method| Self { role: Some(Role::Administer), ..method };
        let (request, stream, probe) = (Resource::requests, Resource::streams, Resource::probes);
        match path {
            "/wade.v1.Hydrodynamics/Evaluate" => of(request, names.unary),
            "/wade.v1.Hydrodynamics/EvaluateBatch" => heavy(Heavy::Batch, names.batch),
            "/wade.v1.Hydrodynamics/GetStability" => heavy(Heavy::Stability, names.batch),
            "/wade.v1.Hydrodynamics/Stream" => of(stream, names.stream),
            "/inference.GRPCInferenceService/ModelInfer" => heavy(Heavy::Infer, names.infer),
            "/inference.GRPCInferenceService/ModelStreamInfer" => of(stream, names.infer),
            "/grpc.health.v1.Health/Watch" => Self { role: None, ..of(Resource::watches, names.other) },
            "/grpc.reflection.v1.ServerReflection/ServerReflectionInfo"
            | "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo" => {
                observes(of(stream, names.other))
            }
            "/grpc.health.v1.Health/Check"
            | "/inference.GRPCInferenceService/ServerLive"
            | "/inference.GRPCInferenceService/ServerReady" => Self { role: None, ..of(probe, names.other) },
            "/wade.v1.Hydrodynamics/GetLatency" | "/inference.GRPCInferenceService/ModelStatistics" => {
                observes(of(request, names.other))
            }
            "/inference.GRPCInferenceService/RepositoryModelLoad"
            | "/inference.GRPCInferenceService/RepositoryModelUnload" => {
                administers(of(request, names.other))
            }
            path if path.starts_with("/wade.v1.Admin/") => administers(of(request, names.other)),
            _ => of(request, names.other),
        }
    }
}

impl Method {
    fn administers(&self) -> bool {
        self.role == Some(Role::Administer)
    }
}

/// What holds for every call of a listener.
#[derive(Debug)]
pub struct Rules {
    /// The names of its calls in the metrics.
    pub names: Names,
    /// Who may make them.
    pub acceptor: Acceptor,
    /// Who answers what takes milliseconds.
    pub heavy: HeavyCalls,
    /// Longest time for a request to arrive.
    pub request: Duration,
    /// Longest pause between two requests of a stream.
    pub stream_idle: Duration,
    /// Calls that ask for no forces are computed one after the other, so that a hundred of them at once do not stand before a
    /// stream: between two of them everything else that is ready has its turn.
    pub gate: Arc<Semaphore>,
    /// Where refusals are counted.
    pub metrics: Arc<Metrics>,
    /// Where spans go; none where nobody collects them.
    pub traces: Option<Arc<Traces>>,
    /// True when the server ends.
    pub stop: watch::Receiver<bool>,
}

/// The calls of one connection.
#[derive(Debug, Clone)]
pub struct Calls {
    /// The services.
    pub routes: Routes,
    /// The connection of who asks.
    pub connection: Arc<Connection>,
    /// What holds for all.
    pub rules: Arc<Rules>,
    /// Who asks, as the connection tells.
    pub who: Who,
}

impl hyper::service::Service<Request<Incoming>> for Calls {
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Response<Body>, Infallible>> + Send>>;

    fn call(&self, request: Request<Incoming>) -> Self::Future {
        let calls = self.clone();
        let method = Method::of(request.uri().path(), &self.rules.names);
        // who probes does so for ever
        let traces = self.rules.traces.as_ref().filter(|_| method.role.is_some());
        let span =
            traces.map(|traces| traces.call(request.uri().path(), request.headers(), self.connection.peer()));
        Box::pin(async move {
            let response = calls.answer(method, request).await.unwrap_or_else(Status::into_http);
            let Some(mut span) = span else { return Ok(response) };
            traces::note(&mut span, response.headers());
            Ok(response.map(|body| Body::new(Traced::new(body, span))))
        })
    }
}

impl Calls {
    async fn answer(
        mut self,
        method: Method,
        mut request: Request<Incoming>,
    ) -> Result<Response<Body>, Status> {
        self.connection.asks();
        let place = match self.admit(method, request.headers()).await {
            Ok((caller, place)) => {
                self.connection.moved();
                if let Some(caller) = caller.filter(|_| method.administers()) {
                    self.connection.pays_for_call();
                    request.extensions_mut().insert(caller);
                }
                place
            }
            Err(refusal) => {
                self.connection.pays_for_call();
                self.rules.metrics.refuse(method.transport, refusal.reason());
                return Err(refusal.into());
            }
        };
        let computing = Arc::new(Mutex::default());
        let request = request.map(|body| Body::new(Received::new(body, &self, method, &computing)));
        // a call that is given up is not computed either
        let _ends = EndsComputing(&computing);
        let response = match method.heavy {
            Some(call) => self.rules.heavy.answer(call, &self.connection, request).await,
            None => match self.routes.call(request).await {
                Ok(response) => response,
                Err(never) => match never {},
            },
        };
        let response = name_the_size_limit(response);
        let connection = Arc::clone(&self.connection);
        Ok(response.map(|body| Body::new(Sent::new(body, connection, Some(place)))))
    }

    async fn admit(&self, method: Method, headers: &HeaderMap) -> Result<(Option<Caller>, Place), Refusal> {
        let access = self.rules.acceptor.access();
        let caller = method.role.map(|role| access.check(&self.who, headers, role)).transpose();
        let caller = caller.inspect_err(|refusal| {
            if method.administers() {
                // as text, so that a name in it writes no line of its own
                let (peer, refusal) = (self.connection.peer(), refusal.to_string());
                tracing::warn!(%peer, refusal, "an administrator's call was refused");
            }
        })?;
        let accounts = self.connection.accounts();
        let overloaded = |overloaded| Refusal::Overloaded { what: method.resource.name(), overloaded };
        // no request is admitted while the bytes of others fill the account
        accounts.take(&self.connection, Resource::bytes, 1).map_err(|overloaded| {
            accounts.make_room(&self.connection, Resource::bytes, overloaded.of_peer);
            Refusal::Overloaded { what: Resource::bytes.name(), overloaded }
        })?;
        let place = match method.resource {
            // for a caller without a role no connection is closed
            Resource::watches => accounts.take(&self.connection, method.resource, 1),
            resource => accounts.admit(&self.connection, resource).await,
        };
        let place = place.map_err(overloaded)?;
        Ok((caller, place))
    }
}

/// What a call has while the server is at work on it.
#[derive(Debug)]
struct AtWork {
    _computing: Computing,
    _turn: Option<OwnedSemaphorePermit>,
}

/// Whether the server is at work on a call.
type Work = Arc<Mutex<Option<AtWork>>>;

fn set(work: &Work, at_work: Option<AtWork>) {
    *work.lock().unwrap_or_else(PoisonError::into_inner) = at_work;
}

struct EndsComputing<'w>(&'w Work);

impl Drop for EndsComputing<'_> {
    fn drop(&mut self) {
        set(self.0, None);
    }
}

/// The messages of a request, of which only those count as held that are not complete.
#[derive(Debug, Default)]
struct Messages {
    prefix: [u8; 4],
    have: usize,
    left: usize,
}

impl Messages {
    /// Length of a message's prefix [bytes]: a flag and a length.
    const PREFIX: usize = 5;

    /// The bytes after the last complete message of this part; none where no message ended in it.
    fn since_last(&mut self, bytes: &[u8]) -> Option<usize> {
        let (mut at, mut ended) = (0, None);
        while at < bytes.len() {
            if self.left > 0 {
                let len = self.left.min(bytes.len() - at);
                self.left -= len;
                at += len;
            } else {
                if self.have > 0 {
                    self.prefix[self.have - 1] = bytes[at];
                }
                self.have += 1;
                at += 1;
                if self.have < Self::PREFIX {
                    continue;
                }
                self.have = 0;
                self.left = u32::from_be_bytes(self.prefix) as usize;
            }
            if self.left == 0 {
                ended = Some(at);
            }
        }
        ended.map(|at| bytes.len() - at)
    }
}

/// The body of a request: it arrives in time, and what has arrived of it is counted.
struct Received {
    body: Incoming,
    connection: Arc<Connection>,
    charge: Option<Place>,
    messages: Messages,
    is_stream: bool,
    /// Longest wait: for the whole of a request, or between the parts of a stream.
    patience: Duration,
    since: Instant,
    deadline: Option<Pin<Box<Sleep>>>,
    stop: Option<Later<()>>,
    work: Work,
    gate: Option<Arc<Semaphore>>,
    /// The wait for a turn, once the request is complete, and its last frame.
    turn: Option<Later<Option<OwnedSemaphorePermit>>>,
    last: Option<Frame<Bytes>>,
}

type Later<T> = Pin<Box<dyn Future<Output = T> + Send>>;

impl Received {
    fn new(body: Incoming, calls: &Calls, method: Method, work: &Work) -> Self {
        let rules = &calls.rules;
        let is_stream = matches!(method.resource, Resource::streams | Resource::watches);
        // whoever waits for an administrator's job does not compute
        let gated = method.resource == Resource::requests && method.transport == rules.names.other;
        Self {
            body,
            connection: Arc::clone(&calls.connection),
            charge: None,
            messages: Messages::default(),
            is_stream,
            patience: if is_stream { rules.stream_idle } else { rules.request },
            since: Instant::now(),
            deadline: None,
            stop: is_stream.then(|| Box::pin(stopped(rules.stop.clone())) as Later<()>),
            work: Arc::clone(work),
            gate: (gated && !method.administers()).then(|| Arc::clone(&rules.gate)),
            turn: None,
            last: None,
        }
    }

    /// The request is complete with this frame: as soon as it has its turn, the server is at work.
    fn poll_complete(
        &mut self,
        last: Option<Frame<Bytes>>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        self.last = last;
        if let Some(gate) = self.gate.take() {
            // it is never closed
            self.turn = Some(Box::pin(async move { gate.acquire_owned().await.ok() }));
            return self.poll_turn(cx);
        }
        if !self.is_stream {
            self.begin(None);
        }
        Poll::Ready(self.last.take().map(Ok))
    }

    fn poll_turn(&mut self, cx: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        if let Some(turn) = &mut self.turn {
            let turn = std::task::ready!(turn.as_mut().poll(cx));
            self.turn = None;
            self.begin(turn);
        }
        Poll::Ready(self.last.take().map(Ok))
    }

    fn begin(&self, turn: Option<OwnedSemaphorePermit>) {
        let mut work = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        work.get_or_insert_with(|| AtWork { _computing: Computing::begin(&self.connection), _turn: turn });
    }

    fn arrived(&mut self, bytes: &Bytes) -> Result<(), Status> {
        let open = self.messages.since_last(bytes);
        if self.is_stream {
            self.since = Instant::now();
        }
        if open.is_some() {
            self.charge = None;
        }
        let held = open.unwrap_or(bytes.len());
        if held == 0 {
            return Ok(());
        }
        let charged = self.connection.charge(&mut self.charge, held);
        charged.map_err(|overloaded| Refusal::Overloaded { what: Resource::bytes.name(), overloaded }.into())
    }

    /// Ready where the wait was too long.
    fn poll_deadline(&mut self, cx: &mut Context<'_>) -> Poll<Status> {
        loop {
            let deadline = self.since + self.patience;
            // made where a request does not arrive as a whole, and not moved with every part
            let sleep = self.deadline.get_or_insert_with(|| Box::pin(tokio::time::sleep_until(deadline)));
            std::task::ready!(sleep.as_mut().poll(cx));
            if Instant::now() >= deadline {
                return Poll::Ready(self.late());
            }
            sleep.as_mut().reset(deadline);
        }
    }

    fn late(&self) -> Status {
        let waited = self.patience.as_secs_f64();
        if self.is_stream {
            Status::deadline_exceeded(format!(
                "no request on this stream for {waited} s (grpc.stream_idle_s): open it again when there is one"
            ))
        } else {
            Status::deadline_exceeded(format!(
                "the request did not arrive within {waited} s (grpc.request_s)"
            ))
        }
    }
}

impl HttpBody for Received {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        let this = &mut *self;
        if let Some(stop) = &mut this.stop
            && stop.as_mut().poll(cx).is_ready()
        {
            return Poll::Ready(Some(Err(Status::unavailable("the server is shutting down"))));
        }
        if this.turn.is_some() {
            return this.poll_turn(cx);
        }
        match Pin::new(&mut this.body).poll_frame(cx) {
            Poll::Ready(Some(Ok(frame))) => {
                match frame.data_ref().map_or(Ok(()), |bytes| this.arrived(bytes)) {
                    Ok(()) if this.body.is_end_stream() => this.poll_complete(Some(frame), cx),
                    arrived => Poll::Ready(Some(arrived.map(|()| frame))),
                }
            }
            Poll::Ready(Some(Err(error))) => Poll::Ready(Some(Err(Status::from_error(Box::new(error))))),
            Poll::Ready(None) => this.poll_complete(None, cx),
            Poll::Pending => this.poll_deadline(cx).map(|late| Some(Err(late))),
        }
    }

    fn is_end_stream(&self) -> bool {
        self.turn.is_none() && self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

#[cfg(test)]
mod tests {
    use super::Messages;

    #[test]
    fn only_the_start_of_a_message_that_is_not_complete_counts() {
        let message = |len: u8| [&[0, 0, 0, 0, len][..], &vec![7; len.into()]].concat();
        let mut messages = Messages::default();
        assert_eq!(messages.since_last(&message(9)), Some(0));
        assert_eq!(messages.since_last(&message(0)), Some(0));
        assert_eq!(messages.since_last(&message(9)[..3]), None);
        assert_eq!(messages.since_last(&message(9)[3..7]), None);
        let rest = [&message(9)[7..], &message(3)[..6]].concat();
        assert_eq!(messages.since_last(&rest), Some(6));
        assert_eq!(messages.since_last(&message(3)[6..]), Some(0));
    }
}
