//! Errors as numbers.

use serde::Serialize;

use wade_core::frame::Vec3;

/// Least magnitude that a relative error is taken of [N] (source paper).
pub const SMAPE_FLOOR: f64 = 1.0;

/// Errors of a vector, component by component, in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Errors {
    /// Mean absolute error.
    pub mae: [f64; 3],
    /// Root mean square error.
    pub rmse: [f64; 3],
    /// Symmetric mean absolute percentage error [%].
    pub smape: [f64; 3],
}

impl Errors {
    /// Of pairs of prediction and truth. All zero without any.
    ///
    /// `sMAPE = 100 % mean(2 |p - t| / max(|p| + |t|, 1 N))`. The paper states the floor but not the formula.
    pub fn of(pairs: &[(Vec3, Vec3)]) -> Self {
        let count = pairs.len().max(1) as f64;
        let mean = |of: &dyn Fn(f64, f64) -> f64| -> [f64; 3] {
            std::array::from_fn(|c| pairs.iter().map(|(p, t)| of(p[c], t[c])).sum::<f64>() / count)
        };
        Self {
            mae: mean(&|p, t| (p - t).abs()),
            rmse: mean(&|p, t| (p - t).powi(2)).map(f64::sqrt),
            smape: mean(&|p, t| 200.0 * (p - t).abs() / (p.abs() + t.abs()).max(SMAPE_FLOOR)),
        }
    }
}

/// Mean of the magnitudes of each component; zero without any.
pub fn mean_magnitude<'a>(errors: impl Iterator<Item = &'a Vec3>) -> [f64; 3] {
    let (sum, count) = errors.fold((Vec3::zeros(), 0.0), |(sum, count), e| (sum + e.abs(), count + 1.0));
    (sum / f64::max(count, 1.0)).into()
}

/// A state with the errors of its sections, and the deviation that is stated of their mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Flow {
    /// Error of each section.
    pub errors: Vec<Vec3>,
    /// One standard deviation.
    pub stated: Vec3,
}

/// How far stated deviations are those of the errors of mean flows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Calibration {
    /// Cases that it is told from.
    pub cases: usize,
    /// Share of the errors within one stated deviation: 0.683 for normal errors.
    pub within_one: [f64; 3],
    /// Within two: 0.954.
    pub within_two: [f64; 3],
    /// Root mean square of the error over its stated deviation: 1.
    pub error_over_stated: [f64; 3],
    /// Root mean square of what the sections swing around their mean, which no deviation states.
    pub swing: [f64; 3],
}

impl Calibration {
    /// Of flows of so many cases; those are left out of which nothing is stated, as of hydrostatics at rest, and `None` where
    /// there are no others.
    pub fn of(flows: &[Flow], cases: usize) -> Option<Self> {
        let flows: Vec<&Flow> = flows.iter().filter(|flow| flow.stated.min() > 0.0).collect();
        if flows.is_empty() {
            return None;
        }
        let means: Vec<Vec3> =
            flows.iter().map(|flow| flow.errors.iter().sum::<Vec3>() / flow.errors.len() as f64).collect();
        let ratios = || means.iter().zip(&flows).map(|(mean, flow)| mean.abs().component_div(&flow.stated));
        let count = flows.len() as f64;
        let mean = |of: &dyn Fn(f64) -> f64| -> [f64; 3] {
            std::array::from_fn(|c| ratios().map(|ratio| of(ratio[c])).sum::<f64>() / count)
        };
        let within = |bound: f64| mean(&|ratio| if ratio <= bound { 1.0 } else { 0.0 });
        let swings = || means.iter().zip(&flows).flat_map(|(m, flow)| flow.errors.iter().map(move |e| e - m));
        let sections = swings().count() as f64;
        let swing = |c: usize| (swings().map(|swing| swing[c].powi(2)).sum::<f64>() / sections).sqrt();
        Some(Self {
            cases,
            swing: std::array::from_fn(swing),
            within_one: within(1.0),
            within_two: within(2.0),
            error_over_stated: mean(&|ratio| ratio.powi(2)).map(f64::sqrt),
        })
    }
}

/// The value that a share of the values does not exceed, by the nearest rank; `None` without values.
pub fn percentile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = (share * sorted.len() as f64).ceil().max(1.0) as usize;
    sorted.get(rank - 1).copied()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn errors_are_those_worked_by_hand() {
        let pairs = [
            (Vec3::new(3.0, 0.2, -5.0), Vec3::new(1.0, -0.2, -5.0)),
            (Vec3::new(0.0, 0.0, 10.0), Vec3::new(4.0, 0.0, 30.0)),
        ];
        let errors = Errors::of(&pairs);
        assert_eq!(errors.mae, [3.0, 0.2, 10.0]);
        for (rmse, square) in errors.rmse.iter().zip([10.0, 0.08, 200.0]) {
            assert!((rmse.powi(2) - square).abs() < 1e-12 * square, "{rmse}");
        }
        // 2 * 2 / 4 and 2 * 4 / 4; below the floor 2 * 0.4 / 1 and 0; 0 and 2 * 20 / 40
        assert_eq!(errors.smape, [150.0, 40.0, 50.0]);
    }

    #[test]
    fn deviations_that_are_half_the_errors_are_seen_as_such() {
        // the means are 2, -1 and 0.5, and z swings by 4
        let errors = vec![Vec3::new(2.0, -1.0, 4.5), Vec3::new(2.0, -1.0, -3.5)];
        let mut flows = vec![Flow { errors, stated: Vec3::new(1.0, 1.0, 1.0) }; 4];
        let at_rest = Flow { errors: vec![Vec3::new(9.0, 9.0, 9.0)], stated: Vec3::zeros() };
        flows.push(at_rest.clone());
        let calibration = Calibration::of(&flows, 4).unwrap();
        assert_eq!(calibration.error_over_stated, [2.0, 1.0, 0.5]);
        assert_eq!((calibration.within_one, calibration.within_two), ([0.0, 1.0, 1.0], [1.0, 1.0, 1.0]));
        assert_eq!((calibration.swing, calibration.cases), ([0.0, 0.0, 4.0], 4));
        assert_eq!(Calibration::of(&[at_rest], 1), None);
    }

    #[test]
    fn percentiles_are_values_that_occur() {
        let values: Vec<f64> = (1..=20).rev().map(f64::from).collect();
        assert_eq!((percentile(&values, 0.05), percentile(&values, 0.95)), (Some(1.0), Some(19.0)));
        assert_eq!(percentile(&[], 0.5), None);
    }
}
