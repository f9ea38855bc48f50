//! A client of any temper over HTTP/2, frame by frame.

use std::cell::Cell;
use std::time::Duration;

use fastrand::Rng;
use h2::client::SendRequest;
use http::{Method, Request};
use prost::Message;
use prost::bytes::Bytes;
use tokio::io::DuplexStream;
use tokio::time::Instant;
use wade_core::served::{ServedVehicle, Session};
use wade_wire::{Evaluator, proto};

use crate::bundle::NAME;
use crate::http2::prefixed;
use crate::ledger::{Ledger, Opened, Place, SETTLED};
use crate::network::Cable;

/// How long any call may take that its client helps along.
const BOUND: Duration = Duration::from_secs(30);

/// How a call ended.
#[derive(Debug)]
enum Outcome {
    /// With this status, and these messages before it.
    Status(u16, Vec<Bytes>),
    /// With the stream or the connection.
    Broken(String),
}

/// A connection.
pub struct Client {
    pub ledger: Ledger,
    pub chance: Rng,
    pub name: String,
    /// Whether every call must be answered.
    pub calm: bool,
    send: SendRequest<Bytes>,
    cable: Option<Cable>,
    /// Whether the server has answered anything on it: one that is never accepted owes nothing.
    accepted: Cell<bool>,
}

type Ended = Result<Outcome, h2::Error>;

impl Client {
    /// Shakes hands; none where that does not come about.
    pub async fn connect(
        stream: DuplexStream,
        cable: Cable,
        (ledger, chance, name, calm): (Ledger, Rng, String, bool),
    ) -> Option<Self> {
        let (send, connection) = h2::client::handshake(stream).await.ok()?;
        tokio::task::spawn_local(async move {
            let _ = connection.await;
        });
        Some(Self { ledger, chance, name, calm, send, cable: Some(cable), accepted: Cell::new(false) })
    }

    /// Asks for something at random; whether the connection may be used on.
    pub async fn act(&mut self) -> bool {
        let moods = if self.calm { 6 } else { 12 };
        let act = self.chance.u32(0..moods);
        self.ledger.note(&format!("{} begins {act}", self.name));
        let goes_on = match act {
            0 => self.unary().await,
            1 => self.batch().await,
            2 => self.stream().await,
            3 => self.burst().await,
            4 => self.reload().await,
            5 => self.health().await,
            6 => self.sends_slowly().await,
            7 => self.gives_up().await,
            8 => self.does_not_read().await,
            9 => self.holds_a_stream().await,
            10 => self.sends_garbage().await,
            _ => self.is_cut(),
        };
        self.ledger.note(&format!("{} ended {act}: {goes_on}", self.name));
        goes_on
    }

    async fn call(&mut self, path: &str, messages: &[Vec<u8>]) -> Outcome {
        let called = async {
            let (response, mut body) = self.begin(path).await?;
            for message in messages {
                body.send_data(framed(message), false)?;
            }
            body.send_data(Bytes::new(), true)?;
            finished(response).await
        };
        bounded(&self.ledger, &self.name, path, called).await
    }

    async fn begin(
        &self,
        path: &str,
    ) -> Result<(h2::client::ResponseFuture, h2::SendStream<Bytes>), h2::Error> {
        let request = Request::builder()
            .method(Method::POST)
            .uri(format!("http://simulated{path}"))
            .header("content-type", "application/grpc")
            .header("te", "trailers")
            .body(())
            .expect("a request");
        self.send.clone().ready().await?.send_request(request, false)
    }

    /// Begins a call and says all there is to say; none where the connection takes no more.
    async fn ask(&self, path: &str, message: &[u8]) -> Option<h2::client::ResponseFuture> {
        let (response, mut body) = self.begin(path).await.ok()?;
        body.send_data(framed(message), true).ok()?;
        Some(response)
    }

    /// Whether the connection may be used on; of a calm client every call is answered.
    fn judged(&self, what: &str, outcome: &Outcome) -> bool {
        let ok = matches!(outcome, Outcome::Status(0, _));
        self.ledger.ended(ok);
        self.accepted.set(self.accepted.get() || matches!(outcome, Outcome::Status(..)));
        let told = match outcome {
            Outcome::Status(code, messages) => format!("status {code}, {} messages", messages.len()),
            Outcome::Broken(why) => format!("broken: {why}"),
        };
        self.ledger.note(&format!("{} {what}: {told}", self.name));
        if self.calm && !ok {
            self.ledger.breaks(format!("{} {what} was not answered: {told}", self.name));
        }
        // cancelled, deadline exceeded, resource exhausted, unavailable
        if let Outcome::Status(code, _) = outcome
            && ![0, 1, 4, 8, 14].contains(code)
        {
            self.ledger.breaks(format!("{} {what}: {told}", self.name));
        }
        !matches!(outcome, Outcome::Broken(_))
    }

    async fn unary(&mut self) -> bool {
        let oldest = self.ledger.told();
        let query = evaluate(state(&mut self.chance)).encode_to_vec();
        let begun = Instant::now();
        let outcome = self.call("/wade.v1.Hydrodynamics/Evaluate", &[query]).await;
        self.soon(begun, "a query");
        if let Outcome::Status(0, messages) = &outcome {
            match messages.as_slice() {
                [message] => self.versioned(oldest, message),
                _ => self.ledger.breaks(format!("{}: {} answers of one query", self.name, messages.len())),
            }
        }
        self.judged("a query", &outcome)
    }

    /// Computing takes no time here: a calm client waits for the network alone.
    fn soon(&self, begun: Instant, what: &str) {
        let took = begun.elapsed();
        if self.calm && took > SETTLED {
            self.ledger.breaks(format!("{} waited {took:?} for {what}", self.name));
        }
    }

    /// The version of an answer was served while it was asked for.
    fn versioned(&self, oldest: u32, message: &Bytes) {
        let newest = self.ledger.written();
        let version = proto::EvaluateResponse::decode(message.clone()).map(|answer| answer.bundle_version);
        if !version.as_ref().is_ok_and(|version| (oldest..=newest).contains(version)) {
            self.ledger.breaks(format!("{}: version {version:?}, not {oldest} to {newest}", self.name));
        }
    }

    async fn batch(&mut self) -> bool {
        let states = self.states();
        let outcome = self.call("/wade.v1.Hydrodynamics/EvaluateBatch", &[states]).await;
        self.judged("a batch", &outcome)
    }

    fn states(&mut self) -> Vec<u8> {
        let depth_m: Vec<f32> = (0..self.chance.usize(1..=64)).map(|_| self.chance.f32() * 0.4).collect();
        proto::EvaluateBatchRequest { vehicle: NAME.into(), depth_m, ..Default::default() }.encode_to_vec()
    }

    /// The answers of a stream are those of a session.
    async fn stream(&mut self) -> bool {
        let states: Vec<_> = (0..self.chance.usize(1..20)).map(|_| state(&mut self.chance)).collect();
        let messages: Vec<_> = states.iter().map(|state| evaluate(state.clone()).encode_to_vec()).collect();
        let outcome = self.call("/wade.v1.Hydrodynamics/Stream", &messages).await;
        if let Outcome::Status(0, answers) = &outcome {
            let expected = in_process(&states);
            let found: Vec<_> = answers.iter().map(wrench).collect();
            if found != expected {
                self.ledger
                    .breaks(format!("{}: a stream is answered with {found:?}, not {expected:?}", self.name));
            }
        }
        self.judged("a stream", &outcome)
    }

    /// More calls at once than a connection has in one turn.
    async fn burst(&mut self) -> bool {
        let (mut begun, start) = (Vec::new(), Instant::now());
        for _ in 0..self.chance.usize(4..16) {
            let query = evaluate(state(&mut self.chance)).encode_to_vec();
            let Some(response) = self.ask("/wade.v1.Hydrodynamics/Evaluate", &query).await else { break };
            begun.push(response);
        }
        let mut goes_on = true;
        for response in begun {
            let outcome = bounded(&self.ledger, &self.name, "a burst", finished(response)).await;
            goes_on &= self.judged("one of many queries", &outcome);
        }
        self.soon(start, "a burst");
        goes_on
    }

    /// Once, or several times at once: the same job does for all.
    async fn reload(&mut self) -> bool {
        let version = self.ledger.writes();
        crate::served::put(version);
        let request = proto::ReloadRequest { vehicle: NAME.into(), ..Default::default() }.encode_to_vec();
        let mut begun = Vec::new();
        for _ in 0..self.chance.usize(1..4) {
            // before it can be read
            self.ledger.asks_for_reload();
            let Some(response) = self.ask("/wade.v1.Admin/Reload", &request).await else { break };
            begun.push(response);
        }
        let mut goes_on = true;
        for response in begun {
            let outcome = bounded(&self.ledger, &self.name, "a reload", finished(response)).await;
            if let Outcome::Status(0, messages) = &outcome {
                self.reloaded(version, messages);
            }
            // of a calm client too: another job may wait
            goes_on &= matches!(outcome, Outcome::Status(8, _)) || self.judged("a reload", &outcome);
        }
        goes_on
    }

    fn reloaded(&self, version: u32, messages: &[Bytes]) {
        let answer = messages.first().map(|message| proto::ReloadResponse::decode(message.clone()));
        let served =
            answer.and_then(Result::ok).and_then(|answer| Some(answer.vehicles.first()?.bundle_version));
        match served {
            // another administrator may have put a newer one there meanwhile
            Some(served) if (version..=self.ledger.written()).contains(&served) => self.ledger.tells(served),
            served => self.ledger.breaks(format!("{}: version {version} was read as {served:?}", self.name)),
        }
    }

    async fn health(&mut self) -> bool {
        let outcome = self.call("/grpc.health.v1.Health/Check", &[Vec::new()]).await;
        self.judged("a health check", &outcome)
    }

    /// The place of a query is taken before the query is complete.
    async fn sends_slowly(&mut self) -> bool {
        let query = framed(&evaluate(state(&mut self.chance)).encode_to_vec());
        let parts = [query.slice(..query.len() / 2), query.slice(query.len() / 2..)];
        let pause = Duration::from_millis(self.chance.u64(200..3500));
        let slow = async {
            let (mut response, mut body) = self.begin("/wade.v1.Hydrodynamics/Evaluate").await?;
            body.send_data(parts[0].clone(), false)?;
            let opened = self.opened(Place::Request);
            tokio::select! {
                biased;
                early = &mut response => {
                    drop(opened);
                    return read(early?).await;
                }
                () = tokio::time::sleep(pause) => drop(opened),
            }
            // it may have been given up there
            if body.send_data(parts[1].clone(), true).is_err() {
                return finished(response).await;
            }
            finished(response).await
        };
        let outcome = bounded(&self.ledger, &self.name, "a slow query", slow).await;
        self.judged("a slow query", &outcome)
    }

    /// A call that the server surely counts.
    fn opened(&self, place: Place) -> Option<Opened> {
        self.accepted.get().then(|| self.ledger.open(place))
    }

    async fn gives_up(&mut self) -> bool {
        let (path, message) = match self.chance.bool() {
            true => ("/wade.v1.Hydrodynamics/EvaluateBatch", self.states()),
            false => ("/wade.v1.Hydrodynamics/Evaluate", evaluate(state(&mut self.chance)).encode_to_vec()),
        };
        let Ok((response, mut body)) = self.begin(path).await else { return false };
        let sent = body.send_data(framed(&message), self.chance.bool());
        tokio::time::sleep(Duration::from_micros(self.chance.u64(0..50_000))).await;
        body.send_reset(h2::Reason::CANCEL);
        drop(response);
        sent.is_ok()
    }

    /// Answers pile up until the server, or somebody who needs the place, has enough of it.
    async fn does_not_read(&mut self) -> bool {
        let mut kept = Vec::new();
        for _ in 0..self.chance.usize(1..6) {
            let message = self.states();
            let Some(response) = self.ask("/wade.v1.Hydrodynamics/EvaluateBatch", &message).await else {
                break;
            };
            kept.push(response);
        }
        tokio::time::sleep(Duration::from_millis(self.chance.u64(100..6000))).await;
        false
    }

    async fn holds_a_stream(&mut self) -> bool {
        let pause = Duration::from_millis(self.chance.u64(200..6000));
        let message = framed(&evaluate(state(&mut self.chance)).encode_to_vec());
        let held = async {
            let (response, mut body) = self.begin("/wade.v1.Hydrodynamics/Stream").await?;
            body.send_data(message, false)?;
            let opened = self.opened(Place::Stream);
            let response = response.await?;
            let (head, mut answers) = response.into_parts();
            if head.headers.contains_key("grpc-status") {
                drop(opened);
                return read(http::Response::from_parts(head, answers)).await;
            }
            let first = tokio::select! {
                biased;
                // the answer to the one message comes, and then only the end
                first = async { (answers.data().await, answers.data().await) } => Some(first),
                () = tokio::time::sleep(pause) => None,
            };
            drop(opened);
            let _ = body.send_data(Bytes::new(), true);
            drop(first);
            Ok(Outcome::Status(0, Vec::new()))
        };
        let outcome = bounded(&self.ledger, &self.name, "a held stream", held).await;
        self.judged("a held stream", &outcome)
    }

    async fn sends_garbage(&mut self) -> bool {
        let bytes: Vec<u8> = (0..self.chance.usize(0..200)).map(|_| self.chance.u8(..)).collect();
        let Ok((response, mut body)) = self.begin("/wade.v1.Hydrodynamics/EvaluateBatch").await else {
            return false;
        };
        let _ = body.send_data(bytes.into(), true);
        let outcome = bounded(&self.ledger, &self.name, "garbage", finished(response)).await;
        !matches!(outcome, Outcome::Broken(_))
    }

    fn is_cut(&mut self) -> bool {
        self.cable = None;
        false
    }
}

async fn bounded(ledger: &Ledger, name: &str, what: &str, call: impl Future<Output = Ended>) -> Outcome {
    match tokio::time::timeout(BOUND, call).await {
        Ok(Ok(outcome)) => outcome,
        Ok(Err(error)) => Outcome::Broken(error.to_string()),
        Err(_) => {
            ledger.breaks(format!("{name}: {what} has no end after {BOUND:?}"));
            Outcome::Broken("no end".to_owned())
        }
    }
}

async fn finished(response: h2::client::ResponseFuture) -> Ended {
    read(response.await?).await
}

async fn read(response: http::Response<h2::RecvStream>) -> Ended {
    let (head, mut body) = response.into_parts();
    let mut bytes = Vec::new();
    while let Some(piece) = body.data().await {
        let piece = piece?;
        body.flow_control().release_capacity(piece.len())?;
        bytes.extend_from_slice(&piece);
    }
    let trailers = body.trailers().await?;
    let status = trailers.as_ref().and_then(|trailers| trailers.get("grpc-status"));
    let status = status.or_else(|| head.headers.get("grpc-status"));
    let code = status.and_then(|status| status.to_str().ok()?.parse().ok());
    Ok(Outcome::Status(code.unwrap_or(u16::MAX), unframed(&bytes)))
}

fn framed(message: &[u8]) -> Bytes {
    prefixed(message).into()
}

fn unframed(mut bytes: &[u8]) -> Vec<Bytes> {
    let mut messages = Vec::new();
    while let [_, a, b, c, d, rest @ ..] = bytes {
        let (message, rest) = rest.split_at(rest.len().min(u32::from_be_bytes([*a, *b, *c, *d]) as usize));
        messages.push(Bytes::copy_from_slice(message));
        bytes = rest;
    }
    messages
}

fn state(chance: &mut Rng) -> proto::State {
    let mut speed = || chance.f32() - 0.5;
    let velocity = proto::Vector3 { x: speed(), y: speed(), z: speed() };
    proto::State {
        velocity_mps: Some(velocity),
        depth_m: Some(chance.f32() * 0.4),
        time_step_s: 0.01,
        ..proto::State::default()
    }
}

fn evaluate(state: proto::State) -> proto::EvaluateRequest {
    proto::EvaluateRequest { vehicle: NAME.into(), state: Some(state) }
}

/// Force and moment, bit by bit.
fn wrench(message: &Bytes) -> Option<[u32; 6]> {
    let answer = proto::EvaluateResponse::decode(message.clone()).ok()?;
    Some(bits(&answer))
}

fn bits(answer: &proto::EvaluateResponse) -> [u32; 6] {
    let wrench = answer.wrench.unwrap_or_default();
    let [force, moment] = [wrench.force_n, wrench.moment_nm].map(Option::unwrap_or_default);
    [force.x, force.y, force.z, moment.x, moment.y, moment.z].map(f32::to_bits)
}

/// What the library answers in one session.
fn in_process(states: &[proto::State]) -> Vec<Option<[u32; 6]>> {
    crate::world::with_vehicle(|vehicle: &ServedVehicle| {
        let (mut evaluator, mut session) = (Evaluator::default(), Session::default());
        let answer = |state: &proto::State| {
            let state = wade_wire::state(state, vehicle).ok()?.check_for(vehicle).ok()?;
            let evaluated = evaluator.evaluate(vehicle, &state, Some(&mut session));
            Some(bits(&wade_wire::response(vehicle, &evaluated)))
        };
        states.iter().map(answer).collect()
    })
}
