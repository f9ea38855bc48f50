//! How probable each explanation of a gap is.
//!
//! An explanation is a set of effects, `nothing`, or a load that is in no library, for which smooth functions of the state stand.
//! Its weight is how well it predicts blocks of trials that its fit left out, averaged over a Bayesian bootstrap of the trials, so
//! that what one trial alone decides is not certain (pseudo-BMA+; Yao, Vehtari, Simpson, Gelman, Bayesian Analysis 13, 2018).
//! Rows that are correlated count for less (Bartlett, J. Roy. Stat. Soc. Suppl. 1946), and so does all that a law may be off by.
//! Every number that was fitted is charged, each border of a region as one (Schwarz, Annals of Statistics 6, 1978). Before the trials, nothing, an unknown load,
//! and each number of effects are equally probable, and so are all sets of a size and all forms of a law. An effect that the
//! prediction is known to leave out is as likely there as not.

use std::collections::BTreeMap;

use serde::Serialize;

use super::design::Design;
use super::features::LIMITING;
use super::fit::FORMULA;
use super::judge::{Judge, Member, Refusal};
use super::lasting::memory_of;
use super::verdict::Found;
use wade_core::effects::Effect;
use wade_learn::random::Random;

/// Name of the explanation that the gap is noise and the model's stated error.
pub const NOTHING: &str = "nothing";
/// Name of the explanation that what is missing is in no library.
pub const OUTSIDE_LIBRARY: &str = "outside_library";

/// Probability below which an explanation is not worth a line.
const LEAST: f64 = 0.001;
/// Lines of a report.
const MOST: usize = 10;

/// One explanation of a gap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// Names of its effects; or `nothing`, or `outside_library`.
    pub effects: Vec<&'static str>,
    /// Probability among all explanations that were weighed.
    pub probability: f64,
}

impl Explanation {
    /// True for a set of effects of the library.
    pub fn is_of_library(&self) -> bool {
        self.effects != [NOTHING] && self.effects != [OUTSIDE_LIBRARY]
    }

    /// For people.
    pub(super) fn in_words(&self) -> String {
        match self.effects[..] {
            [NOTHING] => "nothing missing".to_owned(),
            [OUTSIDE_LIBRARY] => "a load outside the library".to_owned(),
            _ => self.effects.join(" and ").replace('_', " "),
        }
    }
}

/// The effects that probably act though none is named: those of the most probable explanation, where it is more probable than all
/// others together.
pub(super) fn suspected(explanations: &[Explanation], is_named: bool) -> Vec<&'static str> {
    let first = explanations.first().filter(|first| first.is_of_library() && first.probability > 0.5);
    first.filter(|_| !is_named).map_or_else(Vec::new, |first| first.effects.clone())
}

/// An explanation with what its weight rests on.
pub(super) struct Weighed {
    pub explanation: Explanation,
    /// Its effects as they were fitted.
    pub set: Vec<Member>,
    /// Sum of the squares of each trial's rows, by fits without their blocks.
    losses: Vec<f64>,
    log_prior: f64,
    /// How many numbers were fitted.
    numbers: usize,
}

/// Share of a loss by which two sets that say the same can differ.
const SAME: f64 = 1e-6;

/// Numbers that an unknown load has in each component: its size, and how it depends on the state.
const NUMBERS_OUTSIDE: usize = 2;

/// The explanations, the most probable first.
pub(super) fn weigh(judge: &Judge, found: &Found, library: &[Effect]) -> Vec<Weighed> {
    let design = judge.design;
    let of = |name, losses, numbers| {
        let explanation = Explanation { effects: vec![name], probability: 0.0 };
        Weighed { explanation, set: Vec::new(), losses, log_prior: 0.0, numbers }
    };
    let rows = design.rows.of_trial.iter().map(|rows| &design.y.as_slice()[rows.clone()]);
    let nothing: Vec<f64> = rows.map(|y| y.iter().map(|y| y * y).sum()).collect();
    let trials = design.trials.iter().zip(&nothing);
    let outside = trials.map(|(&trial, loss)| loss - found.of_gap.gains[trial]).collect();
    let mut all =
        vec![of(NOTHING, nothing, 0), of(OUTSIDE_LIBRARY, outside, NUMBERS_OUTSIDE * design.rows.width)];
    let whole = |losses: &[f64]| losses.iter().sum::<f64>();
    // the best of each set of effects; the impossible ones come last
    let mut sets: BTreeMap<(bool, Vec<Effect>), Weighed> = BTreeMap::new();
    for Set { members: set, is_possible } in sets_to_weigh(judge, found, library) {
        let Some(losses) = judge.losses(&set) else { continue };
        let mut effects: Vec<Effect> = set.iter().map(|member| judge.effect(member)).collect();
        effects.sort();
        let place = (!is_possible, effects);
        if sets.get(&place).is_some_and(|known| whole(&known.losses) <= whole(&losses)) {
            continue;
        }
        let names = place.1.iter().map(|effect| effect.name()).collect();
        let weighed = Weighed {
            explanation: Explanation { effects: names, probability: 0.0 },
            log_prior: log_prior(judge, &place.1, library)
                - borders(judge, &set) as f64 * (2.0 * LIMITING.len() as f64).ln(),
            numbers: judge.columns(&set).len() + borders(judge, &set),
            set,
            losses,
        };
        sets.insert(place, weighed);
    }
    // what an impossible set explains no better than a possible one of as many numbers does is no other load
    let possible: Vec<(usize, f64)> = sets
        .iter()
        .filter(|((is_impossible, _), _)| !is_impossible)
        .map(|(_, set)| (set.numbers, whole(&set.losses)))
        .collect();
    sets.retain(|(is_impossible, _), set| {
        let mut alike = possible.iter().filter(|(numbers, _)| *numbers <= set.numbers);
        !*is_impossible || !alike.any(|(_, loss)| whole(&set.losses) >= (1.0 - SAME) * loss)
    });
    let possible = all.len() + sets.keys().filter(|(is_impossible, _)| !is_impossible).count();
    all.extend(sets.into_values());
    let probabilities = weights(&all, judge, found);
    for (weighed, probability) in all.iter_mut().zip(probabilities) {
        weighed.explanation.probability = probability;
    }
    // what looks like an effect with an impossible value is another load
    let impossible = all.split_off(possible);
    let beyond: f64 = impossible.iter().map(|weighed| weighed.explanation.probability).sum();
    let outside = all.iter_mut().map(|weighed| &mut weighed.explanation);
    outside.filter(|e| e.effects == [OUTSIDE_LIBRARY]).for_each(|e| e.probability += beyond);
    all.sort_by(|a, b| {
        let (a, b) = (&a.explanation, &b.explanation);
        b.probability.total_cmp(&a.probability).then(a.effects.cmp(&b.effects))
    });
    all
}

/// The effects that are more probable than not, in the order of the library: of all sets that with the best prediction (median
/// probability model; Barbieri and Berger, Annals of Statistics 32, 2004).
pub(super) fn more_probable_than_not(weighed: &[Weighed]) -> Vec<&'static str> {
    let explanations = || weighed.iter().map(|weighed| &weighed.explanation);
    let probability = |name: &str| -> f64 {
        explanations().filter(|e| e.effects.contains(&name)).map(|e| e.probability).sum()
    };
    Effect::ALL.into_iter().map(Effect::name).filter(|name| probability(name) > 0.5).collect()
}

/// Probability that some effects all act, alone or with others.
pub(super) fn probability_of_all(effects: &[&'static str], weighed: &[Weighed]) -> f64 {
    let explanations = weighed.iter().map(|weighed| &weighed.explanation);
    let hold_all = |e: &&Explanation| effects.iter().all(|effect| e.effects.contains(effect));
    explanations.filter(hold_all).map(|e| e.probability).sum()
}

/// Borders of the regions in which the effects of a set act.
fn borders(judge: &Judge, set: &[Member]) -> usize {
    let regions = set.iter().map(|member| &judge.design.candidates[member.candidate].region);
    let limits = regions.flat_map(|region| &region.limits);
    limits.flat_map(|limit| [limit.above, limit.at_most]).flatten().count()
}

/// Logarithm of the probability of a set before the trials, over that of nothing: all sets of a size are alike, but for effects
/// that the prediction is known to leave out, and so are all forms of a law.
fn log_prior(judge: &Judge, effects: &[Effect], library: &[Effect]) -> f64 {
    let forms = |effect: &Effect| {
        judge.design.candidates.iter().filter(|candidate| candidate.effect == *effect).count().max(1) as f64
    };
    let unknown = |effects: &[Effect]| effects.iter().filter(|e| !judge.config.absent.contains(e)).count();
    let (drawn, of) = (unknown(effects), unknown(library));
    let sets = (0..drawn).map(|i| of.saturating_sub(i).max(1) as f64 / (i + 1) as f64);
    -sets.product::<f64>().ln() - effects.iter().map(forms).product::<f64>().ln()
}

/// Those that a report states: the first ones, nothing, and a load outside the library.
pub(super) fn stated(weighed: &[Weighed]) -> Vec<Explanation> {
    let is_stated = |(rank, e): (usize, &Explanation)| {
        !e.is_of_library() || rank == 0 || rank < MOST && e.probability >= LEAST
    };
    let all = weighed.iter().map(|weighed| &weighed.explanation).enumerate();
    all.filter(|entry| is_stated(*entry)).map(|(_, explanation)| explanation.clone()).collect()
}

/// Effects to weigh, and whether each can be there as it was fitted.
#[derive(Clone)]
struct Set {
    members: Vec<Member>,
    is_possible: bool,
}

impl Set {
    /// An effect beside a set with the columns that hold; none without a part of its law, or where the set says the same.
    fn with(&self, judge: &Judge, effect: Effect) -> Option<Self> {
        let judged = judge.judge(&self.members, effect)?;
        if judged.refused == Some(Refusal::NotNew) || !judge.is_a_law(&judged.member) {
            return None;
        }
        let is_possible = self.is_possible && judged.refused != Some(Refusal::OutOfBounds);
        let mut members = self.members.clone();
        members.push(judged.member);
        Some(Self { members, is_possible })
    }
}

impl From<Vec<Member>> for Set {
    fn from(members: Vec<Member>) -> Self {
        Self { members, is_possible: true }
    }
}

/// The set that was found, those that explain as much, each effect alone, the pairs that explain most, and each of the named set taken
/// out, exchanged or joined by another.
fn sets_to_weigh(judge: &Judge, found: &Found, library: &[Effect]) -> Vec<Set> {
    let mut sets: Vec<Set> = found.alternatives.iter().cloned().map(Set::from).collect();
    let beside = |set: &Set, effect: Effect| {
        (!judge.taken(&set.members, effect)).then(|| set.with(judge, effect)).flatten()
    };
    let nothing = Set::from(Vec::new());
    sets.extend(library.iter().filter_map(|&effect| beside(&nothing, effect)));
    sets.extend(pairs(judge, library));
    if found.members.is_empty() {
        return sets;
    }
    let own = Set::from(found.members.clone());
    sets.extend(library.iter().filter_map(|&effect| beside(&own, effect)));
    for out in 0..found.members.len() {
        let mut others = own.clone();
        others.members.remove(out);
        if !others.members.is_empty() {
            sets.extend(library.iter().filter_map(|&effect| beside(&others, effect)));
            sets.push(others);
        }
    }
    sets.push(own);
    sets
}

/// The pairs of effects that explain most, each effect with the columns that hold beside the other: a search that adds one effect
/// after the other finds none of which either explains little alone.
fn pairs(judge: &Judge, library: &[Effect]) -> Vec<Set> {
    const LOOKED_AT: usize = 24;
    let mut looked_at: Vec<[Effect; 2]> = Vec::new();
    let of = |first: Effect, second: Effect| {
        let alone = Set::from(vec![judge.judge_quick(&[], first)?]);
        let second = Set::from(vec![alone.with(judge, second)?.members.pop()?]);
        let pair = second.with(judge, first)?;
        // both beside each other, and neither alone
        let [second, first] = &pair.members[..] else { return None };
        let again = Set::from(vec![first.clone()]).with(judge, judge.effect(second))?;
        Some(Set { is_possible: pair.is_possible && again.is_possible, ..pair })
    };
    let mut pairs = Vec::new();
    for (first, second) in judge.pairs(&[], library) {
        let pair = [first.min(second), first.max(second)];
        if looked_at.len() < LOOKED_AT && !looked_at.contains(&pair) {
            looked_at.push(pair);
            pairs.extend(of(first, second));
        }
    }
    pairs
}

/// Variance of a row of which rows with a memory leave a sum of squares: what is left is noise, never less than where the model is
/// as wrong as it says, and rows that are correlated say the same several times; what a law leaves open of all that is explained is
/// one number more, since it is off in the same way everywhere.
pub(super) fn variance(design: &Design, left: f64, memory: f64) -> f64 {
    let rows = design.y.len().max(1) as f64;
    let noise = (left / rows).max(design.noise.stated()).max(f64::MIN_POSITIVE) * memory;
    noise + FORMULA.powi(2) * (design.empty_loss() - left).max(0.0)
}

/// Weights of explanations over a Bayesian bootstrap of the trials (Rubin, Annals of Statistics 9, 1981).
fn weights(all: &[Weighed], judge: &Judge, found: &Found) -> Vec<f64> {
    let design = judge.design;
    let rows = design.y.len().max(1) as f64;
    let least = all.iter().map(|weighed| weighed.losses.iter().sum::<f64>()).fold(f64::INFINITY, f64::min);
    let memory = memory_of(design, &found.residual);
    let variance = variance(design, least, memory);
    // of a number, by Schwarz's criterion
    let price = 0.5 * (rows / memory).max(1.0).ln();
    let trials = design.trials.len();
    let mut random = Random::new(judge.config.seed ^ 0xb0a7);
    let mut sums = vec![0.0; all.len()];
    for _ in 0..judge.config.bootstrap {
        // a flat Dirichlet variable: exponential ones over their sum
        let shares: Vec<f64> = (0..trials).map(|_| -(1.0 - random.unit()).ln()).collect();
        let whole = shares.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let log = |weighed: &Weighed| {
            let loss: f64 = weighed.losses.iter().zip(&shares).map(|(loss, share)| loss * share).sum();
            weighed.log_prior - 0.5 * loss * trials as f64 / whole / variance - price * weighed.numbers as f64
        };
        let logs: Vec<f64> = all.iter().map(log).collect();
        let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let likelihoods: Vec<f64> = logs.iter().map(|log| (log - most).exp()).collect();
        let sum: f64 = likelihoods.iter().sum();
        sums.iter_mut().zip(&likelihoods).for_each(|(total, likelihood)| *total += likelihood / sum);
    }
    sums.iter_mut().for_each(|sum| *sum /= judge.config.bootstrap as f64);
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_are_likely_over_all_explanations_together() {
        let of = |(effects, probability): (&[&'static str], f64)| Weighed {
            explanation: Explanation { effects: effects.to_vec(), probability },
            set: Vec::new(),
            losses: Vec::new(),
            log_prior: 0.0,
            numbers: 0,
        };
        // the first alone is the less probable half of what holds it
        let explanations: [(&[&str], f64); 4] = [
            (&["added_mass", "squat"], 0.35),
            (&["added_mass"], 0.25),
            (&["current"], 0.2),
            (&[OUTSIDE_LIBRARY], 0.2),
        ];
        let weighed: Vec<Weighed> = explanations.into_iter().map(of).collect();
        assert_eq!(more_probable_than_not(&weighed), ["added_mass"]);
        assert_eq!(more_probable_than_not(&weighed[1..]), [""; 0]);
        assert!((probability_of_all(&["added_mass"], &weighed) - 0.6).abs() < 1e-12);
        assert!((probability_of_all(&["squat", "added_mass"], &weighed) - 0.35).abs() < 1e-12);
    }
}
