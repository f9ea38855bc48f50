//! Rates of a motion as predictors of the true ones.
//!
//! A law in proportion to a rate that was differentiated from a noisy motion comes out too small, since part of the rate is
//! noise, and trials that hold noise alone weigh as much as those that move. Each rate of each trial is therefore scaled by
//! `E[true x recorded] / E[recorded^2]` of what goes into the regression, means of smoothed bins
//! (regression calibration; Carroll, Ruppert, Stefanski, Crainiceanu, Measurement Error in Nonlinear Models, chapter 4), so
//! that what is left is as large as the true rate where that can be said, and 0 where it cannot.
//!
//! Of several forms, the record, the record smoothed over a quarter and half a second, and the bursts of the record, the one
//! that keeps most of the signal is taken: of calibrated predictors it is the closest to the truth.

use std::cell::OnceCell;
use std::ops::Range;

use super::rates::{Autocovariance, mean_square, mean_step, set_rate, smooth, window};
use super::series::Series;
use super::smoothing::{LENGTHS, Smoothing, bins, half, running_mean, samples_of_bin};
use super::statistics::median;
use wade_learn::signal::SavitzkyGolay;

/// Windows of the forms [s].
const WINDOWS: [Option<f64>; 3] = [None, Some(0.25), Some(0.45)];
/// Mean product over that of noise alone from which a trial is held to move.
const MOVING: f64 = 2.0;
/// The same for a bin and its neighbors.
const BURST: f64 = 8.0;
/// Share of the most that any form keeps with which a smoother one is as good.
const AS_MUCH: f64 = 0.95;
/// How much more bursts must keep than a form of the whole trial, since they are sought out.
const MORE: f64 = 1.2;
/// Most that smoothing can have taken off.
const MOST: f64 = 1.5;
/// Length of a stretch that may be quiet [s], and as many lengths of a running mean more, which makes noise last longer.
const STRETCH: [f64; 2] = [0.5, 2.0];
/// Share of noise in a rate, where trials move, that rows may have.
const SMALL: f64 = 0.2;
/// Mean square of the bins at the ends over that of the others from which on filters have made the ends.
const ENDS: f64 = 4.0;

/// Calibrates the rates of all trials and says by how much rows are smoothed: each component as little as leaves a small share
/// of noise in its rate.
pub(super) fn calibrate(all: &mut [Series]) -> Smoothing {
    all.iter_mut().for_each(|series| series.calibrated.clone_from(&series.conditions));
    let mut smoothing = Smoothing::default();
    for rate in 0..6 {
        let ends = !ends_are_noise(all, rate);
        let tried = |&length: &f64| Tried::new(all, rate, length, ends);
        let mut tried: Vec<Tried> = LENGTHS.iter().map(tried).collect();
        let chosen = tried.iter().position(|tried| tried.share < SMALL).unwrap_or_else(|| {
            let least = |a: &usize, b: &usize| tried[*a].share.total_cmp(&tried[*b].share);
            (0..tried.len()).min_by(least).unwrap_or_default()
        });
        let Tried { length, forms, noise, .. } = tried.swap_remove(chosen);
        smoothing.0[rate] = length;
        for (series, forms) in all.iter_mut().zip(&forms) {
            let factors = forms.iter().zip(noise).map(|(form, noise)| (form, form.factor(noise)));
            let kept = |(form, factor): &(&Form, f64)| factor * factor * form.square;
            let most = factors.clone().map(|form| kept(&form)).fold(0.0, f64::max);
            // the smoothest, which leaves least noise in a sample
            let Some((form, factor)) = factors.rev().find(|form| kept(form) >= AS_MUCH * most) else {
                continue;
            };
            let mut values: Vec<f64> = form.values.iter().map(|value| value * factor).collect();
            let bursts = bursts(series, &forms[0], noise[0]);
            if mean_square(&bins(series, length, |i| bursts[i])) > MORE * kept(&(form, factor)) {
                values = bursts;
            }
            let conditions = series.calibrated.iter_mut().zip(values);
            conditions.for_each(|(condition, value)| set_rate(condition, rate, value));
        }
    }
    smoothing
}

/// A rate of all trials for rows that are smoothed over some length.
struct Tried {
    length: f64,
    forms: Vec<[Form; 3]>,
    /// Mean product of noise alone, by form.
    noise: [f64; 3],
    /// Share of noise in the record of the trials that move; without end where none does.
    share: f64,
}

impl Tried {
    fn new(all: &[Series], rate: usize, length: f64, ends: bool) -> Self {
        let form = |series: &Series| WINDOWS.map(|window| Form::new(series, rate, window, length, ends));
        let forms: Vec<[Form; 3]> = all.iter().map(form).collect();
        let signals = vec![OnceCell::new(); all.len()];
        let noise = [0, 1, 2].map(|form| noise(all, &forms, &signals, form, length));
        let records = forms.iter().map(|forms| forms[0].product);
        let moving: Vec<f64> = records.filter(|product| *product > MOVING * noise[0]).collect();
        let share = noise[0] * moving.len() as f64 / moving.iter().sum::<f64>();
        Self { length, forms, noise, share: if moving.is_empty() { f64::INFINITY } else { share } }
    }
}

/// A rate of a trial in one form.
struct Form {
    /// A value a sample.
    values: Vec<f64>,
    /// The record's bins.
    bins: Vec<f64>,
    /// Mean product of the bins of the record and of this form.
    product: f64,
    /// Mean square of the bins of this form.
    square: f64,
    /// The products, a mean a stretch.
    stretches: Vec<f64>,
}

impl Form {
    fn new(series: &Series, rate: usize, window: Option<f64>, length: f64, ends: bool) -> Self {
        let mut recorded: Vec<f64> = series.recorded_rates.iter().map(|rates| rates[rate]).collect();
        for bin in series.runs.iter().flat_map(|run| [run.start, run.end - 1]).filter(|_| !ends) {
            recorded[series.bins[bin].clone()].fill(0.0);
        }
        let mut values = recorded.clone();
        if let Some(window) = window {
            series.pieces().for_each(|piece| smooth(&series.t, &mut values, piece, window));
        }
        let (bins, own) = (bins(series, length, |i| recorded[i]), bins(series, length, |i| values[i]));
        let products: Vec<f64> = bins.iter().zip(&own).map(|(a, b)| a * b).collect();
        let step = series.bin_step();
        let stretch = STRETCH[0] + STRETCH[1] * length;
        let stretch = (stretch / step.max(1e-6)).round().max(3.0) as usize;
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let runs = series.runs.iter().flat_map(|run| products[run.clone()].chunks_exact(stretch));
        Self {
            product: mean(&products),
            square: mean_square(&own),
            stretches: runs.map(mean).collect(),
            values,
            bins,
        }
    }

    /// Share of signal in the values, more where smoothing took peaks off, with noise of so large a mean product.
    fn factor(&self, noise: f64) -> f64 {
        if self.product <= MOVING * noise {
            return 0.0;
        }
        ((self.product - noise) / self.square.max(f64::MIN_POSITIVE)).clamp(0.0, MOST)
    }
}

/// True where the rates at the ends of trials are noise: a polynomial is steep where its window ends.
fn ends_are_noise(all: &[Series], rate: usize) -> bool {
    let (mut outer, mut inner) = (Vec::new(), Vec::new());
    for series in all {
        let bins = series.binned(|i| series.recorded_rates[i][rate]);
        for run in series.runs.iter().filter(|run| run.len() > 4) {
            outer.push(mean_square(&[bins[run.start], bins[run.end - 1]]));
            inner.push(mean_square(&bins[run.start + 1..run.end - 1]));
        }
    }
    !outer.is_empty() && median(&mut outer) > ENDS * median(&mut inner)
}

/// Mean product of noise alone, which one instrument gives all trials: as it is where they are quiet, or as what does not
/// last in them says where they never are.
fn noise(
    all: &[Series],
    forms: &[[Form; 3]],
    signals: &[OnceCell<Autocovariance>],
    form: usize,
    length: f64,
) -> f64 {
    /// Share of the median trial's product below which a stretch is quiet.
    const QUIET: f64 = 0.25;
    let of_form = || forms.iter().map(|trial| &trial[form]);
    let quiet = quiet(forms, form);
    if quiet < QUIET * median(&mut of_form().map(|form| form.product).collect::<Vec<_>>()) {
        return quiet;
    }
    let of = |(trial, series): (usize, &Series)| {
        let recorded = &forms[trial][0].values;
        let signal = signals[trial].get_or_init(|| signal(series, recorded, length));
        forms[trial][form].product - lasting(series, signal, WINDOWS[form], length)
    };
    quiet.min(at_most(all.iter().enumerate().map(of).collect()))
}

/// Upper bound of the middle of some values that scatter: their median and two of its standard errors.
fn at_most(mut values: Vec<f64>) -> f64 {
    /// Of a normal distribution, over its median absolute deviation.
    const STD: f64 = 1.4826;
    let middle = median(&mut values);
    let deviation = median(&mut values.iter().map(|value| (value - middle).abs()).collect::<Vec<_>>());
    (middle + 2.0 * STD * deviation / (values.len() as f64).sqrt()).max(0.0)
}

/// Mean product of the third of all stretches in which the record is quietest, and as much again and a half, since of
/// stretches of noise alone the quietest are quieter than the mean.
fn quiet(forms: &[[Form; 3]], form: usize) -> f64 {
    const TIMES: f64 = 2.5;
    let both = |trial: &[Form; 3]| -> Vec<(f64, f64)> {
        trial[0].stretches.iter().copied().zip(trial[form].stretches.iter().copied()).collect()
    };
    let mut stretches: Vec<(f64, f64)> = forms.iter().flat_map(both).collect();
    if stretches.len() < 3 {
        return f64::INFINITY;
    }
    stretches.sort_by(|a, b| a.0.total_cmp(&b.0));
    let third = &stretches[..stretches.len() / 3];
    (TIMES * third.iter().map(|(_, product)| product).sum::<f64>() / third.len() as f64).max(0.0)
}

/// The record where it is louder than noise, each bin scaled by the share of signal in it and its neighbors.
fn bursts(series: &Series, record: &Form, noise: f64) -> Vec<f64> {
    let mut scaled = vec![0.0; record.values.len()];
    for run in &series.runs {
        for bin in run.clone() {
            let near = bin.saturating_sub(1).max(run.start)..(bin + 2).min(run.end);
            let power = mean_square(&record.bins[near]);
            if power > BURST * noise {
                let share = 1.0 - noise / power;
                series.bins[bin].clone().for_each(|i| scaled[i] = share * record.values[i]);
            }
        }
    }
    scaled
}

/// The signal in a record, as far as any of the forms reaches.
fn signal(series: &Series, recorded: &[f64], length: f64) -> Autocovariance {
    let pieces: Vec<Range<usize>> = series.pieces().collect();
    let longest = WINDOWS.map(|window| both_ways(series, window, length)).into_iter().max();
    Autocovariance::new(mean_step(&series.t), &pieces, recorded, longest.unwrap_or_default())
}

/// Samples of a window over which a record is smoothed: no more than a run without a hole has.
fn window_of(series: &Series, window_s: Option<f64>) -> usize {
    let odd = (longest_run(series) - 1) / 2 * 2 + 1;
    window_s.map_or(1, |window_s| window(window_s, mean_step(&series.t)).min(odd))
}

/// Samples to either side of a running mean: no more than a run without a hole has.
fn half_of(series: &Series, length: f64) -> usize {
    half(length, mean_step(&series.t)).min(longest_run(series))
}

fn longest_run(series: &Series) -> usize {
    series.pieces().map(|piece| piece.len()).max().unwrap_or(1)
}

/// Samples that the product of two smoothed bins reaches to either side, and the window beyond.
fn both_ways(series: &Series, window: Option<f64>, length: f64) -> usize {
    samples_of_bin(series) + 4 * half_of(series, length) + window_of(series, window) / 2
}

/// Mean product of what the signal and the signal smoothed over a window become.
fn lasting(series: &Series, signal: &Autocovariance, window: Option<f64>, length: f64) -> f64 {
    let samples = samples_of_bin(series);
    let middle = both_ways(series, window, length);
    let mut covariances: Vec<f64> = (0..=2 * middle).map(|i| signal.at(i.abs_diff(middle))).collect();
    let filter = SavitzkyGolay::new(window_of(series, window), 2);
    if let Ok(smoothed) = filter.and_then(|filter| filter.smooth(&covariances)) {
        covariances = smoothed;
    }
    // two running means over both are four over one
    let half = half_of(series, length);
    (0..4).for_each(|_| running_mean(&mut covariances, half));
    let pairs = (0..samples).flat_map(|i| (0..samples).map(move |j| (i, j)));
    pairs.map(|(i, j)| covariances[middle + i - j]).sum::<f64>() / (samples * samples) as f64
}
