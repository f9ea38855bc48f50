//! What a validation found, as JSON.

use serde::Serialize;

use super::check::Check;
use super::drag::DragScaling;
use super::page::page;
use super::section::{LeftOut, Section};
use super::vertical::VerticalForce;
use super::{Config, Tests};
use crate::page::PlotError;
use crate::published;
use crate::trials::Trials;
use wade_core::model::Model;

/// What a validation found; serializes to `report.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// True when every check that these trials can judge holds.
    pub passed: bool,
    /// The findings of the checks that do not hold.
    pub failures: Vec<String>,
    /// The findings of the checks that these trials cannot judge.
    pub not_tested: Vec<String>,
    /// What was tested.
    pub subject: Subject,
    /// On what.
    pub data: Data,
    /// Every check.
    pub checks: Vec<Check>,
    /// Test 1.
    pub drag_scaling: DragScaling,
    /// Test 2.
    pub vertical_force: VerticalForce,
    /// How the paper's figures are labelled.
    pub paper_label: &'static str,
    /// One point a trial.
    pub sections: Vec<Section>,
    /// Trials without a planar section.
    pub left_out: Vec<LeftOut>,
    /// Settings and thresholds.
    pub config: Config,
    /// Commit of the build.
    pub commit: String,
}

/// What was tested.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Subject {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Version of its bundle.
    pub version: u32,
    /// Where its weights come from.
    pub weights: String,
}

impl Subject {
    /// A model of a bundle.
    pub fn new(model: &Model) -> Self {
        Self {
            vehicle: model.vehicle().name.clone(),
            version: model.version(),
            weights: model.provenance().to_owned(),
        }
    }
}

/// Where the motion comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// A folder of trials.
    Trials,
    /// Motion-capture recordings.
    Mocap,
    /// Recordings that were generated just now.
    Generated,
}

/// The motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Data {
    /// Where it comes from.
    pub source: Source,
    /// How it was generated; none where it was measured.
    pub generated: Option<String>,
    /// Number of trials.
    pub trials: usize,
    /// Trials with a planar section.
    pub planar_sections: usize,
    /// Share of the samples of the sections within the ranges that the weights were learnt in: outside them the verdict
    /// is about an extrapolation.
    pub in_domain: f64,
    /// What one should know about the files.
    pub remarks: Vec<String>,
}

/// What a report is about.
#[derive(Debug, Clone)]
pub struct About<'a> {
    /// Where the motion comes from.
    pub source: Source,
    /// The model under test.
    pub subject: Subject,
    /// The settings.
    pub config: &'a Config,
    /// Commit of the program.
    pub commit: &'a str,
}

impl Report {
    /// The verdict over both tests.
    pub fn new(tests: Tests, trials: &Trials, about: About<'_>) -> Self {
        let About { source, subject, config, commit } = about;
        let findings = |holds: Option<bool>| {
            let checks = tests.checks.iter().filter(|check| check.holds == holds);
            checks.map(|check| check.finding.clone()).collect::<Vec<_>>()
        };
        let failures = findings(Some(false));
        let samples = tests.sections.iter().map(|section| section.samples as f64).sum::<f64>();
        let inside =
            tests.sections.iter().map(|section| section.in_domain * section.samples as f64).sum::<f64>();
        Self {
            passed: failures.is_empty(),
            failures,
            not_tested: findings(None),
            subject,
            data: Data {
                source,
                generated: trials.manifest.generated.clone(),
                trials: trials.trials.len(),
                planar_sections: tests.sections.len(),
                in_domain: inside / samples,
                remarks: trials.remarks().iter().map(ToString::to_string).collect(),
            },
            checks: tests.checks,
            drag_scaling: tests.drag_scaling,
            vertical_force: tests.vertical_force,
            paper_label: published::LABEL,
            sections: tests.sections,
            left_out: tests.left_out,
            config: config.clone(),
            commit: commit.to_owned(),
        }
    }

    /// The page for people.
    pub fn page(&self) -> Result<String, PlotError> {
        page(self)
    }
}
