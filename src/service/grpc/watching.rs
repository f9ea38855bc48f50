//! Health over gRPC: what tonic-health says, but that those who watch hear the last of it and are let go when the server
//! stops. A drain would wait for them.

use std::future::Future;
use std::pin::Pin;
use std::task::{Context, Poll};

use tokio::sync::watch;
use tokio_stream::Stream;
use tonic::{Request, Response, Status};
use tonic_health::pb::health_server::Health;
use tonic_health::pb::{HealthCheckRequest, HealthCheckResponse};
use tonic_health::server::{HealthReporter, HealthService, WatchStream};

use crate::service::stopped;

/// Health of a server until it stops.
pub struct WatchedHealth {
    statuses: HealthService,
    stop: watch::Receiver<bool>,
}

impl WatchedHealth {
    /// Tells what is reported until `stop` turns true.
    pub fn new(reporter: &HealthReporter, stop: &watch::Receiver<bool>) -> Self {
        Self { statuses: HealthService::from_health_reporter(reporter.clone()), stop: stop.clone() }
    }
}

#[tonic::async_trait]
impl Health for WatchedHealth {
    async fn check(
        &self,
        request: Request<HealthCheckRequest>,
    ) -> Result<Response<HealthCheckResponse>, Status> {
        self.statuses.check(request).await
    }

    type WatchStream = Watching;

    async fn watch(&self, request: Request<HealthCheckRequest>) -> Result<Response<Watching>, Status> {
        let stop = Box::pin(stopped(self.stop.clone()));
        let watching = |statuses| Watching { statuses, stop, is_over: false };
        Ok(self.statuses.watch(request).await?.map(watching))
    }
}

/// Each status that follows, until the server stops.
pub struct Watching {
    statuses: WatchStream,
    stop: Pin<Box<dyn Future<Output = ()> + Send>>,
    is_over: bool,
}

impl Stream for Watching {
    type Item = Result<HealthCheckResponse, Status>;

    fn poll_next(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        // the last status is set before the server stops, so it is there where the stop is seen first
        self.is_over = self.is_over || self.stop.as_mut().poll(cx).is_ready();
        match Pin::new(&mut self.statuses).poll_next(cx) {
            Poll::Pending if self.is_over => Poll::Ready(None),
            polled => polled,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tokio_stream::StreamExt;
    use tonic_health::pb::health_check_response::ServingStatus::{NotServing, Serving};

    /// A simulated world found that a check got NOT_FOUND while the server drained.
    #[tokio::test]
    async fn a_server_that_stops_is_not_serving_and_lets_those_go_who_watch() {
        let reporter = HealthReporter::new();
        let (stop, stopped) = watch::channel(false);
        let health = WatchedHealth::new(&reporter, &stopped);
        let asked = || Request::new(HealthCheckRequest::default());
        let before = health.watch(asked()).await.expect("known").into_inner();
        reporter.set_service_status("", tonic_health::ServingStatus::NotServing).await;
        stop.send_replace(true);
        assert_eq!(health.check(asked()).await.expect("known").into_inner().status(), NotServing);
        for watching in [before, health.watch(asked()).await.expect("known").into_inner()] {
            let heard: Vec<_> = watching.map(|status| status.expect("a status").status()).collect().await;
            assert!(!heard.contains(&Serving) && heard.last() == Some(&NotServing), "{heard:?}");
        }
    }
}
