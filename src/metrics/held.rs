//! What connections make the server hold, its limits, and which connections were closed for it.

use std::sync::atomic::AtomicI64;

use prometheus_client::encoding::{EncodeLabelSet, EncodeLabelValue};
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::Registry;

use super::Metrics;

wade_core::named_enum! {
    /// What a connection makes the server hold.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, EncodeLabelValue)]
    #[allow(non_camel_case_types, missing_docs, reason = "the names are the label's values")]
    pub enum Resource {
        connections,
        http_connections,
        requests,
        batches,
        probes,
        streams,
        watches,
        bytes,
    }
}

wade_core::named_enum! {
    /// Why the server closed a connection.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, EncodeLabelValue)]
    #[allow(non_camel_case_types, missing_docs, reason = "the names are the label's values")]
    pub enum Closed {
        no_handshake,
        no_tls,
        drained,
        no_request,
        idle,
        answer_not_read,
        control_frames,
        broke_protocol,
        made_room,
        no_room,
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct ResourceLabels {
    resource: Resource,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct ClosedLabels {
    reason: Closed,
}

/// The metrics of this module.
#[derive(Debug, Default)]
pub(super) struct HeldMetrics {
    held: Family<ResourceLabels, Gauge>,
    limits: Family<ResourceLabels, Gauge>,
    closed: Family<ClosedLabels, Counter>,
    throttled: Counter,
    accept_errors: Counter,
    admin_jobs: Gauge<i64, AtomicI64>,
}

impl HeldMetrics {
    pub(super) fn register(registry: &mut Registry) -> Self {
        let metrics = Self::default();
        for reason in Closed::ALL {
            // there from the start, so that a rate sees the first one
            let _ = metrics.closed.get_or_create(&ClosedLabels { reason });
        }
        registry.register("held", "What connections make the server hold", metrics.held.clone());
        registry.register("limit", "The most of each resource that is held", metrics.limits.clone());
        registry.register("connections_closed", "Connections that the server closed", metrics.closed.clone());
        registry.register(
            "control_frame_pauses",
            "Pauses in reading a connection that sent too many control frames",
            metrics.throttled.clone(),
        );
        registry.register(
            "accept_errors",
            "Connections that the system could not hand over",
            metrics.accept_errors.clone(),
        );
        registry.register("admin_jobs", "Administrator's jobs that run or wait", metrics.admin_jobs.clone());
        metrics
    }
}

impl Metrics {
    /// The gauge that counts what is held.
    pub fn held(&self, resource: Resource) -> Gauge {
        self.holding.held.get_or_create(&ResourceLabels { resource }).clone()
    }

    /// States a limit.
    pub fn set_limit(&self, resource: Resource, limit: usize) {
        let limit = i64::try_from(limit).unwrap_or(i64::MAX);
        self.holding.limits.get_or_create(&ResourceLabels { resource }).set(limit);
    }

    /// Counts a connection that the server closes.
    pub fn count_closed(&self, reason: Closed) {
        self.holding.closed.get_or_create(&ClosedLabels { reason }).inc();
    }

    /// Counts a pause in reading a connection.
    pub fn count_pause(&self) {
        self.holding.throttled.inc();
    }

    /// Counts a connection that could not be accepted.
    pub fn count_accept_error(&self) {
        self.holding.accept_errors.inc();
    }

    /// States how many of the administrator's jobs run or wait.
    pub fn set_admin_jobs(&self, jobs: usize) {
        self.holding.admin_jobs.set(jobs as i64);
    }
}
