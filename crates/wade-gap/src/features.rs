//! What a region or a structure is described in.

use nalgebra::DVector;

use super::design::Design;
use super::series::Series;
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
