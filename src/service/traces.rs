//! Traces in the protocol of OpenTelemetry (OTLP over gRPC): a span for each call over gRPC and each request over HTTP, under the
//! span of whoever asks (W3C Trace Context, `traceparent`). Off unless a collector is named. What a collector does not take in
//! time is dropped: no call waits for it.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use hyper::body::{Body as HttpBody, Bytes, Frame, SizeHint};
use opentelemetry::propagation::{Extractor, TextMapPropagator};
use opentelemetry::trace::{Span as _, SpanKind, Status, Tracer as _, TracerProvider as _};
use opentelemetry::{KeyValue, Value};
use opentelemetry_otlp::{ExporterBuildError, SpanExporter, WithExportConfig};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::propagation::TraceContextPropagator;
use opentelemetry_sdk::trace::{Sampler, SdkTracer, SdkTracerProvider, Span};
use serde::{Deserialize, Serialize};
use tokio::runtime::Handle;
use tonic::body::Body;
use tonic::codegen::http::HeaderMap;

use super::accounts::Peer;

/// Longest wait for the collector to take a batch of spans, and at the end for the last.
const PATIENCE: Duration = Duration::from_secs(1);

/// Settings of the traces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Where the collector takes OTLP over gRPC, such as http://127.0.0.1:4317; an empty string: no traces.
    pub endpoint: String,
    /// Share of the calls that are traced where the caller does not say, 0 to 1.
    pub sample_ratio: f64,
}

impl Config {
    /// Whether a collector is named.
    pub fn is_on(&self) -> bool {
        !self.endpoint.is_empty()
    }
}

impl Default for Config {
    fn default() -> Self {
        Self { endpoint: String::new(), sample_ratio: 1.0 }
    }
}

/// Why there are no traces.
#[derive(Debug, thiserror::Error)]
#[error("traces.endpoint = \"{endpoint}\": {reason}")]
pub struct TracesError {
    endpoint: String,
    reason: ExporterBuildError,
}

/// Where spans go.
#[derive(Debug)]
pub struct Traces {
    provider: SdkTracerProvider,
    tracer: SdkTracer,
    propagator: TraceContextPropagator,
}

impl Traces {
    /// Spans for the collector that is named, sent by this runtime.
    pub fn start(config: &Config, runtime: &Handle) -> Result<Arc<Self>, TracesError> {
        let _inside = runtime.enter();
        let exporter =
            SpanExporter::builder().with_tonic().with_endpoint(&config.endpoint).with_timeout(PATIENCE);
        let exporter =
            exporter.build().map_err(|reason| TracesError { endpoint: config.endpoint.clone(), reason })?;
        let version = KeyValue::new("service.version", env!("CARGO_PKG_VERSION"));
        let provider = SdkTracerProvider::builder()
            .with_batch_exporter(exporter)
            .with_sampler(Sampler::ParentBased(Box::new(Sampler::TraceIdRatioBased(config.sample_ratio))))
            .with_resource(Resource::builder().with_service_name("wade").with_attribute(version).build())
            .build();
        let (tracer, propagator) = (provider.tracer("wade"), TraceContextPropagator::new());
        Ok(Arc::new(Self { provider, tracer, propagator }))
    }

    /// A call over gRPC begins (OpenTelemetry semantic conventions, RPC).
    pub fn call(&self, path: &str, headers: &HeaderMap, peer: Peer) -> Span {
        let name = path.trim_start_matches('/');
        let (service, method) = name.split_once('/').unwrap_or((name, ""));
        let attributes = [
            ("rpc.system", Value::from("grpc")),
            ("rpc.service", service.to_owned().into()),
            ("rpc.method", method.to_owned().into()),
        ];
        self.begin(name.to_owned(), headers, peer, attributes)
    }

    /// A request over HTTP begins (OpenTelemetry semantic conventions, HTTP).
    pub fn request(&self, method: &str, path: &str, headers: &HeaderMap, peer: Peer) -> Span {
        let attributes = [
            ("http.request.method", Value::from(method.to_owned())),
            ("url.path", path.to_owned().into()),
            ("url.scheme", "http".into()),
        ];
        self.begin(method.to_owned(), headers, peer, attributes)
    }

    fn begin(
        &self,
        name: String,
        headers: &HeaderMap,
        peer: Peer,
        attributes: [(&'static str, Value); 3],
    ) -> Span {
        let parent = self.propagator.extract(&Headers(headers));
        let attributes = attributes.map(|(key, value)| KeyValue::new(key, value));
        let peer = KeyValue::new("network.peer.address", peer.to_string());
        let span = self.tracer.span_builder(name).with_kind(SpanKind::Server);
        let mut span = span.with_attributes(attributes).start_with_context(&self.tracer, &parent);
        span.set_attribute(peer);
        span
    }

    /// Sends what is left.
    pub fn end(&self) {
        if let Err(error) = self.provider.shutdown_with_timeout(PATIENCE) {
            tracing::warn!(%error, "the last traces did not reach their collector");
        }
    }
}

struct Headers<'h>(&'h HeaderMap);

impl Extractor for Headers<'_> {
    fn get(&self, key: &str) -> Option<&str> {
        self.0.get(key)?.to_str().ok()
    }

    fn keys(&self) -> Vec<&str> {
        self.0.keys().map(|key| key.as_str()).collect()
    }
}

/// Notes the status of an answer over HTTP, with which its span ends.
pub fn answered(span: &mut Span, status: u16) {
    span.set_attribute(KeyValue::new("http.response.status_code", i64::from(status)));
    if status >= 500 {
        span.set_status(Status::error(""));
    }
}

/// Notes the status of a call, where these headers or trailers say it.
pub fn note(span: &mut Span, headers: &HeaderMap) {
    let status = headers.get("grpc-status").and_then(|status| status.to_str().ok()?.parse::<i64>().ok());
    let Some(status) = status else { return };
    span.set_attribute(KeyValue::new("rpc.grpc.status_code", status));
    // what is the server's fault: unknown, deadline exceeded, unimplemented, internal, unavailable, data loss
    if [2, 4, 12, 13, 14, 15].contains(&status) {
        let message = headers.get("grpc-message").and_then(|message| message.to_str().ok());
        span.set_status(Status::error(message.unwrap_or_default().to_owned()));
    }
}

/// The body of an answer, whose span ends with it.
pub struct Traced {
    body: Body,
    span: Span,
}

impl Traced {
    /// An answer of this call.
    pub fn new(body: Body, span: Span) -> Self {
        Self { body, span }
    }
}

impl HttpBody for Traced {
    type Data = Bytes;
    type Error = tonic::Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, tonic::Status>>> {
        let polled = Pin::new(&mut self.body).poll_frame(cx);
        if let Poll::Ready(Some(Ok(frame))) = &polled
            && let Some(trailers) = frame.trailers_ref()
        {
            note(&mut self.span, trailers);
        }
        polled
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
