//! Promise: where a collector is named, every call over gRPC and HTTP is a span under that of whoever asks; where none is, or it does
//! not answer, calls are answered as ever.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use opentelemetry_proto::tonic::collector::trace::v1::trace_service_server::{
    TraceService, TraceServiceServer,
};
use opentelemetry_proto::tonic::collector::trace::v1::{
    ExportTraceServiceRequest, ExportTraceServiceResponse,
};
use opentelemetry_proto::tonic::common::v1::any_value::Value;
use opentelemetry_proto::tonic::trace::v1::Span;
use tonic::metadata::MetadataValue;
use tonic::transport::Endpoint;
use tonic::{Request, Response, Status};
use wade_wire::proto;
use wade_wire::proto::hydrodynamics_client::HydrodynamicsClient;

use crate::common::{Served, http};

const TRACE: &str = "4bf92f3577b34da6a3ce929d0e0e4736";
const PARENT: &str = "00f067aa0ba902b7";

#[derive(Clone, Default)]
struct Collector(Arc<Mutex<Vec<Span>>>);

#[tonic::async_trait]
impl TraceService for Collector {
    async fn export(
        &self,
        request: Request<ExportTraceServiceRequest>,
    ) -> Result<Response<ExportTraceServiceResponse>, Status> {
        let resources = request.into_inner().resource_spans.into_iter();
        let spans = resources.flat_map(|resource| resource.scope_spans).flat_map(|scope| scope.spans);
        self.0.lock().expect("no panic").extend(spans);
        Ok(Response::new(ExportTraceServiceResponse::default()))
    }
}

/// A collector on a thread of its own, which ends with the tests.
fn collector() -> (Collector, SocketAddr) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let listener = runtime.block_on(tokio::net::TcpListener::bind("127.0.0.1:0")).expect("a port");
    let (collector, address) = (Collector::default(), listener.local_addr().expect("bound"));
    let service = TraceServiceServer::new(collector.clone());
    let incoming = tokio_stream::wrappers::TcpListenerStream::new(listener);
    let serving = tonic::transport::Server::builder().add_service(service).serve_with_incoming(incoming);
    std::thread::spawn(move || runtime.block_on(serving));
    (collector, address)
}

fn traced(endpoint: &str) -> Served {
    Served::with(|config| {
        config.traces.endpoint = endpoint.to_owned();
        config.shm.enabled = false;
    })
}

fn ask(served: &Served, vehicle: &str, parent: Option<&str>) -> Result<(), Status> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    runtime.block_on(async {
        let channel =
            Endpoint::from_shared(served.url()).expect("a URL").connect().await.expect("the server is there");
        let mut client = HydrodynamicsClient::new(channel);
        let state = proto::State { depth_m: Some(0.2), ..Default::default() };
        let mut request =
            Request::new(proto::EvaluateRequest { vehicle: vehicle.into(), state: Some(state) });
        if let Some(parent) = parent {
            request.metadata_mut().insert("traceparent", MetadataValue::try_from(parent).expect("text"));
        }
        client.evaluate(request).await.map(drop)
    })
}

fn number(span: &Span, key: &str) -> Option<i64> {
    let attribute = span.attributes.iter().find(|attribute| attribute.key == key)?;
    match attribute.value.as_ref()?.value.as_ref()? {
        Value::IntValue(number) => Some(*number),
        _ => None,
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn calls_are_spans_under_that_of_whoever_asks() {
    let (collector, address) = collector();
    let served = traced(&format!("http://{address}"));
    ask(&served, "husky", Some(&format!("00-{TRACE}-{PARENT}-01"))).expect("answered");
    // whoever asks may not want to be traced
    ask(&served, "husky", Some(&format!("00-{TRACE}-{PARENT}-00"))).expect("answered");
    ask(&served, "boat", None).expect_err("no such vehicle");
    let http_address = served.running.http_address().expect("HTTP is on");
    for path in ["/livez", "/metrics", "/v1/vehicles/husky"] {
        http::send(http_address, &format!("GET {path}"), &[], "");
    }
    served.running.shutdown();
    let spans = collector.0.lock().expect("no panic");
    let found: Vec<_> = spans.iter().map(|span| span.name.as_str()).collect();
    assert_eq!(found, ["wade.v1.Hydrodynamics/Evaluate", "wade.v1.Hydrodynamics/Evaluate", "GET"]);
    let [first, refused, page] = spans.as_slice() else { panic!("three spans") };
    assert_eq!((hex(&first.trace_id).as_str(), hex(&first.parent_span_id).as_str()), (TRACE, PARENT));
    assert_eq!(number(first, "rpc.grpc.status_code"), Some(0));
    assert!(first.end_time_unix_nano > first.start_time_unix_nano);
    assert!(refused.parent_span_id.is_empty() && hex(&refused.trace_id) != TRACE);
    // not found, which is not the server's fault
    assert_eq!(number(refused, "rpc.grpc.status_code"), Some(5));
    assert!(refused.status.as_ref().is_none_or(|status| status.code == 0));
    assert_eq!(number(page, "http.response.status_code"), Some(200));
}

#[test]
fn without_a_collector_that_answers_calls_are_answered() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("bound");
    drop(listener);
    let served = traced(&format!("http://{address}"));
    for _ in 0..10 {
        ask(&served, "husky", None).expect("answered");
    }
    let start = std::time::Instant::now();
    served.running.shutdown();
    println!("ended after {:?}", start.elapsed());
}
