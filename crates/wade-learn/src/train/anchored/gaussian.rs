//! Gaussian-process regression: what noisy values at scattered places say of the places between them (Rasmussen, Williams,
//! "Gaussian Processes for Machine Learning", MIT Press 2006; equations 2.25, 4.17, 5.8, 5.12).
//!
//! `y = f + e`, with the covariance of f at a and b `s^2 [BASE (1 + sum_j a_j b_j) + (1 + r + r^2 / 3) exp(-r)]`,
//! `r^2 = 5 sum_i ((a_i - b_i) / l_i)^2` (Matern, 5/2: twice differentiable, which a flow around corners is at most; around a mean
//! that is linear in the last [`LINEAR`] coordinates j, section 2.7), and independent e of variance
//! `s^2 [noise^2 + (scatter v)^2]`, where v is what is known of the value's own scatter, and `s^2 [noise^2 + unknown^2]` of a value
//! of which nothing is.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::random::Random;

/// Variance of the mean of f over all places, and of its slopes, in units of that around it.
const BASE: f64 = 10.0;
/// Coordinates, the last ones, in which the mean of f is linear.
pub const LINEAR: usize = 3;
/// More values than these are not asked for lengths and noise: the likelihood costs their number cubed.
const MOST: usize = 200;
/// Where the search for lengths begins; places are in units of their standard deviation.
const STARTS: [f64; 2] = [2.0, 0.8];
/// Share of its logarithm by which a parameter is moved at first and at last.
const STEPS: [f64; 2] = [0.8, 0.05];
/// Bounds of a length, of the noise, of the factor of the stated scatter, of the noise where none is stated.
const BOUNDS: [[f64; 2]; 4] = [[0.2, 20.0], [1e-3, 1.0], [1e-2, 10.0], [1e-3, 10.0]];

/// What the covariance depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lengths<const N: usize> {
    /// Distance along each coordinate over which f changes.
    length: [f64; N],
    /// Noise that every value has.
    noise: f64,
    /// Factor of the stated scatter.
    scatter: f64,
    /// Noise of values of which no scatter is stated.
    unknown: f64,
}

impl<const N: usize> Lengths<N> {
    fn covariance(&self, a: &[f64; N], b: &[f64; N]) -> f64 {
        let square: f64 = (0..N).map(|i| ((a[i] - b[i]) / self.length[i]).powi(2)).sum();
        let r = (5.0 * square).sqrt();
        let linear: f64 = (N - LINEAR..N).map(|j| a[j] * b[j]).sum();
        BASE * (1.0 + linear) + (1.0 + r + r * r / 3.0) * (-r).exp()
    }

    /// Covariance of the values, noise included.
    fn matrix(&self, places: &[[f64; N]], scatter: &[Option<f64>]) -> Option<Cholesky<f64, Dyn>> {
        let own = |i: usize| scatter[i].map_or(self.unknown, |scatter| self.scatter * scatter);
        let noise = |i: usize| self.noise.powi(2) + own(i).powi(2);
        let matrix = DMatrix::from_fn(places.len(), places.len(), |i, j| {
            self.covariance(&places[i], &places[j]) + if i == j { noise(i) } else { 0.0 }
        });
        Cholesky::new(matrix)
    }

    /// Logarithm of the likelihood of the values with the best `s`, and of how likely such lengths are beforehand; but for
    /// constants.
    fn likelihood(&self, places: &[[f64; N]], values: &DVector<f64>, scatter: &[Option<f64>]) -> f64 {
        let Some(cholesky) = self.matrix(places, scatter) else { return f64::NEG_INFINITY };
        let half: f64 = cholesky.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
        let fit = values.dot(&cholesky.solve(values)) / values.len() as f64;
        let prior: f64 = self.length.iter().map(|l| (l / STARTS[0]).ln().powi(2)).sum();
        -0.5 * values.len() as f64 * fit.max(f64::MIN_POSITIVE).ln() - half - 0.25 * prior
    }

    /// The likeliest, by trying steps along each parameter from where others were found, or from [`STARTS`]; at most
    /// [`MOST`] values, drawn by chance, are asked.
    fn fit(places: &[[f64; N]], values: &[f64], scatter: &[Option<f64>], like: Option<&Self>) -> Self {
        let mut asked = Random::new(1).permutation(places.len());
        asked.truncate(MOST);
        let values = DVector::from_iterator(asked.len(), asked.iter().map(|&i| values[i]));
        let scatter: Vec<Option<f64>> = asked.iter().map(|&i| scatter[i]).collect();
        let places: Vec<[f64; N]> = asked.iter().map(|&i| places[i]).collect();
        let varies = |i: usize| places.iter().any(|place| (place[i] - places[0][i]).abs() > 1e-9);
        let mut free: Vec<usize> = (0..N).filter(|&i| varies(i)).chain([N]).collect();
        if scatter.iter().flatten().any(|&v| v > 0.0) {
            free.push(N + 1);
        }
        if scatter.iter().any(Option::is_none) {
            free.push(N + 2);
        }
        let search = |start: Self| start.search(&free, &|l| l.likelihood(&places, &values, &scatter));
        if let Some(like) = like {
            return search(*like).0;
        }
        let start = |length| Self { length: [length; N], noise: 0.1, scatter: 1.0, unknown: 0.1 };
        let [first, second] = STARTS.map(|length| search(start(length)));
        if second.1 > first.1 { second.0 } else { first.0 }
    }

    fn search(self, free: &[usize], likelihood: &dyn Fn(&Self) -> f64) -> (Self, f64) {
        let (mut best, mut step) = ((self, likelihood(&self)), STEPS[0]);
        while step > STEPS[1] {
            let before = best.1;
            for (&parameter, sign) in free.iter().flat_map(|p| [(p, 1.0), (p, -1.0)]) {
                let tried = best.0.moved(parameter, sign * step);
                let found = likelihood(&tried);
                if found > best.1 {
                    best = (tried, found);
                }
            }
            // less than a tenth of a nat is nothing that the values tell
            if best.1 - before < 0.1 {
                step *= 0.5;
            }
        }
        best
    }

    fn moved(mut self, parameter: usize, by: f64) -> Self {
        let (value, [least, most]) = match parameter {
            p if p < N => (&mut self.length[p], BOUNDS[0]),
            p if p == N => (&mut self.noise, BOUNDS[1]),
            p if p == N + 1 => (&mut self.scatter, BOUNDS[2]),
            _ => (&mut self.unknown, BOUNDS[3]),
        };
        *value = (*value * by.exp()).clamp(least, most);
        self
    }
}

/// A regression for several values a place that share lengths and noise, so that the answer for their sum is the sum of
/// the answers.
#[derive(Debug, Clone)]
pub struct Regression<const N: usize> {
    places: Vec<[f64; N]>,
    lengths: Lengths<N>,
    /// Standard deviation of the noise that every value has.
    pub noise: f64,
    /// `K^-1 y`, a column a value.
    weights: DMatrix<f64>,
}

impl<const N: usize> Regression<N> {
    /// Lengths and noise from `leading`, found from those of a regression to much the same values where there is one; the
    /// rest from `values`, a row a place; `scatter` is that of `leading`, where it is known. `None` where the covariance is not positive
    /// definite, which only numbers that are not finite can do.
    pub fn new(
        places: Vec<[f64; N]>,
        leading: &[f64],
        scatter: &[Option<f64>],
        values: &DMatrix<f64>,
        like: Option<&Self>,
    ) -> Option<Self> {
        let size = (leading.iter().map(|y| y * y).sum::<f64>() / leading.len().max(1) as f64).sqrt();
        let size = size.max(f64::MIN_POSITIVE);
        let scatter: Vec<Option<f64>> = scatter.iter().map(|v| v.map(|v| v / size)).collect();
        let in_units: Vec<f64> = leading.iter().map(|y| y / size).collect();
        let lengths = Lengths::fit(&places, &in_units, &scatter, like.map(|other| &other.lengths));
        let cholesky = lengths.matrix(&places, &scatter)?;
        // the likeliest s (equation 5.8, maximised over it)
        let leading = DVector::from_column_slice(leading);
        let s = (leading.dot(&cholesky.solve(&leading)) / leading.len() as f64).sqrt();
        let weights = cholesky.solve(values);
        Some(Self { places, noise: lengths.noise * s, lengths, weights })
    }

    /// The values at a place.
    pub fn at(&self, place: &[f64; N]) -> DVector<f64> {
        let near = self.places.iter().map(|known| self.lengths.covariance(known, place));
        self.weights.tr_mul(&DVector::from_iterator(self.places.len(), near))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Noisy values of a smooth function of the first of two coordinates, and twice as much of it.
    fn noisy(count: usize, noise: f64) -> (Vec<[f64; 5]>, Vec<f64>) {
        let mut random = Random::new(7);
        let mut normal = || (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
        let places: Vec<[f64; 5]> = (0..count).map(|_| [normal(), normal(), 0.0, 0.0, 0.0]).collect();
        let values = places.iter().map(|[x, ..]| 3.0 + x.sin() + noise * normal()).collect();
        (places, values)
    }

    fn regression(count: usize, noise: f64) -> Regression<5> {
        let (places, values) = noisy(count, noise);
        let columns = DMatrix::from_fn(count, 2, |i, j| values[i] * (j + 1) as f64);
        Regression::new(places, &values, &vec![Some(0.0); count], &columns, None).unwrap()
    }

    #[test]
    fn finds_the_function_under_the_noise_and_which_coordinate_matters() {
        let regression = regression(120, 0.05);
        for x in [-1.5, -0.7, 0.1, 0.9, 1.6] {
            let found = regression.at(&[x, 0.3, 0.0, 0.0, 0.0]);
            assert!((found[0] - 3.0 - x.sin()).abs() < 0.06, "{x}: {found}");
            assert!((found[1] - 2.0 * found[0]).abs() < 1e-9);
        }
        let [first, second, ..] = regression.lengths.length;
        assert!(second > 3.0 * first, "{first} {second}");
        assert!((regression.noise / 0.05 - 1.0).abs() < 0.3, "{}", regression.noise);
    }

    #[test]
    fn a_value_of_stated_scatter_counts_for_less() {
        let (places, mut values) = noisy(60, 0.0);
        let mut scatter = [Some(0.0); 60];
        (values[20], scatter[20]) = (9.0, Some(6.0));
        let at = |scatter: &[Option<f64>]| {
            let columns = DMatrix::from_column_slice(60, 1, &values);
            Regression::new(places.clone(), &values, scatter, &columns, None).unwrap().at(&places[20])[0]
        };
        let truth = 3.0 + places[20][0].sin();
        assert!((at(&scatter) - truth).abs() < 0.1, "{} {truth}", at(&scatter));
        assert!((at(&[Some(0.0); 60]) - truth).abs() > 0.3, "{}", at(&[Some(0.0); 60]));
    }

    #[test]
    fn the_noise_of_values_without_a_stated_scatter_is_found() {
        let (places, exact) = noisy(160, 0.01);
        let (_, rough) = noisy(160, 0.5);
        let values: Vec<f64> = (0..160).map(|i| if i % 2 == 0 { exact[i] } else { rough[i] }).collect();
        let scatter: Vec<Option<f64>> = (0..160).map(|i| (i % 2 == 0).then_some(0.0)).collect();
        let columns = DMatrix::from_column_slice(160, 1, &values);
        let regression = Regression::new(places, &values, &scatter, &columns, None).unwrap();
        let Lengths { noise, unknown, .. } = regression.lengths;
        assert!(unknown > 5.0 * noise, "{unknown} {noise}");
    }

    #[test]
    fn the_mean_goes_on_beyond_the_places_along_the_last_coordinates() {
        let mut random = Random::new(3);
        let places: Vec<[f64; 5]> = (0..60).map(|_| [0.0, 0.0, random.unit(), 0.0, 0.0]).collect();
        let values: Vec<f64> = places.iter().map(|place| 1.0 + 2.0 * place[2]).collect();
        let columns = DMatrix::from_column_slice(60, 1, &values);
        let regression = Regression::new(places, &values, &[Some(0.0); 60], &columns, None).unwrap();
        let beyond = regression.at(&[0.0, 0.0, 3.0, 0.0, 0.0])[0];
        assert!((beyond - 7.0).abs() < 0.1, "{beyond}");
    }
}
