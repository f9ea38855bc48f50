//! How far the answer may be off, learnt from what an ensemble says of it.
//!
//! In each training case that is what those miss that do not know it; between the cases, how far they go apart, and the noise
//! that the cases have; everywhere besides, what the network loses of what it was taught. The network learns the size of it:
//! it states for each surface a measure `m_s >= 0`, and the standard deviation of a component c of the net force on vehicle v
//! is `k_vc sum_s unit_s m_s`. Only the row of the last layer that answers `m_s` and the `k_vc` are fitted, so the forces stay
//! as they were. The loss is the negative log-likelihood of a Laplace distribution, `ln d + sqrt(2) |error| / d` with the
//! deviation d: errors of CFD have long tails.
//!
//! The `k_vc` are those that hold in cases that neither the regression nor the fit of the measure knew: 68.3 % of their errors
//! lie within one deviation, and 95.4 % within two, of as many as there are and one more (conformal; Vovk, Annals of
//! Mathematics and Artificial Intelligence 2015). What is meant is the error of the mean flow, not how that flow swings.

use super::ensemble::MEMBERS;
use wade_core::model::Anchored;
use wade_core::model::network::OUTPUTS;

/// Steps of gradient descent; the loss has settled long before.
const STEPS: usize = 600;
const RATE: f64 = 0.02;
/// Pull of the weights towards zero, where every surface counts by its dynamic load alone.
const DECAY: f64 = 1e-2;
/// Error over dynamic load that counts as none: no model of a turbulent flow is better.
const LEAST: f64 = 0.01;
/// Shares of a normal distribution within so many deviations.
const WITHIN: [(f64, f64); 2] = [(1.0, 0.683), (2.0, 0.954)];
/// Fewest cases of a vehicle that its own factors are told from.
const ENOUGH: usize = 20;

/// A state as the fit sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Missed {
    /// Index of the vehicle.
    pub vehicle: usize,
    /// Part of the cases that it belongs to.
    pub part: usize,
    /// True of a case, false of a state between cases.
    pub is_case: bool,
    /// Activations of the last hidden layer and `unit_s` of each wet surface [N].
    pub surfaces: Vec<(Vec<f32>, f64)>,
    /// Error of each component of the net force, or how large it is expected to be [N].
    pub error: [f64; OUTPUTS],
}

/// A row of the last layer, its bias, and the factors `k_vc`.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Weights of the row.
    pub weights: Vec<f64>,
    /// Its bias.
    pub bias: f64,
    /// Factor of each component, by vehicle.
    pub factors: Vec<[f64; OUTPUTS]>,
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

    /// Fits all of it to the states of so many vehicles; with none, or none that moves, it claims nothing.
    pub fn fit(states: &[Missed], vehicles: usize) -> Self {
        let moving = |state: &&Missed| state.surfaces.iter().any(|(_, unit)| *unit > 0.0);
        let states: Vec<&Missed> = states.iter().filter(moving).collect();
        let mut spread = Self::to(&states, vehicles);
        // errors over deviations, of cases that the fit did not see
        let mut ratios = vec![vec![Vec::new(); OUTPUTS]; vehicles];
        for part in 0..MEMBERS {
            let (own, others): (Vec<_>, Vec<_>) = states.iter().partition(|state| state.part == part);
            let of_others = Self::to(&others, vehicles);
            for state in own.into_iter().filter(|state| state.is_case) {
                let measure = of_others.measure(state);
                for (c, ratios) in ratios[state.vehicle].iter_mut().enumerate() {
                    ratios.push(state.error[c].abs() / (of_others.factors[state.vehicle][c] * measure));
                }
            }
        }
        let all: Vec<Vec<f64>> =
            (0..OUTPUTS).map(|c| ratios.iter().flat_map(|of| of[c].iter().copied()).collect()).collect();
        for (factors, ratios) in spread.factors.iter_mut().zip(&ratios) {
            for (c, factor) in factors.iter_mut().enumerate() {
                *factor *= conformal(if ratios[c].len() < ENOUGH { &all[c] } else { &ratios[c] });
            }
        }
        spread
    }

    /// The row and the factors that suit some states best.
    fn to(states: &[&Missed], vehicles: usize) -> Self {
        let width = states.first().and_then(|state| state.surfaces.first()).map_or(0, |(h, _)| h.len());
        let factors = vec![[1.0; OUTPUTS]; vehicles];
        let mut spread = Self { weights: vec![0.0; width], bias: 0.0, factors };
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
    /// `|error|` over the measure. Of a vehicle without a state the largest of the others.
    fn calibrate(&mut self, states: &[&Missed]) {
        let mut sums = vec![([0.0; OUTPUTS], 0.0); self.factors.len()];
        for state in states {
            let measure = self.measure(state);
            let (sum, count) = &mut sums[state.vehicle];
            (0..OUTPUTS).for_each(|c| sum[c] += state.error[c].abs() / measure);
            *count += 1.0;
        }
        let of = |(sum, count): &([f64; OUTPUTS], f64)| {
            (*count > 0.0).then(|| sum.map(|sum| (std::f64::consts::SQRT_2 * sum / count).max(LEAST)))
        };
        let known: Vec<Option<[f64; OUTPUTS]>> = sums.iter().map(of).collect();
        let largest = known
            .iter()
            .flatten()
            .fold([LEAST; OUTPUTS], |most, factors| std::array::from_fn(|c| f64::max(most[c], factors[c])));
        self.factors = known.into_iter().map(|factors| factors.unwrap_or(largest)).collect();
    }

    /// Slope of the mean loss by the weights, then by the bias.
    fn gradient(&self, states: &[&Missed]) -> Vec<f64> {
        let mut gradient: Vec<f64> = self.weights.iter().map(|w| DECAY * w).chain([0.0]).collect();
        for state in states {
            let measure = self.measure(state);
            let by_measure: f64 = (0..OUTPUTS)
                .map(|c| {
                    let off = std::f64::consts::SQRT_2 * state.error[c].abs()
                        / (self.factors[state.vehicle][c] * measure);
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

/// What deviations must be multiplied by for the shares of [`WITHIN`] to hold, from errors over deviations; 1 without any.
fn conformal(ratios: &[f64]) -> f64 {
    let mut sorted = ratios.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return 1.0 };
    let factor = |(deviations, share): (f64, f64)| {
        let rank = (share * (sorted.len() + 1) as f64).ceil() as usize;
        sorted[(rank - 1).min(last)] / deviations
    };
    WITHIN.map(factor).into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Errors that are ten times larger where the first hidden unit is on, and twice as large on the second vehicle.
    fn states() -> Vec<Missed> {
        let mut random = Random::new(3);
        let mut state = |number: usize| {
            let (on, vehicle) = (number.is_multiple_of(2), number / 2 % 2);
            let size = if on { 10.0 } else { 1.0 } * if vehicle == 1 { 2.0 } else { 1.0 };
            let mut laplace = || {
                let u = random.unit() - 0.5;
                -size * u.signum() * (1.0 - 2.0 * u.abs()).ln() / std::f64::consts::SQRT_2
            };
            let error = [laplace(), 2.0 * laplace(), laplace()];
            let surfaces = vec![(vec![f32::from(u8::from(on)), 1.0], 5.0)];
            Missed { vehicle, part: number / 4 % MEMBERS, is_case: true, surfaces, error }
        };
        (0..2000).map(&mut state).collect()
    }

    #[test]
    fn learns_where_errors_are_large_and_how_large_they_are() {
        let states = states();
        let spread = Spread::fit(&states, 3);
        let deviation = |number: usize, c: usize| {
            let state = &states[number];
            spread.factors[state.vehicle][c] * spread.measure(state)
        };
        for (number, size) in [(0, 10.0), (1, 1.0), (2, 20.0), (3, 2.0)] {
            for (c, times) in [1.0, 2.0, 1.0].into_iter().enumerate() {
                let ratio = deviation(number, c) / (size * times);
                assert!((ratio - 1.0).abs() < 0.25, "{ratio} for {}", size * times);
            }
        }
        assert!((0..3).all(|c| spread.factors[2][c] >= 0.9 * spread.factors[1][c]), "{:?}", spread.factors);
    }

    #[test]
    fn stated_deviations_hold_in_the_cases_and_not_in_what_is_between_them() {
        let mut states = states();
        let between = states.clone().into_iter().map(|mut state| {
            state.error = state.error.map(|error| 0.1 * error);
            Missed { is_case: false, ..state }
        });
        states.extend(between.collect::<Vec<_>>());
        let spread = Spread::fit(&states, 2);
        for vehicle in 0..2 {
            let cases = || states.iter().filter(|s| s.is_case && s.vehicle == vehicle);
            for (deviations, share) in WITHIN {
                let inside = |s: &&Missed| {
                    s.error[0].abs() <= deviations * spread.factors[vehicle][0] * spread.measure(s)
                };
                let found = cases().filter(inside).count() as f64 / cases().count() as f64;
                assert!((share - 0.02..share + 0.12).contains(&found), "{vehicle} {deviations}: {found}");
            }
        }
    }

    #[test]
    fn the_factor_is_that_of_the_ranks() {
        let ratios: Vec<f64> = (1..=99).map(f64::from).collect();
        // the 69th and half the 96th of 99
        assert_eq!(conformal(&ratios), 69.0);
        let tailed: Vec<f64> = (1..=99).map(|i| if i > 90 { 1000.0 } else { f64::from(i) }).collect();
        assert_eq!(conformal(&tailed), 500.0);
        assert_eq!((conformal(&[]), conformal(&[3.0])), (1.0, 3.0));
    }
}
