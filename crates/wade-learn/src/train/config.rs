//! Settings of a training.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::TrainError;
use super::anchored::loss::AnchoredLoss;
use super::loss::LossConfig;
use crate::dataset::split::MOST_PARTS;
use crate::parameter_table::ParameterTable;
use wade_core::model::network::WIDTHS;

/// How to train; the defaults are the source paper's where it states them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Seed of the plan, the split, the first weights and the order of the batches.
    pub seed: u64,
    /// Epochs at most.
    pub epochs: u32,
    /// Samples a step; a batch holds one vehicle.
    pub batch: usize,
    /// Samples a batch when only the loss is wanted.
    pub held_out_batch: usize,
    /// Learning rate at the start.
    pub learning_rate: f64,
    /// Epochs without improvement of the loss on the validation states after which the learning rate is halved.
    pub patience: u32,
    /// Learning rate below which training ends; 0 for the number of epochs alone.
    pub least_learning_rate: f64,
    /// Which weights are kept. The paper does not say.
    pub keep: Keep,
    /// Mirror front to rear also where the hull is not symmetric, as the paper did.
    pub front_rear: bool,
    /// Share held out, by case and by sample.
    pub held_out_share: f64,
    /// Share of the training side that the paper's network does not learn from: its loss sets the pace of the learning rate.
    /// The paper calls it the validation subset and does not say how large it is, nor whether its figures are of the same.
    pub validation_share: f64,
    /// Parts of the range, by depth and by heading.
    pub parts: usize,
    /// Threads at most, 1 or 2: a batch is worked on in two halves either way, so the bits are the same.
    pub threads: usize,
    /// Share of the learning rate by which Adam pulls each weight towards zero (Loshchilov, Hutter 2019); the paper has none.
    pub weight_decay: f64,
    /// Weights of the loss.
    pub loss: LossConfig,
    /// What the anchored network needs besides.
    pub anchored: AnchoredConfig,
    /// The loads by formula, where these are learnt from.
    pub analytic: Analytic,
}

/// Settings that only the anchored network has.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AnchoredConfig {
    /// Units of each hidden layer, one of [`WIDTHS`].
    pub width: usize,
    /// States between the cases in which the network is taught, for each case.
    pub between: usize,
    /// States on lines through any two cases and beyond, for each case.
    pub outside: usize,
    /// Weights of the loss.
    pub loss: AnchoredLoss,
}

impl Default for AnchoredConfig {
    fn default() -> Self {
        Self { width: 64, between: 40, outside: 8, loss: AnchoredLoss::default() }
    }
}

/// Which weights a training keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Keep {
    /// Those of the last epoch.
    Last,
    /// Those with the least loss that sets the pace.
    Best,
}

/// How many states the loads by formula are computed for, and where.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Analytic {
    /// Cases a vehicle; as many again astern where the hull is not symmetric front to rear.
    pub cases: usize,
    /// Parameter table of each vehicle, by its name.
    pub tables: BTreeMap<String, ParameterTable>,
}

impl Default for Analytic {
    fn default() -> Self {
        let tables = [("husky", ParameterTable::HUSKY), ("warthog", ParameterTable::WARTHOG)];
        Self { cases: 175, tables: tables.map(|(name, table)| (name.to_owned(), table)).into() }
    }
}

impl Default for Config {
    fn default() -> Self {
        Self {
            seed: 1,
            epochs: 1000,
            batch: 16,
            held_out_batch: 64,
            learning_rate: 1e-3,
            patience: 20,
            least_learning_rate: 0.0,
            keep: Keep::Last,
            front_rear: false,
            held_out_share: 0.2,
            validation_share: 0.1,
            parts: 5,
            threads: 2,
            weight_decay: 0.0,
            loss: LossConfig::default(),
            anchored: AnchoredConfig::default(),
            analytic: Analytic::default(),
        }
    }
}

impl Config {
    /// For the loads by formula, one steady sample a case.
    ///
    /// The paper's patience of 20 epochs is one of 700 steps each. 175 cases without its 20 windows a run make 70 steps
    /// an epoch, and after 20 of those the held-out loss is still noise: measured, 60 halves the error of the worst of
    /// three seeds. Training ends after ten halvings, after which nothing moves any more.
    pub fn analytic() -> Self {
        Self { epochs: 2000, patience: 60, least_learning_rate: 1e-6, ..Self::default() }
    }

    /// For the anchored network, which learns from one state a case and some between the cases.
    pub fn anchored() -> Self {
        Self { epochs: 150, patience: 5, least_learning_rate: 1e-6, weight_decay: 0.01, ..Self::default() }
    }

    /// Refuses numbers that make no sense.
    pub fn validate(&self) -> Result<(), TrainError> {
        let least = [
            ("analytic.cases", self.analytic.cases as f64, 2.0, "at least 2"),
            ("parts", self.parts as f64, 2.0, "at least 2"),
            ("batch", self.batch as f64, 1.0, "positive"),
            ("held_out_batch", self.held_out_batch as f64, 1.0, "positive"),
            ("epochs", f64::from(self.epochs), 1.0, "positive"),
            ("patience", f64::from(self.patience), 1.0, "positive"),
            ("threads", self.threads as f64, 1.0, "positive"),
            ("learning_rate", self.learning_rate, f64::MIN_POSITIVE, "positive"),
            ("loss.epsilon", self.loss.epsilon, f64::MIN_POSITIVE, "positive"),
            ("loss.net_weight", self.loss.net_weight, 0.0, "0 or more"),
            ("loss.dry_weight", self.loss.dry_weight, 0.0, "0 or more"),
            ("least_learning_rate", self.least_learning_rate, 0.0, "0 or more"),
            ("weight_decay", self.weight_decay, 0.0, "0 or more"),
            ("anchored.loss.delta", self.anchored.loss.delta, f64::MIN_POSITIVE, "positive"),
            ("anchored.loss.floor", self.anchored.loss.floor, f64::MIN_POSITIVE, "positive"),
            ("anchored.loss.net_weight", self.anchored.loss.net_weight, 0.0, "0 or more"),
            ("anchored.loss.moment_weight", self.anchored.loss.moment_weight, 0.0, "0 or more"),
        ];
        // NaN is neither below nor above
        let refused = least.into_iter().find(|(_, value, least, _)| !(value >= least && value.is_finite()));
        if let Some((key, value, _, expected)) = refused {
            return Err(TrainError::Config { key, value, expected });
        }
        // beyond these a training neither ends nor fits into memory
        let most = [
            ("analytic.cases", self.analytic.cases as f64, 1e6, "at most 1000000"),
            ("anchored.between", self.anchored.between as f64, 1e5, "at most 100000"),
            ("anchored.outside", self.anchored.outside as f64, 1e5, "at most 100000"),
            ("parts", self.parts as f64, MOST_PARTS as f64, "at most 1000"),
            ("batch", self.batch as f64, 1e6, "at most 1000000"),
            ("held_out_batch", self.held_out_batch as f64, 1e6, "at most 1000000"),
            ("epochs", f64::from(self.epochs), 1e7, "at most 10000000"),
            ("patience", f64::from(self.patience), 1e7, "at most 10000000"),
            ("threads", self.threads as f64, 1024.0, "at most 1024"),
        ];
        if let Some((key, value, _, expected)) = most.into_iter().find(|(_, value, most, _)| value > most) {
            return Err(TrainError::Config { key, value, expected });
        }
        // with nothing to learn, random weights would be written as trained ones
        if self.least_learning_rate >= self.learning_rate {
            let (key, value) = ("least_learning_rate", self.least_learning_rate);
            return Err(TrainError::Config { key, value, expected: "below learning_rate" });
        }
        let width = self.anchored.width;
        if !WIDTHS.contains(&width) {
            let (key, value) = ("anchored.width", width as f64);
            return Err(TrainError::Config { key, value, expected: "32, 64, 128 or 256" });
        }
        let shares = [
            ("held_out_share", self.held_out_share),
            ("validation_share", self.validation_share),
            ("loss.alpha", self.loss.alpha),
            ("loss.dry_fraction", f64::from(self.loss.dry_fraction)),
            ("anchored.loss.exponent", self.anchored.loss.exponent),
        ];
        match shares.into_iter().find(|(_, share)| !(0.0..=1.0).contains(share)) {
            Some((key, value)) => Err(TrainError::Config { key, value, expected: "between 0 and 1" }),
            None => Ok(()),
        }
    }
}
