//! The gap before and after on trials that took no part in naming and fitting.

use std::collections::BTreeMap;

use serde::Serialize;

use super::candidates::{Column, Setting, columns_within};
use super::design::{Rows, to_rows};
use super::features::{Features, of_bins};
use super::judge::{Judge, informative};
use super::locate::{Limits, OPEN, Region, inside};
use super::model_error::ModelError;
use super::noise::{Floor, sample_noise};
use super::series::Series;
use super::statistics::quantile;
use super::{Config, Named};
use wade_learn::random::Random;
use wade_learn::trials::WRENCH;

/// Fewest trials over which a bootstrap says how far a closure may be off.
pub(super) const ENOUGH: usize = 3;
/// Floors that a gap must have before a share of what stands above is said.
const ABOVE: f64 = 1.02;
/// Floors below which a gap hardly stands above them, and what must be left then: where less is, the floor is none, and hundreds of per
/// cent of what stands above it tell nobody anything.
const NEAR: [f64; 2] = [1.5, 0.9];
/// Times the noise of all trials from which that of one is its own: noise of a sensor is known to far better than a factor of two.
const LOUDER: f64 = 2.0;
/// A region may not become worse by more than this share.
const WORSE: f64 = 0.05;

/// Root mean squares of one component [N or N m]; of `all` in noise floors, each with what the model states of itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Closure {
    /// Without the named effects.
    pub before: f64,
    /// With them.
    pub after: f64,
    /// What noise alone would show.
    pub noise_floor: f64,
    /// `(before - after) / (before - noise_floor)`; none where before is not above the floor, or hardly, and after
    /// far below it.
    pub closure: Option<f64>,
    /// 90 % interval of the closure, by a bootstrap over the trials kept back; none of fewer than three.
    pub interval: Option<[f64; 2]>,
}

/// What of a gap is explained where nobody looked while it was named.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Explained {
    /// Share of the squared gap above noise and the model's own error; of all components together, in floors.
    pub share: f64,
    /// Upper end of the interval of the closure; none where it has none.
    pub closes_at_most: Option<f64>,
}

impl Closure {
    /// As a model that states no error is judged.
    pub(super) fn explained(&self) -> Explained {
        Explained {
            share: above_noise(self.before.powi(2), self.after.powi(2)),
            closes_at_most: self.interval.map(|[_, high]| high),
        }
    }

    /// The share that is explained where what was named does not hold on trials that nobody looked at: less than `least` is explained
    /// and what is left of all components is loud; or it names a fault of a sensor, which is exact, and closes too little even at the
    /// upper end of the interval.
    pub(super) fn disproof(&self, explained: Explained, least: f64, is_fault: bool) -> Option<f64> {
        /// In noise and the model's own error, as all components together are.
        const LOUD: f64 = 2.0;
        /// Closure that a fault must reach.
        const EXACT: f64 = 0.7;
        let Explained { share, closes_at_most } = explained;
        let inexact = is_fault && closes_at_most.is_some_and(|most| most < EXACT);
        (inexact || self.after > LOUD && share < least).then_some(share)
    }
}

/// A region that the named effects make worse.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worse {
    /// The region.
    #[serde(rename = "where")]
    pub place: String,
    /// The component that gets worse; none where all together do.
    pub component: Option<&'static str>,
    /// Gap before, in noise floors.
    pub before: f64,
    /// Gap after.
    pub after: f64,
}

/// The wrench that the named effects add to each sample of a trial.
pub(super) fn explained(named: &[Named], series: &Series, rank: usize, setting: &Setting) -> Vec<[f64; 6]> {
    let mut sum = vec![[0.0; 6]; series.t.len()];
    for named in named {
        let columns = columns_within((&named.shape, &named.region), series, rank, setting);
        for &(coefficient, value) in &named.coefficients {
            for (sum, column) in sum.iter_mut().zip(&columns[coefficient]) {
                (0..6).for_each(|c| sum[c] += value * column[c]);
            }
        }
    }
    sum
}

/// The same of each of several trials, in their order.
pub(super) fn explained_of_trials(
    named: &[Named],
    all: &[Series],
    trials: &[usize],
    setting: &Setting,
) -> Vec<Column> {
    trials.iter().map(|&trial| explained(named, &all[trial], trial, setting)).collect()
}

/// Squares before and after of one trial, by component, and its samples.
#[derive(Clone)]
struct Sums {
    before: [f64; 6],
    after: [f64; 6],
    count: f64,
}

/// The closure of each component, and of all together, each in its noise and what the model states of itself.
pub(super) fn closures(
    added: &[Column],
    all: &[Series],
    held: &[usize],
    setting: &Setting,
    floors: &[Floor; 6],
    config: &Config,
) -> BTreeMap<&'static str, Closure> {
    let sums: Vec<Sums> = held
        .iter()
        .zip(added)
        .map(|(&trial, added)| {
            let series = &all[trial];
            let mut sums = Sums { before: [0.0; 6], after: [0.0; 6], count: series.t.len() as f64 };
            for (gap, added) in series.gap.iter().zip(added) {
                for &c in &setting.components {
                    sums.before[c] += gap[c].powi(2);
                    sums.after[c] += (gap[c] - added[c]).powi(2);
                }
            }
            sums
        })
        .collect();
    let mut random = Random::new(config.seed ^ 0xc105);
    let draws: Vec<Vec<Sums>> = (0..config.bootstrap)
        .map(|_| {
            (0..sums.len()).map(|_| sums[(random.unit() * sums.len() as f64) as usize].clone()).collect()
        })
        .collect();
    let closure = |components: &[usize], floor: f64, unit: bool| {
        let weight = |c: usize| if unit { 1.0 } else { floors[c].with_model().max(1e-12).powi(-2) };
        let sizes = |sums: &[Sums]| {
            let count = sums.iter().map(|s| s.count).sum::<f64>() * components.len() as f64;
            let rms = |of: &dyn Fn(&Sums, usize) -> f64| {
                let squares = sums.iter().flat_map(|s| components.iter().map(move |&c| (s, c)));
                (squares.map(|(s, c)| of(s, c) * weight(c)).sum::<f64>() / count.max(1.0)).sqrt()
            };
            (rms(&|s, c| s.before[c]), rms(&|s, c| s.after[c]))
        };
        let share = |(before, after): (f64, f64)| {
            (before > ABOVE * floor).then(|| (before - after) / (before - floor))
        };
        let (before, after) = sizes(&sums);
        let is_told = before > NEAR[0] * floor || after > NEAR[1] * floor;
        let closed = share((before, after)).filter(|_| is_told);
        let mut found: Vec<f64> = draws.iter().filter_map(|draw| share(sizes(draw))).collect();
        let interval = closed
            .filter(|_| sums.len() >= ENOUGH && found.len() * 2 > draws.len())
            .map(|_| [quantile(&mut found.clone(), 0.05), quantile(&mut found, 0.95)]);
        Closure { before, after, noise_floor: floor, closure: closed, interval }
    };
    let mut closures: BTreeMap<&'static str, Closure> =
        setting.components.iter().map(|&c| (WRENCH[c], closure(&[c], floors[c].total(), true))).collect();
    let noise = |c: usize| (floors[c].total() / floors[c].with_model().max(1e-12)).powi(2);
    let squares = setting.components.iter().map(|&c| noise(c)).sum::<f64>();
    let floor = (squares / setting.components.len().max(1) as f64).sqrt();
    closures.insert("all", closure(&setting.components, floor, false));
    closures
}

/// What is explained as naming saw it, where the model states how far it may be off: in rows without the share that its error has in
/// them. What was named is held to nothing that its naming did not look at.
pub(super) fn explained_of_rows(
    added: &[Column],
    all: &[Series],
    held: &[usize],
    judge: &Judge,
) -> Option<Explained> {
    let (noise, config) = (&judge.design.noise, judge.config);
    if !noise.model {
        return None;
    }
    let components = &judge.setting.components;
    let rows = Rows::new(all, held, components, config.block_s);
    let error = ModelError::new(all, held, components, noise);
    let squares = |value: &dyn Fn(usize) -> Column| -> Vec<f64> {
        let of_all = to_rows(all, &rows, held, components, (noise, &error), value);
        rows.of_trial.iter().map(|of| of_all[of.clone()].iter().map(|row| row * row).sum()).collect()
    };
    let left = |trial: usize| {
        let added = held.iter().zip(added).filter(|(of, _)| **of == trial).flat_map(|(_, added)| added);
        let less = |(gap, added): (&[f64; 6], &[f64; 6])| std::array::from_fn(|c| gap[c] - added[c]);
        all[trial].gap.iter().zip(added).map(less).collect()
    };
    let (before, after) = (squares(&|trial| all[trial].gap.clone()), squares(&left));
    let means = |trials: &[usize]| {
        let count = trials.iter().map(|&place| rows.of_trial[place].len() as f64).sum::<f64>().max(1.0);
        [&before, &after].map(|squares| trials.iter().map(|&place| squares[place]).sum::<f64>() / count)
    };
    let everything: Vec<usize> = (0..held.len()).collect();
    let [whole, whole_left] = means(&everything);
    let mut random = Random::new(config.seed ^ 0xc105);
    let mut closures: Vec<f64> = (0..config.bootstrap)
        .filter_map(|_| {
            let pick = || (random.unit() * held.len() as f64) as usize;
            let draw: Vec<usize> = std::iter::repeat_with(pick).take(held.len()).collect();
            let [before, after] = means(&draw).map(f64::sqrt);
            (before > ABOVE).then(|| (before - after) / (before - 1.0))
        })
        .collect();
    let is_enough = held.len() >= ENOUGH && closures.len() * 2 > config.bootstrap;
    let closes_at_most = is_enough.then(|| quantile(&mut closures, 0.95));
    Some(Explained { share: above_noise(whole, whole_left), closes_at_most })
}

/// Share that named effects explain where they act: of the squared gap above its noise in the samples and components of the held-out
/// trials that hold nine tenths of what they add, each in noise and what the model states of itself. None where they add less there than
/// matters beside the noise of a sample: trials without them say nothing of them.
pub(super) fn explained_where_acting(
    added: &[Column],
    all: &[Series],
    held: &[usize],
    (setting, floors): (&Setting, &[Floor; 6]),
    config: &Config,
) -> Option<f64> {
    let (mut energy, mut squares) = (Vec::new(), Vec::new());
    for (&trial, added) in held.iter().zip(added) {
        let series = &all[trial];
        // of a trial that is clearly louder than the others, its own
        let mut noise = floors.map(|floor| floor.total());
        for &c in &setting.components {
            let own = sample_noise(series, c);
            noise[c] = if own > LOUDER * noise[c] { own } else { noise[c] };
        }
        for (gap, added) in series.gap.iter().zip(added) {
            for &c in &setting.components {
                let weight = noise[c].hypot(floors[c].model).max(1e-12).powi(-2);
                energy.push(added[c].powi(2) * weight);
                squares.push([gap[c], gap[c] - added[c], noise[c]].map(|x| x * x * weight));
            }
        }
    }
    share_where_acting(&energy, &squares, config.relevance)
}

/// The same of squares of what is added to each value, and of its gap before and after and of its noise.
fn share_where_acting(added: &[f64], squares: &[[f64; 3]], relevance: f64) -> Option<f64> {
    let acting = informative(added);
    let sum = |of: usize| acting.iter().map(|&value| squares[value][of]).sum::<f64>();
    let [before, after, noise] = [0, 1, 2].map(sum);
    let adds = acting.iter().map(|&value| added[value]).sum::<f64>();
    let matters = adds > relevance.powi(2) * noise;
    matters.then(|| (before - after) / (before - noise).max(f64::MIN_POSITIVE))
}

/// Share that is explained of what stands above the noise, of mean squares in units of it.
fn above_noise(before: f64, after: f64) -> f64 {
    (before - after) / (before - 1.0).max(f64::MIN_POSITIVE)
}

impl std::fmt::Display for Worse {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { place, component, before, after } = self;
        let of = component.map_or_else(String::new, |component| format!(" of {component}"));
        write!(f, "the gap{of} grows from {before:.1} to {after:.1} noise floors ({place})")
    }
}

/// What of the trials kept back a gap is looked at in: all components together, then each by itself.
struct Point {
    features: Features,
    /// Squares in floors, each with what the model states of itself.
    before: Vec<f64>,
    after: Vec<f64>,
}

/// Regions, thirds of depth and speed, and all of them, where the gap of the trials kept back grows by more than a twentieth: of
/// all components together or of one of them.
pub(super) fn worse(
    named: &[Named],
    all: &[Series],
    held: &[usize],
    setting: &Setting,
    floors: &[Floor; 6],
    regions: &[Region],
) -> Vec<Worse> {
    /// Squared floors by which it must grow, in the mean of all components and of one alone: a fraction of the floor more is no
    /// harm that anyone could measure, and of several components chance picks the worst.
    const HARM: [f64; 2] = [0.05, 0.25];
    let components = &setting.components;
    let mut points: Vec<Point> = Vec::new();
    for &trial in held {
        let series = &all[trial];
        let added = explained(named, series, trial, setting);
        let squares = |value: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
            let of =
                |&c: &usize| series.binned(|i| (value(i, c) / floors[c].with_model().max(1e-12)).powi(2));
            components.iter().map(of).collect()
        };
        let before = squares(&|i, c| series.gap[i][c]);
        let after = squares(&|i, c| series.gap[i][c] - added[i][c]);
        let at = |squares: &[Vec<f64>], bin: usize| squares.iter().map(|of| of[bin]).collect();
        points.extend(of_bins(series).into_iter().enumerate().map(|(bin, features)| Point {
            features,
            before: at(&before, bin),
            after: at(&after, bin),
        }));
    }
    let mut worse = Vec::new();
    for (place, limits) in places(&points, regions) {
        let within: Vec<&Point> = points.iter().filter(|point| inside(&limits, &point.features)).collect();
        if within.len() < LEAST {
            continue;
        }
        let mean =
            |of: &dyn Fn(&Point) -> f64| within.iter().map(|p| of(p)).sum::<f64>() / within.len() as f64;
        let whole = |of: &[f64]| of.iter().sum::<f64>() / of.len().max(1) as f64;
        let together = (None, mean(&|p| whole(&p.before)), mean(&|p| whole(&p.after)), HARM[0]);
        let alone = components.iter().enumerate().map(|(index, &c)| {
            (Some(WRENCH[c]), mean(&|p| p.before[index]), mean(&|p| p.after[index]), HARM[1])
        });
        for (component, before, after, harm) in std::iter::once(together).chain(alone) {
            if after.sqrt() > (1.0 + WORSE) * before.sqrt() && after - before > harm {
                let [before, after] = [before, after].map(f64::sqrt);
                worse.push(Worse { place: place.clone(), component, before, after });
            }
        }
    }
    worse
}

/// Fewest bins of a place.
const LEAST: usize = 5;

/// The regions, the thirds of depth and speed, and everywhere, in words and as limits.
fn places(points: &[Point], regions: &[Region]) -> Vec<(String, Limits)> {
    let mut places: Vec<(String, Limits)> =
        regions.iter().map(|region| (region.place.clone(), region.limits)).collect();
    for (feature, name) in [(0, "depth"), (2, "speed")] {
        let mut values: Vec<f64> = points.iter().map(|point| point.features[feature]).collect();
        let cuts = [quantile(&mut values.clone(), 1.0 / 3.0), quantile(&mut values, 2.0 / 3.0)];
        let thirds = [[f64::NEG_INFINITY, cuts[0]], cuts, [cuts[1], f64::INFINITY]];
        for (third, range) in ["lowest", "middle", "highest"].into_iter().zip(thirds) {
            let mut limits = OPEN;
            limits[feature] = range;
            places.push((format!("{third} third of {name}"), limits));
        }
    }
    places.push(("all held-out trials".to_owned(), OPEN));
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_disproved_where_little_is_explained_and_what_is_left_is_loud() {
        let of = |before: f64, after: f64| {
            let closure = Closure { before, after, noise_floor: 1.0, closure: None, interval: None };
            closure.disproof(closure.explained(), 0.6, false)
        };
        // (85^2 - 57^2) / (85^2 - 1)
        assert!(of(85.0, 57.0).is_some_and(|share| (share - 0.5504).abs() < 1e-4));
        assert_eq!(of(85.0, 40.0), None, "most of it is explained");
        assert_eq!(of(2.1, 1.9), None, "what is left is hardly larger than the noise");
        let fault = |high: f64| {
            let interval = Some([0.4, high]);
            let closure = Closure { before: 1.2, after: 1.1, noise_floor: 1.0, closure: Some(0.5), interval };
            closure.disproof(closure.explained(), 0.6, true)
        };
        assert!(fault(0.64).is_some() && fault(0.82).is_none(), "a zero that is off explains all of it");
    }

    #[test]
    fn the_share_where_effects_act_is_that_of_the_gap_there() {
        // 3 of what is 5 in the first tenth of the values, with 1 of noise; elsewhere a gap that is none of theirs
        let added: Vec<f64> = (0..100).map(|i| if i < 10 { 9.0 } else { 0.0 }).collect();
        let squares = |left: f64| -> Vec<[f64; 3]> {
            (0..100).map(|i| if i < 10 { [26.0, left, 1.0] } else { [900.0, 900.0, 1.0] }).collect()
        };
        let share = |left: f64, relevance: f64| share_where_acting(&added, &squares(left), relevance);
        assert_eq!(share(1.0, 0.08), Some(1.0));
        assert_eq!(share(17.0, 0.08), Some(0.36));
        assert!(share(30.0, 0.08).is_some_and(|share| share < 0.0), "it makes the gap there larger");
        assert_eq!(share(17.0, 3.1), None, "too little beside the noise to say");
        assert_eq!(share_where_acting(&[0.0; 100], &squares(1.0), 0.08), None);
    }
}
