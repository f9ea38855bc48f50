//! The regression: rows are the compared components of every bin, columns the coefficients of the candidates.
//!
//! Rows are standardised by the noise of their component and by what of the model's error at their state is no smooth function of
//! it. The zero of a trial may differ from run to run: each trial's mean is taken off in the share that such scatter has in it (the
//! transform of the random-effects model; Baltagi, Econometric Analysis of Panel Data, section 2.3). So is the smooth part of what
//! the model may be off by ([`super::model_error`]), and the rows are about independent.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::Config;
use super::candidates::{Column, Setting, columns_within};
use super::color::Color;
use super::model_error::ModelError;
use super::series::Series;
use super::smoothing::Smoothing;
use super::split::folds;
use wade_core::effects::{Effect, EffectRegion, Shape};

/// An effect of one shape, everywhere or in a region, with the columns of its coefficients.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub effect: Effect,
    pub shape: Shape,
    /// Where it acts.
    pub region: EffectRegion,
    /// Column and coefficient.
    pub columns: Vec<(usize, usize)>,
}

/// Noise of the rows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RowNoise {
    /// Standard deviation of a bin's noise, by component.
    pub bin: [f64; 6],
    /// Standard deviation of what the model may be off by in each bin and no smooth function of the state is, by trial and
    /// component; nothing of a model that states no deviation.
    pub rough: Vec<[Vec<f64>; 6]>,
    /// Standard deviation of the zero, by trial and component.
    pub offset: Vec<[f64; 6]>,
    /// True where the model states how far it may be off.
    pub model: bool,
    /// Smoothing of the rows.
    pub smoothing: Smoothing,
    /// Color of the noise, by component; none of one whose bins are independent.
    pub color: [Option<Color>; 6],
}

impl RowNoise {
    /// Least mean square that is expected of rows: 1 where the model may be as wrong as it says, else 0, since noise is estimated.
    pub fn stated(&self) -> f64 {
        f64::from(u8::from(self.model))
    }

    /// Standard deviation of a bin of a trial.
    pub fn of_bin(&self, trial: usize, component: usize, bin: usize) -> f64 {
        self.bin[component].hypot(self.rough(trial, component).get(bin).copied().unwrap_or_default())
    }

    /// Squares of a trial's zero over the standard deviations of its bins, summed.
    pub fn of_zero(&self, trial: usize, component: usize, bins: usize) -> f64 {
        let zero = self.offset[trial][component];
        (0..bins).map(|bin| (zero / self.of_bin(trial, component, bin)).powi(2)).sum()
    }

    fn rough(&self, trial: usize, component: usize) -> &[f64] {
        self.rough.get(trial).map_or(&[], |rough| &rough[component])
    }

    /// The bins of a trial over their standard deviation, made independent, with their mean taken off in the share that the trial's
    /// zero has in it.
    pub fn standardize(&self, values: &mut [f64], series: &Series, trial: usize, component: usize) {
        self.whiten(values, series, trial, component);
        let zero = self.offset[trial][component];
        if zero == 0.0 {
            return;
        }
        let mut zeros = vec![zero; values.len()];
        self.whiten(&mut zeros, series, trial, component);
        // the inverse root of I + z z^T
        let square: f64 = zeros.iter().map(|z| z * z).sum();
        let along: f64 = zeros.iter().zip(values.iter()).map(|(z, value)| z * value).sum::<f64>() / square;
        let share = 1.0 - (1.0 + square).sqrt().recip();
        values.iter_mut().zip(&zeros).for_each(|(value, z)| *value -= share * along * z);
    }

    fn whiten(&self, values: &mut [f64], series: &Series, trial: usize, component: usize) {
        let rough = self.rough(trial, component);
        match &self.color[component] {
            Some(color) => series.runs.iter().for_each(|run| {
                color.whiten(&mut values[run.clone()], rough.get(run.clone()).unwrap_or(&[]));
            }),
            None => {
                let of_bin = |(bin, value): (usize, &mut f64)| *value /= self.of_bin(trial, component, bin);
                values.iter_mut().enumerate().for_each(of_bin);
            }
        }
    }
}

/// Where a row stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub trial: usize,
    pub bin: usize,
    pub component: usize,
    pub block: usize,
}

/// Rows of a set of trials.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    pub rows: Vec<Row>,
    /// Number of blocks.
    pub blocks: usize,
    /// Trial of each block.
    pub block_trial: Vec<usize>,
    /// Bins of each block, within its trial.
    pub block_bins: Vec<Range<usize>>,
    /// Rows of each trial.
    pub of_trial: Vec<Range<usize>>,
    /// Rows of a bin: the components.
    pub width: usize,
}

impl Rows {
    /// What a list by trial must be as long as: the trials that are kept back have numbers as well.
    pub fn past_last_trial(&self) -> usize {
        self.block_trial.iter().max().map_or(0, |last| last + 1)
    }

    /// Rows of the trials listed, cut into blocks of about `block_s`.
    pub fn new(all: &[Series], trials: &[usize], components: &[usize], block_s: f64) -> Self {
        let mut this = Self {
            rows: Vec::new(),
            blocks: 0,
            block_trial: Vec::new(),
            block_bins: Vec::new(),
            of_trial: Vec::new(),
            width: components.len(),
        };
        for &trial in trials {
            let series = &all[trial];
            let first = this.rows.len();
            for run in &series.runs {
                let time = |bin: usize| series.t[series.bins[bin].start];
                let length = time(run.end - 1) - time(run.start);
                let count = (length / block_s).round().max(1.0) as usize;
                let per_block = run.len().div_ceil(count);
                let mut start = run.start;
                while start < run.end {
                    let end = (start + per_block).min(run.end);
                    for bin in start..end {
                        let row = |&component: &usize| Row { trial, bin, component, block: this.blocks };
                        this.rows.extend(components.iter().map(row));
                    }
                    this.block_trial.push(trial);
                    this.block_bins.push(start..end);
                    this.blocks += 1;
                    start = end;
                }
            }
            this.of_trial.push(first..this.rows.len());
        }
        this
    }
}

/// A value a sample to the rows: bin means, smoothed, standardised, partly centered trial by trial, less the share that the model's
/// error has in them.
pub(super) fn to_rows(
    all: &[Series],
    rows: &Rows,
    trials: &[usize],
    components: &[usize],
    (noise, error): (&RowNoise, &ModelError),
    of: impl Fn(usize) -> Column,
) -> Vec<f64> {
    let mut out = Vec::with_capacity(rows.rows.len());
    for &trial in trials {
        rows_of_trial(&all[trial], trial, components, noise, &of(trial), &mut out);
    }
    error.take_off(&mut out);
    out
}

/// Adds the rows of one trial to those of the trials before it.
fn rows_of_trial(
    series: &Series,
    trial: usize,
    components: &[usize],
    noise: &RowNoise,
    column: &Column,
    out: &mut Vec<f64>,
) {
    let by_component: Vec<Vec<f64>> = components
        .iter()
        .map(|&component| {
            let mut values = noise.smoothing.bins(series, component, |sample| column[sample][component]);
            noise.standardize(&mut values, series, trial, component);
            values
        })
        .collect();
    for bin in 0..series.bins.len() {
        out.extend(by_component.iter().map(|values| values[bin]));
    }
}

/// Sums of products over the rows of one fold.
#[derive(Debug, Clone)]
struct Fold {
    xx: DMatrix<f64>,
    xy: DVector<f64>,
    yy: f64,
}

/// The regression with the sums from which any subset of columns is solved.
#[derive(Debug, Clone)]
pub(super) struct Design {
    pub rows: Rows,
    pub trials: Vec<usize>,
    pub noise: RowNoise,
    /// What the model may be off by.
    pub error: ModelError,
    pub y: DVector<f64>,
    pub x: DMatrix<f64>,
    /// What a column was divided by, so that its mean square is 1.
    pub scale: Vec<f64>,
    pub candidates: Vec<Candidate>,
    pub block_fold: Vec<usize>,
    /// Bins beyond which the noise of a row has forgotten itself, by component.
    pub reach: [usize; 6],
    folds: Vec<Fold>,
    total: Fold,
}

/// A cross-validated fit.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    /// Scaled coefficients on all rows.
    pub beta: DVector<f64>,
    /// Sum of squares of the rows.
    pub loss: f64,
    /// The same, each fold by the fit to the others.
    pub cv_loss: f64,
    /// By fold.
    pub fold_losses: Vec<f64>,
    /// Coefficients without each fold.
    pub fold_betas: Vec<DVector<f64>>,
}

impl Design {
    /// Fills the columns of every candidate; columns without any excitation are left out.
    pub fn new(
        all: &[Series],
        trials: Vec<usize>,
        rows: Rows,
        setting: &Setting,
        library: &[Shape],
        noise: RowNoise,
        config: &Config,
    ) -> Self {
        let gap = |trial: usize| all[trial].gap.clone();
        let error = ModelError::new(all, &trials, &setting.components, &noise);
        let y = to_rows(all, &rows, &trials, &setting.components, (&noise, &error), gap);
        let y = DVector::from_vec(y);
        let block_fold = folds(all, &rows, config);
        let mut this = Self {
            x: DMatrix::zeros(rows.rows.len(), 0),
            reach: noise.smoothing.reach(config.bin_s),
            trials,
            noise,
            error,
            y,
            scale: Vec::new(),
            candidates: Vec::new(),
            block_fold,
            folds: Vec::new(),
            total: Fold { xx: DMatrix::zeros(0, 0), xy: DVector::zeros(0), yy: 0.0 },
            rows,
        };
        let laws: Vec<_> = library.iter().map(|&shape| (shape, EffectRegion::default())).collect();
        this.add(all, setting, &laws, config.folds);
        this
    }

    /// Adds the columns of more candidates, each a law and where it acts.
    pub fn add(&mut self, all: &[Series], setting: &Setting, laws: &[(Shape, EffectRegion)], folds: usize) {
        let mut values: Vec<f64> = std::mem::replace(&mut self.x, DMatrix::zeros(0, 0)).data.into();
        for (shape, region) in laws {
            let columns = self.candidate_columns(all, setting, (shape, region));
            let (effect, region) = (shape.effect(), region.clone());
            let mut candidate = Candidate { effect, shape: *shape, region, columns: Vec::new() };
            for (coefficient, column, scale) in columns {
                candidate.columns.push((self.scale.len(), coefficient));
                self.scale.push(scale);
                values.extend(column);
            }
            if !candidate.columns.is_empty() {
                self.candidates.push(candidate);
            }
        }
        self.x = DMatrix::from_vec(self.y.len(), self.scale.len(), values);
        self.sum(folds);
    }

    /// Takes out the candidates past a number, which were added last.
    pub fn keep(&mut self, candidates: usize) {
        let added = self.candidates.split_off(candidates);
        let first = added.iter().flat_map(|candidate| candidate.columns.first()).map(|(column, _)| *column);
        let columns = first.min().unwrap_or(self.scale.len());
        self.scale.truncate(columns);
        let x = std::mem::replace(&mut self.x, DMatrix::zeros(0, 0));
        self.x = x.columns(0, columns).into_owned();
        self.sum(self.folds.len());
    }

    /// Place of a trial among those of the design.
    pub fn place(&self, trial: usize) -> usize {
        self.trials.iter().position(|&t| t == trial).unwrap_or_default()
    }

    /// The rows of each coefficient of a shape. A trial's values by sample are gone before the next trial's are computed:
    /// they take several times as much room as its rows.
    fn rows_of_shape(
        &self,
        all: &[Series],
        setting: &Setting,
        law: (&Shape, &EffectRegion),
        noise: &RowNoise,
    ) -> Vec<Vec<f64>> {
        let count = law.0.effect().coefficients().len();
        let mut rows = vec![Vec::with_capacity(self.rows.rows.len()); count];
        for &trial in &self.trials {
            let columns = columns_within(law, &all[trial], trial, setting);
            for (rows, column) in rows.iter_mut().zip(&columns) {
                rows_of_trial(&all[trial], trial, &setting.components, noise, column, rows);
            }
        }
        rows.iter_mut().for_each(|rows| self.error.take_off(rows));
        rows
    }

    /// A value a sample as rows.
    pub fn to_rows(&self, all: &[Series], components: &[usize], of: impl Fn(usize) -> Column) -> Vec<f64> {
        to_rows(all, &self.rows, &self.trials, components, (&self.noise, &self.error), of)
    }

    fn candidate_columns(
        &self,
        all: &[Series],
        setting: &Setting,
        law: (&Shape, &EffectRegion),
    ) -> Vec<(usize, Vec<f64>, f64)> {
        let mut found = Vec::new();
        let rows = self.rows_of_shape(all, setting, law, &self.noise);
        for (coefficient, mut column) in rows.into_iter().enumerate() {
            let scale = (column.iter().map(|v| v * v).sum::<f64>() / column.len().max(1) as f64).sqrt();
            if scale > 1e-9 && scale.is_finite() {
                column.iter_mut().for_each(|value| *value /= scale);
                found.push((coefficient, column, scale));
            }
        }
        found
    }

    /// A value a sample as rows that were not smoothed.
    pub fn unsmoothed(
        &self,
        all: &[Series],
        setting: &Setting,
        of: &dyn Fn(usize) -> Column,
    ) -> DVector<f64> {
        let noise = self.unsmoothed_noise();
        let noise = (&noise, &self.error);
        DVector::from_vec(to_rows(all, &self.rows, &self.trials, &setting.components, noise, of))
    }

    fn unsmoothed_noise(&self) -> RowNoise {
        RowNoise { smoothing: Smoothing::default(), ..self.noise.clone() }
    }

    /// Columns that were not smoothed, in the units of those that were.
    pub fn unsmoothed_columns(
        &self,
        all: &[Series],
        setting: &Setting,
        wanted: &[usize],
    ) -> Vec<DVector<f64>> {
        let mut found = vec![DVector::zeros(self.y.len()); wanted.len()];
        for candidate in &self.candidates {
            let place = |(column, _): &(usize, usize)| wanted.iter().position(|w| w == column);
            let own: Vec<_> = candidate.columns.iter().filter_map(|own| Some((place(own)?, *own))).collect();
            if own.is_empty() {
                continue;
            }
            let law = (&candidate.shape, &candidate.region);
            let mut rows = self.rows_of_shape(all, setting, law, &self.unsmoothed_noise());
            for (place, (column, coefficient)) in own {
                let rows = DVector::from_vec(std::mem::take(&mut rows[coefficient]));
                found[place] = rows / self.scale[column];
            }
        }
        found
    }

    /// Gives a candidate another shape.
    pub fn reshape(&mut self, all: &[Series], setting: &Setting, candidate: usize, shape: Shape) {
        self.candidates[candidate].shape = shape;
        let found = self.candidate_columns(all, setting, (&shape, &self.candidates[candidate].region));
        let held = self.candidates[candidate].columns.clone();
        for (column, coefficient) in held {
            if let Some((_, values, scale)) = found.iter().find(|(c, ..)| *c == coefficient) {
                self.x.column_mut(column).copy_from_slice(values);
                self.scale[column] = *scale;
                self.resum(column);
            }
        }
    }

    /// Loss of some columns beside an effect of a shape, of which the coefficients listed are in use.
    pub fn loss_with(
        &self,
        all: &[Series],
        setting: &Setting,
        law: (&Shape, &EffectRegion),
        coefficients: &[usize],
        others: &[usize],
    ) -> f64 {
        let found = self.candidate_columns(all, setting, law);
        let own: Vec<DVector<f64>> = found
            .into_iter()
            .filter(|(coefficient, ..)| coefficients.contains(coefficient))
            .map(|(_, column, _)| DVector::from_vec(column))
            .collect();
        let Some((beta, loss)) = self.solve(others) else { return f64::INFINITY };
        loss - self.gain(&own, others, &self.residual(others, &beta))
    }

    /// Gain of columns that are no part of the design beside a base of which `residual` is what it leaves.
    fn gain(&self, columns: &[DVector<f64>], base: &[usize], residual: &DVector<f64>) -> f64 {
        let inverse = self.inverse(base).filter(|_| !base.is_empty());
        let clean: Vec<DVector<f64>> = columns
            .iter()
            .map(|column| {
                let mut column = column.clone();
                if let Some(inverse) = &inverse {
                    let cross = base.iter().map(|&c| self.x.column(c).dot(&column));
                    let weights = inverse * DVector::from_iterator(base.len(), cross);
                    base.iter()
                        .enumerate()
                        .for_each(|(i, &c)| column.axpy(-weights[i], &self.x.column(c), 1.0));
                }
                column
            })
            .collect();
        let count = clean.len();
        let ridge = 1e-9 * clean.iter().map(DVector::norm_squared).fold(0.0, f64::max);
        let xx =
            DMatrix::from_fn(count, count, |i, j| clean[i].dot(&clean[j]) + if i == j { ridge } else { 0.0 });
        let xy = DVector::from_iterator(count, clean.iter().map(|column| column.dot(residual)));
        xx.cholesky().map_or(0.0, |factor| xy.dot(&factor.solve(&xy)))
    }

    /// Change of the rows with the logarithm of a nonlinear parameter, for columns with their scaled coefficients.
    pub fn shape_derivative(
        &self,
        all: &[Series],
        setting: &Setting,
        candidate: usize,
        axis: usize,
        columns: &[(usize, usize, f64)],
    ) -> DVector<f64> {
        const STEP: f64 = 0.02;
        let Candidate { shape, region, .. } = &self.candidates[candidate];
        let moved = self.candidate_columns(all, setting, (&shape.scaled(axis, 1.0 + STEP), region));
        let mut change = DVector::zeros(self.y.len());
        for &(column, coefficient, beta) in columns {
            if let Some((_, values, scale)) = moved.iter().find(|(c, ..)| *c == coefficient) {
                let factor = beta * scale / self.scale[column] / STEP;
                change.axpy(factor, &DVector::from_column_slice(values), 1.0);
                change.axpy(-beta / STEP, &self.x.column(column), 1.0);
            }
        }
        change
    }

    fn fold_of(&self, row: usize) -> usize {
        self.block_fold[self.rows.rows[row].block]
    }

    fn sum(&mut self, folds: usize) {
        let count = self.scale.len();
        let mut by_fold: Vec<Vec<usize>> = vec![Vec::new(); folds];
        (0..self.y.len()).for_each(|row| by_fold[self.fold_of(row)].push(row));
        self.folds = by_fold
            .iter()
            .map(|rows| {
                let x = DMatrix::from_fn(rows.len(), count, |i, j| self.x[(rows[i], j)]);
                let y = DVector::from_fn(rows.len(), |i, _| self.y[rows[i]]);
                Fold { xx: x.tr_mul(&x), xy: x.tr_mul(&y), yy: y.norm_squared() }
            })
            .collect();
        self.total();
    }

    fn total(&mut self) {
        let count = self.scale.len();
        let zero = Fold { xx: DMatrix::zeros(count, count), xy: DVector::zeros(count), yy: 0.0 };
        self.total = self.folds.iter().fold(zero, |sum, fold| Fold {
            xx: sum.xx + &fold.xx,
            xy: sum.xy + &fold.xy,
            yy: sum.yy + fold.yy,
        });
    }

    fn resum(&mut self, column: usize) {
        for fold in 0..self.folds.len() {
            let rows: Vec<usize> = (0..self.y.len()).filter(|&row| self.fold_of(row) == fold).collect();
            for other in 0..self.scale.len() {
                let product: f64 = rows.iter().map(|&row| self.x[(row, column)] * self.x[(row, other)]).sum();
                self.folds[fold].xx[(column, other)] = product;
                self.folds[fold].xx[(other, column)] = product;
            }
            self.folds[fold].xy[column] = rows.iter().map(|&row| self.x[(row, column)] * self.y[row]).sum();
        }
        self.total();
    }

    /// Sum of squares of the gap.
    pub fn empty_loss(&self) -> f64 {
        self.total.yy
    }

    /// Least squares on all rows: scaled coefficients and the sum of squares left.
    pub fn solve(&self, columns: &[usize]) -> Option<(DVector<f64>, f64)> {
        solve(&self.total, None, columns)
    }

    /// Least squares with a cross-validated loss.
    pub fn fit(&self, columns: &[usize]) -> Option<Fitted> {
        let (beta, loss) = self.solve(columns)?;
        let mut fitted = Fitted { beta, loss, cv_loss: 0.0, fold_losses: Vec::new(), fold_betas: Vec::new() };
        for fold in &self.folds {
            let (beta, _) = solve(&self.total, Some(fold), columns)?;
            let loss = fold_loss(fold, columns, &beta);
            fitted.cv_loss += loss;
            fitted.fold_losses.push(loss);
            fitted.fold_betas.push(beta);
        }
        Some(fitted)
    }

    /// What is left of the gap, row by row.
    pub fn residual(&self, columns: &[usize], beta: &DVector<f64>) -> DVector<f64> {
        let mut residual = self.y.clone();
        for (index, &column) in columns.iter().enumerate() {
            residual.axpy(-beta[index], &self.x.column(column), 1.0);
        }
        residual
    }

    /// Inverse of the normal matrix of some columns.
    pub fn inverse(&self, columns: &[usize]) -> Option<DMatrix<f64>> {
        let xx = |i: usize, j: usize| self.total.xx[(columns[i], columns[j])];
        ridged(columns.len(), xx).cholesky().map(|factor| factor.inverse())
    }

    /// Squared sine of the angle between a column and the space of others: 0 where it says nothing new.
    pub fn novelty(&self, column: usize, others: &[usize]) -> f64 {
        let xx = &self.total.xx;
        let length = xx[(column, column)];
        if others.is_empty() || length == 0.0 {
            return f64::from(u8::from(length > 0.0));
        }
        let count = others.len();
        let ridge = |i: usize, j: usize| if i == j { 1.0 + 1e-9 } else { 1.0 };
        let inner = DMatrix::from_fn(count, count, |i, j| xx[(others[i], others[j])] * ridge(i, j));
        let cross = DVector::from_fn(count, |i, _| xx[(others[i], column)]);
        let Some(factor) = inner.cholesky() else { return 0.0 };
        (1.0 - cross.dot(&factor.solve(&cross)) / length).max(0.0)
    }
}

fn solve(total: &Fold, without: Option<&Fold>, columns: &[usize]) -> Option<(DVector<f64>, f64)> {
    let count = columns.len();
    let xx = |i: usize, j: usize| {
        let (a, b) = (columns[i], columns[j]);
        total.xx[(a, b)] - without.map_or(0.0, |fold| fold.xx[(a, b)])
    };
    let xy = |i: usize| total.xy[columns[i]] - without.map_or(0.0, |fold| fold.xy[columns[i]]);
    let yy = total.yy - without.map_or(0.0, |fold| fold.yy);
    if count == 0 {
        return Some((DVector::zeros(0), yy));
    }
    let right = DVector::from_fn(count, |i, _| xy(i));
    let beta = ridged(count, xx).cholesky()?.solve(&right);
    let loss = yy - 2.0 * beta.dot(&right)
        + (0..count).map(|i| (0..count).map(|j| beta[i] * beta[j] * xx(i, j)).sum::<f64>()).sum::<f64>();
    Some((beta, loss))
}

/// A normal matrix with a ridge: a column that a fold alone excites has no length without it, and of two that are the same
/// rounding must not decide whether there is a solution.
fn ridged(count: usize, xx: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
    let ridge = 1e-7 * (0..count).map(|i| xx(i, i)).fold(0.0, f64::max);
    DMatrix::from_fn(count, count, |i, j| xx(i, j) + if i == j { ridge } else { 0.0 })
}

fn fold_loss(fold: &Fold, columns: &[usize], beta: &DVector<f64>) -> f64 {
    let mut sum = fold.yy;
    for (i, &a) in columns.iter().enumerate() {
        sum -= 2.0 * beta[i] * fold.xy[a];
        for (j, &b) in columns.iter().enumerate() {
            sum += beta[i] * beta[j] * fold.xx[(a, b)];
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn columns_that_are_the_same_have_an_inverse_whatever_rounding_does() {
        for size in [1.0, 0.3, 1e4 / 3.0] {
            assert!(ridged(2, |_, _| size).cholesky().is_some());
            assert!(ridged(3, |i, j| size * (1.0 + i as f64) * (1.0 + j as f64)).cholesky().is_some());
        }
    }
}
