//! How far the answer may be off, learnt from what each case would be missed by, were it not known.
//!
//! The regressions that teach the network state that error for every training case; what the network loses of them in a state
//! that it was not taught, among the case and two neighbors, adds to it. The network learns the size of the sum: it states
//! for each surface a measure `m_s >= 0`, and the standard deviation of a component c of the net force is
//! `k_c sum_s unit_s m_s`. Only the row of the last layer that answers `m_s` and the `k_c` are fitted, so the forces stay as
//! they were. The loss is the negative log-likelihood of a Laplace distribution, `ln d + sqrt(2) |error| / d` with the
//! deviation d: errors of CFD have long tails. The `k_c` are those that hold in cases left out of the fit.

use crate::model::Anchored;
use crate::model::network::OUTPUTS;

/// Steps of gradient descent; the loss has settled long before.
const STEPS: usize = 600;
const RATE: f64 = 0.02;
/// Pull of the weights towards zero, where every surface counts by its dynamic load alone.
const DECAY: f64 = 1e-2;
/// Groups of states, each left out of a fit in turn.
const FOLDS: usize = 5;
/// Error over dynamic load that counts as none: no model of a turbulent flow is better.
const LEAST: f64 = 0.01;

/// A state as the fit sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Missed {
    /// Activations of the last hidden layer and `unit_s` of each wet surface [N].
    pub surfaces: Vec<(Vec<f32>, f64)>,
    /// Error of each component of the net force [N].
    pub error: [f64; OUTPUTS],
}

/// A row of the last layer, its bias, and the factors `k_c`.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Weights of the row.
    pub weights: Vec<f64>,
    /// Its bias.
    pub bias: f64,
    /// Factor of each component.
    pub factors: [f64; OUTPUTS],
}

impl Spread {
    /// `sum_s unit_s m_s` [N].
    fn measure(&self, state: &Missed) -> f64 {
        state.surfaces.iter().map(|(hidden, unit)| unit * Anchored::softplus(self.answer(hidden))).sum()
    }

    fn answer(&self, hidden: &[f32]) -> f32 {
        let dot: f64 = self.weights.iter().zip(hidden).map(|(w, h)| w * f64::from(*h)).sum();
        (self.bias + dot) as f32
    }

    /// Fits all of it to the states; with none, or none that moves, it claims nothing.
    pub fn fit(states: &[Missed]) -> Self {
        let moving = |state: &&Missed| state.surfaces.iter().any(|(_, unit)| *unit > 0.0);
        let states: Vec<&Missed> = states.iter().filter(moving).collect();
        let mut spread = Self::to(&states);
        if states.len() < 2 * FOLDS {
            return spread;
        }
        // a row of as many weights fits the states that it was shown better than others
        let mut sums = [0.0; OUTPUTS];
        for fold in 0..FOLDS {
            let in_fold = |(index, _): &(usize, &&Missed)| index % FOLDS == fold;
            let (own, others): (Vec<_>, Vec<_>) = states.iter().enumerate().partition(in_fold);
            let part = Self::to(&others.into_iter().map(|(_, state)| *state).collect::<Vec<_>>());
            for (_, state) in own {
                let measure = part.measure(state);
                (0..OUTPUTS).for_each(|c| sums[c] += state.error[c].abs() / (part.factors[c] * measure));
            }
        }
        for (factor, sum) in spread.factors.iter_mut().zip(sums) {
            *factor *= f64::max(1.0, std::f64::consts::SQRT_2 * sum / states.len() as f64);
        }
        spread
    }

    /// The row and the factors that suit some states best.
    fn to(states: &[&Missed]) -> Self {
        let width = states.first().and_then(|state| state.surfaces.first()).map_or(0, |(h, _)| h.len());
        let mut spread = Self { weights: vec![0.0; width], bias: 0.0, factors: [1.0; OUTPUTS] };
        if states.is_empty() {
            return spread;
        }
        spread.calibrate(states);
        let mut moments = vec![[0.0_f64; 2]; width + 1];
        for step in 1..=STEPS {
            let gradient = spread.gradient(states);
            let unbias = [0.9_f64, 0.999].map(|beta| 1.0 - beta.powi(step as i32));
            for (index, (slope, [mean, square])) in gradient.into_iter().zip(&mut moments).enumerate() {
                *mean += 0.1 * (slope - *mean);
                *square += 0.001 * (slope * slope - *square);
                let change = RATE * (*mean / unbias[0]) / ((*square / unbias[1]).sqrt() + 1e-8);
                match spread.weights.get_mut(index) {
                    Some(weight) => *weight -= change,
                    None => spread.bias -= change,
                }
            }
            spread.calibrate(states);
        }
        spread
    }

    /// The factors that make the deviations right on the whole: for a Laplace distribution `sqrt(2)` times the mean of
    /// `|error|` over the measure.
    fn calibrate(&mut self, states: &[&Missed]) {
        let measures: Vec<f64> = states.iter().map(|state| self.measure(state)).collect();
        self.factors = std::array::from_fn(|c| {
            let sum: f64 = states.iter().zip(&measures).map(|(s, m)| s.error[c].abs() / m).sum();
            (std::f64::consts::SQRT_2 * sum / states.len() as f64).max(LEAST)
        });
    }

    /// Slope of the mean loss by the weights, then by the bias.
    fn gradient(&self, states: &[&Missed]) -> Vec<f64> {
        let mut gradient: Vec<f64> = self.weights.iter().map(|w| DECAY * w).chain([0.0]).collect();
        for state in states {
            let measure = self.measure(state);
            let by_measure: f64 = (0..OUTPUTS)
                .map(|c| {
                    let off = std::f64::consts::SQRT_2 * state.error[c].abs() / (self.factors[c] * measure);
                    (1.0 - off) / measure
                })
                .sum();
            for (hidden, unit) in &state.surfaces {
                let answer = f64::from(self.answer(hidden));
                let by_answer = by_measure * unit / (1.0 + (-answer).exp()) / states.len() as f64;
                gradient.iter_mut().zip(hidden).for_each(|(g, h)| *g += by_answer * f64::from(*h));
                if let Some(bias) = gradient.last_mut() {
                    *bias += by_answer;
                }
            }
        }
        gradient
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Errors that are ten times larger where the first hidden unit is on.
    #[test]
    fn learns_where_errors_are_large_and_how_large_they_are() {
        let mut random = Random::new(3);
        let mut state = |on: bool| {
            let size = if on { 10.0 } else { 1.0 };
            let mut laplace = || {
                let u = random.unit() - 0.5;
                -size * u.signum() * (1.0 - 2.0 * u.abs()).ln() / std::f64::consts::SQRT_2
            };
            let error = [laplace(), 2.0 * laplace(), laplace()];
            Missed { surfaces: vec![(vec![f32::from(u8::from(on)), 1.0], 5.0)], error }
        };
        let states: Vec<Missed> = (0..2000).map(|i| state(i % 2 == 0)).collect();
        let spread = Spread::fit(&states);
        for (state, size) in [(&states[0], 10.0), (&states[1], 1.0)] {
            for (c, times) in [1.0, 2.0, 1.0].into_iter().enumerate() {
                let deviation = spread.factors[c] * spread.measure(state);
                assert!((deviation / (size * times) - 1.0).abs() < 0.2, "{deviation} for {}", size * times);
            }
        }
    }
}
