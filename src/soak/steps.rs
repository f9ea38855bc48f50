//! Several rates one after the other: the highest that the server holds.

use std::path::Path;

use serde::Serialize;

use super::plot::time;
use super::record::Percentiles;
use super::report::{Figures, Report, WriteError};
use wade_learn::files::write_whole;
use wade_learn::page::plot::{Series, curves};
use wade_learn::page::{document, table};

/// Share of the rate that was asked for which must be answered.
const LEAST_ANSWERED: f64 = 0.99;

/// Where no objective is stated, the p95 of the response time may be this many times that of the lowest rate: queues make it
/// rise steeply beyond the knee. The p99 would show the machine's own hiccups first.
const MOST_GROWTH: f64 = 3.0;

/// What became of every rate; serialises to `steps.json`.
#[derive(Debug, Serialize)]
pub struct Steps {
    /// The highest rate that was held with all below it [Hz]; none where the lowest was not held.
    pub knee_hz: Option<f64>,
    /// From the lowest rate on.
    pub steps: Vec<Step>,
}

/// One rate.
#[derive(Debug, Clone, Serialize)]
pub struct Step {
    /// The rate that was asked for, or answered where requests followed each other [Hz].
    pub target_rate_hz: f64,
    /// Answered requests a second [Hz].
    pub rate_hz: f64,
    /// From the intended start to the answer.
    pub response_time_us: Percentiles,
    /// How late a thread of this machine woke that only sleeps.
    pub control_us: Percentiles,
    /// Requests refused, lost or never sent.
    pub failed: u64,
    /// True where the rate was held.
    pub holds: bool,
    /// Why it was not, in plain sentences.
    pub reasons: Vec<String>,
}

impl Steps {
    /// Judges the runs of one soak.
    pub fn new(reports: &[Report]) -> Self {
        let mut reports: Vec<&Report> = reports.iter().collect();
        let target = |report: &Report| report.target_rate_hz.unwrap_or(report.rate_hz);
        reports.sort_by(|a, b| target(a).total_cmp(&target(b)));
        let lowest = reports.first().map_or(f64::INFINITY, |report| report.response_time_us.p95);
        let steps: Vec<Step> =
            reports.iter().map(|report| Step::new(report, target(report), lowest)).collect();
        let held = steps.iter().take_while(|step| step.holds);
        Self { knee_hz: held.last().map(|step| step.target_rate_hz), steps }
    }

    /// The answer in a sentence.
    pub fn sentence(&self) -> String {
        match (self.knee_hz, self.steps.last()) {
            (None, _) => "The server holds none of these rates.".into(),
            (Some(knee), Some(last)) if last.target_rate_hz <= knee => {
                format!("The server holds {knee:.0} requests a second, the highest rate tried.")
            }
            (Some(knee), _) => {
                format!("The server holds {knee:.0} requests a second and not the next rate tried.")
            }
        }
    }

    fn page(&self) -> Result<String, WriteError> {
        let heads = [
            "requested [Hz]",
            "answered [Hz]",
            "p50",
            "p95",
            "p99",
            "p99.9",
            "max",
            "failed",
            "objectives met",
        ];
        let row = |step: &Step| {
            let Percentiles { p50, p95, p99, p99_9, max } = step.response_time_us;
            let mut cells = vec![format!("{:.0}", step.target_rate_hz), format!("{:.0}", step.rate_hz)];
            cells.extend([p50, p95, p99, p99_9, max].map(time));
            cells.extend([step.failed.to_string(), if step.holds { "yes" } else { "no" }.to_owned()]);
            cells
        };
        let line = |name: &str, value: fn(&Percentiles) -> f64| Series {
            name: name.to_owned(),
            points: self
                .steps
                .iter()
                .map(|step| (step.target_rate_hz, value(&step.response_time_us)))
                .collect(),
        };
        let lines = [line("p50", |p| p.p50), line("p95", |p| p.p95), line("p99", |p| p.p99)];
        let figure = curves("requested rate [Hz]", "response time [us]", &lines)?;
        let reasons = self.steps.iter().flat_map(|step| {
            let at = step.target_rate_hz;
            step.reasons
                .iter()
                .map(move |reason| format!("<li>{at:.0} Hz: {}</li>", wade_learn::page::escape(reason)))
        });
        let body = format!(
            "<div class=\"verdict\"><b>{}</b><ul>{}</ul></div>{}{figure}",
            self.sentence(),
            reasons.collect::<String>(),
            table(&heads, heads.len(), self.steps.iter().map(row)),
        );
        Ok(document("wade soak: rates", &body))
    }
}

impl Step {
    fn new(report: &Report, target: f64, lowest_p95: f64) -> Self {
        let mut reasons = report.failures.clone();
        if report.rate_hz < LEAST_ANSWERED * target {
            reasons.push(format!("Only {:.0} requests a second were answered.", report.rate_hz));
        }
        let judged = report.slo.values().any(|outcome| matches!(outcome.figures, Figures::Time { .. }));
        let p95 = report.response_time_us.p95;
        if !judged && p95 > MOST_GROWTH * lowest_p95 {
            reasons.push(format!(
                "p95 of the response time is {}, more than {MOST_GROWTH} times that of the lowest rate ({}).",
                time(p95),
                time(lowest_p95)
            ));
        }
        Self {
            target_rate_hz: target,
            rate_hz: report.rate_hz,
            response_time_us: report.response_time_us,
            control_us: report.control_us,
            failed: report.errors + report.lost + report.unsent,
            holds: reasons.is_empty(),
            reasons,
        }
    }
}

/// Makes the folder. A report that is there is kept, unless it may be replaced.
pub fn prepare(dir: &Path, replace: bool) -> Result<(), WriteError> {
    if !replace && dir.join("steps.json").exists() {
        return Err(WriteError::Exists { path: dir.to_owned() });
    }
    std::fs::create_dir_all(dir).map_err(|source| WriteError::Io { path: dir.to_owned(), source })
}

/// Writes `steps.json` and `steps.html`.
pub fn write(dir: &Path, steps: &Steps) -> Result<(), WriteError> {
    let mut json = serde_json::to_vec_pretty(steps)?;
    json.push(b'\n');
    for (name, bytes) in [("steps.json", json), ("steps.html", steps.page()?.into_bytes())] {
        let path = dir.join(name);
        write_whole(&path, &bytes).map_err(|source| WriteError::Io { path, source })?;
    }
    Ok(())
}
