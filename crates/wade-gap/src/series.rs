//! Trials as the workflow sees them: state, prediction and gap of every sample, and bins of samples.

use std::ops::Range;

use super::measurement::{Measurement, Motion, is_computed, measurement, of_columns, twin};
use super::rates::{Coherence, mean_step, rates, smooth_rates, wetting_rate};
use super::sampling::{MOST_SAMPLES, Sampled, Sampling, samplings};
use super::{Asked, Config, GapError, Predicted};
use wade_core::condition::{Condition, LEAST_UPRIGHT};
use wade_core::effects::{Body, Immersion, Input};
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::vehicle::PerWheel;
use wade_core::wrench::Wrench;
use wade_learn::trials::{SimIs, Trial, Trials, WRENCH};

/// Nothing wades where the water is as many times as deep as its hull is high.
const DEEPEST: f64 = 4.0;

/// One trial; a value a sample.
#[derive(Debug, Clone)]
pub(super) struct Series {
    pub name: String,
    pub t: Vec<f64>,
    /// States, with rates that are smoothed where they are noisy.
    pub conditions: Vec<Condition>,
    /// The same with what is expected of the true rates, for inertia; as they are until they are calibrated.
    pub calibrated: Vec<Condition>,
    pub immersions: Vec<Immersion>,
    pub yaw: Vec<f64>,
    pub roll_pitch: Vec<[f64; 2]>,
    pub wetting_rate: Vec<f64>,
    pub wheels: Vec<[Option<f64>; 4]>,
    /// Model's wrench; 0 where another simulator has no column of a component.
    pub predicted: Vec<[f64; 6]>,
    /// Known loads that the sensor bears besides the water's.
    pub known: Vec<[f64; 6]>,
    /// What sensors bear: the prediction, the known loads, and the effects of the water that were found beside them.
    pub seen: Vec<[f64; 6]>,
    /// The model's own standard deviation.
    pub uncertainty: Vec<[f64; 6]>,
    /// True where the state is none of those that the model learnt.
    pub outside: Vec<bool>,
    /// Measured minus predicted and known; 0 for components that are not compared.
    pub gap: Vec<[f64; 6]>,
    /// Known other force on each component, where there is one, less that of the dry twin.
    pub other: Vec<[f64; 6]>,
    /// Rates of the velocities before any smoothing.
    pub recorded_rates: Vec<[f64; 6]>,
    /// `a + g up` before any smoothing [m/s2], where the wrench was inferred with it.
    pub inertia: Option<Vec<Vec3>>,
    /// What each stated moment of inertia makes of the turning before any smoothing [N m], where moments were inferred with it.
    pub turning: Option<Vec<[Vec3; 3]>>,
    /// What the dry twin's rolling resistance takes off, over its mass and the coefficient [m/s2]; 0 without a twin.
    pub dry_rolling: Vec<f64>,
    /// The acceleration of the dry twin that was taken off, where there is one [m/s2].
    pub dry_acceleration: Option<Vec<Vec3>>,
    /// Rates of velocity and angular velocity, wetting rate and angular velocities: how far each hangs together.
    pub coherence: [Coherence; 10],
    /// Samples of each bin.
    pub bins: Vec<Range<usize>>,
    /// Bins of each run without a hole.
    pub runs: Vec<Range<usize>>,
    /// Width of the channel [m]; none in open water.
    pub channel_width: Option<f64>,
    /// Recorded samples in the mean that stands for one.
    pub averaged: f64,
}

impl Series {
    /// The state of a sample as an effect sees it.
    pub fn input<'a>(&'a self, sample: usize, body: &'a Body, base_drag: Vec3) -> Input<'a> {
        Input {
            body,
            condition: &self.conditions[sample],
            immersion: &self.immersions[sample],
            predicted: self.predicted_wrench(sample),
            elsewhere: None,
            base_drag,
            yaw: self.yaw[sample],
            wetting_rate: self.wetting_rate[sample],
            channel_width: self.channel_width,
            wheel_speeds: self.wheels[sample].into(),
        }
    }

    /// The model's wrench of a sample.
    pub fn predicted_wrench(&self, sample: usize) -> Wrench {
        let [fx, fy, fz, mx, my, mz] = self.predicted[sample];
        Wrench { force: Vec3::new(fx, fy, fz), moment: Vec3::new(mx, my, mz) }
    }

    /// Samples of each stretch without a hole.
    pub fn pieces(&self) -> impl Iterator<Item = Range<usize>> {
        self.runs.iter().map(|run| self.bins[run.start].start..self.bins[run.end - 1].end)
    }

    /// Mean length of a bin [s].
    pub fn bin_step(&self) -> f64 {
        mean_step(&self.t) * self.t.len() as f64 / self.bins.len().max(1) as f64
    }

    /// Mean of a value over each bin.
    pub fn binned(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        let mean = |bin: &Range<usize>| bin.clone().map(&value).sum::<f64>() / bin.len() as f64;
        self.bins.iter().map(mean).collect()
    }
}

/// Series in the order of recording without the trials that are only twins, and the components that are compared.
pub(super) fn series(
    trials: &Trials,
    body: &Body,
    predict: &mut dyn FnMut(&Asked<'_>) -> Predicted,
    config: &Config,
) -> Result<(Vec<Series>, Vec<usize>), GapError> {
    let twins: Vec<&String> = trials.manifest.measured.dry_twins.values().collect();
    let mut used: Vec<&Trial> = trials.trials.iter().filter(|trial| !twins.contains(&&trial.name)).collect();
    // the order in which the files came must not matter
    in_order_of_recording(&mut used);
    let mut all = Vec::new();
    let mut common: Option<[bool; 6]> = None;
    let controlled = trials.manifest.measured.sim_is == SimIs::Control;
    if let Some(trial) = used.iter().find(|trial| controlled && !trial.is_simulated()) {
        return Err(GapError::NoControl { trial: trial.name.clone() });
    }
    if let Some(trial) = used.iter().find(|trial| trial.is_simulated() != used[0].is_simulated()) {
        return Err(GapError::Predictions { trial: trial.name.clone(), other: used[0].name.clone() });
    }
    let sampled = samplings(&used, body, config.bin_s, MOST_SAMPLES);
    for (trial, sampling) in used.into_iter().zip(sampled) {
        let (series, present) = of_trial(trials, sampling.apply(trial), body, predict, config)?;
        if !present.contains(&true) {
            return Err(GapError::NothingMeasured { trial: trial.name.clone() });
        }
        if let Some(other) = common.filter(|other| *other != present) {
            let component = (0..6).find(|&c| other[c] != present[c]).unwrap_or_default();
            return Err(GapError::Components { trial: trial.name.clone(), component: WRENCH[component] });
        }
        common = Some(present);
        all.push(series);
    }
    if all.len() < config.least_trials {
        return Err(GapError::TooFewTrials { trials: all.len(), least: config.least_trials });
    }
    let present = common.unwrap_or_default();
    Ok((all, (0..6).filter(|&c| present[c]).collect()))
}

/// By stamps where those of all trials are of one clock, else by name, in which numbers count as such: run9 comes before
/// run10.
fn in_order_of_recording(trials: &mut [&Trial]) {
    trials.sort_by(|a, b| by_number(&a.name).cmp(&by_number(&b.name)).then(a.name.cmp(&b.name)));
    if one_clock(trials.iter().map(|trial| trial.t.as_slice())) {
        trials.sort_by(|a, b| a.t[0].total_cmp(&b.t[0]));
    }
}

/// True where stamps are of one clock: those of one trial do not overlap with those of another.
pub(super) fn one_clock<'a>(stamps: impl Iterator<Item = &'a [f64]>) -> bool {
    let mut spans: Vec<(f64, f64)> = stamps.map(|t| (t[0], t[t.len() - 1])).collect();
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    spans.windows(2).all(|pair| pair[1].0 > pair[0].1)
}

/// Texts and numbers of a name in turn, a number with its digits: of two, that with fewer is the smaller.
fn by_number<'a>(name: &'a str) -> Vec<(usize, &'a [u8])> {
    let parts = name.as_bytes().chunk_by(|a, b| a.is_ascii_digit() == b.is_ascii_digit());
    let of = |part: &'a [u8]| {
        if !part[0].is_ascii_digit() {
            return (0, part);
        }
        let number = &part[part.iter().take_while(|byte| **byte == b'0').count()..];
        (number.len(), number)
    };
    parts.map(of).collect()
}

fn of_trial(
    trials: &Trials,
    Sampled { trial, pieces, bins, runs, averaged }: Sampled,
    body: &Body,
    predict: &mut dyn FnMut(&Asked<'_>) -> Predicted,
    config: &Config,
) -> Result<(Series, [bool; 6]), GapError> {
    let twin = twin(trials, &trial)?.map(|twin| Sampling::new(twin, body, config.bin_s).apply(twin).trial);
    let Measurement { wrench: measured, motion, other } =
        measurement(&trials.manifest, &trial, twin.as_deref(), body.mass)?;
    let simulated = trial.is_simulated();
    let mut present: [bool; 6] = std::array::from_fn(|c| measured[c].is_some());
    if simulated {
        (0..6).for_each(|c| present[c] &= trial.simulated[c].is_some());
    }
    let count = trial.len();
    let mut conditions: Vec<Condition> =
        (0..count).map(|sample| trial.condition(sample, config.ground_contact, body.z0)).collect();
    // near its side a vehicle has no depth that could be too large
    let deep = |c: &Condition| c.up.z >= LEAST_UPRIGHT && c.depth > DEEPEST * body.height;
    if let Some(sample) = (0..count).find(|&i| !simulated && deep(&conditions[i])) {
        let (row, depth, height) = (trial.rows[sample], conditions[sample].depth, body.height);
        let (column, _) = trial.still_water.column();
        return Err(GapError::Deep { trial: trial.name.clone(), row, column, depth, height });
    }
    let immersion = |condition: &Condition| {
        let mut immersion = Immersion::default();
        body.immerse(condition, &mut immersion);
        immersion
    };
    let immersions = conditions.iter().map(immersion).collect();
    // the motion of a computed flow is prescribed: what changes within a sample is no noise
    let exact = is_computed(&trials.manifest);
    // before anything is smoothed, or noise would hang together as well
    let mut coherence = [Coherence::default(); 10];
    for axis in 0..3 {
        let of = |value: &dyn Fn(usize) -> f64| match exact {
            true => Coherence::exact((0..count).map(value)),
            false => Coherence::of(&trial.t, &pieces, value),
        };
        coherence[axis] = of(&|i| rates(&conditions[i])[axis]);
        coherence[axis + 3] = of(&|i| rates(&conditions[i])[axis + 3]);
        coherence[axis + 7] = of(&|i| conditions[i].angular_velocity[axis]);
    }
    let recorded_rates = conditions.iter().map(rates).collect();
    if !exact {
        // a wrench that was inferred has the noise of the acceleration, its ends with it
        let derived = !trial.acceleration_is_measured && motion.is_none();
        smooth_rates(&trial.t, &pieces, &mut conditions, derived);
    }
    // the four columns say nothing of a vehicle with other wheels
    let has_four = body.has_four_wheels();
    let speeds = trial.wheel_speeds.each_ref().map(|column| column.as_ref().filter(|_| has_four));
    let wheels: Vec<[Option<f64>; 4]> =
        (0..count).map(|i| speeds.map(|column| column.map(|column| column[i]))).collect();
    let mut predicted = Vec::with_capacity(count);
    let mut uncertainty = vec![[0.0; 6]; count];
    let mut outside = vec![false; count];
    for sample in 0..count {
        let wrench = if simulated {
            std::array::from_fn(|c| trial.simulated[c].as_ref().map_or(0.0, |column| column[sample]))
        } else {
            let begins = pieces.iter().any(|piece| piece.start == sample);
            let answer = predict(&Asked {
                condition: &conditions[sample],
                wheel_speeds: all_wheels(wheels[sample]),
                time_step: if begins { 0.0 } else { trial.t[sample] - trial.t[sample - 1] },
            });
            uncertainty[sample] = answer.uncertainty;
            outside[sample] = answer.outside;
            let (f, m) = (answer.wrench.force, answer.wrench.moment);
            [f.x, f.y, f.z, m.x, m.y, m.z]
        };
        if !wrench.iter().all(|value: &f64| value.is_finite()) {
            return Err(GapError::NotFinite { trial: trial.name.clone(), row: trial.rows[sample] });
        }
        predicted.push(wrench);
    }
    let depths: Vec<f64> = conditions.iter().map(|condition| condition.depth).collect();
    let wetting_rate = wetting_rate(&trial.t, &pieces, &depths);
    coherence[6] = Coherence::of(&trial.t, &pieces, |i| wetting_rate[i]);
    let known = of_columns(&trial.known_loads, count);
    let seen: Vec<[f64; 6]> =
        predicted.iter().zip(&known).map(|(p, k)| std::array::from_fn(|c| p[c] + k[c])).collect();
    let gap = (0..count).map(|i| {
        std::array::from_fn(|c| match (&measured[c], present[c]) {
            (Some(column), true) => column[i] - seen[i][c],
            _ => 0.0,
        })
    });
    let series = Series {
        name: trial.name.clone(),
        gap: gap.collect(),
        other,
        channel_width: trials.manifest.channel_width_of(&trial.name).filter(|width| width.is_finite()),
        wetting_rate,
        inertia: motion.as_ref().map(|motion| inertia(&trial.t, &pieces, motion)),
        turning: motion.as_ref().map(|motion| turning(&trial.t, &pieces, motion)),
        dry_acceleration: motion.as_ref().and_then(|motion| motion.dry_acceleration.clone()),
        dry_rolling: motion.map_or_else(|| vec![0.0; count], |motion| motion.dry_rolling),
        coherence,
        wheels,
        yaw: trial.yaw.clone(),
        roll_pitch: trial.roll.iter().zip(&trial.pitch).map(|(r, p)| [*r, *p]).collect(),
        t: trial.t.clone(),
        calibrated: conditions.clone(),
        recorded_rates,
        conditions,
        immersions,
        known,
        seen,
        predicted,
        uncertainty,
        outside,
        bins,
        runs,
        averaged,
    };
    Ok((series, present))
}

/// Wheel speeds where all were recorded.
pub(super) fn all_wheels([fl, fr, rl, rr]: [Option<f64>; 4]) -> Option<PerWheel<f64>> {
    fl.zip(fr).zip(rl.zip(rr)).map(|((fl, fr), (rl, rr))| [fl, fr, rl, rr].into())
}

/// `a + g up` of each sample. Along an axis that is hardly accelerated there is noise alone, which would pull an error of the
/// mass to 0.
fn inertia(t: &[f64], pieces: &[Range<usize>], motion: &Motion) -> Vec<Vec3> {
    let moves = |axis: usize| Coherence::of(t, pieces, |i| motion.acceleration[i][axis]).is_a_motion();
    let accelerated = Vec3::from_fn(|axis, _| f64::from(u8::from(moves(axis))));
    let of = |(acceleration, up): (&Vec3, &Vec3)| acceleration.component_mul(&accelerated) + up * GRAVITY;
    motion.acceleration.iter().zip(&motion.up).map(of).collect()
}

/// What each moment of inertia makes of the turning, of those about which the body turns.
fn turning(t: &[f64], pieces: &[Range<usize>], motion: &Motion) -> Vec<[Vec3; 3]> {
    let turns =
        [0, 1, 2].map(|axis| Coherence::of(t, pieces, |i| motion.moments[i][axis][axis]).is_a_motion());
    let of = |alone: &[Vec3; 3]| std::array::from_fn(|axis| alone[axis] * f64::from(u8::from(turns[axis])));
    motion.moments.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let mut names = ["run10-b", "run9", "run010-a", "run2", "run1", "dry", "run10"];
        names.sort_by_key(|name| by_number(name));
        assert_eq!(names, ["dry", "run1", "run2", "run9", "run10", "run010-a", "run10-b"]);
    }
}
