//! The noise floor: what no effect can explain.
//!
//! From the part of the gap that changes within a tenth of a second, scaled by what repeats show beyond that; never below the
//! noise that `trials.toml` states. The model's own uncertainty stands beside it.

use super::color::Color;
use super::design::RowNoise;
use super::measurement::is_computed;
use super::model_error::ROUGH;
use super::rates::mean_step;
use super::series::Series;
use super::smoothing::Smoothing;
use super::statistics::{SEEN_OF_COLORED_NOISE, SEEN_OF_SLOW_NOISE, median, noise_variance, white_variance};
use serde::Serialize;
use wade_learn::signal::interpolate;
use wade_learn::trials::{Manifest, WRENCH};

/// Where a floor comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FloorSource {
    /// Trials that repeat each other.
    Repeats,
    /// The part of the gap that changes within a tenth of a second.
    HighFrequency,
    /// Stated in `trials.toml`.
    Stated,
}

impl FloorSource {
    /// Least share of the noise that a floor of this source holds. What changes quickly says little of a slow noise, and repeats and
    /// stated figures hold all of it but for the error of an estimate.
    pub(super) fn least_seen(self) -> f64 {
        match self {
            Self::HighFrequency => SEEN_OF_SLOW_NOISE,
            Self::Repeats | Self::Stated => SEEN_OF_COLORED_NOISE,
        }
    }
}

/// The floor of one component, one standard deviation of a sample [N or N m].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Floor {
    /// Of one sample.
    pub sample: f64,
    /// Of a trial's zero, from trial to trial.
    pub offset: f64,
    /// The model's own.
    pub model: f64,
    /// Where `sample` comes from.
    pub source: FloorSource,
}

impl Floor {
    /// What is expected of the gap where nothing is missing [N or N m].
    pub fn total(&self) -> f64 {
        self.sample.hypot(self.offset)
    }

    /// The same with what the model states of itself: what weighs one component against another [N or N m].
    pub fn with_model(&self) -> f64 {
        self.total().hypot(self.model)
    }

    /// What of the model's error is no smooth function of the state [N or N m].
    pub(super) fn rough(&self) -> f64 {
        ROUGH.sqrt() * self.model
    }
}

/// The floor of each compared component from the trials `naming`; the others are 0. Repeats may be of any trials: what
/// differs between them is noise, whatever effect they share.
pub(super) fn floors(
    all: &[Series],
    naming: &[usize],
    manifest: &Manifest,
    components: &[usize],
) -> [Floor; 6] {
    let model = model_error(&naming.iter().map(|&trial| &all[trial]).collect::<Vec<_>>());
    std::array::from_fn(|component| {
        let name = WRENCH[component];
        let stated = manifest.sensor_noise.get(name).map(|std| std * noise_kept(all, naming));
        let offsets = naming.iter().map(|&trial| manifest.trial_offset_of(&all[trial].name, name));
        let offset = (offsets.map(|o| o * o).sum::<f64>() / naming.len().max(1) as f64).sqrt();
        let mut floor = Floor { sample: 0.0, offset, model: 0.0, source: FloorSource::HighFrequency };
        if !components.contains(&component) {
            return floor;
        }
        floor.sample = high_frequency(naming.iter().map(|&trial| &all[trial]), component);
        if let Some(ratio) = repeats(all, manifest, component) {
            floor = Floor { sample: ratio * floor.sample, source: FloorSource::Repeats, ..floor };
        }
        if let Some(stated) = stated.filter(|&stated| stated > floor.sample) {
            floor = Floor { sample: stated, source: FloorSource::Stated, ..floor };
        }
        floor.model = model[component];
        floor
    })
}

/// Share of the standard deviation of white noise that means of samples keep in some trials, root mean square.
fn noise_kept(all: &[Series], trials: &[usize]) -> f64 {
    let kept = trials.iter().map(|&trial| all[trial].averaged.recip());
    (kept.sum::<f64>() / trials.len().max(1) as f64).sqrt()
}

/// Root mean square of what the model states of itself over the samples of some trials [N or N m].
fn model_error(trials: &[&Series]) -> [f64; 6] {
    let of = || trials.iter().flat_map(|series| &series.uncertainty);
    let count = of().count().max(1) as f64;
    std::array::from_fn(|c| (of().map(|u| u[c].powi(2)).sum::<f64>() / count).sqrt())
}

pub(super) fn high_frequency<'a>(all: impl Iterator<Item = &'a Series>, component: usize) -> f64 {
    pooled(all, |series| sample_noise(series, component))
}

/// Noise of a sample that a floor of its source leaves out [N or N m]: stated figures are those of the sensor, and a prediction
/// for a noisy motion is noisy as well.
pub(super) fn left_out<'a>(
    all: impl Iterator<Item = &'a Series>,
    source: FloorSource,
    component: usize,
) -> f64 {
    match source {
        FloorSource::Stated => pooled(all, |series| {
            let values: Vec<f64> = series.predicted.iter().map(|wrench| wrench[component]).collect();
            noise_variance(&values, scales(&series.t)).sqrt()
        }),
        FloorSource::Repeats | FloorSource::HighFrequency => 0.0,
    }
}

/// Root mean square over the samples of some trials of a noise of each.
fn pooled<'a>(all: impl Iterator<Item = &'a Series>, noise: impl Fn(&Series) -> f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for series in all {
        let samples = series.t.len() as f64;
        sum += noise(series).powi(2) * samples;
        count += samples;
    }
    (sum / f64::max(count, 1.0)).sqrt()
}

/// Noise of a sample of one trial by what changes within a tenth of a second [N or N m].
pub(super) fn sample_noise(series: &Series, component: usize) -> f64 {
    let values: Vec<f64> = series.gap.iter().map(|gap| gap[component]).collect();
    noise_variance(&values, scales(&series.t)).sqrt()
}

/// What changes faster is no load [s].
pub(super) const SLOWEST_SEEN: f64 = 0.08;

/// Octaves below the rate of the samples in which noise is told from signal.
fn scales(t: &[f64]) -> u32 {
    (SLOWEST_SEEN / mean_step(t).max(1e-6)).log2().max(0.0) as u32
}

/// The floors of some trials alone, where they come from the trials themselves or these are louder than is stated: noise may
/// differ from trial to trial.
pub(super) fn floors_of(
    all: &[Series],
    trials: &[usize],
    floors: &[Floor; 6],
    components: &[usize],
) -> [Floor; 6] {
    let mut own = *floors;
    for &component in components {
        if own[component].source == FloorSource::Repeats || trials.is_empty() {
            continue;
        }
        let sample = high_frequency(trials.iter().map(|&trial| &all[trial]), component);
        let is_stated = own[component].source == FloorSource::Stated;
        own[component].sample = if is_stated { sample.max(own[component].sample) } else { sample };
    }
    own
}

/// The trials of each list of trials that repeat each other.
pub(super) fn groups<'a>(all: &'a [Series], manifest: &'a Manifest) -> impl Iterator<Item = Vec<&'a Series>> {
    let of = |name: &String| all.iter().find(|series| series.name == *name);
    manifest.measured.repeats.iter().map(move |group| group.iter().filter_map(of).collect())
}

/// Noise of trials that repeat each other over its high-frequency part in these trials, as a ratio of standard deviations: the
/// median over pairs of half the variance of their difference, at the same time since their start, over that part. A ratio,
/// since the repeated trials may be quieter or louder than the others.
fn repeats(all: &[Series], manifest: &Manifest, component: usize) -> Option<f64> {
    let mut ratios = Vec::new();
    for group in groups(all, manifest) {
        for (index, a) in group.iter().enumerate() {
            for b in &group[index + 1..] {
                let fast = 0.5 * (sample_noise(a, component).powi(2) + sample_noise(b, component).powi(2));
                // a pair without noise says nothing about that of others
                let slow = half_difference(a, b, component).filter(|_| fast > 0.0);
                ratios.extend(slow.map(|slow| slow / fast));
            }
        }
    }
    (!ratios.is_empty()).then(|| median(&mut ratios).sqrt())
}

/// Half the variance of the difference of two trials where both have samples; `None` where they never do.
fn half_difference(a: &Series, b: &Series, component: usize) -> Option<f64> {
    let gap = |series: &Series| series.gap.iter().map(|gap| gap[component]).collect::<Vec<f64>>();
    let since: Vec<f64> = a.t.iter().map(|t| t - a.t[0] + b.t[0]).collect();
    let other = interpolate(&b.t, &gap(b), &since);
    let pieces: Vec<[f64; 2]> = b.pieces().map(|piece| [b.t[piece.start], b.t[piece.end - 1]]).collect();
    let in_both = |t: f64| pieces.iter().any(|[first, last]| (*first..=*last).contains(&t));
    let pairs = gap(a).into_iter().zip(&other).zip(&since).filter(|(_, t)| in_both(**t));
    let differences: Vec<f64> = pairs.map(|((a, b), _)| a - b).collect();
    let count = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / count;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / count;
    (!differences.is_empty()).then_some(0.5 * variance)
}

/// Noise of the rows, for weights: of bins by their own high-frequency part and what of the model's error is no smooth function of
/// the state, of trials by what the manifest states.
pub(super) fn row_noise(
    all: &[Series],
    trials: &[usize],
    components: &[usize],
    (floors, manifest): (&[Floor; 6], &Manifest),
    smoothing: Smoothing,
    colors: [Option<Color>; 6],
) -> RowNoise {
    let model = components.iter().any(|&c| floors[c].model > 0.0);
    // a computed wrench has no noise, and a model that says that it is exact at rest would be believed there alone
    let least = floors.map(|floor| if is_computed(manifest) { floor.model } else { 0.0 });
    let rough_of = |series: &Series| {
        let stated = |sample: usize, c: usize| f64::max(series.uncertainty[sample][c], least[c]);
        let of = |component| series.binned(|sample| ROUGH.sqrt() * stated(sample, component));
        std::array::from_fn(|c| if components.contains(&c) { of(c) } else { Vec::new() })
    };
    let rough = if model { all.iter().map(rough_of).collect() } else { Vec::new() };
    let offset = vec![[0.0; 6]; all.len()];
    let mut noise = RowNoise { bin: [1.0; 6], rough, offset, model, smoothing, color: [None; 6] };
    for &component in components {
        let mut variances = Vec::new();
        for &trial in trials {
            let series = &all[trial];
            let values = series.binned(|sample| series.gap[sample][component]);
            let runs = series.runs.iter().filter(|run| run.len() >= 4);
            variances.extend(runs.map(|run| white_variance(&values[run.clone()])));
        }
        let samples = trials.iter().flat_map(|&trial| all[trial].bins.iter().map(|bin| bin.len() as f64));
        let per_bin = median(&mut samples.collect::<Vec<_>>()).max(1.0);
        let white = floors[component].sample / per_bin.sqrt();
        let bin = median(&mut variances).sqrt().max(white);
        // a component without any noise at all weighs as if its gap were noise of a thousandth
        let size = rms(all, trials, component);
        noise.bin[component] = bin.max(1e-3 * size).max(1e-12);
        noise.color[component] = colors[component];
        for (offset, series) in noise.offset.iter_mut().zip(all) {
            offset[component] = manifest.trial_offset_of(&series.name, WRENCH[component]);
        }
    }
    noise
}

fn rms(all: &[Series], trials: &[usize], component: usize) -> f64 {
    let squares = trials.iter().flat_map(|&t| all[t].gap.iter().map(|gap| gap[component].powi(2)));
    let count = trials.iter().map(|&t| all[t].t.len()).sum::<usize>().max(1);
    (squares.sum::<f64>() / count as f64).sqrt()
}
