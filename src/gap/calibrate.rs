//! Rates of a motion as predictors of the true ones.
//!
//! A law in proportion to a rate that was differentiated from a noisy motion comes out too small, since part of the rate is
//! noise, and trials that hold noise alone weigh as much as those that move. Each rate of each trial is therefore scaled by
//! `E[true x recorded] / E[recorded^2]` of what goes into the regression, means of bins after its passes of smoothing
//! (regression calibration; Carroll, Ruppert, Stefanski, Crainiceanu, Measurement Error in Nonlinear Models, chapter 4), so
//! that what is left is as large as the true rate where that can be said, and 0 where it cannot.
//!
//! Of several forms, the record, the record smoothed over a quarter and half a second, and the bursts of the record, the one
//! that keeps most of the signal is taken: of calibrated predictors it is the closest to the truth.

use std::cell::OnceCell;
use std::ops::Range;

use super::design::smooth as passes;
use super::rates::{Autocovariance, mean_square, mean_step, set_rate, smooth, window};
use super::series::Series;
use super::statistics::median;
use crate::signal::SavitzkyGolay;

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
/// Length of a stretch that may be quiet [s], and as much more for a pass, which makes noise last longer.
const STRETCH: [f64; 2] = [0.5, 0.17];
/// Mean square of the bins at the ends over that of the others from which on filters have made the ends.
const ENDS: f64 = 4.0;

/// Calibrates the rates of all trials for a regression that smooths its rows by so many passes.
pub(super) fn calibrate(all: &mut [Series], times: usize) {
    all.iter_mut().for_each(|series| series.calibrated.clone_from(&series.conditions));
    for rate in 0..6 {
        let ends = !ends_are_noise(all, rate);
        let form = |series: &Series| WINDOWS.map(|window| Form::new(series, rate, window, times, ends));
        let forms: Vec<[Form; 3]> = all.iter().map(form).collect();
        let signals = vec![OnceCell::new(); all.len()];
        let noise = [0, 1, 2].map(|form| noise(all, &forms, &signals, form, times));
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
            if mean_square(&bins_of(series, &bursts, times)) > MORE * kept(&(form, factor)) {
                values = bursts;
            }
            let conditions = series.calibrated.iter_mut().zip(values);
            conditions.for_each(|(condition, value)| set_rate(condition, rate, value));
        }
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
    fn new(series: &Series, rate: usize, length: Option<f64>, times: usize, ends: bool) -> Self {
        let mut recorded: Vec<f64> = series.recorded_rates.iter().map(|rates| rates[rate]).collect();
        for bin in series.runs.iter().flat_map(|run| [run.start, run.end - 1]).filter(|_| !ends) {
            recorded[series.bins[bin].clone()].fill(0.0);
        }
        let mut values = recorded.clone();
        if let Some(length) = length {
            series.pieces().for_each(|piece| smooth(&series.t, &mut values, piece, length));
        }
        let (bins, own) = (bins_of(series, &recorded, times), bins_of(series, &values, times));
        let products: Vec<f64> = bins.iter().zip(&own).map(|(a, b)| a * b).collect();
        let step = series.bin_step();
        let stretch = STRETCH[0] + STRETCH[1] * times as f64;
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
    times: usize,
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
        let signal = signals[trial].get_or_init(|| signal(series, recorded, times));
        forms[trial][form].product - lasting(series, signal, WINDOWS[form], times)
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

/// Means of bins after the passes.
fn bins_of(series: &Series, values: &[f64], times: usize) -> Vec<f64> {
    let mut bins = series.binned(|i| values[i]);
    series.runs.iter().for_each(|run| passes(&mut bins[run.clone()], times));
    bins
}

/// The signal in a record, as far as any of the forms reaches.
fn signal(series: &Series, recorded: &[f64], times: usize) -> Autocovariance {
    let pieces: Vec<Range<usize>> = series.pieces().collect();
    let longest = WINDOWS.map(|length| both_ways(series, length, times)).into_iter().max();
    Autocovariance::new(mean_step(&series.t), &pieces, recorded, longest.unwrap_or_default())
}

/// Samples of a bin.
fn samples_of(series: &Series) -> usize {
    (series.bin_step() / mean_step(&series.t).max(1e-6)).round().max(1.0) as usize
}

/// Samples of a window over which a record is smoothed.
fn window_of(series: &Series, length: Option<f64>) -> usize {
    length.map_or(1, |length| window(length, mean_step(&series.t)))
}

/// Samples that bins after their passes reach to either side, and the window beyond.
fn both_ways(series: &Series, length: Option<f64>, times: usize) -> usize {
    samples_of(series) * (2 * times + 1) + window_of(series, length) / 2
}

/// Mean product of what the signal and the signal smoothed over a window become.
fn lasting(series: &Series, signal: &Autocovariance, length: Option<f64>, times: usize) -> f64 {
    let (samples, window) = (samples_of(series), window_of(series, length));
    let both_ways = both_ways(series, length, times);
    let mut covariances: Vec<f64> = (0..=2 * both_ways).map(|i| signal.at(i.abs_diff(both_ways))).collect();
    if let Ok(smoothed) = SavitzkyGolay::new(window, 2).and_then(|filter| filter.smooth(&covariances)) {
        covariances = smoothed;
    }
    // of the means of two bins, so many bins apart
    let of_bins = |apart: usize| -> f64 {
        let pair = |(i, j): (usize, usize)| covariances[both_ways + apart * samples + i - j];
        let pairs = (0..samples).flat_map(|i| (0..samples).map(move |j| (i, j)));
        pairs.map(pair).sum::<f64>() / (samples * samples) as f64
    };
    // passes over both are twice the passes over one, and a pass is a binomial distribution over bins
    let mut weights = vec![0.0; 4 * times + 3];
    let middle = weights.len() / 2;
    weights[middle] = 1.0;
    passes(&mut weights, 2 * times);
    weights.iter().enumerate().map(|(i, weight)| weight * of_bins(i.abs_diff(middle).min(2 * times))).sum()
}
