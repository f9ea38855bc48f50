//! What was found, as JSON with stable names.

use std::collections::BTreeMap;

use serde::Serialize;

use super::detect::{Excitation, GapSize};
use super::explanations::Explanation;
use super::fit::Parameter;
use super::holdout::{Closure, Worse};
use super::judge::Refusal;
use super::locate::Region;
use super::noise::Floor;
use wade_core::effects::{Effect, EffectRegion, Kind, Shape};

/// The answer in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// No structure beyond the noise.
    NothingMissing,
    /// One set of effects explains the gap, and no other does.
    Named,
    /// Several sets explain it equally well with these trials.
    Ambiguous,
    /// There is structure, and nothing of the library explains it.
    NoCandidateFits,
}

/// An effect that was named.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedEffect {
    /// Name in the library.
    pub name: &'static str,
    /// Water, measuring chain, or drive.
    pub kind: Kind,
    /// By name.
    pub parameters: BTreeMap<&'static str, Parameter>,
    /// Share of the gap above the floor that goes when it is added to the others.
    pub share_of_gap: f64,
    /// Seen in one condition only.
    pub provisional: bool,
    /// Where it acts; nothing of one that acts everywhere.
    pub region: EffectRegion,
    /// Surfaces that carry it, with their shares of its load.
    pub surfaces: BTreeMap<String, f64>,
    /// Covariance of the coefficients in the order of `coefficients`.
    pub covariance: Vec<Vec<f64>>,
    /// Covariance with the coefficients of the effects after it, by name: a row each own coefficient.
    pub covariance_with: BTreeMap<&'static str, Vec<Vec<f64>>>,
    /// Names of the coefficients.
    pub coefficients: Vec<&'static str>,
    /// Which effect.
    #[serde(skip)]
    pub effect: Effect,
    /// The form of its law with the nonlinear parameters; three numbers in a file.
    pub shape: Shape,
    /// Drag of the model itself as coefficients along x, y, z, with which some effects scale.
    pub base_drag: [f64; 3],
}

/// An effect that the trials could not have shown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NotTestable {
    /// Name in the library.
    pub name: &'static str,
    /// Why.
    pub why: String,
    /// The smallest coefficient that would have shown, where one can be told.
    pub minimum_detectable: BTreeMap<&'static str, super::detect::Detectable>,
}

/// What an effect that was not named would have explained.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rejected {
    /// Name in the library.
    pub name: &'static str,
    /// The first gate that it did not pass beside the named effects.
    pub why: Option<Refusal>,
    /// Share of the gap above the floor that it would take off beside the named effects.
    pub share_of_gap: f64,
    /// What its best form takes off alone, with all of its columns.
    pub share_alone: f64,
}

/// The gap as a whole.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GapReport {
    /// On the trials that took no part in naming and fitting.
    pub held_out: BTreeMap<&'static str, Closure>,
    /// On all trials.
    pub size: BTreeMap<&'static str, GapSize>,
    /// Shares of the squared gap: noise, explained, unexplained.
    pub shares: BTreeMap<&'static str, f64>,
    /// Floors by component.
    pub floors: BTreeMap<&'static str, Floor>,
    /// Places that the named effects make worse by more than a twentieth.
    pub worse_regions: Vec<Worse>,
    /// Trials kept back.
    pub held_out_trials: Vec<String>,
    /// What is left in words, where structure is left.
    pub unexplained: Option<String>,
}

/// Hashes of what the report rests on.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Sources {
    /// Of the numbers in the trials.
    pub trials: String,
    /// Of the bundle or simulator.
    pub model: String,
    /// Version and commit of the program.
    pub tool: String,
}

/// A trace of the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trace {
    /// Trial.
    pub trial: String,
    /// Component.
    pub component: &'static str,
    /// Took no part in naming and fitting.
    pub is_held: bool,
    /// The trial whose gap is the median, not one of the largest.
    pub is_typical: bool,
    /// Time [s].
    pub t: Vec<f64>,
    /// What was measured or inferred [N, N m]; less `before` it is the prediction, less `after` that with the named effects.
    pub measured: Vec<f64>,
    /// Gap without the named effects.
    pub before: Vec<f64>,
    /// Gap with them.
    pub after: Vec<f64>,
    /// One standard deviation of the noise of a point.
    pub noise: f64,
}

/// How the gap goes with a quantity of the state: means over equal numbers of bins of all trials.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trend {
    /// Component of the gap.
    pub component: &'static str,
    /// The quantity in words.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its value.
    pub at: Vec<f64>,
    /// Gap without the named effects [N, N m].
    pub before: Vec<f64>,
    /// Gap with them [N, N m].
    pub after: Vec<f64>,
}

/// What the workflow found; serializes to `report.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The answer in a word.
    pub verdict: Verdict,
    /// The answer in a sentence.
    pub summary: String,
    /// Vehicle.
    pub vehicle: String,
    /// How the data was generated, where it was not measured.
    pub generated: Option<String>,
    /// Named effects.
    pub effects: Vec<NamedEffect>,
    /// Sets of names that explain as much.
    pub alternatives: Vec<Vec<&'static str>>,
    /// Explanations of the gap with their probabilities, the most probable first.
    pub explanations: Vec<Explanation>,
    /// Effects that probably act, though none is named; empty where the verdict names any.
    pub suspected: Vec<&'static str>,
    /// Trial that tells the alternatives apart.
    pub separating_experiment: Option<String>,
    /// What to do where nothing is named.
    pub next_step: Option<String>,
    /// Effects that these trials could not have shown.
    pub not_testable: Vec<NotTestable>,
    /// Effects that were looked for and not named.
    pub rejected: Vec<Rejected>,
    /// Where the gap is.
    pub regions: Vec<Region>,
    /// Splits that were tried to find the regions.
    pub regions_tried: usize,
    /// Before and after.
    pub gap: GapReport,
    /// What the trials excite.
    pub excitation: Vec<Excitation>,
    /// Ranges of the state in which the effects were seen: least and largest.
    pub validity: BTreeMap<&'static str, [f64; 2]>,
    /// Trials used.
    pub trials: usize,
    /// Samples used.
    pub samples: usize,
    /// Length of the bins over which samples were averaged [s].
    pub bin_s: f64,
    /// What one should know.
    pub remarks: Vec<String>,
    /// Hashes.
    pub sources: Sources,
    /// The trials with the largest gap, and typical ones.
    pub traces: Vec<Trace>,
    /// How the gap goes with the state.
    pub trends: Vec<Trend>,
}
