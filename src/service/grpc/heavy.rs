//! Calls that take milliseconds, away from the thread that reads: their messages are decoded, answered and encoded where long
//! work is done. One of a few states is answered at once, as a single query is: the way there and back would take longer.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use hyper::body::{Body as HttpBody, Frame};
use prost::Message;
use prost::bytes::{Buf, BufMut, Bytes, BytesMut};
use tokio::time::Instant;
use tonic::body::Body;
use tonic::codec::{
    Codec, CompressionEncoding, DecodeBuf, Decoder, EnabledCompressionEncodings, EncodeBuf, Encoder,
};
use tonic::codegen::http;
use tonic::server::{Grpc, UnaryService};
use tonic::{Request, Response, Status};

use super::inference::InferenceHandlers;
use crate::service::accounts::{Connection, Heavy as UnderWay};
use crate::service::bulk::Bulk;
use crate::service::call::Arrived;
use wade_wire::proto;
use wade_wire::proto::hydrodynamics_server::Hydrodynamics;
use wade_wire::proto::inference::ModelInferRequest;
use wade_wire::proto::inference::grpc_inference_service_server::GrpcInferenceService;

/// Longest request that is looked at where it was read [bytes]: decoding it takes a few microseconds.
const SHORT: usize = 2 << 10;
/// Most states that are answered where they were read: they take what waiting for another thread may take.
const FEW_STATES: usize = 16;

/// The calls that take milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Heavy {
    /// `EvaluateBatch`.
    Batch,
    /// `GetStability`.
    Stability,
    /// `ModelInfer`.
    Infer,
}

/// Who answers them.
#[derive(Debug, Clone)]
pub struct HeavyCalls {
    pub(super) handlers: InferenceHandlers,
    pub(super) bulk: Arc<Bulk>,
    /// Longest message [bytes].
    pub(super) limit: usize,
}

impl HeavyCalls {
    /// Answers a call of this connection.
    pub async fn answer(
        &self,
        call: Heavy,
        connection: &Arc<Connection>,
        request: http::Request<Body>,
    ) -> http::Response<Body> {
        let mut accepted = EnabledCompressionEncodings::default();
        accepted.enable(CompressionEncoding::Gzip);
        let mut grpc = Grpc::new(Raw)
            .apply_compression_config(accepted, EnabledCompressionEncodings::default())
            .apply_max_message_size_config(Some(self.limit), None);
        let (calls, connection) = (self.clone(), Arc::clone(connection));
        let mut response = match call {
            Heavy::Batch => {
                let answer = |calls: HeavyCalls, request| {
                    Box::pin(async move { calls.handlers.handlers.evaluate_batch(request).await })
                        as Answer<_>
                };
                grpc.unary(Service { calls, connection, answer }, request).await
            }
            Heavy::Stability => {
                let answer = |calls: HeavyCalls, request| {
                    Box::pin(async move { calls.handlers.handlers.get_stability(request).await }) as Answer<_>
                };
                grpc.unary(Service { calls, connection, answer }, request).await
            }
            Heavy::Infer => {
                let answer = |calls: HeavyCalls, request| {
                    Box::pin(async move { calls.handlers.model_infer(request).await }) as Answer<_>
                };
                grpc.unary(Service { calls, connection, answer }, request).await
            }
        };
        match response.extensions_mut().remove::<Encoded>() {
            Some(encoded) => response.map(|_| Body::new(encoded)),
            None => response,
        }
    }
}

type Answer<T> = Pin<Box<dyn Future<Output = Result<Response<T>, Status>> + Send>>;

/// A request that may ask for many states.
trait States: Message + Default + 'static {
    /// How many it asks for.
    fn states(&self) -> usize;
}

impl States for proto::EvaluateBatchRequest {
    fn states(&self) -> usize {
        // a batch is as long as the one of them that it has
        self.depth_m.len().max(self.water_level_m.len())
    }
}

impl States for proto::GetStabilityRequest {
    fn states(&self) -> usize {
        self.depth_m.len().saturating_mul(self.speed_mps.len())
    }
}

impl States for ModelInferRequest {
    fn states(&self) -> usize {
        let rows = self.inputs.iter().filter_map(|input| input.shape.first()).max();
        rows.map_or(0, |&rows| usize::try_from(rows).unwrap_or(usize::MAX))
    }
}

/// One of the calls.
struct Service<M, R> {
    calls: HeavyCalls,
    connection: Arc<Connection>,
    answer: fn(HeavyCalls, Request<M>) -> Answer<R>,
}

impl<M: States, R: Message + 'static> UnaryService<Bytes> for Service<M, R> {
    type Response = Bytes;
    type Future = Answer<Bytes>;

    fn call(&mut self, mut request: Request<Bytes>) -> Self::Future {
        request.extensions_mut().insert(Arrived(Instant::now()));
        let (calls, connection, answer) = (self.calls.clone(), Arc::clone(&self.connection), self.answer);
        Box::pin(async move {
            let (metadata, extensions, bytes) = request.into_parts();
            // the bytes are shared, not copied
            let decode = |bytes: Bytes| M::decode(bytes).map_err(|error| Status::internal(error.to_string()));
            let known = (bytes.len() <= SHORT).then(|| decode(bytes.clone())).transpose()?;
            let is_light = known.as_ref().is_some_and(|message| message.states() <= FEW_STATES);
            let bulk = Arc::clone(&calls.bulk);
            let work = async move {
                let message = known.map_or_else(|| decode(bytes), Ok)?;
                let response = answer(calls, Request::from_parts(metadata, extensions, message)).await?;
                let (metadata, message, mut extensions) = response.into_parts();
                // tonic frames no message, and so copies none
                extensions.insert(Encoded::new(&message));
                Ok(Response::from_parts(metadata, Bytes::new(), extensions))
            };
            if is_light {
                return work.await;
            }
            let _heavy = UnderWay::begin(&connection);
            bulk.run(connection.peer(), work).await.map_err(|error| Status::unavailable(error.to_string()))?
        })
    }
}

/// Length of what stands before a message: a flag, here of one that is not compressed, and its length [bytes].
const PREFIX: usize = 5;

/// The body of an answer, encoded where it was computed. It is passed on to the socket without a copy.
#[derive(Debug, Clone)]
struct Encoded {
    message: Option<Bytes>,
    ended: bool,
}

impl Encoded {
    fn new(message: &impl Message) -> Self {
        let len = message.encoded_len();
        let mut bytes = BytesMut::with_capacity(PREFIX + len);
        bytes.put_u8(0);
        // no message of more than 4 GB is encoded: the longest batch is bounded by that of a request
        bytes.put_u32(u32::try_from(len).unwrap_or(u32::MAX));
        // there is room for it
        let _ = message.encode(&mut bytes);
        Self { message: Some(bytes.freeze()), ended: false }
    }
}

impl HttpBody for Encoded {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        _: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Status>>> {
        if let Some(message) = self.message.take() {
            return Poll::Ready(Some(Ok(Frame::data(message))));
        }
        if std::mem::replace(&mut self.ended, true) {
            return Poll::Ready(None);
        }
        let mut trailers = http::HeaderMap::new();
        trailers.insert("grpc-status", http::HeaderValue::from_static("0"));
        Poll::Ready(Some(Ok(Frame::trailers(trailers))))
    }

    fn is_end_stream(&self) -> bool {
        self.ended
    }
}

/// Passes messages on as they are.
struct Raw;

impl Codec for Raw {
    type Encode = Bytes;
    type Decode = Bytes;
    type Encoder = Self;
    type Decoder = Self;

    fn encoder(&mut self) -> Self {
        Self
    }

    fn decoder(&mut self) -> Self {
        Self
    }
}

impl Encoder for Raw {
    type Item = Bytes;
    type Error = Status;

    fn encode(&mut self, message: Bytes, buffer: &mut EncodeBuf<'_>) -> Result<(), Status> {
        buffer.put(message);
        Ok(())
    }
}

impl Decoder for Raw {
    type Item = Bytes;
    type Error = Status;

    fn decode(&mut self, buffer: &mut DecodeBuf<'_>) -> Result<Option<Bytes>, Status> {
        Ok(Some(buffer.copy_to_bytes(buffer.remaining())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wade_wire::proto::inference::model_infer_request::InferInputTensor;

    #[test]
    fn a_request_counts_its_states_by_whichever_array_it_has() {
        let levels = proto::EvaluateBatchRequest { water_level_m: vec![0.0; 100], ..Default::default() };
        let depths = proto::EvaluateBatchRequest { depth_m: vec![0.0; 100], ..Default::default() };
        assert_eq!([levels.states(), depths.states()], [100, 100]);
        let map = proto::GetStabilityRequest {
            depth_m: vec![0.0; 10],
            speed_mps: vec![0.0; 20],
            ..Default::default()
        };
        assert_eq!(map.states(), 200);
        let tensor = |rows| InferInputTensor { shape: vec![rows, 3], ..Default::default() };
        let infer = ModelInferRequest { inputs: vec![tensor(1), tensor(50)], ..Default::default() };
        assert_eq!(infer.states(), 50);
        let negative = ModelInferRequest { inputs: vec![tensor(-1)], ..Default::default() };
        assert_eq!(negative.states(), usize::MAX);
    }
}
