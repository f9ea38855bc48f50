//! An effect that acts in a part of the state space alone: where what the whole space does not fit, a region does.
//!
//! The columns of an effect are set to zero outside a region, and the region grows by one limit at a time, that which
//! explains most, as long as a limit says much. A tree over the size of the gap, as in `locate`, cuts where the gap is
//! large; an effect that grows with the speed is large where it is fast, and its border lies elsewhere.

use nalgebra::{DMatrix, DVector};

use super::design::{Candidate, Design};
use super::features::{Features, of_bins};
use super::judge::{Judge, lives_on_a_rate};
use super::locate::{Limits, OPEN, inside};
use super::shared::outlasts_noise;
use wade_core::effects::Effect;

/// Features that may limit an effect of the water: depth, Froude number, speed.
const FEATURES_USED: usize = 3;
/// Cuts of a feature that are tried.
const CUTS: usize = 24;
/// Limits of a region.
const MOST: usize = 3;
/// Share of the gap above the floor that a limit must add.
pub(super) const WORTH: f64 = 0.03;
/// Share of the gap above the floor that the effect must explain within its region.
const EXPLAINED: f64 = 0.6;

/// Ridge over the energy of an effect's largest column everywhere: where hardly any of it is, rounding is most of what is left.
const RIDGE: f64 = 1e-5;

/// What a gap is like in a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Gated {
    pub effect: Effect,
    pub limits: Limits,
    /// Share of the gap above the floor that it explains there.
    pub share: f64,
    /// Cuts that were tried, of all effects.
    pub tried: usize,
}

/// The effect and region that explain most of the gap, where one limit or more is worth it.
pub(super) fn gated(judge: &Judge, library: &[Effect]) -> Option<Gated> {
    let design = judge.design;
    let whole = judge.missing();
    let features: Vec<Vec<Features>> = judge.all.iter().map(of_bins).collect();
    let places: Vec<Features> =
        design.rows.rows.iter().step_by(design.rows.width).map(|row| features[row.trial][row.bin]).collect();
    let one = |candidate: &Candidate| {
        let bins = sums(design, &columns(candidate));
        let whole_sum = total(bins.iter())?;
        let ridge = RIDGE * whole_sum.xx.diagonal().max();
        let mut found = (OPEN, whole_sum.gain(ridge));
        let mut tried = 0;
        for _ in 0..MOST {
            let Some(next) = best_limit(&bins, &places, &found.0, ridge, &mut tried) else { break };
            if next.1 < found.1 + WORTH * whole {
                break;
            }
            found = next;
        }
        Some(Gated { effect: candidate.effect, limits: found.0, share: found.1 / whole, tried })
    };
    // where an effect is hardly excited, the noise of the recorded motion is in it and, with the other sign, in the gap
    let of_noise = |gated: &Gated, candidate: &Candidate| {
        if lives_on_a_rate(gated.effect) {
            return false;
        }
        let (columns, bins) = (columns(candidate), sums(design, &columns(candidate)));
        let inside: Vec<bool> = places.iter().map(|place| inside(&gated.limits, place)).collect();
        let Some(sum) = total(bins.iter().zip(&inside).filter(|(_, inside)| **inside).map(|(bin, _)| bin))
        else {
            return true;
        };
        let beta = sum.solve(RIDGE * sum.xx.diagonal().max());
        let load = |row: usize| {
            let of = |(column, beta): (&usize, &f64)| design.x[(row, *column)] * beta;
            if inside[row / design.rows.width] { columns.iter().zip(beta.iter()).map(of).sum() } else { 0.0 }
        };
        let load = DVector::from_fn(design.y.len(), |row, _| load(row));
        !outlasts_noise(design, &load, &design.y)
    };
    // what remembers, or begins in the middle of the trials, has a border of its own
    let bordered = |effect: Effect| effect.spec().has_memory || effect == Effect::SensorBiasStep;
    let candidates = design
        .candidates
        .iter()
        .filter(|candidate| library.contains(&candidate.effect) && !bordered(candidate.effect));
    let mut found: Vec<(Gated, &Candidate)> = candidates.filter_map(|of| Some((one(of)?, of))).collect();
    let tried = found.iter().map(|(gated, _)| gated.tried).sum();
    found.sort_by(|(a, _), (b, _)| b.share.total_cmp(&a.share).then(a.effect.cmp(&b.effect)));
    let (best, _) = found.into_iter().find(|(gated, candidate)| !of_noise(gated, candidate))?;
    (best.limits != OPEN && best.share > EXPLAINED).then_some(Gated { tried, ..best })
}

/// Normal equations of one bin.
#[derive(Clone)]
struct Sum {
    xx: DMatrix<f64>,
    xy: DVector<f64>,
}

fn columns(candidate: &Candidate) -> Vec<usize> {
    candidate.columns.iter().map(|(column, _)| *column).collect()
}

fn sums(design: &Design, columns: &[usize]) -> Vec<Sum> {
    let width = design.rows.width;
    let of = |bin: usize| {
        let rows = bin * width..(bin + 1) * width;
        let x = DMatrix::from_fn(width, columns.len(), |i, j| design.x[(rows.start + i, columns[j])]);
        let y = design.y.rows(rows.start, width);
        Sum { xx: x.tr_mul(&x), xy: x.tr_mul(&y) }
    };
    (0..design.y.len() / width).map(of).collect()
}

fn total<'a>(mut bins: impl Iterator<Item = &'a Sum>) -> Option<Sum> {
    let mut sum = bins.next()?.clone();
    bins.for_each(|bin| sum.add(bin));
    Some(sum)
}

impl Sum {
    fn add(&mut self, other: &Self) {
        self.xx += &other.xx;
        self.xy += &other.xy;
    }

    /// Coefficients of least squares.
    fn solve(&self, ridge: f64) -> DVector<f64> {
        let count = self.xy.len();
        let matrix =
            DMatrix::from_fn(count, count, |i, j| self.xx[(i, j)] + if i == j { ridge } else { 0.0 });
        matrix.cholesky().map_or_else(|| DVector::zeros(count), |factor| factor.solve(&self.xy))
    }

    /// What they take off the sum of squares.
    fn gain(&self, ridge: f64) -> f64 {
        self.xy.dot(&self.solve(ridge))
    }
}

/// The limit to add to a region with which the effect explains most, and what it explains then.
fn best_limit(
    bins: &[Sum],
    places: &[Features],
    limits: &Limits,
    ridge: f64,
    tried: &mut usize,
) -> Option<(Limits, f64)> {
    let mut best: Option<(Limits, f64)> = None;
    for feature in 0..FEATURES_USED {
        let mut order: Vec<usize> = (0..bins.len()).filter(|&bin| inside(limits, &places[bin])).collect();
        order.sort_by(|&a, &b| places[a][feature].total_cmp(&places[b][feature]));
        let whole = total(order.iter().map(|&bin| &bins[bin]))?;
        let mut below: Option<Sum> = None;
        let step = (order.len() / CUTS).max(1);
        for (index, &bin) in order.iter().enumerate() {
            match &mut below {
                Some(sum) => sum.add(&bins[bin]),
                None => below = Some(bins[bin].clone()),
            }
            let next = order.get(index + 1).map(|&next| places[next][feature]);
            // a cut lies between two values that differ
            let Some(next) = next.filter(|next| *next > places[bin][feature]) else { continue };
            if index % step != 0 && next - places[bin][feature] < 0.01 {
                continue;
            }
            let Some(low) = &below else { continue };
            let high = Sum { xx: &whole.xx - &low.xx, xy: &whole.xy - &low.xy };
            let at = 0.5 * (places[bin][feature] + next);
            *tried += 1;
            for (end, gain) in [(1, low.gain(ridge)), (0, high.gain(ridge))] {
                if best.as_ref().is_none_or(|(_, most)| gain > *most) {
                    let mut cut = *limits;
                    cut[feature][end] = at;
                    best = Some((cut, gain));
                }
            }
        }
    }
    best
}
