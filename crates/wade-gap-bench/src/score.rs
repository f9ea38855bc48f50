//! Answers against what is true, a row a measure, each with a 90 % interval.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::answer::{Answer, Verdict};
use super::case::{Case, Family};
use super::generate::{Generated, inside};
use super::hidden::Parameter;
use super::{NoiseKind, Region};
use wade_learn::random::Random;
use wade_learn::signal;

/// Two-sided 90 % of a normal distribution.
const Z90: f64 = 1.645;
/// Resamples of a bootstrap.
const RESAMPLES: usize = 1000;

/// A parameter that was planted and estimated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// Effect and parameter.
    pub name: String,
    /// As planted.
    pub planted: f64,
    /// As estimated.
    pub estimated: f64,
    /// Its 90 % interval as stated; of a tool that states a standard error alone, that of a normal variable.
    pub interval: Option<[f64; 2]>,
    /// True of the one of an effect that was planted largest.
    pub is_largest: bool,
}

impl Compared {
    pub(super) fn is_covered(&self) -> Option<bool> {
        self.interval.map(|[low, high]| (low..=high).contains(&self.planted))
    }
}

/// One case as it was answered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    /// Name of the case.
    pub case: String,
    /// Its sort.
    pub family: Family,
    /// Strength of each hidden effect, in floors, as asked for.
    pub strength: f64,
    /// Strength of each as planted.
    pub strengths: Vec<f64>,
    /// Noise of the wrench.
    pub noise: NoiseKind,
    /// What was hidden.
    pub hidden: BTreeSet<String>,
    /// Parameters of each as planted, by effect.
    pub planted: BTreeMap<String, Vec<Parameter>>,
    /// True where the trials cannot tell the hidden effect from another, so that both may be held possible.
    pub has_twin: bool,
    /// True where further trials resolve a pair.
    pub resolved: bool,
    /// Why there is no answer.
    pub error: Option<String>,
    /// The verdict.
    pub verdict: Option<Verdict>,
    /// What was named.
    pub named: BTreeSet<String>,
    /// What was held possible.
    pub possible: BTreeSet<String>,
    /// Planted parameters that were estimated, of effects that were rightly named. Each tells of its interval; error and
    /// sign go by the largest of an effect, since those of one that is next to nothing say nothing.
    pub parameters: Vec<Compared>,
    /// Effects rightly named of whose parameters none has a known name.
    pub not_compared: Vec<String>,
    /// Held-out closure as the tool states it.
    pub closure: Option<f64>,
    /// What the true change closes.
    pub true_closure: Option<f64>,
    /// Best overlap of a stated region with the planted one, by samples (intersection over union); `None` where no region
    /// was planted or none of those stated could be read.
    pub overlap: Option<f64>,
    /// Effects that are not excited and said to be, and all that are not.
    pub said_unexcited: [usize; 2],
    /// Time taken [s].
    pub seconds: f64,
}

impl Judged {
    /// Holds an answer against the truth.
    pub fn new(case: &Case, generated: &Generated, answer: Result<Answer, String>, seconds: f64) -> Self {
        let truth = &generated.truth;
        let names = || truth.effects.iter().map(|hidden| hidden.effect.name());
        let mut judged = Self {
            case: case.name.clone(),
            family: case.family,
            strength: case.strength,
            strengths: truth.strengths.clone(),
            noise: case.noise,
            hidden: names().collect(),
            planted: names().zip(truth.parameters.iter().cloned()).collect(),
            has_twin: case.twin.is_some() && !case.resolved,
            resolved: case.resolved,
            error: None,
            verdict: None,
            named: BTreeSet::new(),
            possible: BTreeSet::new(),
            parameters: Vec::new(),
            not_compared: Vec::new(),
            closure: None,
            true_closure: truth.closure,
            overlap: None,
            said_unexcited: [0, case.unexcited.len()],
            seconds,
        };
        match answer {
            Ok(answer) => judged.judge(case, generated, &answer),
            Err(error) => judged.error = Some(error),
        }
        judged
    }

    fn judge(&mut self, case: &Case, generated: &Generated, answer: &Answer) {
        let owned = |names: BTreeSet<&str>| names.into_iter().map(str::to_owned).collect();
        self.verdict = Some(answer.verdict);
        self.named = owned(answer.names());
        self.possible = owned(answer.possible());
        self.closure = answer.closure();
        self.said_unexcited[0] =
            case.unexcited.iter().filter(|effect| answer.says_not_testable(&effect.name())).count();
        self.overlap = case.gate.as_ref().and_then(|gate| overlap(gate, generated, answer));
        for (hidden, planted) in generated.truth.effects.iter().zip(&generated.truth.parameters) {
            let name = hidden.effect.name();
            let Some(effect) = answer.effects.iter().find(|effect| effect.name == name) else { continue };
            let compared = compare(&name, planted, effect);
            if compared.is_empty() {
                self.not_compared.push(name);
            }
            self.parameters.extend(compared);
        }
    }

    /// Nothing but the truth, and all of it; or, where nothing can tell it from another, both.
    fn is_right(&self) -> bool {
        self.verdict == Some(Verdict::Named) && self.named == self.hidden
            || self.has_twin && self.holds_truth_possible()
    }

    fn holds_truth_possible(&self) -> bool {
        self.verdict == Some(Verdict::Ambiguous) && self.hidden.is_subset(&self.possible)
    }

    fn is_wrong_with_confidence(&self) -> bool {
        self.verdict == Some(Verdict::Named) && !self.named.is_subset(&self.hidden)
    }
}

/// The planted parameters that the tool states under a known name, in the same unit where it states one.
pub(super) fn compare(
    effect: &str,
    planted: &[Parameter],
    named: &super::answer::NamedEffect,
) -> Vec<Compared> {
    let found = |parameter: &Parameter| {
        let estimates = parameter.names.iter().filter_map(|name| named.parameters.get_key_value(*name));
        let same_unit = |unit: &str| {
            let plain =
                |unit: &str| unit.replace(['^', '*', ' ', '·'], "").replace('²', "2").replace('³', "3");
            matches!((plain(unit).as_str(), plain(parameter.unit).as_str()), (a, b) if a == b
                || (["", "-", "1"].contains(&a) && b == "1"))
        };
        estimates
            .filter(|(_, estimate)| same_unit(&estimate.unit))
            .map(|(name, e)| (name.clone(), e.clone()))
            .next()
    };
    let of = |parameter: &Parameter| {
        let (name, estimate) = found(parameter)?;
        let normal = |std: f64| [estimate.value - Z90 * std, estimate.value + Z90 * std];
        Some(Compared {
            name: format!("{effect}.{name}"),
            planted: parameter.value,
            estimated: estimate.value,
            interval: estimate.interval.or_else(|| estimate.std.map(normal)),
            is_largest: false,
        })
    };
    let mut all: Vec<Compared> = planted.iter().filter_map(of).collect();
    if let Some(largest) = all.iter_mut().max_by(|a, b| a.planted.abs().total_cmp(&b.planted.abs())) {
        largest.is_largest = true;
    }
    all
}

fn overlap(gate: &Region, generated: &Generated, answer: &Answer) -> Option<f64> {
    let regions = answer.regions.iter().filter_map(|region| Region::parse(&region.conditions));
    let of = |region: &Region| -> Vec<bool> {
        (0..generated.trials.trials.len()).flat_map(|trial| inside(region, &generated.truth, trial)).collect()
    };
    let planted = of(gate);
    let intersection_over_union = |region: Region| {
        let pairs = of(&region).into_iter().zip(planted.iter().copied());
        let (both, any) =
            pairs.fold((0, 0), |(both, any), (a, b)| (both + usize::from(a && b), any + usize::from(a || b)));
        both as f64 / f64::max(any as f64, 1.0)
    };
    regions.map(intersection_over_union).reduce(f64::max)
}

/// What a measure should reach.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Reach {
    AtLeast(f64),
    AtMost(f64),
    Within([f64; 2]),
    /// For the record.
    Open,
}

/// A measure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// What is measured.
    pub measure: String,
    reach: Reach,
    /// Its value; `None` where no case tells.
    pub value: Option<f64>,
    /// 90 % interval.
    pub interval: Option<[f64; 2]>,
    /// Cases, or values, that it rests on.
    pub count: usize,
    /// Whether the value reaches what it should.
    pub holds: Option<bool>,
}

/// All measures over some answers.
pub fn rows(judged: &[Judged]) -> Vec<Row> {
    let of = |family: Family| judged.iter().filter(move |case| case.family == family);
    let answered = || judged.iter().filter(|case| case.family != Family::Timing);
    let single = |strength: f64| of(Family::Single).filter(move |case| case.strength == strength);
    let sets = of(Family::Set).collect::<Vec<_>>();
    let mut rows = vec![
        share("cases without an answer", Reach::AtMost(0.0), judged.iter().map(|case| case.error.is_some())),
        share(
            "nulls in which any effect is named",
            Reach::AtMost(0.01),
            of(Family::Null).map(|case| !case.named.is_empty()),
        ),
        share(
            "wrong name stated with confidence",
            Reach::AtMost(0.03),
            answered().map(Judged::is_wrong_with_confidence),
        ),
        share(
            "right name, one effect, 3 x the floor",
            Reach::AtLeast(0.95),
            single(3.0).map(Judged::is_right),
        ),
        share(
            "right name, one effect, 1 x the floor",
            Reach::AtLeast(0.85),
            single(1.0).map(Judged::is_right),
        ),
        share("right name, one effect, 0.3 x the floor", Reach::Open, single(0.3).map(Judged::is_right)),
        bootstrap("sets: precision", Reach::AtLeast(0.95), &sets, |cases| {
            let named: usize = cases.iter().map(|case| case.named.len()).sum();
            (named > 0).then(|| common(cases) as f64 / named as f64)
        }),
        bootstrap("sets: recall", Reach::AtLeast(0.85), &sets, |cases| {
            let hidden: usize = cases.iter().map(|case| case.hidden.len()).sum();
            (hidden > 0).then(|| common(cases) as f64 / hidden as f64)
        }),
    ];
    for (strength, reach) in [(3.0, 0.05), (1.0, 0.15)] {
        let errors: Vec<f64> = single(strength)
            .flat_map(|case| &case.parameters)
            .filter(|p| p.is_largest)
            .map(relative_error)
            .collect();
        let measure = format!("parameter error, median, {strength} x the floor");
        rows.push(bootstrap(&measure, Reach::AtMost(reach), &errors, median));
    }
    let parameters = || judged.iter().flat_map(|case| &case.parameters);
    let signs = parameters().filter(|p| p.is_largest).map(|p| p.planted * p.estimated < 0.0);
    rows.push(share("parameters with the wrong sign", Reach::AtMost(0.0), signs));
    let covered = parameters().filter_map(Compared::is_covered);
    rows.push(share("stated 90 % interval covers", Reach::Within([0.85, 0.95]), covered));
    for (strength, reach) in [(3.0, 0.9), (1.0, 0.7)] {
        let closures: Vec<f64> = single(strength).map(|case| case.closure.unwrap_or(0.0)).collect();
        let measure = format!("held-out closure, median, {strength} x the floor");
        rows.push(bootstrap(&measure, Reach::AtLeast(reach), &closures, median));
    }
    let shares: Vec<f64> = of(Family::Single)
        .filter(|case| case.strength >= 1.0)
        .filter_map(|case| Some(case.closure.unwrap_or(0.0) / case.true_closure.filter(|c| *c > 0.1)?))
        .collect();
    rows.push(bootstrap("closure over that of the true term, median", Reach::AtLeast(0.95), &shares, median));
    let pair = |resolved: bool| of(Family::Confounded).filter(move |case| case.resolved == resolved);
    rows.extend([
        share(
            "outside the library: no candidate fits",
            Reach::AtLeast(0.9),
            of(Family::Outside).map(|case| case.verdict == Some(Verdict::NoCandidateFits)),
        ),
        share(
            "outside the library: a library name",
            Reach::AtMost(0.05),
            of(Family::Outside).map(|case| case.verdict == Some(Verdict::Named)),
        ),
        share(
            "indistinguishable pair: ambiguous, holding the truth",
            Reach::AtLeast(0.95),
            pair(false).map(Judged::holds_truth_possible),
        ),
        share(
            "the same after a trial that tells: right name",
            Reach::AtLeast(0.9),
            pair(true).map(Judged::is_right),
        ),
    ]);
    let unexcited = judged.iter().flat_map(|case| {
        let [said, all] = case.said_unexcited;
        (0..all).map(move |index| index < said)
    });
    rows.push(share("not excited: said so", Reach::AtLeast(0.95), unexcited));
    rows.push(share("region: right name", Reach::AtLeast(0.8), of(Family::Gated).map(Judged::is_right)));
    let overlaps: Vec<f64> = of(Family::Gated).map(|case| case.overlap.unwrap_or(0.0)).collect();
    rows.push(bootstrap(
        "region: overlap with the planted one, mean",
        Reach::AtLeast(0.6),
        &overlaps,
        |values| Some(values.iter().sum::<f64>() / values.len() as f64),
    ));
    let times: Vec<f64> = of(Family::Timing).map(|case| case.seconds).collect();
    rows.push(bootstrap("65 trials of 1,000 samples [s]", Reach::AtMost(30.0), &times, median));
    rows
}

/// How many names of some sets are right.
fn common(cases: &[&Judged]) -> usize {
    cases.iter().map(|case| case.named.intersection(&case.hidden).count()).sum()
}

pub(super) fn relative_error(compared: &Compared) -> f64 {
    (compared.estimated / compared.planted - 1.0).abs()
}

pub(super) fn median(values: &[f64]) -> Option<f64> {
    signal::median(&mut values.to_vec())
}

/// A share with Wilson's interval.
pub(super) fn share(measure: &str, reach: Reach, holds: impl Iterator<Item = bool>) -> Row {
    let (yes, count) = holds.fold((0, 0), |(yes, count), holds| (yes + usize::from(holds), count + 1));
    let value = (count > 0).then(|| yes as f64 / count as f64);
    row(measure, reach, value, (count > 0).then(|| wilson(yes, count)), count)
}

/// 90 % interval of a share (Wilson, 1927).
pub fn wilson(yes: usize, count: usize) -> [f64; 2] {
    let (n, z2) = (count as f64, Z90 * Z90);
    let p = yes as f64 / n;
    let center = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = Z90 / (1.0 + z2 / n) * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    [(center - half).max(0.0), (center + half).min(1.0)]
}

/// A statistic with a percentile bootstrap over its values.
pub(super) fn bootstrap<T: Clone>(
    measure: &str,
    reach: Reach,
    values: &[T],
    of: impl Fn(&[T]) -> Option<f64>,
) -> Row {
    if values.is_empty() {
        return row(measure, reach, None, None, 0);
    }
    let mut random = Random::new(values.len() as u64);
    let mut draws: Vec<f64> = (0..RESAMPLES)
        .filter_map(|_| {
            let draw = |_| values[(random.unit() * values.len() as f64) as usize].clone();
            of(&(0..values.len()).map(draw).collect::<Vec<T>>())
        })
        .collect();
    draws.sort_by(f64::total_cmp);
    let quantile = |q: f64| draws[((draws.len() - 1) as f64 * q).round() as usize];
    let interval = (!draws.is_empty()).then(|| [quantile(0.05), quantile(0.95)]);
    row(measure, reach, of(values), interval, values.len())
}

fn row(measure: &str, reach: Reach, value: Option<f64>, interval: Option<[f64; 2]>, count: usize) -> Row {
    let holds = value.and_then(|value| match reach {
        Reach::AtLeast(least) => Some(value >= least),
        Reach::AtMost(most) => Some(value <= most),
        Reach::Within([least, most]) => Some((least..=most).contains(&value)),
        Reach::Open => None,
    });
    Row { measure: measure.to_owned(), reach, value, interval, count, holds }
}

/// The rows of several tools as a table of text.
pub fn table(tools: &BTreeMap<String, Vec<Row>>) -> String {
    let Some(first) = tools.values().next() else { return String::new() };
    let mut text = format!("{:54}{:>14}", "measure", "reach");
    tools.keys().for_each(|name| text += &format!("  {name:>24}"));
    for (index, row) in first.iter().enumerate() {
        let reach = match row.reach {
            Reach::AtLeast(least) => format!(">= {least}"),
            Reach::AtMost(most) => format!("<= {most}"),
            Reach::Within([least, most]) => format!("{least}-{most}"),
            Reach::Open => String::new(),
        };
        text += &format!("\n{:54}{reach:>14}", row.measure);
        for rows in tools.values() {
            text += &format!("  {:>24}", cell(&rows[index]));
        }
    }
    text + "\n"
}

fn cell(row: &Row) -> String {
    match (row.value, row.interval) {
        (Some(value), Some([low, high])) => {
            let mark = if row.holds == Some(false) { "!" } else { "" };
            format!("{mark}{value:.3} ({low:.2}-{high:.2}) {:>4}", row.count)
        }
        _ => "-".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn wilson_s_interval_is_that_of_his_formula() {
        // 9 of 10 at z = 1.645 by hand: center (0.9 + 0.1353) / 1.2706, half width 1.645 / 1.2706 sqrt(0.009 + 0.006765)
        let [low, high] = wilson(9, 10);
        assert!((low - 0.6523).abs() < 2e-3 && (high - 0.9773).abs() < 2e-3, "{low} {high}");
        assert!(wilson(0, 300)[1] < 0.01 && wilson(0, 300)[0] == 0.0);
    }

    #[test]
    fn an_interval_is_scored_as_it_is_stated() {
        let stated = serde_json::json!({"name": "current", "parameters": {
            "east": {"value": 0.5, "std": 0.001, "interval": [0.45, 0.52], "unit": "m/s"},
            "north": {"value": 0.1, "std": 0.02, "unit": "m/s"}}});
        let named = serde_json::from_value(stated).unwrap();
        let planted = |name, value| Parameter { names: name, unit: "m/s", value };
        let compared = |east, north| {
            compare("current", &[planted(&["east"], east), planted(&["u", "north"], north)], &named)
        };
        // the ends that are stated, not those of the standard error; and of both parameters, that of a standard error alone
        let covered =
            |east, north| compared(east, north).iter().map(Compared::is_covered).collect::<Vec<_>>();
        assert_eq!(covered(0.46, 0.13), [Some(true), Some(true)]);
        assert_eq!(covered(0.53, 0.06), [Some(false), Some(false)]);
        let largest = |east, north| compared(east, north).iter().map(|p| p.is_largest).collect::<Vec<_>>();
        assert_eq!((largest(0.5, 0.1), largest(0.1, -0.5)), (vec![true, false], vec![false, true]));
        let other_unit = Parameter { names: &["east"], unit: "km/h", value: 1.8 };
        assert!(compare("current", &[other_unit], &named).is_empty());
    }

    #[test]
    fn bootstraps_hold_their_values() {
        let row = bootstrap("m", Reach::AtMost(0.5), &[0.4; 20], median);
        assert_eq!((row.value, row.interval, row.holds), (Some(0.4), Some([0.4, 0.4]), Some(true)));
        assert_eq!(bootstrap::<f64>("m", Reach::Open, &[], median).value, None);
    }
}
