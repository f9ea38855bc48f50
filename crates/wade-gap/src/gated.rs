//! An effect that acts in a part of the state space alone: where what the whole space does not fit, a region does. It is named there
//! where it passes what every effect must, and the held-out trials show it.
//!
//! The columns of an effect are set to zero outside a region, and the region grows by one limit at a time, that which
//! explains most, as long as a limit says much. A tree over the size of the gap, as in `locate`, cuts where the gap is
//! large; an effect that grows with the speed is large where it is fast, and its border lies elsewhere.

use nalgebra::{DMatrix, DVector};

use super::candidates::Setting;
use super::design::{Candidate, Design};
use super::explanations::variance;
use super::features::{Features, LIMITING, of_bins};
use super::judge::{Judge, Member, lives_on_a_rate};
use super::lasting::memory_of;
use super::locate::{Limits, OPEN, inside};
use super::nonlinear::settle;
use super::series::Series;
use super::shared::outlasts_noise;
use super::statistics::{Z90, median};
use wade_core::effects::{Effect, EffectRegion, Kind, RegionLimit, RegionQuantity, Shape};

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
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Gated {
    pub effect: Effect,
    pub shape: Shape,
    /// Its borders where each is best.
    pub limits: Limits,
    /// The same with the interval of each border; none where no state lies clearly within one of them.
    pub region: Option<EffectRegion>,
    /// Share of the gap above the floor that it explains there.
    pub share: f64,
    /// Cuts that were tried, of all effects.
    pub tried: usize,
}

/// The effect and region that explain most of the gap, where one limit or more is worth it, and those that do so of what may be named
/// in one, where these are others.
pub(super) fn gated(judge: &Judge, library: &[Effect]) -> Vec<Gated> {
    let design = judge.design;
    let whole = judge.missing();
    let features: Vec<Vec<Features>> = judge.all.iter().map(of_bins).collect();
    let places: Vec<Features> =
        design.rows.rows.iter().step_by(design.rows.width).map(|row| features[row.trial][row.bin]).collect();
    let one = |candidate: &Candidate| {
        let Normal { bins, ridge, .. } = &Normal::of(design, candidate);
        let mut found = (OPEN, total(bins.iter())?.gain(*ridge));
        let mut tried = 0;
        for _ in 0..MOST {
            let Some(next) = best_limit(bins, &places, &found.0, *ridge, &mut tried) else { break };
            if next.1 < found.1 + WORTH * whole {
                break;
            }
            found = next;
        }
        let (effect, shape) = (candidate.effect, candidate.shape);
        Some(Gated { effect, shape, limits: found.0, region: None, share: found.1 / whole, tried })
    };
    // where an effect is hardly excited, the noise of the recorded motion is in it and, with the other sign, in the gap
    let of_noise = |gated: &Gated, candidate: &Candidate| {
        if lives_on_a_rate(gated.effect) {
            return false;
        }
        let (left, _) = Normal::of(design, candidate).left_within(design, &places, &gated.limits);
        let load = &design.y - left;
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
    let describes = |of: &(Gated, &Candidate)| !of_noise(&of.0, of.1);
    let mut rest = found.iter();
    let first = rest.find(|of| describes(of));
    let is_of_water = |(gated, _): &(Gated, &Candidate)| has_borders(gated.effect);
    let of_water = match first.is_some_and(is_of_water) {
        true => None,
        false => rest.find(|of| is_of_water(of) && describes(of)),
    };
    let explains = |gated: &Gated| gated.limits != OPEN && gated.share > EXPLAINED;
    let of = |(gated, candidate): &(Gated, &Candidate)| {
        let region = region(design, candidate, &places, gated);
        Gated { tried, region, ..gated.clone() }
    };
    first.into_iter().chain(of_water).filter(|(gated, _)| explains(gated)).map(of).collect()
}

impl Gated {
    /// True for a load of the water whose region has clear borders.
    pub fn may_be_named(&self) -> bool {
        self.region.is_some() && has_borders(self.effect)
    }

    /// Adds to the design what may act in the region, each effect of the library in its best form, and gives the one that was found to;
    /// none where the region has no clear border.
    pub fn add_to(
        &self,
        design: &mut Design,
        all: &[Series],
        setting: &Setting,
        library: &[Effect],
        folds: usize,
    ) -> Option<Member> {
        let region = self.region.as_ref()?;
        let best = |effect: Effect| {
            let forms = design.candidates.iter().filter(|candidate| candidate.effect == effect);
            let loss =
                |form: &&Candidate| design.solve(&columns(form)).map_or(f64::INFINITY, |(_, loss)| loss);
            let first = forms.min_by(|a, b| loss(a).total_cmp(&loss(b)));
            first.map(|candidate| if effect == self.effect { self.shape } else { candidate.shape })
        };
        let limited = library.iter().copied().filter(|effect| has_borders(*effect));
        let laws: Vec<_> = limited.filter_map(best).map(|shape| (shape, region.clone())).collect();
        let first = design.candidates.len();
        design.add(all, setting, &laws, folds);
        settle(design, all, setting, first);
        let own = |&index: &usize| design.candidates[index].effect == self.effect;
        let candidate = (first..design.candidates.len()).find(own)?;
        Some(Member { candidate, columns: design.candidates[candidate].columns.clone() })
    }
}

/// True for what may be named in a region: a load of the water, unless it remembers and so acts beyond any border.
fn has_borders(effect: Effect) -> bool {
    effect.kind() == Kind::Physics && !effect.spec().has_memory
}

/// The borders of a region as intervals: where the likelihood of the rows falls by as much as it does for a normal variable at the
/// ends of 90 %, and no less than the quantity changes from bin to bin across it, which a mean over a bin cannot tell apart. None where
/// no state lies on the inner side of the whole interval, or where two intervals meet: what acts at the last value alone, such as at
/// rest, is not seen to act beyond a border.
fn region(
    design: &Design,
    candidate: &Candidate,
    places: &[Features],
    gated: &Gated,
) -> Option<EffectRegion> {
    let normal = Normal::of(design, candidate);
    let (residual, best) = normal.left_within(design, places, &gated.limits);
    let slack = Z90 * Z90 * variance(design, design.empty_loss() - best, memory_of(design, &residual));
    let border = |feature: usize, end: usize| -> Option<[f64; 2]> {
        let at = gated.limits[feature][end];
        if !at.is_finite() {
            return None;
        }
        let mut open = gated.limits;
        open[feature][end] = OPEN[feature][end];
        let cuts = gains(&normal.bins, places, &open, feature, normal.ridge);
        let near = cuts.iter().filter(|cut| cut.gain[1 - end] >= best - slack);
        let (low, high) =
            near.fold((at, at), |(low, high), cut| (low.min(cut.between[0]), high.max(cut.between[1])));
        let crossing = step_across(design, places, feature, at);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low).max(crossing));
        Some([middle - half, middle + half])
    };
    let limit = |&(feature, quantity): &(usize, RegionQuantity)| {
        let (above, at_most) = (border(feature, 0), border(feature, 1));
        (above.is_some() || at_most.is_some()).then_some(RegionLimit { quantity, above, at_most })
    };
    let within = places.iter().filter(|place| inside(&gated.limits, place));
    let is_seen = |limit: &RegionLimit, feature: usize| {
        let mut values = within.clone().map(|place| place[feature]);
        let beyond = limit.above.is_none_or(|[_, high]| values.clone().any(|value| value > high));
        let below = limit.at_most.is_none_or(|[low, _]| values.any(|value| value < low));
        beyond && below
    };
    let limits: Vec<(usize, RegionLimit)> =
        LIMITING.iter().filter_map(|own| Some((own.0, limit(own)?))).collect();
    let is_clear = limits.iter().all(|(feature, limit)| limit.is_sound() && is_seen(limit, *feature));
    is_clear.then(|| EffectRegion { limits: limits.into_iter().map(|(_, limit)| limit).collect() })
}

/// Columns of a candidate with their normal equations, bin by bin.
struct Normal {
    columns: Vec<usize>,
    bins: Vec<Sum>,
    ridge: f64,
}

impl Normal {
    fn of(design: &Design, candidate: &Candidate) -> Self {
        let columns = columns(candidate);
        let bins = sums(design, &columns);
        let ridge = RIDGE * total(bins.iter()).map_or(0.0, |sum| sum.xx.diagonal().max());
        Self { columns, bins, ridge }
    }

    /// What the effect within limits leaves, row by row, and what it takes off the sum of squares.
    fn left_within(&self, design: &Design, places: &[Features], limits: &Limits) -> (DVector<f64>, f64) {
        let within: Vec<bool> = places.iter().map(|place| inside(limits, place)).collect();
        let bins = self.bins.iter().zip(&within).filter(|(_, within)| **within).map(|(bin, _)| bin);
        let Some(sum) = total(bins) else { return (design.y.clone(), 0.0) };
        let beta = sum.solve(self.ridge);
        let load = |row: usize| {
            let of = |(column, beta): (&usize, &f64)| design.x[(row, *column)] * beta;
            let is_within = within[row / design.rows.width];
            if is_within { self.columns.iter().zip(beta.iter()).map(of).sum() } else { 0.0 }
        };
        (DVector::from_fn(design.y.len(), |row, _| design.y[row] - load(row)), sum.gain(self.ridge))
    }
}

/// The median change of a feature from a bin to the next one of its trial where it crosses a value; 0 where none does.
fn step_across(design: &Design, places: &[Features], feature: usize, at: f64) -> f64 {
    let rows: Vec<_> = design.rows.rows.iter().step_by(design.rows.width).collect();
    let pairs = rows.windows(2).zip(places.windows(2));
    let of_one = pairs.filter(|(rows, _)| rows[0].trial == rows[1].trial && rows[0].bin + 1 == rows[1].bin);
    let ends = of_one.map(|(_, places)| [places[0][feature], places[1][feature]]);
    let mut steps: Vec<f64> =
        ends.filter(|[a, b]| (a - at) * (b - at) < 0.0).map(|[a, b]| (a - b).abs()).collect();
    if steps.is_empty() { 0.0 } else { median(&mut steps) }
}

/// A cut between two values of a feature that differ, and what an effect explains below it and above it.
struct Cut {
    between: [f64; 2],
    gain: [f64; 2],
}

/// Every cut of a feature that is tried within limits.
fn gains(bins: &[Sum], places: &[Features], limits: &Limits, feature: usize, ridge: f64) -> Vec<Cut> {
    let mut order: Vec<usize> = (0..bins.len()).filter(|&bin| inside(limits, &places[bin])).collect();
    order.sort_by(|&a, &b| places[a][feature].total_cmp(&places[b][feature]));
    let Some(whole) = total(order.iter().map(|&bin| &bins[bin])) else { return Vec::new() };
    let mut below: Option<Sum> = None;
    let step = (order.len() / CUTS).max(1);
    let mut cuts = Vec::new();
    for (index, pair) in order.windows(2).enumerate() {
        match &mut below {
            Some(sum) => sum.add(&bins[pair[0]]),
            None => below = Some(bins[pair[0]].clone()),
        }
        let between = [places[pair[0]][feature], places[pair[1]][feature]];
        let is_tried = index % step == 0 || between[1] - between[0] >= 0.01;
        let Some(low) = below.as_ref().filter(|_| between[1] > between[0] && is_tried) else { continue };
        let high = Sum { xx: &whole.xx - &low.xx, xy: &whole.xy - &low.xy };
        cuts.push(Cut { between, gain: [low.gain(ridge), high.gain(ridge)] });
    }
    cuts
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
    for (feature, _) in LIMITING {
        for Cut { between: [low, high], gain } in gains(bins, places, limits, feature, ridge) {
            *tried += 1;
            // the effect stays below a cut at the upper end, and above it at the lower end
            for (end, gain) in [(1, gain[0]), (0, gain[1])] {
                if best.as_ref().is_none_or(|(_, most)| gain > *most) {
                    let mut cut = *limits;
                    cut[feature][end] = 0.5 * (low + high);
                    best = Some((cut, gain));
                }
            }
        }
    }
    best
}
