//! The gap workflow: where a model and measured trials disagree, which known effect explains it, whether anything else could,
//! and how much smaller the gap is with it on held-out trials.
//!
//! No IO and no clock: trials and a prediction in, a report out, the same for one seed whatever the order of the trials.
//!
//! Reading order: `config`, `sampling`, `measurement`, `rates` and `series` (trials to samples with a gap), `plausible` and `contradictions`
//! (what cannot be), `noise` (the floor), `candidates` (the library as columns), `base_drag`, `split` (held-out trials, and folds),
//! `design` (the regression), `robust` (errors that hold), `judge` (the gates), `select` and `rivals` (which effects), `shared`
//! (noise of the motion in both), `nonlinear`, `general` and `lasting` (structure without a name), `features`, `gated`, `locate`
//! and `carriers` (where), `verdict`, `explanations` (how probable each is), `fit`, `holdout`, `detect` (what would have shown),
//! `experiment`, `report`, `compose`, `sentences`, `page` and `effects_file`; `run` calls them.

#![allow(
    clippy::too_many_arguments,
    reason = "moved as it was: the rebuild of the workflow gives these their types"
)]

mod base_drag;
mod calibrate;
mod candidates;
mod carriers;
mod color;
mod compose;
mod config;
mod contradictions;
mod design;
mod detect;
mod effects_file;
mod elsewhere;
mod error;
mod experiment;
mod explanations;
mod features;
mod fit;
mod gated;
mod general;
mod holdout;
mod judge;
mod lasting;
mod locate;
mod measurement;
mod model_error;
mod noise;
mod nonlinear;
mod page;
mod plausible;
mod rates;
mod report;
mod rivals;
mod robust;
mod run;
mod sampling;
mod select;
mod sentences;
mod series;
mod shared;
mod smoothing;
mod split;
mod statistics;
mod traces;
mod verdict;

pub use carriers::in_shares;
pub use config::Config;
pub use detect::{Detectable, Excitation, GapSize};
pub use effects_file::{NotApplicable, effects_file};
pub use error::GapError;
pub use explanations::{Explanation, NOTHING, OUTSIDE_LIBRARY};
pub use fit::Parameter;
pub use holdout::{Closure, Worse};
pub use judge::Refusal;
pub use locate::{Condition as RegionCondition, Region};
pub use noise::{Floor, FloorSource};
pub use report::{GapReport, NamedEffect, NotTestable, Rejected, Report, Sources, Trace, Verdict};
pub use run::{body_of, run};

use wade_core::condition::Condition;
use wade_core::effects::{Effect, EffectRegion, Shape};
use wade_core::vehicle::PerWheel;
use wade_core::wrench::Wrench;

/// A sample of a trial, as a model is asked about it.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// State.
    pub condition: &'a Condition,
    /// Wheel speeds [rad/s], where all were recorded.
    pub wheel_speeds: Option<PerWheel<f64>>,
    /// Time since the sample before [s]; 0 where a run begins.
    pub time_step: f64,
}

/// A model's answer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Predicted {
    /// Net wrench about the center of mass [N, N m].
    pub wrench: Wrench,
    /// Its standard deviation [N, N m].
    pub uncertainty: [f64; 6],
    /// True where the state is none of those that it learnt.
    pub outside: bool,
}

/// An effect with its numbers.
#[derive(Debug, Clone)]
struct Named {
    effect: Effect,
    shape: Shape,
    /// Where it acts.
    region: EffectRegion,
    /// Coefficient and value.
    coefficients: Vec<(usize, f64)>,
}
