//! Training: lowers the loss, repeats bit for bit, keeps its split, and says what it cannot do.

#![allow(clippy::unwrap_used)]

use std::cell::RefCell;

use wade::features;
use wade::random::Random;
use wade::train::plan::Table;
use wade::train::samples::Dataset;
use wade::train::{Config, TrainError, Trained, train};
use wade::vehicle::{Vehicle, shipped};

fn vehicles() -> Vec<Vehicle> {
    [shipped::husky(), shipped::warthog()].map(|v| v.unwrap().vehicle().unwrap()).into()
}

fn short() -> Config {
    Config { cases: 20, epochs: 4, ..Config::default() }
}

fn run(config: &Config) -> Trained {
    train(&vehicles(), config, &|_| ()).unwrap()
}

#[test]
fn lowers_the_loss_and_repeats_bit_for_bit() {
    let heard = RefCell::new(Vec::new());
    let first = train(&vehicles(), &short(), &|epoch| heard.borrow_mut().push(*epoch)).unwrap();
    assert_eq!(*heard.borrow(), first.history);
    let (start, end) = (first.history[0], first.history[3]);
    assert!(end.training_loss < 0.5 * start.training_loss, "{start:?} to {end:?}");
    assert!(end.held_out_loss < start.held_out_loss, "{start:?} to {end:?}");
    assert_eq!(first, run(&short()));
    assert_ne!(first.network, run(&Config { seed: 2, ..short() }).network);
}

#[test]
fn reports_each_vehicle_with_its_domain_and_error() {
    let trained = run(&Config { epochs: 1, ..short() });
    let names: Vec<_> = trained.vehicles.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["husky", "warthog"]);
    for vehicle in &trained.vehicles {
        assert_eq!(vehicle.score.samples, 4 * 4);
        assert!(vehicle.held_out_rms.iter().all(|rms| rms.is_finite() && *rms > 0.0));
    }
    assert_eq!(trained.vehicles[0].domain, Table::HUSKY.domain());
}

#[test]
fn an_input_that_never_varied_has_no_say() {
    let network = run(&Config { epochs: 1, ..short() }).network;
    let vz = features::INPUTS - features::GLOBAL + 5;
    assert!(network.w1.chunks(features::INPUTS).all(|weights| weights[vz] == 0.0));
}

#[test]
fn images_of_a_case_stay_together_and_statistics_come_from_training_alone() {
    let (mut data, vehicle) = (Dataset::default(), &vehicles()[0]);
    data.add(0, vehicle, &Table::HUSKY, 10, 0.2, &mut Random::new(1));
    assert_eq!((data.training.len(), data.held_out.len()), (32, 8));
    assert!(data.held_out.iter().all(|h| data.training.iter().all(|t| t.case != h.case)));
    let scaling = data.scaling().unwrap();
    data.held_out.clear();
    assert_eq!(data.scaling().unwrap(), scaling);
    let speeds = data.training.iter().map(|s| s.global[0]);
    assert!((f64::from(scaling.global_mean[0]) - speeds.sum::<f64>() / 32.0).abs() < 1e-6);
}

#[test]
fn refuses_what_it_cannot_train() {
    let error = |vehicles: &[Vehicle], config: &Config| train(vehicles, config, &|_| ()).unwrap_err();
    assert_eq!(error(&[], &short()), TrainError::NoCases);
    let nameless = Config { tables: Default::default(), ..short() };
    assert_eq!(error(&vehicles(), &nameless), TrainError::NoTable { vehicle: "husky".into() });
    let empty = error(&vehicles(), &Config { cases: 1, ..short() });
    assert_eq!(empty.to_string(), "`cases` is 1, which is not at least 2");
    let hot = Config { learning_rate: 1e30, ..short() };
    assert!(matches!(error(&vehicles(), &hot), TrainError::Diverged { .. }));
}

#[test]
fn the_configuration_is_toml_and_refuses_unknown_keys() {
    let config: Config = toml::from_str("epochs = 3\n[loss]\nalpha = 0.2").unwrap();
    assert_eq!((config.epochs, config.cases, config.loss.alpha), (3, 175, 0.2));
    assert!(toml::from_str::<Config>("epoch = 3").is_err());
}
