//! Where the gap is: a shallow tree over the state.
//!
//! Grown on one half of the trials by variance reduction of the squared standardised gap (Breiman and others, CART 1984),
//! at most three conditions deep; what it claims is estimated on the other half (Athey and Imbens, PNAS 2016), where a split
//! must hold again, and tested by giving each trial the gaps of another. A region to which an effect was fitted (`gated`) stands
//! beside them untested, since all trials took part in that.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::Config;
use super::features::{FEATURES, Features, of_bins};
use super::gated::Gated;
use super::series::Series;
use wade_core::effects::{EffectRegion, RegionLimit};
use wade_learn::random::Random;

/// Least share of the bins that a region may hold.
const LEAST_SHARE: f64 = 0.03;
/// Conditions of a region.
const DEPTH: usize = 3;
/// How many times the gap of one side must be that of the other for a split to say something.
const CONTRAST: f64 = 1.5;
/// Largest probability that a region is chance.
const SIGNIFICANCE: f64 = 0.05;

/// A place in the state space where the gap is larger than the noise explains.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Region {
    /// At most three conditions.
    #[serde(rename = "where")]
    pub place: String,
    /// The conditions as numbers: quantity, lower and upper limit.
    pub conditions: Vec<Condition>,
    /// Share of the squared gap above the floor, estimated on trials that did not choose the region where there is a
    /// probability of chance.
    pub share_of_gap: f64,
    /// Share of the samples.
    pub share_of_samples: f64,
    /// Trials that enter it.
    pub trials: usize,
    /// Standardised gap in it over that elsewhere, root mean square.
    pub contrast: f64,
    /// Probability of such a contrast where the place means nothing; none where an effect was fitted to the region, on the
    /// same trials.
    pub p_value: Option<f64>,
    /// Shares of the surfaces in the load there: of the named effects, or of what would carry such a gap where none is named.
    pub surfaces: BTreeMap<String, f64>,
    /// The conditions as limits.
    #[serde(skip)]
    pub(super) limits: Limits,
}

/// One condition of a region.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Condition {
    /// Quantity.
    pub quantity: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Above this.
    pub above: Option<f64>,
    /// At most this.
    pub at_most: Option<f64>,
}

/// A bin as the tree sees it.
struct Point {
    trial: usize,
    features: Features,
    /// Squared standardised gap above the floor.
    excess: f64,
}

/// Lower and upper limit of each feature.
pub(super) type Limits = [[f64; 2]; FEATURES.len()];

pub(super) const OPEN: Limits = [[f64::NEG_INFINITY, f64::INFINITY]; FEATURES.len()];

pub(super) fn inside(limits: &Limits, features: &Features) -> bool {
    limits.iter().zip(features).all(|([low, high], value)| value > low && value <= high)
}

/// Regions by share, and how many splits were tried. `excess` gives the standardised squared gap of each bin of a trial,
/// less what noise alone would show; `fitted` is a region that a fit to all trials has found.
pub(super) fn locate(
    all: &[Series],
    trials: &[usize],
    excess: impl Fn(usize) -> Vec<f64>,
    fitted: Option<&Gated>,
    config: &Config,
) -> (Vec<Region>, usize) {
    let mut points = Vec::new();
    for &trial in trials {
        let bins = of_bins(&all[trial]).into_iter().zip(excess(trial));
        points.extend(bins.map(|(features, excess)| Point { trial, features, excess }));
    }
    let mut order = trials.to_vec();
    Random::new(config.seed ^ 0x10ca7e).shuffle(&mut order);
    let growing = &order[..order.len() / 2];
    let (grow, check): (Vec<&Point>, Vec<&Point>) =
        points.iter().partition(|point| growing.contains(&point.trial));
    if grow.is_empty() || check.is_empty() {
        return (Vec::new(), 0);
    }
    let mut tried = fitted.map_or(0, |gated| gated.tried);
    let mut leaves = Vec::new();
    split(&grow, &check, OPEN, DEPTH, &mut leaves, &mut tried);
    let overall = mean(&grow);
    let ahead = |limits: &Limits| {
        let within: Vec<&Point> = grow.iter().filter(|p| inside(limits, &p.features)).copied().collect();
        mean(&within) > overall
    };
    let boxes = merged(leaves.into_iter().filter(|limits| *limits != OPEN && ahead(limits)).collect());
    let points: Vec<&Point> = points.iter().collect();
    let mut random = Random::new(config.seed ^ 0x9e21);
    let mut tested = |limits: &Limits| {
        let (region, difference) = region(limits, &check, &points)?;
        let p_value = permuted(limits, &check, difference, &mut random);
        (p_value <= SIGNIFICANCE).then_some(Region { p_value: Some(p_value), ..region })
    };
    let mut regions: Vec<Region> = boxes.iter().filter_map(&mut tested).collect();
    regions
        .extend(fitted.and_then(|gated| region(&gated.limits, &points, &points)).map(|(region, _)| region));
    regions.sort_by(|a, b| b.share_of_gap.total_cmp(&a.share_of_gap).then(a.place.cmp(&b.place)));
    regions.truncate(5);
    (regions, tried)
}

/// Boxes that touch along one feature and agree in all others become one.
fn merged(mut boxes: Vec<Limits>) -> Vec<Limits> {
    let join = |a: &Limits, b: &Limits| -> Option<Limits> {
        let differ: Vec<usize> = (0..a.len()).filter(|&f| a[f] != b[f]).collect();
        let &[feature] = &differ[..] else { return None };
        let touch = a[feature][1] == b[feature][0] || b[feature][1] == a[feature][0];
        let mut joined = *a;
        joined[feature] = [a[feature][0].min(b[feature][0]), a[feature][1].max(b[feature][1])];
        touch.then_some(joined)
    };
    loop {
        let pairs = (0..boxes.len()).flat_map(|i| (i + 1..boxes.len()).map(move |j| (i, j)));
        let Some((i, j, joined)) =
            pairs.filter_map(|(i, j)| Some((i, j, join(&boxes[i], &boxes[j])?))).next()
        else {
            return boxes;
        };
        boxes.remove(j);
        boxes[i] = joined;
    }
}

fn mean(points: &[&Point]) -> f64 {
    points.iter().map(|p| p.excess).sum::<f64>() / points.len().max(1) as f64
}

/// Leaves of the tree over points within `limits`.
fn split(
    grow: &[&Point],
    check: &[&Point],
    limits: Limits,
    depth: usize,
    leaves: &mut Vec<Limits>,
    tried: &mut usize,
) {
    let best = (depth > 0).then(|| best_split(grow, tried)).flatten();
    let Some((feature, at)) = best else {
        leaves.push(limits);
        return;
    };
    let below = |p: &&&Point| p.features[feature] <= at;
    let (low_grow, high_grow): (Vec<&Point>, Vec<&Point>) = grow.iter().partition(|p| below(p));
    let (low_check, high_check): (Vec<&Point>, Vec<&Point>) = check.iter().partition(|p| below(p));
    // the other half of the trials must see the same side ahead, clearly
    let sides = [mean(&low_check), mean(&high_check)];
    let ahead = usize::from(mean(&high_grow) > mean(&low_grow));
    let holds = !low_check.is_empty()
        && !high_check.is_empty()
        && sides[ahead] > 0.0
        && sides[ahead] > CONTRAST * CONTRAST * sides[1 - ahead].max(0.0);
    if !holds {
        leaves.push(limits);
        return;
    }
    let (mut low, mut high) = (limits, limits);
    low[feature][1] = at;
    high[feature][0] = at;
    split(&low_grow, &low_check, low, depth - 1, leaves, tried);
    split(&high_grow, &high_check, high, depth - 1, leaves, tried);
}

/// The split that takes most off the sum of squares; winsorised, so that a blow does not carve a region of its own.
fn best_split(points: &[&Point], tried: &mut usize) -> Option<(usize, f64)> {
    const CUTS: usize = 16;
    let least = (LEAST_SHARE * points.len() as f64).max(8.0) as usize;
    if points.len() < 2 * least {
        return None;
    }
    let mut sizes: Vec<f64> = points.iter().map(|p| p.excess).collect();
    let cap = super::statistics::quantile(&mut sizes, 0.98).max(1e-12);
    let mut best: Option<(f64, usize, f64)> = None;
    for feature in 0..FEATURES.len() {
        let mut pairs: Vec<(f64, f64)> =
            points.iter().map(|p| (p.features[feature], p.excess.min(cap))).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let count = pairs.len();
        let mut prefix = vec![0.0];
        pairs.iter().for_each(|(_, e)| prefix.push(prefix[prefix.len() - 1] + e));
        let whole = prefix[count];
        for cut in 1..CUTS {
            let at = (count * cut / CUTS).clamp(least, count - least);
            let value = pairs[at - 1].0;
            let n = pairs.partition_point(|(v, _)| *v <= value);
            if n < least || count - n < least {
                continue;
            }
            *tried += 1;
            let (a, b) = (prefix[n] / n as f64, (whole - prefix[n]) / (count - n) as f64);
            let gain = (a - b).powi(2) * n as f64 * (count - n) as f64 / count as f64;
            if best.is_none_or(|(other, ..)| gain > other) {
                // between two values, so that the words of it tell on which side each lies
                best = Some((gain, feature, 0.5 * (value + pairs[n].0)));
            }
        }
    }
    best.filter(|(gain, ..)| *gain > 0.0).map(|(_, feature, value)| (feature, value))
}

/// A region as some points have it with the trials of all that enter it, and how much larger the gap is in it.
fn region(limits: &Limits, check: &[&Point], all: &[&Point]) -> Option<(Region, f64)> {
    let whole: f64 = check.iter().map(|p| p.excess).sum();
    let (within, without): (Vec<&Point>, Vec<&Point>) =
        check.iter().partition(|p| inside(limits, &p.features));
    if within.is_empty() || without.is_empty() || whole <= 0.0 {
        return None;
    }
    let (here, there) = (mean(&within), mean(&without));
    let share = within.iter().map(|p| p.excess).sum::<f64>() / whole;
    if here <= there.max(0.0) || share < 0.05 {
        return None;
    }
    let entered: BTreeSet<usize> =
        all.iter().filter(|p| inside(limits, &p.features)).map(|p| p.trial).collect();
    let region = Region {
        place: in_words(limits),
        conditions: conditions(limits),
        // elsewhere there may be less than noise is expected to leave
        share_of_gap: share.min(1.0),
        share_of_samples: within.len() as f64 / check.len() as f64,
        trials: entered.len(),
        contrast: (here.max(0.0) / there.max(1e-6 * here)).sqrt(),
        p_value: None,
        surfaces: BTreeMap::new(),
        limits: *limits,
    };
    Some((region, here - there))
}

/// Share of permutations, in which a trial's gaps are those of another, with as large a difference.
fn permuted(limits: &Limits, points: &[&Point], observed: f64, random: &mut Random) -> f64 {
    const DRAWS: usize = 99;
    let mut by_trial: Vec<Vec<&Point>> = Vec::new();
    for point in points {
        match by_trial.last_mut().filter(|trial| trial[0].trial == point.trial) {
            Some(trial) => trial.push(point),
            None => by_trial.push(vec![point]),
        }
    }
    let mut as_large = 0;
    for _ in 0..DRAWS {
        let order = random.permutation(by_trial.len());
        let (mut here, mut there) = ([0.0; 2], [0.0; 2]);
        for (trial, &other) in by_trial.iter().zip(&order) {
            let gaps = &by_trial[other];
            let shift = (random.unit() * gaps.len() as f64) as usize;
            for (i, point) in trial.iter().enumerate() {
                let excess = gaps[(i + shift) % gaps.len()].excess;
                let side = if inside(limits, &point.features) { &mut here } else { &mut there };
                side[0] += excess;
                side[1] += 1.0;
            }
        }
        as_large +=
            usize::from(here[0] / f64::max(here[1], 1.0) - there[0] / f64::max(there[1], 1.0) >= observed);
    }
    (1 + as_large) as f64 / (1 + DRAWS) as f64
}

/// The region of an effect in words, each border in the middle of its interval.
pub(super) fn region_in_words(region: &EffectRegion) -> String {
    let middle = |border: Option<[f64; 2]>| border.map(|[low, high]| 0.5 * (low + high));
    let of = |limit: &RegionLimit| Condition {
        quantity: limit.quantity.name(),
        unit: limit.quantity.unit(),
        above: middle(limit.above),
        at_most: middle(limit.at_most),
    };
    region.limits.iter().map(|limit| text(&of(limit))).collect::<Vec<_>>().join(" and ")
}

/// Limits in words.
pub(super) fn in_words(limits: &Limits) -> String {
    conditions(limits).iter().map(text).collect::<Vec<_>>().join(" and ")
}

fn conditions(limits: &Limits) -> Vec<Condition> {
    let of = |(index, [low, high]): (usize, &[f64; 2])| {
        let (quantity, unit) = FEATURES[index];
        let finite = |value: f64| value.is_finite().then_some(value);
        (low.is_finite() || high.is_finite()).then(|| Condition {
            quantity,
            unit,
            above: finite(*low),
            at_most: finite(*high),
        })
    };
    limits.iter().enumerate().filter_map(of).collect()
}

fn text(condition: &Condition) -> String {
    let Condition { quantity, unit, above, at_most } = condition;
    let unit = if *unit == "1" { String::new() } else { format!(" {unit}") };
    match (above, at_most) {
        (Some(above), Some(at_most)) => format!("{above:.3} < {quantity} <= {at_most:.3}{unit}"),
        (Some(above), None) => format!("{quantity} > {above:.3}{unit}"),
        (None, Some(at_most)) => format!("{quantity} <= {at_most:.3}{unit}"),
        (None, None) => quantity.to_string(),
    }
}
