//! A rotor with a vertical axis towed through a tank, against the same rotor without blades.
//!
//! Source: Bachant, Wosnik, Gunawan, Neary, 2016, doi:10.6084/m9.figshare.1373899 (CC-BY 4.0). Files: `Perf-*.csv`, each a
//! performance curve at one towing speed, and `Perf-1.0-no-blades.csv`.
//!
//! Against the drag without blades a force is missing that depends on the rotation: drag of the blades, which grows with
//! the ratio of tip speed to towing speed, and their torque about the axis. Of the library `wheel_paddle_thrust` and
//! `rotation` are nearest to it; neither is meant for a rotor across the flow.
//!
//! Each row of a curve is a steady mean and becomes one sample; samples are a minute apart, and accelerations are stated
//! as 0. The coefficients refer to diameter times height.

use std::path::Path;

use super::ImportError;
use wade_learn::signal::interpolate;
use wade_learn::trials::{self, Body, Columns, Manifest, Measured, Method, Table};

/// Diameter and height [m].
const DIAMETER: f64 = 1.075;
const HEIGHT: f64 = 0.8067;
/// Time between samples [s].
const APART: f64 = 60.0;
const WITHOUT_BLADES: &str = "Perf-1.0-no-blades.csv";
const COLUMNS: [&str; 5] = ["mean_tow_speed", "mean_tsr", "mean_cp", "mean_cd", "exp_unc_cd"];
const CURVES: [&str; 12] = [
    "Perf-0.4",
    "Perf-0.4-b",
    "Perf-0.6",
    "Perf-0.6-b",
    "Perf-0.8",
    "Perf-0.8-b",
    "Perf-1.0",
    "Perf-1.0-b",
    "Perf-1.2",
    "Perf-1.2-b",
    "Perf-tsr_0",
    "Perf-tsr_0-b",
];

/// Writes the curves that are in a folder of the source.
pub fn import(from: &Path, out: &Path) -> Result<(), ImportError> {
    let bare = sorted_by_ratio(&Table::read(&from.join(WITHOUT_BLADES), &COLUMNS, &[])?);
    let present = CURVES.into_iter().filter(|name| from.join(format!("{name}.csv")).exists());
    let (mut trials, mut errors): (Vec<Columns>, Vec<f64>) = (Vec::new(), Vec::new());
    for name in present {
        let table = Table::read(&from.join(format!("{name}.csv")), &COLUMNS, &[])?;
        trials.push((name.to_lowercase().replace('.', "-"), columns(&table, &bare, &mut errors)));
    }
    if trials.is_empty() {
        return Err(ImportError::Nothing { path: from.to_owned(), expected: "Perf-1.0.csv and the like" });
    }
    let names: Vec<String> = trials.iter().map(|(name, _)| name.clone()).collect();
    let repeats = names.iter().filter(|name| names.contains(&format!("{name}-b")));
    let mean_square = errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64;
    let manifest = Manifest {
        vehicle: "rm2-rotor".to_owned(),
        fluid_density: Some(1000.0),
        measured: Measured {
            method: Some(Method::LoadCell),
            repeats: repeats.map(|name| vec![name.clone(), format!("{name}-b")]).collect(),
            ..Measured::default()
        },
        sensor_noise: [("fx".to_owned(), mean_square.sqrt())].into(),
        body: Some(Body {
            length: DIAMETER,
            width: DIAMETER,
            draft: HEIGHT,
            // of the water that the swept cylinder holds: the rotor's own is not stated
            mass: 1000.0 * HEIGHT * std::f64::consts::FRAC_PI_4 * DIAMETER * DIAMETER,
            displaced_volume: HEIGHT * std::f64::consts::FRAC_PI_4 * DIAMETER * DIAMETER,
            center_of_mass: [0.0; 3],
        }),
        ..Manifest::default()
    };
    Ok(trials::write(out, &manifest, &trials)?)
}

/// Tip-speed ratio, power and drag coefficient, the ratio increasing.
fn sorted_by_ratio(table: &Table) -> [Vec<f64>; 3] {
    let [ratio, power, drag] = ["mean_tsr", "mean_cp", "mean_cd"].map(|name| table.column(name));
    let mut order: Vec<usize> = (0..ratio.len()).collect();
    order.sort_by(|&a, &b| ratio[a].total_cmp(&ratio[b]));
    [ratio, power, drag].map(|values| order.iter().map(|&i| values[i]).collect())
}

fn columns(table: &Table, bare: &[Vec<f64>; 3], errors: &mut Vec<f64>) -> Vec<(&'static str, Vec<f64>)> {
    let [speed, ratio, power, drag, error] = COLUMNS.map(|name| table.column(name));
    let [at, bare_power, bare_drag] = bare;
    let rows = speed.len();
    let force = |i: usize, cd: f64| -0.5 * 1000.0 * DIAMETER * HEIGHT * cd * speed[i] * speed[i];
    // power over angular velocity, taken out of the water by the rotor
    let turning = |i: usize| ratio[i] * speed[i] / (0.5 * DIAMETER);
    let torque =
        |i: usize, cp: f64| 0.5 * 1000.0 * DIAMETER * HEIGHT * cp * speed[i].powi(3) / turning(i).max(1e-6);
    // two standard deviations
    errors.extend((0..rows).map(|i| 0.5 * force(i, error[i])));
    let of = |value: &dyn Fn(usize) -> f64| (0..rows).map(value).collect::<Vec<f64>>();
    let simulated = |values: &[f64]| interpolate(at, values, ratio);
    let (sim_power, sim_drag) = (simulated(bare_power), simulated(bare_drag));
    let mut columns = vec![
        ("t", of(&|i| APART * i as f64)),
        ("vx", speed.to_vec()),
        ("depth", vec![HEIGHT; rows]),
        ("fx", of(&|i| force(i, drag[i]))),
        ("mz", of(&|i| torque(i, power[i]))),
        ("sim_fx", of(&|i| force(i, sim_drag[i]))),
        ("sim_mz", of(&|i| torque(i, sim_power[i]))),
    ];
    let still = ["ax", "ay", "az", "alx", "aly", "alz"];
    columns.extend(still.map(|name| (name, vec![0.0; rows])));
    columns.extend(wade_learn::trials::WHEELS.map(|name| (name, of(&turning))));
    columns
}
