//! Promise: the motion alone and a known drive force say what is missing, under the noise of a recorded pose that hides it in every
//! sample; and a drive that comes late or spins up its own wheels is named as such.

use crate::planted::{self, Noise, State, gaussian, planted as plant, pushes, rms, run_with, trials};
use wade_gap::{Config, Report, Verdict};
use wade_learn::random::Random;
use wade_learn::signal::SavitzkyGolay;
use wade_learn::trials::{Method, Trials};

const TRIALS: usize = 16;
const SAMPLES: usize = 1000;

/// What a log makes of the true drive force along a motion.
type Record = dyn Fn(&[State], Vec<f64>) -> Vec<f64>;

/// Drive force that the true motion needs [N].
fn pull(state: &State, load: f64) -> f64 {
    planted::MASS * state.a.x - planted::simulate(state)[0] - load
}

/// Trials whose force along x is inferred from a pose with white noise [m], differentiated twice by a filter of nine samples.
/// `load` acts on the vehicle and is not in the prediction; `recorded` is what the log holds of a true drive force.
fn driven(pose: f64, load: &dyn Fn(&[State]) -> Vec<f64>, recorded: &Record) -> Trials {
    let mut motions = pushes(TRIALS, SAMPLES, 51);
    // to and fro, or a current could stand for what goes with speed
    motions.iter_mut().step_by(2).flatten().for_each(|state| state.yaw = std::f64::consts::PI);
    let nothing: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| vec![[0.0; 6]; motion.len()]).collect();
    let mut trials = trials(&motions, &nothing, &Noise::white([0.0; 6]), 51);
    let mut random = Random::new(52);
    let filter = SavitzkyGolay::new(9, 2).unwrap();
    for (trial, motion) in trials.trials.iter_mut().zip(&motions) {
        let step = trial.t[1] - trial.t[0];
        let noise: Vec<f64> = motion.iter().map(|_| pose * gaussian(&mut random)).collect();
        let of_velocity = filter.derivative(&noise, 1, step).unwrap();
        let of_acceleration = filter.derivative(&of_velocity, 1, step).unwrap();
        for sample in 0..motion.len() {
            trial.velocity[sample].x += of_velocity[sample];
            trial.acceleration[sample].x += of_acceleration[sample];
        }
        let forces = motion.iter().zip(load(motion)).map(|(state, load)| pull(state, load)).collect();
        let drive = recorded(motion, forces).into_iter().map(|force| force + gaussian(&mut random));
        trial.other_forces.insert("drive_fx".into(), drive.collect());
        trial.measured = Default::default();
        trial.simulated = std::array::from_fn(|c| trial.simulated[c].take().filter(|_| c == 0));
    }
    trials.manifest.measured.method = Some(Method::InverseDynamics);
    trials.manifest.measured.other_forces = vec!["drive_fx".into()];
    trials.manifest.mass = Some(planted::MASS);
    trials
}

fn as_recorded(_: &[State], force: Vec<f64>) -> Vec<f64> {
    force
}

fn no_load(motion: &[State]) -> Vec<f64> {
    vec![0.0; motion.len()]
}

fn run(trials: &Trials) -> Report {
    run_with(trials, &Config::default())
}

fn names(report: &Report) -> Vec<&'static str> {
    report.effects.iter().map(|effect| effect.name).collect()
}

#[test]
fn damping_that_the_noise_of_a_pose_hides_in_every_sample_is_named() {
    const FACTOR: f64 = 0.006;
    let damping = |motion: &[State]| -> Vec<f64> {
        plant("linear_damping", motion).into_iter().map(|load| FACTOR * load[0]).collect()
    };
    let trials = driven(0.5e-3, &damping, &as_recorded);
    let report = run(&trials);
    assert_eq!(names(&report), ["linear_damping"], "{} {:?}", report.summary, report.rejected);
    let found = &report.effects[0].parameters["surge"];
    assert!((found.value - FACTOR).abs() < 3.0 * found.std + 0.1 * FACTOR, "{found:?}");
    let planted: Vec<Vec<[f64; 6]>> =
        pushes(TRIALS, SAMPLES, 51).iter().map(|motion| plant("linear_damping", motion)).collect();
    let noise = report.gap.floors["fx"].sample;
    assert!(FACTOR * rms(&planted)[0] < 0.3 * noise, "{} {noise}", FACTOR * rms(&planted)[0]);
}

#[test]
fn a_motion_with_nothing_missing_has_no_gap_whatever_the_noise_of_its_pose() {
    for pose in [0.1e-3, 0.5e-3, 2e-3] {
        let report = run(&driven(pose, &no_load, &as_recorded));
        assert_eq!(report.verdict, Verdict::NothingMissing, "{pose}: {}", report.summary);
    }
}

#[test]
fn a_drive_that_lags_is_named_with_its_time_constant_and_one_that_is_recorded_late_with_its_delay() {
    const LAG: f64 = 0.15;
    let before_lag = |motion: &[State], force: Vec<f64>| -> Vec<f64> {
        // what a lag of first order makes the true force of: F + tau dF/dt
        let step = 1.0 / planted::RATE;
        let rate =
            |i: usize| (force[(i + 1).min(motion.len() - 1)] - force[i.saturating_sub(1)]) / (2.0 * step);
        (0..motion.len()).map(|i| force[i] + LAG * rate(i)).collect()
    };
    const LATE: usize = 8;
    let late = |motion: &[State], force: Vec<f64>| -> Vec<f64> {
        (0..motion.len()).map(|i| force[i.saturating_sub(LATE)]).collect()
    };
    for (recorded, truth) in [(&before_lag as &Record, LAG), (&late, -(LATE as f64) / planted::RATE)] {
        let report = run(&driven(0.1e-3, &no_load, recorded));
        assert_eq!(names(&report), ["drive_delay"], "{} {:?}", report.summary, report.rejected);
        let found = report.effects[0].parameters["delay"].value;
        assert!((found / truth - 1.0).abs() < 0.1, "{found}, planted {truth}");
    }
}

#[test]
fn wheels_that_take_force_to_spin_up_are_named_or_stand_beside_an_error_of_the_mass() {
    const SHARE: f64 = 0.15;
    let spinning = |motion: &[State]| -> Vec<f64> {
        motion.iter().map(|state| -SHARE * planted::MASS * state.a.x).collect()
    };
    let report = run(&driven(0.1e-3, &spinning, &as_recorded));
    let possible: Vec<&str> = names(&report).into_iter().chain(report.alternatives.concat()).collect();
    assert!(possible.contains(&"rotating_inertia"), "{} {:?}", report.summary, report.rejected);
    assert!(!possible.contains(&"linear_damping"), "{}", report.summary);
    let [found] = &report.effects[..] else { panic!("{}", report.summary) };
    let value = found.parameters.values().next().unwrap().value;
    assert!((value / SHARE - 1.0).abs() < 0.1, "{value}");
}
