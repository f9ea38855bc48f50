//! Promise: trials that cannot be what they are said to be are refused with what and where, and no others.

use crate::gap_recovery::{NOISE, SAMPLES, TRIALS, names, run, with, with_dry_twins};
use crate::planted::{self, gaussian};
use wade_core::wrench::Wrench;
use wade_gap::{Asked, Config, GapError, Predicted};
use wade_learn::random::Random;
use wade_learn::trials::{StillWater, Trials};

#[test]
fn a_channel_that_cannot_be_what_it_is_called_is_refused_with_its_trial() {
    let good = with(&["squat"], 3.0, 16).0;
    let body = wade_gap::body_of(&good).expect("a body");
    let refused = |spoil: &dyn Fn(&mut Channels)| {
        // one trial, then all
        [4..5, 0..TRIALS].map(|spoiled| {
            let mut trials = good.clone();
            trials.trials[spoiled].iter_mut().for_each(|trial| spoil(&mut trial.measured));
            wade_gap::run(&trials, &body, &mut |_| Predicted::default(), &Config::default())
        })
    };
    let all = |value: &mut Option<Vec<f64>>, to: &dyn Fn(f64) -> f64| {
        value.iter_mut().flatten().for_each(|value| *value = to(*value));
    };
    for (result, of) in refused(&|measured| all(&mut measured[0], &|_| 3.0)).iter().zip(PLACES) {
        let is_named = |e: &GapError| matches!(e, GapError::Dead { place, column: "fx", .. } if place == of);
        assert!(result.as_ref().is_err_and(is_named), "{result:?}");
    }
    for (result, of) in refused(&|measured| all(&mut measured[0], &|x| -x)).iter().zip(PLACES) {
        let is_named =
            |e: &GapError| matches!(e, GapError::Reversed { place, column: "fx", .. } if place == of);
        assert!(result.as_ref().is_err_and(is_named), "{result:?}");
    }
    let [alone, everywhere] = refused(&|measured| {
        let most = measured[0].iter().flatten().fold(0.0, |most: f64, x| most.min(*x));
        all(&mut measured[0], &|x| x.max(0.5 * most));
    });
    for result in [alone, everywhere] {
        // each trial stops elsewhere
        let is_named =
            |e: &GapError| matches!(e, GapError::Saturated { column: "fx", count, .. } if *count >= 20);
        assert!(result.as_ref().is_err_and(is_named), "{result:?}");
    }
    for (result, of) in refused(&|measured| measured.swap(0, 2)).iter().zip(PLACES) {
        let swapped = GapError::Swapped { place: of.into(), column: "fx", other: "fz" };
        assert_eq!(result.as_ref().err(), Some(&swapped));
    }
    for (result, of) in refused(&|measured| all(&mut measured[0], &|x| 1e-3 * x)).iter().zip(PLACES) {
        let is_named = |e: &GapError| matches!(e, GapError::Unit { place, column: "fx", other: "kN", .. } if place == of);
        assert!(result.as_ref().is_err_and(is_named), "{result:?}");
    }
    // a zero that is off by the weight turns fz about, but not its changes; one that is as far off is another zero
    let [_, everywhere] = refused(&|measured| all(&mut measured[2], &|x| x - planted::MASS * 9.81));
    let is_weight = |e: &GapError| matches!(e, GapError::Weight { column: "fz", off, .. } if *off < 0.0);
    assert!(everywhere.as_ref().is_err_and(is_weight), "{everywhere:?}");
    let [_, everywhere] = refused(&|measured| all(&mut measured[2], &|x| x - 0.8 * planted::MASS * 9.81));
    assert!(everywhere.is_ok(), "{everywhere:?}");
    let [_, everywhere] = refused(&|measured| measured[1] = measured[0].clone());
    assert_eq!(everywhere.err(), Some(GapError::Copied { column: "fx", other: "fy" }));
}

#[test]
fn known_forces_and_a_mass_in_another_unit_are_named_beside_the_motion() {
    let good = with_dry_twins(1.0, 1.0, 0.0);
    let body = wade_gap::body_of(&good).expect("a body");
    let run = |force: f64, mass: f64| {
        let mut trials = good.clone();
        trials.manifest.mass = Some(mass * planted::MASS);
        let forces = trials.trials.iter_mut().flat_map(|trial| trial.other_forces.values_mut());
        forces.flatten().for_each(|value| *value *= force);
        wade_gap::run(&trials, &body, &mut |_| Predicted::default(), &Config::default())
    };
    assert!(run(1.0, 1.0).is_ok());
    // faults that the library has
    assert!(run(0.7, 1.0).is_ok() && run(1.0, 1.3).is_ok());
    for (force, mass, what, said) in [
        (1e-3, 1.0, "measured.other_forces", "in kN?"),
        (1.0 / 4.448, 1.0, "measured.other_forces", "in lbf?"),
        (-1.0, 1.0, "measured.other_forces", "reversed?"),
        (1.0, 2.2046, "mass", "in lb?"),
        (1.0, 1e3, "mass", "in g?"),
    ] {
        let error = run(force, mass).expect_err(said);
        let is_named = matches!(&error, GapError::Driven { what: w, .. } if *w == what);
        assert!(is_named && error.to_string().contains(said), "{error}");
    }
}

#[test]
fn a_channel_within_the_error_that_the_model_states_is_no_other_and_not_reversed() {
    let good = with(&["squat"], 3.0, 16).0;
    let body = wade_gap::body_of(&good).expect("a body");
    let refused = |doubt: f64, spoil: &dyn Fn(&mut Channels)| {
        let mut trials = good.clone();
        for trial in &mut trials.trials {
            spoil(&mut trial.measured);
            trial.simulated = Default::default();
        }
        let mut model = |asked: &Asked<'_>| {
            let [fx, fy, fz, mx, my, mz] =
                planted::simulate_at(asked.condition.velocity, asked.condition.depth);
            let wrench = Wrench { force: [fx, fy, fz].into(), moment: [mx, my, mz].into() };
            Predicted { wrench, uncertainty: [doubt; 6], outside: false }
        };
        let error = wade_gap::run(&trials, &body, &mut model, &Config::default()).err();
        error.is_some_and(|error| matches!(error, GapError::Swapped { .. } | GapError::Reversed { .. }))
    };
    let reverse = |measured: &mut Channels| measured[0].iter_mut().flatten().for_each(|x| *x = -*x);
    // a newton, and more than the vehicle weighs
    for (doubt, is_refused) in [(1.0, true), (1e4, false)] {
        assert_eq!(refused(doubt, &|measured| measured.swap(0, 2)), is_refused, "exchanged, {doubt} N");
        assert_eq!(refused(doubt, &reverse), is_refused, "reversed, {doubt} N");
    }
}

#[test]
fn a_channel_that_stops_in_the_middle_is_refused_with_its_time() {
    let mut trials = with(&["squat"], 3.0, 16).0;
    let body = wade_gap::body_of(&trials).expect("a body");
    // over the end of the run, in which the vehicle brakes
    let at = SAMPLES / 2;
    let fx = trials.trials[4].measured[0].as_mut().expect("measured");
    let value = fx[at];
    fx[at..].fill(value);
    let from = trials.trials[4].t[at];
    let error = wade_gap::run(&trials, &body, &mut |_| Predicted::default(), &Config::default());
    let is_named = |e: &GapError| matches!(e, GapError::Stopped { place, column: "fx", from: f, count, .. } if place == "run04.csv" && *f == from && *count == SAMPLES - at);
    assert!(error.as_ref().is_err_and(is_named), "{:?}", error.err());
}

#[test]
fn what_is_stated_is_held_against_the_trials() {
    let good = with(&["squat"], 3.0, 16).0;
    let refused = |spoil: &dyn Fn(&mut Trials)| {
        let mut trials = good.clone();
        spoil(&mut trials);
        let body = wade_gap::body_of(&good).expect("a body");
        wade_gap::run(&trials, &body, &mut |_| Predicted::default(), &Config::default())
    };
    // inches of a channel that is 3 m wide would pass, its feet and a hull's width in another unit do not
    let narrow = refused(&|trials| trials.manifest.channel_width = Some(0.9)).expect_err("too narrow");
    assert!(matches!(narrow, GapError::NarrowChannel { channel: 0.9, hull, .. } if hull == planted::WIDTH));
    let another = refused(&|trials| {
        trials.manifest.measured.repeats = vec![vec!["run02".into(), "run03".into()]];
    });
    // what they show of the noise is left out, and all else is as without them
    let another = another.expect("the pair is left out");
    let mut report = refused(&|_| ()).expect("sound");
    let remark = another.remarks.iter().find(|remark| remark.contains("run03.csv does not repeat run02.csv"));
    assert!(remark.is_some_and(|remark| remark.contains("measured.repeats")), "{:?}", another.remarks);
    report.remarks.clone_from(&another.remarks);
    report.sources.clone_from(&another.sources);
    assert_eq!(another, report);
    let radius = wade_gap::body_of(&good).expect("a body").wheel_radius;
    let turning = |factor: f64| {
        refused(&|trials| {
            for trial in &mut trials.trials {
                let speeds = trial.velocity.iter().map(|v| factor * v.x / radius).collect();
                trial.wheel_speeds[0] = Some(speeds);
            }
        })
    };
    assert!(turning(1.0).is_ok());
    for (factor, said) in
        [(9.549, "revolutions a minute"), (57.3, "degrees a second"), (0.15915, "revolutions a second")]
    {
        let error = turning(factor).expect_err(said);
        assert!(matches!(&error, GapError::WheelUnit { .. }) && error.to_string().contains(said), "{error}");
    }
    let rims = turning(radius).expect_err("m/s of the rims");
    assert!(rims.to_string().contains("rims"), "{rims}");
    let fast = turning(1.0 / 3.6).expect_err("km/h");
    assert!(fast.to_string().contains("km/h"), "{fast}");
    let said = |stated: f64| {
        let report = refused(&|trials| {
            trials.manifest.sensor_noise.insert("fx".into(), stated);
        });
        let remarks = report.expect("a report").remarks;
        remarks.into_iter().find(|remark| remark.contains("sensor_noise"))
    };
    assert_eq!((said(NOISE[0]), said(0.5 * NOISE[0])), (None, None));
    assert!(said(0.1 * NOISE[0]).is_some_and(|remark| remark.contains("the larger one is used")));
    assert!(said(100.0 * NOISE[0]).is_some_and(|remark| remark.contains("is taken for noise")));
}

/// The measured components of a trial.
type Channels = [Option<Vec<f64>>; 6];

/// What one trial and all of them are called where a channel is refused.
const PLACES: [&str; 2] = ["run04.csv", "every trial"];

#[test]
fn a_recording_that_was_damaged_is_pointed_at_and_where_it_is_kept_back_hides_no_name() {
    let (mut trials, _) = with(&["squat"], 3.0, 16);
    let clean = run(&trials);
    let is_loud = |remark: &&String| remark.contains("times the noise");
    assert_eq!((names(&clean), clean.remarks.iter().find(is_loud)), (vec!["squat"], None));
    let kept_back = clean.gap.held_out_trials[0].clone();
    trials.manifest.sensor_noise.insert("fz".into(), NOISE[2]);
    let damaged = trials.trials.iter_mut().find(|trial| trial.name == kept_back).expect("a trial");
    let mut random = Random::new(3);
    for value in damaged.measured[2].iter_mut().flatten() {
        *value += 20.0 * NOISE[2] * gaussian(&mut random);
    }
    let report = run(&trials);
    assert_eq!(names(&report), ["squat"], "{}", report.summary);
    let remark = report.remarks.iter().find(is_loud).expect("remarked");
    assert!(remark.starts_with("fz: 1 of ") && remark.contains(&kept_back), "{remark}");
}

#[test]
fn bad_input_is_named() {
    let (good, _) = with(&["squat"], 3.0, 16);
    let body = wade_gap::body_of(&good).expect("a body");
    let run = |trials: &Trials| {
        wade_gap::run(trials, &body, &mut |_| Predicted::default(), &Config::default()).expect_err("refused")
    };
    let mut few = good.clone();
    few.trials.truncate(3);
    assert_eq!(run(&few), GapError::TooFewTrials { trials: 3, least: 4 });
    let mut silent = good.clone();
    silent.trials[4].measured = Default::default();
    assert_eq!(run(&silent), GapError::NothingMeasured { trial: "run04".into() });
    let mut uneven = good.clone();
    uneven.trials[4].measured[0] = None;
    assert_eq!(run(&uneven), GapError::Components { trial: "run04".into(), component: "fx" });
    let mut other = good.clone();
    other.manifest.vehicle = "boat".into();
    assert!(matches!(run(&other), GapError::Vehicle { .. }));
    let mut dry = good.clone();
    dry.trials.iter_mut().for_each(|trial| trial.still_water = StillWater::Depth(vec![-0.3; trial.len()]));
    assert_eq!(run(&dry), GapError::Dry { depth: -0.3 });
    let mut mixed = good.clone();
    mixed.trials[4].simulated = Default::default();
    assert_eq!(run(&mixed), GapError::Predictions { trial: "run04".into(), other: "run00".into() });
    let settings = |config: Config| {
        wade_gap::run(&good, &body, &mut |_| Predicted::default(), &config).expect_err("refused").to_string()
    };
    let many = settings(Config { folds: usize::MAX, ..Config::default() });
    assert!(many.contains("too few for"), "{many}");
    assert_eq!(settings(Config { folds: 1, ..Config::default() }), "folds = 1 must be 2 or more");
    let mut short = with_dry_twins(1.0, 1.0, 0.0);
    let twin = short.trials.iter_mut().find(|trial| trial.name == "dry03").expect("a twin");
    twin.t.truncate(700);
    let error = run(&short);
    assert!(
        matches!(&error, GapError::ShortTwin { trial, twin, .. } if trial == "run03" && twin == "dry03"),
        "{error}"
    );
    let mut bodiless = good.clone();
    bodiless.manifest.body = None;
    assert!(matches!(wade_gap::body_of(&bodiless), Err(GapError::NoBody { .. })));
}
