//! The samples that the workflow works on: the recorded ones, or means over short windows where a trial was sampled fast,
//! and stretches of trials where a folder is long.
//!
//! A bin averages its samples, so that a hundred of them say no more of a load than ten means do. Windows never cross the
//! borders of bins: the bins hold the same samples as at the full rate, and so do bins of trials that are shorter than one.
//! A window is shorter where the state changes within it by more than noise does.

use std::borrow::Cow;
use std::ops::Range;

use super::statistics::quiet_white_variance;
use wade_core::effects::Body;
use wade_learn::signal::{GAP_STEPS, median, median_step, pieces};
use wade_learn::trials::Trial;

/// Fewest means of a bin: as many as a bin of the default length has at 100 Hz.
const SAMPLES_OF_BIN: usize = 10;
/// Fewest means of a trial that has as many samples.
const SAMPLES_OF_TRIAL: usize = 64;
/// Halvings of a window in which the state changes quickly.
const HALVINGS: u32 = 2;
/// Most samples of a folder after that. A folder has several times as many columns as components, and the regression keeps
/// each of them over all bins: with six components about 1.4 kB a sample.
pub(super) const MOST_SAMPLES: usize = 160_000;
/// Stretches into which a long trial is cut, and least and largest length of one [s]: a stretch must be long beside what
/// waves remember.
const STRETCHES: f64 = 8.0;
const STRETCH_S: [f64; 2] = [2.0, 20.0];

/// A trial as the workflow sees it.
pub(super) struct Sampled<'a> {
    pub trial: Cow<'a, Trial>,
    /// Samples of each run without a hole.
    pub pieces: Vec<Range<usize>>,
    /// Samples of each bin.
    pub bins: Vec<Range<usize>>,
    /// Bins of each run without a hole.
    pub runs: Vec<Range<usize>>,
    /// Recorded samples in the mean that stands for one.
    pub averaged: f64,
}

/// How a trial is sampled.
pub(super) struct Sampling {
    /// Recorded samples of each window.
    windows: Vec<Range<usize>>,
    /// Windows of each bin.
    bins: Vec<Range<usize>>,
    /// Bins of each run without a hole.
    runs: Vec<Range<usize>>,
    /// Recorded samples of most windows.
    samples: usize,
}

impl Sampling {
    /// Of one trial as a whole, in bins of a length [s].
    pub fn new(trial: &Trial, body: &Body, bin_s: f64) -> Self {
        let found = pieces(&trial.t);
        let whole = Self::of_windows(trial, &found, bin_s, 1);
        let mut sizes: Vec<f64> = whole.bins.iter().map(|bin| bin.len() as f64).collect();
        let of_bin = median(&mut sizes).unwrap_or(1.0) as usize / SAMPLES_OF_BIN;
        let most = of_bin.min(trial.len() / SAMPLES_OF_TRIAL);
        if most < 2 {
            return whole;
        }
        let mut samples = most;
        while samples > most >> HALVINGS && samples > 1 && bends(trial, &found, samples, body) {
            samples /= 2;
        }
        Self::of_windows(trial, &found, bin_s, samples)
    }

    fn of_windows(trial: &Trial, pieces: &[Range<usize>], bin_s: f64, samples: usize) -> Self {
        let (recorded, runs) = bins(&trial.t, &joined(&trial.t, pieces, samples), bin_s);
        let (mut windows, mut bins) = (Vec::new(), Vec::new());
        for bin in recorded {
            let (first, count) = (windows.len(), (bin.len() + samples / 2) / samples);
            windows.extend(parts(&bin, count.max(1)));
            bins.push(first..windows.len());
        }
        Self { windows, bins, runs, samples }
    }

    /// Keeps a share of the bins in whole stretches: the first, from which time is counted, those in which the state changes
    /// most quickly, since a short event must not be lost, and as many in even distances.
    pub fn keep(&mut self, trial: &Trial, share: f64, bin_s: f64) {
        let bins_of = |seconds: f64| (seconds / bin_s).max(1.0) as usize;
        let [least, most] = STRETCH_S.map(bins_of);
        let length = ((self.bins.len() as f64 / STRETCHES) as usize).clamp(least, most.max(least));
        let cut =
            |run: &Range<usize>| parts(run, (run.len() as f64 / length as f64).round().max(1.0) as usize);
        let stretches: Vec<Range<usize>> = self.runs.iter().flat_map(cut).collect();
        let wanted = ((stretches.len() as f64 * share).round() as usize).max(1);
        let quickness = |stretch: &Range<usize>| {
            let recorded = |bin: usize| self.windows[self.bins[bin].start].start;
            let velocity = |bin: usize| trial.velocity[recorded(bin)];
            let changes = stretch.clone().skip(1).map(|bin| (velocity(bin) - velocity(bin - 1)).norm());
            changes.fold(0.0, f64::max)
        };
        let quickness: Vec<f64> = stretches.iter().map(quickness).collect();
        let mut rest: Vec<usize> = (1..stretches.len()).collect();
        rest.sort_by(|&a, &b| quickness[b].total_cmp(&quickness[a]).then(a.cmp(&b)));
        let mut even = rest.split_off((wanted / 2).min(rest.len()));
        even.sort_unstable();
        let places = (wanted - 1).saturating_sub(rest.len()).min(even.len());
        rest.extend((0..places).map(|place| even[place * even.len() / places]));
        rest.push(0);
        rest.sort_unstable();
        let kept: Vec<Range<usize>> = rest.into_iter().map(|stretch| stretches[stretch].clone()).collect();
        self.retain(&kept);
    }

    /// Leaves out all bins but those of some stretches.
    fn retain(&mut self, stretches: &[Range<usize>]) {
        let (mut windows, mut bins, mut runs) = (Vec::new(), Vec::new(), Vec::<Range<usize>>::new());
        let mut last = None;
        for stretch in stretches {
            let follows = last == Some(stretch.start) && !self.runs.iter().any(|r| r.start == stretch.start);
            let first = bins.len();
            for bin in stretch.clone() {
                let of_bin = &self.windows[self.bins[bin].clone()];
                bins.push(windows.len()..windows.len() + of_bin.len());
                windows.extend_from_slice(of_bin);
            }
            match runs.last_mut().filter(|_| follows) {
                Some(run) => run.end = bins.len(),
                None => runs.push(first..bins.len()),
            }
            last = Some(stretch.end);
        }
        (self.windows, self.bins, self.runs) = (windows, bins, runs);
    }

    /// Number of samples that are left.
    pub fn count(&self) -> usize {
        self.windows.len()
    }

    /// The trial in these samples.
    pub fn apply<'a>(self, trial: &'a Trial) -> Sampled<'a> {
        let is_whole = self.windows.len() == trial.len();
        let trial = if is_whole { Cow::Borrowed(trial) } else { Cow::Owned(trial.averaged(&self.windows)) };
        let Self { bins, runs, samples, .. } = self;
        let pieces = runs.iter().map(|run| bins[run.start].start..bins[run.end - 1].end).collect();
        Sampled { trial, pieces, bins, runs, averaged: samples as f64 }
    }
}

/// How each of some trials is sampled, with at most about so many samples of all together.
pub(super) fn samplings(trials: &[&Trial], body: &Body, bin_s: f64, most: usize) -> Vec<Sampling> {
    let mut all: Vec<Sampling> = trials.iter().map(|trial| Sampling::new(trial, body, bin_s)).collect();
    let count = all.iter().map(Sampling::count).sum::<usize>();
    if count > most {
        let share = most as f64 / count as f64;
        all.iter_mut().zip(trials).for_each(|(sampling, trial)| sampling.keep(trial, share, bin_s));
    }
    all
}

/// Pieces without a hole that so many samples could not cover.
fn joined(t: &[f64], pieces: &[Range<usize>], samples: usize) -> Vec<Range<usize>> {
    let limit = median_step(t).map_or(f64::INFINITY, |step| GAP_STEPS * step * samples as f64);
    let mut joined: Vec<Range<usize>> = Vec::new();
    for piece in pieces {
        match joined.last_mut().filter(|last| t[piece.start] - t[last.end - 1] <= limit) {
            Some(last) => last.end = piece.end,
            None => joined.push(piece.clone()),
        }
    }
    joined
}

/// Bins of about `length` within each run without a hole, and the bins of each run; at least one sample each.
fn bins(t: &[f64], pieces: &[Range<usize>], length: f64) -> (Vec<Range<usize>>, Vec<Range<usize>>) {
    let (mut bins, mut runs) = (Vec::new(), Vec::new());
    for piece in pieces {
        let first = bins.len();
        let mut start = piece.start;
        while start < piece.end {
            let end =
                (start + 1..piece.end).find(|&i| t[i] - t[start] >= length * 0.999).unwrap_or(piece.end);
            bins.push(start..end);
            start = end;
        }
        runs.push(first..bins.len());
    }
    (bins, runs)
}

/// A range in parts of about the same length.
fn parts(range: &Range<usize>, count: usize) -> impl Iterator<Item = Range<usize>> + use<> {
    let (start, length) = (range.start, range.len());
    (0..count).map(move |part| start + part * length / count..start + (part + 1) * length / count)
}

/// True where a state changes its rate from one mean of so many samples to the next by more than noise does.
fn bends(trial: &Trial, pieces: &[Range<usize>], samples: usize, body: &Body) -> bool {
    /// Share of the size of a state, from one mean to the next.
    const SHARE: f64 = 0.05;
    /// Standard deviations of noise: a mean in a million is beyond five.
    const NOISES: f64 = 6.0;
    let speed = (trial.velocity.iter().map(|v| v.norm_squared()).sum::<f64>() / trial.len() as f64).sqrt();
    let quickly = |size: f64, value: &dyn Fn(usize) -> f64| {
        let values: Vec<f64> = (0..trial.len()).map(value).collect();
        let noise = (6.0 * quiet_white_variance(&values) / samples as f64).sqrt();
        let limit = f64::max(SHARE * size, NOISES * noise);
        pieces.iter().any(|piece| {
            let mean = |window: &[f64]| window.iter().sum::<f64>() / samples as f64;
            let means: Vec<f64> = values[piece.clone()].chunks_exact(samples).map(mean).collect();
            means.windows(3).any(|three| (three[0] - 2.0 * three[1] + three[2]).abs() > limit)
        })
    };
    let (_, level) = trial.still_water.column();
    (0..3).any(|axis| quickly(speed, &|i| trial.velocity[i][axis]))
        || (0..3).any(|axis| quickly(speed / body.length, &|i| trial.angular_velocity[i][axis]))
        || quickly(body.height, &|i| level[i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use wade_core::effects::Block;
    use wade_core::frame::Vec3;
    use wade_learn::trials::StillWater;

    const BIN: f64 = 0.1;

    fn trial(rate: f64, samples: usize, velocity: impl Fn(f64) -> f64) -> Trial {
        let t: Vec<f64> = (0..samples).map(|i| i as f64 / rate).collect();
        let still = || vec![Vec3::zeros(); samples];
        Trial {
            name: "run".into(),
            rows: (2..).take(samples).collect(),
            velocity: t.iter().map(|&t| Vec3::x() * velocity(t)).collect(),
            current: still(),
            angular_velocity: still(),
            roll: vec![0.0; samples],
            pitch: vec![0.0; samples],
            yaw: vec![0.0; samples],
            still_water: StillWater::Depth(vec![0.2; samples]),
            bed_clearance: None,
            bed: None,
            acceleration: still(),
            angular_acceleration: still(),
            acceleration_is_measured: true,
            density: vec![1000.0; samples],
            wheel_speeds: [const { None }; 4],
            measured: [const { None }; 6],
            simulated: [const { None }; 6],
            other_forces: Default::default(),
            known_loads: Default::default(),
            unknown_columns: Vec::new(),
            gaps: Vec::new(),
            glitches: Vec::new(),
            t,
        }
    }

    fn body() -> Body {
        let block = Block {
            length: 1.5,
            width: 1.4,
            draft: 0.2,
            mass: 280.0,
            displaced_volume: 0.3,
            center_of_mass: [0.0; 3],
            wheel_radius: None,
        };
        Body::of_block("box", block)
    }

    /// Recorded samples of each bin.
    fn recorded(sampling: &Sampling) -> Vec<Range<usize>> {
        let of = |bin: &Range<usize>| sampling.windows[bin.start].start..sampling.windows[bin.end - 1].end;
        sampling.bins.iter().map(of).collect()
    }

    #[test]
    fn bins_hold_the_same_samples_as_at_the_full_rate() {
        for rate in [100.0, 190.0, 250.0, 333.0, 1000.0, 4000.0] {
            let mut trial = trial(rate, (3.0 * rate) as usize, |t| t.sin());
            let lost = 1.0..1.3;
            trial.t.iter_mut().filter(|t| **t > lost.start).for_each(|t| *t += lost.end - lost.start);
            let (bins, runs) = bins(&trial.t, &pieces(&trial.t), BIN);
            let sampling = Sampling::new(&trial, &body(), BIN);
            assert_eq!((recorded(&sampling), &sampling.runs), (bins, &runs), "{rate} Hz");
            assert_eq!(runs.len(), 2, "{rate} Hz");
            for bin in &sampling.bins {
                let windows = sampling.windows[bin.clone()].iter().map(|window| window.len());
                let (least, most) = (windows.clone().min(), windows.max());
                assert!(most <= least.map(|least| least + 1), "{rate} Hz: windows of a bin are alike");
            }
            let most = sampling.bins.iter().map(|bin| bin.len()).max().expect("bins");
            assert!((10..=20).contains(&most), "{rate} Hz: {most} a bin");
        }
    }

    #[test]
    fn a_window_is_shorter_where_the_velocity_changes_within_it() {
        let samples = |velocity: &dyn Fn(f64) -> f64| {
            Sampling::new(&trial(4000.0, 8000, velocity), &body(), BIN).samples
        };
        assert_eq!(samples(&|t| 1.0 + 0.5 * (3.0 * t).sin()), 40);
        // brought to rest within 5 ms
        assert_eq!(samples(&|t| 1.0 - ((t - 1.0) / 0.005).clamp(0.0, 1.0)), 10);
        let random = std::cell::RefCell::new(wade_learn::random::Random::new(2));
        assert_eq!(samples(&|_| 1.0 + random.borrow_mut().unit()), 40, "noise is no change");
    }

    #[test]
    fn of_a_long_folder_each_trial_keeps_its_start_and_its_quickest_changes() {
        let (rate, seconds) = (50.0, 300.0);
        let quick = |at: f64| move |t: f64| 1.0 + ((t - at) / 0.1).clamp(0.0, 1.0);
        let trials = [130.0, 210.0].map(|at| trial(rate, (rate * seconds) as usize, quick(at)));
        let used: Vec<&Trial> = trials.iter().collect();
        let most = 10_000;
        let all = samplings(&used, &body(), BIN, most);
        let count: usize = all.iter().map(Sampling::count).sum();
        assert!(count.abs_diff(most) < most / 5, "{count}");
        for ((sampling, trial), at) in all.into_iter().zip(&trials).zip([130.0, 210.0]) {
            let sampled = sampling.apply(trial);
            let t = &sampled.trial.t;
            assert_eq!(t[0], trial.t[0]);
            assert!(t.iter().any(|t| (t - at).abs() < 0.02));
            assert_eq!(sampled.pieces, pieces(t), "what is left out is a hole");
            assert!(sampled.pieces.iter().all(|piece| piece.len() as f64 >= 2.0 * rate));
            assert_eq!(sampled.runs.last().map(|run| run.end), Some(sampled.bins.len()));
        }
        let all = samplings(&used, &body(), BIN, MOST_SAMPLES);
        assert!(all.iter().zip(&trials).all(|(sampling, trial)| sampling.count() == trial.len()));
    }
}
