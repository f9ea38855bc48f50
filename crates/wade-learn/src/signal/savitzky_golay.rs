//! Smoothing and differentiating by local polynomials.

use nalgebra::{DMatrix, DVector};

/// Highest order of polynomial: above it the normal equations lose the digits that are asked for.
pub const MAX_ORDER: usize = 10;

/// Why there is no such filter, or why it has no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum FilterError {
    /// The window has no middle.
    #[error("a Savitzky-Golay window has an odd number of samples, 3 or more, not {window}")]
    Window {
        /// Samples in the window.
        window: usize,
    },
    /// More coefficients than samples, or too many to be found.
    #[error(
        "a polynomial of order {order} needs a window of more samples than {window}, and at most order {MAX_ORDER}"
    )]
    Order {
        /// Order of the polynomial.
        order: usize,
        /// Samples in the window.
        window: usize,
    },
    /// Fewer samples than the window.
    #[error("{samples} samples are fewer than the window of {window}")]
    TooShort {
        /// Samples given.
        samples: usize,
        /// Samples in the window.
        window: usize,
    },
}

/// A least-squares polynomial through each window of evenly spaced samples (Savitzky and Golay, Analytical Chemistry
/// 1964). At the ends the polynomial of the first or last full window answers.
#[derive(Debug, Clone, PartialEq)]
pub struct SavitzkyGolay {
    half: usize,
    /// Samples of a window to the coefficients of the polynomial in `u = offset / half`, `[order + 1, window]`.
    coefficients: DMatrix<f64>,
}

impl SavitzkyGolay {
    /// Solves the normal equations `(A'A) c = A' y` with `A[i, j] = u_i^j`; `u` in -1 to 1 keeps them well conditioned.
    pub fn new(window: usize, order: usize) -> Result<Self, FilterError> {
        if window < 3 || window.is_multiple_of(2) {
            return Err(FilterError::Window { window });
        }
        let half = window / 2;
        let powers = DMatrix::from_fn(window, order.min(MAX_ORDER) + 1, |sample, power| {
            ((sample as f64 - half as f64) / half as f64).powi(power as i32)
        });
        let normal = powers.tr_mul(&powers).cholesky().filter(|_| order < window && order <= MAX_ORDER);
        let normal = normal.ok_or(FilterError::Order { order, window })?;
        Ok(Self { half, coefficients: normal.solve(&powers.transpose()) })
    }

    /// Samples in a window.
    pub fn window(&self) -> usize {
        2 * self.half + 1
    }

    /// The smoothed samples.
    pub fn smooth(&self, samples: &[f64]) -> Result<Vec<f64>, FilterError> {
        self.derivative(samples, 0, 1.0)
    }

    /// The derivative of order `derivative` of samples `step` apart; exact for polynomials up to the filter's order.
    pub fn derivative(&self, samples: &[f64], derivative: usize, step: f64) -> Result<Vec<f64>, FilterError> {
        let (window, half) = (self.window(), self.half);
        let Some(last) = samples.len().checked_sub(window) else {
            return Err(FilterError::TooShort { samples: samples.len(), window });
        };
        let weights: Vec<_> = (0..window).map(|offset| self.weights(derivative, offset, step)).collect();
        let value = |at: usize| {
            let start = at.saturating_sub(half).min(last);
            let weights = &weights[at - start];
            samples[start..start + window].iter().zip(weights.iter()).map(|(y, w)| y * w).sum()
        };
        Ok((0..samples.len()).map(value).collect())
    }

    /// Weights of a window's samples in the derivative at its sample number `offset`.
    fn weights(&self, derivative: usize, offset: usize, step: f64) -> DVector<f64> {
        let u = (offset as f64 - self.half as f64) / self.half as f64;
        // the derivative of u^power
        let basis = DVector::from_fn(self.coefficients.nrows(), |power, _| {
            let factors = (0..derivative).map(|k| power as f64 - k as f64).product::<f64>();
            if power < derivative { 0.0 } else { factors * u.powi((power - derivative) as i32) }
        });
        self.coefficients.tr_mul(&basis) / (step * self.half as f64).powi(derivative as i32)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn polynomials_of_its_order_are_smoothed_and_differentiated_exactly() {
        let step = 1.0 / 111.0;
        for (window, order) in [(3, 1), (9, 2), (9, 8), (21, 5), (51, 10)] {
            let filter = SavitzkyGolay::new(window, order).unwrap();
            let n = order as i32;
            let times: Vec<f64> = (0..window + 7).map(|i| 0.3 + i as f64 * step).collect();
            let samples: Vec<f64> = times.iter().map(|t| 2.0 - t + t.powi(n)).collect();
            let first = filter.derivative(&samples, 1, step).unwrap();
            let smooth = filter.smooth(&samples).unwrap();
            for (at, &t) in times.iter().enumerate() {
                let expected = -1.0 + f64::from(n) * t.powi(n - 1);
                assert!((smooth[at] - samples[at]).abs() < 1e-9, "{window}/{order}");
                assert!((first[at] - expected).abs() < 1e-6, "{window}/{order}: {} {expected}", first[at]);
            }
        }
    }

    #[test]
    fn second_derivatives_and_those_above_the_order() {
        let filter = SavitzkyGolay::new(9, 2).unwrap();
        let samples: Vec<f64> = (0..12).map(|i| 1.5 * f64::from(i * i)).collect();
        let second = filter.derivative(&samples, 2, 0.5).unwrap();
        assert!(second.iter().all(|value| (value - 12.0).abs() < 1e-9));
        assert!(filter.derivative(&samples, 3, 0.5).unwrap().iter().all(|value| *value == 0.0));
    }

    #[test]
    fn the_weights_are_the_published_ones() {
        // the tables of Savitzky and Golay 1964 for 9 points and a quadratic: divisors 231 and, for the slope, 60
        let filter = SavitzkyGolay::new(9, 2).unwrap();
        let smooth = [-21.0, 14.0, 39.0, 54.0, 59.0, 54.0, 39.0, 14.0, -21.0].map(|w| w / 231.0);
        let slope = [-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0].map(|w| w / 60.0);
        for (derivative, published) in [(0, smooth), (1, slope)] {
            let found = filter.weights(derivative, 4, 1.0);
            assert!(found.iter().zip(published).all(|(found, w)| (found - w).abs() < 1e-12), "{found}");
        }
    }

    #[test]
    fn filters_that_cannot_be_are_refused() {
        for window in [0, 1, 4] {
            assert_eq!(SavitzkyGolay::new(window, 1), Err(FilterError::Window { window }));
        }
        for (window, order) in [(5, 5), (101, 11)] {
            assert_eq!(SavitzkyGolay::new(window, order), Err(FilterError::Order { order, window }));
        }
        let filter = SavitzkyGolay::new(9, 2).unwrap();
        assert_eq!(filter.smooth(&[0.0; 8]), Err(FilterError::TooShort { samples: 8, window: 9 }));
        assert_eq!(filter.smooth(&[1.0; 9]).unwrap().len(), 9);
    }
}
