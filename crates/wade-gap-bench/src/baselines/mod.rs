//! What plain regression names: the textbook term of each effect beside a generic dictionary of state functions.
//!
//! `columns` holds the terms, `regression` the normal equations. None of these knows of instruments, blocks in time or
//! terms that mimic each other: they are what a tool has to beat.

mod columns;
mod regression;

use std::collections::BTreeMap;

use serde_json::json;

use super::answer::Answer;
use super::{Simulator, ToolError};
use columns::TERMS;
use regression::{Normal, Selection};
use wade_learn::trials::Trials;

wade_core::named_enum! {
    /// A way to select terms.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Method {
        /// Sequentially thresholded least squares (Brunton, Proctor, Kutz, PNAS 2016), its threshold by cross-validation.
        ThresholdedSparse => "thresholded sparse",
        /// LASSO by coordinate descent, its penalty by cross-validation and the rule of one standard error.
        Lasso => "LASSO",
        /// Forward and backward by the Bayesian information criterion.
        StepwiseBic => "stepwise BIC",
        /// The one effect that explains most.
        BestR2 => "best R2",
    }
}

impl Method {
    /// The answer to trials of a simulator's body. The last fifth of the trials is held out.
    pub fn answer(self, trials: &Trials, simulator: &Simulator) -> Result<Answer, ToolError> {
        let folds = columns::folds(trials, simulator);
        let [train @ .., held_out] = folds.as_slice() else {
            return Ok(report(&[], &BTreeMap::new(), None)?);
        };
        let selection = match self {
            Self::ThresholdedSparse => regression::thresholded(train),
            Self::Lasso => regression::lasso(train),
            Self::StepwiseBic => regression::stepwise(train, &columns::groups()),
            Self::BestR2 => regression::best(train, &columns::groups()),
        };
        Ok(report(&selection, &estimates(&selection), closure(&selection, held_out))?)
    }
}

/// Name of a term's effect, parameter, unit and estimate.
type Estimates = BTreeMap<String, serde_json::Map<String, serde_json::Value>>;

fn estimates(selection: &Selection) -> Estimates {
    let mut estimates = Estimates::new();
    for &(term, value, std) in selection {
        let Some(effect) = TERMS[term].effect else { continue };
        let parameter = json!({"value": value, "std": std, "unit": TERMS[term].unit});
        estimates.entry(effect.name()).or_default().insert(TERMS[term].name.to_owned(), parameter);
    }
    estimates
}

/// Share of the held-out gap above one standard deviation of the noise that the selected terms close.
fn closure(selection: &Selection, held_out: &Normal) -> Option<f64> {
    let root = |sum: f64| (sum / held_out.count).sqrt();
    let (before, after) = (root(held_out.yy), root(held_out.residual(selection)));
    (before > 1.0).then(|| (before - after) / (before - 1.0))
}

fn report(
    selection: &[(usize, f64, f64)],
    estimates: &Estimates,
    closure: Option<f64>,
) -> Result<Answer, serde_json::Error> {
    let verdict = match (estimates.is_empty(), selection.is_empty()) {
        (false, _) => "named",
        (true, false) => "no_candidate_fits",
        (true, true) => "nothing_missing",
    };
    let effects: Vec<_> =
        estimates.iter().map(|(name, parameters)| json!({"name": name, "parameters": parameters})).collect();
    let report = json!({
        "verdict": verdict,
        "effects": effects,
        "gap": {"held_out": {"all": {"closure": closure}}},
    });
    Answer::from_report(&report)
}
