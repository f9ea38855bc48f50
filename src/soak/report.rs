//! What a soak found, as JSON and on disk.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
    time::SystemTime,
};

use serde::Serialize;

use super::{
    config::Config,
    hiccup::Hiccups,
    hlog, lateness,
    machine::{Machine, rfc3339},
    page,
    plot::time,
    record::{Counts, Recording, Totals, histogram},
    slo::{Measured, Slo, judge},
};
pub use super::{
    hlog::HlogError,
    record::Percentiles,
    slo::{Figures, Outcome},
};
use wade_learn::files::write_whole;
use wade_learn::page::PlotError;

/// What a soak found; serialises to `soak.json`.
#[derive(Debug, Serialize)]
pub struct Report {
    /// True when `failures` is empty.
    pub passed: bool,
    /// True when the run was stopped before its end; the figures are those of the part until then.
    pub interrupted: bool,
    /// Everything that did not hold, in plain sentences.
    pub failures: Vec<String>,
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the transport.
    pub transport: String,
    /// `constant`, `varying` or `recorded`.
    pub input: &'static str,
    /// States in a request.
    pub batch: usize,
    /// Clients that asked at the same time.
    pub clients: usize,
    /// How a client waited until its next request was due: `spin` or `sleep`.
    pub pace: &'static str,
    /// True when each request waited for the answer before (`--rate max`); response is then service time.
    pub closed_loop: bool,
    /// The rate that was asked for [Hz]; none in a closed loop.
    pub target_rate_hz: Option<f64>,
    /// Answered requests a second [Hz].
    pub rate_hz: f64,
    /// Length of the measured part [s].
    pub duration_s: f64,
    /// Requests sent in the measured part.
    pub sent: u64,
    /// Requests answered.
    pub answered: u64,
    /// Requests refused: answered with an error.
    pub errors: u64,
    /// Requests not answered before the client's deadline.
    pub lost: u64,
    /// Requests that were due but could not be sent before the end, for a server too slow for the rate.
    pub unsent: u64,
    /// What the first refusal said.
    pub first_error: Option<String>,
    /// True when the generator sent late by its own fault; the figures then say nothing about the server.
    pub generator_late: bool,
    /// The generator's own share of the send lag.
    pub generator_lag_us: Percentiles,
    /// The p99 of that share from which on the generator counts as late [us]; none in a closed loop.
    pub generator_lag_limit_us: Option<f64>,
    /// From the intended start to the answer.
    pub response_time_us: Percentiles,
    /// From the actual send to the answer.
    pub service_time_us: Percentiles,
    /// From the intended start to the actual send.
    pub send_lag_us: Percentiles,
    /// How late a thread of this machine woke that only sleeps.
    pub control_us: Percentiles,
    /// The core on which that thread slept; none where it was free to move.
    pub control_core: Option<usize>,
    /// The longest gap between two clock readings in the wait before each request.
    pub generator_stall_us: Percentiles,
    /// The server's own compute time.
    pub server_compute_us: Percentiles,
    /// How each objective came out, by name.
    pub slo: BTreeMap<String, Outcome>,
    /// The load before the measured part, in none of the figures above.
    pub warm_up: WarmUp,
    /// The machine.
    pub machine: Machine,
    /// Commit of the build.
    pub commit: String,
    /// When the schedule started, UTC.
    pub started_at: String,
    #[serde(skip)]
    pub(super) details: Details,
}

/// The load before the measured part.
#[derive(Debug, Serialize)]
pub struct WarmUp {
    /// Its length [s].
    pub duration_s: f64,
    /// Requests sent.
    pub sent: u64,
    /// Requests answered.
    pub answered: u64,
    /// Requests refused.
    pub errors: u64,
    /// Requests lost.
    pub lost: u64,
    /// From the intended start to the answer.
    pub response_time_us: Percentiles,
}

/// What the plots and the log are made from.
#[derive(Debug)]
pub(super) struct Details {
    pub recording: Recording,
    pub hiccups: Hiccups,
    pub control: Counts,
    pub started: SystemTime,
}

impl Report {
    pub(super) fn new(
        config: &Config,
        input: &'static str,
        started: SystemTime,
        recording: Recording,
        hiccups: Hiccups,
    ) -> Self {
        let totals = &recording.measured;
        let reached = recording.reached(config.duration);
        let rate_hz = totals.answered as f64 / reached.as_secs_f64().max(f64::MIN_POSITIVE);
        let failed = totals.errors + totals.lost + recording.unsent;
        let measured = Measured { response: &totals.response, answered: totals.answered, rate_hz, failed };
        let control = control(&recording, &hiccups);
        let mut report = Self {
            passed: false,
            interrupted: recording.stopped.is_some(),
            failures: Vec::new(),
            vehicle: config.vehicle.clone(),
            transport: config.transport.clone(),
            input,
            batch: config.batch.get(),
            clients: config.clients.get(),
            pace: config.pace.name(),
            closed_loop: config.rate.interval_ns().is_none(),
            target_rate_hz: config.rate.interval_ns().map(|interval| 1e9 / interval),
            rate_hz,
            duration_s: recording.stopped.map_or(config.duration, |_| reached).as_secs_f64(),
            sent: totals.sent,
            answered: totals.answered,
            errors: totals.errors,
            lost: totals.lost,
            unsent: recording.unsent,
            first_error: recording.first_error.clone(),
            generator_late: lateness::is_late(config.rate_of_client(), &totals.own_lag),
            generator_lag_us: Percentiles::of(&totals.own_lag),
            generator_lag_limit_us: lateness::limit_us(config.rate_of_client()),
            response_time_us: Percentiles::of(&totals.response),
            service_time_us: Percentiles::of(&totals.service),
            send_lag_us: Percentiles::of(&totals.lag),
            control_us: Percentiles::of(&control),
            control_core: hiccups.core,
            generator_stall_us: Percentiles::of(&totals.stall),
            server_compute_us: Percentiles::of(&totals.server),
            slo: judge(&config.slo, &measured),
            warm_up: WarmUp::new(config, &recording.warm_up),
            machine: Machine::this(),
            commit: config.commit.clone(),
            started_at: rfc3339(started),
            details: Details { recording, hiccups, control, started },
        };
        report.failures = report.failures(config);
        report.passed = report.failures.is_empty();
        report
    }

    fn failures(&self, config: &Config) -> Vec<String> {
        let mut failures = Vec::new();
        if self.interrupted {
            failures.push(format!(
                "Interrupted after {:.1} of {} s: the figures are of the part until then.",
                self.duration_s,
                config.duration.as_secs_f64()
            ));
        }
        let allowed = config.slo.iter().any(Slo::allows_errors);
        if self.answered == 0 {
            failures.push("No request was answered.".to_owned());
        }
        for (count, what) in [
            (self.errors, "were refused by the server"),
            (self.lost, "got no answer in time"),
            (
                self.unsent,
                "were due but could not be sent before the end: the server is too slow for this rate",
            ),
        ] {
            if count > 0 && !allowed {
                failures.push(format!("{count} requests {what}."));
            }
        }
        if let (true, Some(limit)) = (self.generator_late, self.generator_lag_limit_us) {
            failures.push(format!(
                "The load generator itself was late (p99 {}, allowed {}): this machine was too busy to measure, \
                 and the figures say nothing about the server.",
                time(self.generator_lag_us.p99),
                time(limit),
            ));
        }
        for (name, outcome) in self.slo.iter().filter(|(_, outcome)| !outcome.holds) {
            failures.push(sentence(name, outcome));
        }
        failures
    }
}

impl WarmUp {
    fn new(config: &Config, totals: &Totals) -> Self {
        Self {
            duration_s: config.warm_up.as_secs_f64(),
            sent: totals.sent,
            answered: totals.answered,
            errors: totals.errors,
            lost: totals.lost,
            response_time_us: Percentiles::of(&totals.response),
        }
    }
}

/// The control's overshoots in the measured part [ns].
fn control(recording: &Recording, hiccups: &Hiccups) -> Counts {
    let mut control = histogram(recording.measured.response.high());
    let measured = hiccups.overshoots.iter().filter(|overshoot| overshoot.due >= recording.warm_up_ns);
    measured.for_each(|overshoot| control.saturating_record(overshoot.late));
    control
}

/// How an objective came out, in words.
pub(super) fn sentence(name: &str, Outcome { figures, holds }: &Outcome) -> String {
    match *figures {
        Figures::Time { limit_us, measured_us } => {
            let side = if *holds { "within" } else { "over" };
            format!("{name} of the response time is {}, {side} {}.", time(measured_us), time(limit_us))
        }
        Figures::Rate { limit_hz, measured_hz } => {
            let side = if *holds { "at least" } else { "under" };
            format!("{measured_hz:.1} requests a second were answered, {side} {limit_hz}.")
        }
        Figures::Errors { limit, measured } => {
            let side = if *holds { "within" } else { "over" };
            let as_text = |value: f64| match limit {
                limit if limit > 0.0 && limit < 1.0 => format!("{:.3} %", 100.0 * value),
                _ => format!("{value}"),
            };
            format!("Failed requests: {}, {side} {}.", as_text(measured), as_text(limit))
        }
    }
}

/// A file of the report could not be made.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The disk refused.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// Which file or folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// There is a report already.
    #[error("{} holds the report of another run: name another folder with --out, or add --force to replace it", path.display())]
    Exists {
        /// The folder.
        path: PathBuf,
    },
    /// The report is no JSON.
    #[error("cannot write soak.json: {0}")]
    Json(#[from] serde_json::Error),
    /// The interval log could not be encoded.
    #[error("cannot write soak.hlog: {0}")]
    Hlog(#[from] HlogError),
    /// A plot could not be drawn.
    #[error("cannot write soak.html: {0}")]
    Plot(#[from] PlotError),
}

/// Makes the folder and tries whether it can be written. A report that is there is kept, unless it may be replaced.
pub fn prepare(dir: &Path, replace: bool) -> Result<(), WriteError> {
    if !replace && dir.join("soak.json").exists() {
        return Err(WriteError::Exists { path: dir.to_owned() });
    }
    let probe = dir.join(".soak.probe");
    let try_it = || {
        fs::create_dir_all(dir)?;
        fs::write(&probe, [])?;
        fs::remove_file(&probe)
    };
    try_it().map_err(|source| WriteError::Io { path: dir.to_owned(), source })
}

/// Writes `soak.json`, `soak.hlog` and `soak.html` to a folder, which is made where it does not exist. Each file
/// appears whole or not at all.
pub fn write(dir: &Path, report: &Report) -> Result<(), WriteError> {
    let Details { recording, hiccups, started, .. } = &report.details;
    let mut json = serde_json::to_vec_pretty(report)?;
    json.push(b'\n');
    let log = hlog::write(recording, hiccups, *started)?;
    let html = page::page(report)?;
    fs::create_dir_all(dir).map_err(|source| WriteError::Io { path: dir.to_owned(), source })?;
    for (name, bytes) in [("soak.json", json), ("soak.hlog", log), ("soak.html", html.into_bytes())] {
        let path = dir.join(name);
        write_whole(&path, &bytes).map_err(|source| WriteError::Io { path, source })?;
    }
    Ok(())
}
