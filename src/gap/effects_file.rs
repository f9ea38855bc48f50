//! The physical effects of a report as the text of `effects.toml`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::report::{NamedEffect, Report, Verdict};
use crate::effects::Kind;

/// Version of the file's format.
const FORMAT: u32 = 1;

#[derive(Serialize)]
struct File<'a> {
    format: u32,
    vehicle: &'a str,
    verdict: Verdict,
    sources: Source<'a>,
    /// Ranges of the trials, outside which an effect is clamped and flagged.
    validity: &'a BTreeMap<&'static str, [f64; 2]>,
    effect: Vec<Entry<'a>>,
}

#[derive(Serialize)]
struct Source<'a> {
    trials_sha256: &'a str,
    model_sha256: &'a str,
    tool: &'a str,
    trials: usize,
    samples: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    generated: Option<&'a str>,
}

#[derive(Serialize)]
struct Entry<'a> {
    name: &'a str,
    provisional: bool,
    share_of_gap: f64,
    /// Nonlinear parameters in the order of the effect's file.
    shape: [f64; 3],
    /// Names of the coefficients, in the order of the covariance.
    coefficients: &'a [&'static str],
    values: Vec<f64>,
    standard_errors: Vec<f64>,
    units: Vec<&'static str>,
    covariance: &'a [Vec<f64>],
    /// Drag of the model that the effect scales with, along x, y, z.
    base_drag: [f64; 3],
}

impl Report {
    /// True where there is something to add to a model: physics, named without a rival.
    pub fn is_applicable(&self) -> bool {
        self.verdict == Verdict::Named && self.effects.iter().any(|effect| effect.kind == Kind::Physics)
    }
}

/// `effects.toml` with the physical effects of a report: coefficients, units, standard errors, covariance, the ranges in
/// which they were seen, and the hashes of what they rest on. Faults of sensors and drive are never in it.
pub fn effects_toml(report: &Report) -> String {
    let physical = report.effects.iter().filter(|effect| effect.kind == Kind::Physics);
    let sources = Source {
        trials_sha256: &report.sources.trials,
        model_sha256: &report.sources.model,
        tool: &report.sources.tool,
        trials: report.trials,
        samples: report.samples,
        generated: report.generated.as_deref(),
    };
    let file = File {
        format: FORMAT,
        vehicle: &report.vehicle,
        verdict: report.verdict,
        sources,
        validity: &report.validity,
        effect: physical.map(|effect| entry(effect, report.base_drag)).collect(),
    };
    toml::to_string(&file).expect("plain numbers, strings and tables are always TOML")
}

fn entry(effect: &NamedEffect, base_drag: [f64; 3]) -> Entry<'_> {
    let parameters = || effect.coefficients.iter().filter_map(|name| effect.parameters.get(name));
    Entry {
        name: effect.name,
        provisional: effect.provisional,
        share_of_gap: effect.share_of_gap,
        shape: effect.shape,
        coefficients: &effect.coefficients,
        values: parameters().map(|p| p.value).collect(),
        standard_errors: parameters().map(|p| p.std).collect(),
        units: parameters().map(|p| p.unit).collect(),
        covariance: &effect.covariance,
        base_drag,
    }
}
