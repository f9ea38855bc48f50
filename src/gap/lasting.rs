//! Structure that few trials hold, or that no function of the state predicts: what of the gap hangs together for longer
//! than any noise, trial by trial.
//!
//! Noise has forgotten itself after half a second. A sum of the products of rows `K` lags apart then scatters about 0; for
//! a series whose noise has the autocorrelation `rho`, with the variance `n K (c_0 sum rho)^2` (Bartlett, J. Roy. Stat.
//! Soc. Suppl. 1946). Each trial is judged by itself, so that one of many is enough, and each window of lags, so that what
//! swings to and fro does not cancel.

use nalgebra::DVector;

use super::design::Design;
use super::robust::strided;
use super::statistics::median;

/// Windows of bins apart.
const WINDOWS: [[usize; 2]; 3] = [[5, 9], [10, 14], [15, 19]];
const FIRST: usize = WINDOWS[0][0];
const LAST: usize = WINDOWS[2][1];

/// What lasts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lasting {
    /// Deviate of the trial in which it stands out most.
    pub deviate: f64,
    /// Its root mean square in that trial, in noises of a bin.
    pub size: f64,
    /// Its sum of squares over all trials, a row each, in the window where it is largest: what swings is against itself in some.
    pub energy: f64,
}

/// Sums of products of one component of one trial, by lag.
struct Products {
    lags: [f64; LAST + 1],
    count: f64,
}

/// What lasts of a target that has the rows of the design.
pub(super) fn lasting(design: &Design, target: &DVector<f64>) -> Lasting {
    let width = design.rows.width;
    let trials: Vec<Vec<Products>> = design
        .rows
        .of_trial
        .iter()
        .map(|rows| {
            let rows = &target.as_slice()[rows.clone()];
            (0..width).map(|component| products(rows, component, width)).collect()
        })
        .collect();
    let memory = memory(&trials);
    let mut found = Lasting { deviate: 0.0, size: 0.0, energy: 0.0 };
    let mut energies = [0.0; WINDOWS.len()];
    for trial in &trials {
        for ([first, last], energy) in WINDOWS.into_iter().zip(&mut energies) {
            let of = in_window(trial, first, last, memory);
            *energy += of.energy;
            if of.deviate > found.deviate {
                found = of;
            }
        }
    }
    Lasting { energy: energies.into_iter().map(f64::abs).fold(0.0, f64::max), ..found }
}

/// What lasts of a trial over a window of lags.
fn in_window(trial: &[Products], first: usize, last: usize, memory: f64) -> Lasting {
    let (mut sum, mut variance, mut pairs, mut rows) = (0.0, 0.0, 0.0, 0.0);
    for products in trial {
        let own: f64 = (first..=last).map(|lag| (products.count - lag as f64).max(0.0)).sum();
        let power = products.lags[0] / products.count.max(1.0);
        sum += products.lags[first..=last].iter().sum::<f64>();
        variance += own * (power * memory).powi(2);
        (pairs, rows) = (pairs + own, rows + products.count);
    }
    let mean = sum / f64::max(pairs, 1.0);
    let deviate = sum.abs() / variance.sqrt().max(f64::MIN_POSITIVE);
    Lasting { deviate, size: mean.abs().sqrt(), energy: mean * rows }
}

fn products(rows: &[f64], component: usize, width: usize) -> Products {
    let values = strided(rows, component, width);
    let of = |lag: usize| values.iter().zip(values.iter().skip(lag)).map(|(a, b)| a * b).sum();
    Products { lags: std::array::from_fn(of), count: values.len() as f64 }
}

/// `sum rho` over the lags that noise may reach, of the middle one of all trials and components.
fn memory(trials: &[Vec<Products>]) -> f64 {
    let of = |lag: usize| {
        let share = |p: &Products| p.lags[lag] / p.lags[0].max(f64::MIN_POSITIVE);
        median(&mut trials.iter().flatten().map(share).collect::<Vec<_>>()).max(0.0)
    };
    1.0 + 2.0 * (1..FIRST).map(of).sum::<f64>()
}
