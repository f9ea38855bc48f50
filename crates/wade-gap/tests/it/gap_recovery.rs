//! Promise: the gap workflow names what is missing, says when nothing is, when two things cannot be told apart and when no
//! effect of the library fits; the same whatever the order of the trials and for a mirrored vehicle.
//!
//! Effects are planted by formulas of `common/planted.rs`, on a box with another simulator's prediction.

use crate::planted::{
    self, Noise, State, gaussian, motions, planted as plant, pushes, rms, run_with, trials,
};
use wade_core::effects::{Effect, RegionQuantity};
use wade_core::frame::Vec3;
use wade_core::wrench::Wrench;
use wade_gap::{Asked, Config, Predicted, Report, Verdict};
use wade_learn::random::Random;
use wade_learn::trials::{Method, StillWater, Trials};

pub(super) const NOISE: [f64; 6] = [8.0, 8.0, 12.0, 4.0, 4.0, 4.0];
pub(super) const TRIALS: usize = 20;
pub(super) const SAMPLES: usize = 800;

/// Trials with effects planted so that the strongest component of each is `strength` times its noise, and their factors.
pub(super) fn with(names: &[&str], strength: f64, seed: u64) -> (Trials, Vec<f64>) {
    with_motions(&motions(TRIALS, SAMPLES, seed), names, strength, seed)
}

fn with_motions(motions: &[Vec<State>], names: &[&str], strength: f64, seed: u64) -> (Trials, Vec<f64>) {
    let mut sum: Vec<Vec<[f64; 6]>> = motions.iter().map(|m| vec![[0.0; 6]; m.len()]).collect();
    let mut factors = Vec::new();
    for name in names {
        let unit: Vec<Vec<[f64; 6]>> = motions.iter().map(|m| plant(name, m)).collect();
        let size = rms(&unit);
        let ratio = [0, 2, 4, 5].map(|c| size[c] / NOISE[c]).into_iter().fold(0.0, f64::max);
        // a delay and a current are planted at one size
        let factor = if matches!(*name, "sensor_delay" | "current") { 1.0 } else { strength / ratio };
        for (sum, unit) in sum.iter_mut().flatten().zip(unit.iter().flatten()) {
            (0..6).for_each(|c| sum[c] += factor * unit[c]);
        }
        factors.push(factor);
    }
    (trials(motions, &sum, &Noise::white(NOISE), seed), factors)
}

pub(super) fn run(trials: &Trials) -> Report {
    run_with(trials, &Config::default())
}

pub(super) fn names(report: &Report) -> Vec<&'static str> {
    report.effects.iter().map(|effect| effect.name).collect()
}

/// The planted value lies within the stated errors and 5 %, and the gap of the trials kept back closes.
fn recovered(name: &str, parameter: &str, per_factor: f64, strength: f64) {
    let (trials, factors) = with(&[name], strength, 11);
    let report = run(&trials);
    assert_eq!(report.verdict, Verdict::Named, "{name}: {} {:?}", report.summary, report.rejected);
    assert_eq!(names(&report), [name]);
    let found = &report.effects[0].parameters[parameter];
    let truth = factors[0] * per_factor;
    let room = 3.0 * found.std + 0.05 * truth.abs();
    assert!((found.value - truth).abs() < room, "{name}: {found:?}, planted {truth}");
    let closure = report.gap.held_out["all"].closure.expect("a gap");
    assert!(closure > 0.85, "{name}: {closure}");
    assert!(report.gap.worse_regions.is_empty(), "{name}: {:?}", report.gap.worse_regions);
}

#[test]
fn effects_of_the_water_are_named_with_their_size() {
    for (name, parameter, strength) in [
        ("added_mass", "surge", 1.0),
        ("linear_damping", "surge", 1.0),
        ("rotation", "drag_coefficient", 3.0),
        ("hull_lift", "yaw_of_drift", 3.0),
        ("water_level_offset", "offset", 3.0),
        ("wave_memory", "surge", 3.0),
        ("squat", "sinkage", 1.0),
        ("hull_flooding", "flooded_share", 3.0),
    ] {
        recovered(name, parameter, 1.0, strength);
    }
    recovered("current", "east", 0.3, 1.0);
}

/// Trials of short pushes with loads planted at three times the noise, and the factor that took.
fn pushed(load: impl Fn(&[State]) -> Vec<[f64; 6]>) -> (Trials, f64) {
    let motions = pushes(TRIALS, SAMPLES, 21);
    let mut sum: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| load(motion)).collect();
    let size = rms(&sum);
    let factor = 3.0 / [0, 2, 4].map(|c| size[c] / NOISE[c]).into_iter().fold(0.0, f64::max);
    sum.iter_mut().flatten().flatten().for_each(|value| *value *= factor);
    let mut trials = trials(&motions, &sum, &Noise::white(NOISE), 21);
    trials.trials.iter_mut().for_each(|trial| trial.acceleration_is_measured = false);
    (trials, factor)
}

#[test]
fn wheels_that_spin_thrust_by_what_they_slip() {
    // wheels of 0.25 m, which no table states: they roll in most trials and spin in some
    const RADIUS: f64 = 0.25;
    let slips = |s: &State| if (s.depth - 0.2).abs() < 0.01 { 6.0 * (0.9 * s.t).sin().powi(2) } else { 0.0 };
    let turning = |s: &State| s.v.x / RADIUS + slips(s);
    let thrust = |s: &State| {
        let rim = turning(s) * RADIUS;
        let area = 4.0 * std::f64::consts::PI * RADIUS * RADIUS * s.depth / (2.0 * RADIUS);
        let force = 500.0 * area * rim.abs() * (rim - s.v.x);
        // at the hubs, which lie 0.15 m above the center of mass
        [force, 0.0, 0.0, 0.0, (RADIUS - 0.1) * force, 0.0]
    };
    let (mut trials, factor) = pushed(|motion| motion.iter().map(thrust).collect());
    for (trial, motion) in trials.trials.iter_mut().zip(pushes(TRIALS, SAMPLES, 21)) {
        let speeds: Vec<f64> = motion.iter().map(turning).collect();
        trial.wheel_speeds = std::array::from_fn(|_| Some(speeds.clone()));
    }
    let report = run(&trials);
    assert_eq!(names(&report), ["wheel_paddle_thrust"], "{} {:?}", report.summary, report.rejected);
    let found = report.effects[0].parameters["thrust"].value;
    assert!((found / factor - 1.0).abs() < 0.1, "{found}, planted {factor}");
}

#[test]
fn a_driving_bed_is_told_by_its_lift_and_by_what_it_does_along_and_across() {
    const DRAG: f64 = -0.1;
    const LIFT: f64 = -0.15;
    const SIDE: f64 = 0.3;
    // half of the trials drift; every second one is the one before once more, parked in a current
    let mut motions = pushes(2 * TRIALS, SAMPLES, 21);
    for (index, pair) in motions.chunks_mut(2).enumerate() {
        if index % 2 == 0 {
            pair[0].iter_mut().for_each(|s| (s.v.y, s.a.y) = (0.3 * s.v.x, 0.3 * s.a.x));
        }
        pair[1] = pair[0].clone();
    }
    let bed = |s: &State| {
        let load = 0.5 * planted::RHO * planted::WIDTH * s.depth * s.v.norm();
        [-DRAG * load * s.v.x, -(DRAG + SIDE) * load * s.v.y, LIFT * load * s.v.norm(), 0.0, 0.0, 0.0]
    };
    let loads: Vec<Vec<[f64; 6]>> = motions
        .iter()
        .enumerate()
        .map(|(index, motion)| {
            motion.iter().map(|s| if index % 2 == 0 { bed(s) } else { [0.0; 6] }).collect()
        })
        .collect();
    let mut trials = trials(&motions, &loads, &Noise::white(NOISE), 21);
    for (index, trial) in trials.trials.iter_mut().enumerate() {
        (3..6).for_each(|c| trial.measured[c] = None);
        if index % 2 == 1 {
            trial.current = trial.velocity.iter().map(|v| -v).collect();
            trial.velocity.fill(Vec3::zeros());
            trial.acceleration.fill(Vec3::zeros());
        }
    }
    let report = run(&trials);
    assert_eq!(names(&report), ["bed_motion"], "{} {:?}", report.summary, report.rejected);
    for (name, planted) in [("drag", DRAG), ("lift", LIFT), ("side", SIDE)] {
        let found = &report.effects[0].parameters[name];
        assert!((found.value - planted).abs() < 3.0 * found.std + 0.1 * planted.abs(), "{name}: {found:?}");
    }
}

#[test]
fn a_trial_whose_zero_is_said_to_wander_is_no_gap() {
    let motions = motions(TRIALS, SAMPLES, 5);
    // three cells that were mounted badly
    let zero = |trial: usize| if trial.is_multiple_of(7) { 10.0 * NOISE[0] } else { 0.0 };
    let zeros: Vec<Vec<[f64; 6]>> =
        (0..TRIALS).map(|trial| vec![[zero(trial), 0.0, 0.0, 0.0, 0.0, 0.0]; SAMPLES]).collect();
    let mut trials = trials(&motions, &zeros, &Noise::white(NOISE), 5);
    let unsaid = run(&trials);
    assert_ne!(unsaid.verdict, Verdict::NothingMissing, "{}", unsaid.summary);
    let wanders = |trial: usize| (format!("run{trial:02}"), [("fx".to_owned(), 10.0 * NOISE[0])].into());
    trials.manifest.trial_offsets = (0..TRIALS).step_by(7).map(wanders).collect();
    let said = run(&trials);
    assert_eq!(said.verdict, Verdict::NothingMissing, "{} {:?}", said.summary, said.gap.unexplained);
}

/// A load of the planted laws in water of less than 0.15 m alone.
fn in_shallow_water(load: impl Fn(&[State]) -> Vec<[f64; 6]>) -> Trials {
    let shallow = |(load, s): ([f64; 6], &State)| if s.depth < 0.15 { load } else { [0.0; 6] };
    pushed(|motion| load(motion).into_iter().zip(motion).map(shallow).collect()).0
}

#[test]
fn an_effect_in_shallow_water_alone_is_named_with_its_border_and_applied_there() {
    let trials = in_shallow_water(|motion| plant("drag_coefficient_error", motion));
    let report = run(&trials);
    assert_eq!(report.verdict, Verdict::Named, "{} {:?}", report.summary, report.gap.unexplained);
    assert_eq!(names(&report), ["drag_coefficient_error"]);
    assert!(report.summary.contains("drag coefficient error where depth <="), "{}", report.summary);
    let file = wade_gap::effects_file(&report, &trials, false).expect("named");
    let [limit] = file.effects[0].region.limits[..] else { panic!("{:?}", file.effects[0].region) };
    let [low, high] = limit.at_most.expect("an upper border");
    assert_eq!((limit.quantity, limit.above), (RegionQuantity::Depth, None));
    assert!(low <= 0.15 && 0.15 <= high && high - low < 0.1, "{low} to {high}");
    assert!(report.gap.held_out["all"].closure.expect("a gap") > 0.8, "{}", report.summary);
}

#[test]
fn a_zero_in_shallow_water_alone_is_described_there_and_not_named() {
    let report = run(&in_shallow_water(|motion| plant("sensor_bias", motion)));
    assert_eq!(report.verdict, Verdict::NoCandidateFits, "{} {:?}", report.summary, names(&report));
    let text = report.gap.unexplained.clone().unwrap_or_default();
    assert!(text.contains("where depth <=") && report.effects.is_empty(), "{text}");
    // whatever was found and is not named is told with what it would explain
    let told = |name: &str| report.rejected.iter().any(|rejected| rejected.name == name);
    let untold: Vec<_> =
        report.excitation.iter().filter(|e| e.not_testable.is_none() && !told(e.name)).collect();
    assert!(untold.is_empty(), "{untold:?}");
    let border = |region: &wade_gap::Region| match &region.conditions[..] {
        [one] if one.quantity == "depth" => one.at_most,
        _ => None,
    };
    let borders: Vec<f64> = report.regions.iter().filter_map(border).collect();
    assert!(borders.iter().any(|border| (0.1..0.2).contains(border)), "{:?}", report.regions);
    // the fit to the region is no test of it, and counts its cuts; 7 of the trials are shallow
    let fitted = report.regions.iter().find(|region| region.p_value.is_none()).expect("the one of the text");
    assert!(fitted.trials <= 7 && report.regions_tried > 1000, "{fitted:?} {}", report.regions_tried);
    assert!(report.regions.iter().all(|region| region.trials <= 7), "{:?}", report.regions);
}

#[test]
fn pushes_of_half_a_second_hardly_bias_a_delay() {
    let motions = pushes(TRIALS, SAMPLES, 22);
    let late: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| plant("sensor_delay", motion)).collect();
    let report = run(&planted::trials(&motions, &late, &Noise::white(NOISE), 22));
    assert_eq!(names(&report), ["sensor_delay"], "{} {:?}", report.summary, report.rejected);
    let delay = report.effects[0].parameters["delay"].value;
    // the differences of the prediction still take a few hundredths off such pushes
    assert!((delay / 0.08 - 1.0).abs() < 0.08, "{delay}");
}

#[test]
fn a_wrong_mass_is_found_by_pushes_of_half_a_second() {
    let motions = pushes(TRIALS, SAMPLES, 23);
    let nothing: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| vec![[0.0; 6]; motion.len()]).collect();
    let mut trials = trials(&motions, &nothing, &Noise::white(NOISE), 23);
    trials.manifest.measured.method = Some(Method::InverseDynamics);
    // a tenth of the true mass too much
    trials.manifest.mass = Some(1.1 * planted::MASS);
    for (trial, motion) in trials.trials.iter_mut().zip(&motions) {
        let drive = |s: &State| planted::MASS * s.a.x - planted::simulate(s)[0];
        trial.other_forces.insert("drive_fx".into(), motion.iter().map(drive).collect());
        trial.measured = Default::default();
        trial.simulated = std::array::from_fn(|c| trial.simulated[c].take().filter(|_| c == 0));
    }
    let report = run(&trials);
    assert_eq!(names(&report), ["mass_error"], "{} {:?}", report.summary, report.rejected);
    let found = report.effects[0].parameters["relative_error"].value;
    assert!((found / (-0.1 / 1.1) - 1.0).abs() < 0.05, "{found}");
}

/// Trials whose wrench along x is inferred, each less its dry twin: the same pushes without water, at other speeds. The true
/// mass over the stated one, the true drive force over the stated one, and a coefficient of rolling.
pub(super) fn with_dry_twins(mass: f64, drive: f64, rolling: f64) -> Trials {
    const G: f64 = 9.81;
    let motion = |seed: u64, wet: bool| {
        let mut motions = pushes(TRIALS, SAMPLES, seed);
        motions.iter_mut().flatten().for_each(|s| s.depth = if wet { s.depth } else { -0.1 });
        motions
    };
    let told = |motions: &[Vec<State>], wet: bool, seed: u64| {
        let nothing: Vec<Vec<[f64; 6]>> = motions.iter().map(|m| vec![[0.0; 6]; m.len()]).collect();
        let noise = Noise { acceleration: 0.02, ..Noise::white(NOISE) };
        let mut told = trials(motions, &nothing, &noise, seed);
        for (trial, motion) in told.trials.iter_mut().zip(motions) {
            let pull = |s: &State| {
                let [fx, _, fz, ..] = if wet { planted::simulate(s) } else { [0.0; 6] };
                let load = (planted::MASS * G - fz).max(0.0);
                planted::MASS * s.a.x - fx + rolling * load * s.v.x / s.v.x.hypot(0.05)
            };
            trial.other_forces.insert("drive_fx".into(), motion.iter().map(|s| pull(s) / drive).collect());
            trial.measured = Default::default();
        }
        told
    };
    let mut all = told(&motion(31, true), true, 31);
    let mut dry = told(&motion(32, false), false, 32).trials;
    dry.iter_mut().for_each(|trial| trial.name = trial.name.replace("run", "dry"));
    let twin = |trial: &wade_learn::trials::Trial| (trial.name.clone(), trial.name.replace("run", "dry"));
    all.manifest.measured.dry_twins = all.trials.iter().map(twin).collect();
    all.manifest.measured.method = Some(Method::InverseDynamics);
    all.manifest.measured.other_forces = vec!["drive_fx".into()];
    all.manifest.mass = Some(planted::MASS / mass);
    all.trials.extend(dry);
    all
}

#[test]
fn errors_of_mass_and_drive_and_rolling_are_found_in_wrenches_less_those_of_dry_twins() {
    for (name, parameter, truth, trials) in [
        ("mass_error", "relative_error", -0.1, with_dry_twins(0.9, 1.0, 0.0)),
        ("drive_gain", "relative_error", 0.1, with_dry_twins(1.0, 1.1, 0.0)),
        ("rolling_resistance", "coefficient", 0.05, with_dry_twins(1.0, 1.0, 0.05)),
    ] {
        // a drive is inertia and drag: a gain of it is an error of both
        let library = vec![Effect::MassError, Effect::DriveGain, Effect::RollingResistance];
        let report = run_with(&trials, &Config { library, ..Config::default() });
        assert_eq!(names(&report), [name], "{} {:?}", report.summary, report.rejected);
        let found = report.effects[0].parameters[parameter].value;
        assert!((found / truth - 1.0).abs() < 0.06, "{name}: {found}, planted {truth}");
    }
}

#[test]
fn the_pitch_moment_of_rolling_at_the_ground_is_no_zero_of_the_sensor() {
    const ROLLING: f64 = 0.05;
    const LEVER_M: f64 = 0.3;
    let motions = pushes(TRIALS, SAMPLES, 34);
    let load = |s: &State| {
        let on_wheels = (planted::MASS * 9.81 - planted::simulate(s)[2]).max(0.0);
        let back = ROLLING * on_wheels * s.v.x / s.v.x.hypot(0.05);
        [-back, 0.0, 0.0, 0.0, LEVER_M * back, 0.0]
    };
    let loads: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| motion.iter().map(load).collect()).collect();
    let mut trials = trials(&motions, &loads, &Noise::white(NOISE), 34);
    trials.manifest.measured.method = Some(Method::InverseDynamics);
    let library = vec![Effect::RollingResistance, Effect::SensorBias];
    let report = run_with(&trials, &Config { library, ..Config::default() });
    assert_eq!(names(&report), ["rolling_resistance"], "{} {:?}", report.summary, report.rejected);
    let found = |name| report.effects[0].parameters[name].value;
    assert!((found("coefficient") / ROLLING - 1.0).abs() < 0.06, "{}", found("coefficient"));
    assert!((found("pitch") / (ROLLING * LEVER_M) - 1.0).abs() < 0.06, "{}", found("pitch"));
}

#[test]
fn a_report_says_what_an_inferred_wrench_rests_on_where_the_trials_leave_it_open() {
    let remarks = |change: &dyn Fn(&mut Trials)| {
        let mut trials = with_dry_twins(1.0, 1.0, 0.0);
        change(&mut trials);
        run(&trials).remarks.join("\n")
    };
    let stated = remarks(&|_| ());
    assert!(!stated.contains("mass") && !stated.contains("column"), "{stated}");
    let open = remarks(&|trials| {
        trials.manifest.mass = None;
        trials.manifest.measured.other_forces.extend(["brake_fx".into(), "drive_mz".into()]);
        for trial in &mut trials.trials {
            let zero = vec![0.0; trial.len()];
            trial.other_forces.extend([("brake_fx".into(), zero.clone()), ("drive_mz".into(), zero)]);
        }
    });
    for said in [
        "trials.toml states no mass: the wrench is inferred with the vehicle's, 280 kg",
        "column brake_fx is 0 in every row: no such force acts on the vehicle",
        "column drive_mz is not used: a moment is inferred from the motion where trials.toml states the inertia",
    ] {
        assert!(open.contains(said), "{open}");
    }
}

#[test]
fn an_effect_of_all_trials_is_not_provisional_for_a_part_of_it_that_two_show() {
    let mut motions = pushes(TRIALS, SAMPLES, 24);
    for motion in &mut motions[4..6] {
        motion.iter_mut().for_each(|s| s.v.y = 0.5 * (1.3 * s.t).sin());
    }
    let damping: Vec<Vec<[f64; 6]>> = motions
        .iter()
        .map(|motion| plant("linear_damping", motion).into_iter().map(|w| w.map(|x| 0.05 * x)).collect())
        .collect();
    let report = run(&trials(&motions, &damping, &Noise::white(NOISE), 24));
    assert_eq!(names(&report), ["linear_damping"], "{} {:?}", report.summary, report.rejected);
    let effect = &report.effects[0];
    assert!(effect.parameters.contains_key("sway") && !effect.provisional, "{effect:?}");
}

/// Loads of half the error that the model states: `load` of a unit effect, and a bias of the model's drag beside it.
fn within_the_model_s_error(name: &str, bias: f64) -> (Report, f64) {
    let motions = motions(TRIALS, SAMPLES, 25);
    let unit: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| plant(name, motion)).collect();
    let factor = 3.0 * NOISE[0] / rms(&unit)[0];
    let drag: Vec<Vec<[f64; 6]>> =
        motions.iter().map(|motion| plant("drag_coefficient_error", motion)).collect();
    let wrong = bias * factor * rms(&unit)[0] / rms(&drag)[0];
    let added: Vec<Vec<[f64; 6]>> = unit
        .iter()
        .zip(&drag)
        .map(|(unit, drag)| {
            let sum = |(u, d): (&[f64; 6], &[f64; 6])| std::array::from_fn(|c| factor * u[c] + wrong * d[c]);
            unit.iter().zip(drag).map(sum).collect()
        })
        .collect();
    (run_with_doubts(trials(&motions, &added, &Noise::white(NOISE), 25)), factor)
}

/// The workflow with a model that states six noises of itself.
fn run_with_doubts(trials: Trials) -> Report {
    run_outside(trials, f64::INFINITY)
}

/// The same with a model that learnt nothing of water deeper than this.
fn run_outside(trials: Trials, deepest: f64) -> Report {
    run_with_errors(trials, deepest, |_| 6.0)
}

/// The same with a model that states so many noises of itself at a depth.
fn run_with_errors(mut trials: Trials, deepest: f64, noises: impl Fn(f64) -> f64) -> Report {
    trials.trials.iter_mut().for_each(|trial| trial.simulated = Default::default());
    let body = wade_gap::body_of(&trials).expect("a body");
    let mut model = |asked: &Asked<'_>| {
        let condition = asked.condition;
        let [fx, fy, fz, mx, my, mz] = planted::simulate_at(condition.velocity, condition.depth);
        let wrench = Wrench { force: Vec3::new(fx, fy, fz), moment: Vec3::new(mx, my, mz) };
        let uncertainty = NOISE.map(|noise| noises(condition.depth) * noise);
        Predicted { wrench, uncertainty, outside: condition.depth > deepest }
    };
    let report = wade_gap::run(&trials, &body, &mut model, &Config::default()).expect("runs");
    planted::check(&report);
    report
}

#[test]
fn trials_that_the_model_did_not_learn_are_kept_back_only_where_there_are_too_few_others() {
    let deep = |name: &str| name.trim_start_matches("run").parse::<usize>().expect("a number") % 3 == 2;
    let kept_back = |deepest: f64| {
        let report = run_outside(with(&["added_mass"], 3.0, 33).0, deepest);
        assert_eq!(names(&report), ["added_mass"], "{}", report.summary);
        report.gap.held_out_trials
    };
    // a third of the trials go as deep as 0.25 m
    let held = kept_back(0.22);
    assert!(held.len() == 4 && !held.iter().any(|name| deep(name)), "{held:?}");
    assert!(kept_back(f64::INFINITY).iter().any(|name| deep(name)));
    // none is learnt: some must be kept back all the same
    assert_eq!(kept_back(0.0).len(), 4);
}

#[test]
fn what_the_model_is_not_told_is_named_however_wrong_the_model_says_it_is_and_what_it_is_told_is_not() {
    for bias in [0.0, 0.2] {
        let (report, factor) = within_the_model_s_error("added_mass", bias);
        assert_eq!(names(&report), ["added_mass"], "{} {:?}", report.summary, report.rejected);
        let found = report.effects[0].parameters["surge"].value;
        assert!((found / factor - 1.0).abs() < 0.2, "{found}, planted {factor}");
    }
    // a drag of that size is what the model said of itself
    let (report, _) = within_the_model_s_error("drag_coefficient_error", 0.0);
    assert!(report.effects.is_empty(), "{} {:?}", report.summary, names(&report));
}

#[test]
fn an_error_of_the_stated_size_that_is_a_function_of_the_state_hides_no_added_mass_and_is_no_effect() {
    // alike everywhere; and large where the model learnt nothing, which a third of the trials are in
    of_the_stated_size(f64::INFINITY, |_| 6.0, 6.0);
    of_the_stated_size(0.22, |depth| if depth > 0.22 { 60.0 } else { 0.5 }, 2.0);
}

/// With an error of so many noises at a depth, as a model states that learnt nothing of deeper water, and with an added mass of so many
/// besides, of a third of it, and without.
fn of_the_stated_size(deepest: f64, noises: impl Fn(f64) -> f64 + Copy, added_mass: f64) {
    let motions = motions(TRIALS, SAMPLES, 26);
    let unit: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| plant("added_mass", motion)).collect();
    let factor = added_mass * NOISE[0] / rms(&unit)[0];
    let mut random = Random::new(26);
    // waves over velocity and depth, together as large as the model says
    let mut wave_number = |scale: f64| gaussian(&mut random) / scale;
    let waves: [[[f64; 4]; 8]; 6] = std::array::from_fn(|_| {
        std::array::from_fn(|_| [wave_number(0.5), wave_number(0.5), wave_number(0.1), wave_number(0.3)])
    });
    let wave = |s: &State| {
        waves.map(|of| {
            let one = |[x, y, deep, phase]: [f64; 4]| (x * s.v.x + y * s.v.y + deep * s.depth + phase).sin();
            of.map(one).iter().sum::<f64>()
        })
    };
    let sizes = rms(&motions.iter().map(|motion| motion.iter().map(wave).collect()).collect::<Vec<_>>());
    let of_the_state = |s: &State, c: usize| noises(s.depth) * NOISE[c] * wave(s)[c] / sizes[c];
    for share in [1.0, 1.0 / 3.0, 0.0] {
        let factor = share * factor;
        let of = |(s, u): (&State, &[f64; 6])| std::array::from_fn(|c| factor * u[c] + of_the_state(s, c));
        let added: Vec<Vec<[f64; 6]>> = motions
            .iter()
            .zip(&unit)
            .map(|(motion, unit)| motion.iter().zip(unit).map(of).collect())
            .collect();
        let trials = trials(&motions, &added, &Noise::white(NOISE), 26);
        let report = run_with_errors(trials, deepest, noises);
        let known: &[&str] = if share > 0.0 { &["added_mass"] } else { &[] };
        if let Some(effect) = report.effects.first() {
            assert_eq!(names(&report), known, "{}", report.summary);
            let found = effect.parameters["surge"].value;
            assert!((found / factor - 1.0).abs() < 0.2, "{found}, planted {factor}");
        } else {
            // of what is far smaller than the error nobody can be sure
            assert!(share < 1.0, "{} {:?}", report.summary, report.rejected);
            assert_eq!(report.suspected, known, "{}", report.summary);
            assert_eq!(report.verdict == Verdict::NothingMissing, share == 0.0, "{}", report.summary);
        }
    }
}

#[test]
fn a_computed_wrench_has_no_fault_of_a_sensor_and_what_lies_above_the_model_s_error_is_not_called_nothing() {
    let motions = motions(TRIALS, SAMPLES, 27);
    let mut random = Random::new(27);
    let mut off = || 30.0 * NOISE[0] * gaussian(&mut random);
    let added: Vec<Vec<[f64; 6]>> =
        motions.iter().map(|motion| vec![[off(), 0.0, 0.0, 0.0, 0.0, 0.0]; motion.len()]).collect();
    let mut trials = trials(&motions, &added, &Noise::white(NOISE), 27);
    trials.manifest.measured.method = Some(Method::Cfd);
    let report = run_with_doubts(trials);
    assert_eq!(report.verdict, Verdict::NoCandidateFits, "{}", report.summary);
    let bias = report.not_testable.iter().find(|effect| effect.name == "sensor_bias").expect("said");
    assert!(bias.why.contains("computed"), "{}", bias.why);
}

/// Ramps of the speed at three depths as a solver's means of a tenth of a second hold them: the motion is exact, and the
/// acceleration comes and goes from one row to the next. Load: an added mass of 0.3 and a memory of 0.4 over 0.7 s, a ramp's in
/// closed form, `z = a T (1 - exp(-t / T))`.
fn computed_ramps() -> Trials {
    const TIME_CONSTANT: f64 = 0.7;
    let motion = |index: usize| -> Vec<(State, [f64; 6])> {
        let depth = [0.1, 0.2, 0.25][index % 3];
        let (length, to) = ([0.5, 1.0, 2.0][index / 3 % 3], [0.5, 1.0][index / 9]);
        let rate = to / length;
        let mass = planted::RHO * planted::VOLUME / planted::DRAFT * depth;
        let at = |row: usize| {
            let t = 0.1 * row as f64 + 0.05;
            let since = t - 0.5;
            let within = since.clamp(0.0, length);
            let pushed = (0.0..length).contains(&since);
            let grown = rate * TIME_CONSTANT * (1.0 - (-within / TIME_CONSTANT).exp());
            let memory = grown * (-(since - within).max(0.0) / TIME_CONSTANT).exp();
            let acceleration = if pushed { rate } else { 0.0 };
            let force = -mass * (0.3 * acceleration + 0.4 * (9.81 / planted::LENGTH).sqrt() * memory);
            let state = State {
                t,
                v: Vec3::new(rate * within, 0.0, 0.0),
                w: Vec3::zeros(),
                a: Vec3::new(acceleration, 0.0, 0.0),
                al: Vec3::zeros(),
                depth,
                depth_rate: 0.0,
                yaw: 0.0,
            };
            // at the center of buoyancy
            (state, [force, 0.0, 0.0, 0.0, (0.5 * depth - 0.1) * force, 0.0])
        };
        (0..45).map(at).collect()
    };
    let (motions, loads): (Vec<_>, Vec<_>) = (0..18).map(|index| motion(index).into_iter().unzip()).unzip();
    let noise = Noise { velocity: 0.0, depth: 0.0, acceleration: 0.0, ..Noise::white([0.3; 6]) };
    let mut trials = trials(&motions, &loads, &noise, 31);
    trials.manifest.measured.method = Some(Method::Cfd);
    trials
}

#[test]
fn the_step_and_the_memory_of_a_computed_ramp_are_told_apart_since_its_motion_is_exact() {
    let report = run(&computed_ramps());
    assert_eq!(names(&report), ["added_mass", "wave_memory"], "{} {:?}", report.summary, report.rejected);
    for (effect, name, truth) in [(0, "surge", 0.3), (1, "surge", 0.4), (1, "time_constant", 0.7)] {
        let value = report.effects[effect].parameters[name].value;
        assert!((value / truth - 1.0).abs() < 0.1, "{name}: {value}, planted {truth}");
    }
    // a memory that only fades has no frequency to state
    assert!(!report.effects[1].parameters.contains_key("frequency"));
    let closure = report.gap.held_out["all"].closure.expect("a gap");
    assert!(closure > 0.9, "{closure}");
}

#[test]
fn an_effect_whose_fitted_shape_makes_it_impossible_is_not_named() {
    // more water than the hull displaces: through the openings that are looked at first less of it would do
    let motions = motions(TRIALS, SAMPLES, 28);
    let flooded =
        |motion: &Vec<State>| plant("hull_flooding", motion).into_iter().map(|w| w.map(|x| 1.35 * x));
    let added: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| flooded(motion).collect()).collect();
    let library = vec![Effect::HullFlooding];
    let trials = trials(&motions, &added, &Noise::white(NOISE), 28);
    let report = run_with(&trials, &Config { library, ..Config::default() });
    assert_eq!(report.verdict, Verdict::NoCandidateFits, "{} {:?}", report.summary, report.effects);
}

#[test]
fn an_interval_that_rests_on_the_blows_of_three_entries_is_as_wide_as_three_can_tell() {
    let mut motions = motions(TRIALS, SAMPLES, 29);
    for motion in &mut motions[6..] {
        motion.iter_mut().for_each(|s| (s.depth, s.depth_rate, s.v.z) = (0.2, 0.0, 0.0));
    }
    let added: Vec<Vec<[f64; 6]>> = motions
        .iter()
        .map(|motion| plant("water_entry_slamming", motion).into_iter().map(|w| w.map(|x| 0.8 * x)).collect())
        .collect();
    let library = vec![Effect::WaterEntrySlamming];
    let trials = trials(&motions, &added, &Noise::white(NOISE.map(|noise| 2.0 * noise)), 29);
    let report = run_with(&trials, &Config { library, ..Config::default() });
    assert_eq!(names(&report), ["water_entry_slamming"], "{} {:?}", report.summary, report.rejected);
    let blow = &report.effects[0].parameters["vertical"];
    // 90 % of a normal distribution are 3.3 standard deviations wide, of Student's with 4 degrees of freedom 4.3
    let width = (blow.interval[1] - blow.interval[0]) / blow.std;
    assert!(width > 3.8, "{width} {blow:?}");
}

#[test]
fn faults_of_sensors_are_named_as_such_and_never_applied() {
    for (name, parameter, value) in [
        ("sensor_bias", "fz", 1.0),
        ("sensor_drift", "fx", 1.0),
        ("axis_misalignment", "about_y", 1.0),
        ("sensor_delay", "delay", 0.08),
    ] {
        recovered(name, parameter, value, 1.0);
        let trials = with(&[name], 1.0, 11).0;
        let applied = wade_gap::effects_file(&run(&trials), &trials, true);
        assert_eq!(applied, Err(wade_gap::NotApplicable::NotPhysics), "{name}");
    }
}

#[test]
fn what_makes_a_part_of_the_trials_worse_is_not_applied() {
    let trials = with(&["added_mass"], 1.0, 11).0;
    let mut report = run(&trials);
    assert!(wade_gap::effects_file(&report, &trials, false).is_ok(), "{}", report.summary);
    let worse =
        wade_gap::Worse { place: "depth > 0.2 m".into(), component: Some("fz"), before: 1.0, after: 2.0 };
    report.gap.worse_regions.push(worse.clone());
    let refused = wade_gap::effects_file(&report, &trials, true).expect_err("refused");
    assert_eq!(refused, wade_gap::NotApplicable::Worse(worse));
    let said = refused.to_string();
    assert!(said.contains("the gap of fz grows from 1.0 to 2.0 noise floors (depth > 0.2 m)"), "{said}");
}

#[test]
fn a_component_that_an_effect_makes_worse_is_told_though_all_together_gain() {
    let mut trials = with(&["density_error"], 6.0, 11).0;
    let clean = run(&trials).gap;
    assert!(clean.worse_regions.is_empty(), "{:?}", clean.worse_regions);
    // along x the trials kept back have what the simulator says
    let mut random = Random::new(8);
    for trial in trials.trials.iter_mut().filter(|trial| clean.held_out_trials.contains(&trial.name)) {
        let said = trial.simulated[0].iter().flatten();
        trial.measured[0] = Some(said.map(|value| value + NOISE[0] * gaussian(&mut random)).collect());
    }
    let worse = run(&trials).gap.worse_regions;
    assert!(worse.iter().any(|worse| worse.component == Some("fx")), "{worse:?}");
    assert!(worse.iter().all(|worse| worse.component.is_some() && worse.after > worse.before), "{worse:?}");
}

#[test]
fn two_and_three_effects_are_told_apart() {
    for set in [
        &["added_mass", "sensor_delay"][..],
        &["linear_damping", "sensor_drift"],
        &["added_mass", "rotation", "squat"],
    ] {
        let report = run(&with(set, 3.0, 12).0);
        assert_eq!(report.verdict, Verdict::Named, "{set:?}: {}", report.summary);
        assert_eq!(names(&report), set, "in the order of the library");
    }
    // water that is 4 mm higher lifts a box that stands in it up to its bottom as well: it may be a zero of fz that is off
    let report = run(&with(&["linear_damping", "sensor_bias"], 3.0, 12).0);
    assert_eq!(
        (report.verdict, names(&report).as_slice()),
        (Verdict::Ambiguous, &["linear_damping", "sensor_bias"][..])
    );
    assert_eq!(report.alternatives, [["linear_damping", "water_level_offset"]], "{}", report.summary);
}

#[test]
fn where_nothing_is_missing_nothing_is_named() {
    for (seed, colored, offset) in [(1, 0.0, 0.0), (2, 0.5, 0.0), (3, 0.0, 1.0)] {
        let motions = motions(TRIALS, SAMPLES, seed);
        let nothing: Vec<Vec<[f64; 6]>> = motions.iter().map(|m| vec![[0.0; 6]; m.len()]).collect();
        let noise = Noise { colored, offset, ..Noise::white(NOISE) };
        let report = run(&trials(&motions, &nothing, &noise, seed));
        assert_eq!(
            report.verdict,
            Verdict::NothingMissing,
            "{} {:?} {:?}",
            report.summary,
            report.gap.size,
            report.gap.floors
        );
        assert!(report.effects.is_empty() && report.regions.is_empty());
        let smallest = report.excitation.iter().find(|e| e.name == "added_mass").expect("looked for");
        assert!(smallest.minimum_detectable["surge"].value < 0.1, "{smallest:?}");
    }
}

#[test]
fn noise_that_grows_with_the_speed_is_no_structure_where_the_rows_are_smoothed() {
    let motions = motions(TRIALS, SAMPLES, 4);
    let mut random = Random::new(4);
    let mut shaken = |s: &State| NOISE.map(|noise| 1.5 * noise * s.v.x.abs() * gaussian(&mut random));
    let grows: Vec<Vec<[f64; 6]>> =
        motions.iter().map(|motion| motion.iter().map(&mut shaken).collect()).collect();
    // accelerations noisy enough that all is smoothed over many bins
    let noise = Noise { acceleration: 3.0, ..Noise::white(NOISE) };
    let report = run(&trials(&motions, &grows, &noise, 4));
    assert_eq!(report.verdict, Verdict::NothingMissing, "{} {:?}", report.summary, report.gap.unexplained);
}

#[test]
fn a_pair_that_these_trials_cannot_tell_apart_is_ambiguous_and_the_trial_that_would_is_named() {
    // the simulator's fx is drag and nothing else, so a wrong gain of fx is a wrong coefficient; a gain of all channels and
    // a density scale the same loads
    for (hidden, twin) in [
        ("sensor_gain", "drag_coefficient_error"),
        ("drag_coefficient_error", "sensor_gain"),
        ("density_error", "sensor_gain"),
    ] {
        let report = run(&with(&[hidden], 3.0, 13).0);
        assert_eq!(report.verdict, Verdict::Ambiguous, "{hidden}: {}", report.summary);
        let sets: Vec<Vec<&str>> =
            std::iter::once(names(&report)).chain(report.alternatives.clone()).collect();
        assert!(sets.contains(&vec![hidden]) && sets.contains(&vec![twin]), "{sets:?}");
        assert!(report.separating_experiment.is_some_and(|text| text.contains("known weights")));
    }
}

#[test]
fn entry_loads_are_held_possible_beside_drag_of_the_same_heave() {
    // a drag of the heave that comes with an entry fits them nearly as well
    let report = run(&with(&["water_entry_slamming"], 1.0, 11).0);
    let sets: Vec<Vec<&str>> = std::iter::once(names(&report)).chain(report.alternatives.clone()).collect();
    assert!(sets.contains(&vec!["water_entry_slamming"]), "{} {sets:?}", report.summary);
}

#[test]
fn trials_are_in_the_order_of_their_numbers_or_of_one_clock() {
    let step = |name: &dyn Fn(usize) -> String, start: &dyn Fn(usize) -> f64| {
        let motions = motions(TRIALS, SAMPLES, 17);
        let late = |index: usize| [0.0, 0.0, if index < 9 { 0.0 } else { 2.0 * NOISE[2] }, 0.0, 0.0, 0.0];
        let added: Vec<Vec<[f64; 6]>> =
            motions.iter().enumerate().map(|(i, m)| vec![late(i); m.len()]).collect();
        let mut trials = trials(&motions, &added, &Noise::white(NOISE), 17);
        for (index, trial) in trials.trials.iter_mut().enumerate() {
            trial.name = name(index);
            trial.t.iter_mut().for_each(|t| *t += start(index));
        }
        let report = run(&trials);
        assert_eq!(names(&report), ["sensor_bias_step"], "{} {:?}", report.summary, report.rejected);
    };
    step(&|index| format!("run{}", index + 1), &|_| 0.0);
    // names that say nothing, and a clock that does
    step(&|index| format!("{}-run", (7 * index) % TRIALS), &|index| 10.0 * index as f64);
}

#[test]
fn a_gain_of_several_channels_is_named_though_one_of_them_hardly_changes() {
    // at one depth a trial the vertical force stays, and its gain is a constant
    let (trials, _) = pushed(|motion| {
        motion
            .iter()
            .map(planted::simulate)
            .map(|sim| [0.3 * sim[0], 0.0, 0.004 * sim[2], 0.0, 0.0, 0.0])
            .collect()
    });
    let library = vec![Effect::SensorGain];
    let report = run_with(&trials, &Config { library, ..Config::default() });
    assert_eq!(names(&report), ["sensor_gain"], "{} {:?}", report.summary, report.rejected);
    let gain = &report.effects[0];
    assert!(
        gain.parameters.contains_key("fx") && gain.parameters.contains_key("fz"),
        "{:?}",
        gain.parameters
    );
}

/// Why an effect was not named.
fn why(report: &Report, name: &str) -> Option<wade_gap::Refusal> {
    report.rejected.iter().find(|rejected| rejected.name == name)?.why
}

/// What one effect of the library is said to be, of loads on runs that push again and again.
fn judged(effect: Effect, count: usize, load: impl Fn(usize, &[State]) -> Vec<[f64; 6]>) -> Report {
    let motions = pushes(count, SAMPLES, 26);
    let loads: Vec<Vec<[f64; 6]>> = motions.iter().enumerate().map(|(i, motion)| load(i, motion)).collect();
    let trials = trials(&motions, &loads, &Noise::white(NOISE), 26);
    run_with(&trials, &Config { library: vec![effect], ..Config::default() })
}

#[test]
fn a_fault_that_half_of_the_trials_have_is_none_of_the_sensor_and_not_called_nothing() {
    let gain = |of: &dyn Fn(usize) -> f64| {
        judged(Effect::SensorGain, TRIALS, |trial, motion| {
            motion.iter().map(|s| [of(trial) * planted::simulate(s)[0], 0.0, 0.0, 0.0, 0.0, 0.0]).collect()
        })
    };
    let steady = gain(&|_| 0.3);
    assert_eq!(names(&steady), ["sensor_gain"], "{} {:?}", steady.summary, steady.rejected);
    // the gap is twelve times the noise, but neither the gain nor a smooth function holds in all of the trials
    let erratic = gain(&|trial| if trial % 2 == 0 { 0.6 } else { 0.0 });
    assert_eq!(erratic.verdict, Verdict::NoCandidateFits, "{}", erratic.summary);
    assert!(erratic.gap.size["fx"].rms > 10.0 * erratic.gap.floors["fx"].sample, "{:?}", erratic.gap.size);

    let zero = judged(Effect::SensorBias, 3 * TRIALS, |trial, motion| {
        vec![[if trial % 2 == 0 { 3.0 * NOISE[0] } else { 0.0 }, 0.0, 0.0, 0.0, 0.0, 0.0]; motion.len()]
    });
    assert_eq!(zero.verdict, Verdict::NoCandidateFits, "{}", zero.summary);
    assert_eq!(why(&zero, "sensor_bias"), Some(wade_gap::Refusal::Unstable), "{:?}", zero.rejected);
}

#[test]
fn a_gain_is_told_by_the_trials_that_load_its_channel_and_not_by_the_noise_of_the_others() {
    const GAIN: f64 = -0.035;
    // one in five drifts
    let mut motions = pushes(TRIALS, SAMPLES, 33);
    for motion in motions.iter_mut().step_by(5) {
        motion.iter_mut().for_each(|s| (s.v.y, s.a.y) = (0.5 * s.v.x, 0.5 * s.a.x));
    }
    let of = |s: &State| [0.0, GAIN * planted::simulate(s)[1], 0.0, 0.0, 0.0, 0.0];
    let added: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| motion.iter().map(of).collect()).collect();
    // where nothing goes aside the prediction of the side force is the noise of the recorded speed, and the gap that negated
    let quiet = [8.0, 0.5, 12.0, 4.0, 4.0, 4.0];
    let noise = Noise { velocity: 0.04, ..Noise::white(quiet) };
    let config = Config { library: vec![Effect::SensorGain], ..Config::default() };
    let report = run_with(&trials(&motions, &added, &noise, 33), &config);
    assert_eq!(names(&report), ["sensor_gain"], "{} {:?}", report.summary, report.rejected);
    let found = report.effects[0].parameters["fy"].value;
    // that noise is a hundredth of the energy of the channel, and pulls the gain towards -1 by as much
    assert!((found - GAIN).abs() < 0.01, "{found}");
}

#[test]
fn a_force_that_a_shifted_drag_explains_as_well_is_not_called_drag() {
    // it goes with how hard a trial was driven, not with when
    let report = judged(Effect::DragCoefficientError, TRIALS, |_, motion| {
        let drag = plant("drag_coefficient_error", motion);
        let mean = drag.iter().map(|w| w[0]).sum::<f64>() / drag.len() as f64;
        vec![[mean, 0.0, 0.0, 0.0, 0.0, 0.0]; motion.len()]
    });
    assert_eq!(report.verdict, Verdict::NoCandidateFits, "{} {:?}", report.summary, report.rejected);
    assert!(why(&report, "drag_coefficient_error").is_some(), "{:?}", report.rejected);
}

#[test]
fn what_many_samples_show_far_below_the_noise_of_one_is_not_named() {
    const MANY: usize = 60;
    let of = |times: f64| {
        judged(Effect::DragCoefficientError, MANY, move |_, motion| {
            let drag = plant("drag_coefficient_error", motion);
            drag.into_iter().map(|w| [times * w[0], 0.0, 0.0, 0.0, 0.0, 0.0]).collect()
        })
    };
    let size = rms(&pushes(MANY, SAMPLES, 26)
        .iter()
        .map(|motion| plant("drag_coefficient_error", motion))
        .collect::<Vec<_>>())[0];
    let faint = of(0.06 * NOISE[0] / size);
    assert_eq!(
        why(&faint, "drag_coefficient_error"),
        Some(wade_gap::Refusal::Irrelevant),
        "{:?}",
        faint.rejected
    );
    assert_eq!(faint.verdict, Verdict::NothingMissing, "{}", faint.summary);
    assert_eq!(names(&of(0.3 * NOISE[0] / size)), ["drag_coefficient_error"]);
}

#[test]
fn trials_that_repeat_each_other_tell_a_noise_that_is_slow() {
    let mut motions = pushes(TRIALS, SAMPLES, 27);
    for pair in motions.chunks_mut(2) {
        pair[1] = pair[0].clone();
    }
    let nothing: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| vec![[0.0; 6]; motion.len()]).collect();
    let slow = Noise { colored: 0.5, velocity: 0.0, depth: 0.0, acceleration: 0.0, ..Noise::white(NOISE) };
    let mut trials = trials(&motions, &nothing, &slow, 27);
    let alone = run(&trials).gap.floors["fx"];
    trials.manifest.measured.repeats =
        (0..TRIALS).step_by(2).map(|i| [i, i + 1].map(|i| format!("run{i:02}")).into()).collect();
    let repeated = run(&trials).gap.floors["fx"];
    assert_eq!(
        (alone.source, repeated.source),
        (wade_gap::FloorSource::HighFrequency, wade_gap::FloorSource::Repeats)
    );
    // the means of two trials take some of a slow noise with them: 1 s of it in 8 s is an eighth of its variance
    let expected = NOISE[0] * (1.0_f64 - 2.0 * 0.5 / 8.0).sqrt();
    assert!((repeated.sample / expected - 1.0).abs() < 0.1, "{repeated:?}, planted {expected}");
    assert!(alone.sample < 0.6 * expected, "{alone:?}");
}

#[test]
fn quiet_repeats_do_not_hide_the_noise_of_the_other_trials() {
    const LOUD: f64 = 4.0;
    let mut motions = pushes(TRIALS, SAMPLES, 28);
    motions[1] = motions[0].clone();
    let nothing: Vec<Vec<[f64; 6]>> = motions.iter().map(|motion| vec![[0.0; 6]; motion.len()]).collect();
    let mut trials = trials(&motions, &nothing, &Noise::white(NOISE), 28);
    let mut random = Random::new(28);
    for value in trials.trials[2..].iter_mut().filter_map(|trial| trial.measured[0].as_mut()).flatten() {
        *value += (LOUD * LOUD - 1.0).sqrt() * NOISE[0] * gaussian(&mut random);
    }
    trials.manifest.measured.repeats = vec![vec!["run00".into(), "run01".into()]];
    let floor = run(&trials).gap.floors["fx"];
    assert_eq!(floor.source, wade_gap::FloorSource::Repeats);
    // of 16 trials that name at most two are quiet
    assert!((0.9 * LOUD..1.1 * LOUD).contains(&(floor.sample / NOISE[0])), "{floor:?}");
}

#[test]
fn trials_that_repeat_each_other_are_kept_back_together_and_two_have_no_interval() {
    let mut motions = motions(TRIALS, SAMPLES, 18);
    for index in 0..10 {
        motions[index + 10] = motions[index].clone();
    }
    let (mut trials, _) = with_motions(&motions, &["squat"], 3.0, 18);
    let pair = |index: usize| vec![format!("run{index:02}"), format!("run{:02}", index + 10)];
    trials.manifest.measured.repeats = (0..10).map(pair).collect();
    let report = run(&trials);
    let held = &report.gap.held_out_trials;
    let number = |name: &String| name[3..].parse::<usize>().expect("a number");
    let other = |name: &String| format!("run{:02}", (number(name) + 10) % 20);
    assert!(held.len() >= 3 && held.iter().all(|name| held.contains(&other(name))), "{held:?}");
    assert!(report.gap.held_out["all"].interval.is_some());
    trials.manifest.measured.repeats.clear();
    trials.trials.truncate(8);
    let report = run(&trials);
    assert_eq!(report.gap.held_out_trials.len(), 2);
    let all = &report.gap.held_out["all"];
    assert!(all.closure.is_some() && all.interval.is_none(), "{all:?}");
}

#[test]
fn the_hash_tells_columns_and_their_names_apart() {
    let (mut trials, _) = with(&["squat"], 3.0, 19);
    trials.trials.truncate(6);
    let hash = |trials: &Trials| run(trials).sources.trials;
    let plain = hash(&trials);
    assert_eq!(plain, hash(&trials));
    let mut wheels = trials.clone();
    wheels.trials[2].wheel_speeds[1] = Some(vec![3.0; SAMPLES]);
    let mut turned = trials.clone();
    turned.trials[2].angular_acceleration[7].z += 0.1;
    let mut elsewhere = wheels.clone();
    elsewhere.trials[2].wheel_speeds.swap(1, 2);
    let hashes = [plain, hash(&wheels), hash(&turned), hash(&elsewhere)];
    assert!((0..4).all(|i| (0..i).all(|j| hashes[i] != hashes[j])), "{hashes:?}");
}

#[test]
fn a_region_says_which_surfaces_carry_its_gap_with_and_without_a_name() {
    let shares = |report: &Report| {
        let region = report.regions.first().unwrap_or_else(|| panic!("a region: {}", report.summary));
        let whole: f64 = region.surfaces.values().sum();
        // what carries next to nothing is left out
        assert!((0.95..1.0 + 1e-9).contains(&whole), "{:?}", region.surfaces);
        region.surfaces.clone()
    };
    // the drag of the flow that is met, on the sides that meet it
    let named = run(&with(&["drag_coefficient_error"], 3.0, 11).0);
    assert_eq!(names(&named), ["drag_coefficient_error"]);
    let of_drag = shares(&named);
    // upwards in shallow water alone
    let motions = motions(TRIALS, SAMPLES, 21);
    let lift =
        |state: &State| if state.depth < 0.15 { 6.0 * NOISE[2] * (7.0 * state.v.x).sin() } else { 0.0 };
    let load: Vec<Vec<[f64; 6]>> = motions
        .iter()
        .map(|motion| motion.iter().map(|s| [0.0, 0.0, lift(s), 0.0, 0.0, 0.0]).collect())
        .collect();
    let unnamed = run(&trials(&motions, &load, &Noise::white(NOISE), 21));
    assert_eq!(unnamed.verdict, Verdict::NoCandidateFits, "{}", unnamed.summary);
    let of_lift = shares(&unnamed);
    assert_ne!(of_drag, of_lift);
}

#[test]
fn a_force_of_no_effect_has_no_name() {
    for name in ["outside_sine", "outside_vibration"] {
        let report = run(&with(&[name], 3.0, 14).0);
        assert_eq!(report.verdict, Verdict::NoCandidateFits, "{name}: {}", report.summary);
        assert!(report.effects.is_empty() && report.gap.unexplained.is_some());
    }
}

#[test]
fn what_passes_and_leaves_too_much_is_told_and_not_named() {
    let report = run(&with(&["drag_coefficient_error", "outside_sine"], 3.0, 14).0);
    assert_eq!(report.verdict, Verdict::NoCandidateFits, "{}", report.summary);
    let drag = report.rejected.iter().find(|rejected| rejected.name == "drag_coefficient_error");
    assert_eq!(drag.and_then(|drag| drag.why), Some(wade_gap::Refusal::Incomplete), "{:?}", report.rejected);
    let left = report.gap.unexplained.expect("told");
    assert!(left.contains("; the closest candidate is drag coefficient error"), "{left}");
}

#[test]
fn what_is_not_excited_is_said() {
    // steady straight runs in open water at one depth
    let steady: Vec<Vec<State>> = (0..12)
        .map(|index| {
            let speed = 0.5 + 0.2 * f64::from(index);
            let state = |i: u32| State {
                t: f64::from(i) / planted::RATE,
                v: Vec3::new(speed, 0.0, 0.0),
                w: Vec3::zeros(),
                a: Vec3::zeros(),
                al: Vec3::zeros(),
                depth: 0.2,
                depth_rate: 0.0,
                yaw: 0.0,
            };
            (0..600).map(state).collect()
        })
        .collect();
    let nothing: Vec<Vec<[f64; 6]>> = steady.iter().map(|m| vec![[0.0; 6]; m.len()]).collect();
    let report = run(&trials(&steady, &nothing, &Noise::white(NOISE), 3));
    let silent: Vec<&str> = report.not_testable.iter().map(|missing| missing.name).collect();
    for name in [
        "added_mass",
        "rotation",
        "water_entry_slamming",
        "sensor_delay",
        "channel_blockage",
        "wheel_paddle_thrust",
        "mass_error",
    ] {
        assert!(silent.contains(&name), "{name} {silent:?}");
    }
    assert!(!silent.contains(&"drag_coefficient_error"), "{silent:?}");
}

#[test]
fn the_mass_of_water_that_turns_with_the_hull_can_be_told_by_turning_alone() {
    let mut motions = motions(12, 600, 5);
    for (index, motion) in motions.iter_mut().enumerate() {
        for s in motion.iter_mut() {
            let phase = (1.0 + 0.1 * index as f64) * s.t;
            (s.v, s.a, s.depth, s.depth_rate) = (Vec3::zeros(), Vec3::zeros(), 0.2, 0.0);
            (s.w.z, s.al.z) = (0.6 * phase.sin(), 0.6 * (1.0 + 0.1 * index as f64) * phase.cos());
        }
    }
    let nothing: Vec<Vec<[f64; 6]>> = motions.iter().map(|m| vec![[0.0; 6]; m.len()]).collect();
    let report = run(&trials(&motions, &nothing, &Noise::white(NOISE), 5));
    let silent: Vec<&str> = report.not_testable.iter().map(|missing| missing.name).collect();
    assert!(!silent.contains(&"added_mass") && silent.contains(&"wave_memory"), "{silent:?}");
}

#[test]
fn the_order_of_the_trials_and_the_side_of_the_vehicle_do_not_matter() {
    let (trials, _) = with(&["added_mass", "rotation"], 3.0, 15);
    let report = run(&trials);
    let mut shuffled = trials.clone();
    shuffled.trials.reverse();
    assert_eq!(run(&shuffled), report);
    let twice = Effect::ALL.into_iter().rev().chain([Effect::AddedMass]);
    let backwards = Config { library: twice.collect(), ..Config::default() };
    assert_eq!(run_with(&trials, &backwards), report);
    let mirrored = run(&mirrored(trials));
    assert_eq!((mirrored.verdict, names(&mirrored)), (report.verdict, names(&report)));
    for (a, b) in mirrored.effects.iter().zip(&report.effects) {
        for (name, p) in &a.parameters {
            assert!((p.value - b.parameters[name].value).abs() < 1e-6 * p.value.abs().max(1e-6), "{name}");
        }
    }
}

/// Left becomes right.
fn mirrored(mut trials: Trials) -> Trials {
    for trial in &mut trials.trials {
        trial.velocity.iter_mut().chain(&mut trial.acceleration).for_each(|v| v.y = -v.y);
        let turning = trial.angular_velocity.iter_mut().chain(&mut trial.angular_acceleration);
        turning.for_each(|w| (w.x, w.z) = (-w.x, -w.z));
        trial.yaw.iter_mut().for_each(|yaw| *yaw = -*yaw);
        for wrench in [&mut trial.measured, &mut trial.simulated] {
            for component in [1, 3, 5] {
                wrench[component].iter_mut().flatten().for_each(|v| *v = -*v);
            }
        }
    }
    trials
}

/// The same trials with the level of the water, and with depths that belong to it to the last bit.
fn with_levels(trials: &Trials, z0: f64) -> [Trials; 2] {
    let (mut by_depth, mut by_level) = (trials.clone(), trials.clone());
    for (depths, levels) in by_depth.trials.iter_mut().zip(&mut by_level.trials) {
        let level: Vec<f64> = (0..levels.len()).map(|i| levels.depth(i, z0) + z0).collect();
        let depth: Vec<f64> = level.iter().map(|level| level - z0).collect();
        let level: Vec<f64> = depth.iter().map(|depth| z0 + depth).collect();
        assert!(level.iter().zip(&depth).all(|(level, depth)| level - z0 == *depth));
        (depths.still_water, levels.still_water) = (StillWater::Depth(depth), StillWater::Level(level));
    }
    [by_depth, by_level]
}

#[test]
fn trials_with_a_water_level_give_the_bits_of_those_with_the_depth() {
    for simulated in [true, false] {
        let (trials, _) = with(&["water_level_offset"], 3.0, 41);
        let z0 = wade_gap::body_of(&trials).expect("a body").z0;
        let [by_depth, by_level] = with_levels(&trials, z0).map(|trials| {
            let mut report = if simulated { run(&trials) } else { run_with_doubts(trials) };
            report.sources = Default::default();
            report
        });
        // a model that doubts itself by six noises allows no name
        let named: &[&str] = if simulated { &["water_level_offset"] } else { &[] };
        assert_eq!(names(&by_level), named, "{}", by_level.summary);
        assert_eq!(format!("{by_level:?}"), format!("{by_depth:?}"));
    }
}

#[test]
fn the_model_is_asked_about_the_level_and_the_bed_of_a_trial() {
    let (mut trials, _) = with(&["added_mass"], 3.0, 42);
    let z0 = wade_gap::body_of(&trials).expect("a body").z0;
    for trial in &mut trials.trials {
        trial.simulated = Default::default();
        trial.roll = vec![0.3; trial.len()];
        trial.still_water = StillWater::Level(vec![0.0625; trial.len()]);
        (trial.bed_clearance, trial.bed) = (Some(vec![0.5; trial.len()]), Some(vec![0.25; trial.len()]));
    }
    let mut asked = 0;
    let mut model = |about: &Asked<'_>| {
        let state = about.condition;
        // then in states that effects move it to
        if asked < TRIALS * SAMPLES {
            assert_eq!((state.water_level, state.depth), (Some(0.0625), 0.0625 / 0.3_f64.cos() - z0));
        }
        assert_eq!((state.bed_clearance, state.stated_bed), (Some(0.5), Some(0.25)));
        asked += 1;
        Predicted::default()
    };
    let body = wade_gap::body_of(&trials).expect("a body");
    let _ = wade_gap::run(&trials, &body, &mut model, &Config::default());
    assert!(asked >= TRIALS * SAMPLES, "{asked}");
}
