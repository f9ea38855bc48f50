//! Whether an effect holds beside a set of others.
//!
//! Physics, sensors and drive compete in one regression, scored by the loss of blocks left out (Burman, Chow, Nolan,
//! Biometrika 1994) and Schwarz's price of a number (Annals of Statistics 1978). Each effect of a set must pass every gate given the others:
//! significant by cluster-robust errors, inside its physical bounds, of one sign in every fold, better in most folds and in
//! most of the blocks that excite it, a stated share of the remaining gap above the floor, and large enough to
//! matter beside the noise of a sample.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::DVector;

use super::design::{Design, Fitted};
use super::noise::Floor;
use super::rates::mean_square;
use super::robust::{Error, contribution, errors, group, shadow};
use super::series::Series;
use super::shared::{exceeds_noise, outlasts_noise};
use super::statistics::deviate_of;
use super::{Config, candidates::Setting};
use wade_core::effects::{Effect, Kind};

/// Least deviate of a column that stays in a group.
const COLUMN_DEVIATE: f64 = 2.5;
/// Squared sine of the angle to the others of a set below which a column says the same as they.
const NOVEL: f64 = 0.03;
/// Share of the folds in which an effect must help and keep its sign.
const MOST_FOLDS: f64 = 0.75;
/// Scatter of a coefficient from trial to trial beyond its noise, over the coefficient, above which it is no coefficient: a
/// gain that warms up, a pull that depends on the place. A law that holds in outline stays below.
const MOST_SCATTER: f64 = 0.75;
/// What holds this share of an effect's energy tells of it: where there is nearly none, the noise of the recorded motion is in
/// the effect and, with the other sign, in the gap.
const INFORMATIVE: f64 = 0.9;

/// An effect of a set: its candidate, and the columns that are in use with their coefficients.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Member {
    pub candidate: usize,
    pub columns: Vec<(usize, usize)>,
}

/// How an effect does beside a set.
#[derive(Debug, Clone)]
pub(super) struct Judged {
    pub member: Member,
    pub effect: Effect,
    /// Cross-validated loss of the set with it.
    pub cv_loss: f64,
    /// In-sample gain of the loss.
    pub gain: f64,
    /// Why it is not named; `None` where every gate is passed.
    pub refused: Option<Refusal>,
}

/// A gate that was not passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Refusal {
    /// As likely chance.
    NotSignificant,
    /// Coefficients beyond what is physically possible.
    OutOfBounds,
    /// Too small beside the noise.
    Irrelevant,
    /// Explains too little of the remaining gap.
    SmallShare,
    /// Does not help in most folds, or changes sign between them.
    Unstable,
    /// The others of the set say the same.
    NotNew,
    /// Agrees with the gap from sample to sample alone, as the noise of the recorded motion does.
    SharedNoise,
    /// Passes with others that passed, and together they leave too much to be named.
    Incomplete,
}

/// What the gates said of an effect beside a set of columns.
type Verdicts = BTreeMap<(Vec<usize>, Effect), Option<Judged>>;

/// The regression with what the gates need.
pub(super) struct Judge<'a> {
    pub design: &'a Design,
    pub all: &'a [Series],
    pub setting: &'a Setting<'a>,
    pub config: &'a Config,
    pub floors: &'a [Floor; 6],
    /// Loss that nothing explains.
    pub floor_loss: f64,
    passed: RefCell<Verdicts>,
}

impl<'a> Judge<'a> {
    pub fn new(
        design: &'a Design,
        all: &'a [Series],
        setting: &'a Setting<'a>,
        config: &'a Config,
        floors: &'a [Floor; 6],
        floor_loss: f64,
    ) -> Self {
        Self { design, all, setting, config, floors, floor_loss, passed: RefCell::default() }
    }

    /// Loss above the floor, which there is to explain.
    pub fn missing(&self) -> f64 {
        (self.design.empty_loss() - self.floor_loss).max(f64::MIN_POSITIVE)
    }

    /// Columns of a set.
    pub fn columns(&self, set: &[Member]) -> Vec<usize> {
        set.iter().flat_map(|member| member.columns.iter().map(|(column, _)| *column)).collect()
    }

    pub fn effect(&self, member: &Member) -> Effect {
        self.design.candidates[member.candidate].effect
    }

    /// True where a fault of a sensor is among them.
    pub fn has_fault(&self, set: &[Member]) -> bool {
        set.iter().any(|member| self.effect(member).kind() == Kind::Sensor)
    }

    /// The names of a set in the order of the library.
    pub fn sorted_names(&self, set: &[Member]) -> Vec<&'static str> {
        let mut effects: Vec<Effect> = set.iter().map(|member| self.effect(member)).collect();
        effects.sort();
        effects.into_iter().map(Effect::name).collect()
    }

    /// The names of a set.
    pub fn names(&self, set: &[Member]) -> Vec<&'static str> {
        set.iter().map(|member| self.effect(member).name()).collect()
    }

    /// The best form of an effect beside a set, by every gate but that of shared noise.
    pub fn judge(&self, set: &[Member], effect: Effect) -> Option<Judged> {
        let ranked = self.ranked(set, effect)?;
        let before = self.design.solve(&self.columns(set))?.1;
        let &(least, candidate) = ranked.first()?;
        let Some(refused) = self.hopeless(set, before, least) else {
            return self.judge_ranked(set, &ranked);
        };
        let member = self.whole(candidate);
        let (gain, refused) = (before - least, Some(refused));
        Some(Judged { member, effect, cv_loss: f64::INFINITY, gain, refused })
    }

    /// Loss and candidate of each form of an effect beside a set, the least first.
    pub fn ranked(&self, set: &[Member], effect: Effect) -> Option<Vec<(f64, usize)>> {
        let base = self.columns(set);
        let forms = self.design.candidates.iter().enumerate().filter(|(_, c)| c.effect == effect);
        let mut ranked: Vec<(f64, usize)> = forms
            .filter_map(|(index, candidate)| {
                let mut columns = base.clone();
                columns.extend(candidate.columns.iter().map(|(column, _)| *column));
                Some((self.design.solve(&columns)?.1, index))
            })
            .collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        (!ranked.is_empty()).then_some(ranked)
    }

    /// A candidate with all of its columns.
    pub fn whole(&self, candidate: usize) -> Member {
        Member { candidate, columns: self.design.candidates[candidate].columns.clone() }
    }

    /// The first of the best two forms that passes, or else the best one.
    pub fn judge_ranked(&self, set: &[Member], ranked: &[(f64, usize)]) -> Option<Judged> {
        let base = self.columns(set);
        let before = self.design.solve(&base)?.1;
        let mut first = None;
        for &(_, candidate) in ranked.iter().take(2) {
            let Some(judged) = self.judge_form(set, &base, before, candidate) else { continue };
            if judged.refused.is_none() {
                return Some(judged);
            }
            first.get_or_insert(judged);
        }
        first
    }

    /// A gate that no choice among an effect's columns can pass, from the gain of all of them: most of the library is not
    /// there, and the errors of a fit take most of the time.
    fn hopeless(&self, set: &[Member], before: f64, after: f64) -> Option<Refusal> {
        // a third of the variance that rows of their own residual would give
        const CERTAIN: f64 = 3.0;
        let gain = before - after;
        if gain < self.least_gain(set, before) {
            return Some(Refusal::SmallShare);
        }
        let variance = after / self.design.y.len().max(1) as f64;
        let deviate = deviate_of(self.config.significance);
        (CERTAIN * gain < deviate * deviate * variance).then_some(Refusal::NotSignificant)
    }

    /// What an effect beside a set must gain.
    fn least_gain(&self, set: &[Member], before: f64) -> f64 {
        let remaining = (before - self.floor_loss).max(0.0);
        let of_whole = if set.is_empty() { 0.0 } else { self.config.share_of_gap * self.missing() };
        f64::max(self.config.share_of_remaining * remaining, of_whole)
    }

    pub fn judge_form(
        &self,
        set: &[Member],
        base: &[usize],
        before: f64,
        candidate: usize,
    ) -> Option<Judged> {
        let effect = self.design.candidates[candidate].effect;
        let mut own = self.design.candidates[candidate].columns.clone();
        // two that say the same cancel each other at any size, and so explain what neither does
        own.retain(|(column, _)| self.design.novelty(*column, base) > NOVEL);
        if own.is_empty() {
            let member = self.whole(candidate);
            return Some(Judged {
                member,
                effect,
                cv_loss: before,
                gain: 0.0,
                refused: Some(Refusal::NotNew),
            });
        }
        let mut refused = None;
        let fitted = loop {
            let columns: Vec<usize> = base.iter().copied().chain(own.iter().map(|(c, _)| *c)).collect();
            let (beta, _) = self.design.solve(&columns)?;
            let residual = self.design.residual(&columns, &beta);
            let errors = errors(self.design, &columns, &residual)?;
            let at = base.len();
            let outside = |i: usize| self.out_of_bounds(effect, own[i], beta[at + i], &errors[at + i]);
            let deviate = |i: usize| errors[at + i].deviate(beta[at + i]);
            let weakest = (0..own.len()).min_by(|&a, &b| deviate(a).total_cmp(&deviate(b)));
            let bad = (0..own.len()).find(|&i| outside(i)).filter(|_| own.len() > 1);
            let drop = bad.or(weakest.filter(|&i| own.len() > 1 && deviate(i) < COLUMN_DEVIATE));
            if let Some(drop) =
                drop.or_else(|| self.of_noise(effect, base, &own, &beta.as_slice()[at..], &residual))
            {
                own.remove(drop);
                continue;
            }
            if outside(0) && own.len() == 1 {
                refused = Some(Refusal::OutOfBounds);
            }
            let mine: Vec<usize> = own.iter().map(|(column, _)| *column).collect();
            let together = group(self.design, base, &mine, &beta.as_slice()[at..], &residual)?;
            if together.probability(1.0) > self.config.significance {
                refused = refused.or(Some(Refusal::NotSignificant));
            }
            break self.design.fit(&columns)?;
        };
        let gain = before - fitted.loss;
        let member = Member { candidate, columns: own };
        refused = refused.or_else(|| self.gates(set, &member, base, before, &fitted));
        Some(Judged { member, effect, cv_loss: fitted.cv_loss, gain, refused })
    }

    fn out_of_bounds(&self, effect: Effect, column: (usize, usize), beta: f64, error: &Error) -> bool {
        let [low, high] = effect.coefficients()[column.1].bounds;
        let scale = self.design.scale[column.0];
        let (value, slack) = (beta / scale, 2.0 * error.std / scale);
        value < low - slack || value > high + slack
    }

    fn gates(
        &self,
        set: &[Member],
        member: &Member,
        base: &[usize],
        before: f64,
        fitted: &Fitted,
    ) -> Option<Refusal> {
        if !self.is_a_law(member) {
            return Some(Refusal::NotSignificant);
        }
        if !self.relevant(member, base, fitted) {
            return Some(Refusal::Irrelevant);
        }
        if before - fitted.loss < self.least_gain(set, before) {
            return Some(Refusal::SmallShare);
        }
        (!self.stable(member, base, fitted)).then_some(Refusal::Unstable)
    }

    /// False for columns of an effect that are not its law by themselves: what comes with an effect does not come without it. A moving
    /// bed changes the lift, and the drag along or across: either alone is another effect's.
    pub fn is_a_law(&self, member: &Member) -> bool {
        const LIFT: usize = 1;
        let effect = self.effect(member);
        let of_bed = |columns: &[(usize, usize)]| {
            let lifts = |&(_, coefficient): &(usize, usize)| coefficient == LIFT;
            columns.iter().any(lifts) && !columns.iter().all(lifts)
        };
        let has_first = member.columns.iter().any(|(_, coefficient)| *coefficient == 0);
        let candidate = &self.design.candidates[member.candidate];
        (has_first || !effect.spec().needs_its_first)
            && (effect != Effect::BedMotion || of_bed(&member.columns) || !of_bed(&candidate.columns))
    }

    /// Size of what a member adds, against the noise of a sample, in any component. What of it the model's own error could be was
    /// taken off the rows.
    fn relevant(&self, member: &Member, base: &[usize], fitted: &Fitted) -> bool {
        let (design, first) = (self.design, base.len());
        let mut squares = [0.0; 6];
        let mut count = [0.0; 6];
        for (row, place) in design.rows.rows.iter().enumerate() {
            let of = |(i, (column, _)): (usize, &(usize, usize))| {
                fitted.beta[first + i] * design.x[(row, *column)]
            };
            let value: f64 = member.columns.iter().enumerate().map(of).sum();
            let of_bin = design.noise.of_bin(place.trial, place.component, place.bin);
            squares[place.component] += (value * of_bin).powi(2);
            count[place.component] += 1.0;
        }
        let size = |c: usize| (squares[c] / f64::max(count[c], 1.0)).sqrt();
        let is_audible = |&c: &usize| size(c) > self.config.relevance * self.floors[c].sample;
        self.setting.components.iter().any(is_audible)
    }

    fn stable(&self, member: &Member, base: &[usize], fitted: &Fitted) -> bool {
        let Some(without) = self.design.fit(base) else { return false };
        let pairs = without.fold_losses.iter().zip(&fitted.fold_losses);
        let helped = pairs.filter(|(without, with)| with < without).count() as f64;
        let folds = fitted.fold_losses.len() as f64;
        // the strongest column carries the sign
        let strongest = (0..member.columns.len())
            .max_by(|&a, &b| fitted.beta[base.len() + a].abs().total_cmp(&fitted.beta[base.len() + b].abs()));
        let Some(strongest) = strongest else { return false };
        let columns: Vec<usize> =
            base.iter().copied().chain(member.columns.iter().map(|(c, _)| *c)).collect();
        let scatter = scatter(self.design, &columns, &fitted.beta, base.len() + strongest);
        if scatter > MOST_SCATTER * fitted.beta[base.len() + strongest].abs() {
            return false;
        }
        let sign = fitted.beta[base.len() + strongest].signum();
        let kept = fitted.fold_betas.iter().all(|beta| beta[base.len() + strongest].signum() == sign);
        helped >= MOST_FOLDS * folds && kept && self.helps_most_blocks(member, base, fitted, &without)
    }

    /// Among the blocks that tell of the member, most must be better.
    fn helps_most_blocks(&self, member: &Member, base: &[usize], with: &Fitted, without: &Fitted) -> bool {
        let design = self.design;
        let blocks = design.rows.blocks;
        let (mut energy, mut change) = (vec![0.0; blocks], vec![0.0; blocks]);
        for (row, place) in design.rows.rows.iter().enumerate() {
            let fold = design.block_fold[place.block];
            let sum = |beta: &DVector<f64>| {
                base.iter().enumerate().map(|(i, &c)| beta[i] * design.x[(row, c)]).sum::<f64>()
            };
            let own: f64 = member
                .columns
                .iter()
                .enumerate()
                .map(|(i, (c, _))| with.fold_betas[fold][base.len() + i] * design.x[(row, *c)])
                .sum();
            let (a, b) = (sum(&without.fold_betas[fold]), sum(&with.fold_betas[fold]) + own);
            energy[place.block] += own * own;
            change[place.block] += (design.y[row] - b).powi(2) - (design.y[row] - a).powi(2);
        }
        let informative = informative(&energy);
        2 * informative.iter().filter(|&&block| change[block] < 0.0).count() > informative.len()
    }

    pub fn taken(&self, set: &[Member], effect: Effect) -> bool {
        set.iter().any(|member| self.effect(member) == effect)
    }

    /// An effect beside a set where it passes every gate; the search asks again and again.
    pub fn passes(&self, set: &[Member], effect: Effect) -> Option<Judged> {
        let key = (self.columns(set), effect);
        if let Some(known) = self.passed.borrow().get(&key) {
            return known.clone();
        }
        let found = self.passes_anew(set, effect);
        self.passed.borrow_mut().insert(key, found.clone());
        found
    }

    fn passes_anew(&self, set: &[Member], effect: Effect) -> Option<Judged> {
        self.weighed(set, effect).filter(|judged| judged.refused.is_none())
    }

    /// The best form of an effect beside a set, by every gate.
    pub fn weighed(&self, set: &[Member], effect: Effect) -> Option<Judged> {
        let judged = self.judge(set, effect)?;
        self.beyond_noise(set, judged)
    }

    /// The gate that looks at a form once it has passed the others: the noise that it shares with the gap.
    pub fn beyond_noise(&self, set: &[Member], mut judged: Judged) -> Option<Judged> {
        if judged.refused.is_none() && !self.outlasts_noise(set, &judged.member)? {
            judged.refused = Some(Refusal::SharedNoise);
        }
        Some(judged)
    }

    /// The first of several columns that agrees with the gap from sample to sample alone: a channel that carries nothing but
    /// noise of the motion seems to have a gain of -1, and would lend the others what it takes off the loss.
    fn of_noise(
        &self,
        effect: Effect,
        base: &[usize],
        own: &[(usize, usize)],
        beta: &[f64],
        residual: &DVector<f64>,
    ) -> Option<usize> {
        if self.setting.computed || own.len() < 2 || lives_on_a_rate(effect) {
            return None;
        }
        let outlasts = |i: usize| {
            let others = own.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, (column, _))| *column);
            let base: Vec<usize> = base.iter().copied().chain(others).collect();
            contribution(self.design, &base, &[own[i].0], &beta[i..=i])
                .is_none_or(|sum| outlasts_noise(self.design, &sum, &(residual + &sum)))
        };
        (0..own.len()).find(|&i| !outlasts(i))
    }

    /// False for what agrees with the gap no better than the noise of the motion would; that of a computed flow has none.
    fn outlasts_noise(&self, set: &[Member], member: &Member) -> Option<bool> {
        if self.setting.computed {
            return Some(true);
        }
        let (design, base) = (self.design, self.columns(set));
        let own: Vec<usize> = member.columns.iter().map(|(column, _)| *column).collect();
        let all: Vec<usize> = base.iter().chain(&own).copied().collect();
        let (beta, _) = design.solve(&all)?;
        let mine = &beta.as_slice()[base.len()..];
        let sum = contribution(design, &base, &own, mine)?;
        let (of_base, _) = design.solve(&base)?;
        if outlasts_noise(design, &sum, &design.residual(&base, &of_base)) {
            return Some(true);
        }
        if !lives_on_a_rate(self.effect(member)) {
            return Some(false);
        }
        let on_base = shadow(design, &base, &own, mine)?;
        let (trials, setting) = (self.all, self.setting);
        let mut residual = design.unsmoothed(trials, setting, &|trial| trials[trial].gap.clone());
        let mut sum = DVector::zeros(residual.len());
        // an inferred wrench holds the noise of the accelerations itself
        let source = match setting.inferred {
            true => residual.clone(),
            false => design.unsmoothed(trials, setting, &|trial| trials[trial].predicted.clone()),
        };
        for (index, column) in design.unsmoothed_columns(trials, setting, &all).iter().enumerate() {
            match index.checked_sub(base.len()) {
                Some(own) => sum.axpy(mine[own], column, 1.0),
                None => {
                    sum.axpy(-on_base[index], column, 1.0);
                    residual.axpy(-of_base[index], column, 1.0);
                }
            }
        }
        Some(exceeds_noise(design, &sum, &residual, &source))
    }
}

/// True for an effect that comes and goes with a rate, as fast as the noise of a motion does.
pub(super) fn lives_on_a_rate(effect: Effect) -> bool {
    use Effect::{
        AddedMass, DriveDelay, InertiaError, MassError, RotatingInertia, SensorDelay, WaterEntrySlamming,
        WaveMemory,
    };
    matches!(effect, AddedMass | InertiaError | MassError | RotatingInertia | WaterEntrySlamming | WaveMemory)
        || matches!(effect, DriveDelay | SensorDelay)
}

/// The fewest that together hold [`INFORMATIVE`] of the energy.
pub(super) fn informative(energy: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..energy.len()).collect();
    order.sort_by(|&a, &b| energy[b].total_cmp(&energy[a]).then(a.cmp(&b)));
    let (most, mut held) = (INFORMATIVE * energy.iter().sum::<f64>(), 0.0);
    order.retain(|&index| {
        let needed = held <= most;
        held += energy[index];
        needed
    });
    order
}

/// Standard deviation of a coefficient between the trials that tell of it, beyond what noise explains, by moments (DerSimonian
/// and Laird, Controlled Clinical Trials 1986); 0 where its excess is as likely chance. A trial that is explained badly as a whole says
/// little of one coefficient: its noise is its own residual where that is larger than all trials' together.
fn scatter(design: &Design, columns: &[usize], beta: &DVector<f64>, index: usize) -> f64 {
    let residual = design.residual(columns, beta);
    let x = design.x.column(columns[index]);
    let noise = mean_square(residual.as_slice()).max(f64::MIN_POSITIVE);
    // inverse of the variance of the trial's own deviation, and that over its standard deviation
    let of_trial = |trial: usize| {
        let rows = &design.rows.of_trial[trial];
        let residual = &residual.as_slice()[rows.clone()];
        let variance = noise.max(mean_square(residual));
        let of = |(xx, xr): (f64, f64), (x, r): (&f64, &f64)| (xx + x * x, xr + x * r);
        let (xx, xr) = x.as_slice()[rows.clone()].iter().zip(residual).fold((0.0, 0.0), of);
        (xx > 0.0).then(|| (xx / variance, xr / (xx * variance).sqrt()))
    };
    let energy = |rows: &Range<usize>| x.as_slice()[rows.clone()].iter().map(|x| x * x).sum::<f64>();
    let energies: Vec<f64> = design.rows.of_trial.iter().map(energy).collect();
    let trials: Vec<(f64, f64)> = informative(&energies).into_iter().filter_map(of_trial).collect();
    let (sum, squares) =
        trials.iter().fold((0.0, 0.0), |(s, q), (weight, _)| (s + weight, q + weight * weight));
    let freedom = trials.len().max(2) as f64 - 1.0;
    let excess = trials.iter().map(|(_, deviate)| deviate * deviate).sum::<f64>() - freedom;
    if excess < 5.0 * (2.0 * freedom).sqrt() {
        return 0.0;
    }
    (excess / (sum - squares / sum).max(f64::MIN_POSITIVE)).sqrt()
}
