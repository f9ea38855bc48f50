//! What the search found, and the verdict on it.

use nalgebra::DVector;

use super::design::Design;
use super::detect::sizes;
use super::explanations::{NOTHING, OUTSIDE_LIBRARY, Weighed, more_probable_than_not, probability_of_all};
use super::features::without_zeros;
use super::gated::{Gated, WORTH, gated};
use super::general::{General, Structure};
use super::judge::{Judge, Member};
use super::lasting::lasting;
use super::nonlinear::is_too_short;
use super::report::Verdict;
use wade_core::effects::Effect;

/// Deviates that structure without a name needs.
pub(super) const STRUCTURE: f64 = 5.0;

/// Deviates in one trial that what lasts needs: one of a hundred trials with noise alone reaches 3.5, and products of
/// normal numbers have heavier tails than they.
const LASTS: f64 = 7.0;
/// What lasts beyond the zero of its trial and is clearly larger than the noise itself needs no more than what one of a hundred
/// trials reaches by chance: noise that hangs together is no larger than all of the noise. Deviates, and root mean square
/// in noises of a bin.
const LARGE: [f64; 2] = [3.5, 1.2];

/// Least share of the structure that must be explained where a fault of the sensor is named. Laws of the water hold in
/// outline; a zero, a gain or a turned axis is exact, and where one leaves more it stands in for another thing.
const EXACT: f64 = 0.9;

/// Share of the gap above the floor that an effect may leave to a region of its own and still be named for everywhere.
const LIMITED: f64 = 0.1;

/// Share of what lasts that named effects may leave: the law of an effect that is there leaves a few hundredths.
const MUCH: f64 = 0.15;

/// Probability from which a set that the search passed by is tried and an effect in a region is named, and that of `nothing` below
/// which nothing is not what is said: nine to one, as the intervals of a report have it, and twenty to one.
const LIKELY: f64 = 0.9;
const UNLIKELY: f64 = 0.05;

/// What the search found.
pub(super) struct Found {
    pub verdict: Verdict,
    pub members: Vec<Member>,
    /// Their names, in the order of the library.
    names: Vec<&'static str>,
    pub alternatives: Vec<Vec<Member>>,
    pub residual: DVector<f64>,
    /// Effects that explain more within a region than the members do everywhere: the one that explains most, and that of those that may
    /// be named.
    pub gated: Vec<Gated>,
    /// What is left without a name: after the members where they fit, else of the gap as it is.
    pub left: Structure,
    /// What the gap has without a name before anything is taken out.
    pub of_gap: Structure,
    pub loss: f64,
    /// Whether what the evidence holds for missing can matter: what the state predicts of the gap is large enough, or the model
    /// states an error of which functions of the state see as much as of an effect.
    matters: bool,
    /// Whether the gap has structure, whatever explains it.
    is_structured: bool,
    /// Why members that pass every gate are not named.
    pub unfit: Option<Unfit>,
}

/// Why effects that pass every gate are not named.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unfit {
    /// They explain this share of what is missing, where that much is asked for.
    Explains(f64, f64),
    /// One of them goes faster than the samples tell.
    Unresolved,
    /// One effect in a region explains more.
    Imitates,
    /// Much of what lasts is still there.
    Leaves,
    /// That nothing of the library explains the gap is more probable, with this probability.
    Unlikely(f64),
    /// Other effects are more probable, with this probability, and the held-out trials disprove them.
    Outweighed(f64),
    /// That nothing is missing has this probability.
    Doubtful(f64),
}

impl Found {
    pub fn of(
        judge: &Judge,
        members: &[Member],
        library: &[Effect],
        general: &General,
        gap_structure: &Structure,
        for_its_weight: bool,
    ) -> Self {
        let (design, config) = (judge.design, judge.config);
        let columns = judge.columns(members);
        let (beta, loss) =
            design.solve(&columns).unwrap_or_else(|| (DVector::zeros(columns.len()), design.empty_loss()));
        let residual = design.residual(&columns, &beta);
        let coverage = (design.empty_loss() - loss) / judge.missing();
        let needed = if judge.has_fault(members) { config.coverage.max(EXACT) } else { config.coverage };
        // rows in which the model is as wrong as it says have a square of 1 each
        let stated = design.noise.stated() * design.y.len() as f64;
        let unresolved = members.iter().any(|member| {
            let candidate = &design.candidates[member.candidate];
            is_too_short(&candidate.shape, judge.setting)
        });
        let is_structured = is_structured(judge, gap_structure);
        let missing = !members.is_empty() || is_structured;
        // what one effect explains in a region, a sum of others can imitate everywhere; never the other way round, since a limit
        // takes from an effect, and what acts in a region has its limits
        let is_limited = members.iter().any(|m| !design.candidates[m.candidate].region.is_everywhere());
        let mut gated = if missing && !is_limited { gated(judge, library) } else { Vec::new() };
        gated.retain(|gated| gated.share > coverage + WORTH);
        let imitated = gated.first().is_some_and(|gated| {
            let same = matches!(members, [one] if judge.effect(one) == gated.effect);
            !same || gated.share > coverage + LIMITED
        });
        let unfit = match members.is_empty() {
            true => None,
            _ if coverage < needed && loss > stated && !for_its_weight => {
                Some(Unfit::Explains(coverage, needed))
            }
            _ if unresolved => Some(Unfit::Unresolved),
            _ if imitated => Some(Unfit::Imitates),
            _ => leaves_much(design, &residual).then_some(Unfit::Leaves),
        };
        let fits = !members.is_empty() && unfit.is_none();
        let left = match fits {
            true => general.structure(design, &judge.setting.components, &residual),
            false => gap_structure.clone(),
        };
        let alternatives = if fits { judge.alternatives(members, library) } else { Vec::new() };
        let verdict = match (missing, fits) {
            (false, _) => Verdict::NothingMissing,
            (_, false) => Verdict::NoCandidateFits,
            _ if alternatives.is_empty() => Verdict::Named,
            _ => Verdict::Ambiguous,
        };
        let of_gap = gap_structure.clone();
        let names = judge.sorted_names(members);
        Self {
            verdict,
            members: members.to_vec(),
            names,
            alternatives,
            residual,
            gated,
            left,
            of_gap,
            loss,
            matters: is_relevant(judge, gap_structure) || design.noise.model,
            is_structured,
            unfit,
        }
    }

    /// The explanation that the members are, in whatever forms and columns of their laws.
    fn own<'a>(&self, weighed: &'a [Weighed]) -> Option<&'a Weighed> {
        weighed.iter().find(|weighed| weighed.explanation.effects == self.names)
    }

    /// True where the members are far more probable to act than not, alone or with others.
    pub fn is_likely(&self, weighed: &[Weighed]) -> bool {
        probability_of_all(&self.names, weighed) >= LIKELY
    }

    /// The set of the effects that are more probable than not, where it is none of what was found: a search that adds one effect
    /// after the other can end in a set too many or too few. Where it ended in none, it must be far more probable than not that
    /// all of them act, whatever acts beside them.
    pub fn set_to_name(&self, judge: &Judge, weighed: &[Weighed]) -> Option<Vec<Member>> {
        let likely = more_probable_than_not(weighed);
        let is_named = matches!(self.verdict, Verdict::Named | Verdict::Ambiguous);
        let is_likely = self.matters && probability_of_all(&likely, weighed) >= LIKELY;
        // of several that stand beside each other the first is the one that is far more probable than the others
        let stands_beside =
            !is_likely && self.alternatives.iter().any(|set| judge.sorted_names(set) == likely);
        let is_said = self.verdict == Verdict::Named && likely == self.names;
        let is_another = is_named && likely != self.names || is_likely && !is_said;
        let is_tried = is_another && !likely.is_empty() && !stands_beside;
        let set = weighed.iter().find(|weighed| is_tried && weighed.explanation.effects == likely)?;
        let mut set = set.set.clone();
        set.sort_by_key(|member| judge.effect(member));
        Some(set)
    }

    /// Names nothing against the weight of the evidence: where other effects than the members are more probable than not, the
    /// explanations that are more probable than the members stand beside them. Where the first of these is none of the library, or where
    /// the held-out trials disprove all of them, nothing is named: then neither the members nor they are what is missing. Nor is
    /// anything named while it is not unlikely that nothing is missing.
    pub fn heed(&mut self, weighed: &[Weighed], holds: impl Fn(&[Member]) -> bool) {
        let probability = |name: &str| {
            let explanations = weighed.iter().map(|weighed| &weighed.explanation);
            explanations.filter(|e| e.effects == [name]).map(|e| e.probability).sum::<f64>()
        };
        let (outside, nothing) = (probability(OUTSIDE_LIBRARY), probability(NOTHING));
        self.is_structured |= self.matters && nothing < UNLIKELY;
        if matches!(self.verdict, Verdict::NothingMissing | Verdict::NoCandidateFits) {
            return self.name_nothing(self.unfit);
        }
        if self.verdict == Verdict::Ambiguous && outside > 0.5 {
            return self.name_nothing(Some(Unfit::Unlikely(outside)));
        }
        if self.verdict == Verdict::Named && nothing >= UNLIKELY {
            return self.name_nothing(Some(Unfit::Doubtful(nothing)));
        }
        let Some(own) = self.own(weighed) else { return };
        if self.verdict != Verdict::Named || more_probable_than_not(weighed) == self.names {
            return;
        }
        let least = own.explanation.probability;
        let before: Vec<&Weighed> =
            weighed.iter().filter(|weighed| weighed.explanation.probability > least).collect();
        let Some(first) = before.first().map(|first| &first.explanation) else { return };
        let of_library = before.iter().filter(|weighed| weighed.explanation.is_of_library());
        let alternatives: Vec<Vec<Member>> =
            of_library.map(|weighed| &weighed.set).filter(|set| holds(set)).cloned().collect();
        let unfit = match first.is_of_library() {
            false => Some(Unfit::Unlikely(first.probability)),
            true => alternatives.is_empty().then_some(Unfit::Outweighed(first.probability)),
        };
        if unfit.is_some() {
            self.name_nothing(unfit);
        } else {
            self.verdict = Verdict::Ambiguous;
            self.alternatives = alternatives;
        }
    }

    /// Leaves the gap as it is: what was searched for does not make structure of noise.
    pub fn name_nothing(&mut self, unfit: Option<Unfit>) {
        self.verdict = if self.is_structured { Verdict::NoCandidateFits } else { Verdict::NothingMissing };
        self.alternatives.clear();
        self.unfit = unfit;
        self.left = self.of_gap.clone();
    }
}

/// True where much of what lasts of the gap is still there after the named effects, beyond what the zeros of the trials leave: a
/// zero of a stated deviation is one square in the rows of a trial, as each of their noises is, and it lasts. What is no larger than
/// the rough part of what the model says of itself is none.
fn leaves_much(design: &Design, residual: &DVector<f64>) -> bool {
    let (before, after) = (lasting(design, &design.y), lasting(design, residual));
    // what the rows keep of a zero of z noises, of n rows: n z^2 / (1 + n z^2)
    let kept = |(&trial, rows): (&usize, &std::ops::Range<usize>)| -> f64 {
        let count = rows.len() / design.rows.width;
        let squares = (0..6).map(|component| design.noise.of_zero(trial, component, count));
        squares.map(|square| square / (1.0 + square)).sum()
    };
    let of_zeros: f64 = design.trials.iter().zip(&design.rows.of_trial).map(kept).sum();
    f64::min(before.most.deviate, after.most.deviate) > LASTS
        && after.most.rms > design.noise.stated()
        && after.energy - of_zeros > MUCH * before.energy
}

/// What the state predicts of the gap, and the least that matters, in noises of a bin.
fn size_and_least(judge: &Judge, structure: &Structure) -> [f64; 2] {
    let (design, setting) = (judge.design, judge.setting);
    let rows = design.y.len().max(1) as f64;
    // gain per row is in bins' noise; relevance is in samples' noise
    let relative = setting
        .components
        .iter()
        .map(|&c| {
            let rough = judge.floors[c].rough();
            judge.floors[c].sample.hypot(rough) / design.noise.bin[c].hypot(rough)
        })
        .fold(f64::INFINITY, f64::min);
    [((structure.gain - design.error.most_left()).max(0.0) / rows).sqrt(), judge.config.relevance * relative]
}

fn is_relevant(judge: &Judge, structure: &Structure) -> bool {
    let [size, least] = size_and_least(judge, structure);
    size > least
}

/// Predictable from the state, or lasting in a trial, and large enough to matter.
fn is_structured(judge: &Judge, structure: &Structure) -> bool {
    let (design, all, setting, config) = (judge.design, judge.all, judge.setting, judge.config);
    let [size, least] = size_and_least(judge, structure);
    // what lasts and is no larger than the rough part of what the model says is none
    let lasts = least.max(design.noise.stated());
    let kept = lasting(design, &design.y);
    let moving = lasting(design, &without_zeros(design, &design.y));
    // a load that was computed has no noise that hangs together and could pass for a gap
    let naming = design.trials.iter().map(|&trial| &all[trial]);
    let above = || {
        sizes(naming.clone(), judge.floors, &design.error, setting, config).values().any(|s| s.above_floor)
    };
    setting.computed && above()
        || structure.deviate > STRUCTURE && size > least
        || kept.most.deviate > LASTS && kept.most.rms > lasts
        || moving.most.deviate > LARGE[0] && moving.most.rms > LARGE[1].max(lasts)
        || moving.together.deviate > LASTS && moving.together.rms > lasts
}

/// Loss that nothing explains: the whole library at once, or the general model, whichever leaves less.
pub(super) fn floor_loss(design: &Design, structure: &Structure) -> f64 {
    let mut columns: Vec<usize> = Vec::new();
    for candidate in &design.candidates {
        for &(column, _) in &candidate.columns {
            if design.novelty(column, &columns) > 1e-3 {
                columns.push(column);
            }
        }
    }
    // midway between in sample and cross-validated, as the general model has it
    let library = design.fit(&columns).map_or(f64::INFINITY, |fit| 0.5 * (fit.loss + fit.cv_loss));
    library.min(structure.loss).min(design.empty_loss()).max(0.0)
}
