//! Every metric's name, unit and buckets, and the one function that records a request.

mod exchange;
mod held;

/// The locks of [`exchange`], for which its model has others.
mod sync {
    pub use std::sync::{Mutex, MutexGuard};
}

pub use held::{Closed, Resource};

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, PoisonError, RwLock};
use std::time::Duration;

use hdrhistogram::Histogram;
use prometheus_client::encoding::{EncodeLabelSet, EncodeLabelValue, text};
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram as Buckets;
use prometheus_client::registry::{Registry, Unit};

use exchange::Exchange;

/// Upper bounds of the Prometheus buckets [s]: 1 us to 100 ms.
const BUCKETS_S: [f64; 22] = [
    1e-6, 2e-6, 5e-6, 7.5e-6, 10e-6, 15e-6, 20e-6, 30e-6, 50e-6, 75e-6, 100e-6, 150e-6, 200e-6, 300e-6,
    500e-6, 1e-3, 2e-3, 5e-3, 10e-3, 20e-3, 50e-3, 100e-3,
];

wade_core::named_enum! {
    /// The way a request came in: gRPC over TCP, gRPC over the Unix socket, shared memory, or JSON over HTTP. `other` are the
    /// calls that ask for no forces.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, EncodeLabelValue)]
    #[allow(non_camel_case_types, missing_docs, reason = "the names are the label's values")]
    pub enum Transport {
        grpc_unary,
        grpc_batch,
        grpc_stream,
        uds_unary,
        uds_batch,
        uds_stream,
        shm,
        shm_batch,
        http,
        grpc_infer,
        uds_infer,
        grpc_other,
        uds_other,
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RequestLabels {
    transport: Transport,
    vehicle: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RefusalLabels {
    transport: Transport,
    reason: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct VehicleLabels {
    vehicle: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct UpLabels {
    transport: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct FileLabels {
    file: String,
}

const RELOAD_OUTCOMES: [&str; 2] = ["accepted", "refused"];

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct ReloadLabels {
    outcome: &'static str,
}

/// Latencies of one transport and vehicle.
#[derive(Debug)]
pub struct Recorder {
    latencies: Exchange,
    buckets: Buckets,
    out_of_domain: Counter,
}

impl Recorder {
    fn new(buckets: Buckets, out_of_domain: Counter) -> Self {
        Self { latencies: Exchange::new(), buckets, out_of_domain }
    }

    /// Records one answered request: the time from its arrival to its answer, and how many of its states were outside
    /// the training domain.
    pub fn record(&self, elapsed: Duration, out_of_domain: u64) {
        self.latencies.record(u64::try_from(elapsed.as_nanos()).unwrap_or(u64::MAX), 1);
        self.buckets.observe(elapsed.as_secs_f64());
        if out_of_domain > 0 {
            self.out_of_domain.inc_by(out_of_domain);
        }
    }

    /// Takes out what has come since the last call: times [ns] with how many there were of each, and states outside the
    /// training domain. For a process that reports to another, which alone looks at latencies.
    pub fn drain(&self) -> (Vec<(u64, u64)>, u64) {
        self.latencies.drain(|| self.out_of_domain.get())
    }

    /// Records what another process has [drained](Self::drain).
    pub fn record_all(&self, times: &[(u64, u64)], out_of_domain: u64) {
        for &(ns, count) in times {
            self.latencies.record(ns, count);
            let seconds = Duration::from_nanos(ns).as_secs_f64();
            (0..count).for_each(|_| self.buckets.observe(seconds));
        }
        self.out_of_domain.inc_by(out_of_domain);
    }
}

/// The percentiles that are reported, of latencies in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Percentiles {
    /// Number of requests.
    pub count: u64,
    /// Median [us].
    pub p50_us: f64,
    /// [us]
    pub p95_us: f64,
    /// [us]
    pub p99_us: f64,
    /// [us]
    pub p99_9_us: f64,
    /// [us]
    pub max_us: f64,
}

impl Percentiles {
    /// Reads them off a histogram of nanoseconds.
    pub fn of(histogram: &Histogram<u64>) -> Self {
        let at = |quantile| histogram.value_at_quantile(quantile) as f64 * 1e-3;
        Self {
            count: histogram.len(),
            p50_us: at(0.5),
            p95_us: at(0.95),
            p99_us: at(0.99),
            p99_9_us: at(0.999),
            max_us: histogram.max() as f64 * 1e-3,
        }
    }
}

/// One row of [`Metrics::latencies`].
#[derive(Debug, Clone)]
pub struct Latency {
    /// The transport.
    pub transport: Transport,
    /// The vehicle.
    pub vehicle: String,
    /// Since the server started.
    pub since_start: Percentiles,
    /// Over the last full window.
    pub window: Percentiles,
}

/// Everything that is counted.
#[derive(Debug)]
pub struct Metrics {
    registry: Registry,
    recorders: [RwLock<BTreeMap<String, Arc<Recorder>>>; Transport::ALL.len()],
    latency: Family<RequestLabels, Buckets, fn() -> Buckets>,
    out_of_domain: Family<RequestLabels, Counter>,
    refusals: Family<RefusalLabels, Counter>,
    bundle_version: Family<VehicleLabels, Gauge>,
    reloads: Family<ReloadLabels, Counter>,
    transport_up: Family<UpLabels, Gauge>,
    certificate_end: Family<FileLabels, Gauge>,
    shm_restarts: Counter,
    holding: held::HeldMetrics,
}

impl Default for Metrics {
    fn default() -> Self {
        Self::new()
    }
}

impl Metrics {
    /// Registers every metric.
    pub fn new() -> Self {
        let latency: Family<_, _, fn() -> Buckets> = Family::new_with_constructor(|| Buckets::new(BUCKETS_S));
        let (out_of_domain, refusals) = (Family::default(), Family::default());
        let (bundle_version, reloads) = (Family::default(), Family::default());
        for outcome in RELOAD_OUTCOMES {
            // there from the start, so that a rate sees the first one
            let _ = Family::<_, Counter>::get_or_create(&reloads, &ReloadLabels { outcome });
        }
        let mut registry = Registry::with_prefix("wade");
        registry.register_with_unit(
            "request_duration",
            "Time from a request's arrival to its answer",
            Unit::Seconds,
            latency.clone(),
        );
        registry.register(
            "out_of_domain",
            "States answered outside the training domain",
            Family::clone(&out_of_domain),
        );
        registry.register("refusals", "Requests that were not answered", Family::clone(&refusals));
        registry.register(
            "bundle_version",
            "Version of the bundle being served",
            Family::clone(&bundle_version),
        );
        registry.register("reloads", "Bundles read from disk while serving", Family::clone(&reloads));
        let shm_restarts = Counter::default();
        registry.register(
            "shared_memory_restarts",
            "Processes of shared memory that ended while they should serve",
            shm_restarts.clone(),
        );
        let transport_up = Family::default();
        registry.register(
            "transport_up",
            "1 where the transport answers the server's own question, else 0",
            Family::clone(&transport_up),
        );
        // without TLS there is none, and so no line
        let certificate_end = Family::default();
        registry.register_with_unit(
            "certificate_end",
            "When the certificate of the server expires, since 1970",
            Unit::Seconds,
            Family::clone(&certificate_end),
        );
        let holding = held::HeldMetrics::register(&mut registry);
        Self {
            registry,
            holding,
            recorders: Default::default(),
            latency,
            out_of_domain,
            refusals,
            bundle_version,
            reloads,
            transport_up,
            certificate_end,
            shm_restarts,
        }
    }

    /// Where to record a transport's requests for a vehicle.
    pub fn recorder(&self, transport: Transport, vehicle: &str) -> Arc<Recorder> {
        let recorders = &self.recorders[transport as usize];
        let known = recorders.read().unwrap_or_else(PoisonError::into_inner);
        if let Some(recorder) = known.get(vehicle) {
            return Arc::clone(recorder);
        }
        drop(known);
        let labels = RequestLabels { transport, vehicle: vehicle.to_owned() };
        let buckets = self.latency.get_or_create(&labels).clone();
        let out_of_domain = self.out_of_domain.get_or_create(&labels).clone();
        let mut recorders = recorders.write().unwrap_or_else(PoisonError::into_inner);
        let recorder = recorders
            .entry(labels.vehicle)
            .or_insert_with(|| Arc::new(Recorder::new(buckets, out_of_domain)));
        Arc::clone(recorder)
    }

    /// The recorders of a transport by vehicle.
    pub fn recorders(&self, transport: Transport) -> BTreeMap<String, Arc<Recorder>> {
        self.recorders[transport as usize].read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// How many requests were not answered.
    pub fn refused(&self, transport: Transport, reason: &'static str) -> u64 {
        self.refusals.get_or_create(&RefusalLabels { transport, reason }).get()
    }

    /// Counts a process of shared memory that ended while it should serve.
    pub fn count_shm_restart(&self) {
        self.shm_restarts.inc();
    }

    /// Counts a request that was not answered.
    pub fn refuse(&self, transport: Transport, reason: &'static str) {
        self.refusals.get_or_create(&RefusalLabels { transport, reason }).inc();
    }

    /// States which version of a vehicle is served.
    pub fn set_bundle_version(&self, vehicle: &str, version: u32) {
        let labels = VehicleLabels { vehicle: vehicle.to_owned() };
        self.bundle_version.get_or_create(&labels).set(i64::from(version));
    }

    /// Forgets the version of a vehicle that is not served any more.
    pub fn forget_bundle_version(&self, vehicle: &str) {
        self.bundle_version.remove(&VehicleLabels { vehicle: vehicle.to_owned() });
    }

    /// Counts a bundle that was read while serving.
    pub fn count_reload(&self, accepted: bool) {
        let outcome = RELOAD_OUTCOMES[usize::from(!accepted)];
        self.reloads.get_or_create(&ReloadLabels { outcome }).inc();
    }

    /// States whether a transport answers.
    pub fn set_transport_up(&self, transport: &'static str, up: bool) {
        self.transport_up.get_or_create(&UpLabels { transport }).set(i64::from(up));
    }

    /// States when the server's certificate expires, since 1970.
    pub fn set_certificate_end(&self, file: &Path, since_1970: Duration) {
        let file = FileLabels { file: file.display().to_string() };
        self.certificate_end
            .get_or_create(&file)
            .set(i64::try_from(since_1970.as_secs()).unwrap_or(i64::MAX));
    }

    /// Begins a new window; to be called at a steady period by somebody who owns a clock.
    pub fn rotate(&self) {
        for recorders in &self.recorders {
            for recorder in recorders.read().unwrap_or_else(PoisonError::into_inner).values() {
                recorder.latencies.rotate();
            }
        }
    }

    /// Percentiles of every transport and vehicle that was asked.
    pub fn latencies(&self) -> Vec<Latency> {
        let rows = Transport::ALL.into_iter().zip(&self.recorders).flat_map(|(transport, recorders)| {
            // not looked up under the lock: a new vehicle's first query would wait for it, and the others for that one
            let recorders = recorders.read().unwrap_or_else(PoisonError::into_inner).clone();
            recorders.into_iter().map(move |(vehicle, recorder)| {
                let accounts = recorder.latencies.collect();
                let (since_start, window) = (&accounts.since_start, &accounts.last_window);
                let (since_start, window) = (Percentiles::of(since_start), Percentiles::of(window));
                Latency { transport, vehicle, since_start, window }
            })
        });
        rows.collect()
    }

    /// How many requests for a vehicle were answered over these transports since the start, and the sum of their times [ns].
    pub fn totals(&self, transports: &[Transport], vehicle: &str) -> (u64, u64) {
        let mut totals = (0, 0);
        for &transport in transports {
            let recorders = self.recorders[transport as usize].read().unwrap_or_else(PoisonError::into_inner);
            let Some(recorder) = recorders.get(vehicle).cloned() else { continue };
            drop(recorders);
            let accounts = recorder.latencies.collect();
            let count = accounts.since_start.len();
            totals.0 += count;
            totals.1 += (accounts.since_start.mean() * count as f64) as u64;
        }
        totals
    }

    /// The text that everything scrapes (Prometheus text format 0.0.4).
    pub fn render_plain(&self) -> String {
        plain(&self.render())
    }

    /// The text that Prometheus scrapes (OpenMetrics 1.0).
    pub fn render(&self) -> String {
        let mut text = String::new();
        // writing to a String cannot fail
        let _ = text::encode(&mut text, &self.registry);
        text
    }
}

/// OpenMetrics in the text format that was before it (0.0.4): counters have their suffix in the descriptions too, and there
/// are neither units nor an end.
fn plain(open: &str) -> String {
    let mut plain = String::with_capacity(open.len());
    let mut counters = std::collections::BTreeSet::new();
    for line in open.lines() {
        if let Some(name) = line.strip_prefix("# TYPE ").and_then(|rest| rest.strip_suffix(" counter")) {
            counters.insert(name);
        }
    }
    for line in open.lines().filter(|line| *line != "# EOF" && !line.starts_with("# UNIT ")) {
        let mut words = line.splitn(4, ' ');
        let described = match (words.next(), words.next(), words.next()) {
            (Some("#"), Some(_), Some(name)) if counters.contains(name) => Some(name),
            _ => None,
        };
        match described {
            Some(name) => plain.push_str(&line.replacen(name, &format!("{name}_total"), 1)),
            None => plain.push_str(line),
        }
        plain.push('\n');
    }
    plain
}

/// A histogram is sound even if a thread panicked while it held the lock: the worst is one lost value.
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_shows_what_came_before_the_last_rotation_and_the_start_shows_everything() {
        let metrics = Metrics::new();
        let recorder = metrics.recorder(Transport::shm, "husky");
        recorder.record(Duration::from_micros(10), 0);
        metrics.rotate();
        recorder.record(Duration::from_micros(20), 1);
        recorder.record(Duration::from_micros(20), 0);
        let latencies = metrics.latencies();
        assert_eq!(latencies.len(), 1);
        assert_eq!((latencies[0].since_start.count, latencies[0].window.count), (3, 1));
        assert!((latencies[0].window.max_us - 10.0).abs() < 0.02);
        metrics.rotate();
        assert_eq!(metrics.latencies()[0].window.count, 2);
    }

    #[test]
    fn the_scrape_names_units_and_labels() {
        let metrics = Metrics::new();
        metrics.recorder(Transport::grpc_unary, "husky").record(Duration::from_micros(9), 1);
        metrics.refuse(Transport::grpc_unary, "invalid_argument");
        let text = metrics.render();
        let bucket =
            r#"wade_request_duration_seconds_bucket{le="0.00001",transport="grpc_unary",vehicle="husky"} 1"#;
        assert!(text.contains(bucket), "{text}");
        assert!(text.contains(r#"wade_refusals_total{transport="grpc_unary",reason="invalid_argument"} 1"#));
    }
}
