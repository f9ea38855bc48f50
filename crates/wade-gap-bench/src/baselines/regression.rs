//! Selection of columns from normal equations.

use nalgebra::{DMatrix, DVector};

/// Columns that are selected, each with its coefficient and standard error.
pub(super) type Selection = Vec<(usize, f64, f64)>;

/// Share of a column's square that is added to it, so that equal columns can be solved for.
const RIDGE: f64 = 1e-8;
/// Thresholds and penalties that are tried.
const TRIED: usize = 24;
/// Sweeps of coordinate descent.
const SWEEPS: usize = 400;
/// Share of the gap that the best effect must explain to be named.
const LEAST_R2: f64 = 0.1;

/// `X'X`, `X'y`, `y'y` and the number of rows.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    xx: DMatrix<f64>,
    xy: DVector<f64>,
    pub yy: f64,
    pub count: f64,
}

impl Normal {
    pub fn new(columns: usize) -> Self {
        Self { xx: DMatrix::zeros(columns, columns), xy: DVector::zeros(columns), yy: 0.0, count: 0.0 }
    }

    pub fn add(&mut self, row: &[f64], y: f64) {
        // most terms act on one component: skip the zeros
        let used: Vec<usize> = (0..row.len()).filter(|&i| row[i] != 0.0).collect();
        for &i in &used {
            self.xy[i] += row[i] * y;
            for &j in &used {
                self.xx[(i, j)] += row[i] * row[j];
            }
        }
        self.yy += y * y;
        self.count += 1.0;
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            xx: &self.xx + &other.xx,
            xy: &self.xy + &other.xy,
            yy: self.yy + other.yy,
            count: self.count + other.count,
        }
    }

    /// Sum of squares that some coefficients leave.
    pub fn residual(&self, selection: &[(usize, f64, f64)]) -> f64 {
        let mut rest = self.yy;
        for &(i, a, _) in selection {
            rest -= 2.0 * a * self.xy[i];
            rest += selection.iter().map(|&(j, b, _)| a * b * self.xx[(i, j)]).sum::<f64>();
        }
        rest.max(0.0)
    }

    /// Least squares on some columns.
    pub fn fit(&self, columns: &[usize]) -> Selection {
        let columns: Vec<usize> = columns.iter().copied().filter(|&i| self.xx[(i, i)] > 0.0).collect();
        let n = columns.len();
        let scale: Vec<f64> = columns.iter().map(|&i| self.xx[(i, i)].sqrt()).collect();
        let gram = DMatrix::from_fn(n, n, |i, j| {
            let ridge = if i == j { RIDGE } else { 0.0 };
            self.xx[(columns[i], columns[j])] / (scale[i] * scale[j]) + ridge
        });
        let right = DVector::from_fn(n, |i, _| self.xy[columns[i]] / scale[i]);
        let Some(inverse) = gram.cholesky().map(|cholesky| cholesky.inverse()) else { return Vec::new() };
        let solution = &inverse * right;
        let fitted: Selection = (0..n).map(|i| (columns[i], solution[i] / scale[i], 0.0)).collect();
        let variance = self.residual(&fitted) / (self.count - n as f64).max(1.0);
        let std = |i: usize| (variance * inverse[(i, i)]).sqrt() / scale[i];
        fitted.into_iter().enumerate().map(|(i, (column, value, _))| (column, value, std(i))).collect()
    }

    fn columns(&self) -> usize {
        self.xy.len()
    }
}

fn sum(folds: &[Normal]) -> Normal {
    let mut all = Normal::new(folds[0].columns());
    folds.iter().for_each(|fold| all = all.plus(fold));
    all
}

/// The setting that the rule of one standard error chooses: the most sparing one whose error on left-out folds is within
/// one standard error of the least. Settings come from the most sparing on.
fn cross_validated(folds: &[Normal], settings: usize, fit: impl Fn(&Normal, usize) -> Selection) -> usize {
    let errors: Vec<Vec<f64>> = (0..settings)
        .map(|setting| {
            let left_out = |out: usize| {
                let others = folds.iter().enumerate().filter(|(i, _)| *i != out);
                let train = sum(&others.map(|(_, fold)| fold.clone()).collect::<Vec<_>>());
                folds[out].residual(&fit(&train, setting)) / folds[out].count.max(1.0)
            };
            (0..folds.len()).map(left_out).collect()
        })
        .collect();
    let mean = |errors: &Vec<f64>| errors.iter().sum::<f64>() / errors.len() as f64;
    let best = (0..settings).min_by(|&a, &b| mean(&errors[a]).total_cmp(&mean(&errors[b]))).unwrap_or(0);
    let least = mean(&errors[best]);
    let n = folds.len() as f64;
    let spread = errors[best].iter().map(|e| (e - least) * (e - least)).sum::<f64>() / (n - 1.0).max(1.0);
    let limit = least + (spread / n).sqrt();
    (0..=best).find(|&setting| mean(&errors[setting]) <= limit).unwrap_or(best)
}

/// Sequentially thresholded least squares: columns whose share of the gap's root mean square is below a threshold fall.
pub(super) fn thresholded(folds: &[Normal]) -> Selection {
    let fit = |normal: &Normal, setting: usize| {
        // from 1 down to 0.02 of the root mean square of the gap
        let threshold = 0.02f64.powf(setting as f64 / (TRIED - 1) as f64) * (normal.yy / normal.count).sqrt();
        let mut columns: Vec<usize> = (0..normal.columns()).collect();
        loop {
            let fitted = normal.fit(&columns);
            let size =
                |&(i, value, _): &(usize, f64, f64)| value.abs() * (normal.xx[(i, i)] / normal.count).sqrt();
            let kept: Selection = fitted.iter().copied().filter(|term| size(term) >= threshold).collect();
            if kept.len() == fitted.len() || kept.is_empty() {
                return kept;
            }
            columns = kept.iter().map(|(i, ..)| *i).collect();
        }
    };
    let setting = cross_validated(folds, TRIED, fit);
    fit(&sum(folds), setting)
}

/// LASSO on columns of unit size, its survivors fitted again by least squares.
pub(super) fn lasso(folds: &[Normal]) -> Selection {
    let fit = |normal: &Normal, setting: usize| {
        let largest = (0..normal.columns()).map(|i| scaled(normal, i).abs()).fold(0.0, f64::max);
        let penalty = largest * 1e-3f64.powf((setting + 1) as f64 / TRIED as f64);
        descend(normal, penalty)
    };
    let setting = cross_validated(folds, TRIED, fit);
    let all = sum(folds);
    let survivors: Vec<usize> = fit(&all, setting).iter().map(|(i, ..)| *i).collect();
    all.fit(&survivors)
}

fn scaled(normal: &Normal, i: usize) -> f64 {
    let size = normal.xx[(i, i)].sqrt();
    if size > 0.0 { normal.xy[i] / size } else { 0.0 }
}

/// Coordinate descent (Friedman, Hastie, Tibshirani, 2010) on `0.5 |y - Z b|^2 + penalty |b|_1` with unit columns Z.
fn descend(normal: &Normal, penalty: f64) -> Selection {
    let n = normal.columns();
    let size: Vec<f64> = (0..n).map(|i| normal.xx[(i, i)].sqrt()).collect();
    let mut b = vec![0.0; n];
    for _ in 0..SWEEPS {
        let mut moved: f64 = 0.0;
        for i in (0..n).filter(|&i| size[i] > 0.0) {
            let others: f64 = (0..n)
                .filter(|&j| j != i && b[j] != 0.0)
                .map(|j| normal.xx[(i, j)] / (size[i] * size[j]) * b[j])
                .sum();
            let free = scaled(normal, i) - others;
            let next = (free.abs() - penalty).max(0.0).copysign(free);
            moved = moved.max((next - b[i]).abs());
            b[i] = next;
        }
        if moved < 1e-4 * penalty {
            break;
        }
    }
    (0..n).filter(|&i| b[i] != 0.0).map(|i| (i, b[i] / size[i], 0.0)).collect()
}

/// Groups of columns in and out, one at a time, while the Bayesian information criterion falls.
pub(super) fn stepwise(folds: &[Normal], groups: &[Vec<usize>]) -> Selection {
    let all = sum(folds);
    let of = |chosen: &[usize]| {
        all.fit(&chosen.iter().flat_map(|&group| groups[group].clone()).collect::<Vec<_>>())
    };
    let criterion = |chosen: &[usize]| {
        let fitted = of(chosen);
        let rest = all.residual(&fitted).max(1e-12);
        all.count * (rest / all.count).ln() + fitted.len() as f64 * all.count.ln()
    };
    let mut chosen: Vec<usize> = Vec::new();
    let mut best = criterion(&chosen);
    loop {
        let toggled = |group: usize| {
            let mut next: Vec<usize> = chosen.iter().copied().filter(|&other| other != group).collect();
            if next.len() == chosen.len() {
                next.push(group);
            }
            next
        };
        let moves = (0..groups.len()).map(|group| (criterion(&toggled(group)), group));
        match moves.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((next, group)) if next < best - 1e-9 => {
                chosen = toggled(group);
                best = next;
            }
            _ => return of(&chosen),
        }
    }
}

/// The one group that explains most.
pub(super) fn best(folds: &[Normal], groups: &[Vec<usize>]) -> Selection {
    let all = sum(folds);
    let fits = groups.iter().map(|group| all.fit(group));
    let least = fits.min_by(|a, b| all.residual(a).total_cmp(&all.residual(b))).unwrap_or_default();
    if all.residual(&least) < (1.0 - LEAST_R2) * all.yy { least } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::Gaussian;
    use wade_learn::random::Random;

    /// y = 2 x0 - 3 x3 with noise, six independent columns.
    fn planted(noise: f64) -> Vec<Normal> {
        let mut gaussian = Gaussian::new(Random::new(9));
        let fold = |_| {
            let mut normal = Normal::new(6);
            for _ in 0..200 {
                let row: Vec<f64> = (0..6).map(|_| gaussian.draw()).collect();
                normal.add(&row, 2.0 * row[0] - 3.0 * row[3] + noise * gaussian.draw());
            }
            normal
        };
        (0..4).map(fold).collect()
    }

    #[test]
    fn every_method_finds_what_is_plain() {
        let folds = planted(0.5);
        let groups: Vec<Vec<usize>> = (0..6).map(|i| vec![i]).collect();
        for found in [thresholded(&folds), lasso(&folds), stepwise(&folds, &groups)] {
            let columns: Vec<usize> = found.iter().map(|(i, ..)| *i).collect();
            assert_eq!(columns.len(), 2, "{found:?}");
            for (i, value, std) in found {
                let truth = if i == 0 { 2.0 } else { -3.0 };
                assert!(
                    (value - truth).abs() < 4.0 * std && (0.01..0.03).contains(&std),
                    "{i} {value} {std}"
                );
            }
        }
        assert_eq!(best(&folds, &groups)[0].0, 3);
    }

    #[test]
    fn a_large_penalty_leaves_nothing_and_orthogonal_columns_are_shrunk_by_it() {
        let mut normal = Normal::new(2);
        normal.add(&[1.0, 0.0], 3.0);
        normal.add(&[0.0, 1.0], -1.0);
        let found = descend(&normal, 0.5);
        assert!((found[0].1 - 2.5).abs() < 1e-12 && (found[1].1 + 0.5).abs() < 1e-12);
        assert_eq!(descend(&normal, 1.5).len(), 1);
    }
}
