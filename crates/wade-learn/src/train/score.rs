//! Errors of the net force on held-out samples.

use serde::{Deserialize, Serialize};

use wade_core::model::network::OUTPUTS;

/// Errors of the net force, component by component, body frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Score {
    /// Number of states, mirror images included.
    pub samples: usize,
    /// Mean absolute error [N].
    pub mae: [f64; OUTPUTS],
    /// Root mean square error [N].
    pub rms: [f64; OUTPUTS],
    /// Root mean square error of force over density [m4/s2].
    pub rms_over_density: [f64; OUTPUTS],
    /// Standard deviation of the true force, for scale [N].
    pub spread: [f64; OUTPUTS],
}

/// The net force over density in a state [m4/s2].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// Fluid density [kg/m3].
    pub density: f64,
    /// As it is.
    pub truth: [f64; OUTPUTS],
    /// As it was predicted.
    pub guess: [f64; OUTPUTS],
}

impl Score {
    /// Compares predictions with the truth. All zero without any.
    pub fn of(states: impl Iterator<Item = Judged>) -> Self {
        let mut score = Self::default();
        let mut mean = [0.0; OUTPUTS];
        for Judged { density, truth, guess } in states {
            score.samples += 1;
            for c in 0..OUTPUTS {
                let error = guess[c] - truth[c];
                let force = truth[c] * density;
                score.mae[c] += (error * density).abs();
                score.rms[c] += (error * density).powi(2);
                score.rms_over_density[c] += error.powi(2);
                mean[c] += force;
                score.spread[c] += force.powi(2);
            }
        }
        score.finish(mean)
    }

    fn finish(mut self, mean: [f64; OUTPUTS]) -> Self {
        let count = self.samples.max(1) as f64;
        self.mae = self.mae.map(|sum| sum / count);
        self.rms = self.rms.map(|sum| (sum / count).sqrt());
        self.rms_over_density = self.rms_over_density.map(|sum| (sum / count).sqrt());
        for (spread, mean) in self.spread.iter_mut().zip(mean) {
            *spread = (*spread / count - (mean / count).powi(2)).max(0.0).sqrt();
        }
        self
    }
}
