//! Trials that cannot be what they are said to be, as far as the prediction beside them tells.

use super::GapError;
use super::series::Series;
use crate::trials::WRENCH;

/// Fewest samples in which a channel that never changes is told from one that happens not to.
const ENOUGH: usize = 20;
/// Share of the size of a prediction by which it must change where a dead channel is to show.
const CHANGES: f64 = 0.1;
/// A unit a thousand times as large or as small, and the factor by which a prediction may be off beside it.
const THOUSAND: f64 = 1000.0;
const OFF: f64 = 1.6;
/// Correlation with the prediction from which a factor between the two is one.
const SAME: f64 = 0.7;

/// Refuses trials of the same samples, measured channels that never change where they should, and loads in kilonewtons.
pub(super) fn check(all: &[Series], components: &[usize], inferred: bool) -> Result<(), GapError> {
    for (index, series) in all.iter().enumerate() {
        let is_same = |other: &&Series| {
            let from_start = |series: &Series, i: usize| series.t[i] - series.t[0];
            let same =
                |i: usize| from_start(series, i) == from_start(other, i) && series.gap[i] == other.gap[i];
            other.t.len() == series.t.len()
                && series.gap.iter().any(|gap| *gap != series.gap[0])
                && (0..series.t.len()).all(same)
        };
        if let Some(other) = all[..index].iter().find(is_same) {
            return Err(GapError::SameTrial { trial: series.name.clone(), other: other.name.clone() });
        }
    }
    // what is inferred is no channel, and in the unit of the mass
    components.iter().filter(|_| !inferred).try_for_each(|&component| check_channel(all, component))
}

fn check_channel(all: &[Series], component: usize) -> Result<(), GapError> {
    let column = WRENCH[component];
    let (unit, larger, smaller) = if component < 3 { ("N", "mN", "kN") } else { ("N m", "N mm", "kN m") };
    // measured and expected
    let samples = all.iter().flat_map(|series| series.seen.iter().zip(&series.gap));
    let pairs: Vec<(f64, f64)> =
        samples.map(|(seen, gap)| (gap[component] + seen[component], seen[component])).collect();
    let sum = |of: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|&(m, p)| of(m, p)).sum::<f64>();
    let (mm, mp, pp) = (sum(&|m, _| m * m), sum(&|m, p| m * p), sum(&|_, p| p * p));
    let (first, count) = (pairs[0].0, pairs.len() as f64);
    let size = (pp / count).sqrt();
    // a gap is a difference: adding the prediction to it again leaves an error of rounding
    let is_constant = pairs.iter().all(|(m, _)| (m - first).abs() <= 1e-9 * size.max(first.abs()));
    let spread = (pp / count - (sum(&|_, p| p) / count).powi(2)).max(0.0).sqrt();
    if is_constant && pairs.len() >= ENOUGH && spread > CHANGES * size {
        return Err(GapError::Dead { column, value: first, spread, unit });
    }
    let ratio = mp.abs() / pp.max(f64::MIN_POSITIVE);
    let is_near = |factor: f64| (1.0 / OFF..OFF).contains(&(ratio / factor));
    let other =
        [(THOUSAND, larger), (1.0 / THOUSAND, smaller)].into_iter().find(|(factor, _)| is_near(*factor));
    match other.filter(|_| mp.abs() > SAME * (mm * pp).sqrt()) {
        Some((_, other)) => Err(GapError::Unit { column, ratio, unit, other }),
        None => Ok(()),
    }
}
