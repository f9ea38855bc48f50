//! What a region or a structure is described in.

use nalgebra::{DMatrix, DVector};

use super::candidates::Column;
use super::design::{Design, to_rows};
use super::series::Series;
use super::statistics::{quantile, white_variance};
use crate::frame::GRAVITY;

/// Names of the features of a place, with units; all the same for a mirrored vehicle.
pub(super) const FEATURES: [(&str, &str); 9] = [
    ("depth", "m"),
    ("froude_depth", "1"),
    ("speed", "m/s"),
    ("acceleration", "m/s2"),
    ("yaw_rate", "rad/s"),
    ("wetting_rate", "m/s"),
    ("time_in_water", "s"),
    ("pitch", "rad"),
    ("roll", "rad"),
];

/// Features of each bin of a trial.
pub(super) fn of_bins(series: &Series) -> Vec<[f64; 9]> {
    let time_in_water = time_in_water(series);
    let mean = |value: &dyn Fn(usize) -> f64| series.binned(value);
    let conditions = &series.conditions;
    let columns = [
        mean(&|i| conditions[i].depth),
        mean(&|i| conditions[i].velocity.norm() / (GRAVITY * conditions[i].depth.max(0.01)).sqrt()),
        mean(&|i| conditions[i].velocity.norm()),
        // the mean before the norm, or noise would pass for acceleration
        {
            let [x, y, z] = [0, 1, 2].map(|axis| mean(&|i| conditions[i].acceleration[axis]));
            (0..x.len()).map(|i| (x[i] * x[i] + y[i] * y[i] + z[i] * z[i]).sqrt()).collect()
        },
        mean(&|i| conditions[i].angular_velocity.z).into_iter().map(f64::abs).collect(),
        mean(&|i| series.wetting_rate[i]),
        mean(&|i| time_in_water[i]),
        mean(&|i| series.roll_pitch[i][1]),
        mean(&|i| series.roll_pitch[i][0]).into_iter().map(f64::abs).collect(),
    ];
    (0..series.bins.len()).map(|bin| std::array::from_fn(|f| columns[f][bin])).collect()
}

fn time_in_water(series: &Series) -> Vec<f64> {
    let mut since = None;
    let mut of = |(t, depth): (&f64, f64)| {
        if depth <= 0.0 {
            since = None;
            return 0.0;
        }
        t - *since.get_or_insert(*t)
    };
    series.t.iter().zip(series.conditions.iter().map(|c| c.depth)).map(&mut of).collect()
}

/// A general model of the gap that knows no effect: many smooth functions of the state, apart for each component. What it
/// predicts of blocks that it has not seen is structure, whatever its name.
#[derive(Debug, Clone)]
pub(super) struct General {
    columns: Vec<Smooth>,
}

/// One of the functions over all rows.
#[derive(Debug, Clone)]
struct Smooth {
    name: String,
    values: Vec<f64>,
    /// True where it is one of what a model is told: velocity, depth, attitude.
    told: bool,
}

/// What the general model finds in the rows.
#[derive(Debug, Clone)]
pub(super) struct Structure {
    /// Cross-validated gain of the loss, not below 0.
    pub gain: f64,
    /// Loss left in sample, with the fitted numbers counted.
    pub loss: f64,
    /// The gain over its standard error from trial to trial.
    pub deviate: f64,
    /// Functions that say most by themselves, with the share of the rows' squares.
    pub strongest: Vec<(String, f64)>,
}

impl General {
    pub fn new(all: &[Series], design: &Design, components: &[usize]) -> Self {
        let mut columns = Vec::new();
        let mut add = |name: String, told: bool, function: &dyn Fn(&Series, usize, f64) -> f64| {
            let of = |trial: usize| -> Column {
                let series = &all[trial];
                let time = time_in_water(series);
                (0..series.t.len()).map(|i| [function(series, i, time[i]); 6]).collect()
            };
            let values = to_rows(all, &design.rows, &design.trials, components, &design.noise, of);
            if values.iter().any(|v| v.abs() > 1e-12) {
                columns.push(Smooth { name, values, told });
            }
        };
        for (told, functions) in [(true, of_the_state()), (false, of_the_motion())] {
            functions.into_iter().for_each(|(name, function)| add(name.to_owned(), told, &function));
        }
        // hats over the range of a quantity follow any shape that a polynomial does not
        for (name, told, quantity) in quantities() {
            let mut values: Vec<f64> =
                all.iter().flat_map(|s| (0..s.t.len()).step_by(7).map(|i| quantity(s, i))).collect();
            let (low, high) = (quantile(&mut values.clone(), 0.005), quantile(&mut values, 0.995));
            let width = (high - low) / HATS as f64;
            for hat in (0..=HATS).filter(|_| width > 1e-6) {
                let middle = low + hat as f64 * width;
                let height = move |value: f64| (1.0 - ((value - middle) / width).abs()).max(0.0);
                add(format!("{name} near {middle:.2}"), told, &|s, i, _| height(quantity(s, i)));
            }
        }
        Self { columns }
    }

    /// Fits each component of `target`, which has the rows of the design.
    pub fn structure(&self, design: &Design, components: &[usize], target: &DVector<f64>) -> Structure {
        let folds = design.block_fold.iter().max().map_or(1, |last| last + 1);
        let trials = design.rows.block_trial.iter().max().map_or(0, |last| last + 1);
        let mut gains = vec![0.0; trials];
        let mut sum = Structure { gain: 0.0, loss: 0.0, deviate: 0.0, strongest: Vec::new() };
        let mut shares = vec![0.0; self.columns.len()];
        for &component in components {
            let rows: Vec<usize> =
                (0..target.len()).filter(|&r| design.rows.rows[r].component == component).collect();
            self.component(design, target, &rows, folds, &mut gains, &mut sum, &mut shares);
        }
        let whole = target.norm_squared().max(f64::MIN_POSITIVE);
        let used: Vec<f64> = design.trials.iter().map(|&trial| gains[trial]).collect();
        let count = used.len() as f64;
        let mean = used.iter().sum::<f64>() / count;
        let variance = used.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        sum.gain = used.iter().sum::<f64>().max(0.0);
        sum.deviate = mean / (variance / count).sqrt().max(f64::MIN_POSITIVE);
        let mut order: Vec<usize> = (0..self.columns.len()).collect();
        order.sort_by(|&a, &b| shares[b].total_cmp(&shares[a]).then(a.cmp(&b)));
        sum.strongest =
            order.into_iter().take(3).map(|i| (self.columns[i].name.clone(), shares[i] / whole)).collect();
        sum
    }

    /// What smooth functions of what a model is told leave of a target that has the rows of the design.
    pub fn untold(&self, target: &DVector<f64>, design: &Design) -> DVector<f64> {
        let told: Vec<&Smooth> = self.columns.iter().filter(|column| column.told).collect();
        let mut left = target.clone();
        for place in 0..design.rows.width {
            let rows: Vec<usize> = (place..target.len()).step_by(design.rows.width).collect();
            let mut x = DMatrix::from_fn(rows.len(), told.len(), |i, j| told[j].values[rows[i]]);
            x.column_iter_mut().for_each(|mut column| column /= column.norm().max(1e-12));
            let y = DVector::from_fn(rows.len(), |i, _| target[rows[i]]);
            let matrix = x.tr_mul(&x) + DMatrix::identity(told.len(), told.len()) * RIDGE;
            let Some(factor) = matrix.cholesky() else { continue };
            let rest = &y - &x * factor.solve(&x.tr_mul(&y));
            rows.iter().zip(rest.iter()).for_each(|(&row, value)| left[row] = *value);
        }
        left
    }

    #[expect(clippy::too_many_arguments, reason = "sums of one pass")]
    fn component(
        &self,
        design: &Design,
        target: &DVector<f64>,
        rows: &[usize],
        folds: usize,
        gains: &mut [f64],
        sum: &mut Structure,
        shares: &mut [f64],
    ) {
        let count = self.columns.len();
        // whole trials are left out: parts of one would teach the zero of the others
        let place = |trial: usize| design.trials.iter().position(|&t| t == trial).unwrap_or_default();
        let fold_of_trial: Vec<usize> =
            (0..gains.len()).map(|trial| place(trial) % folds.min(design.trials.len())).collect();
        let fold_of = |row: usize| fold_of_trial[design.rows.rows[row].trial];
        let x = DMatrix::from_fn(rows.len(), count, |i, j| self.columns[j].values[rows[i]]);
        let scale: Vec<f64> =
            (0..count).map(|j| (x.column(j).norm_squared() / rows.len() as f64).sqrt().max(1e-12)).collect();
        let x = DMatrix::from_fn(rows.len(), count, |i, j| x[(i, j)] / scale[j]);
        let y = DVector::from_fn(rows.len(), |i, _| target[rows[i]]);
        let ridge = RIDGE * rows.len() as f64;
        let solve = |xx: &DMatrix<f64>, xy: &DVector<f64>| {
            let mut matrix = xx.clone();
            (0..count).for_each(|i| matrix[(i, i)] += ridge);
            matrix.cholesky().map(|factor| factor.solve(xy))
        };
        let (xx, xy) = (x.tr_mul(&x), x.tr_mul(&y));
        for j in 0..count {
            shares[j] += xy[j].powi(2) / xx[(j, j)].max(1e-12);
        }
        let freedom = (rows.len() as f64 / (rows.len() as f64 - count as f64).max(1.0)).max(1.0);
        sum.loss +=
            solve(&xx, &xy).map_or(y.norm_squared(), |beta| (&y - &x * beta).norm_squared()) * freedom;
        for fold in 0..folds {
            let inside: Vec<usize> = (0..rows.len()).filter(|&i| fold_of(rows[i]) == fold).collect();
            let part = DMatrix::from_fn(inside.len(), count, |i, j| x[(inside[i], j)]);
            let part_y = DVector::from_fn(inside.len(), |i, _| y[inside[i]]);
            let Some(beta) = solve(&(&xx - part.tr_mul(&part)), &(&xy - part.tr_mul(&part_y))) else {
                continue;
            };
            let left = &part_y - part * beta;
            for (i, &row) in inside.iter().enumerate() {
                gains[design.rows.rows[rows[row]].trial] += part_y[i].powi(2) - left[i].powi(2);
            }
        }
    }
}

/// Ridge over the square of a column: functions of the state that hardly differ.
const RIDGE: f64 = 1e-3;

/// Hats over the range of a quantity.
const HATS: usize = 12;

type Quantity = fn(&Series, usize) -> f64;

/// Each with whether a model is told of it.
fn quantities() -> [(&'static str, bool, Quantity); 3] {
    [
        ("forward velocity", true, |s, i| s.conditions[i].velocity.x),
        ("depth", true, |s, i| s.conditions[i].depth),
        ("yaw rate", false, |s, i| s.conditions[i].angular_velocity.z),
    ]
}

/// How the energy of the rows that no trend explains grows with the state: the deviate of the strongest quantity, its
/// name, and the root of the energy in its upper third, in noises of a bin. White noise of any size is taken off block by
/// block, so that noise that grows with speed is no structure.
pub(super) fn energy(all: &[Series], design: &Design, target: &DVector<f64>) -> (f64, &'static str, f64) {
    let blocks = design.rows.blocks;
    let mut series: Vec<[Vec<f64>; 6]> = vec![Default::default(); blocks];
    // the zero of a trial is no force that comes and goes
    let trials = design.rows.block_trial.iter().max().map_or(0, |last| last + 1);
    let mut zero = vec![[(0.0, 0.0); 6]; trials];
    for (row, place) in design.rows.rows.iter().enumerate() {
        let (sum, count) = &mut zero[place.trial][place.component];
        (*sum, *count) = (*sum + target[row], *count + 1.0);
    }
    for (row, place) in design.rows.rows.iter().enumerate() {
        let (sum, count) = zero[place.trial][place.component];
        series[place.block][place.component].push(target[row] - sum / count);
    }
    let excess: Vec<f64> = series
        .iter()
        .map(|components| {
            let of = |values: &Vec<f64>| {
                let square = values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64;
                (square - white_variance(values)).min(1e6)
            };
            components.iter().filter(|values| values.len() >= 6).map(of).sum()
        })
        .collect();
    let features: Vec<Vec<[f64; 9]>> = all.iter().map(of_bins).collect();
    let mut best = (0.0, "", 0.0);
    for (index, (name, _)) in FEATURES.iter().enumerate() {
        let values: Vec<f64> = (0..blocks)
            .map(|block| {
                let bins = &features[design.rows.block_trial[block]][design.rows.block_bins[block].clone()];
                bins.iter().map(|f| f[index]).sum::<f64>() / bins.len().max(1) as f64
            })
            .collect();
        let (deviate, size) = trend(&values, &excess, &design.rows.block_trial);
        if deviate > best.0 {
            best = (deviate, *name, size);
        }
    }
    best
}

/// Deviate of the slope of ranks, clustered by trial, and the root mean excess of the third on the larger side.
fn trend(values: &[f64], excess: &[f64], trial: &[usize]) -> (f64, f64) {
    let (x, y) = (ranks(values), ranks(excess));
    let trials = trial.iter().max().map_or(0, |last| last + 1);
    let mut scores = vec![0.0; trials];
    for ((x, y), &trial) in x.iter().zip(&y).zip(trial) {
        scores[trial] += x * y;
    }
    let sum: f64 = scores.iter().sum();
    let spread = scores.iter().map(|s| s * s).sum::<f64>().sqrt();
    let upper: Vec<f64> =
        x.iter().zip(excess).filter(|(x, _)| **x * sum.signum() > 1.0 / 6.0).map(|(_, e)| *e).collect();
    let mean = upper.iter().sum::<f64>() / upper.len().max(1) as f64;
    (sum.abs() / spread.max(f64::MIN_POSITIVE), mean.max(0.0).sqrt())
}

/// Ranks from -1/2 to 1/2.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    for (rank, index) in order.into_iter().enumerate() {
        ranks[index] = (rank as f64 + 0.5) / values.len() as f64 - 0.5;
    }
    ranks
}

type Function = fn(&Series, usize, f64) -> f64;

/// Functions of what a model is told.
fn of_the_state() -> Vec<(&'static str, Function)> {
    vec![
        ("a constant", |_, _, _| 1.0),
        ("forward velocity", |s, i, _| s.conditions[i].velocity.x),
        ("lateral velocity", |s, i, _| s.conditions[i].velocity.y),
        ("vertical velocity", |s, i, _| s.conditions[i].velocity.z),
        ("forward velocity squared with its sign", |s, i, _| {
            s.conditions[i].velocity.x * s.conditions[i].velocity.norm()
        }),
        ("lateral velocity times speed", |s, i, _| {
            s.conditions[i].velocity.y * s.conditions[i].velocity.norm()
        }),
        ("speed squared", |s, i, _| s.conditions[i].velocity.norm_squared()),
        ("speed cubed", |s, i, _| s.conditions[i].velocity.norm().powi(3)),
        ("forward velocity times speed squared", |s, i, _| {
            s.conditions[i].velocity.x * s.conditions[i].velocity.norm_squared()
        }),
        ("depth", |s, i, _| s.conditions[i].depth),
        ("depth squared", |s, i, _| s.conditions[i].depth.powi(2)),
        ("depth times speed squared", |s, i, _| {
            s.conditions[i].depth * s.conditions[i].velocity.norm_squared()
        }),
        ("depth times forward velocity squared", |s, i, _| {
            s.conditions[i].depth * s.conditions[i].velocity.x * s.conditions[i].velocity.norm()
        }),
        ("depth times forward velocity", |s, i, _| s.conditions[i].depth * s.conditions[i].velocity.x),
        ("pitch", |s, i, _| s.roll_pitch[i][1]),
        ("roll", |s, i, _| s.roll_pitch[i][0]),
    ]
}

/// Functions of how the vehicle moves and moved, and of where it heads.
fn of_the_motion() -> Vec<(&'static str, Function)> {
    vec![
        ("forward acceleration", |s, i, _| s.conditions[i].acceleration.x),
        ("lateral acceleration", |s, i, _| s.conditions[i].acceleration.y),
        ("vertical acceleration", |s, i, _| s.conditions[i].acceleration.z),
        ("depth times forward acceleration", |s, i, _| {
            s.conditions[i].depth * s.conditions[i].acceleration.x
        }),
        ("forward acceleration times speed", |s, i, _| {
            s.conditions[i].acceleration.x * s.conditions[i].velocity.norm()
        }),
        ("roll rate", |s, i, _| s.conditions[i].angular_velocity.x),
        ("pitch rate", |s, i, _| s.conditions[i].angular_velocity.y),
        ("yaw rate", |s, i, _| s.conditions[i].angular_velocity.z),
        ("yaw rate times forward velocity", |s, i, _| {
            s.conditions[i].angular_velocity.z * s.conditions[i].velocity.x
        }),
        ("yaw rate squared", |s, i, _| s.conditions[i].angular_velocity.z.powi(2)),
        ("angular acceleration about z", |s, i, _| s.conditions[i].angular_acceleration.z),
        ("wetting rate", |s, i, _| s.wetting_rate[i]),
        ("entry speed squared", |s, i, _| s.wetting_rate[i].max(0.0).powi(2)),
        ("time in water", |_, _, time| time),
        ("time since the entry, fading", |_, _, time| (-time / 1.5).exp()),
        ("heading (cosine)", |s, i, _| s.yaw[i].cos()),
        ("heading (sine)", |s, i, _| s.yaw[i].sin()),
        ("speed times heading (cosine)", |s, i, _| s.conditions[i].velocity.norm() * s.yaw[i].cos()),
        ("speed times heading (sine)", |s, i, _| s.conditions[i].velocity.norm() * s.yaw[i].sin()),
    ]
}
