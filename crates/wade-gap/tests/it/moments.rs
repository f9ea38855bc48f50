//! Promise: with a stated inertia moments are inferred from the motion as forces are, and a wrong inertia is distinguished
//! from what the water does.

use crate::planted::{self, Noise, State, motions, planted as plant, run_with, trials};
use wade_gap::{Config, Report};
use wade_learn::trials::{Method, Trials};

const TRIALS: usize = 20;
const SAMPLES: usize = 800;
/// Of the vehicle itself, about z [kg m2].
const YAW: f64 = 60.0;

/// Trials at three depths that speed up and turn to and fro; the moment about z is what is left of the inertia less the drive.
/// `load` acts on the vehicle and is not in the prediction.
fn turning(stated: Option<f64>, load: &str, factor: f64) -> Trials {
    let mut motions = motions(TRIALS, SAMPLES, 41);
    for (index, motion) in motions.iter_mut().enumerate() {
        let (phase, pace) = (index as f64, 1.2 + 0.1 * (index % 7) as f64);
        for s in motion.iter_mut() {
            let rate_before = s.w;
            (s.w.z, s.al.z) = (0.6 * (pace * s.t + phase).sin(), 0.6 * pace * (pace * s.t + phase).cos());
            s.a += (s.w - rate_before).cross(&s.v);
        }
    }
    let added: Vec<Vec<[f64; 6]>> = motions
        .iter()
        .map(|motion| plant(load, motion).into_iter().map(|w| w.map(|x| factor * x)).collect())
        .collect();
    let noise = Noise { acceleration: 0.02, ..Noise::white([0.0; 6]) };
    let mut trials = trials(&motions, &added, &noise, 41);
    let mut random = wade_learn::random::Random::new(42);
    for ((trial, motion), added) in trials.trials.iter_mut().zip(&motions).zip(&added) {
        let drive = |(s, added): (&State, &[f64; 6])| {
            YAW * s.al.z - planted::simulate(s)[5] - added[5] + 1.0 * planted::gaussian(&mut random)
        };
        trial.other_forces.insert("drive_mz".into(), motion.iter().zip(added).map(drive).collect());
        trial.measured = Default::default();
        trial.simulated = std::array::from_fn(|c| trial.simulated[c].take().filter(|_| c == 5));
    }
    trials.manifest.measured.method = Some(Method::InverseDynamics);
    trials.manifest.measured.other_forces = vec!["drive_mz".into()];
    trials.manifest.mass = Some(planted::MASS);
    trials.manifest.inertia = stated.map(|yaw| [[20.0, 0.0, 1.0], [0.0, 50.0, 0.0], [1.0, 0.0, yaw]]);
    trials
}

fn run(trials: &Trials) -> Report {
    run_with(trials, &Config::default())
}

fn names(report: &Report) -> Vec<&'static str> {
    report.effects.iter().map(|effect| effect.name).collect()
}

#[test]
fn a_moment_that_is_inferred_with_the_right_inertia_has_no_gap() {
    let report = run(&turning(Some(YAW), "nothing", 0.0));
    assert_eq!(names(&report), [""; 0], "{}", report.summary);
    assert!(report.gap.size.contains_key("mz"), "{:?}", report.gap.size);
    assert!(!report.remarks.iter().any(|said| said.contains("inertia")), "{:?}", report.remarks);
}

#[test]
fn a_wrong_inertia_is_named() {
    let report = run(&turning(Some(YAW / 0.8), "nothing", 0.0));
    assert_eq!(names(&report), ["inertia_error"], "{} {:?}", report.summary, report.rejected);
    let found = report.effects[0].parameters["yaw"].value;
    assert!((found + 0.2).abs() < 0.01, "{found}");
}

#[test]
fn damping_of_yaw_is_no_wrong_inertia() {
    let report = run(&turning(Some(YAW), "linear_damping", 0.05));
    assert_eq!(names(&report), ["linear_damping"], "{} {:?}", report.summary, report.rejected);
}

#[test]
fn without_an_inertia_no_moment_is_inferred_and_the_report_says_so() {
    let mut trials = turning(None, "nothing", 0.0);
    for trial in &mut trials.trials {
        let [fx, ..] = planted::simulate_at(trial.velocity[0], 0.1);
        trial.other_forces.insert("drive_fx".into(), vec![fx; trial.len()]);
        trial.simulated[0] = Some(trial.simulated[5].clone().unwrap());
    }
    let said = run(&trials).remarks.join("\n");
    assert!(said.contains("column drive_mz is not used") && said.contains("states the inertia"), "{said}");
}
