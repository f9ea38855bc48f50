//! Whether there is structure in a gap, whatever its name: a regression on many smooth functions of the state.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::candidates::Column;
use super::design::Design;
use super::features::time_in_water;
use super::series::Series;
use super::statistics::quantile;

/// A general model of the gap that knows no effect: many smooth functions of the state, apart for each component. What it
/// predicts of trials that it has not seen is structure, whatever its name.
#[derive(Debug, Clone)]
pub(super) struct General {
    columns: Vec<Smooth>,
}

/// One of the functions over all rows.
#[derive(Debug, Clone)]
struct Smooth {
    name: String,
    values: Vec<f64>,
}

/// What the general model finds in the rows.
#[derive(Debug, Clone)]
pub(super) struct Structure {
    /// Cross-validated gain of the loss, not below 0.
    pub gain: f64,
    /// Loss that is left: midway between that in sample, which chance lowers, and the cross-validated one, which it raises as
    /// much. Noise that hangs together lets each number take more than its share of the rows.
    pub loss: f64,
    /// The gain over its standard error from trial to trial.
    pub deviate: f64,
    /// The gain in each trial.
    pub gains: Vec<f64>,
    /// Functions that say most by themselves, with the share of the rows' squares.
    pub strongest: Vec<(String, f64)>,
}

impl General {
    pub fn new(all: &[Series], design: &Design, components: &[usize]) -> Self {
        let mut columns = Vec::new();
        let mut add = |name: String, function: &dyn Fn(&Series, usize, f64) -> f64| {
            let of = |trial: usize| -> Column {
                let series = &all[trial];
                let time = time_in_water(series);
                (0..series.t.len()).map(|i| [function(series, i, time[i]); 6]).collect()
            };
            let values = design.to_rows(all, components, of);
            if values.iter().any(|v| v.abs() > 1e-12) {
                columns.push(Smooth { name, values });
            }
        };
        functions().into_iter().for_each(|(name, function)| add(name.to_owned(), &function));
        // hats over the range of a quantity follow any shape that a polynomial does not
        for (name, quantity) in quantities() {
            let mut values: Vec<f64> =
                all.iter().flat_map(|s| (0..s.t.len()).step_by(7).map(|i| quantity(s, i))).collect();
            let (low, high) = (quantile(&mut values.clone(), 0.005), quantile(&mut values, 0.995));
            let width = (high - low) / HATS as f64;
            for hat in (0..=HATS).filter(|_| width > 1e-6) {
                let middle = low + hat as f64 * width;
                let height = move |value: f64| (1.0 - ((value - middle) / width).abs()).max(0.0);
                add(format!("{name} near {middle:.2}"), &|s, i, _| height(quantity(s, i)));
            }
        }
        Self { columns }
    }

    /// Fits each component of `target`, which has the rows of the design.
    pub fn structure(&self, design: &Design, components: &[usize], target: &DVector<f64>) -> Structure {
        let trials = design.rows.past_last_trial();
        let mut whole = Part { loss: 0.0, gains: vec![0.0; trials], shares: vec![0.0; self.columns.len()] };
        for &component in components {
            let rows: Vec<usize> =
                (0..target.len()).filter(|&r| design.rows.rows[r].component == component).collect();
            whole.add(&self.part(design, target, &rows));
        }
        let used: Vec<f64> = design.trials.iter().map(|&trial| whole.gains[trial]).collect();
        let count = used.len() as f64;
        let mean = used.iter().sum::<f64>() / count;
        let variance = used.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        let shares = whole.shares;
        let mut order: Vec<usize> = (0..shares.len()).collect();
        order.sort_by(|&a, &b| shares[b].total_cmp(&shares[a]).then(a.cmp(&b)));
        let squares = target.norm_squared().max(f64::MIN_POSITIVE);
        let strongest = order.into_iter().take(3);
        let gain = used.iter().sum::<f64>();
        Structure {
            gain: gain.max(0.0),
            loss: 0.5 * (whole.loss + target.norm_squared() - gain),
            deviate: mean / (variance / count).sqrt().max(f64::MIN_POSITIVE),
            gains: whole.gains,
            strongest: strongest.map(|i| (self.columns[i].name.clone(), shares[i] / squares)).collect(),
        }
    }

    /// The rows of one component.
    fn part(&self, design: &Design, target: &DVector<f64>, rows: &[usize]) -> Part {
        let trials = design.rows.past_last_trial();
        let folds = design.block_fold.iter().max().map_or(1, |last| last + 1);
        // whole trials are left out: parts of one would teach the zero of the others
        let fold_of_trial: Vec<usize> =
            (0..trials).map(|trial| design.place(trial) % folds.min(design.trials.len())).collect();
        let fold_of = |row: usize| fold_of_trial[design.rows.rows[row].trial];
        let x = scaled(&self.columns, rows);
        let y = DVector::from_fn(rows.len(), |i, _| target[rows[i]]);
        let (xx, xy) = (x.tr_mul(&x), x.tr_mul(&y));
        let count = self.columns.len();
        let left = ridged(xx.clone(), rows.len())
            .map_or(y.norm_squared(), |factor| (&y - &x * factor.solve(&xy)).norm_squared());
        let shares = (0..count).map(|j| xy[j].powi(2) / xx[(j, j)].max(1e-12));
        let mut part = Part { loss: left, gains: vec![0.0; trials], shares: shares.collect() };
        for fold in 0..folds {
            let inside: Vec<usize> = (0..rows.len()).filter(|&i| fold_of(rows[i]) == fold).collect();
            let own = DMatrix::from_fn(inside.len(), count, |i, j| x[(inside[i], j)]);
            let own_y = DVector::from_fn(inside.len(), |i, _| y[inside[i]]);
            let (others, of_target) = (&xx - own.tr_mul(&own), &xy - own.tr_mul(&own_y));
            // one penalty for all: that of the whole component
            let Some(factor) = ridged(others, rows.len()) else { continue };
            let left = &own_y - own * factor.solve(&of_target);
            for (i, &row) in inside.iter().enumerate() {
                part.gains[design.rows.rows[rows[row]].trial] += own_y[i].powi(2) - left[i].powi(2);
            }
        }
        part
    }
}

/// What the functions do for some of the rows.
struct Part {
    /// Loss in sample.
    loss: f64,
    /// Cross-validated gain in each trial.
    gains: Vec<f64>,
    /// What each function explains by itself.
    shares: Vec<f64>,
}

impl Part {
    fn add(&mut self, other: &Self) {
        let sum = |ours: &mut [f64], theirs: &[f64]| ours.iter_mut().zip(theirs).for_each(|(a, b)| *a += b);
        self.loss += other.loss;
        sum(&mut self.gains, &other.gains);
        sum(&mut self.shares, &other.shares);
    }
}

/// The functions over some rows, each in units of its root mean square.
fn scaled(columns: &[Smooth], rows: &[usize]) -> DMatrix<f64> {
    let mut x = DMatrix::from_fn(rows.len(), columns.len(), |i, j| columns[j].values[rows[i]]);
    let root = (rows.len().max(1) as f64).sqrt();
    x.column_iter_mut().for_each(|mut column| column /= (column.norm() / root).max(1e-12));
    x
}

/// The factored normal matrix with a penalty of [`RIDGE`] a row.
fn ridged(mut xx: DMatrix<f64>, rows: usize) -> Option<Cholesky<f64, Dyn>> {
    (0..xx.ncols()).for_each(|i| xx[(i, i)] += RIDGE * rows as f64);
    xx.cholesky()
}

/// Ridge over the square of a column: functions of the state that hardly differ.
const RIDGE: f64 = 1e-3;

/// Hats over the range of a quantity.
const HATS: usize = 12;

type Quantity = fn(&Series, usize) -> f64;

fn quantities() -> [(&'static str, Quantity); 3] {
    [
        ("forward velocity", |s, i| s.conditions[i].velocity.x),
        ("depth", |s, i| s.conditions[i].depth),
        ("yaw rate", |s, i| s.conditions[i].angular_velocity.z),
    ]
}

type Function = fn(&Series, usize, f64) -> f64;

/// Functions of the state, of how the vehicle moves and moved, and of where it heads.
fn functions() -> Vec<(&'static str, Function)> {
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
