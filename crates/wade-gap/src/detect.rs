//! Is there a gap, and how small an effect would these trials have shown?

use std::collections::BTreeMap;

use nalgebra::DVector;
use serde::Serialize;

use super::candidates::{Column, Setting, columns, unavailable};
use super::design::{Candidate, Design};
use super::model_error::ModelError;
use super::noise::{Floor, left_out};
use super::rates::mean_square;
use super::robust::errors;
use super::series::Series;
use super::smoothing::bins;
use super::statistics::{median, quantile, white_variance};
use super::{Config, Named};
use wade_core::effects::{Effect, Rate, Shape};
use wade_learn::random::Random;
use wade_learn::trials::{Manifest, WRENCH};

/// Deviates that an effect must have to be named nine times of ten: the bar, and 1.28 for the power.
const POWER: f64 = 1.28;
/// Below this share of signal in its columns an effect is not excited: the rest is noise of the kinematics.
const LEAST_SIGNAL: f64 = 0.3;
/// Share of a rate that hangs together, below which it is noise.
const COHERENT: f64 = 0.1;
/// A trial excites an effect when its mean square is this share of that of the trial that does so most.
const EXCITED: f64 = 0.1;

/// The gap of one component against its floor, root mean squares [N or N m].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GapSize {
    /// Of all samples.
    pub rms: f64,
    /// 90 % interval, by a bootstrap over trials.
    pub interval: [f64; 2],
    /// What noise alone would show.
    pub noise_floor: f64,
    /// The most that is expected with nothing missing: the floor, all noise that a floor of its source may have missed, and what a
    /// smooth model error of the stated size is in 19 of 20 draws at most.
    pub expected_at_most: f64,
    /// True where the interval lies above what is expected at most.
    pub above_floor: bool,
}

/// The gap of each component in some trials.
pub(super) fn sizes<'a>(
    trials: impl Iterator<Item = &'a Series> + Clone,
    floors: &[Floor; 6],
    error: &ModelError,
    setting: &Setting,
    config: &Config,
) -> BTreeMap<&'static str, GapSize> {
    let of = |(place, &component): (usize, &usize)| {
        let squares: Vec<(f64, f64)> = trials
            .clone()
            .map(|s| (s.gap.iter().map(|gap| gap[component].powi(2)).sum(), s.gap.len() as f64))
            .collect();
        let mut random = Random::new(config.seed ^ 0xde7ec7);
        let rms = |draw: &[(f64, f64)]| {
            let (sum, count) = draw.iter().fold((0.0, 0.0), |(s, c), (a, b)| (s + a, c + b));
            (sum / f64::max(count, 1.0)).sqrt()
        };
        let mut draws: Vec<f64> = (0..config.bootstrap)
            .map(|_| {
                let pick = || squares[(random.unit() * squares.len() as f64) as usize];
                rms(&std::iter::repeat_with(pick).take(squares.len()).collect::<Vec<_>>())
            })
            .collect();
        let interval = [quantile(&mut draws.clone(), 0.05), quantile(&mut draws, 0.95)];
        let noise_floor = floors[component].with_model();
        // a computed wrench has no noise that had to be estimated
        let seen = if setting.computed { 1.0 } else { floors[component].source.least_seen() };
        let left_out = left_out(trials.clone(), floors[component].source, component);
        let model = floors[component].model * error.at_most(place);
        let expected_at_most = floors[component].total().hypot(model).hypot(left_out) / seen;
        let above_floor = interval[0] > expected_at_most;
        let size = GapSize { rms: rms(&squares), interval, noise_floor, expected_at_most, above_floor };
        (WRENCH[component], size)
    };
    setting.components.iter().enumerate().map(of).collect()
}

/// What the trials say about one effect of the library, whether it is there or not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Excitation {
    /// Effect.
    pub name: &'static str,
    /// Trials that excite it.
    pub trials: usize,
    /// The smallest coefficient that these trials would have shown, by name.
    pub minimum_detectable: BTreeMap<&'static str, Detectable>,
    /// The same as a force or moment, root mean square over all samples [N or N m].
    pub minimum_load: Option<f64>,
    /// Why it could not have been found; none where it could.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_testable: Option<String>,
}

/// A smallest coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Detectable {
    /// Size.
    pub value: f64,
    /// Unit; 1 where it has none.
    pub unit: &'static str,
}

/// The excitation of every effect; `residual` is what the named effects leave of the rows. What was named was excited.
pub(super) fn excitations(
    design: &Design,
    all: &[Series],
    setting: &Setting,
    manifest: &Manifest,
    residual: &DVector<f64>,
    named: &[Named],
    config: &Config,
) -> Vec<Excitation> {
    let bar = super::statistics::deviate_of(config.significance) + POWER;
    let of = |&effect: &Effect| {
        let mut found = of_effect(effect, design, all, setting, manifest, residual, bar);
        found.not_testable.take_if(|_| named.iter().any(|named| named.effect == effect));
        found
    };
    config.library.iter().map(of).collect()
}

fn of_effect(
    effect: Effect,
    design: &Design,
    all: &[Series],
    setting: &Setting,
    manifest: &Manifest,
    residual: &DVector<f64>,
    bar: f64,
) -> Excitation {
    let mut found = Excitation {
        name: effect.name(),
        trials: 0,
        minimum_detectable: BTreeMap::new(),
        minimum_load: None,
        not_testable: unavailable(effect, setting, manifest, all),
    };
    if found.not_testable.is_some() {
        return found;
    }
    let is_whole = |candidate: &Candidate| candidate.effect == effect && candidate.region.is_everywhere();
    let forms: Vec<usize> =
        (0..design.candidates.len()).filter(|&i| is_whole(&design.candidates[i])).collect();
    let Some(&form) = forms.get(forms.len() / 2) else {
        found.not_testable = Some(effect.spec().not_excited.into());
        return found;
    };
    let candidate = &design.candidates[form];
    let signals = signals(&candidate.shape, all, setting, design);
    let coherent = is_coherent(effect, all, &setting.components);
    let changes = if effect == Effect::SensorDelay { change_signal(all, &setting.components) } else { 1.0 };
    let mut plausible = false;
    let mut excited = false;
    for &(column, coefficient) in &candidate.columns {
        let (signal, trials) = signals[coefficient].share();
        let smooth = if coherent { signal.min(changes).max(0.0) } else { 0.0 };
        found.trials = found.trials.max(if smooth > LEAST_SIGNAL { trials } else { 0 });
        excited |= smooth > LEAST_SIGNAL;
        let Some(error) = errors(design, &[column], residual).map(|errors| errors[0]) else { continue };
        let floor = white_error(design, column);
        let detectable = bar * error.std.max(floor) / design.scale[column] / smooth.max(0.01);
        let coefficient = &effect.coefficients()[coefficient];
        plausible |= smooth > LEAST_SIGNAL && detectable < coefficient.largest_plausible();
        found
            .minimum_detectable
            .insert(coefficient.name, Detectable { value: detectable, unit: coefficient.unit });
        let load = bar * error.std.max(floor) * mean_bin(design, setting);
        found.minimum_load = Some(found.minimum_load.map_or(load, |other| other.min(load)));
    }
    if !excited {
        found.not_testable = Some(effect.spec().not_excited.into());
    } else if !plausible {
        found.not_testable =
            Some("excited too little: even the largest plausible value would drown in the noise".into());
    }
    found
}

/// Standard error that rows of unit variance would give.
fn white_error(design: &Design, column: usize) -> f64 {
    design.x.column(column).norm_squared().max(1e-12).sqrt().recip()
}

/// Noise of a bin, root mean square over all, of the component in the middle [N or N m].
fn mean_bin(design: &Design, setting: &Setting) -> f64 {
    let of = |component: usize| {
        let own = design.rows.rows.iter().filter(|row| row.component == component);
        let squares = own.map(|row| design.noise.of_bin(row.trial, component, row.bin).powi(2));
        (squares.sum::<f64>() / (design.rows.rows.len() / design.rows.width).max(1) as f64).sqrt()
    };
    median(&mut setting.components.iter().map(|&component| of(component)).collect::<Vec<_>>())
}

/// Length of the running means after which a column is looked at trial by trial [s].
const EVEN: f64 = 0.25;

/// What there is of a coefficient in the bins of all trials.
#[derive(Clone, Default)]
struct Signal {
    /// Sum of the squares that noise of the kinematics makes, and of all.
    noise: f64,
    total: f64,
    by_trial: Vec<f64>,
}

impl Signal {
    /// Adds the bins of a trial.
    fn add(
        &mut self,
        column: &Column,
        (trial, series): (usize, &Series),
        setting: &Setting,
        design: &Design,
    ) {
        let mut energy = 0.0;
        for &component in &setting.components {
            let value = |sample: usize| column[sample][component];
            let (values, smooth) = (series.binned(value), bins(series, EVEN, value));
            let over_noise = |values: Vec<f64>| -> Vec<f64> {
                let of = |(bin, value): (usize, f64)| value / design.noise.of_bin(trial, component, bin);
                values.into_iter().enumerate().map(of).collect()
            };
            let (values, smooth) = (over_noise(values), over_noise(smooth));
            for run in series.runs.iter().filter(|run| run.len() >= 6) {
                let values = &values[run.clone()];
                if !setting.computed {
                    self.noise += white_variance(values) * values.len() as f64;
                }
                self.total += values.iter().map(|v| v * v).sum::<f64>();
                energy += mean_square(&smooth[run.clone()]);
            }
        }
        self.by_trial.push(energy);
    }

    /// Share of signal, not noise of the kinematics, and the number of trials that excite it.
    fn share(&self) -> (f64, usize) {
        let most = self.by_trial.iter().copied().fold(0.0, f64::max);
        let trials = self.by_trial.iter().filter(|e| **e > EXCITED * most && **e > 0.0).count();
        (if self.total > 0.0 { 1.0 - self.noise / self.total } else { 0.0 }, trials)
    }
}

/// What there is of each coefficient of a shape.
fn signals(shape: &Shape, all: &[Series], setting: &Setting, design: &Design) -> Vec<Signal> {
    let mut signals = vec![Signal::default(); shape.effect().coefficients().len()];
    for (rank, series) in all.iter().enumerate() {
        let columns = columns(shape, series, rank, setting);
        let own = (rank, series);
        signals.iter_mut().zip(&columns).for_each(|(sum, column)| sum.add(column, own, setting, design));
    }
    signals
}

/// True where a rate that an effect lives on hangs together for longer than the filter that made it: what is left of the
/// noise of a motion after differentiating it does not, however smooth it looks.
fn is_coherent(effect: Effect, all: &[Series], components: &[usize]) -> bool {
    let share = |index: usize| {
        let sums = all.iter().map(|series| series.coherence[index]);
        let (power, covariance) = sums.fold((0.0, 0.0), |(p, c), s| (p + s.power, c + s.covariance));
        if power > 0.0 { covariance / power } else { 0.0 }
    };
    let felt = |rates: [usize; 3], with: [[usize; 2]; 3]| {
        let seen = |with: &[usize; 2]| with.iter().any(|c| components.contains(c));
        rates.into_iter().zip(with).filter(|(_, with)| seen(with)).any(|(rate, _)| share(rate) > COHERENT)
    };
    let is_signal = |rate: &Rate| match rate {
        // pitch comes with surge, roll with sway
        Rate::Acceleration => felt([0, 1, 2], [[0, 4], [1, 3], [2, 2]]),
        Rate::AngularAcceleration => felt([3, 4, 5], [[3, 3], [4, 4], [5, 5]]),
        Rate::Depth => share(6) > COHERENT,
        Rate::Attitude => felt([7, 8, 9], [[3, 3], [2, 4], [1, 5]]),
    };
    let rates = effect.spec().rates;
    rates.is_empty() || rates.iter().any(is_signal)
}

/// Share of signal in the changes of the prediction, on which a delay lives.
fn change_signal(all: &[Series], components: &[usize]) -> f64 {
    let (mut noise, mut power) = (0.0, 0.0);
    for (series, &c) in all.iter().flat_map(|s| components.iter().map(move |c| (s, c))) {
        let values = series.binned(|i| series.predicted[i][c]);
        let white = white_variance(&values).max(1e-12);
        let changes = values.windows(4).map(|w| (w[3] - w[0]).powi(2));
        // the difference of two bins has twice their noise
        noise += 2.0 * values.len() as f64;
        power += changes.sum::<f64>() / white;
    }
    if power > 0.0 { 1.0 - noise / power } else { 0.0 }
}
