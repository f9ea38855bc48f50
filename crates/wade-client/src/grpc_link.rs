//! A gRPC connection to one vehicle, for whoever drives a runtime; [`super::GrpcClient`] is its blocking form.

use std::time::Duration;

use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::metadata::{Ascii, MetadataValue};
use tonic::transport::Channel;
use tonic::{Code, Request, Response, Status, Streaming};

use super::credentials::{Credentials, sign};
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
    authorization: Option<MetadataValue<Ascii>>,
    stream: Option<Open>,
}

#[derive(Debug)]
struct Open {
    requests: mpsc::Sender<proto::EvaluateRequest>,
    answers: Streaming<proto::EvaluateResponse>,
}

impl GrpcLink {
    /// Connects to `http://HOST:PORT`, `https://HOST:PORT` or `unix:PATH`. The timeout is for this and for every call.
    pub async fn connect(
        url: &str,
        vehicle: &str,
        timeout: Duration,
        credentials: &Credentials,
    ) -> Result<Self, ClientError> {
        let authorization = credentials.authorization()?;
        let channel = credentials.connect(url, timeout).await?;
        let client = HydrodynamicsClient::new(channel).max_decoding_message_size(64 << 20);
        let (url, vehicle) = (url.to_owned(), vehicle.to_owned());
        Ok(Self { client, url, vehicle, timeout, authorization, stream: None })
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
        let Self { client, stream, timeout, authorization, .. } = self;
        let exchange = async {
            let open = match stream {
                Some(open) => open,
                None => stream.insert(open(client, authorization.as_ref()).await?),
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
        sign(request.metadata_mut(), self.authorization.as_ref());
        request
    }

    fn answered<T>(&self, response: Result<Response<T>, Status>) -> Result<T, ClientError> {
        response.map(Response::into_inner).map_err(|status| self.error(&status))
    }

    fn error(&self, status: &Status) -> ClientError {
        match (status.code(), std::error::Error::source(status)) {
            (Code::DeadlineExceeded | Code::Cancelled, _) => ClientError::Timeout(self.timeout),
            // not the server's word: the connection
            (_, Some(cause)) => nobody_at(&self.url, cause),
            (Code::Unavailable | Code::Unknown, None) => {
                ClientError::NoServer { at: self.url.clone(), reason: status.message().to_owned() }
            }
            (code, None) => ClientError::Refused { code, message: status.message().to_owned() },
        }
    }
}

async fn open(
    client: &mut HydrodynamicsClient<Channel>,
    authorization: Option<&MetadataValue<Ascii>>,
) -> Result<Open, Status> {
    let (requests, outgoing) = mpsc::channel(1);
    let mut request = Request::new(ReceiverStream::new(outgoing));
    sign(request.metadata_mut(), authorization);
    let answers = client.stream(request).await?.into_inner();
    Ok(Open { requests, answers })
}
