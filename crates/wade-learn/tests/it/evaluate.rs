//! Evaluation: simple models find the coefficients that were planted, the figures are those of planted errors, and what
//! was learnt from is no judge.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use wade_core::bundle::{self, Bundle};
use wade_core::condition::Condition;
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::vehicle::Vehicle;
use wade_learn::dataset::Dataset;
use wade_learn::dataset::split::{By, split};
use wade_learn::evaluate::baseline::Baseline;
use wade_learn::evaluate::contest::{Contest, Entry, Heat};
use wade_learn::evaluate::predict::Prediction;
use wade_learn::evaluate::regimes::regimes;
use wade_learn::evaluate::report::{About, Report};
use wade_learn::evaluate::states::{State, states};
use wade_learn::evaluate::{EvaluateError, held_out};
use wade_learn::train::fit::Epoch;
use wade_learn::train::report::{DataFile, Record};
use wade_learn::train::{self, Analytic, Config, Run, Sides, Source, Variant};

fn bundles() -> BTreeMap<String, Bundle> {
    let read = |name: &str| (name.to_owned(), bundle::read(&crate::common::vehicles().join(name)).unwrap());
    crate::common::VEHICLES.map(read).into()
}

fn vehicles() -> BTreeMap<String, Vehicle> {
    bundles().into_iter().map(|(name, bundle)| (name, bundle.vehicle)).collect()
}

fn analytic(cases: usize) -> Dataset {
    train::analytic::dataset(&vehicles(), &Analytic { cases, ..Analytic::default() }, 1).unwrap()
}

/// All states of a vehicle, with loads that `change` makes of the net ones: the first surface takes the difference.
fn planted(vehicle: &str, moments: bool, wrench: impl Fn(&Condition) -> (Vec3, Vec3)) -> Vec<State> {
    let mut data = analytic(12);
    data.samples.retain(|sample| sample.vehicle == vehicle);
    data.meta.vehicles.retain(|name, _| name == vehicle);
    for sample in &mut data.samples {
        let (force, moment) = wrench(&sample.condition);
        for (index, load) in sample.surfaces.iter_mut().enumerate() {
            (load.force, load.rest) = (if index == 0 { force } else { Vec3::zeros() }, None);
            load.moment = moments.then_some(if index == 0 { moment } else { Vec3::zeros() });
        }
    }
    let source = Source::new(data, &vehicles(), false).unwrap();
    states(&source, &(0..source.data.samples.len()).collect::<Vec<_>>()).unwrap()
}

fn fit(vehicle: &str, states: &[State]) -> [Baseline; 3] {
    let bundle = bundles().remove(vehicle).unwrap();
    Baseline::fit(&bundle.vehicle, &states.iter().collect::<Vec<_>>()).unwrap()
}

#[test]
fn a_planted_drag_constant_is_found_and_leaves_no_error() {
    let vehicle = vehicles().remove("warthog").unwrap();
    let planted = planted("warthog", false, |c| {
        let buoyancy =
            hydrostatics(&vehicle.hull.mesh, &c.water_plane(vehicle.z0), c.density, &Vec3::zeros());
        let v = Vec3::new(c.velocity.x, c.velocity.y, 0.0);
        let drag = v * (-0.5 * 0.77 * c.density * vehicle.dimensions.width * c.depth * v.norm());
        (buoyancy.wrench.force + drag, Vec3::zeros())
    });
    let [archimedes, ..] = fit("warthog", &planted);
    let Baseline::Archimedes { drag } = archimedes else { panic!("{archimedes:?}") };
    assert!((drag - 0.77).abs() < 1e-9, "{drag}");
    for state in &planted {
        let error = archimedes.wrench(&vehicle, &state.condition).force - state.force();
        assert!(error.norm() < 1e-8 * state.force().norm(), "{error}");
    }
}

#[test]
fn pontoons_lift_the_caps_of_spheres_and_together_the_hull() {
    let vehicle = vehicles().remove("husky").unwrap();
    let half = Baseline::Pontoons { centers: vec![Vec3::zeros()], radius: 0.1, lift: 1.0, drag: 0.5 };
    // the surface at the center: half the sphere lifts, half its cross section drags
    let state = Condition::level(Vec3::new(2.0, 0.0, 0.0), -vehicle.z0);
    let wrench = half.wrench(&vehicle, &state);
    let pi = std::f64::consts::PI;
    assert!((wrench.force.z - 1000.0 * GRAVITY * 2.0 / 3.0 * pi * 1e-3).abs() < 1e-9);
    assert!((wrench.force.x + 0.5 * 0.5 * 1000.0 * pi * 0.01 * 0.5 * 4.0).abs() < 1e-9);

    let planted = planted("husky", false, |_| (Vec3::new(-1.0, 0.0, 1.0), Vec3::zeros()));
    let [_, pontoons, _] = fit("husky", &planted);
    let Baseline::Pontoons { centers, radius, .. } = pontoons else { panic!("{pontoons:?}") };
    let deep = Condition::level(Vec3::zeros(), 5.0);
    let plane = deep.water_plane(vehicle.z0);
    let hull = hydrostatics(&vehicle.hull.mesh, &plane, 1000.0, &Vec3::zeros()).wrench.force.z;
    let all = Baseline::Pontoons { centers: centers.clone(), radius, lift: 1.0, drag: 0.0 };
    assert!((all.wrench(&vehicle, &deep).force.z - hull).abs() < 1e-6 * hull);
    assert!(centers.len() > 10, "{}", centers.len());
    let half = vehicle.dimensions;
    assert!(centers.iter().all(|c| c.x.abs() < 0.5 * half.length && c.y.abs() < 0.5 * half.width));
}

#[test]
fn planted_coefficients_of_fossen_s_form_are_found_with_their_moments() {
    let vehicle = vehicles().remove("husky").unwrap();
    let about = vehicle.center_of_mass;
    // by density; rows as the model's terms
    let terms = |c: &Condition| {
        let (u, v) = (c.velocity.x, c.velocity.y);
        [1.0, c.depth, u, v, u * u.abs(), v * v.abs()]
    };
    let force = [
        [0.0, 0.0, -0.1],
        [0.0, 0.0, 1.9],
        [-0.01, 0.0, 0.0],
        [0.0, -0.02, 0.0],
        [-0.05, 0.0, 0.003],
        [0.0, -0.07, 0.0],
    ];
    let moment = [
        [0.0, 0.01, 0.0],
        [0.0, 0.1, 0.0],
        [0.0, 0.02, 0.0],
        [0.004, 0.0, 0.0],
        [0.0, 0.005, 0.0],
        [0.006, 0.0, 0.001],
    ];
    let of = |c: &Condition, rows: &[[f64; 3]; 6]| -> Vec3 {
        terms(c).iter().zip(rows).map(|(term, row)| Vec3::from(*row) * (*term * c.density)).sum()
    };
    // loads on a data set are about the body origin; no mirror images, which would make odd terms of what is planted
    let planted = planted("husky", true, |c| {
        let (force, moment) = (of(c, &force), of(c, &moment));
        (force, moment + about.cross(&force))
    });
    let original: Vec<State> = planted.into_iter().take(12).collect();
    let [.., fossen] = fit("husky", &original);
    for state in &original {
        let wrench = fossen.wrench(&vehicle, &state.condition);
        assert!((wrench.force - of(&state.condition, &force)).norm() < 1e-6, "{wrench:?}");
        assert!((wrench.moment - of(&state.condition, &moment)).norm() < 1e-6, "{wrench:?}");
        assert!((state.moment(&about).unwrap() - of(&state.condition, &moment)).norm() < 1e-9);
    }
}

#[test]
fn the_figures_are_those_of_planted_errors() {
    let data = analytic(20);
    let source = Source::new(data, &vehicles(), false).unwrap();
    let numbers: Vec<usize> =
        (0..source.data.samples.len()).filter(|&n| source.data.samples[n].vehicle == "husky").collect();
    let states = states(&source, &numbers).unwrap();
    let surface = Vec3::new(0.5, -1.0, 2.0);
    let least = |of: &dyn Fn(&State) -> f64| states.iter().map(of).fold(f64::INFINITY, f64::min);
    let most = |of: &dyn Fn(&State) -> f64| -least(&|state| -of(state));
    let shallow = least(&|state| state.condition.depth);
    let (fastest, steepest) = (most(&State::speed), most(&State::obliqueness));
    let predict = |state: &State| {
        // at the least depth three times the error
        let factor = if state.condition.depth == shallow { 3.0 } else { 1.0 };
        Prediction {
            force: state.force() + surface * factor * 13.0,
            moment: None,
            surface_errors: vec![surface * factor; 13],
            uncertainty: Some(Vec3::new(13.5, 13.5, 13.5)),
        }
    };
    let entry = Entry { name: "paper".into(), predictions: states.iter().map(predict).collect() };
    let contest: Contest = [("husky".to_owned(), Heat { states, entries: vec![entry] })].into();
    let file = DataFile { name: "analytic".into(), sha256: None, provenance: "analytic".into() };
    let epoch = |number: u32| {
        let loss = f64::from(number).recip();
        Epoch { number, training_loss: loss, validation_loss: loss, learning_rate: 1e-3 }
    };
    let about = About {
        data: file,
        splits: vec!["all".into()],
        by_sample: false,
        settings: BTreeMap::new(),
        history: (1..4).map(epoch).collect(),
    };
    let report = Report::new(&contest, &source.vehicles, about, "test").unwrap();
    let husky = &report.vehicles[0];
    assert_eq!((husky.cases, husky.samples), (20, 80));
    // 4 of 80 states are the images of the shallowest case
    let mean = (76.0 + 4.0 * 3.0) / 80.0;
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9 * b.abs().max(1.0), "{a} {b}");
    near(husky.models[0].force.mae[0], 6.5 * mean);
    near(husky.models[0].force.rmse[2], 26.0 * ((76.0 + 4.0 * 9.0) / 80.0_f64).sqrt());
    near(husky.models[0].surface_mae_n.unwrap()[1], mean);
    near(husky.kinds.iter().map(|kind| kind.share).sum(), 1.0);
    near(husky.surfaces.iter().map(|surface| surface.share).sum(), 1.0);
    assert_eq!(
        husky.kinds.iter().map(|k| k.name.as_str()).collect::<Vec<_>>(),
        ["front", "rear", "side", "bottom", "wheel"]
    );
    let slice = husky.slices.iter().find(|slice| slice.name == "depth low").unwrap();
    assert_eq!(slice.samples, 4);
    near(slice.mae_n[2], 78.0);
    // what lies at the upper ends is what was drawn there
    let end = |name: &str| husky.slices.iter().find(|slice| slice.name == name).unwrap();
    for (name, most) in [("speed high", fastest), ("obliqueness high", steepest)] {
        assert!(end(name).bound <= most && end(name).samples >= 4, "{name}");
        assert!(end(name).bound > end(&name.replace("high", "low")).bound, "{name}");
    }
    let worst = husky.flows.iter().map(|flow| flow.error.z).fold(0.0, f64::max);
    near(worst, 78.0);
    assert_eq!(husky.flows.iter().filter(|flow| flow.place[0] == shallow).count(), 4);
    let calibration = husky.calibration.unwrap();
    near(calibration.within_one[1], 0.95);
    near(calibration.within_two[2], 0.95);
    assert_eq!(calibration.cases, 20);
    assert_eq!(husky.paper.unwrap().mae, [1.25, 3.42, 4.38]);
    let page = report.page().unwrap();
    assert!(page.contains("published, different data") && page.contains("<svg") && page.contains("12.96"));
    for title in ["obliqueness [1]", "share of the errors within", "epoch"] {
        assert!(page.contains(title), "{title}");
    }
    // parity, errors over the state, deviations, loss and learning rate
    assert_eq!(page.matches("<svg").count(), 3 + 3 + 1 + 2);
}

/// A record of one short training.
fn trained(by: By) -> (Record, Source, DataFile) {
    let config = Config { epochs: 1, ..Config::analytic() };
    let source = Source::new(analytic(10), &vehicles(), false).unwrap();
    let split = split(&source.data, by, config.seed).unwrap().remove(0);
    let sides = Sides { split: &split, by };
    let run = Run { source: &source, sides, config: &config, checkpoint: None };
    let trained = train::train(run, Variant::Paper, &|_| ()).unwrap();
    let file = DataFile { name: "data".into(), sha256: Some("abc".into()), provenance: "test".into() };
    let record = Record::new(&trained, &run, 1, file.clone(), "test");
    (record, source, file)
}

#[test]
fn what_was_learnt_from_is_no_judge() {
    for by in [By::Case { share: 0.2 }, By::Sample { share: 0.2 }] {
        let (record, source, file) = trained(by);
        let sides = split(&source.data, by, 1).unwrap().remove(0);
        assert_eq!(held_out::of(&record, &file, &source).unwrap().held_out, sides.held_out);
    }
    let (record, source, file) = trained(By::Case { share: 0.2 });
    let other = DataFile { sha256: Some("abd".into()), ..file.clone() };
    assert!(matches!(held_out::of(&record, &other, &source), Err(EvaluateError::OtherData { .. })));
    let mut leak = record.clone();
    let case = leak.split.training_cases.first().unwrap().clone();
    leak.split.held_out_cases.insert(case.clone());
    let error = held_out::of(&leak, &file, &source).unwrap_err().to_string();
    assert!(error.contains(&case) && error.contains("was trained on"), "{error}");
    let mut stranger = record.clone();
    stranger.split.training_cases.remove(&case);
    assert!(matches!(held_out::of(&stranger, &file, &source), Err(EvaluateError::UnknownCase { .. })));
    let (weights, _) = bundles().remove("husky").unwrap().trained.unwrap();
    let error = held_out::check_weights(&record, "husky", &weights).unwrap_err();
    assert!(matches!(error, EvaluateError::OtherWeights { .. }));
}

#[test]
fn an_error_of_a_tenth_of_the_dynamic_load_is_a_tenth_in_every_regime() {
    let vehicle = vehicles().remove("warthog").unwrap();
    let about = vehicle.center_of_mass;
    let mut states = planted("warthog", true, |c| {
        let rest =
            vehicle.at_rest(c).into_iter().fold(wade_core::wrench::Wrench::default(), |sum, load| sum + load);
        let (drag, turn) = (Vec3::new(-900.0, 300.0, 200.0), Vec3::new(20.0, -40.0, 60.0));
        (rest.force + drag, rest.moment + about.cross(&drag) + turn)
    });
    for state in states.iter_mut().step_by(2) {
        state.set = "afloat".to_owned();
        state.condition.bed_clearance = Some(0.3);
    }
    let predictions = states.iter().map(|state| {
        let moment = state.moment(&about).unwrap() + Vec3::new(2.0, -4.0, 6.0);
        let force = state.force() + Vec3::new(-90.0, 30.0, 20.0);
        Prediction { force, moment: Some(moment), surface_errors: Vec::new(), uncertainty: None }
    });
    let entry = Entry { name: "planted".to_owned(), predictions: predictions.collect() };
    let found = regimes(&vehicle, &entry, &states);
    let names: Vec<&str> = found.iter().map(|regime| regime.name.as_str()).collect();
    assert!(names.starts_with(&["afloat"]) && names.contains(&"off the bed"), "{names:?}");
    for regime in &found {
        assert!(regime.cases > 0 && regime.judged == regime.cases, "{regime:?}");
        let shares = [regime.horizontal.unwrap(), regime.vertical].into_iter().chain(regime.moment.unwrap());
        for share in shares {
            assert!((share - 0.1).abs() < 1e-6, "{regime:?}");
        }
    }
}
