//! Settings of the gap workflow.

use serde::{Deserialize, Serialize};

use super::GapError;
use wade_core::condition::GroundContact;
use wade_core::effects::Effect;
use wade_core::physics::Physics;

/// How to look, and what must hold before something is named.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Whether the predictions have water under the tires.
    pub ground_contact: GroundContact,
    /// Effects that are looked for, by name; the whole library unless said otherwise.
    pub library: Vec<Effect>,
    /// Effects that the prediction is known to leave out, by name: before the trials they are as likely there as not.
    pub absent: Vec<Effect>,
    /// Seed of everything random.
    pub seed: u64,
    /// Length of a bin, over which samples are averaged [s].
    pub bin_s: f64,
    /// Length of a block, the unit of cross-validation [s].
    pub block_s: f64,
    /// Parts of the cross-validation.
    pub folds: usize,
    /// Share of the trials that take no part in naming and fitting.
    pub held_out: f64,
    /// Fewest trials, 3 at least: one is kept back, and an effect of one trial is no effect.
    pub least_trials: usize,
    /// Largest probability of a false alarm of one effect.
    pub significance: f64,
    /// Least share of the remaining gap above the floor that an effect must explain.
    pub share_of_remaining: f64,
    /// Least share of the whole explained gap that one of several effects must explain.
    pub share_of_gap: f64,
    /// Least size of an effect over the noise floor of one sample.
    pub relevance: f64,
    /// Most effects that are named together.
    pub most_effects: usize,
    /// Draws of the bootstrap.
    pub bootstrap: usize,
    /// Least share of the structure that the named effects must explain.
    pub coverage: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            ground_contact: GroundContact::Wetted,
            library: Effect::ALL.to_vec(),
            absent: Vec::new(),
            seed: 1,
            bin_s: 0.1,
            block_s: 1.5,
            folds: 8,
            held_out: 0.2,
            least_trials: 4,
            significance: 1e-6,
            share_of_remaining: 0.1,
            share_of_gap: 0.01,
            relevance: 0.08,
            most_effects: 4,
            bootstrap: 400,
            coverage: 0.6,
        }
    }
}

impl Config {
    /// The same for a prediction with a part of the base alone, which leaves out what the rest of it holds.
    pub fn predicted_by(mut self, physics: Physics) -> Self {
        let moving = [Effect::AddedMass, Effect::WaveMemory];
        let steady = [Effect::DragCoefficientError, Effect::LinearDamping];
        match physics {
            Physics::Full => {}
            Physics::QuasiSteady => self.absent.extend(moving),
            Physics::Hydrostatic => self.absent.extend(moving.into_iter().chain(steady)),
        }
        self
    }

    /// Refuses numbers that make no sense, and counts that nobody could wait for.
    pub fn check(&self) -> Result<(), GapError> {
        let positive = [("bin_s", self.bin_s), ("block_s", self.block_s)];
        let shares = [
            ("held_out", self.held_out),
            ("share_of_remaining", self.share_of_remaining),
            ("share_of_gap", self.share_of_gap),
            ("relevance", self.relevance),
            ("coverage", self.coverage),
        ];
        // more folds than the trials have blocks are told by the trials
        let counts = [
            ("folds", self.folds, 2..=usize::MAX, "2 or more"),
            ("least_trials", self.least_trials, 3..=usize::MAX, "3 or more"),
            ("most_effects", self.most_effects, 1..=Effect::ALL.len(), "from 1 to the size of the library"),
            ("bootstrap", self.bootstrap, 20..=100_000, "from 20 to 100000"),
        ];
        if let Some((key, value)) =
            positive.into_iter().find(|(_, value)| !(*value > 0.0 && value.is_finite()))
        {
            return Err(GapError::Config { key, value, expected: "positive" });
        }
        if !(self.significance > 0.0 && self.significance < 1.0) {
            let (key, value) = ("significance", self.significance);
            return Err(GapError::Config { key, value, expected: "above 0 and below 1" });
        }
        if let Some((key, value)) = shares.into_iter().find(|(_, value)| !(0.0..1.0).contains(value)) {
            return Err(GapError::Config { key, value, expected: "from 0 to below 1" });
        }
        match counts.into_iter().find(|(_, value, range, _)| !range.contains(value)) {
            Some((key, value, _, expected)) => Err(GapError::Config { key, value: value as f64, expected }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn numbers_that_make_no_sense_and_counts_without_end_are_refused() {
        for (text, expected) in [
            ("bootstrap = 1000000000", "bootstrap = 1000000000 must be from 20 to 100000"),
            ("most_effects = 99", "most_effects = 99 must be from 1 to the size of the library"),
            ("significance = 1.0", "significance = 1 must be above 0 and below 1"),
            ("significance = 0.0", "significance = 0 must be above 0 and below 1"),
            ("significance = nan", "significance = NaN must be above 0 and below 1"),
            ("held_out = 1.5", "held_out = 1.5 must be from 0 to below 1"),
            ("coverage = nan", "coverage = NaN must be from 0 to below 1"),
            ("bin_s = inf", "bin_s = inf must be positive"),
        ] {
            let config: Config = toml::from_str(text).unwrap();
            assert_eq!(config.check().unwrap_err().to_string(), expected);
        }
        for text in ["", "bootstrap = 100000", "most_effects = 23\nsignificance = 0.5"] {
            assert_eq!(toml::from_str::<Config>(text).unwrap().check(), Ok(()));
        }
    }
}
