//! Learning a network: plan the cases, compute their loads, fit, and judge by cases held out.
//!
//! Reading order: `plan` (which states), `samples` (features and targets), `loss`, `layers` (forward and backward),
//! `adam`, `fit` (epochs), `score` (errors on held-out cases). All in memory on one thread; the same seed gives the
//! same bits on the same kind of processor (the matrix product is chosen by what the processor can do).

pub mod adam;
pub mod fit;
pub mod layers;
pub mod loss;
pub mod plan;
pub mod samples;
pub mod score;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::domain::Domain;
use crate::model::network::{Network, OUTPUTS, Scaling};
use crate::random::Random;
use crate::vehicle::Vehicle;
use fit::{Epoch, Fit};
use loss::LossConfig;
use plan::Table;
use samples::Dataset;
use score::Score;

/// How to train; the defaults are the source paper's where it states them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Seed of the plan, the split, the first weights and the order of the batches.
    pub seed: u64,
    /// Cases a vehicle, each with its three mirror images.
    pub cases: usize,
    /// Share of the cases that is held out.
    pub held_out_share: f64,
    /// Epochs at most; the learning rate usually ends training after about 800.
    pub epochs: u32,
    /// Samples a step; a batch holds one vehicle.
    pub batch: usize,
    /// Learning rate at the start.
    pub learning_rate: f64,
    /// Epochs without improvement of the held-out loss after which the learning rate is halved.
    ///
    /// The paper has 20, of 700 steps each. 175 cases without its 20 windows a run make 70 steps an epoch, and after 20
    /// of those the held-out loss is still noise: measured, 60 halves the error of the worst of three seeds.
    pub patience: u32,
    /// Learning rate below which training ends: ten halvings, after which nothing moves any more.
    ///
    /// The held-out cases set the pace, as in the paper, but choose no weights: those of the last epoch are kept.
    pub least_learning_rate: f64,
    /// Weights of the loss.
    pub loss: LossConfig,
    /// Parameter table of each vehicle, by its name.
    pub tables: BTreeMap<String, Table>,
}

impl Default for Config {
    fn default() -> Self {
        let tables = [("husky", Table::HUSKY), ("warthog", Table::WARTHOG)];
        Self {
            seed: 1,
            cases: 175,
            held_out_share: 0.2,
            epochs: 2000,
            batch: 16,
            learning_rate: 1e-3,
            patience: 60,
            least_learning_rate: 1e-6,
            loss: LossConfig::default(),
            tables: tables.map(|(name, table)| (name.to_owned(), table)).into(),
        }
    }
}

/// Why training did not start or did not end well.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrainError {
    /// A vehicle without a parameter table.
    #[error("no parameter table for vehicle `{vehicle}`")]
    NoTable {
        /// Its name.
        vehicle: String,
    },
    /// A table with a range upside down or without a positive speed or density.
    #[error("the parameter table of `{vehicle}` has a range that is not one")]
    Table {
        /// Name of the vehicle.
        vehicle: String,
    },
    /// A number that makes no sense.
    #[error("`{key}` is {value}, which is not {expected}")]
    Config {
        /// Name of the key.
        key: &'static str,
        /// What it is.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// No vehicle, hence no case.
    #[error("there is nothing to learn from: no vehicle was given")]
    NoCases,
    /// The loss is no longer a number.
    #[error("the loss is not finite after epoch {epoch}")]
    Diverged {
        /// Number of the epoch.
        epoch: u32,
    },
}

impl Config {
    /// Refuses numbers that make no sense.
    pub fn validate(&self) -> Result<(), TrainError> {
        let positive = [
            ("cases", self.cases as f64, 2.0),
            ("batch", self.batch as f64, 1.0),
            ("epochs", f64::from(self.epochs), 1.0),
            ("patience", f64::from(self.patience), 1.0),
            ("learning_rate", self.learning_rate, f64::MIN_POSITIVE),
            ("loss.epsilon", self.loss.epsilon, f64::MIN_POSITIVE),
        ];
        for (key, value, least) in positive {
            if !(value >= least && value.is_finite()) {
                let expected = if least > 1.0 { "at least 2" } else { "positive" };
                return Err(TrainError::Config { key, value, expected });
            }
        }
        let value = self.least_learning_rate;
        // with nothing to learn, random weights would be written as trained ones; NaN is neither below nor above
        if value.is_nan() || value >= self.learning_rate {
            let expected = "below learning_rate";
            return Err(TrainError::Config { key: "least_learning_rate", value, expected });
        }
        let shares = [("held_out_share", self.held_out_share), ("loss.alpha", self.loss.alpha)];
        match shares.into_iter().find(|(_, share)| !(0.0..=1.0).contains(share)) {
            Some((key, value)) => Err(TrainError::Config { key, value, expected: "between 0 and 1" }),
            None => Ok(()),
        }
    }

    fn table(&self, vehicle: &Vehicle) -> Result<&Table, TrainError> {
        let name = || vehicle.name.clone();
        let table = self.tables.get(&vehicle.name).ok_or_else(|| TrainError::NoTable { vehicle: name() })?;
        if table.is_valid() { Ok(table) } else { Err(TrainError::Table { vehicle: name() }) }
    }
}

/// What came out.
#[derive(Debug, Clone, PartialEq)]
pub struct Trained {
    /// One network for all vehicles.
    pub network: Network,
    /// Its standardisation.
    pub scaling: Scaling,
    /// What holds for each vehicle, in the order given.
    pub vehicles: Vec<TrainedVehicle>,
    /// Every epoch.
    pub history: Vec<Epoch>,
}

/// The part of a training that belongs to one vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainedVehicle {
    /// Its name.
    pub name: String,
    /// The states learnt from.
    pub domain: Domain,
    /// Root mean square of the error of the net force over density on held-out cases [m4/s2].
    pub held_out_rms: [f64; OUTPUTS],
    /// Errors on held-out cases in newtons.
    pub score: Score,
}

/// Trains one network for all vehicles on their analytic loads; `progress` hears of every epoch.
pub fn train(
    vehicles: &[Vehicle],
    config: &Config,
    progress: &dyn Fn(&Epoch),
) -> Result<Trained, TrainError> {
    config.validate()?;
    let mut random = Random::new(config.seed);
    let data = gather(vehicles, config, &mut random)?;
    let mut fit = Fit::new(&data, config, &mut random)?;
    let mut history = Vec::new();
    while !fit.is_over() {
        let epoch = fit.epoch()?;
        progress(&epoch);
        history.push(epoch);
    }
    let of_vehicle = |(index, vehicle): (usize, &Vehicle)| {
        let samples = || data.held_out.iter().filter(|s| s.vehicle == index);
        let score = Score::of(samples(), |sample| fit.net_force_over_density(sample));
        let domain = config.table(vehicle)?.domain();
        Ok(TrainedVehicle { name: vehicle.name.clone(), domain, held_out_rms: score.rms_over_density, score })
    };
    let vehicles = vehicles.iter().enumerate().map(of_vehicle).collect::<Result<_, TrainError>>()?;
    Ok(Trained { network: fit.network(), scaling: fit.scaling().clone(), vehicles, history })
}

fn gather(vehicles: &[Vehicle], config: &Config, random: &mut Random) -> Result<Dataset, TrainError> {
    let mut data = Dataset::default();
    for (index, vehicle) in vehicles.iter().enumerate() {
        let table = config.table(vehicle)?;
        data.add(index, vehicle, table, config.cases, config.held_out_share, &mut random.fork());
    }
    Ok(data)
}
