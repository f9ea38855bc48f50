//! Training: lowers the loss, repeats bit for bit whatever the threads and interruptions, keeps its split, and says what
//! it cannot do.

#![allow(clippy::unwrap_used)]

use std::cell::RefCell;
use std::collections::BTreeMap;

use tempfile::TempDir;
use wade_core::bundle;
use wade_core::condition::{Condition, GroundContact};
use wade_core::features;
use wade_core::forces::Forces;
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::model::{Model, Workspace, kernel::Isa};
use wade_core::vehicle::{Vehicle, shipped};
use wade_learn::dataset::label::{labels, order};
use wade_learn::dataset::split::{By, Split, split};
use wade_learn::dataset::{self, Dataset, Image, Rest, SurfaceLoad};
use wade_learn::parameter_table::ParameterTable;
use wade_learn::train::checkpoint::Checkpoint;
use wade_learn::train::samples::samples;
use wade_learn::train::task::Task;
use wade_learn::train::{
    self, Analytic, Config, Keep, Published, Run, Sides, Source, TrainError, Trained, Variant,
};

const BY: By = By::Case { share: 0.2 };

fn vehicles() -> BTreeMap<String, Vehicle> {
    let vehicles = [shipped::husky(), shipped::warthog()].map(|v| v.unwrap().vehicle().unwrap());
    vehicles.into_iter().map(|vehicle| (vehicle.name.clone(), vehicle)).collect()
}

fn analytic(cases: usize) -> Dataset {
    let settings = Analytic { cases, ..Analytic::default() };
    train::analytic::dataset(&vehicles(), &settings, 1).unwrap()
}

fn source() -> Source {
    Source::new(analytic(20), &vehicles(), false).unwrap()
}

fn short() -> Config {
    Config { epochs: 4, ..Config::analytic() }
}

fn by_case(source: &Source) -> Split {
    split(&source.data, BY, 1).unwrap().remove(0)
}

fn run(config: &Config) -> Trained<Published> {
    let source = source();
    let split = by_case(&source);
    train::train(
        Run { source: &source, sides: Sides { split: &split, by: BY }, config, checkpoint: None },
        Variant::Paper,
        &|_| (),
    )
    .unwrap()
}

fn same(a: &Trained<Published>, b: &Trained<Published>) -> bool {
    a.layers == b.layers && a.history == b.history && a.vehicles == b.vehicles
}

#[test]
fn lowers_the_loss_and_repeats_bit_for_bit_on_one_thread_and_on_two() {
    let first = run(&short());
    let (start, end) = (first.history[0], first.history[3]);
    assert!(end.training_loss < 0.5 * start.training_loss, "{start:?} to {end:?}");
    assert!(end.validation_loss < start.validation_loss, "{start:?} to {end:?}");
    assert!(same(&first, &run(&Config { threads: 1, ..short() })));
    assert_ne!(first.layers, run(&Config { seed: 2, ..short() }).layers);
}

#[test]
fn reports_each_vehicle_with_its_domain_and_error() {
    let trained = run(&Config { epochs: 1, ..short() });
    let names: Vec<_> = trained.vehicles.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["husky", "warthog"]);
    for (vehicle, table) in trained.vehicles.iter().zip([ParameterTable::HUSKY, ParameterTable::WARTHOG]) {
        // 4 cases with four images; of the Warthog, which is not symmetric, 8 with two
        assert_eq!(vehicle.score.samples, 16);
        assert!(trained.learnt.rms[&vehicle.name].iter().all(|rms| rms.is_finite() && *rms > 0.0));
        let depth = vehicle.domain.depth_m;
        let range = table.depth_m.max - table.depth_m.min;
        // wider than where the cases lie by two of their mean distances: 16 or 32 cases were learnt from
        assert!(depth.min >= table.depth_m.min - range / 7.5 && depth.max <= table.depth_m.max + range / 7.5);
        assert!(depth.max - depth.min > 0.8 * range);
    }
}

#[test]
fn an_input_that_never_varied_has_no_say() {
    let network = run(&Config { epochs: 1, ..short() }).layers.network();
    let vz = features::INPUTS - features::GLOBAL + 5;
    assert!(network.w1.chunks(features::INPUTS).all(|weights| weights[vz] == 0.0));
}

#[test]
fn the_best_weights_are_those_of_the_epoch_with_the_least_validation_loss() {
    let config = Config { epochs: 12, keep: Keep::Best, learning_rate: 0.02, ..short() };
    let trained = run(&config);
    let least =
        trained.history.iter().min_by(|a, b| a.validation_loss.total_cmp(&b.validation_loss)).unwrap();
    assert_eq!(trained.kept_epoch, least.number);
    let until_then = run(&Config { epochs: least.number, keep: Keep::Last, ..config });
    assert_eq!(trained.layers, until_then.layers);
}

#[test]
fn images_of_a_case_stay_together_and_statistics_come_from_training_alone() {
    let source = source();
    let sides = by_case(&source);
    assert!(sides.leaks(&source.data).is_empty());
    let side = |numbers: &[usize]| samples(&source.data, numbers, &source.vehicles).unwrap();
    let (training, mut held_out) = (side(&sides.training), side(&sides.held_out));
    let (task, scaling) = Task::new(Variant::Paper, &training, &held_out, &short()).unwrap();
    for sample in &mut held_out {
        sample.global = sample.global.map(|x| 1e3 * x);
        sample.targets.iter_mut().for_each(|target| *target = target.map(|x| 1e3 * x));
    }
    let (other, other_scaling) = Task::new(Variant::Paper, &training, &held_out, &short()).unwrap();
    assert_eq!((&scaling, &task.training), (&other_scaling, &other.training));
    assert_ne!(task.validation, other.validation);
    let mean = training.iter().map(|s| s.global[0]).sum::<f64>() / training.len() as f64;
    assert!((f64::from(scaling.global_mean[0]) - mean).abs() < 1e-6);
}

#[test]
fn nothing_of_the_held_out_side_reaches_the_weights_or_what_they_state() {
    let source = source();
    let split = by_case(&source);
    let mut spoilt = source.clone();
    for &number in &split.held_out {
        let loads = &mut spoilt.data.samples[number].surfaces;
        loads.iter_mut().for_each(|load| load.force *= 10.0);
    }
    // long enough for the pace to matter
    let config = Config { epochs: 30, patience: 2, ..short() };
    let train = |source: &Source| {
        let sides = Sides { split: &split, by: BY };
        train::train(Run { source, sides, config: &config, checkpoint: None }, Variant::Paper, &|_| ())
            .unwrap()
    };
    let (clean, other) = (train(&source), train(&spoilt));
    assert!(clean.history.last().unwrap().learning_rate < config.learning_rate, "the pace has changed");
    assert_eq!((&clean.layers, &clean.learnt.rms), (&other.layers, &other.learnt.rms));
    assert_ne!(clean.vehicles[0].score, other.vehicles[0].score);
}

#[test]
fn a_case_on_both_sides_is_refused_but_of_a_split_by_sample() {
    let source = source();
    let mut leak = by_case(&source);
    leak.training.push(leak.held_out[0]);
    let train = |by, split: &Split| {
        let config = Config { epochs: 1, ..short() };
        train::train(
            Run { source: &source, sides: Sides { split, by }, config: &config, checkpoint: None },
            Variant::Paper,
            &|_| (),
        )
    };
    let error = train(BY, &leak).unwrap_err().to_string();
    assert!(
        error.contains(
            "the split leaks: the states of 1 held-out cases are training states too, the first is `"
        ),
        "{error}"
    );
    let by = By::Sample { share: 0.2 };
    let by_sample = split(&source.data, by, 1).unwrap().remove(0);
    assert!(!by_sample.leaks(&source.data).is_empty());
    assert!(train(by, &by_sample).is_ok());
}

#[test]
fn a_label_is_the_load_with_the_hull_s_own_hydrostatics() {
    let vehicle = &vehicles()["warthog"];
    let mut state = Condition::level(Vec3::new(1.0, 0.2, 0.0), 0.25);
    state.ground_contact = GroundContact::Dry;
    let mut sample = dataset::analytic::samples(vehicle, "paper", &[state]).remove(0);
    let names: Vec<String> = vehicle.surfaces.iter().rev().map(|surface| surface.name.clone()).collect();
    sample.surfaces.reverse();
    let order = order(vehicle, &names).unwrap();
    let dynamic = Vec3::new(-3.0, 1.0, 2.0);
    let moment = Vec3::new(0.1, 0.2, 0.3);
    for load in &mut sample.surfaces {
        // a mesh that displaces a tenth more than the hull
        let rest = load.rest.unwrap();
        let rest = Rest { force: rest.force * 1.1, moment: rest.moment * 1.1 };
        *load = SurfaceLoad {
            force: rest.force + dynamic,
            moment: Some(rest.moment + moment),
            rest: Some(rest),
            viscous: None,
        };
    }
    let exact = vehicle.at_rest(&state);
    for (label, exact) in labels(vehicle, &order, &sample).iter().zip(&exact) {
        assert!((label.force - exact.force - dynamic).norm() < 1e-9);
        assert!((label.moment.unwrap() - exact.moment - moment).norm() < 1e-9);
    }
    // the patches of dry ground contact carry no pressure: depth times their area is missing
    let wetted = vehicle.at_rest(&Condition { ground_contact: GroundContact::Wetted, ..state });
    let lost: f64 = wetted.iter().zip(&exact).map(|(a, b)| a.force.z - b.force.z).sum();
    let area: f64 = vehicle.contacts.iter().map(|patch| patch.area).sum();
    assert!((lost - 1000.0 * GRAVITY * 0.25 * area).abs() < 1e-6 && lost > 100.0, "{lost}");

    sample.surfaces.iter_mut().for_each(|load| load.rest = None);
    let plain: Vec3 = labels(vehicle, &order, &sample).iter().map(|label| label.force).sum();
    assert!((plain - sample.net_force()).norm() < 1e-9);
}

#[test]
fn the_bundle_answers_as_the_trainer_s_own_forward_pass() {
    let source = source();
    let split = by_case(&source);
    let sides = Sides { split: &split, by: BY };
    let trained = train::train(
        Run { source: &source, sides, config: &short(), checkpoint: None },
        Variant::Paper,
        &|_| (),
    )
    .unwrap();
    let held_out = samples(&source.data, &split.held_out, &source.vehicles).unwrap();
    let folder = TempDir::new().unwrap();
    for (index, of_vehicle) in trained.vehicles.iter().enumerate() {
        let path = folder.path().join(&of_vehicle.name);
        let mut bundle = bundle::read(&crate::common::vehicles().join(&of_vehicle.name)).unwrap();
        let weights = trained.weights(of_vehicle, source.data.meta.ground_contact, "test".into());
        bundle.trained = Some((weights, of_vehicle.domain));
        bundle::write(&path, &bundle).unwrap();
        let model: Model = bundle::load(&path, Isa::available()[0]).unwrap();
        let (mut forces, mut workspace) = (Forces::default(), Workspace::new());
        let states = split.held_out.iter().zip(&held_out).filter(|(_, sample)| sample.vehicle == index);
        for (&number, sample) in states {
            let condition = &source.data.samples[number].condition;
            model.evaluate(condition, &mut workspace, &mut forces);
            let own = trained.force_over_density(sample);
            let scale: f64 = own.iter().map(|force| Vec3::from(*force).norm()).sum();
            for (own, served) in own.iter().zip(&forces.surfaces) {
                let (own, served) = (Vec3::from(*own), served.force / condition.density);
                assert!((own - served).norm() < 1e-5 * scale, "{own} {served}");
            }
        }
    }
}

#[test]
fn a_run_that_stopped_goes_on_with_the_same_bits() {
    let source = source();
    let split = by_case(&source);
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("state");
    for keep in [Keep::Last, Keep::Best] {
        let config = Config { epochs: 24, patience: 3, learning_rate: 0.01, keep, ..short() };
        let sides = Sides { split: &split, by: BY };
        let train = |config: &Config, resume| {
            let checkpoint = Checkpoint { path: path.clone(), resume };
            train::train(
                Run { source: &source, sides, config, checkpoint: Some(&checkpoint) },
                Variant::Paper,
                &|_| (),
            )
        };
        let whole = train::train(
            Run { source: &source, sides, config: &config, checkpoint: None },
            Variant::Paper,
            &|_| (),
        )
        .unwrap();
        // the state of epoch 10 is what a run that was killed in epoch 17 leaves
        train(&Config { epochs: 17, ..config.clone() }, false).unwrap();
        let resumed = train(&config, true).unwrap();
        assert!(same(&whole, &resumed));
        assert_eq!(whole.kept_epoch, resumed.kept_epoch);

        let again = train(&config, false).unwrap_err().to_string();
        assert!(again.contains("state: is there already: give --resume"), "{again}");
        let other = train(&Config { batch: 8, ..config.clone() }, true).unwrap_err().to_string();
        assert!(other.contains("state: belongs to a training with other data"), "{other}");
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let cut = train(&config, true).unwrap_err().to_string();
        assert!(cut.contains("state: no checkpoint"), "{cut}");
        std::fs::remove_file(&path).unwrap();
    }
}

#[test]
fn refuses_what_it_cannot_train() {
    let none = train::analytic::dataset(&BTreeMap::new(), &Analytic::default(), 1).unwrap_err();
    assert!(matches!(none, TrainError::NoTable));
    let unknown = Source::new(analytic(4), &BTreeMap::new(), false).unwrap_err();
    assert!(matches!(unknown, TrainError::UnknownVehicle { vehicle } if vehicle == "husky"));
    let mut renamed = analytic(4);
    renamed.meta.vehicles.get_mut("husky").unwrap()[2] = "bonnet".into();
    let error = Source::new(renamed, &vehicles(), false).unwrap_err().to_string();
    assert!(error.contains("vehicle `husky`") && error.contains("`bonnet` is in one of them"), "{error}");

    let mut surging = analytic(4);
    surging.samples[5].condition.acceleration = Vec3::new(0.3, 0.0, 0.4);
    let case = surging.samples[5].case.clone();
    let error = Source::new(surging, &vehicles(), false).unwrap_err().to_string();
    assert!(error.contains(&format!("case `{case}` accelerates by 0.50 m/s2")), "{error}");
    let source = source();
    let mut sides = by_case(&source);
    let train = |split: &Split, config: &Config| {
        train::train(
            Run { source: &source, sides: Sides { split, by: BY }, config, checkpoint: None },
            Variant::Paper,
            &|_| (),
        )
        .unwrap_err()
    };
    let hot = Config { learning_rate: 1e30, ..short() };
    assert!(matches!(train(&sides, &hot), TrainError::Diverged { .. }));
    let idle = train(&sides, &Config { batch: 0, ..short() });
    assert_eq!(idle.to_string(), "`batch` is 0, which is not positive");
    let mut beds = source.clone();
    let parked = beds.data.samples.iter().position(|s| s.vehicle == "warthog").unwrap();
    beds.data.samples[parked].condition.ground_velocity = Vec3::zeros();
    let told = Sides { split: &sides, by: BY };
    let error = train::train(
        Run { source: &beds, sides: told, config: &short(), checkpoint: None },
        Variant::Paper,
        &|_| (),
    )
    .unwrap_err();
    let case = &source.data.samples[parked].case;
    assert!(
        matches!(error, TrainError::Beds { vehicle, resting, .. } if vehicle == "warthog" && resting == *case)
    );
    sides.training.clear();
    assert_eq!(train(&sides, &short()).to_string(), "the training side of the split is empty");

    let both = samples(&source.data, &[0, source.data.samples.len() - 1], &source.vehicles).unwrap();
    let (task, _) = Task::new(Variant::Paper, &both, &both, &short()).unwrap();
    let mixed = task.batch(&[&task.training[0], &task.training[1]]).unwrap_err();
    let expected = if both[0].vehicle == 0 { "0 and 1" } else { "1 and 0" };
    assert_eq!(mixed.to_string(), format!("a batch mixes the vehicles {expected}"));
}

#[test]
fn front_and_rear_are_mirrored_on_request_alone() {
    let count = |front_rear| {
        let source = Source::new(analytic(3), &vehicles(), front_rear).unwrap();
        let of =
            |image| source.data.samples.iter().filter(|s| s.vehicle == "warthog" && s.image == image).count();
        [Image::LeftRight, Image::FrontRear].map(of)
    };
    assert_eq!((count(false), count(true)), ([6, 0], [6, 6]));
}

#[test]
fn the_configuration_is_toml_and_refuses_unknown_keys() {
    let config: Config = toml::from_str("epochs = 3\nkeep = \"best\"\n[loss]\nalpha = 0.2").unwrap();
    assert_eq!((config.epochs, config.batch, config.loss.alpha), (3, 16, 0.2));
    assert_eq!((config.patience, config.keep), (20, Keep::Best));
    assert!(toml::from_str::<Config>("epoch = 3").is_err());
}

#[test]
fn weights_that_reward_errors_and_counts_without_end_are_refused() {
    for (text, expected) in [
        ("[loss]\nnet_weight = -0.1", "`loss.net_weight` is -0.1, which is not 0 or more"),
        ("[loss]\ndry_weight = nan", "`loss.dry_weight` is NaN, which is not 0 or more"),
        ("[loss]\ndry_fraction = 2.0", "`loss.dry_fraction` is 2, which is not between 0 and 1"),
        (
            "[anchored.loss]\nmoment_weight = inf",
            "`anchored.loss.moment_weight` is inf, which is not 0 or more",
        ),
        ("[anchored]\nbetween = 1000000000", "`anchored.between` is 1000000000, which is not at most 100000"),
        ("[anchored]\noutside = 100001", "`anchored.outside` is 100001, which is not at most 100000"),
        ("epochs = 4000000000", "`epochs` is 4000000000, which is not at most 10000000"),
        ("batch = 1000000000000", "`batch` is 1000000000000, which is not at most 1000000"),
        ("parts = 1000000000000", "`parts` is 1000000000000, which is not at most 1000"),
        ("threads = 100000", "`threads` is 100000, which is not at most 1024"),
        (
            "[analytic]\ncases = 1000000000000",
            "`analytic.cases` is 1000000000000, which is not at most 1000000",
        ),
    ] {
        let config: Config = toml::from_str(text).unwrap();
        assert_eq!(config.validate().unwrap_err().to_string(), expected);
    }
    for config in [Config::default(), Config::analytic(), Config::anchored()] {
        config.validate().unwrap();
    }
}

#[test]
fn progress_is_heard_of_every_epoch() {
    let (source, heard) = (source(), RefCell::new(Vec::new()));
    let split = by_case(&source);
    let sides = Sides { split: &split, by: BY };
    let trained = train::train(
        Run { source: &source, sides, config: &short(), checkpoint: None },
        Variant::Paper,
        &|epoch| {
            heard.borrow_mut().push(*epoch);
        },
    );
    assert_eq!(*heard.borrow(), trained.unwrap().history);
}
