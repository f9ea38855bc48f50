//! Parameters of the named effects, with intervals.
//!
//! Least squares on the rows of the design. Intervals: a bootstrap over trials, or over blocks where few trials excite an effect,
//! its ends moved out for the few that there are (the expanded percentile of Hesterberg, The American Statistician 2015) and
//! as far as the robust error reaches, what the formula itself leaves open, and what the model's own error is taken for: it is
//! one function of the state in all trials, so that no scatter between them shows it.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use serde::Serialize;

use super::Config;
use super::candidates::Setting;
use super::design::Design;
use super::features::{DEPTH, Features, SPEED, of_bins};
use super::judge::Member;
use super::robust::errors;
use super::series::Series;
use super::statistics::{Z90, quantile, student_from_normal};
use wade_core::effects::{Effect, Kind, Numbers};
use wade_learn::random::Random;

/// Fewest trials, in effect, that let an interval rest on the scatter between trials.
const ENOUGH_TRIALS: f64 = 8.0;
/// Share of a load of the water that its formula leaves open, one standard deviation: no law of the library holds to
/// better than some per cent on a hull, and no number of trials shows it.
pub(super) const FORMULA: f64 = 0.05;
/// The same of a delay, whose shift in time is a difference over a few tenths of a second here.
const DELAY: f64 = 0.02;
/// Fewer trials than this, in effect: one condition.
const ONE_CONDITION: f64 = 2.5;

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Best estimate.
    pub value: f64,
    /// Standard error.
    pub std: f64,
    /// Unit; 1 where it has none.
    pub unit: &'static str,
    /// 90 % interval.
    pub interval: [f64; 2],
    /// Band of published values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub literature: Option<[f64; 2]>,
}

/// The fit of a set.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    /// Coefficients in their units, in the order of the set's columns.
    pub values: Vec<f64>,
    /// Covariance of the values.
    pub covariance: DMatrix<f64>,
    /// 90 % intervals.
    pub intervals: Vec<[f64; 2]>,
    /// Seen in one condition only, by member.
    pub provisional: Vec<bool>,
    /// Standard errors of the nonlinear parameters, by member and number of the parameter.
    pub shape_std: Vec<Numbers>,
}

/// Fits a set on the rows of the design.
pub(super) fn fit(
    design: &Design,
    set: &[Member],
    all: &[Series],
    setting: &Setting,
    config: &Config,
) -> Option<Fit> {
    let used: Vec<(usize, usize, usize)> = set
        .iter()
        .enumerate()
        .flat_map(|(m, member)| member.columns.iter().map(move |&(column, k)| (m, column, k)))
        .collect();
    let columns: Vec<usize> = used.iter().map(|(_, column, _)| *column).collect();
    let (beta, _) = design.solve(&columns)?;
    let errors = errors(design, &columns, &design.residual(&columns, &beta))?;
    // a nonlinear parameter moves the rows like one more column; its draws are changes of its logarithm
    let shapes = shape_axes(design, set);
    let moved: Vec<DVector<f64>> = shapes
        .iter()
        .map(|&(m, axis)| {
            let own = used.iter().zip(beta.iter()).filter(|((member, ..), _)| *member == m);
            let own: Vec<(usize, usize, f64)> = own.map(|(&(_, column, k), &b)| (column, k, b)).collect();
            design.shape_derivative(all, setting, set[m].candidate, axis, &own)
        })
        .collect();
    let clusters = clusters(design, &columns, &moved);
    let few = errors.iter().map(|e| e.trials).fold(f64::INFINITY, f64::min) < ENOUGH_TRIALS;
    let groups = if few { clusters.blocks } else { clusters.trials };
    let count = columns.len();
    let (xx, xy) = sum_of(&groups, &vec![1.0; groups.len()]);
    let whole = xx.cholesky()?;
    let best = whole.solve(&xy);
    let draws = bootstrap(&groups, config);
    let scale: Vec<f64> = columns.iter().map(|&c| design.scale[c]).collect();
    let values: Vec<f64> = best.iter().zip(&scale).map(|(b, s)| b / s).collect();
    let effect = |m: usize| design.candidates[set[m].candidate].effect;
    let laws: Vec<usize> = (0..set.len()).filter(|&m| effect(m).kind() == Kind::Physics).collect();
    let formula = |m: usize| match effect(m) {
        Effect::SensorDelay | Effect::DriveDelay => DELAY,
        _ if laws.contains(&m) => FORMULA,
        _ => 0.0,
    };
    let loads = laws.iter().map(|&m| {
        let own = used.iter().enumerate().filter(|(_, (member, ..))| *member == m);
        let add = |mut sum: DVector<f64>, (i, (_, column, _)): (usize, &(usize, usize, usize))| {
            sum.axpy(best[i], &design.x.column(*column), 1.0);
            sum
        };
        own.fold(DVector::zeros(design.y.len()), add)
    });
    let bent = bent(design, all, loads);
    let leaks: Vec<DVector<f64>> = bent
        .iter()
        .map(|load| {
            let own = columns.iter().map(|&c| design.x.column(c).dot(load));
            let moved = moved.iter().map(|column| column.dot(load));
            whole.solve(&DVector::from_iterator(best.len(), own.chain(moved))) * FORMULA
        })
        .collect();
    let leaks = [leaks, model_leaks(design, &columns, &moved, &whole)].concat();
    let open = |i: usize, j: usize| {
        let own = if i == j { (formula(used[i].0) * values[i]).powi(2) } else { 0.0 };
        own + leaks.iter().map(|leak| leak[i] * leak[j]).sum::<f64>() / (scale[i] * scale[j])
    };
    // draws scatter by n - 1 of n + 1 of the variance, n the clusters that excite a column; and where the noise of all
    // trials together says more, of those few it is no less
    let freedom = |i: usize| f64::max(if few { errors[i].blocks } else { errors[i].trials } - 1.0, 1.0);
    let widening: Vec<f64> = (0..count)
        .map(|i| {
            let drawn = covariance_of(&draws, i).sqrt().max(f64::MIN_POSITIVE);
            ((freedom(i) + 2.0) / freedom(i)).sqrt().max(errors[i].std / drawn)
        })
        .collect();
    let covariance = DMatrix::from_fn(count, count, |i, j| {
        covariance(&draws, i, j) * widening[i] * widening[j] / (scale[i] * scale[j]) + open(i, j)
    });
    let interval = |i: usize| {
        let mut sorted: Vec<f64> = draws.iter().map(|d| d[i] / scale[i]).collect();
        let drawn = [quantile(&mut sorted.clone(), 0.05), quantile(&mut sorted, 0.95)];
        // as a normal variable, not as Student's
        let expansion = student_from_normal(Z90, freedom(i)) / Z90 * widening[i];
        ends(drawn, values[i], expansion, Z90 * open(i, i).sqrt())
    };
    let intervals = (0..count).map(interval).collect();
    let mut shape_std = vec![[0.0; 3]; set.len()];
    for (place, &(m, axis)) in shapes.iter().enumerate() {
        let value = design.candidates[set[m].candidate].shape.parameter(axis);
        let leaked: f64 = leaks.iter().map(|leak| leak[count + place].powi(2)).sum();
        shape_std[m][axis] = value * (covariance_of(&draws, count + place) + leaked).sqrt();
    }
    let provisional = (0..set.len())
        .map(|m| {
            // by the column that carries most of the load; the others state their own uncertainty
            let own = used.iter().zip(&errors).zip(beta.iter()).filter(|(((member, ..), _), _)| *member == m);
            let strongest = own.max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()));
            strongest.is_some_and(|((_, error), _)| error.trials < ONE_CONDITION)
        })
        .collect();
    Some(Fit { values, covariance, intervals, provisional, shape_std })
}

/// What an error of the model of one standard deviation, in each of the ways in which it may be off, changes in the estimates.
fn model_leaks(
    design: &Design,
    columns: &[usize],
    moved: &[DVector<f64>],
    whole: &Cholesky<f64, Dyn>,
) -> Vec<DVector<f64>> {
    let own = columns.iter().map(|&column| design.error.products(design.x.column(column).as_slice()));
    let products: Vec<Vec<f64>> =
        own.chain(moved.iter().map(|column| design.error.products(column.as_slice()))).collect();
    let weights = products.first().map_or(0, Vec::len);
    let leak = |weight: usize| {
        whole.solve(&DVector::from_iterator(products.len(), products.iter().map(|of| of[weight])))
    };
    (0..weights).map(leak).collect()
}

/// The ends of an interval about a value: those drawn, moved out by a factor, and what is open beyond; where both were drawn
/// on one side, the other reaches as far as is open.
fn ends([low, high]: [f64; 2], value: f64, expansion: f64, open: f64) -> [f64; 2] {
    let reach = |beyond: f64| (beyond.max(0.0) * expansion).hypot(open);
    [value - reach(value - low), value + reach(high - value)]
}

/// Each load as it would be missing where its law holds less well the deeper, or the faster: the load times the depth, and
/// the speed, in standard deviations over where it acts. What the law then leaves, the others of the set take up.
fn bent(design: &Design, all: &[Series], loads: impl Iterator<Item = DVector<f64>>) -> Vec<DVector<f64>> {
    let features: Vec<Vec<Features>> = all.iter().map(of_bins).collect();
    let mut bent = Vec::new();
    for load in loads {
        for feature in [DEPTH, SPEED] {
            let at = |row: usize| {
                let place = &design.rows.rows[row];
                features[place.trial][place.bin][feature]
            };
            let weighted = |of: &dyn Fn(usize) -> f64| {
                (0..load.len()).map(|row| load[row].powi(2) * of(row)).sum::<f64>()
                    / load.norm_squared().max(f64::MIN_POSITIVE)
            };
            let mean = weighted(&at);
            let deviation = weighted(&|row| (at(row) - mean).powi(2)).sqrt();
            if deviation > 1e-6 {
                bent.push(DVector::from_fn(load.len(), |row, _| load[row] * (at(row) - mean) / deviation));
            }
        }
    }
    bent
}

/// Members and axes of the nonlinear parameters that were searched for.
fn shape_axes(design: &Design, set: &[Member]) -> Vec<(usize, usize)> {
    let mut axes = Vec::new();
    for (m, member) in set.iter().enumerate() {
        let candidate = &design.candidates[member.candidate];
        let named = 0..candidate.effect.spec().parameters.len();
        axes.extend(named.filter(|&axis| candidate.shape.parameter(axis) != 0.0).map(|axis| (m, axis)));
    }
    axes
}

fn covariance(draws: &[DVector<f64>], i: usize, j: usize) -> f64 {
    let count = draws.len().max(2) as f64;
    let mean = |k: usize| draws.iter().map(|d| d[k]).sum::<f64>() / count;
    let (a, b) = (mean(i), mean(j));
    draws.iter().map(|d| (d[i] - a) * (d[j] - b)).sum::<f64>() / (count - 1.0)
}

fn covariance_of(draws: &[DVector<f64>], i: usize) -> f64 {
    covariance(draws, i, i).max(0.0)
}

/// Normal equations of one cluster.
struct Group {
    xx: DMatrix<f64>,
    xy: DVector<f64>,
}

struct Clusters {
    trials: Vec<Group>,
    blocks: Vec<Group>,
}

fn clusters(design: &Design, columns: &[usize], moved: &[DVector<f64>]) -> Clusters {
    let count = columns.len() + moved.len();
    let value = |row: usize, i: usize| match columns.get(i) {
        Some(&column) => design.x[(row, column)],
        None => moved[i - columns.len()][row],
    };
    let empty = || Group { xx: DMatrix::zeros(count, count), xy: DVector::zeros(count) };
    let mut blocks: Vec<Group> = (0..design.rows.blocks).map(|_| empty()).collect();
    for (row, place) in design.rows.rows.iter().enumerate() {
        let group = &mut blocks[place.block];
        for i in 0..count {
            let x = value(row, i);
            group.xy[i] += x * design.y[row];
            for j in 0..count {
                group.xx[(i, j)] += x * value(row, j);
            }
        }
    }
    let mut trials: Vec<Group> = design.trials.iter().map(|_| empty()).collect();
    for (block, group) in blocks.iter().enumerate() {
        let trial = &mut trials[design.place(design.rows.block_trial[block])];
        trial.xx += &group.xx;
        trial.xy += &group.xy;
    }
    Clusters { trials, blocks }
}

fn weighted(groups: &[Group], weights: &[f64]) -> Option<DVector<f64>> {
    let (xx, xy) = sum_of(groups, weights);
    xx.cholesky().map(|factor| factor.solve(&xy))
}

/// Normal equations of weighted clusters.
fn sum_of(groups: &[Group], weights: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
    let count = groups.first().map_or(0, |group| group.xy.len());
    let mut xx = DMatrix::zeros(count, count);
    let mut xy = DVector::zeros(count);
    for (group, &weight) in groups.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
        xx += &group.xx * weight;
        xy += &group.xy * weight;
    }
    for i in 0..count {
        xx[(i, i)] *= 1.0 + 1e-9;
    }
    (xx, xy)
}

/// Estimates from clusters with random weights (the Bayesian bootstrap; Rubin, Annals of Statistics 1981): where few clusters
/// excite an effect, a draw with replacement may have none of them, and would say anything.
fn bootstrap(groups: &[Group], config: &Config) -> Vec<DVector<f64>> {
    let mut random = Random::new(config.seed ^ 0xb007);
    let mut draw = || groups.iter().map(|_| -(1.0 - random.unit()).ln()).collect::<Vec<f64>>();
    (0..config.bootstrap).filter_map(|_| weighted(groups, &draw())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_holds_its_value_however_skew_the_draws() {
        assert_eq!(ends([1.0, 4.0], 2.0, 2.0, 0.0), [0.0, 6.0]);
        // all drawn above: what the formula leaves open is open below as well
        assert_eq!(ends([2.5, 4.0], 2.0, 1.0, 1.5), [0.5, 4.5]);
    }
}
