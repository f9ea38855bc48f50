//! Roll decay of a ship model (KVLCC2, SSPA) beside inviscid simulations of the same tests.
//!
//! Source: Alexandersson, Kjellberg, "Prediction of roll motion using fully nonlinear potential flow and Ikeda's method"
//! (data under MIT). Files: `model_test_21338.csv` and `model_test_21337.csv` at rest, `model_test_21340.csv` at 15.5
//! knots full scale; `fnpf_kvlcc2_rolldecay_0kn.csv`, `fnpf_kvlcc2_rolldecay_15-5kn_const_large2.csv`.
//!
//! The literature says that the simulation lacks viscous roll damping: skin friction and the making of eddies, growing
//! with the roll rate and its square (Ikeda), and at speed lift damping, linear in the roll rate; all of it `mx`.
//!
//! The measured moment is the dry inertia times the measured roll acceleration, since weight has no moment about the
//! center of mass. The simulation is known as its own decay only; its moment is regressed on roll and roll rate,
//! `c1 phi + c2 phi^3 + c3 phi' + c4 abs(phi') phi'`, which fits it well, and evaluated at the measured motion.

use std::path::Path;

use nalgebra::{DMatrix, DVector};

use super::ImportError;
use wade_learn::signal::{SavitzkyGolay, UniformGrid, interpolate};
use wade_learn::trials::{self, Body, Manifest, Measured, Method, Table};

/// Ship over model.
const SCALE: f64 = 68.0;
/// Rate at which records are filtered, and one in how many of its samples is kept.
const RATE: f64 = 100.0;
const KEPT: usize = 5;
/// Window of the filter, half a second of a period of two and a half, and its order: a third-order one takes 3 % off the
/// curvature, as much as what is looked for.
const WINDOW: usize = 51;
const ORDER: usize = 4;
/// Time after the largest roll from which on nothing holds the model any more [s].
const LET_GO: f64 = 0.5;
/// Length of a decay that is used [s].
const LENGTH: f64 = 50.0;

/// File, its simulation, and model speed [m/s].
const TESTS: [(&str, &str, f64); 3] = [
    ("model_test_21337", "fnpf_kvlcc2_rolldecay_0kn", 0.0),
    ("model_test_21338", "fnpf_kvlcc2_rolldecay_0kn", 0.0),
    ("model_test_21340", "fnpf_kvlcc2_rolldecay_15-5kn_const_large2", 0.967),
];

/// Writes the trials of a folder of the source.
pub fn import(from: &Path, out: &Path) -> Result<(), ImportError> {
    let length = 320.0 / SCALE;
    let draft = 20.8 / SCALE;
    let volume = 312_653.0 / SCALE.powi(3);
    let radius = 23.2 / SCALE;
    let inertia = 0.995_380 * 1000.0 * volume * radius * radius;
    let mut trials = Vec::new();
    for (test, simulation, speed) in TESTS {
        let path = from.join(format!("{simulation}.csv"));
        let simulated = Table::read(&path, &["Time", "phi", "phi1d", "phi2d"], &[])?;
        let law = Law::fit(simulated.column("phi"), simulated.column("phi1d"), simulated.column("phi2d"));
        let path = from.join(format!("{test}.csv"));
        let measured = Table::read(&path, &["time", "phi"], &[])?;
        let decay = decay(measured.column("time"), measured.column("phi"))
            .map_err(|error| ImportError::Filter { path, error })?;
        let Decay { t, roll, rate, acceleration } = decay;
        let sim_mx =
            roll.iter().zip(&rate).map(|(&phi, &rate)| inertia * law.acceleration(phi, rate)).collect();
        let mx = acceleration.iter().map(|a| inertia * a).collect();
        let still = vec![0.0; t.len()];
        let columns = vec![
            ("t", t.clone()),
            ("vx", vec![speed; t.len()]),
            ("wx", rate),
            ("roll", roll),
            ("depth", vec![draft; t.len()]),
            ("alx", acceleration),
            ("aly", still.clone()),
            ("alz", still),
            ("mx", mx),
            ("sim_mx", sim_mx),
        ];
        trials.push((test.to_owned(), columns));
    }
    let manifest = Manifest {
        vehicle: "kvlcc2-model".to_owned(),
        fluid_density: Some(1000.0),
        mass: Some(1000.0 * volume * 0.995_380),
        measured: Measured {
            method: Some(Method::InverseDynamics),
            repeats: vec![vec![TESTS[0].0.to_owned(), TESTS[1].0.to_owned()]],
            ..Measured::default()
        },
        body: Some(Body {
            length,
            width: 58.0 / SCALE,
            draft,
            mass: 1000.0 * volume * 0.995_380,
            displaced_volume: volume,
            // kg over the keel, body origin at half the draft
            center_of_mass: [11.2672 / SCALE, 0.0, 18.6 / SCALE - 0.5 * draft],
        }),
        ..Manifest::default()
    };
    Ok(trials::write(out, &manifest, &trials)?)
}

/// Roll acceleration as a function of roll and roll rate.
struct Law([f64; 4]);

impl Law {
    fn terms(phi: f64, rate: f64) -> [f64; 4] {
        [phi, phi.powi(3), rate, rate * rate.abs()]
    }

    /// Least squares over a decay.
    fn fit(phi: &[f64], rate: &[f64], acceleration: &[f64]) -> Self {
        let rows = phi.len().min(rate.len());
        let x = DMatrix::from_fn(rows, 4, |i, j| Self::terms(phi[i], rate[i])[j]);
        let y = DVector::from_column_slice(&acceleration[..rows]);
        let normal = x.transpose() * &x;
        let solution = normal.cholesky().map(|normal| normal.solve(&(x.transpose() * y)));
        Self(solution.map_or([0.0; 4], |c| [c[0], c[1], c[2], c[3]]))
    }

    fn acceleration(&self, phi: f64, rate: f64) -> f64 {
        Self::terms(phi, rate).iter().zip(self.0).map(|(term, c)| term * c).sum()
    }
}

struct Decay {
    t: Vec<f64>,
    roll: Vec<f64>,
    rate: Vec<f64>,
    acceleration: Vec<f64>,
}

/// The free part of a record, filtered.
fn decay(times: &[f64], phi: &[f64]) -> Result<Decay, wade_learn::signal::FilterError> {
    let largest = (0..phi.len()).max_by(|&a, &b| phi[a].abs().total_cmp(&phi[b].abs())).unwrap_or(0);
    let start = times[largest] + LET_GO;
    let end = (start + LENGTH).min(times[times.len() - 1]);
    let grid = UniformGrid::within(times[0], times[times.len() - 1], RATE);
    let t = grid.times();
    let even = interpolate(times, phi, &t);
    let filter = SavitzkyGolay::new(WINDOW, ORDER)?;
    let [roll, rate, acceleration] = [
        filter.smooth(&even)?,
        filter.derivative(&even, 1, 1.0 / RATE)?,
        filter.derivative(&even, 2, 1.0 / RATE)?,
    ];
    let kept: Vec<usize> = (0..t.len()).filter(|&i| t[i] >= start && t[i] <= end).step_by(KEPT).collect();
    let of = |values: &[f64]| kept.iter().map(|&i| values[i]).collect::<Vec<f64>>();
    Ok(Decay { t: of(&t), roll: of(&roll), rate: of(&rate), acceleration: of(&acceleration) })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_decay_keeps_the_damping_that_it_has() {
        // phi'' = -w^2 phi - 2 d phi', solved exactly
        let (w, d) = (2.5, 0.05);
        let free = f64::sqrt(w * w - d * d);
        let times: Vec<f64> = (0..6000).map(|i| 0.01 * f64::from(i)).collect();
        let phi: Vec<f64> = times.iter().map(|t| 0.17 * (-d * t).exp() * (free * t).cos()).collect();
        let decay = decay(&times, &phi).unwrap();
        let law = Law::fit(&decay.roll, &decay.rate, &decay.acceleration);
        assert!(
            (law.0[0] / (-w * w) - 1.0).abs() < 0.005 && (law.0[2] / (-2.0 * d) - 1.0).abs() < 0.01,
            "{:?}",
            law.0
        );
        assert!(decay.t[0] >= LET_GO && decay.t.len() > 900);
    }
}
