//! What the model may be off by: one smooth function of the state, the same in every trial.
//!
//! A model that states a standard deviation says how far its answer for a state may be off; the error is the same whenever the
//! state is the same, and alike where states are alike. So it is a Gaussian process over the state (Kennedy, O'Hagan, J. Roy. Stat.
//! Soc. B 63, 2001) with the stated deviation `d`: `cov(e(s), e(s')) = (1 - r) d(s) d(s') exp(-|s - s'|^2 / 2)`, each number of a
//! state measured in lengths, and a part `r` of the variance is rough. The smooth part is taken off the rows in the share that it has in
//! them, by as many states as it takes to know it to a third of the noise.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::design::RowNoise;
use super::series::Series;
use super::statistics::{Z90, quantile};

/// Numbers of a state: velocity, depth, roll and pitch, angular velocity.
const NUMBERS: usize = 9;
/// A state in lengths.
type State = [f64; NUMBERS];

/// A length over the range that the trials cover: errors at the two ends of it are nearly independent, of a correlation of `e^-2`.
/// Fitted to how the base misses our CFD, lengths are 0.05 to 0.3 of the range of a velocity, and 0.6 to 1.1 of the depth.
const OF_RANGE: f64 = 0.5;
/// Share of the squared error that is no smooth function of the state and counts as noise of a bin: of how the base misses our CFD
/// along x a third in the mean of both vehicles.
pub(super) const ROUGH: f64 = 1.0 / 3.0;
/// Least lengths [m/s, m, rad, rad/s]: what varies by less is noise of the motion.
const LEAST: State = [0.15, 0.15, 0.15, 0.025, 0.05, 0.05, 0.15, 0.15, 0.15];
/// Most states by which the error is known. The drives and ramps of a folder need 20 to 200.
const MOST_STATES: usize = 300;
/// Squared noises of a bin that may be left out.
const LEFT_OUT: f64 = 0.1;

/// The error of a model in the rows of some trials.
#[derive(Debug, Clone, Default)]
pub(super) struct ModelError {
    /// Of each component in the order of a bin's rows; nothing where the model states none.
    parts: Vec<Part>,
}

/// The covariance of the rows of a component is `I + Z Z^T`, and its inverse root is `I - Z share Z^T`.
#[derive(Debug, Clone)]
struct Part {
    z: DMatrix<f64>,
    share: DMatrix<f64>,
    /// `Z` times this are the rows of the error of which its share was taken off.
    left: DMatrix<f64>,
    /// Eigenvalues of `Z^T Z`, none below 0.
    squares: DVector<f64>,
    /// Half the squared coefficient of variation of the mean square of the error over all rows.
    spread: f64,
}

impl ModelError {
    /// Of the rows of some trials.
    pub fn new(all: &[Series], trials: &[usize], components: &[usize], noise: &RowNoise) -> Self {
        if !noise.model {
            return Self::default();
        }
        let states: Vec<Vec<State>> = trials.iter().map(|&trial| states(&all[trial])).collect();
        let lengths = lengths(states.concat());
        let in_lengths = |state: State| std::array::from_fn(|i| state[i] / lengths[i]);
        let states: Vec<Vec<State>> =
            states.into_iter().map(|of| of.into_iter().map(in_lengths).collect()).collect();
        let process = Process::new(&states.concat(), &most_off(all, trials, components, noise));
        let part = |&component: &usize| {
            let mut z = process.weights.clone();
            let mut stated = z.clone();
            let mut first = 0;
            for &trial in trials {
                let series = &all[trial];
                let weights = process.weights.rows(first, series.bins.len());
                let smooth = (1.0 - ROUGH).sqrt();
                let size = series.binned(|i| smooth * series.uncertainty[i][component]);
                let mut of_trial = DMatrix::from_diagonal(&DVector::from_vec(size)) * weights;
                stated.rows_mut(first, weights.nrows()).copy_from(&of_trial);
                for mut column in of_trial.column_iter_mut() {
                    noise.standardize(column.as_mut_slice(), series, trial, component);
                }
                z.rows_mut(first, weights.nrows()).copy_from(&of_trial);
                first += weights.nrows();
            }
            Part::new(z, &stated)
        };
        Self { parts: components.iter().map(part).collect() }
    }

    /// Takes the error's share off rows, which are those of all the trials.
    pub fn take_off(&self, rows: &mut [f64]) {
        let width = self.parts.len();
        for (place, Part { z, share, .. }) in self.parts.iter().enumerate() {
            let own = self.own_rows(rows, place);
            let off = z * (share * z.tr_mul(&own));
            rows.iter_mut().skip(place).step_by(width).zip(&off).for_each(|(row, off)| *row -= off);
        }
    }

    /// Products of a column of rows, of which the error's share was taken off, with each of the unit Gaussian weights that the error
    /// is a sum over.
    pub fn products(&self, rows: &[f64]) -> Vec<f64> {
        let of = |(place, Part { z, left, .. }): (usize, &Part)| -> Vec<f64> {
            (left * z.tr_mul(&self.own_rows(rows, place))).data.into()
        };
        self.parts.iter().enumerate().flat_map(of).collect()
    }

    /// Of rows of all components in turn, those of one.
    fn own_rows(&self, rows: &[f64], place: usize) -> DVector<f64> {
        let own = rows.iter().skip(place).step_by(self.parts.len()).copied();
        DVector::from_vec(own.collect())
    }

    /// Sum of squares that a smooth error of the stated size leaves in the rows in 19 of 20 draws at most: a chi-square of its degrees
    /// of freedom.
    pub fn most_left(&self) -> f64 {
        let freedom: f64 = self.parts.iter().flat_map(|part| &part.squares).map(|l| l / (1.0 + l)).sum();
        freedom + Z90 * (2.0 * freedom).sqrt()
    }

    /// How many times what is stated the error of a component is in 19 of 20 draws at most, root mean square over all rows: a smooth
    /// function has few degrees of freedom (Satterthwaite, Biometrics Bulletin 2, 1946), which it has a chi-square of (Wilson,
    /// Hilferty, PNAS 17, 1931).
    pub fn at_most(&self, place: usize) -> f64 {
        let Some(Part { spread, .. }) = self.parts.get(place) else { return 1.0 };
        let spread = 2.0 / 9.0 * spread;
        (1.0 - spread + Z90 * spread.sqrt()).powf(1.5)
    }
}

impl Part {
    /// With the error over the noise of each row, and as it is.
    fn new(z: DMatrix<f64>, stated: &DMatrix<f64>) -> Self {
        let SymmetricEigen { eigenvectors, eigenvalues } = z.tr_mul(&z).symmetric_eigen();
        let covariance = stated.tr_mul(stated);
        let spread = covariance.norm_squared() / covariance.trace().powi(2).max(f64::MIN_POSITIVE);
        // (1 - 1 / sqrt(1 + l)) / l, which is 1/2 where l vanishes
        let squares = eigenvalues.map(|l| l.max(0.0));
        let shares = squares.map(|l| {
            let root = (1.0 + l).sqrt();
            1.0 / (root * (1.0 + root))
        });
        let of = |diagonal: DVector<f64>| {
            &eigenvectors * DMatrix::from_diagonal(&diagonal) * eigenvectors.transpose()
        };
        let (share, left) = (of(shares), of(squares.map(|l| (1.0 + l).sqrt().recip())));
        Self { z, share, left, squares, spread }
    }
}

/// The state of each bin, in SI units.
fn states(series: &Series) -> Vec<State> {
    let number = |number: usize| {
        series.binned(|i| {
            let condition = &series.conditions[i];
            match number {
                0..3 => condition.velocity[number],
                3 => condition.depth,
                4 | 5 => series.roll_pitch[i][number - 4],
                _ => condition.angular_velocity[number - 6],
            }
        })
    };
    let numbers: [Vec<f64>; NUMBERS] = std::array::from_fn(number);
    (0..series.bins.len()).map(|bin| std::array::from_fn(|i| numbers[i][bin])).collect()
}

fn lengths(states: Vec<State>) -> State {
    std::array::from_fn(|number| {
        // single samples of noise do not widen what was covered
        let mut values: Vec<f64> = states.iter().map(|state| state[number]).collect();
        let [low, high] = [0.01, 0.99].map(|share| quantile(&mut values, share));
        (OF_RANGE * (high - low)).max(LEAST[number])
    })
}

/// By how many noises each bin of some trials may be off, squared, in the component in which it is most.
fn most_off(all: &[Series], trials: &[usize], components: &[usize], noise: &RowNoise) -> Vec<f64> {
    let of_trial = |&trial: &usize| {
        let mut most = vec![0.0; all[trial].bins.len()];
        for &component in components {
            let stated = all[trial].binned(|sample| all[trial].uncertainty[sample][component]);
            for (bin, (most, stated)) in most.iter_mut().zip(stated).enumerate() {
                *most = f64::max(*most, (stated / noise.of_bin(trial, component, bin)).powi(2));
            }
        }
        most
    };
    trials.iter().flat_map(of_trial).collect()
}

/// A Gaussian process of unit variance as a sum over independent unit Gaussian weights.
struct Process {
    /// What each weight adds at each state.
    weights: DMatrix<f64>,
}

impl Process {
    /// One state after the other is known, that at which the most is left of what may be off, until that is little everywhere: the
    /// incomplete Cholesky factor with the largest pivots (Fine, Scheinberg, J. Mach. Learn. Res. 2, 2001).
    fn new(states: &[State], off: &[f64]) -> Self {
        let mut left = vec![1.0; states.len()];
        let mut columns: Vec<DVector<f64>> = Vec::new();
        while columns.len() < MOST_STATES {
            let size = |&state: &usize| left[state] * off[state];
            let Some(pivot) = (0..states.len()).max_by(|a, b| size(a).total_cmp(&size(b))) else { break };
            if size(&pivot) < LEFT_OUT && !columns.is_empty() {
                break;
            }
            let of_pivot = states.iter().map(|state| covariance(state, &states[pivot]));
            let mut column = DVector::from_iterator(states.len(), of_pivot);
            for before in &columns {
                column.axpy(-before[pivot], before, 1.0);
            }
            column /= left[pivot].sqrt();
            left.iter_mut().zip(&column).for_each(|(left, c)| *left = (*left - c * c).max(0.0));
            columns.push(column);
        }
        Self {
            weights: DMatrix::from_fn(states.len(), columns.len(), |state, weight| columns[weight][state]),
        }
    }
}

fn covariance(a: &State, b: &State) -> f64 {
    (-0.5 * squared_distance(a, b)).exp()
}

fn squared_distance(a: &State, b: &State) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// States along a line, a tenth of a length apart.
    fn line(count: usize) -> Vec<State> {
        (0..count).map(|i| std::array::from_fn(|n| if n == 0 { 0.1 * i as f64 } else { 0.0 })).collect()
    }

    #[test]
    fn a_few_states_stand_for_all_and_rows_lose_the_inverse_root_of_the_covariance() {
        let states = line(60);
        let process = Process::new(&states, &[1e9; 60]);
        assert!(process.weights.ncols() < 30, "{}", process.weights.ncols());
        let z = process.weights * 1.7;
        let covariance = DMatrix::from_fn(60, 60, |i, j| 1.7 * 1.7 * covariance(&states[i], &states[j]));
        assert!((&z * z.transpose() - &covariance).amax() < 1e-6);
        let SymmetricEigen { eigenvectors, eigenvalues } =
            (covariance + DMatrix::identity(60, 60)).symmetric_eigen();
        let root = &eigenvectors
            * DMatrix::from_diagonal(&eigenvalues.map(|l| l.sqrt().recip()))
            * eigenvectors.transpose();
        // of two components in turn, each has its own rows
        let values: Vec<f64> = (0..120).map(|i| f64::from(i * i % 7) - 2.0).collect();
        let mut rows = values.clone();
        let error = ModelError { parts: vec![Part::new(z.clone(), &z), Part::new(z.clone(), &z)] };
        error.take_off(&mut rows);
        for place in 0..2 {
            let of = |rows: &[f64]| DVector::from_fn(60, |i, _| rows[2 * i + place]);
            assert!((&root * of(&values) - of(&rows)).amax() < 1e-6);
        }
        // a column of rows sees the error as far as the rows hold what is left of it
        let left = &root * z;
        let products = [0, 1].map(|place| left.tr_mul(&DVector::from_fn(60, |i, _| rows[2 * i + place])));
        let expected =
            DVector::from_iterator(2 * left.ncols(), products.iter().flat_map(|p| p.iter().copied()));
        assert!((DVector::from_vec(error.products(&rows)) - expected).amax() < 1e-6);
    }

    #[test]
    fn an_error_that_is_alike_everywhere_may_be_far_larger_than_stated() {
        let of = |z: DMatrix<f64>| ModelError { parts: vec![Part::new(z.clone(), &z)] };
        // |N(0, 1)| is below 1.96 in 19 of 20 draws
        let alike = of(DMatrix::from_element(50, 1, 0.3));
        assert!((alike.at_most(0) - 1.96).abs() < 0.03, "{}", alike.at_most(0));
        // root of the chi-square of 50 degrees at 0.95, over 50
        let independent = of(DMatrix::identity(50, 50));
        assert!((independent.at_most(0) - (67.505_f64 / 50.0).sqrt()).abs() < 0.002);
        assert_eq!(ModelError::default().at_most(0), 1.0);
    }
}
