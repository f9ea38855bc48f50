//! Forward selection with swaps and deletions over the whole library: the search for the set of effects whose members all
//! pass their gates ([`super::judge`]) beside each other.

use super::judge::{Judge, Judged, Member, lives_on_a_rate};
use wade_core::effects::Effect;

impl Judge<'_> {
    /// A set after its shapes were fitted: each member as its own candidate passes beside the others now, without those that
    /// no longer do.
    pub fn confirmed(&self, set: &[Member]) -> Vec<Member> {
        let mut set = set.to_vec();
        let mut index = 0;
        while index < set.len() {
            let own = set.remove(index);
            match self.passes_still(&set, own.candidate) {
                Some(member) => {
                    set.insert(index, member);
                    index += 1;
                }
                // the others were judged beside one that is not there
                None => index = 0,
            }
        }
        set
    }

    fn passes_still(&self, others: &[Member], candidate: usize) -> Option<Member> {
        let base = self.columns(others);
        let before = self.design.solve(&base)?.1;
        let judged = self.beyond_noise(others, self.judge_form(others, &base, before, candidate)?)?;
        judged.refused.is_none().then_some(judged.member)
    }

    /// The search: adds the best effect that passes, or the best two that pass only beside each other, then swaps and
    /// deletes until nothing changes.
    pub fn select(&self, library: &[Effect]) -> Vec<Member> {
        let mut set: Vec<Member> = Vec::new();
        let mut seen: Vec<Vec<usize>> = Vec::new();
        while set.len() < self.config.most_effects {
            // what one step adds another may delete: a set that comes back would come back for ever
            let mut columns = self.columns(&set);
            columns.sort_unstable();
            if seen.contains(&columns) {
                break;
            }
            seen.push(columns);
            let before = set.len();
            match self.best_addition(&set, library) {
                Some(best) => set.push(best.member),
                None => set.extend(self.best_pair(&set, library)),
            }
            if set.len() == before {
                break;
            }
            self.improve(&mut set, library);
        }
        if set.len() == 1 {
            self.try_pairs(&mut set, library);
        }
        set.sort_by_key(|member| self.effect(member));
        set
    }

    fn best_addition(&self, set: &[Member], library: &[Effect]) -> Option<Judged> {
        let free = library.iter().filter(|effect| !self.taken(set, **effect));
        let found = free.filter_map(|&effect| self.passes(set, effect));
        found.min_by(|a, b| self.score(a, set).total_cmp(&self.score(b, set)).then(a.effect.cmp(&b.effect)))
    }

    /// Cross-validated loss, and a little for every number: among equals the simpler wins.
    fn score(&self, judged: &Judged, set: &[Member]) -> f64 {
        judged.cv_loss + self.price(self.columns(set).len() + judged.member.columns.len())
    }

    /// What `count` numbers cost in loss: Schwarz's criterion.
    fn price(&self, count: usize) -> f64 {
        let variance = self.floor_loss / self.design.y.len().max(1) as f64;
        count as f64 * variance * (self.design.y.len().max(2) as f64).ln()
    }

    fn improve(&self, set: &mut Vec<Member>, library: &[Effect]) {
        for _ in 0..6 {
            if !self.swap_one(set, library) && !self.delete_one(set) {
                return;
            }
        }
    }

    fn set_score(&self, set: &[Member]) -> f64 {
        let columns = self.columns(set);
        self.design.fit(&columns).map_or(f64::INFINITY, |f| f.cv_loss + self.price(columns.len()))
    }

    fn swap_one(&self, set: &mut Vec<Member>, library: &[Effect]) -> bool {
        let now = self.set_score(set);
        for index in 0..set.len() {
            let mut others = set.clone();
            let out = others.remove(index);
            let Some(best) = self.best_addition(&others, library) else { continue };
            if best.effect != self.effect(&out) && self.score(&best, &others) < now - 1e-9 * now.abs() {
                others.push(best.member);
                *set = others;
                return true;
            }
            // the same effect, but in the form that suits the others
            if best.effect == self.effect(&out) && best.member != out {
                let score = self.score(&best, &others);
                if score < now - 1e-6 * now.abs() {
                    others.push(best.member);
                    *set = others;
                    return true;
                }
            }
        }
        false
    }

    fn delete_one(&self, set: &mut Vec<Member>) -> bool {
        if set.len() < 2 {
            return false;
        }
        for index in 0..set.len() {
            let mut others = set.clone();
            let out = others.remove(index);
            if self.passes(&others, self.effect(&out)).is_none() {
                *set = others;
                return true;
            }
        }
        false
    }

    /// One effect may stand for the sum of two that are both needed: every pair is looked at once.
    fn try_pairs(&self, set: &mut Vec<Member>, library: &[Effect]) {
        /// Share of what a law explains that the noise of its rates may keep from it. A sum that needs no rate, such as a
        /// gain of the drive and one of the water for the product of mass and acceleration, is free of that noise.
        const NOISE: f64 = 0.1;
        let now = self.set_score(set);
        // the motion of a computed flow is prescribed, and has no noise
        let on_rates =
            !self.setting.computed && set.iter().any(|member| lives_on_a_rate(self.effect(member)));
        let explained = (self.design.empty_loss() - now).max(0.0);
        let kept = if on_rates { NOISE * explained } else { 1e-6 * now.abs() };
        let pair = self.best_pair(&[], library);
        if pair.len() == 2 && self.set_score(&pair) < now - kept {
            *set = pair;
            self.improve(set, library);
        }
    }

    /// Two effects that both pass beside a set and each other; none where no pair does. Each hides the other where they
    /// pull in opposite directions, so that neither passes alone.
    fn best_pair(&self, set: &[Member], library: &[Effect]) -> Vec<Member> {
        const LOOKED_AT: usize = 6;
        if set.len() + 2 > self.config.most_effects {
            return Vec::new();
        }
        for (first, second) in self.pairs(set, library).into_iter().take(2 * LOOKED_AT) {
            let Some(a) = self.judge_quick(set, first) else { continue };
            let mut beside = set.to_vec();
            beside.push(a);
            let Some(b) = self.passes(&beside, second) else { continue };
            let mut beside = set.to_vec();
            beside.push(b.member.clone());
            let Some(a) = self.passes(&beside, first) else { continue };
            return vec![a.member, b.member];
        }
        Vec::new()
    }

    /// Every two effects beside a set by least squares alone, in both orders: the second in the form that suits the first. The best
    /// come first.
    pub fn pairs(&self, set: &[Member], library: &[Effect]) -> Vec<(Effect, Effect)> {
        let free: Vec<Effect> = library.iter().filter(|effect| !self.taken(set, **effect)).copied().collect();
        let mut pairs: Vec<(f64, Effect, Effect)> = Vec::new();
        for &first in &free {
            let Some(a) = self.judge_quick(set, first) else { continue };
            let mut beside = set.to_vec();
            beside.push(a);
            for &second in free.iter().filter(|second| **second != first) {
                let Some(b) = self.judge_quick(&beside, second) else { continue };
                let mut whole = beside.clone();
                whole.push(b);
                pairs.push((self.set_score(&whole), first, second));
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        pairs.into_iter().map(|(_, first, second)| (first, second)).collect()
    }

    /// The best form of an effect beside a set by least squares alone.
    pub fn judge_quick(&self, set: &[Member], effect: Effect) -> Option<Member> {
        Some(self.whole(self.ranked(set, effect)?.first()?.1))
    }
}
