//! Promise: means of fast samples say of an effect what the samples say, a short event keeps its bins, and a model is asked
//! about the means alone.

use crate::planted::{DRAFT, Noise, RHO, State, VOLUME, motions_at, planted as plant, rms, run_with, trials};
use wade_core::wrench::Wrench;
use wade_gap::{Config, Parameter, Predicted, Report};
use wade_learn::trials::{Trial, Trials};

const NOISE: [f64; 6] = [24.0, 24.0, 36.0, 12.0, 12.0, 12.0];

/// Trials of six seconds in which linear damping acts, and the factor it was planted with.
fn damped(rate: f64, count: usize) -> (Trials, f64) {
    let motions = motions_at(rate, count, (6.0 * rate) as usize, 11);
    let mut load: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| plant("linear_damping", motion)).collect();
    let factor = NOISE[0] / rms(&load)[0];
    load.iter_mut().flatten().flatten().for_each(|value| *value *= factor);
    (trials(&motions, &load, &Noise::white(NOISE), 11), factor)
}

fn run(trials: &Trials) -> Report {
    run_with(trials, &Config::default())
}

/// Every so many samples of a trial, each as it was recorded.
fn every(trial: &Trial, stride: usize) -> Trial {
    let windows: Vec<_> = (0..trial.len()).step_by(stride).map(|sample| sample..sample + 1).collect();
    trial.averaged(&windows)
}

fn surge(report: &Report) -> &Parameter {
    let names: Vec<&str> = report.effects.iter().map(|effect| effect.name).collect();
    assert_eq!(names, ["linear_damping"], "{} {:?}", report.summary, report.rejected);
    &report.effects[0].parameters["surge"]
}

#[test]
fn means_of_fast_samples_name_the_effect_that_the_samples_name_with_the_same_number() {
    let (fast, truth) = damped(950.0, 12);
    // 190 Hz are worked on as they are
    let slow = Trials { trials: fast.trials.iter().map(|trial| every(trial, 5)).collect(), ..fast.clone() };
    let (averaged, full) = (run(&fast), run(&slow));
    let rows = |trials: &Trials| trials.trials.iter().map(Trial::len).sum::<usize>();
    assert_eq!(full.samples, rows(&slow), "the control is not averaged");
    assert!(averaged.samples * 8 < rows(&fast), "{} of {}", averaged.samples, rows(&fast));
    let says = |report: &Report| report.remarks.iter().any(|remark| remark.contains("samples were averaged"));
    assert!(says(&averaged) && !says(&full), "{:?}", averaged.remarks);
    let (own, control) = (surge(&averaged), surge(&full));
    for (name, found) in [("means", own), ("samples", control)] {
        let [low, high] = found.interval;
        assert!((low..=high).contains(&truth), "{name}: {found:?}, planted {truth}");
        assert!(
            (low..=high).contains(&own.value) && (low..=high).contains(&control.value),
            "{own:?} {control:?}"
        );
    }
    assert!(own.std < 1.05 * control.std, "means lose nothing: {own:?} {control:?}");
    // the noise of a mean of nine is a third of that of a sample
    for (name, std) in [("fx", NOISE[0]), ("fz", NOISE[2])] {
        assert!(
            (averaged.gap.floors[name].sample / (std / 3.0) - 1.0).abs() < 0.1,
            "{name}: {:?}",
            averaged.gap
        );
        assert!((full.gap.floors[name].sample / std - 1.0).abs() < 0.1, "{name}: {:?}", full.gap);
    }
}

#[test]
fn noise_that_is_stated_of_a_sample_is_less_in_a_mean() {
    let (mut fast, _) = damped(950.0, 8);
    fast.manifest.sensor_noise.insert("fx".into(), 10.0 * NOISE[0]);
    let floor = run(&fast).gap.floors["fx"];
    assert!((floor.sample / (10.0 * NOISE[0] / 3.0) - 1.0).abs() < 0.01, "{floor:?}");
}

/// Trials of 1.5 s at 4 kHz in which a load of 20 ms acts when the hull enters.
fn drops(count: usize, samples: usize) -> Trials {
    const RATE: f64 = 4000.0;
    let step = |t: f64| if t > 0.0 { t } else { 0.0 };
    let motion = |index: usize| -> Vec<State> {
        let (entry, speed) = (0.4 + 0.023 * index as f64, 0.6 + 0.05 * index as f64);
        let at = |i: usize| {
            let t = i as f64 / RATE;
            let depth = (0.02 + speed * step(t - entry)).min(0.2);
            let depth_rate = if t > entry && depth < 0.2 { speed } else { 0.0 };
            let v = [0.3, 0.0, -depth_rate].into();
            let zero = [0.0; 3].into();
            State { t, v, w: zero, a: zero, al: zero, depth, depth_rate, yaw: 0.0 }
        };
        (0..samples).map(at).collect()
    };
    let motions: Vec<Vec<State>> = (0..count).map(motion).collect();
    let peak = |motion: &[State]| -> Vec<[f64; 6]> {
        let entry = motion.iter().position(|s| s.depth_rate > 0.0).unwrap_or(motion.len());
        let load = |(i, s): (usize, &State)| {
            let into = (i as f64 - entry as f64) / (0.02 * RATE);
            let pulse = if (0.0..1.0).contains(&into) { (std::f64::consts::PI * into).sin() } else { 0.0 };
            [0.0, 0.0, RHO * VOLUME / DRAFT * s.depth_rate.powi(2) * pulse, 0.0, 0.0, 0.0]
        };
        motion.iter().enumerate().map(load).collect()
    };
    let loads: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| peak(motion)).collect();
    trials(&motions, &loads, &Noise::white([2.0; 6]), 3)
}

#[test]
fn a_peak_of_20_ms_at_4_khz_keeps_its_bin() {
    let trials = drops(24, 6000);
    let report = run(&trials);
    let rows = trials.trials.iter().map(Trial::len).sum::<usize>();
    assert!(report.samples * 8 < rows, "{} of {rows}", report.samples);
    assert!(report.traces.iter().any(|trace| trace.component == "fz"), "the peaks are the largest gaps");
    for trace in &report.traces {
        let trial = trials.trials.iter().find(|trial| trial.name == trace.trial).expect("it is one of them");
        let component = ["fx", "fy", "fz", "mx", "my", "mz"].iter().position(|c| *c == trace.component);
        let component = component.expect("a component");
        let (measured, simulated) = (&trial.measured[component], &trial.simulated[component]);
        let (measured, simulated) = (measured.as_ref().expect("it is"), simulated.as_ref().expect("it is"));
        let gap: Vec<f64> = measured.iter().zip(simulated).map(|(m, s)| m - s).collect();
        let bins: Vec<f64> = gap.chunks(400).map(|bin| bin.iter().sum::<f64>() / bin.len() as f64).collect();
        assert_eq!(trace.before.len(), bins.len());
        for (found, bin) in trace.before.iter().zip(&bins) {
            assert!((found - bin).abs() < 1e-6, "{}: {found} {bin}", trace.trial);
        }
        let highest = bins.iter().copied().fold(0.0, f64::max);
        let high = bins.iter().filter(|bin| **bin > 0.3 * highest).count();
        assert!(trace.component != "fz" || high <= 2, "the peak is in a bin or two: {bins:?}");
    }
}

#[test]
fn trials_of_16_ms_at_4_khz_are_worked_on_as_they_are() {
    let trials = drops(36, 64);
    assert_eq!(run(&trials).samples, 36 * 64);
}

#[test]
fn a_model_is_asked_about_the_means() {
    let (mut fast, _) = damped(950.0, 8);
    let rows = fast.trials.iter().map(Trial::len).sum::<usize>();
    fast.trials.iter_mut().for_each(|trial| trial.simulated = Default::default());
    let body = wade_gap::body_of(&fast).expect("a body");
    let mut asked = 0;
    let mut predict = |_: &wade_gap::Asked<'_>| {
        asked += 1;
        Predicted { wrench: Wrench::default(), uncertainty: [0.0; 6], outside: false }
    };
    let report = wade_gap::run(&fast, &body, &mut predict, &Config::default()).expect("runs");
    assert!(asked >= report.samples && report.samples * 8 < rows, "{asked} for {} of {rows}", report.samples);
}
