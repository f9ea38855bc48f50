//! What a region or a structure is described in.

use nalgebra::DVector;

use super::design::Design;
use super::rates::mean_square;
use super::robust::strided;
use super::series::Series;
use super::smoothing::{running_mean, white_kept};
use super::statistics::white_variance;
use wade_core::effects::RegionQuantity;

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

/// Places in [`FEATURES`].
pub(super) const DEPTH: usize = 0;
pub(super) const SPEED: usize = 2;

/// The features that may limit an effect, with their places in [`FEATURES`].
pub(super) const LIMITING: [(usize, RegionQuantity); 4] = [
    (DEPTH, RegionQuantity::Depth),
    (1, RegionQuantity::FroudeDepth),
    (SPEED, RegionQuantity::Speed),
    (7, RegionQuantity::Pitch),
];

/// The features of a place, in the order of [`FEATURES`].
pub(super) type Features = [f64; FEATURES.len()];

/// Features of each bin of a trial.
pub(super) fn of_bins(series: &Series) -> Vec<Features> {
    let time_in_water = time_in_water(series);
    let mean = |value: &dyn Fn(usize) -> f64| series.binned(value);
    let conditions = &series.conditions;
    let columns = [
        mean(&|i| conditions[i].depth),
        mean(&|i| RegionQuantity::FroudeDepth.of(&conditions[i])),
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

pub(super) fn time_in_water(series: &Series) -> Vec<f64> {
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

/// A target that has the rows of the design without the mean of each component in each trial.
pub(super) fn without_zeros(design: &Design, target: &DVector<f64>) -> DVector<f64> {
    let trials = design.rows.past_last_trial();
    let mut zero = vec![[(0.0, 0.0); 6]; trials];
    for (row, place) in design.rows.rows.iter().enumerate() {
        let (sum, count) = &mut zero[place.trial][place.component];
        (*sum, *count) = (*sum + target[row], *count + 1.0);
    }
    DVector::from_fn(target.len(), |row, _| {
        let place = &design.rows.rows[row];
        let (sum, count) = zero[place.trial][place.component];
        target[row] - sum / count
    })
}

/// Bins to either side of the running means over which energy is looked for.
const NEAR: usize = 1;

/// How the energy of rows that no trend explains grows with the state: the deviate of the strongest quantity, and the root of
/// the energy in its upper third, in noises of a bin. White noise of any size is taken off block by block, so that noise that
/// grows with speed is no structure: as large as it is in the rows, which were not smoothed, as far as two running means leave
/// it.
pub(super) fn energy(all: &[Series], design: &Design, unsmoothed: &DVector<f64>) -> (f64, f64) {
    let (blocks, width) = (design.rows.blocks, design.rows.width);
    // the zero of a trial is no force that comes and goes
    let unsmoothed = without_zeros(design, unsmoothed);
    let mut series: Vec<[[Vec<f64>; 2]; 6]> = vec![Default::default(); blocks];
    for trial in &design.rows.of_trial {
        for first in 0..width {
            let rough = strided(&unsmoothed.as_slice()[trial.clone()], first, width);
            let mut smooth = rough.clone();
            (0..2).for_each(|_| running_mean(&mut smooth, NEAR));
            let places = design.rows.rows[trial.clone()].iter().skip(first).step_by(width);
            for ((place, rough), smooth) in places.zip(rough).zip(smooth) {
                let [of_smooth, of_rough] = &mut series[place.block][place.component];
                of_smooth.push(smooth);
                of_rough.push(rough);
            }
        }
    }
    let kept = white_kept(NEAR, 1);
    let of = |[smooth, rough]: &[Vec<f64>; 2]| (mean_square(smooth) - kept * white_variance(rough)).min(1e6);
    let excess: Vec<f64> = series
        .iter()
        .map(|components| components.iter().filter(|[values, _]| values.len() >= 6).map(of).sum())
        .collect();
    let features: Vec<Vec<Features>> = all.iter().map(of_bins).collect();
    let of_feature = |index: usize| {
        let values: Vec<f64> = (0..blocks)
            .map(|block| {
                let bins = &features[design.rows.block_trial[block]][design.rows.block_bins[block].clone()];
                bins.iter().map(|f| f[index]).sum::<f64>() / bins.len().max(1) as f64
            })
            .collect();
        trend(&values, &excess, &design.rows.block_trial)
    };
    (0..FEATURES.len())
        .map(of_feature)
        .fold((0.0, 0.0), |best, found| if found.0 > best.0 { found } else { best })
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

/// Ranks from -1/2 to 1/2; values that are the same share theirs, or their order would depend on the names of the files.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut before = 0;
    for same in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let rank = (before as f64 + 0.5 * same.len() as f64) / values.len() as f64 - 0.5;
        same.iter().for_each(|&index| ranks[index] = rank);
        before += same.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trend_over_values_that_are_the_same_is_that_of_the_trials_in_any_order() {
        // blocks at two depths, their energies, and their trials
        let blocks =
            [(0.1, 1.0, 0), (0.2, 5.0, 1), (0.1, 2.0, 2), (0.2, 4.0, 3), (0.1, 3.0, 4), (0.2, 6.0, 5)];
        let of = |order: [usize; 6]| {
            let pick = order.map(|i| blocks[i]);
            trend(&pick.map(|b| b.0), &pick.map(|b| b.1), &pick.map(|b| b.2))
        };
        let (deviate, size) = of([0, 1, 2, 3, 4, 5]);
        for order in [[5, 4, 3, 2, 1, 0], [2, 0, 5, 1, 4, 3]] {
            let other = of(order);
            assert!((other.0 - deviate).abs() < 1e-12 && (other.1 - size).abs() < 1e-12, "{other:?}");
        }
        let ranks = ranks(&[7.0, 7.0, 9.0]);
        assert!(ranks[0] == ranks[1] && (ranks[0] + 1.0 / 6.0).abs() < 1e-12, "{ranks:?}");
    }
}
