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
    /// In the trial in which it stands out most.
    pub most: Size,
    /// In all trials together, in the window in which it stands out most.
    pub together: Size,
    /// Its sum of squares over all trials, a row each, in the window where it is largest: what swings is against itself in some.
    pub energy: f64,
}

/// How large what lasts is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Size {
    /// Deviate.
    pub deviate: f64,
    /// Root mean square, in noises of a bin.
    pub rms: f64,
}

/// Sums of products of one component of one trial, by lag.
struct Products {
    lags: [f64; LAST + 1],
    count: f64,
}

/// What lasts of a target that has the rows of the design.
pub(super) fn lasting(design: &Design, target: &DVector<f64>) -> Lasting {
    let trials = products_of_trials(design, target);
    let memory = memory(&trials);
    let mut most = Size { deviate: 0.0, rms: 0.0 };
    let (mut together, mut energy) = (most, 0.0_f64);
    let larger = |a: Size, b: Size| if b.deviate > a.deviate { b } else { a };
    for [first, last] in WINDOWS {
        let sums: Vec<Window> = trials.iter().map(|trial| in_window(trial, first, last, memory)).collect();
        most = sums.iter().map(Window::size).fold(most, larger);
        together = larger(together, sums.iter().fold(Window::default(), Window::and).size());
        energy = energy.max(sums.iter().map(Window::energy).sum::<f64>().abs());
    }
    Lasting { most, together, energy }
}

/// Sums of products over a window of lags: their sum and its variance where they are noise, pairs, rows.
#[derive(Debug, Default)]
struct Window {
    sum: f64,
    variance: f64,
    pairs: f64,
    rows: f64,
}

impl Window {
    fn and(self, other: &Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            variance: self.variance + other.variance,
            pairs: self.pairs + other.pairs,
            rows: self.rows + other.rows,
        }
    }

    fn mean(&self) -> f64 {
        self.sum / f64::max(self.pairs, 1.0)
    }

    fn size(&self) -> Size {
        let deviate = self.sum.abs() / self.variance.sqrt().max(f64::MIN_POSITIVE);
        Size { deviate, rms: self.mean().abs().sqrt() }
    }

    fn energy(&self) -> f64 {
        self.mean() * self.rows
    }
}

/// What a trial holds in a window of lags.
fn in_window(trial: &[Products], first: usize, last: usize, memory: f64) -> Window {
    let mut window = Window::default();
    for products in trial {
        let own: f64 = (first..=last).map(|lag| (products.count - lag as f64).max(0.0)).sum();
        let power = products.lags[0] / products.count.max(1.0);
        window.sum += products.lags[first..=last].iter().sum::<f64>();
        window.variance += own * (power * memory).powi(2);
        window.pairs += own;
        window.rows += products.count;
    }
    window
}

fn products(rows: &[f64], component: usize, width: usize) -> Products {
    let values = strided(rows, component, width);
    let of = |lag: usize| values.iter().zip(values.iter().skip(lag)).map(|(a, b)| a * b).sum();
    Products { lags: std::array::from_fn(of), count: values.len() as f64 }
}

/// By how much rows count for less than independent ones: `sum rho` of a residual that has the rows of the design.
pub(super) fn memory_of(design: &Design, residual: &DVector<f64>) -> f64 {
    memory(&products_of_trials(design, residual))
}

/// Products of each component of each trial.
fn products_of_trials(design: &Design, target: &DVector<f64>) -> Vec<Vec<Products>> {
    let width = design.rows.width;
    let of = |rows: &std::ops::Range<usize>| {
        let rows = &target.as_slice()[rows.clone()];
        (0..width).map(|component| products(rows, component, width)).collect()
    };
    design.rows.of_trial.iter().map(of).collect()
}

/// `sum rho` over the lags that noise may reach, of the middle one of all trials and components.
fn memory(trials: &[Vec<Products>]) -> f64 {
    let of = |lag: usize| {
        let share = |p: &Products| p.lags[lag] / p.lags[0].max(f64::MIN_POSITIVE);
        median(&mut trials.iter().flatten().map(share).collect::<Vec<_>>()).max(0.0)
    };
    1.0 + 2.0 * (1..FIRST).map(of).sum::<f64>()
}
