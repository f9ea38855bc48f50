//! Trials that cannot be what they are said to be, as far as the prediction beside them tells.

use std::ops::Range;

use super::GapError;
use super::noise::sample_noise;
use super::series::Series;
use super::smoothing::bins;
use super::statistics::quantile;
use wade_core::effects::Immersion;
use wade_core::frame::GRAVITY;
use wade_learn::trials::WRENCH;

/// Fewest samples in which a channel that never changes is told from one that happens not to.
const ENOUGH: usize = 20;
/// Share of the size of a prediction by which it must change where a dead channel is to show, ...
const CHANGES: f64 = 0.1;
/// ... and how many times the noise of a sample, where samples of single trials or values are held against it.
const CLEARLY: f64 = 3.0;
/// A number a thousand times as large or as small, and the factor by which a prediction may be off beside it.
const THOUSAND: f64 = 1000.0;
const OFF: f64 = 1.6;
/// Newtons of a pound and of a kilogram of force, the factor by which a prediction may be off beside these, which are nearer to one,
/// and the correlation that they need: a current that is not known scales the drag as well, but not in the same way in all trials,
/// which are looked at together. A pound foot is too near a newton meter to be known from it.
const POUND_N: f64 = 4.448_222;
const KILOGRAM_N: f64 = 9.806_65;
const INCH: f64 = 0.0254;
const NEARLY: f64 = 1.35;
const SAME_UNIT: f64 = 0.95;
/// Kilograms of a pound.
const POUND_KG: f64 = 0.453_592_37;
/// Known forces and masses as many times what is written, and what they seem to be.
const FORCES: [(f64, &str); 4] = [
    (THOUSAND, "are they in kN? They must be in N"),
    (POUND_N, "are they in lbf? They must be in N"),
    (KILOGRAM_N, "are they in kgf? They must be in N"),
    (-1.0, "is their sign reversed? A force that drives forward is positive"),
];
const MASSES: [(f64, &str); 3] = [
    (POUND_KG, "is it in lb? It must be in kg"),
    (1.0 / THOUSAND, "is it in g? It must be in kg"),
    (THOUSAND, "is it in t? It must be in kg"),
];
/// Length of the means over which a motion is compared with the known forces [s]: noise of a recorded place hardly reaches into them.
const SLOW: f64 = 1.0;
/// Share by which what a channel is off may differ from the weight of the vehicle.
const OF_WEIGHT: f64 = 0.05;
/// Correlation with the prediction from which a factor between the two is one, and from which it says that a sign is reversed:
/// a current that is not known turns the drag of some trials about, but does not mirror it.
const SAME: f64 = 0.7;
const MIRRORED: f64 = -0.85;
/// An end of the range of a channel is its stop where it holds this many times the samples of the value beside it.
const STOP: usize = 10;
/// Times by which two channels must come closer to what is expected where they are taken for each other.
const SWAPPED: f64 = 10.0;
/// Times the noise that three quarters of the trials stay below, beyond which that of one is no noise of the sensor, ...
const LOUD: f64 = 4.0;
/// ... where it is at most this share of the trials: more of them are another kind of trial.
const FEW: f64 = 0.1;

/// What all trials together are called.
const ALL: &str = "every trial";

/// What one component measured and what is expected of it.
struct Channel<'a> {
    component: usize,
    trials: Vec<Recorded<'a>>,
    /// Root mean square of what is expected [N or N m].
    size: f64,
    /// Noise of a sample that three quarters of the trials stay below [N or N m].
    noise: f64,
}

/// A channel in one trial.
struct Recorded<'a> {
    trial: &'a str,
    pairs: Vec<Pair>,
    /// Time of each sample [s].
    times: &'a [f64],
    /// Mean square of the deviation that the model states [N2 or N2 m2].
    doubt: f64,
}

/// Measured and expected [N or N m].
type Pair = [f64; 2];

/// Refuses trials without water, trials of the same samples, and measured channels that never change where they should or stop to,
/// stop short of it, stand in for each other, have their sign reversed, hold the weight of the vehicle, or are in another unit.
pub(super) fn check(all: &[Series], components: &[usize], inferred: bool, mass: f64) -> Result<(), GapError> {
    let is_wet = |immersion: &Immersion| {
        immersion.volume > 0.0 || immersion.panels.iter().any(|panel| panel.fraction > 0.0)
    };
    if !all.iter().flat_map(|series| &series.immersions).any(is_wet) {
        let depths = all.iter().flat_map(|series| &series.conditions).map(|condition| condition.depth);
        return Err(GapError::Dry { depth: depths.fold(f64::NEG_INFINITY, f64::max) });
    }
    for (index, series) in all.iter().enumerate() {
        let is_same = |other: &&Series| {
            series.t.len() >= ENOUGH && other.gap == series.gap && other.seen == series.seen
        };
        if let Some(other) = all[..index].iter().find(is_same) {
            return Err(GapError::SameTrial { trial: series.name.clone(), other: other.name.clone() });
        }
    }
    // what is inferred is no channel, and in the unit of the mass
    if inferred {
        return components.iter().filter(|c| **c < 3).try_for_each(|&axis| check_driven(all, axis));
    }
    let channels: Vec<Channel> = components.iter().map(|&component| Channel::new(all, component)).collect();
    channels.iter().filter(|channel| channel.component == 2).try_for_each(|fz| fz.check_weight(mass))?;
    for channel in &channels {
        channel.check()?;
    }
    for (index, a) in channels.iter().enumerate() {
        let rest = channels[index + 1..].iter().filter(|b| a.component / 3 == b.component / 3);
        rest.into_iter().try_for_each(|b| a.check_apart(b))?;
    }
    Ok(())
}

/// Refuses known forces and masses in another unit: what moves the vehicle, less the known forces, is what is expected of the water.
fn check_driven(all: &[Series], axis: usize) -> Result<(), GapError> {
    let of = |value: &dyn Fn(&Series, usize) -> f64| -> Vec<f64> {
        all.iter().flat_map(|series| bins(series, SLOW, |sample| value(series, sample))).collect()
    };
    let expected = of(&|series, i| series.seen[i][axis]);
    let known = of(&|series, i| series.other[i][axis]);
    let moving = of(&|series, i| series.gap[i][axis] + series.seen[i][axis] + series.other[i][axis]);
    let whole: f64 = expected.iter().map(|expected| expected * expected).sum();
    // squares that are left of what is expected, which may be off as a prediction is
    let left = |of_mass: f64, of_known: f64| -> f64 {
        let given = moving.iter().zip(&known).map(|(m, k)| of_mass * m - of_known * k);
        let pairs: Vec<Pair> = given.zip(&expected).map(|(given, expected)| [given, *expected]).collect();
        let [gg, ge, _] = products(&pairs);
        let scale = (ge / gg.max(f64::MIN_POSITIVE)).clamp(1.0 / OFF, OFF);
        whole - 2.0 * scale * ge + scale * scale * gg
    };
    let as_written = left(1.0, 1.0);
    let forces =
        FORCES.map(|(factor, suspected)| (left(1.0, factor), "measured.other_forces", factor, suspected));
    let masses = MASSES.map(|(factor, suspected)| (left(factor, 1.0), "mass", factor, suspected));
    let nearest = forces.into_iter().chain(masses).min_by(|a, b| a.0.total_cmp(&b.0));
    // what is expected must be in what is given, but for what two numbers that say the same may differ by
    let is_found = |left: f64| left < (1.0 - SAME * SAME) * whole && as_written > SWAPPED * left;
    match nearest.filter(|(left, ..)| is_found(*left)) {
        Some((_, what, factor, suspected)) => {
            Err(GapError::Driven { column: WRENCH[axis], what, factor, suspected })
        }
        None => Ok(()),
    }
}

/// Few trials with far more noise than the others, which may hide what these show.
pub(super) fn remarks(all: &[Series], components: &[usize]) -> Vec<String> {
    let of = |&component: &usize| {
        let noises: Vec<f64> = all.iter().map(|series| sample_noise(series, component)).collect();
        let usual = usual(&noises);
        let most = noises.iter().copied().fold(0.0, f64::max);
        let loud = noises.iter().filter(|noise| **noise > LOUD * usual).count();
        let trial = noises.iter().position(|noise| *noise == most)?;
        let is_few = loud == 1 || loud as f64 <= FEW * all.len() as f64;
        (usual > 0.0 && loud > 0 && is_few).then(|| {
            format!(
                "{}: {loud} of {} trials have up to {:.1} times the noise of the others, most of all {}: if their recording was damaged, leave them out",
                WRENCH[component],
                all.len(),
                most / usual,
                all[trial].name,
            )
        })
    };
    components.iter().filter_map(of).collect()
}

impl<'a> Channel<'a> {
    fn new(all: &'a [Series], component: usize) -> Self {
        let pairs = |series: &Series| -> Vec<Pair> {
            let samples = series.seen.iter().zip(&series.gap);
            samples.map(|(seen, gap)| [gap[component] + seen[component], seen[component]]).collect()
        };
        let recorded = |series: &'a Series| {
            let squares = series.uncertainty.iter().map(|deviation| deviation[component].powi(2));
            let doubt = squares.sum::<f64>() / series.t.len().max(1) as f64;
            Recorded { trial: &series.name, pairs: pairs(series), times: &series.t, doubt }
        };
        let trials: Vec<Recorded> = all.iter().map(recorded).collect();
        let expected = trials.iter().flat_map(|of| of.pairs.iter().map(|[_, p]| p * p));
        let count = trials.iter().map(|of| of.pairs.len()).sum::<usize>().max(1);
        let size = (expected.sum::<f64>() / count as f64).sqrt();
        let noises: Vec<f64> = all.iter().map(|series| sample_noise(series, component)).collect();
        Self { component, trials, size, noise: usual(&noises) }
    }

    fn column(&self) -> &'static str {
        WRENCH[self.component]
    }

    /// The unit, and those in which a number is a thousand times as large and as small.
    fn units(&self) -> (&'static str, &'static str, &'static str) {
        if self.component < 3 { ("N", "mN", "kN") } else { ("N m", "N mm", "kN m") }
    }

    /// True for a change of what is expected that a channel cannot but show.
    fn is_clear(&self, spread: f64) -> bool {
        spread > CHANGES * self.size && spread > CLEARLY * self.noise
    }

    /// All trials together, then each alone.
    fn check(&self) -> Result<(), GapError> {
        let all: Vec<Pair> = self.trials.iter().flat_map(|of| of.pairs.iter().copied()).collect();
        let doubt = self.trials.iter().map(|of| of.doubt * of.pairs.len() as f64).sum::<f64>();
        self.check_unit(ALL, &all)?;
        self.check_pairs(ALL, &all, doubt / all.len().max(1) as f64)?;
        self.trials.iter().try_for_each(|Recorded { trial, pairs, times, doubt }| {
            let [_, _, pp] = products(pairs);
            let place = format!("{trial}.csv");
            if pairs.len() >= ENOUGH && self.is_clear((pp / pairs.len() as f64).sqrt()) {
                self.check_unit(&place, pairs)?;
            }
            self.check_pairs(&place, pairs, *doubt)?;
            self.check_live(place, pairs, times)
        })
    }

    /// Refuses a vertical force that is off what is expected by the weight of the vehicle.
    fn check_weight(&self, mass: f64) -> Result<(), GapError> {
        let weight = mass * GRAVITY;
        let off = |of: &Recorded| {
            of.pairs.iter().map(|[measured, expected]| measured - expected).sum::<f64>()
                / of.pairs.len().max(1) as f64
        };
        let offs: Vec<f64> = self.trials.iter().map(off).collect();
        let is_weight = |off: &f64| (off.abs() / weight - 1.0).abs() < OF_WEIGHT;
        let is_one_sign = offs.iter().all(|off| off.signum() == offs[0].signum());
        if weight > 0.0 && is_one_sign && offs.iter().all(is_weight) {
            let off = offs.iter().sum::<f64>() / offs.len() as f64;
            return Err(GapError::Weight { column: self.column(), off, mass, weight });
        }
        Ok(())
    }

    /// True of one recorded value: a gap is a difference, and adding the prediction to it again leaves an error of rounding.
    fn is_same(&self, a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9 * self.size.max(a.abs())
    }

    /// Refuses a channel that keeps one value from some sample on while what is expected goes on.
    fn check_live(&self, place: String, pairs: &[Pair], times: &[f64]) -> Result<(), GapError> {
        for run in chunks(pairs, |a, b| self.is_same(a[0], b[0])) {
            let spread = spread(&pairs[run.clone()]);
            if run.len() >= ENOUGH && self.is_clear(spread) {
                let (value, from, count) = (pairs[run.start][0], times[run.start], run.len());
                let (column, unit) = (self.column(), self.units().0);
                return Err(GapError::Stopped { place, column, from, count, value, spread, unit });
            }
        }
        Ok(())
    }

    fn check_unit(&self, place: &str, pairs: &[Pair]) -> Result<(), GapError> {
        let ((unit, larger, smaller), place) = (self.units(), place.to_owned());
        let [mm, mp, pp] = products(pairs);
        let ratio = mp.abs() / pp.max(f64::MIN_POSITIVE);
        let is_near = |factor: f64| is_about(ratio / factor);
        let correlation = mp.abs() / (mm * pp).sqrt().max(f64::MIN_POSITIVE);
        let thousands =
            [(THOUSAND, larger), (1.0 / THOUSAND, smaller)].into_iter().find(|(f, _)| is_near(*f));
        let is_nearly = |factor: f64| (1.0 / NEARLY..NEARLY).contains(&(ratio / factor));
        let weights: &[(f64, &'static str)] = match self.component {
            0..3 => &[(1.0 / POUND_N, "lbf"), (1.0 / KILOGRAM_N, "kgf")],
            _ => &[(1.0 / KILOGRAM_N, "kgf m"), (100.0, "N cm"), (1.0 / POUND_N / INCH, "lbf in")],
        };
        let weights = weights.iter().copied().find(|(factor, _)| is_nearly(*factor));
        let is_sure = mp > 0.0 && correlation > SAME_UNIT && place == ALL;
        let other = thousands.filter(|_| correlation > SAME).or(weights.filter(|_| is_sure));
        match other {
            Some((_, other)) => Err(GapError::Unit { place, column: self.column(), ratio, unit, other }),
            None => Ok(()),
        }
    }

    fn check_pairs(&self, place: &str, pairs: &[Pair], doubt: f64) -> Result<(), GapError> {
        if pairs.len() < ENOUGH {
            return Ok(());
        }
        let (column, unit, place) = (self.column(), self.units().0, place.to_owned());
        let whole = spread(pairs);
        let first = pairs[0][0];
        if pairs.iter().all(|[measured, _]| self.is_same(first, *measured)) && self.is_clear(whole) {
            return Err(GapError::Dead { place, column, value: first, spread: whole, unit });
        }
        let [_, mp, pp] = products(pairs);
        // a sign that is reversed is an error of twice what is expected
        let is_beyond_doubt = 4.0 * pp > CLEARLY.powi(2) * doubt * pairs.len() as f64;
        if self.is_clear(whole) && is_beyond_doubt && is_mirrored(pairs) {
            return Err(GapError::Reversed { place, column, ratio: mp / pp });
        }
        match self.stop(pairs) {
            Some((value, count, spread)) => {
                Err(GapError::Saturated { place, column, value, count, spread, unit })
            }
            None => Ok(()),
        }
    }

    /// An end of its range at which a channel stands while what is expected goes on: the value, how many samples have it, and
    /// the standard deviation of what is expected in them.
    fn stop(&self, pairs: &[Pair]) -> Option<(f64, usize, f64)> {
        let mut sorted = pairs.to_vec();
        sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let of_end = |sorted: &[Pair]| {
            let near = |from: f64| move |pair: &&Pair| (pair[0] - from).abs() <= 1e-9 * from.abs();
            let first = sorted[0][0];
            let count = sorted.iter().take_while(near(first)).count();
            let rest = &sorted[count..];
            let next = rest.first().map_or(0, |[next, _]| rest.iter().take_while(near(*next)).count());
            let spread = spread(&sorted[..count]);
            // at rest, and in the air, a computed load is exactly nothing
            let stands = first != 0.0 && count >= ENOUGH && count >= STOP * next && next > 0;
            (stands && self.is_clear(spread)).then_some((first, count, spread))
        };
        of_end(&sorted).or_else(|| {
            sorted.reverse();
            of_end(&sorted)
        })
    }

    /// Refuses two channels that are one, or that stand in for each other, in all trials or in one.
    fn check_apart(&self, other: &Self) -> Result<(), GapError> {
        let both = || self.trials.iter().zip(&other.trials).flat_map(|(a, b)| a.pairs.iter().zip(&b.pairs));
        let changes = both().any(|([a, _], _)| !self.is_same(*a, 0.0));
        if changes && both().all(|([a, _], [b, _])| self.is_same(*a, *b)) {
            return Err(GapError::Copied { column: self.column(), other: other.column() });
        }
        // how far the two are from what is expected of them, and from what is expected of each other
        let sums = |(ours, theirs): (&Recorded, &Recorded)| {
            // within what noise and an error of the model make of channels of which nothing is expected
            let least = self.noise.powi(2) + other.noise.powi(2) + ours.doubt + theirs.doubt;
            let pairs = ours.pairs.iter().zip(&theirs.pairs);
            pairs.fold([0.0; 3], |[apart, swapped, sum], ([a, of_a], [b, of_b])| {
                let square = |x: f64, y: f64| x * x + y * y;
                [apart + square(a - of_a, b - of_b), swapped + square(a - of_b, b - of_a), sum + least]
            })
        };
        let of_trials: Vec<[f64; 3]> = self.trials.iter().zip(&other.trials).map(sums).collect();
        let all = of_trials.iter().fold([0.0; 3], |sum, of| std::array::from_fn(|i| sum[i] + of[i]));
        let is_swapped = |[apart, swapped, least]: [f64; 3]| apart > SWAPPED * swapped.max(least);
        let place = match of_trials.iter().position(|of| is_swapped(*of)) {
            _ if is_swapped(all) => ALL.to_owned(),
            Some(trial) => format!("{}.csv", self.trials[trial].trial),
            None => return Ok(()),
        };
        Err(GapError::Swapped { place, column: self.column(), other: other.column() })
    }
}

/// Runs of neighbors that are alike.
fn chunks(pairs: &[Pair], alike: impl Fn(&Pair, &Pair) -> bool) -> Vec<Range<usize>> {
    let mut start = 0;
    pairs
        .chunk_by(alike)
        .map(|chunk| {
            let from = start;
            start += chunk.len();
            from..start
        })
        .collect()
}

/// The noise that three quarters of some trials stay below.
fn usual(noises: &[f64]) -> f64 {
    quantile(&mut noises.to_vec(), 0.75)
}

/// Sums of squares and products: measured, both, expected.
fn products(pairs: &[Pair]) -> [f64; 3] {
    pairs.iter().fold([0.0; 3], |[mm, mp, pp], [m, p]| [mm + m * m, mp + m * p, pp + p * p])
}

/// The same pairs about their means.
fn centered(pairs: &[Pair]) -> Vec<Pair> {
    let count = pairs.len().max(1) as f64;
    let mean = [0, 1].map(|i| pairs.iter().map(|pair| pair[i]).sum::<f64>() / count);
    pairs.iter().map(|[m, p]| [m - mean[0], p - mean[1]]).collect()
}

/// Standard deviation of what is expected.
fn spread(pairs: &[Pair]) -> f64 {
    let [_, _, pp] = products(&centered(pairs));
    (pp / pairs.len().max(1) as f64).sqrt()
}

/// True where what was measured is what is expected with the other sign, in its mean and in its changes: a zero that is off may
/// turn the one about and not the other.
fn is_mirrored(pairs: &[Pair]) -> bool {
    let is_opposite = |pairs: &[Pair]| {
        let [mm, mp, pp] = products(pairs);
        mp < MIRRORED * (mm * pp).sqrt() && is_about(-mp / pp.max(f64::MIN_POSITIVE))
    };
    is_opposite(pairs) && is_opposite(&centered(pairs))
}

/// True for a factor that is one but for what a prediction may be off by.
fn is_about(factor: f64) -> bool {
    (1.0 / OFF..OFF).contains(&factor)
}
