//! What could stand in the place of an effect that was named: sets that explain as much with other names.

use nalgebra::DVector;

use super::judge::{Judge, Judged, Member, Refusal, lives_on_a_rate};
use super::robust::noise_of;
use wade_core::effects::Effect;

impl Judge<'_> {
    /// Sets in which one effect is exchanged that explain as much within two standard errors, with one number
    /// more at most.
    pub fn alternatives(&self, set: &[Member], library: &[Effect]) -> Vec<Vec<Member>> {
        let columns = self.columns(set);
        let Some(fitted) = self.design.fit(&columns) else { return Vec::new() };
        let mut found = Vec::new();
        for index in 0..set.len() {
            let mut others = set.to_vec();
            let out = others.remove(index);
            let without = self.design.solve(&self.columns(&others)).map_or(fitted.loss, |(_, loss)| loss);
            let explained = (without - fitted.loss).max(0.0);
            for &effect in library.iter().filter(|effect| !self.taken(set, **effect)) {
                let rivals = self.passing(&others, effect).into_iter().filter_map(|judged| {
                    let member = self.without_ballast(judged.member, &others);
                    if !self.is_rival(&member, &out, &others) {
                        return None;
                    }
                    let mut rival = others.clone();
                    rival.push(member);
                    let (difference, open) = self.difference(&rival, set, explained)?;
                    (difference <= open && !self.is_refuted(&rival, set)).then_some((difference, rival))
                });
                if let Some((difference, mut rival)) = rivals.min_by(|a, b| a.0.total_cmp(&b.0)) {
                    rival.sort_by_key(|member| self.effect(member));
                    found.push((difference, rival));
                }
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut rivals: Vec<Vec<Member>> = found.into_iter().map(|(_, rival)| rival).collect();
        // where one could stand for the other, both may be there
        if let (&[ours], Some(&[theirs])) =
            (&self.effects(set)[..], rivals.first().map(|r| self.effects(r)).as_deref())
        {
            rivals.extend(self.both(ours, theirs));
        }
        rivals
    }

    /// Forms of an effect that pass every gate beside a set: the best one by losses, and that of the fewest columns, since
    /// what many numbers say of each channel one may say of all.
    fn passing(&self, set: &[Member], effect: Effect) -> Vec<Judged> {
        let best = self.passes(set, effect);
        let base = self.columns(set);
        let plain = || -> Option<Judged> {
            let before = self.design.solve(&base)?.1;
            let forms = self.design.candidates.iter().enumerate().filter(|(_, c)| c.effect == effect);
            let (candidate, _) = forms.min_by_key(|(index, c)| (c.columns.len(), *index))?;
            if best.as_ref().is_some_and(|best| best.member.candidate == candidate) {
                return None;
            }
            let judged = self.judge_form(set, &base, before, candidate)?;
            self.beyond_noise(set, judged).filter(|judged| judged.refused.is_none())
        };
        let plain = if effect == Effect::SensorGain { plain() } else { None };
        best.into_iter().chain(plain).collect()
    }

    /// A law of inertia without the columns that add next to nothing: rates of axes that hardly move hold noise, some of which
    /// always agrees with the gap, and would count as a number against it.
    fn without_ballast(&self, mut member: Member, others: &[Member]) -> Member {
        const LITTLE: f64 = 0.02;
        if !lives_on_a_rate(self.effect(&member)) {
            return member;
        }
        let mut columns = self.columns(others);
        let first = columns.len();
        columns.extend(member.columns.iter().map(|(column, _)| *column));
        let Some((beta, _)) = self.design.solve(&columns) else { return member };
        let energies: Vec<f64> = (first..columns.len())
            .map(|i| beta[i].powi(2) * self.design.x.column(columns[i]).norm_squared())
            .collect();
        let least = LITTLE * energies.iter().sum::<f64>();
        let mut energies = energies.iter();
        member.columns.retain(|_| energies.next().is_none_or(|energy| *energy >= least));
        member
    }

    /// True where an effect may stand in another's place: with one number more at most, and none that nobody has ever measured.
    fn is_rival(&self, member: &Member, out: &Member, others: &[Member]) -> bool {
        self.numbers(member) <= self.numbers(out) + 1 && self.is_published(member, others)
    }

    /// True where every coefficient that has a band of published values lies in it, or a quarter beyond.
    fn is_published(&self, member: &Member, others: &[Member]) -> bool {
        const BEYOND: f64 = 1.25;
        let mut columns = self.columns(others);
        let first = columns.len();
        columns.extend(member.columns.iter().map(|(column, _)| *column));
        let Some((beta, _)) = self.design.solve(&columns) else { return false };
        member.columns.iter().enumerate().all(|(i, &(column, coefficient))| {
            let value = beta[first + i] / self.design.scale[column];
            let band = self.effect(member).coefficients()[coefficient].literature;
            // a band ends where nothing was measured, on either side of 0
            let reach =
                |end: f64, outwards: f64| if end * outwards > 0.0 { end * BEYOND } else { end / BEYOND };
            band.is_none_or(|[low, high]| value >= reach(low, -1.0) && value <= reach(high, 1.0))
        })
    }

    /// Two rivals together, where each is significant beside the other.
    fn both(&self, ours: Effect, theirs: Effect) -> Option<Vec<Member>> {
        let significant = |set: &[Member], effect: Effect| {
            let judged = self.judge_ranked(set, &self.ranked(set, effect)?)?;
            matches!(judged.refused, None | Some(Refusal::SmallShare)).then_some(judged.member)
        };
        let a = self.judge(&[], ours)?.member;
        let b = significant(&[a], theirs)?;
        let a = significant(std::slice::from_ref(&b), ours)?;
        let mut both = vec![a, b];
        both.sort_by_key(|member| self.effect(member));
        Some(both)
    }

    /// Numbers that a member was fitted with, nonlinear ones included.
    fn numbers(&self, member: &Member) -> usize {
        let shape = match self.effect(member) {
            // when, and whether in a trial or between trials
            Effect::SensorBiasStep => 2,
            // time constant, frequency, and what it remembers
            Effect::WaveMemory => 3,
            effect => effect.spec().parameters.len(),
        };
        member.columns.len() + shape
    }

    /// Cross-validated loss of one set over another, and how much of it two standard errors and the formulas' own
    /// uncertainty leave open, for a member that explains `explained`.
    ///
    /// The scatter from trial to trial, and a hundredth for the formula. Where few trials tell the two apart that scatter
    /// says nothing: there the noise alone counts, through what the two predict differently, and more for the formula, whose
    /// errors fewer trials average.
    fn difference(&self, rival: &[Member], set: &[Member], explained: f64) -> Option<(f64, f64)> {
        const ENOUGH: f64 = 8.0;
        /// Share of what is explained that a formula leaves open in one trial, and the bounds of that in several.
        const FORMULA: (f64, [f64; 2]) = (0.1, [0.01, 0.05]);
        let (a, b) = (self.predictions(rival)?, self.predictions(set)?);
        let design = self.design;
        let mut trials = vec![0.0; design.trials.len()];
        for (row, part) in design.rows.rows.iter().enumerate() {
            trials[design.place(part.trial)] +=
                (design.y[row] - a[row]).powi(2) - (design.y[row] - b[row]).powi(2);
        }
        let count = trials.len() as f64;
        let (sum, squares) = trials.iter().fold((0.0, 0.0), |(s, q), d| (s + d.abs(), q + d * d));
        let total: f64 = trials.iter().sum();
        let telling = sum * sum / squares.max(f64::MIN_POSITIVE);
        let formula = (FORMULA.0 / telling).clamp(FORMULA.1[0], FORMULA.1[1]) * explained;
        if telling >= ENOUGH {
            let variance = trials.iter().map(|d| (d - total / count).powi(2)).sum::<f64>() / (count - 1.0);
            return Some((total, (2.0 * (variance * count).sqrt()).max(formula)));
        }
        // the loss of the rival has the noise twice as often as the predictions differ
        let noise = 2.0 * noise_of(design, &(&design.y - &b), &(&a - &b)).sqrt();
        Some((total, (2.0 * noise).max(formula)))
    }

    /// True where single trials rule a rival out, however little of all that is explained lies in them: what it misses there
    /// is more than noise and more than an error of the formulas there, such as the gain that a hung weight should have shown.
    fn is_refuted(&self, rival: &[Member], set: &[Member]) -> bool {
        /// Share of what is explained of a trial that formulas leave open, and of what is left of it that errors of the motion do,
        /// which stand in the gap and in the prediction.
        const OPEN: [f64; 2] = [0.1, 0.05];
        const DEVIATIONS: f64 = 3.0;
        let (Some(a), Some(b)) = (self.predictions(rival), self.predictions(set)) else { return false };
        let design = self.design;
        let mut apart = &a - &b;
        let mut missed = 0.0;
        for rows in &design.rows.of_trial {
            let of = |row: usize| {
                let y = design.y[row];
                [(y - a[row]).powi(2), (y - b[row]).powi(2), a[row] * a[row], b[row] * b[row]]
            };
            let [without, with, ours, theirs] =
                rows.clone().map(of).fold([0.0; 4], |sum, row| std::array::from_fn(|i| sum[i] + row[i]));
            let difference = without - with;
            let open = OPEN[0] * f64::max(ours, theirs) + OPEN[1] * with;
            if difference.abs() > open {
                missed += difference - difference.clamp(-open, open);
            } else {
                rows.clone().for_each(|row| apart[row] = 0.0);
            }
        }
        missed > DEVIATIONS * 2.0 * noise_of(design, &(&design.y - &b), &apart).sqrt()
    }

    /// What a set predicts of each row by the fit without the row's fold.
    fn predictions(&self, set: &[Member]) -> Option<DVector<f64>> {
        let columns = self.columns(set);
        let fitted = self.design.fit(&columns)?;
        let design = self.design;
        let of = |row: usize| {
            let beta = &fitted.fold_betas[design.block_fold[design.rows.rows[row].block]];
            columns.iter().enumerate().map(|(i, &c)| beta[i] * design.x[(row, c)]).sum()
        };
        Some(DVector::from_fn(design.y.len(), |row, _| of(row)))
    }

    /// What a set leaves of each trial by the fits without the rows' folds.
    pub fn losses(&self, set: &[Member]) -> Option<Vec<f64>> {
        let predicted = self.predictions(set)?;
        let of = |rows: &std::ops::Range<usize>| {
            rows.clone().map(|row| (self.design.y[row] - predicted[row]).powi(2)).sum()
        };
        Some(self.design.rows.of_trial.iter().map(of).collect())
    }

    fn effects(&self, set: &[Member]) -> Vec<Effect> {
        set.iter().map(|member| self.effect(member)).collect()
    }
}
