//! A gRPC connection to one vehicle, for whoever drives a runtime; [`super::GrpcClient`] is its blocking form.

use std::time::Duration;

use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Request, Response, Status, Streaming};

use super::grpc::{batch_message, message, shared};
use super::{ClientError, nobody_at};
use wade_wire::State;
use wade_wire::proto;
use wade_wire::proto::hydrodynamics_client::HydrodynamicsClient;

/// A connection, and the stream that was opened on it.
#[derive(Debug)]
pub struct GrpcLink {
    client: HydrodynamicsClient<Channel>,
    url: String,
    vehicle: String,
    timeout: Duration,
    stream: Option<Open>,
}

#[derive(Debug)]
struct Open {
    requests: mpsc::Sender<proto::EvaluateRequest>,
    answers: Streaming<proto::EvaluateResponse>,
}

impl GrpcLink {
    /// Connects to `http://HOST:PORT` or `unix:PATH`. The timeout is for this and for every call.
    pub async fn connect(url: &str, vehicle: &str, timeout: Duration) -> Result<Self, ClientError> {
        let endpoint = Endpoint::from_shared(url.to_owned()).map_err(|e| nobody_at(url, &e))?;
        let endpoint = endpoint.connect_timeout(timeout).tcp_nodelay(true);
        let channel = endpoint.connect().await.map_err(|e| nobody_at(url, &e))?;
        let client = HydrodynamicsClient::new(channel).max_decoding_message_size(64 << 20);
        Ok(Self { client, url: url.to_owned(), vehicle: vehicle.to_owned(), timeout, stream: None })
    }

    /// The forces in one state, in a call of its own.
    pub async fn evaluate(&mut self, state: &State) -> Result<proto::EvaluateResponse, ClientError> {
        let request = self.request(self.query(state));
        let response = self.client.evaluate(request).await;
        self.answered(response)
    }

    /// The forces in one state, in the stream. Opens one where there is none; an error ends it.
    pub async fn evaluate_in_stream(
        &mut self,
        state: &State,
    ) -> Result<proto::EvaluateResponse, ClientError> {
        let query = self.query(state);
        let Self { client, stream, timeout, .. } = self;
        let exchange = async {
            let open = match stream {
                Some(open) => open,
                None => stream.insert(open(client).await?),
            };
            if open.requests.send(query).await.is_err() {
                tracing::debug!("the stream was closed by the server; its answer says why");
            }
            open.answers.message().await?.ok_or_else(|| Status::unavailable("the server closed the stream"))
        };
        let answer = tokio::time::timeout(*timeout, exchange).await;
        let answer = answer.unwrap_or_else(|_| Err(Status::deadline_exceeded("no answer in the stream")));
        answer.map_err(|status| {
            // a stream ends with its first error; the next query opens another
            self.stream = None;
            self.error(&status)
        })
    }

    /// True where the next state in the stream goes on with one that is open.
    pub fn has_stream(&self) -> bool {
        self.stream.is_some()
    }

    /// Ends the stream, and with it what the effects remember.
    pub fn end_stream(&mut self) {
        self.stream = None;
    }

    /// The forces in each state of a batch.
    pub async fn evaluate_batch(
        &mut self,
        states: &[State],
    ) -> Result<proto::EvaluateBatchResponse, ClientError> {
        if states.windows(2).any(|pair| shared(&pair[0]) != shared(&pair[1])) {
            return Err(ClientError::MixedBatch);
        }
        let request = self.request(batch_message(&self.vehicle, states));
        let response = self.client.evaluate_batch(request).await;
        self.answered(response)
    }

    /// How the vehicle stands.
    pub async fn stability(
        &mut self,
        query: proto::GetStabilityRequest,
    ) -> Result<proto::GetStabilityResponse, ClientError> {
        let request = self.request(query);
        let response = self.client.get_stability(request).await;
        self.answered(response)
    }

    /// What the server says of the vehicle.
    pub async fn vehicle(&mut self) -> Result<proto::GetVehicleResponse, ClientError> {
        let query = proto::GetVehicleRequest { vehicle: self.vehicle.clone(), include_mesh: false };
        let request = self.request(query);
        let response = self.client.get_vehicle(request).await;
        self.answered(response)
    }

    fn query(&self, state: &State) -> proto::EvaluateRequest {
        proto::EvaluateRequest { vehicle: self.vehicle.clone(), state: Some(message(state)) }
    }

    fn request<T>(&self, message: T) -> Request<T> {
        let mut request = Request::new(message);
        request.set_timeout(self.timeout);
        request
    }

    fn answered<T>(&self, response: Result<Response<T>, Status>) -> Result<T, ClientError> {
        response.map(Response::into_inner).map_err(|status| self.error(&status))
    }

    fn error(&self, status: &Status) -> ClientError {
        match status.code() {
            Code::DeadlineExceeded | Code::Cancelled => ClientError::Timeout(self.timeout),
            Code::Unavailable | Code::Unknown => {
                ClientError::NoServer { at: self.url.clone(), reason: status.message().to_owned() }
            }
            code => ClientError::Refused { code, message: status.message().to_owned() },
        }
    }
}

async fn open(client: &mut HydrodynamicsClient<Channel>) -> Result<Open, Status> {
    let (requests, outgoing) = mpsc::channel(1);
    let answers = client.stream(ReceiverStream::new(outgoing)).await?.into_inner();
    Ok(Open { requests, answers })
}
