//! Trials as files.

use std::fs;
use std::io;
use std::path::Path;

use wade_core::frame::Vec3;
use wade_learn::trials::{MANIFEST_FILE, Trial, Trials, WHEELS, WRENCH, csv_text};

const SIMULATED: [&str; 6] = ["sim_fx", "sim_fy", "sim_fz", "sim_mx", "sim_my", "sim_mz"];

/// Writes `trials.toml` and a CSV file a trial to a folder, which is made.
pub fn write(folder: &Path, trials: &Trials) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    fs::write(folder.join(MANIFEST_FILE), trials.manifest.to_toml())?;
    for trial in &trials.trials {
        fs::write(folder.join(format!("{}.csv", trial.name)), csv(trial))?;
    }
    Ok(())
}

fn csv(trial: &Trial) -> String {
    let axis = |vectors: &[Vec3], axis: usize| -> Vec<f64> { vectors.iter().map(|v| v[axis]).collect() };
    let mut columns: Vec<(&str, Vec<f64>)> = vec![("t", trial.t.clone())];
    let vectors = |names: [&'static str; 3], values: &[Vec3]| {
        names.into_iter().enumerate().map(|(i, name)| (name, axis(values, i))).collect::<Vec<_>>()
    };
    columns.extend(vectors(["vx", "vy", "vz"], &trial.velocity));
    columns.extend(vectors(["wx", "wy", "wz"], &trial.angular_velocity));
    columns.extend([
        ("roll", trial.roll.clone()),
        ("pitch", trial.pitch.clone()),
        ("yaw", trial.yaw.clone()),
    ]);
    let (name, values) = trial.still_water.column();
    columns.push((name, values.clone()));
    let bed = [("bed_clearance", &trial.bed_clearance), ("bed", &trial.bed)];
    columns.extend(bed.into_iter().filter_map(|(name, values)| Some((name, values.clone()?))));
    if trial.acceleration_is_measured {
        columns.extend(vectors(["ax", "ay", "az"], &trial.acceleration));
        columns.extend(vectors(["alx", "aly", "alz"], &trial.angular_acceleration));
    }
    let optional = [(WHEELS.as_slice(), trial.wheel_speeds.as_slice()), (&WRENCH, &trial.measured)];
    let optional = optional.into_iter().chain([(SIMULATED.as_slice(), trial.simulated.as_slice())]);
    for (names, values) in optional {
        for (name, values) in names.iter().zip(values) {
            columns.extend(values.clone().map(|values| (*name, values)));
        }
    }
    let stated = trial.other_forces.iter().chain(&trial.known_loads);
    columns.extend(stated.map(|(name, values)| (name.as_str(), values.clone())));
    let columns: Vec<(&str, &[f64])> = columns.iter().map(|(name, v)| (*name, v.as_slice())).collect();
    csv_text(&columns)
}
